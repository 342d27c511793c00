//! Progress on standard error: nothing where that is no terminal, lines where they were asked for.

use super::{CONDITION, coldplate, message, root, status};

#[test]
fn progress_comes_where_it_is_asked_for() {
    let solve = [&["solve", "machines/rig.toml", "--cells", "500"], &CONDITION[..]].concat();
    let silent = coldplate(&solve);
    assert!(status(&silent) == 0 && !message(&silent).contains("unknowns"), "{}", message(&silent));
    let heard = coldplate(&[&solve[..], &["--progress"]].concat());
    for word in ["meshing", "unknowns: setting up", "Newton step 1 moved", "were open"] {
        assert!(message(&heard).contains(word), "{word}: {}", message(&heard));
    }
    let both = coldplate(&[&solve[..], &["--progress", "--quiet"]].concat());
    assert!(status(&both) == 2 && message(&both).contains("--quiet"), "{}", message(&both));

    let free = ["identify", "machines/rig.toml", "--cells", "300", "--free", "contact.motor.conductance", "--progress", "--starts", "1"];
    let heard = coldplate(&free);
    for word in ["start 1 of 1", "prediction 2: misfit", "profile likelihoods", "further tests"] {
        assert!(message(&heard).contains(word), "{word}: {}", message(&heard));
    }
    let table = root().join(env!("CARGO_TARGET_TMPDIR")).join("progress.csv");
    let rows: String = (0..12).map(|i| format!("{i},{}\n", 20.0 + f64::from(i * i))).collect();
    std::fs::write(&table, format!("motor_speed [rpm],motor [degC]\n{rows}")).unwrap();
    let heard = coldplate(&["fit", table.to_str().unwrap(), "--progress"]);
    for word in ["12 rows: polynomials", "12 rows: radial functions"] {
        assert!(message(&heard).contains(word), "{word}: {}", message(&heard));
    }
}
