//! The command: text, JSON, exit statuses.

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

/// The path of a machine of the repository.
fn path(name: &str) -> PathBuf {
    coldplate_testing::root().join("machines").join(format!("{name}.toml"))
}

fn coldplate(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_coldplate"))
        .arg("sensitivity")
        .arg(path("slab"))
        .args(["--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC", "--motor-speed", "1000 rpm"])
        .args(["--ambient-temperature", "23 degC", "--cells", "800"])
        .args(arguments)
        .output()
        .unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = coldplate(&[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The block's temperature as `solve` prints it.
fn block(arguments: &[&str]) -> f64 {
    let condition = ["--coolant-temperature", "20 degC", "--motor-speed", "1000 rpm", "--ambient-temperature", "23 degC", "--cells", "800"];
    let output = Command::new(env!("CARGO_BIN_EXE_coldplate"))
        .arg("solve")
        .arg(path("slab"))
        .args(condition)
        .args(arguments)
        .arg("--json")
        .output()
        .unwrap();
    serde_json::from_slice::<Value>(&output.stdout).unwrap()["sensors"]["block"].as_f64().unwrap()
}

/// The table holds what two runs of `solve` differ by, in the unit of the file.
#[test]
fn slopes_are_those_of_solve() {
    let found = json(&["--to", "contact.joint.conductance", "--to", "coolant_flow"]);
    let slopes = &found["readings"]["block"]["slopes"];
    let contact = |h: &str| block(&["--coolant-flow", "2 L/min", "--set", &format!("contact.joint.conductance={h} W/(m2 K)")]);
    let difference = (contact("1010") - contact("990")) / 20.0;
    let slope = slopes["contact.joint.conductance"]["K_per_unit"].as_f64().unwrap();
    assert!((slope / difference - 1.0).abs() < 2e-4, "{slope} {difference}");
    let percent = slopes["contact.joint.conductance"]["K_per_percent"].as_f64().unwrap();
    assert!((percent - 10.0 * slope).abs() < 1e-12);
    let difference = (block(&["--coolant-flow", "2.02 L/min"]) - block(&["--coolant-flow", "1.98 L/min"])) / 0.04;
    let slope = slopes["coolant_flow"]["K_per_unit"].as_f64().unwrap();
    assert!((slope / difference - 1.0).abs() < 2e-4, "{slope} {difference}");
    assert_eq!(found["parameters"]["coolant_flow"]["unit"], "L/min");
    assert!((found["parameters"]["coolant_flow"]["value"].as_f64().unwrap() - 2.0).abs() < 1e-12);
}

#[test]
fn the_usual_parameters_and_every_sensor() {
    let found = json(&[]);
    let parameters: Vec<&String> = found["parameters"].as_object().unwrap().keys().collect();
    for name in [
        "coolant_flow",
        "coolant_temperature",
        "motor_speed",
        "ambient_temperature",
        "contact.joint.conductance",
        "part.plate.surface.emissivity",
        "part.block.surface.emissivity",
        "source.friction.power",
    ] {
        assert!(parameters.iter().any(|p| *p == name), "{name} is not in {parameters:?}");
    }
    assert_eq!(found["readings"].as_object().unwrap().len(), 3);
    // A temperature has no percentage.
    assert!(found["readings"]["block"]["slopes"]["coolant_temperature"]["K_per_percent"].is_null());
    // The power is proportional to the speed.
    let slopes = &found["readings"]["block"]["slopes"];
    let per_percent = |name: &str| slopes[name]["K_per_percent"].as_f64().unwrap();
    assert!((per_percent("motor_speed") / per_percent("source.friction.power") - 1.0).abs() < 1e-9);
}

#[test]
fn text_is_sorted_and_cut() {
    let output = coldplate(&["--sensor", "block", "--sensor", "hole", "--top", "2", "--to", "mesh.cells"]);
    assert_eq!(output.status.code(), Some(2));
    let output = coldplate(&["--sensor", "block", "--sensor", "hole", "--top", "2"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("block: ") && text.contains("outlet of hole: "), "{text}");
    assert!(text.contains("and 6 more: --top 8"), "{text}");
    let all = coldplate(&["--sensor", "block"]);
    let text = String::from_utf8(all.stdout).unwrap();
    let places: Vec<usize> = ["coolant_temperature", "motor_speed", "part.plate.surface"].iter().map(|n| text.find(n).unwrap()).collect();
    assert!(places.is_sorted(), "{text}");
}

#[test]
fn bad_names_end_with_status_2() {
    for (arguments, needle) in [
        (["--to", "contact.joint.conductanc"], "did you mean 'contact.joint.conductance'"),
        (["--to", "coolant_floww"], "did you mean 'coolant_flow'"),
        (["--sensor", "blok"], "did you mean 'block'"),
        (["--to", "part.block.material"], "is a word"),
    ] {
        let output = coldplate(&arguments);
        let message = String::from_utf8_lossy(&output.stderr).to_string();
        assert!(output.status.code() == Some(2) && message.contains(needle), "{message}");
        assert!(output.stdout.is_empty());
    }
    let idle = coldplate(&["--to", "material.none.density"]);
    assert_eq!(idle.status.code(), Some(2));
    let idle = coldplate(&["--to", "limit.block.maximum"]);
    assert!(idle.status.success() && String::from_utf8_lossy(&idle.stderr).contains("nothing depends on 'limit.block.maximum'"));
}

/// Results do not depend on the number of threads, bit for bit.
#[test]
fn threads_change_nothing() {
    let readings = |threads: &str| json(&["--threads", threads])["readings"].to_string();
    assert_eq!(readings("1"), readings("3"));
}
