//! Two heaters on a board, measured: from a machine file without their coupling, whatever noise is stated, the coupling is named
//! and days that were not used are predicted.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// W per per cent of a heater's drive, as documented.
const WATTS: f64 = 0.032;
/// W/K, documented.
const COUPLING: std::ops::Range<f64> = 0.012..0.0141;
/// What a least-squares fit of five parameters with its own model error leaves on the unseen days, K, by stated limit of the noise.
const REFERENCE: [(f64, f64); 3] = [(0.1, 0.96), (0.35, 0.92), (2.0, 1.00)];

const BOARD: &str = r#"
name = "Two heaters on a board"
[variables]
heater_1 = { unit = "W", default = "0 W" }
heater_2 = { unit = "W", default = "0 W" }
ambient_temperature = "22 degC"
[node."heater 1"]
capacity = "6.5 J/K"
[node."heater 2"]
capacity = "6.5 J/K"
[node.room]
temperature = "ambient_temperature"
[contact."heater 1 to air"]
between = ["heater 1", "room"]
total_conductance = "0.035 W/K"
[contact."heater 2 to air"]
between = ["heater 2", "room"]
total_conductance = "0.03 W/K"
[source."heater 1"]
in = "heater 1"
power = "heater_1_W"
[source."heater 2"]
in = "heater 2"
power = "heater_2_W"
[sensor.T1]
node = "heater 1"
lag = "22 s"
[sensor.T2]
node = "heater 2"
lag = "22 s"
"#;

/// The measured runs as one table; at first everything is at the room's temperature.
fn table(folder: &Path, tests: &[&str]) -> String {
    let mut text = "test,time [s],heater_1 [W],heater_2 [W],ambient_temperature [degC],T1 [degC],T2 [degC]\n".to_string();
    for test in tests {
        let file = std::fs::read_to_string(folder.join(format!("{test}.csv"))).unwrap();
        let rows: Vec<Vec<f64>> = file.lines().skip(1).map(|l| l.split(',').map(|c| c.trim().parse().unwrap()).collect()).collect();
        let room = 0.5 * (rows[0][3] + rows[0][4]);
        for r in &rows {
            writeln!(text, "{test},{},{},{},{room},{},{}", r[0], WATTS * r[1], WATTS * r[2], r[3], r[4]).unwrap();
        }
    }
    text
}

fn json(arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_coldplate")).args(arguments).args(["--json", "--quiet"]).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_coupling_whatever_noise_is_stated() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/measured/tclab");
    if !folder.is_dir() {
        println!("SKIPPED: the measurements are not at {}", folder.display());
        return;
    }
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("diagnose-board");
    let _ = std::fs::remove_dir_all(&out);
    std::fs::create_dir_all(&out).unwrap();
    let write = |name: &str, text: &str| -> String {
        let path = out.join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_string()
    };
    let board = write("board.toml", BOARD);
    let days = table(&folder, &["step_1", "sine5_1", "sine2_1", "sine50_1"]);
    let unseen = write("unseen.csv", &table(&folder, &["step_2", "sine5_2"]));
    let error = |machine: &str| json(&["predict", machine, &unseen, "--from", "readings"])["all"]["rmse_K"].as_f64().unwrap();
    let before = error(&board);
    for (limit, reference) in REFERENCE {
        let data = write(&format!("days_{limit}.csv"), &days);
        let stated = format!("kind = \"limits\"\nnoise = \"{limit} K\"\nbias = \"0.1 K\"\n[condition]\nambient_temperature = \"0.5 K\"\n");
        write(&format!("days_{limit}.toml"), &stated);
        let extended = out.join(format!("extended_{limit}.toml"));
        let extended = extended.to_str().unwrap();
        let found = json(&["diagnose", &board, &data, "--from", "readings", "--out", extended]);
        let first = &found["rungs"][0]["causes"][0];
        let [low, value, high] = ["low", "value", "high"].map(|k| first["amplitude"][k].as_f64().unwrap());
        let after = error(extended);
        println!(
            "{limit} K: {} {value:.4} ({low:.4} to {high:.4}) W/K; unseen {before:.2} -> {after:.2} K, {} s",
            found["headline"], found["seconds"]
        );
        assert_eq!(found["verdict"], "explained");
        assert_eq!((&first["kind"], &first["place"]), (&"conductive link".into(), &"heater 1 - heater 2".into()));
        assert!(low < COUPLING.end && high > COUPLING.start, "{low} to {high} W/K");
        assert!(after < 1.15 * reference, "{after} K");
        assert!(found["gain"]["low"].as_f64().unwrap() > 0.0);
    }
}
