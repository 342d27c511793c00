//! What becomes of the machine's limits over time: in full, with a reduced model, and with a surrogate that moves.

use serde_json::Value;

use super::passes::NODE;
use super::{coldplate, json, numbers, scratch, write};

const USUAL: [&str; 6] = ["--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "22 degC"];
const LIMITS: &str = "[limit.hot]\nsensor = \"motor\"\nmaximum = \"60 degC\"\n[limit.rise]\nsensor = \"motor\"\nrise = \"8 K\"\n\
                      [limit.cold]\nsensor = \"motor\"\nrise = \"-1 K\"\n";
/// A surrogate that moves: four variables, three points, and a limit on the first.
const MOVING: &str = "crates/runtime/fixtures/moving.cps";

fn limit<'a>(found: &'a Value, name: &str) -> &'a Value {
    found["limits"].as_array().unwrap().iter().find(|limit| limit["name"] == name).unwrap_or_else(|| panic!("{name}: {}", found["limits"]))
}

/// Warming up for 1500 s from 22 degC, T = 22 + 15 (1 - exp(-t/500)), then cooling down.
#[test]
fn of_one_node_they_are_those_of_the_exponential() {
    let folder = scratch("limits");
    let machine = write(&folder, "node.toml", format!("{NODE}{LIMITS}"));
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,1000\n1500,1000\n1500,0\n4000,0\n");
    let state = folder.join("state").to_str().unwrap().to_string();
    let args = ["simulate", &machine, &schedule, "--from", "22 degC", "--tolerance", "1e-4 K", "--every", "1 h"];
    let args = [&args[..], &USUAL].concat();
    let found = json(&coldplate(&[&args[..], &["--json", "--checkpoint", &state]].concat()));
    let top = 15.0 * (1.0 - (-3.0f64).exp());
    let near = |value: &Value, wanted: f64, within: f64| assert!((value.as_f64().unwrap() - wanted).abs() < within, "{value} {wanted}");
    let hot = limit(&found, "hot");
    near(&hot["largest"], 22.0 + top, 5e-3);
    near(&hot["margin"], 38.0 - top, 5e-3);
    near(&hot["limit"], 60.0, 1e-9);
    assert_eq!((&hot["unit"], &hot["at_s"]), (&"degC".into(), &1500.0.into()));
    assert!(hot["first_broken_s"].is_null(), "{hot}");
    let rise = limit(&found, "rise");
    near(&rise["largest"], top, 5e-3);
    near(&rise["margin"], 8.0 - top, 5e-3);
    near(&rise["first_broken_s"], -500.0 * (1.0f64 - 8.0 / 15.0).ln(), 0.2);
    assert_eq!(rise["unit"], "K");
    // Broken from the beginning.
    assert_eq!(limit(&found, "cold")["first_broken_s"], 0.0);

    let text = coldplate(&args);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    for needle in ["largest value", "first broken at", "60.000 degC", "8.000 K", "25 min", "never", "6 min 21 s"] {
        assert!(text.contains(needle), "{needle}: {text}");
    }
    // Taken up again from a checkpoint, a run says the same of them.
    let again = json(&coldplate(&[&args[..], &["--json", "--checkpoint", &state, "--resume"]].concat()));
    assert!(again["resumed_at_s"].is_number() && again["limits"] == found["limits"], "{} {}", again["limits"], found["limits"]);
    // The picture says it too.
    let picture = folder.join("c.svg").to_str().unwrap().to_string();
    assert_eq!(coldplate(&[&args[..], &["--chart", &picture]].concat()).status.code(), Some(0));
    let drawn = std::fs::read_to_string(&picture).unwrap();
    assert!(drawn.contains("allowed"), "the limits are not in the picture");
}

/// Few outputs cost no exactness: a reduced model follows its sensors within its steps. It says how far its times may be off, and the full
/// model's are not further.
#[test]
fn a_reduced_model_says_the_same_between_its_outputs() {
    let folder = scratch("limits-reduced");
    let text = std::fs::read_to_string("machines/rig.toml").unwrap();
    let text = text.replacen("maximum = \"60 degC\"", "maximum = \"28 degC\"", 1).replacen("maximum = \"50 degC\"", "rise = \"4 K\"", 1);
    let machine = write(&folder, "rig.toml", &text);
    let model = folder.join("rig.cpr").to_str().unwrap().to_string();
    let made = ["reduce", &machine, "--cells", "600", "--accuracy", "0.01 K", "--histories", "2", "--quiet", "--out", &model];
    let made = coldplate(&made);
    assert_eq!(made.status.code(), Some(0), "{}", String::from_utf8_lossy(&made.stderr));
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,300\n600,300\n600,2500\n4200,2500\n4200,300\n7800,300\n");
    let run = |machine: &str, every: &str, more: &[&str]| {
        let args = ["simulate", machine, &schedule, "--every", every, "--passes", "motor shell=26 degC", "--quiet"];
        let conditions = ["--coolant-flow", "3 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "22 degC"];
        coldplate(&[&args[..], &conditions, more].concat())
    };
    let (coarse, fine) = (json(&run(&model, "2 h", &["--json"])), json(&run(&model, "5 s", &["--json"])));
    let full = json(&run(&machine, "5 s", &["--json", "--cells", "600", "--tolerance", "0.001 K"]));
    let at = |found: &Value, key: &str| found["passes"][0][key].as_f64().unwrap();
    for (key, within) in [("rising_s", "rising_within_s"), ("falling_s", "falling_within_s")] {
        let (coarse_at, fine_at, full_at) = (at(&coarse, key), at(&fine, key), at(&full, key));
        println!("{key}: {coarse_at} s with few outputs, {fine_at} s with many, {full_at} s in full, within {} s", at(&coarse, within));
        assert!((coarse_at - fine_at).abs() < 1.0 && (fine_at - full_at).abs() <= at(&fine, within), "{coarse_at} {fine_at} {full_at}");
        assert!(full["passes"][0].get(within).is_none());
    }
    for name in ["motor shell", "reducer shell", "water rise"] {
        let [coarse, fine, full] = [&coarse, &fine, &full].map(|found| limit(found, name));
        let number = |limit: &Value, key: &str| limit[key].as_f64();
        let off = |a: &Value, b: &Value, key: &str| (number(a, key).unwrap() - number(b, key).unwrap()).abs();
        println!("{name}: {coarse} {full}");
        assert!(off(coarse, fine, "largest") < 5e-3, "{coarse} {fine}");
        assert!(off(fine, full, "largest") <= number(fine, "bound").unwrap(), "{fine} {full}");
        assert_eq!(coarse["first_broken_s"].is_null(), full["first_broken_s"].is_null(), "{coarse} {full}");
        if let Some(broken) = number(coarse, "first_broken_s") {
            assert!((broken - number(fine, "first_broken_s").unwrap()).abs() < 1.0, "{coarse} {fine}");
            assert!(off(fine, full, "first_broken_s") <= number(fine, "first_broken_within_s").unwrap(), "{fine} {full}");
        }
    }
    assert!(limit(&coarse, "motor shell")["first_broken_s"].is_number() && limit(&coarse, "reducer shell")["unit"] == "K");
    // Every sensor has its own bound in the text, and the largest says whose it is.
    let text = String::from_utf8_lossy(&run(&model, "1 h", &[]).stdout).into_owned();
    for needle in ["bound K", ", that of '", "first broken at", " +- "] {
        assert!(text.contains(needle), "{needle}: {text}");
    }
    // Its bound is not known from a temperature that nothing of the machine has; boiling water is one of them.
    let hot = run(&model, "1 h", &["--from", "200 degC"]);
    let said = String::from_utf8_lossy(&hot.stderr).into_owned();
    assert!(hot.status.code() == Some(2) && said.contains("--from") && said.contains("its error is not known"), "{said}");
    assert_eq!(run(&model, "1 h", &["--from", "22 degC"]).status.code(), Some(0));
}

/// What passes in the first stretch behind a corner is met at its time and not at the next output.
#[test]
fn a_surrogate_is_followed_between_its_outputs() {
    let folder = scratch("limits-surrogate");
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,500\n1800,500\n1800,2500\n9000,2500\n9000,500\n18000,500\n");
    let run = |every: &str, more: &[&str]| {
        let args = ["simulate", MOVING, &schedule, "--every", every, "--passes", "point 2=25.8 degC", "--quiet"];
        let conditions = ["--coolant-flow", "6 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "22 degC"];
        coldplate(&[&args[..], &conditions, more].concat())
    };
    let (coarse, fine) = (json(&run("5 h", &["--json"])), json(&run("2 s", &["--json"])));
    let (coarse_pass, fine_pass) = (&coarse["passes"][0], &fine["passes"][0]);
    // It jumps with the condition, and falls through the same temperature half an hour later.
    assert_eq!((&coarse_pass["rising_s"], &fine_pass["rising_s"]), (&1800.0.into(), &1800.0.into()));
    let [first, second] = [coarse_pass, fine_pass].map(|pass| pass["falling_s"].as_f64().unwrap());
    println!("falls at {first} s with few outputs, at {second} s with many");
    assert!((first - second).abs() < 1.0 && (2400.0..6000.0).contains(&first), "{first} {second}");
    // The series of many outputs has it between two of them.
    let (times, course) = (numbers(&fine["series"]["time_s"]), numbers(&fine["series"]["point 2"]));
    let after = times.iter().zip(&course).find(|(time, value)| **time > 1800.0 && **value <= 25.8).map(|(time, _)| *time).unwrap();
    assert!((after - first).abs() <= 3.0, "{after} {first}");
    assert!(coarse_pass["falling_within_s"].as_f64().unwrap() > 0.0);
    let [coarse_limit, fine_limit] = [&coarse, &fine].map(|found| limit(found, "point 0"));
    assert!(coarse_limit["first_broken_s"].is_null() && coarse_limit["unit"] == "degC", "{coarse_limit}");
    let number = |limit: &Value, key: &str| limit[key].as_f64().unwrap();
    assert!((number(coarse_limit, "limit") - 60.0).abs() < 1e-9);
    assert!((number(coarse_limit, "largest") - number(fine_limit, "largest")).abs() < 0.01, "{coarse_limit} {fine_limit}");
    let text = String::from_utf8_lossy(&run("1 h", &[]).stdout).into_owned();
    for needle in ["bound K", "largest bound 0.13 K, that of 'point 2', against the full model", "largest value", "never"] {
        assert!(text.contains(needle), "{needle}: {text}");
    }
}

/// A surrogate has no machine file in which a default could be stated.
#[test]
fn a_surrogate_asks_for_missing_conditions_in_its_own_words() {
    let folder = scratch("limits-missing");
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm],ambient_temperature [degC]\n0,500,22\n1800,500,22\n");
    let refused = coldplate(&["simulate", MOVING, &schedule, "--coolant-temperature", "20 degC"]);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{message}");
    for needle in ["s.csv:2", "coolant_flow", "holds no defaults", "--at coolant_flow=\"2 L/min\"", "'coolant_flow [L/min]' (2 to 12)"] {
        assert!(message.contains(needle), "{needle}: {message}");
    }
    assert!(!message.contains("machine file"), "{message}");
    // Other mistakes keep their own remedy.
    let wrong = coldplate(&["simulate", MOVING, &schedule, "--coolant-temperature", "20 degC", "--coolant-flow", "6"]);
    let message = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert!(wrong.status.code() == Some(2) && message.contains("unit") && !message.contains("holds no defaults"), "{message}");
}
