//! Causes that set in in the course of logs, through the command: what is written declares the time where a cause follows it.

use std::path::Path;
use std::process::Command;

use coldplate_base::random::Random;
use serde_json::Value;

/// A winding and a housing in a room.
const LUMPED: &str = r#"
name = "Winding and housing"
[node.room]
temperature = "ambient_temperature"
[node.winding]
capacity = "300 J/K"
[node.housing]
capacity = "900 J/K"
[contact.slot]
between = ["winding", "housing"]
total_conductance = "2 W/K"
[contact.feet]
between = ["housing", "room"]
total_conductance = "1.5 W/K"
[source.winding]
in = "winding"
power = "0.02 * motor_speed_rpm"
[sensor.winding]
node = "winding"
[sensor.housing]
node = "housing"
"#;

fn coldplate(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_coldplate")).args(arguments).arg("--quiet").output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Through the command: logs of a machine whose file knows no time, made by `simulate` with lines added. The file that comes out declares
/// the time where a cause follows it, and predicts the logs.
fn through_the_command(name: &str, lines: &str) -> (Value, String, f64) {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("diagnose-over-time-{name}"));
    let _ = std::fs::remove_dir_all(&out);
    std::fs::create_dir_all(&out).unwrap();
    let path = |file: &str| out.join(file).to_str().unwrap().to_string();
    let write = |file: &str, text: &str| {
        std::fs::write(path(file), text).unwrap();
        path(file)
    };
    let given = write("given.toml", LUMPED);
    let time = "[variables]\ntime = { unit = \"s\", default = \"0 s\" }\n";
    let truth = write("truth.toml", &LUMPED.replacen("[node.room]", &format!("{time}{lines}\n[node.room]"), 1));
    let mut random = Random::new(7);
    let head = "coolant_flow [L/min], coolant_temperature [degC], motor_speed [rpm], ambient_temperature [degC]";
    let mut table = format!("test, time [s], {head}, winding [degC], housing [degC]\n");
    for (test, before, after, turns) in [("a", 500.0, 2500.0, 1000.0), ("b", 2500.0, 1200.0, 3600.0), ("c", 1800.0, 1800.0, 7200.0)] {
        let speed = |t: f64| if t <= turns { before } else { after };
        let rows: Vec<f64> = (0..=120).map(|i| 60.0 * f64::from(i)).collect();
        let conditions = |t: f64| format!("4, 20, {}, 22", speed(t));
        let schedule: String = rows.iter().map(|t| format!("{t}, {}\n", conditions(*t))).collect();
        let schedule = write(&format!("{test}.csv"), &format!("time [s], {head}\n{schedule}"));
        let result = path(&format!("{test}_out.csv"));
        coldplate(&["simulate", &truth, &schedule, "--every", "60 s", "--out", &result]);
        let text = std::fs::read_to_string(&result).unwrap();
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let names: Vec<String> = lines.next().unwrap().split(',').map(|n| n.trim().to_string()).collect();
        let at = |name: &str| names.iter().position(|n| n.starts_with(name)).unwrap();
        for line in lines {
            let cells: Vec<f64> = line.split(',').map(|c| c.trim().parse().unwrap_or(f64::NAN)).collect();
            let time = cells[at("time")];
            let read: Vec<f64> = ["winding", "housing"].iter().map(|s| cells[at(s)] + 0.03 * random.normal()).collect();
            table += &format!("{test}, {time}, {}, {:.3}, {:.3}\n", conditions(time), read[0], read[1]);
        }
    }
    let data = write("data.csv", &table);
    write("data.toml", "kind = \"standard deviations\"\nnoise = \"0.03 K\"\nbias = \"0.03 K\"\n");
    let extended = path("extended.toml");
    let found = coldplate(&["diagnose", &given, &data, "--out", &extended, "--json"]);
    let found: Value = serde_json::from_str(&found).unwrap();
    let predicted: Value = serde_json::from_str(&coldplate(&["predict", &extended, &data, "--json"])).unwrap();
    println!("{} {}", found["headline"], found["rungs"][0]["causes"]);
    (found, std::fs::read_to_string(&extended).unwrap(), predicted["all"]["rmse_K"].as_f64().unwrap())
}

#[test]
fn a_leak_that_sets_in_through_the_command() {
    let leak = "[node.cold]\ntemperature = \"ambient_temperature\"\n[contact.hose]\nbetween = [\"winding\", \"cold\"]\n\
                total_conductance = \"0.1 W/K\"\nfactor = \"min(1, max(0, (time_s - 2400) / 10))\"\n";
    let (found, text, error) = through_the_command("leak", leak);
    let cause = &found["rungs"][0]["causes"][0];
    assert_eq!((&cause["kind"], &cause["place"]), (&"leak to the surroundings".into(), &"winding".into()));
    let [low, high] = ["low", "high"].map(|end| found["causes"][0]["parameters"]["time"][end].as_f64().unwrap());
    assert!(low < 2410.0 && 2400.0 < high && high - low < 300.0, "{low} {high}");
    assert!(text.contains("[variables.time]") && text.contains("time_s"), "{text}");
    assert!(error < 0.06, "{error}");
}

/// Three times as much bends, and moves the machine by kelvins: its slope at nothing explains less than others do.
#[test]
fn a_large_leak_that_sets_in_through_the_command() {
    let leak = "[node.cold]\ntemperature = \"ambient_temperature\"\n[contact.hose]\nbetween = [\"winding\", \"cold\"]\n\
                total_conductance = \"0.3 W/K\"\nfactor = \"min(1, max(0, (time_s - 2400) / 10))\"\n";
    let (found, _, error) = through_the_command("large-leak", leak);
    let cause = &found["rungs"][0]["causes"][0];
    assert_eq!((&cause["kind"], &cause["place"]), (&"leak to the surroundings".into(), &"winding".into()));
    let conductance = &found["causes"][0]["parameters"]["conductance"];
    let [low, high] = ["low", "high"].map(|end| conductance[end].as_f64().unwrap());
    assert!(low < 0.3 && 0.3 < high, "{conductance}");
    assert!(error < 0.06, "{error}");
}

#[test]
fn a_constant_cause_needs_no_time() {
    let (found, text, error) = through_the_command("heat", "[source.hidden]\nin = \"housing\"\npower = \"5 W\"\n");
    let cause = &found["rungs"][0]["causes"][0];
    assert_eq!((&cause["kind"], &cause["place"]), (&"heat source".into(), &"housing".into()));
    assert!(!text.contains("time"), "{text}");
    assert!(error < 0.06, "{error}");
}
