//! Data as they should not be: each gets an error that names file, line, column and remedy, or a note.

use std::path::Path;

use coldplate_testing::machines::SERIES;

use super::scratch;
use crate::common::{coldplate, json, message, write};

const C: &str = "coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
const FREE: [&str; 3] = ["--free", "contact.second.conductance", "--brief"];

fn run(folder: &Path, csv: &[u8], toml: Option<&str>) -> std::process::Output {
    let machine = write(folder, "nodes.toml", SERIES);
    let data = write(folder, "readings.csv", csv);
    let _ = std::fs::remove_file(folder.join("readings.toml"));
    if let Some(toml) = toml {
        write(folder, "readings.toml", toml);
    }
    coldplate(&[&["identify", &machine, &data, "--json"][..], &FREE].concat())
}

fn refused(folder: &Path, csv: &[u8], toml: Option<&str>, needles: &[&str]) {
    let output = run(folder, csv, toml);
    let text = message(&output);
    let shown = String::from_utf8_lossy(csv).into_owned() + toml.unwrap_or("");
    assert_eq!(output.status.code(), Some(2), "{shown}\n{text}");
    assert!(output.stdout.is_empty() && !text.contains("panicked"), "{shown}\n{text}");
    for needle in needles {
        assert!(text.contains(needle), "no '{needle}' for\n{shown}\n{text}");
    }
}

#[test]
fn bad_tables_name_line_column_and_remedy() {
    let folder = scratch("bad_tables");
    let f = "readings.csv";
    let cases: Vec<(String, Vec<&str>)> = vec![
        (String::new(), vec![f, "no table", "header"]),
        ("# only a remark\n\n".into(), vec![f, "no table"]),
        (format!("{C},motor [degC]\n"), vec![f, "not one reading"]),
        (format!("{C},motor [degC]\n2,20,1000,22,\n"), vec![f, "not one reading"]),
        (format!("{C}\n2,20,1000,22\n"), vec![f, "not one reading", "NAME [degC]"]),
        (format!("{C},motor\n2,20,1000,22,40\n"), vec![f, "motor", "unit"]),
        (format!("{C},motr [degC]\n2,20,1000,22,40\n"), vec![f, "motr", "did you mean 'motor'"]),
        (format!("{C},motor [W]\n2,20,1000,22,40\n"), vec![f, "motor [W]"]),
        (format!("{C},motor [K]\n2,20,1000,22,40\n"), vec!["readings.csv:2", "motor", "-233", "unit in the header"]),
        (format!("{C},motor [degC]\n2,20,1000,22,4000\n"), vec!["readings.csv:2", "motor", "4000.0"]),
        (format!("{C},motor [degC]\n2,20,1000,22,-300\n"), vec!["readings.csv:2", "motor", "-300 degC"]),
        (format!("{C},motor [degC]\n2,20,1000,-999,40\n"), vec!["readings.csv:2", "ambient_temperature [degC]", "-999", "fill"]),
        (format!("{C},motor [degC]\n2,20,1000,22,warm\n"), vec!["readings.csv:2", "motor [degC]", "warm"]),
        (format!("{C},motor [degC]\n2,20,1000,22,inf\n"), vec!["readings.csv:2", "motor [degC]", "inf"]),
        (format!("{C},motor [degC]\n2,20,1000,22,\"39,500\"\n"), vec!["readings.csv:2", "39,500", "decimal point"]),
        (format!("{C},motor [degC]\n2,20,1000,22,40,41\n"), vec!["readings.csv:2", "6 cells"]),
        (format!("{C},motor [degC],motor [degC]\n2,20,1000,22,40,41\n"), vec![f, "motor"]),
        (format!("{C},motor [degC]\n2,20,1000,,40\n"), vec!["readings.csv:2", "ambient_temperature", "condition is missing"]),
        (format!("{C},motor [degC]\n2,20,1000,nan,40\n"), vec!["readings.csv:2", "ambient_temperature"]),
        (format!("{C},motor [degC]\n-2,20,1000,22,40\n"), vec!["readings.csv:2", "coolant_flow", "-2"]),
        ("coolant_flow [L/min],motor [degC]\n2,40\n".into(), vec!["readings.csv:2", "ambient_temperature", "needs a value"]),
        ("coolant_flow [degC],motor [degC]\n2,40\n".into(), vec![f, "coolant_flow [degC]"]),
        ("coolant_flow,motor [degC]\n2,40\n".into(), vec![f, "coolant_flow", "unit"]),
        (format!("test,{C},motor [degC]\n,2,20,1000,22,40\n"), vec!["readings.csv:2", "test"]),
        // Logs.
        (format!("time [s],{C},motor [degC]\n60,2,20,1000,22,22\n0,2,20,1000,22,23\n"), vec!["readings.csv:3", "time", "not in order"]),
        (format!("time [s],{C},motor [degC]\n,2,20,1000,22,22\n0,2,20,1000,22,23\n"), vec!["readings.csv:2", "no time"]),
        (format!("time [s],{C},motor [degC]\n0,2,20,1000,22,22\n"), vec!["readings.csv:2", "one row only", "steady"]),
        (format!("time,{C},motor [degC]\n0,2,20,1000,22,22\n"), vec![f, "time"]),
        (format!("time [K],{C},motor [degC]\n0,2,20,1000,22,22\n1,2,20,1000,22,22\n"), vec![f, "time"]),
        (
            format!("test,time [min],{C},motor [degC]\na,0,2,20,1000,22,22\na,9,2,20,1000,22,22\nb,0,2,20,1000,22,22\n"),
            vec!["readings.csv:4", "'b'", "one row only"],
        ),
    ];
    for (csv, needles) in &cases {
        refused(&folder, csv.as_bytes(), None, needles);
    }
    refused(&folder, b"coolant_flow [L/min],motor [degC]\n2,\xff\xfe\n", None, &[f]);
    refused(&folder, b"PAR1\0\0\0\0\0\0\0\0", None, &[f]);
    let missing = coldplate(&["identify", &write(&folder, "nodes.toml", SERIES), "no_such.csv", FREE[0], FREE[1]]);
    assert!(missing.status.code() == Some(2) && message(&missing).contains("no_such.csv"), "{}", message(&missing));
}

#[test]
fn bad_uncertainties_name_line_key_and_remedy() {
    let folder = scratch("bad_uncertainties");
    let csv = format!("{C},motor [degC],middle [degC]\n2,20,1000,22,40,35\n");
    let kind = "kind = \"limits\"\n";
    for (toml, needles) in [
        ("noise = \"0.1 K\"\n".to_string(), &["readings.toml", "kind = \"limits\""][..]),
        ("kind = \"sigma\"\n".into(), &["readings.toml:1", "kind", "standard deviations"]),
        (format!("{kind}noise = \"-0.1 K\"\n"), &["readings.toml:2", "noise", "not negative"]),
        (format!("{kind}noise = 0.1\n"), &["readings.toml:2", "noise"]),
        (format!("{kind}noise = \"0.1 L/min\"\n"), &["readings.toml:2", "noise"]),
        (format!("{kind}noise = \"nan K\"\n"), &["readings.toml:2", "noise"]),
        (format!("{kind}noise = \"0 K\"\n"), &["readings.toml", "noise", "cannot be weighed"]),
        (format!("{kind}nosie = \"0.1 K\"\n"), &["readings.toml:2", "nosie", "noise"]),
        (format!("{kind}[condition]\ncoolant_flw = \"0.1 L/min\"\n"), &["readings.toml:3", "coolant_flw", "coolant_flow"]),
        (format!("{kind}[condition]\ncoolant_flow = \"0.1 K\"\n"), &["readings.toml:3", "coolant_flow"]),
        (format!("{kind}[condition]\ncoolant_flow = \"-2 %\"\n"), &["readings.toml:3", "coolant_flow", "not negative"]),
        (format!("{kind}[condition]\ncoolant_flow = \"nan %\"\n"), &["readings.toml:3", "coolant_flow"]),
        (format!("{kind}[condition]\ncoolant_flow = \"two %\"\n"), &["readings.toml:3", "percent"]),
        (format!("{kind}[sensor.motr]\nbias = \"0.1 K\"\n"), &["readings.toml", "motr", "did you mean 'motor'"]),
        (format!("{kind}[sensor.motor]\nbias = \"-1 K\"\n"), &["readings.toml:3", "bias"]),
        (format!("{kind}[sensor.motor]\nbais = \"1 K\"\n"), &["readings.toml:3", "bais"]),
        ("kind = \n".into(), &["readings.toml:1"]),
    ] {
        refused(&folder, csv.as_bytes(), Some(&toml), needles);
    }
}

/// What spreadsheets write, and gaps, are taken as they are meant.
#[test]
fn gaps_and_spreadsheets_are_understood() {
    let folder = scratch("good_tables");
    let value = |csv: &[u8]| -> (f64, String, usize) {
        let output = run(&folder, csv, None);
        let found = json(&output);
        let value = found["parameters"]["contact.second.conductance"]["value"].as_f64().unwrap();
        (value, message(&output), found["readings"].as_array().unwrap().len())
    };
    let plain = format!("{C},motor [degC],middle [degC]\n2,20,1000,22,42,37\n");
    let (expected, ..) = value(plain.as_bytes());
    assert!((expected / 600.0 - 1.0).abs() < 1e-4, "{expected}");
    let marked = format!("\u{feff}{}", plain.replace('\n', "\r\n"));
    let kelvin = format!("{C},motor [K],middle [degC]\n2,20,1000,22,315.15,37\n");
    for csv in [marked, kelvin, format!("# from the rig\n\n{plain}\n"), plain.replace("\n2,20", "\n 2 , 20 ")] {
        let (same, _, count) = value(csv.as_bytes());
        assert!((same / expected - 1.0).abs() < 1e-9 && count == 2, "{csv} {same}");
    }
    // A sensor that was not read, a row without any reading, no file of uncertainties: each is said.
    let gaps = format!("{C},motor [degC],middle [degC]\n2,20,1000,22,42,\n2,20,1000,22,,nan\n");
    let (_, notes, count) = value(gaps.as_bytes());
    assert_eq!(count, 1);
    for note in ["'middle' has a column but no reading", "1 row without a reading", "no file says how uncertain"] {
        assert!(notes.contains(note), "{note}: {notes}");
    }
    // A table called like the machine beside it: the machine file is not taken for its uncertainties.
    let machine = write(&folder, "same.toml", SERIES);
    let data = write(&folder, "same.csv", &plain);
    let found = json(&coldplate(&[&["identify", &machine, &data, "--json"][..], &FREE].concat()));
    let same = found["parameters"]["contact.second.conductance"]["value"].as_f64().unwrap();
    assert!((same / expected - 1.0).abs() < 1e-9, "{same}");
    // Limits of 0.1 K are standard deviations of 0.1 / sqrt 3: intervals that much narrower.
    let width = |kind: &str| {
        let toml = format!("kind = \"{kind}\"\nnoise = \"0.1 K\"\nbias = \"0.2 K\"\n[condition]\nambient_temperature = \"0.3 K\"\n");
        let found = json(&run(&folder, plain.as_bytes(), Some(&toml)));
        let p = &found["parameters"]["contact.second.conductance"];
        (p["high"].as_f64().unwrap() / p["low"].as_f64().unwrap()).ln()
    };
    let ratio = width("standard deviations") / width("limits");
    assert!((ratio - 3f64.sqrt()).abs() < 1e-3, "{ratio}");
}

/// A log in two tests, interleaved, with a row that only says that the source stops.
#[test]
fn logs_are_read_by_test() {
    let folder = scratch("logs");
    let machine = SERIES.replace("power = \"30 W\"", "power = \"0.03 * motor_speed_rpm\"");
    let machine = write(&folder, "nodes.toml", machine);
    // From 22 degC without heat nothing moves; the row that starts the motor has no reading of its own.
    let rows = "b,0,2,20,0,22,22\na,0,2,20,0,22,22\na,600,2,20,0,22,\na,601,2,20,1000,22,\nb,900,2,20,0,22,22\na,90000,2,20,1000,22,42\n";
    let data = write(&folder, "log.csv", format!("test,time [s],{C},motor [degC]\n{rows}"));
    let found = json(&coldplate(&["identify", &machine, &data, "--json", "--from", "22 degC", FREE[0], FREE[1], FREE[2]]));
    // After a day it is steady: 20 K above the ambient with 30 W through 2 and 6 W/K in series.
    let value = found["parameters"]["contact.second.conductance"]["value"].as_f64().unwrap();
    assert!((value / 600.0 - 1.0).abs() < 2e-3, "{value}");
    assert_eq!(found["readings"].as_array().unwrap().len(), 4);
}
