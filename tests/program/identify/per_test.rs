//! Numbers that hold in one test alone: `KEY@TEST` and `KEY@*`.

use coldplate_testing::machines::SERIES;

use super::scratch;
use crate::common::{coldplate, json, message, write};

const HEADER: &str = "test,coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
const FIRST: &str = "contact.first.total_conductance";
const HEAT: &str = "source.motor.power";

/// Readings of the two nodes for 2.5 and 4 W/K; 30 W in the first test, 36 W in the second.
fn folder(name: &str) -> (std::path::PathBuf, String, String) {
    let folder = scratch(name);
    let machine = write(&folder, "nodes.toml", SERIES);
    let rows = "first,2,20,1000,22,41.5,34\nsecond,2,20,1000,25,48.4,39.4\n";
    let data = write(&folder, "data.csv", format!("{HEADER},motor [degC],middle [degC]\n{rows}"));
    (folder, machine, data)
}

#[test]
fn a_heat_of_one_test_is_found_beside_what_is_common_to_all() {
    let (folder, machine, data) = folder("own_heat");
    let goal = folder.join("found.toml");
    let own = format!("{HEAT}@second=10 W..100 W");
    let args = ["identify", &machine, &data, "--free", FIRST, "--free", &own, "--out", goal.to_str().unwrap(), "--json"];
    let found = json(&coldplate(&args));
    for (name, planted) in [(FIRST, 2.5), ("source.motor.power@second", 36.0)] {
        let p = &found["parameters"][name];
        assert!((p["value"].as_f64().unwrap() / planted - 1.0).abs() < 1e-4, "{name}: {p}");
    }
    assert!(found["misfit"]["after"].as_f64().unwrap() < 1e-3, "{}", found["misfit"]);
    // A further test tells of the heat of this one only by what it tells of the machine.
    let order = found["correlation"]["names"].as_array().unwrap();
    let shrink = |name: &str| found["next_tests"][0]["shrink"][order.iter().position(|n| n == name).unwrap()].as_f64().unwrap();
    assert!(shrink(FIRST) < shrink("source.motor.power@second") && shrink("source.motor.power@second") > 0.8, "{found}");
    // The machine keeps its own heat; that of the test is said above it.
    let text = std::fs::read_to_string(&goal).unwrap();
    assert!(text.contains("power = \"30 W\"") && text.contains("source.motor.power@second"), "{text}");
}

#[test]
fn every_test_has_a_value_of_its_own() {
    let (_, machine, data) = folder("own_each");
    let each = format!("{HEAT}@*");
    let found =
        json(&coldplate(&["identify", &machine, &data, "--set", "contact.first.total_conductance=2.5 W/K", "--free", &each, "--json"]));
    for (name, planted) in [("source.motor.power@first", 30.0), ("source.motor.power@second", 36.0)] {
        assert!((found["parameters"][name]["value"].as_f64().unwrap() / planted - 1.0).abs() < 1e-4, "{found}");
    }
    // One beside the common value stands in its place in that test.
    let own = format!("{HEAT}@second");
    let args = ["identify", &machine, &data, "--set", "contact.first.total_conductance=2.5 W/K", "--free", HEAT, "--free", &own, "--json"];
    let found = json(&coldplate(&args));
    for (name, planted) in [(HEAT, 30.0), ("source.motor.power@second", 36.0)] {
        assert!((found["parameters"][name]["value"].as_f64().unwrap() / planted - 1.0).abs() < 1e-4, "{found}");
    }
}

#[test]
fn a_test_that_is_not_used_is_refused_with_those_that_are() {
    let (_, machine, data) = folder("own_unknown");
    for free in ["source.motor.power@third", "source.motor.power@"] {
        let refused = coldplate(&["identify", &machine, &data, "--free", free]);
        assert!(refused.status.code() == Some(2) && message(&refused).contains("first, second"), "{}", message(&refused));
    }
    let refused = coldplate(&["identify", &machine, &data, "--free", "source.motor.power@second", "--use", "first"]);
    assert!(message(&refused).contains("no test of this name is used"), "{}", message(&refused));
}
