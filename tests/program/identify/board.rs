//! Two heaters on a board, measured: what plain least squares and what is learnt of the model's error make of days not used.

use std::fmt::Write as _;
use std::path::Path;

use super::scratch;
use crate::common::{coldplate, json, write};

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
[contact.coupling]
between = ["heater 1", "heater 2"]
total_conductance = "0.01 W/K"
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
const OF_THE_BOARD: [&str; 5] = [
    "contact.heater 1 to air.total_conductance",
    "contact.heater 2 to air.total_conductance",
    "contact.coupling.total_conductance",
    "node.heater 1.capacity",
    "sensor.T1.lag",
];

/// The measured runs as one table; at first everything is at the room's temperature. 0.032 W per per cent of a drive.
fn runs(folder: &Path, tests: &[&str]) -> String {
    let mut text = "test,time [s],heater_1 [W],heater_2 [W],ambient_temperature [degC],T1 [degC],T2 [degC]\n".to_string();
    for test in tests {
        let file = std::fs::read_to_string(folder.join(format!("{test}.csv"))).unwrap();
        let rows: Vec<Vec<f64>> = file.lines().skip(1).map(|l| l.split(',').map(|c| c.trim().parse().unwrap()).collect()).collect();
        let room = 0.5 * (rows[0][3] + rows[0][4]);
        for r in &rows {
            writeln!(text, "{test},{},{},{},{room},{},{}", r[0], 0.032 * r[1], 0.032 * r[2], r[3], r[4]).unwrap();
        }
    }
    text
}

/// Two heaters on a board: whatever noise is stated, days that were not used are predicted as well as by plain least squares.
#[test]
fn five_numbers_of_a_board_whatever_noise_is_stated() {
    let measured = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/measured/tclab");
    if !measured.is_dir() {
        println!("SKIPPED: the measurements are not at {}", measured.display());
        return;
    }
    let folder = scratch("board");
    let board = write(&folder, "board.toml", BOARD);
    let days = runs(&measured, &["step_1", "sine5_1", "sine2_1", "sine50_1"]);
    let unseen = write(&folder, "unseen.csv", runs(&measured, &["step_2", "sine5_2"]));
    let fit = |name: &str, noise: &str, bias: &str, room: &str| {
        let data = write(&folder, &format!("{name}.csv"), &days);
        let stated = format!("noise = \"{noise} K\"\nbias = \"{bias} K\"\n[condition]\nambient_temperature = \"{room} K\"\n");
        write(&folder, &format!("{name}.toml"), format!("kind = \"limits\"\n{stated}"));
        let out = folder.join(format!("found_{name}.toml"));
        let out = out.to_str().unwrap();
        let free: Vec<&str> = OF_THE_BOARD.iter().flat_map(|key| ["--free", key]).collect();
        let args = [&["identify", &board, &data, "--from", "readings", "--brief", "--json", "--out", out], &free[..]].concat();
        let found = json(&coldplate(&args));
        let rmse = json(&coldplate(&["predict", out, &unseen, "--from", "readings", "--json"]))["all"]["rmse_K"].as_f64().unwrap();
        (found, rmse)
    };
    let (_, plain) = fit("plain", "6", "0", "0");
    for limit in ["0.1", "0.35", "2"] {
        let (found, rmse) = fit(limit, limit, "0.1", "0.5");
        println!("{limit} K: unseen {rmse:.3} K, plain least squares {plain:.3} K; {}", found["model_error"]["text"]);
        assert!(rmse < 1.15 * plain, "{limit}: {rmse} {plain}");
        assert!(found["model_error"]["text"].as_str().unwrap().contains("from test to test"), "{}", found["model_error"]);
        let coupling = &found["parameters"]["contact.coupling.total_conductance"];
        let [low, high] = ["low", "high"].map(|k| coupling[k].as_f64().unwrap());
        assert!(low < 0.0141 && high > 0.012, "{coupling}");
        for (sensor, e) in found["sensor_errors"].as_object().unwrap() {
            let [value, stated] = ["value_K", "stated_K"].map(|k| e[k].as_f64().unwrap());
            assert!(value.abs() < 2.0 * stated, "{sensor}: {e}");
        }
    }
}
