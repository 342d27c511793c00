//! The command: what it prints, what it writes, and that nothing is overwritten.

use std::path::Path;

use coldplate_solve::study::Study;
use serde_json::Value;

use coldplate_testing::machines::{BLOCKS, SERIES};

use super::scratch;
use crate::common::{coldplate, json, message, write};

const HEADER: &str = "test,coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
const SECOND: &str = "contact.second.conductance";

/// Readings of the two nodes for conductances of 2.5 and 6 W/K.
fn folder(name: &str) -> (std::path::PathBuf, String, String) {
    let folder = scratch(name);
    let machine = write(&folder, "nodes.toml", SERIES);
    let data =
        write(&folder, "data.csv", format!("{HEADER},motor [degC],middle [degC]\nfirst,2,20,1000,22,39,34\nsecond,2,20,1000,25,42,37\n"));
    (folder, machine, data)
}

fn solved(machine: &str, ambient: &str) -> Value {
    let args = ["solve", machine, "--json", "--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC"];
    json(&coldplate(&[&args[..], &["--motor-speed", "1000 rpm", "--ambient-temperature", ambient]].concat()))
}

#[test]
fn the_written_machine_predicts_what_was_reported_and_keeps_its_comments() {
    let (folder, machine, data) = folder("written");
    let goal = folder.join("found.toml");
    let before = std::fs::read_to_string(&machine).unwrap();
    let args = ["identify", &machine, &data, "--free", "contact.first.total_conductance", "--free", SECOND, "--json"];
    // A value that is changed for the run is part of the machine that is written.
    let args = [&args[..], &["--set", "source.motor.power=33 W"]].concat();
    // Unless that is asked for, nothing is written, neither beside the machine nor anywhere else.
    let unwritten = json(&coldplate(&args));
    assert!(unwritten["machine"].is_null() && std::fs::read_dir(&folder).unwrap().count() == 2, "{unwritten}");
    let args = [&args[..], &["--out", goal.to_str().unwrap()]].concat();
    let found = json(&coldplate(&args));
    assert_eq!(found["parameters"], unwritten["parameters"]);
    let path = found["machine"].as_str().unwrap().to_string();
    assert_eq!(Path::new(&path), goal);
    assert_eq!(std::fs::read_to_string(&machine).unwrap(), before);
    let text = std::fs::read_to_string(&path).unwrap();
    for kept in ["# two nodes in a row", "# keep this remark", "# a guess", "# 4 W/K over the area", "data.csv", "first, second", "33 W"] {
        assert!(text.contains(kept), "{kept}: {text}");
    }
    // What was found is written as uncertain as it is, with what goes together and where it was measured.
    let study = Study::read(&path, &[], None).unwrap();
    let open = study.open_parameters(false).unwrap();
    assert_eq!(open.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["contact.first.total_conductance", SECOND]);
    for p in &open {
        let own = &found["parameters"][&p.name];
        let width = own["high"].as_f64().unwrap() - own["low"].as_f64().unwrap();
        assert!((width / (2.0 * 1.96 * p.deviation) - 1.0).abs() < 0.01, "{} {own}", p.deviation);
    }
    assert!(study.correlations(&open).unwrap()[0][1] != 0.0);
    assert_eq!(study.model.machine.model_error.measured.len(), 2);
    // 33 W through 2.75 and 6.6 W/K.
    for (name, planted) in [("contact.first.total_conductance", 2.75), (SECOND, 660.0)] {
        let p = &found["parameters"][name];
        assert!((p["value"].as_f64().unwrap() / planted - 1.0).abs() < 1e-4, "{p}");
        assert!(p["low"].as_f64().unwrap() < planted && planted < p["high"].as_f64().unwrap(), "{p}");
    }
    let solved = solved(&path, "25 degC");
    let readings = found["readings"].as_array().unwrap();
    assert_eq!(readings.len(), 4);
    for r in readings.iter().filter(|r| r["test"] == "second") {
        let there = solved["sensors"][r["sensor"].as_str().unwrap()].as_f64().unwrap();
        assert!((there - r["after_degC"].as_f64().unwrap()).abs() < 1e-6, "{r} {there}");
    }
    // A name that is taken: refused before any work, and left as it is.
    let taken = coldplate(&args);
    assert!(taken.status.code() == Some(2) && message(&taken).contains("nothing is written over"), "{}", message(&taken));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    // What was identified is a machine like any other: identified again, nothing changes.
    let settled = json(&coldplate(&["identify", &path, &data, "--free", SECOND, "--brief", "--json"]));
    let p = &settled["parameters"][SECOND];
    assert!((p["value"].as_f64().unwrap() / p["before"].as_f64().unwrap() - 1.0).abs() < 1e-4, "{p}");
}

#[test]
fn tests_that_are_not_used_are_predicted() {
    let (_, machine, data) = folder("held_out");
    let args = ["identify", &machine, &data, "--free", SECOND, "--free", "contact.first.total_conductance", "--use", "first", "--json"];
    let found = json(&coldplate(&args));
    assert_eq!(found["readings"].as_array().unwrap().len(), 2);
    assert_eq!(found["held_out"]["readings"].as_array().unwrap().len(), 2);
    assert!(found["held_out"]["rmse_after_K"].as_f64().unwrap() < 1e-3, "{}", found["held_out"]);
    assert!(found["held_out"]["rmse_before_K"].as_f64().unwrap() > 3.0, "{}", found["held_out"]);
    let text = coldplate(&[&args[..args.len() - 1], &["--quiet", "--threads", "1"]].concat());
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("as many readings as parameters") && text.contains("not used, predicted untouched"), "{text}");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let folder = scratch("threads");
    let machine = write(&folder, "blocks.toml", BLOCKS);
    let data = write(
        &folder,
        "data.csv",
        format!("{HEADER},motor [degC],reducer [degC],outlet [degC]\na,2,20,2000,23,46,,21.1\nb,4,20,1000,22,33.5,29.5,\n"),
    );
    let run = |threads: &str| {
        let mut found = json(&coldplate(&[
            "identify",
            &machine,
            &data,
            "--free",
            "contact.motor.conductance",
            "--free",
            "part.motor.surface.emissivity",
            "--json",
            "--cells",
            "300",
            "--threads",
            threads,
        ]));
        found["seconds"] = Value::Null;
        found["machine"] = Value::Null;
        found
    };
    let (one, two) = (run("1"), run("2"));
    assert_eq!(one, two);
    // An emissivity ends at one, profiles too.
    let e = &one["parameters"]["part.motor.surface.emissivity"];
    assert!(e["high"].as_f64().unwrap() <= 1.0, "{e}");
}

/// A table on the reduced model and one of full solves find the same, and only the first has something to check in full.
#[test]
fn full_solves_find_the_same() {
    let folder = scratch("in_full");
    let machine = write(&folder, "blocks.toml", BLOCKS);
    let rows = "a,2,20,2000,23,46,38.5,21.1\nb,4,20,1000,22,33.5,29.5,20.3\nc,1,25,1500,24,45,38,26.4\nd,6,15,2500,22,47,37.5,15.5\n";
    let data = write(&folder, "data.csv", format!("{HEADER},motor [degC],reducer [degC],outlet [degC]\n{rows}"));
    let args = ["identify", &machine, &data, "--free", "contact.motor.conductance", "--free", "contact.reducer.conductance", "--json"];
    let run = |more: &[&str]| json(&coldplate(&[&args[..], &["--cells", "1500"], more].concat()));
    let (reduced, full) = (run(&[]), run(&["--full"]));
    let off = reduced["off_in_full_K"].as_f64().unwrap();
    println!("off in full by {off:.1e} K");
    assert!(off < 1e-3 && full["off_in_full_K"].is_null(), "{off} {}", full["off_in_full_K"]);
    for name in ["contact.motor.conductance", "contact.reducer.conductance"] {
        let [a, b] = [&reduced, &full].map(|found| &found["parameters"][name]);
        let width = b["high"].as_f64().unwrap() - b["low"].as_f64().unwrap();
        let apart = (a["value"].as_f64().unwrap() - b["value"].as_f64().unwrap()).abs();
        println!("{name}: {apart:.1e} apart, interval {width:.1}");
        assert!(apart < 0.01 * width, "{name}: {a} {b}");
    }
}

#[test]
fn a_scan_says_where_it_is_least_and_draws_it() {
    let (folder, machine, data) = folder("scan");
    let chart = folder.join("valley.svg");
    let found = json(&coldplate(&[
        "identify",
        &machine,
        &data,
        "--scan",
        "contact.first.total_conductance=1.5 W/K..3.5 W/K/0.25 W/K",
        "--scan",
        "contact.second.conductance=100..1000/100",
        "--chart",
        chart.to_str().unwrap(),
        "--json",
    ]));
    let least: Vec<f64> = found["least_misfit"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!((least[0] - 2.5).abs() < 1e-9 && (least[1] - 600.0).abs() < 1e-9, "{least:?}");
    assert_eq!(found["misfit"].as_array().unwrap().len(), 9);
    assert!(std::fs::read_to_string(&chart).unwrap().contains("<svg"));
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let (folder, machine, data) = folder("options");
    for (args, needles) in [
        (vec![], &["--free", "contact.first.total_conductance"][..]),
        (vec!["--free", "contact.secnd.conductance"], &["did you mean", "contact.second.conductance"]),
        (vec!["--free", SECOND, "--free", SECOND], &["named twice"]),
        (vec!["--free", "motor_speed"], &["is a condition", "DATA.toml"]),
        (vec!["--free", "node.motor.capacity=2 J/K..1 J/K"], &["lower bound comes first"]),
        (vec!["--free", "node.motor.capacity=1..2 K"], &["node.motor.capacity", "unit"]),
        (vec!["--free", "node.motor.capacity=-5 J/K..2 J/K"], &["does not allow these bounds", "capacity"]),
        (vec!["--free", "node.motor.capacity=1000 J/K +- 0 J/K"], &["standard deviation is positive"]),
        (vec!["--free", "node.motor.capacity=1 J/K..2 J/K, 5 J/K +- 1 J/K"], &["outside the bounds"]),
        (vec!["--free", "node.motor.capacity=about 5"], &["neither bounds nor prior", "write"]),
        (vec!["--free", "node.motor.capacity=nan J/K..2 J/K"], &["node.motor.capacity"]),
        (vec!["--free", SECOND, "--use", "frist"], &["no test 'frist'", "did you mean 'first'"]),
        (vec!["--free", SECOND, "--without", "motr"], &["motr", "did you mean 'motor'"]),
        (vec!["--free", SECOND, "--without", "motor", "--without", "middle"], &["no reading is left"]),
        (vec!["--free", SECOND, "--from", "20"], &["--from", "unit"]),
        (vec!["--scan", "contact.second.conductance=100..1000/100"], &["two parameters"]),
        (vec!["--scan", "contact.second.conductance=9", "--scan", "a=1..2/1"], &["no axis of a scan"]),
        (vec!["--scan", "contact.second.conductance=100..1000/0", "--scan", "contact.second.area=1..2/1"], &["no axis of a scan"]),
    ] {
        let output = coldplate(&[&["identify", &machine, &data][..], &args].concat());
        let text = message(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        assert!(output.stdout.is_empty() && !text.contains("panicked"), "{args:?}: {text}");
        for needle in needles {
            assert!(text.contains(needle), "{args:?}: no '{needle}' in {text}");
        }
    }
    // Only the data and the machine are there: nothing was written on the way to an error.
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
}
