//! Parameters that the data do not determine stay where they were, and none runs far from the file's value.

use coldplate_testing::machines::SERIES;

use super::scratch;
use crate::common::{coldplate, json, write};

const HEADER: &str = "test,coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
const FIRST: &str = "contact.first.total_conductance";
const SECOND: &str = "contact.second.conductance";

#[test]
fn what_is_not_determined_keeps_the_text_of_the_file() {
    let folder = scratch("kept");
    let machine = write(&folder, "nodes.toml", SERIES);
    // The motor alone is read: 17 K over the room through both conductances in series.
    let data = write(&folder, "data.csv", format!("{HEADER},motor [degC]\na,2,20,1000,22,39\nb,2,20,1000,25,42.1\nc,2,20,1000,20,37\n"));
    let out = folder.join("found.toml");
    let free = ["--free", FIRST, "--free", SECOND, "--free", "node.motor.capacity"];
    let args = [&["identify", &machine, &data, "--out", out.to_str().unwrap()], &free[..]].concat();
    let found = json(&coldplate(&[&args[..], &["--json"]].concat()));
    let of = |key: &str| &found["parameters"][key];
    assert!(of("node.motor.capacity")["kept"] == true && of("node.motor.capacity")["profile"].is_null(), "{found}");
    // Of the two conductances one is found beside the other.
    assert!(of(FIRST)["kept"] != of(SECOND)["kept"], "{found}");
    let [g1, g2] = [FIRST, SECOND].map(|key| of(key)["value"].as_f64().unwrap());
    assert!((30.0 / g1 + 3000.0 / g2 - 17.03).abs() < 0.05, "{g1} {g2}");
    let (kept, moved) = if of(FIRST)["kept"] == true { (FIRST, SECOND) } else { (SECOND, FIRST) };
    assert_eq!(of(kept)["value"], of(kept)["before"]);
    let [low, high] = ["low", "high"].map(|k| of(moved)[k].as_f64().unwrap());
    assert!(high / low < 1.5, "{}", of(moved));
    let text = std::fs::read_to_string(&out).unwrap();
    let lines =
        ["capacity = \"1000 J/K\"", "total_conductance = \"2 W/K\" # a guess", "conductance = \"400 W/(m2 K)\" # 4 W/K over the area"];
    assert!(text.contains(lines[0]) && text.contains(lines[if kept == FIRST { 1 } else { 2 }]), "{text}");
    assert!(text.contains("not determined by these data, kept at"), "{text}");
    std::fs::remove_file(&out).unwrap();
    let shown = String::from_utf8_lossy(&coldplate(&args).stdout).into_owned();
    assert!(shown.contains("node.motor.capacity is not determined by these data: kept at 1000"), "{shown}");
}

/// A contact without any drop: the data say that it conducts well, not how well.
#[test]
fn nothing_runs_to_a_thousand_times_its_value() {
    let folder = scratch("far");
    let machine = write(&folder, "nodes.toml", SERIES);
    let data = write(&folder, "data.csv", format!("{HEADER},motor [degC],middle [degC]\na,2,20,1000,22,37,37\nb,2,20,1000,25,40,40\n"));
    let out = folder.join("found.toml");
    let args = ["identify", &machine, &data, "--free", FIRST, "--free", SECOND, "--brief", "--json", "--out", out.to_str().unwrap()];
    let found = json(&coldplate(&args));
    let p = &found["parameters"][SECOND];
    let [value, low] = ["value", "low"].map(|k| p[k].as_f64().unwrap());
    // 7.5 K at the file's value are refuted: it is not kept, and goes as far as it may without being told to.
    assert!(p["kept"] == false && value <= 100.0 * 400.0 * (1.0 + 1e-9) && value > 10.0 * 400.0 && low > 400.0, "{p}");
}
