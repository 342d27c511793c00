//! Readings that are held out of a fit, and predicted untouched.

use coldplate_testing::machines::SERIES;
use serde_json::Value;

use super::scratch;
use crate::common::{coldplate, json, message, write};

const CONDITIONS: &str = "coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
const FREE: [&str; 3] = ["--free", "contact.second.conductance", "--brief"];

fn rmse(found: &Value) -> f64 {
    found.as_f64().unwrap_or_else(|| panic!("{found}"))
}

/// A log of the machine with another conductance: what is held out of its end, or of its blocks, is predicted by the number found.
#[test]
fn of_logs_the_end_or_blocks() {
    let folder = scratch("hold-out-log");
    let lively = SERIES.replace("1000 J/K", "100 J/K").replace("power = \"30 W\"", "power = \"0.03 * motor_speed_rpm\"");
    let machine = write(&folder, "nodes.toml", &lively);
    let changed = ["--set", "contact.second.conductance=600 W/(m2 K)"];
    let header = "time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
    let schedule =
        write(&folder, "schedule.csv", format!("{header}\n0,2,20,1000,22\n1500,2,20,1000,22\n1500,2,20,300,22\n3000,2,20,300,22\n"));
    let log = folder.join("log.csv").display().to_string();
    let ran =
        coldplate(&[&["simulate", &machine, &schedule, "--from", "22 degC", "--every", "60 s", "--out", &log][..], &changed].concat());
    assert_eq!(ran.status.code(), Some(0), "{}", message(&ran));
    let identify = |more: &[&str]| {
        coldplate(&[&["identify", &machine, &log, "--from", "readings", "--held", "motor_speed"][..], &FREE, more].concat())
    };
    for (how, sentence) in [("20%", "the last 20 % of the time of each log"), ("every:5", "the last of every 5 blocks")] {
        let output = identify(&["--hold-out", how, "--json"]);
        assert!(message(&output).contains(sentence), "{}", message(&output));
        let found = json(&output);
        let value = found["parameters"]["contact.second.conductance"]["value"].as_f64().unwrap();
        assert!((value / 600.0 - 1.0).abs() < 0.01, "{value}");
        let held = &found["held_out"];
        assert!(held["text"].as_str().unwrap().contains(sentence), "{}", held["text"]);
        assert!(rmse(&held["rmse_after_K"]) < 0.05 && rmse(&held["rmse_before_K"]) > 0.3, "{held}");
        assert!(rmse(&held["sensors"]["motor"]["rmse_before_K"]) > 0.3 && held["tests"].as_object().unwrap().len() == 1, "{held}");
        let (used, kept) = (found["readings"].as_array().unwrap(), held["readings"].as_array().unwrap());
        let times = |readings: &[Value]| readings.iter().map(|r| r["time_s"].as_f64().unwrap() as i64).collect::<Vec<_>>();
        assert!(times(used).iter().all(|time| !times(kept).contains(time)), "{how}");
        let first = &kept[0];
        let residual = first["measured_degC"].as_f64().unwrap() - first["after_degC"].as_f64().unwrap();
        assert!((first["residual_K"].as_f64().unwrap() - residual).abs() < 1e-9, "{first}");
        // The same readings, and no others, are scored by `predict`.
        let scored = json(&coldplate(
            &[&["predict", &machine, &log, "--from", "readings", "--held", "motor_speed", "--hold-out", how, "--json"][..], &changed]
                .concat(),
        ));
        assert_eq!(times(scored["readings"].as_array().unwrap()), times(kept));
        assert!(scored["account"]["notes"].to_string().contains(sentence), "{}", scored["account"]);
        assert!(scored["all"]["rmse_K"].as_f64().unwrap() < 0.05, "{}", scored["all"]);
    }
    let text = identify(&["--hold-out", "20%"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    for said in ["not used, predicted untouched", "root mean square difference", "motor"] {
        assert!(text.contains(said), "no '{said}' in {text}");
    }
}

#[test]
fn of_steady_tables_tests_by_name_and_evenly() {
    let folder = scratch("hold-out-table");
    let machine = write(&folder, "nodes.toml", SERIES);
    // 30 W through 2 and 6 W/K.
    let rows: String = (0..10).map(|r| format!("t{r},2,20,1000,{},{}\n", 20 + r, 40 + r)).collect();
    let data = write(&folder, "data.csv", format!("test,{CONDITIONS},motor [degC]\n{rows}"));
    let held = |texts: &[&str]| -> Vec<String> {
        let options: Vec<&str> = texts.iter().flat_map(|text| ["--hold-out", text]).collect();
        let found = json(&coldplate(&[&["identify", &machine, &data, "--json"][..], &FREE, &options].concat()));
        assert!(rmse(&found["held_out"]["rmse_after_K"]) < 0.05, "{}", found["held_out"]);
        found["held_out"]["readings"].as_array().unwrap().iter().map(|r| r["test"].as_str().unwrap().to_string()).collect()
    };
    assert_eq!(held(&["t3", "t8"]), ["t3", "t8"]);
    assert_eq!(held(&["20%"]), ["t2", "t7"]);
    assert_eq!(held(&["every:5"]), ["t4", "t9"]);
    for (options, needle) in [
        (&["--hold-out", "t33"][..], "did you mean 't3'"),
        (&["--hold-out", "120%"], "between 0 and 100 %"),
        (&["--hold-out", "every:x"], "every:5"),
        (&["--hold-out", "t1", "--use", "t2"], "cannot be used with"),
    ] {
        let refused = coldplate(&[&["identify", &machine, &data][..], &FREE, options].concat());
        assert!(refused.status.code() == Some(2) && message(&refused).contains(needle), "{options:?} {}", message(&refused));
    }
}

/// The diagnosis of nine tests names the conductance that is too small; the one that it never saw is predicted better with it.
#[test]
fn a_diagnosis_is_judged_by_what_it_never_saw() {
    let folder = scratch("hold-out-diagnose");
    let machine = write(&folder, "nodes.toml", SERIES);
    let rows: String = (0..10)
        .map(|r| {
            let ambient = 20.0 + f64::from(r);
            format!("t{r},2,20,1000,{ambient},{},{}\n", ambient + 15.0 + 30.0 / 6.0, ambient + 15.0)
        })
        .collect();
    let data = write(&folder, "data.csv", format!("test,{CONDITIONS},motor [degC],middle [degC]\n{rows}"));
    let output = coldplate(&["diagnose", &machine, &data, "--hold-out", "t4", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", message(&output));
    let found = json(&output);
    let held = found["held_out"]["readings"].as_array().unwrap();
    assert!(held.len() == 2 && held.iter().all(|r| r["test"] == "t4"), "{held:?}");
    assert!(found["readings"].as_array().unwrap().iter().all(|r| r["test"] != "t4"));
    let (before, after) = (rmse(&found["held_out"]["rmse_before_K"]), rmse(&found["held_out"]["rmse_after_K"]));
    assert!(before > 1.0 && after <= before, "{before} {after}");
    if found["extended_machine"].is_string() {
        assert!(after < 0.5 * before, "{before} {after}");
    }
}
