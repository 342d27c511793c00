//! Limits of an answer: each is said in words, and the part that holds is kept.

use super::{json, message, status};
use crate::common::{coldplate, scratch, write};

/// Two nodes that store no heat, watched on one side of their difference.
const NODES: &str = r#"
name = "two nodes"
[variables]
heater = { unit = "W", default = "20 W", range = ["0 W", "60 W"] }
ambient_temperature = { default = "22 degC", range = ["15 degC", "30 degC"] }
[node.block]
[node.lid]
[node.room]
temperature = "ambient_temperature"
[contact.foot]
between = ["block", "room"]
total_conductance = "1 W/K"
[contact.lid]
between = ["block", "lid"]
total_conductance = "1 W/K"
[source.heater]
in = "lid"
power = "heater_W"
[sensor.block]
node = "block"
[sensor.lid]
node = "lid"
[limit.apart]
between = ["lid", "block"]
difference = "30 K"
"#;

/// A machine that stores no heat is in balance at every instant, as a reduced model too.
#[test]
fn a_machine_that_stores_no_heat_is_reduced_over_time() {
    let folder = scratch("storeless");
    let machine = write(&folder, "nodes.toml", NODES);
    let file = folder.join("nodes.cpr").to_str().unwrap().to_string();
    let made = coldplate(&["reduce", &machine, "--vary", "all", "--histories", "2", "--out", &file]);
    assert_eq!(status(&made), 0, "{}", message(&made));
    // 20 W through 1 and 1 W/K.
    let answer = json(&coldplate(&["solve", &file, "--json"]));
    assert!((answer["sensors"]["lid"].as_f64().unwrap() - 62.0).abs() < 1e-3, "{answer}");
    let schedule = write(&folder, "s.csv", "time [s],heater [W]\n0,20\n60,20\n");
    let run = json(&coldplate(&["simulate", &file, &schedule, "--json", "--quiet"]));
    let lid = run["sensors"]["lid"]["end_degC"].as_f64().unwrap();
    assert!((lid - 62.0).abs() < 5e-3, "{run}");
}

#[test]
fn check_says_which_side_of_a_difference_is_watched() {
    let folder = scratch("one-sided");
    let machine = write(&folder, "nodes.toml", NODES);
    let text = |machine: &str| String::from_utf8_lossy(&coldplate(&["check", machine]).stdout).into_owned();
    let said = text(&machine);
    assert!(said.contains("limit 'apart' watches 'lid' above 'block' alone"), "{said}");
    let offered = "sensors = [\"lid\", \"block\"] with spread";
    assert!(said.contains(offered), "{said}");
    let both = NODES.replace("between = [\"lid\", \"block\"]\ndifference", "sensors = [\"lid\", \"block\"]\nspread");
    assert!(both != NODES && !text(&write(&folder, "both.toml", both)).contains("alone"));
}

/// Cells that the address space has no room for are refused before they are made, in every command that makes a mesh.
#[cfg(target_os = "linux")]
#[test]
fn too_little_memory_is_a_message() {
    let folder = scratch("memory");
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,500\n60,500\n");
    let [out, model] = ["out", "m.cpr"].map(|name| folder.join(name).to_str().unwrap().to_string());
    let (machine, data) = ("examples/tutorial/machine.toml", "examples/tutorial/readings.csv");
    let commands: [&[&str]; 7] = [
        &["solve", machine],
        &["simulate", machine, &schedule],
        &["sweep", "examples/tutorial/sweep.toml", "--out", &out],
        &["reduce", machine, "--out", &model],
        &["identify", machine, data, "--free", "contact.motor_foot.conductance"],
        &["predict", machine, data],
        &["diagnose", machine, data],
    ];
    for command in commands {
        let mut limited = std::process::Command::new("sh");
        limited.args(["-c", "ulimit -v 300000; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_coldplate")]).args(command);
        let ended = limited.args(["--cells", "5000000"]).current_dir(super::root()).output().unwrap();
        let told = message(&ended);
        assert!(status(&ended) == 2 && told.contains("GB of memory") && told.contains("ask for at most"), "{command:?}: {told}");
        assert!(!told.contains("panicked"), "{command:?}: {told}");
    }
}
