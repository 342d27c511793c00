//! Bands beside published readings that took no part in making them.

use std::process::Command;

use coldplate_jobs::measured::check;
use coldplate_solve::study::Study;

/// Both conductances of the rig are found at working condition 1; its bands at working condition 2 hold the readings there.
#[test]
fn the_rig_at_a_condition_it_was_not_identified_at() {
    let folder = std::env::temp_dir().join(format!("coldplate-rig-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("rig.toml");
    let found = Command::new(env!("CARGO_BIN_EXE_coldplate"))
        .current_dir(coldplate_testing::root())
        .args(["identify", "machines/rig.toml", "data/rig.csv", "--use", "working condition 1", "--quiet"])
        .args(["--free", "contact.motor.conductance", "--free", "contact.reducer.conductance"])
        .arg("--out")
        .arg(&file)
        .output()
        .unwrap();
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    let study = Study::read(&file, &[], None).unwrap();
    let checked = check(&study).unwrap();
    let second = checked.iter().find(|own| own.name == "working condition 2").unwrap();
    for row in &second.rows {
        let band = row.band;
        println!("{}: measured {:.2}, predicted {:.2} +- {band:.2} degC", row.name, row.measured, row.predicted);
        assert!(row.is_inside(), "{row:?}");
        // A band that holds anything says nothing: the shells stand 5 to 8 K over the water.
        assert!(band < 1.8, "{row:?}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}
