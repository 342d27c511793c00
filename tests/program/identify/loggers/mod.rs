//! Files as loggers and spreadsheets write them: read with a word on everything that was assumed or left out, or refused with the
//! remedy.

use std::path::Path;

use coldplate_testing::machines::SERIES;
use serde_json::Value;

use super::scratch;
use crate::common::{coldplate, json, message, write};

const HEADER: &str = "test,coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC],motor [degC]";
/// 30 W through 2 and 4 W/K: 22.5 K above the ambient temperature.
const ROWS: &str = "a,2,20,1000,22,45.5\nb,2,20.5,1000,25,46.5\n";

fn predict(folder: &Path, name: &str, data: impl AsRef<[u8]>, toml: Option<&str>) -> std::process::Output {
    let machine = write(folder, "nodes.toml", SERIES);
    let data = write(folder, name, data);
    let _ = std::fs::remove_file(folder.join(name).with_extension("toml"));
    if let Some(toml) = toml {
        write(folder, &format!("{}.toml", name.split('.').next().unwrap()), toml);
    }
    coldplate(&["predict", &machine, &data, "--from", "22 degC", "--json", "--keep-all"])
}

/// Measured values of the motor, degC.
fn measured(found: &Value) -> Vec<f64> {
    found["readings"].as_array().unwrap().iter().map(|r| r["measured_degC"].as_f64().unwrap()).collect()
}

#[test]
fn every_spelling_gives_the_same_readings() {
    let folder = scratch("spellings");
    let plain = format!("{HEADER}\n{ROWS}");
    let german = plain.replace(',', ";").replace("20.5", "20,5").replace("5.5", "5,5").replace("6.5", "6,5");
    for (data, said) in [
        (plain.clone().into_bytes(), "3 lines seen: 2 rows"),
        (plain.replace(" [degC]", " / °C").into_bytes(), "'motor / °C' as 'motor [°C]'"),
        (plain.replace(" [degC]", "_degC").into_bytes(), "'motor_degC' as 'motor [degC]'"),
        (plain.replace("motor [", "Motor [").replace("coolant_flow", "Coolant flow").into_bytes(), "'Motor' as 'motor'"),
        (plain.replace(',', "|").into_bytes(), "separated by '|'"),
        (plain.replace(",45.5", ",45.5 °C").into_bytes(), "1 number has a unit in the cells of 'motor [degC]'"),
        (plain.replace(",45.5", ",113.9 °F").into_bytes(), "1 number has a unit"),
        (format!("{plain}Mean,2,20.25,1000,23.5,46\nEnd of file\n").into_bytes(), "a statistic of the rows above"),
        (german.replace(';', "\t").into_bytes(), "separated by tabs"),
        (format!("Logger X\nserial 12\n\n{plain}").into_bytes(), "lines 1, 2 were left out: above the header"),
        (plain.replace("\nb,", "\n# a remark\nb,").into_bytes(), "a remark behind '#'"),
        (
            plain.replace("test,", "test,remarks,").replace("\na,", "\na,warm,").replace("\nb,", "\nb,cold,").into_bytes(),
            "left out: 'remarks'",
        ),
    ] {
        let output = predict(&folder, "data.csv", &data, None);
        let told = message(&output);
        assert_eq!(output.status.code(), Some(0), "{}\n{told}", String::from_utf8_lossy(&data));
        let found = json(&output);
        let read = measured(&found);
        let is_near = read.iter().zip([45.5, 46.5]).all(|(read, own)| (read - own).abs() < 1e-9);
        assert!(read.len() == 2 && is_near, "{} {read:?}", String::from_utf8_lossy(&data));
        assert!(told.contains(said), "no '{said}' in {told}");
        let notes: Vec<&str> = found["account"]["notes"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
        assert!(notes.iter().any(|note| note.contains(said)), "{said}: {notes:?}");
        assert_eq!((found["account"]["rows"].as_u64(), found["account"]["readings"].as_u64()), (Some(2), Some(2)));
    }
}

#[test]
fn what_cannot_be_known_is_refused_with_the_remedy() {
    let folder = scratch("not_known");
    let log = "time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC],motor [degC]";
    let row = |time: &str| format!("{time},2,20,1000,22,30\n");
    let hour = ["2400", "3000", "3600", "4200", "4800", "5400", "2400", "3000"].map(row).concat();
    let stamps = ["2024-10-27 01:30", "2024-10-27 02:00", "2024-10-27 02:30", "2024-10-27 02:00", "2024-10-27 02:30", "2024-10-27 03:00"];
    let stamped = stamps.map(row).concat();
    for (data, needles) in [
        (format!("{log}\n{hour}"), ["data.csv:8", "one hour stands twice"]),
        (format!("{log}\n{stamped}"), ["data.csv:5", "zone = "]),
        (format!("{log}\n{}{}", row("01/02/2024 10:00"), row("02/02/2024 10:00")), ["01/02/2024", "year-month-day"]),
        (format!("{log}\n{}{}", row("0"), "60,2,20,1000,22,12:30"), ["data.csv:3", "12:30"]),
    ] {
        let output = predict(&folder, "data.csv", &data, None);
        let told = message(&output);
        assert_eq!(output.status.code(), Some(2), "{data}\n{told}");
        needles.iter().for_each(|needle| assert!(told.contains(needle), "no '{needle}' for\n{data}\n{told}"));
    }
    // With the zone, the hour that stands twice is read.
    let output = predict(&folder, "data.csv", format!("{log}\n{stamped}"), Some("zone = \"Europe/Berlin\"\n"));
    assert_eq!(output.status.code(), Some(0), "{}", message(&output));
    let times: Vec<f64> = json(&output)["readings"].as_array().unwrap().iter().map(|r| r["time_s"].as_f64().unwrap()).collect();
    assert_eq!(times, [0.0, 1800.0, 3600.0, 5400.0, 7200.0, 9000.0]);
}

#[test]
fn a_sheet_of_a_workbook_is_a_log() {
    let folder = scratch("workbook");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/identify/loggers/book.xlsx"), folder.join("book.xlsx"))
        .unwrap();
    let defaults = "[variables]\nambient_temperature = \"22 degC\"\nmotor_speed = \"1000 rpm\"\n[node.base]";
    let machine = write(&folder, "nodes.toml", SERIES.replace("[node.base]", defaults));
    let book = folder.join("book.xlsx#March").display().to_string();
    let output = coldplate(&["predict", &machine, &book, "--from", "22 degC", "--json", "--keep-all"]);
    let told = message(&output);
    assert_eq!(output.status.code(), Some(0), "{told}");
    let found = json(&output);
    assert_eq!(measured(&found), [44.5, 44.25]);
    let time = found["readings"][1]["time_s"].as_f64().unwrap();
    assert!((time - 60.0).abs() < 2e-3, "{time}");
    for said in ["sheet 'March' of 2", "time runs from 2024-05-01 10:00:00", "'#N/A' once", "'who'"] {
        assert!(told.contains(said), "no '{said}' in {told}");
    }
    let other = coldplate(&["predict", &machine, &folder.join("book.xlsx#Marhc").display().to_string()]);
    assert!(other.status.code() == Some(2) && message(&other).contains("did you mean 'March'"), "{}", message(&other));
}

/// Workbooks of other programs; sheets, formats and formulas that hide something.
#[test]
fn every_workbook_is_read_as_it_is_shown() {
    let folder = scratch("workbooks");
    let defaults = "[variables]\nambient_temperature = \"22 degC\"\nmotor_speed = \"1000 rpm\"\nshare = { unit = \"1\", default = \"1\" }\n[node.base]";
    let machine = write(&folder, "nodes.toml", SERIES.replace("[node.base]", defaults));
    let predict = |name: &str| {
        std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/identify/loggers").join(name), folder.join(name)).unwrap();
        coldplate(&["predict", &machine, &folder.join(name).display().to_string(), "--json", "--keep-all"])
    };
    for name in ["book.xls", "book.ods", "percent.xlsx"] {
        let output = predict(name);
        assert_eq!(output.status.code(), Some(0), "{name}: {}", message(&output));
        assert_eq!(measured(&json(&output)), [44.5, 44.25], "{name}");
    }
    let told = message(&predict("percent.xlsx"));
    for said in ["sheet 'Data' of 2 was read", "2 numbers have a unit in the cells of 'share [1]' ('25%' in line 2)"] {
        assert!(told.contains(said), "no '{said}' in {told}");
    }
    let output = predict("formulas.xlsx");
    let told = message(&output);
    for said in ["formulas.xlsx:2", "have no values", "=40+4.5", "save it"] {
        assert!(output.status.code() == Some(2) && told.contains(said), "no '{said}' in {told}");
    }
}

/// A heater that a relay switches every five minutes, logged once a minute: between two rows it does not fade.
#[test]
fn a_relay_is_held_between_two_rows() {
    let folder = scratch("relay");
    let machine = SERIES.replace("power = \"30 W\"", "power = \"0.03 * motor_speed_rpm\"").replace("1000 J/K", "60 J/K");
    let machine = write(&folder, "nodes.toml", machine);
    let header = "time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
    let rows: String = (0..60).map(|r| format!("{},2,20,{},22\n", 60 * r, if r / 5 % 2 == 0 { 2000 } else { 0 })).collect();
    let schedule = write(&folder, "schedule.csv", format!("{header}\n{rows}"));
    let log = folder.join("log.csv").display().to_string();
    let ran = coldplate(&["simulate", &machine, &schedule, "--hold", "--from", "22 degC", "--every", "60 s", "--out", &log]);
    assert_eq!(ran.status.code(), Some(0), "{}", message(&ran));
    let rmse = |toml: Option<&str>| {
        let _ = std::fs::remove_file(folder.join("log.toml"));
        if let Some(toml) = toml {
            write(&folder, "log.toml", toml);
        }
        let output = coldplate(&["predict", &machine, &log, "--from", "22 degC", "--json", "--keep-all"]);
        assert_eq!(output.status.code(), Some(0), "{}", message(&output));
        (json(&output)["all"]["rmse_K"].as_f64().unwrap(), message(&output))
    };
    let (held, told) = rmse(None);
    assert!(held < 0.01 && told.contains("between two rows 'motor_speed' is held (it has 2 levels"), "{held} {told}");
    let (joined, told) = rmse(Some("joined = [\"motor_speed\"]\n"));
    assert!(joined > 0.5 && told.contains("'motor_speed' runs straight"), "{joined} {told}");
    let (stated, _) = rmse(Some("held = [\"motor_speed\"]\n"));
    assert!((stated - held).abs() < 1e-12);
    let unknown = write(&folder, "log.toml", "held = [\"motor_sped\"]\n");
    let output = coldplate(&["predict", &machine, &log, "--from", "22 degC"]);
    assert!(output.status.code() == Some(2) && message(&output).contains("did you mean 'motor_speed'"), "{unknown} {}", message(&output));
}

/// Stretches of a value of the logger's own are no readings, in all commands that read data.
#[test]
fn stretches_of_an_error_value_are_left_out() {
    let folder = scratch("error_values");
    let machine = write(&folder, "nodes.toml", SERIES);
    let header = "time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
    let schedule = write(&folder, "schedule.csv", format!("{header}\n0,2,20,1000,22\n3000,2,20,1000,22\n"));
    let log = folder.join("log.csv").display().to_string();
    coldplate(&["simulate", &machine, &schedule, "--from", "22 degC", "--every", "60 s", "--out", &log]);
    let text = std::fs::read_to_string(&log).unwrap();
    let columns: Vec<&str> = text.lines().find(|l| l.starts_with("time")).unwrap().split(',').collect();
    let motor = columns.iter().position(|c| *c == "motor [degC]").unwrap();
    let spoilt: Vec<String> = (text.lines().enumerate())
        .map(|(n, line)| {
            let mut cells: Vec<&str> = line.split(',').collect();
            if (20..27).contains(&n) {
                cells[motor] = "988.79";
            }
            cells.join(",")
        })
        .collect();
    write(&folder, "log.csv", spoilt.join("\n") + "\n");
    let found = json(&coldplate(&["predict", &machine, &log, "--from", "22 degC", "--json"]));
    let faults = found["faults"].as_array().unwrap();
    assert_eq!((faults.len(), faults[0]["kind"].as_str(), faults[0]["readings"].as_u64()), (1, Some("error_value"), Some(7)), "{faults:?}");
    assert!(found["all"]["rmse_K"].as_f64().unwrap() < 0.01, "{}", found["all"]);
}

const LOG: &str = "time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC],motor [degC]";

fn log_of(header: &str, rows: impl IntoIterator<Item = (String, f64)>) -> String {
    let rows: String = rows.into_iter().map(|(time, motor)| format!("{time},2,20,1000,22,{motor}\n")).collect();
    format!("{header}\n{rows}")
}

/// Times in whole seconds of a logger that reads five times a second are spread; single repeats are second readings.
#[test]
fn times_that_repeat_are_spread_or_counted() {
    let folder = scratch("repeated");
    let fast = log_of(LOG, (0..40).map(|n| ((n / 5).to_string(), 30.0 + 0.01 * f64::from(n))));
    let output = predict(&folder, "data.csv", fast, None);
    let told = message(&output);
    assert!(told.contains("about 5 rows in each 1 s, which are spread evenly"), "{told}");
    let found = json(&output);
    let times: Vec<f64> = found["readings"].as_array().unwrap().iter().map(|r| r["time_s"].as_f64().unwrap()).collect();
    assert!(times.len() == 40 && times.iter().enumerate().all(|(n, t)| (t - 0.2 * n as f64).abs() < 1e-9), "{times:?}");
    let notes = found["account"]["notes"].to_string();
    assert!(notes.contains("spread evenly"), "{notes}");
    let twice = log_of(LOG, [("0", 30.0), ("60", 31.0), ("60", 31.5), ("120", 32.0)].map(|(t, v)| (t.to_string(), v)));
    let output = predict(&folder, "data.csv", twice, None);
    assert!(message(&output).contains("1 row stands at the time of the row above"), "{}", message(&output));
    assert_eq!(measured(&json(&output)), [30.0, 31.0, 31.5, 32.0]);
}

/// Columns of times without a unit are asked for; a table of them is never a steady one.
#[test]
fn times_without_a_unit_are_asked_for_or_read() {
    let folder = scratch("bare-times");
    let log = |name: &str, step: f64| log_of(&LOG.replace("time [s]", name), (0..30).map(|n| ((step * f64::from(n)).to_string(), 30.0)));
    for (name, step) in [("t", 1.0), ("X_Value", 0.5), ("elapsed", 10.0), ("Untitled", 0.25), ("duration [s]", 10.0)] {
        let output = predict(&folder, "data.csv", log(name, step), None);
        let told = message(&output);
        assert!(output.status.code() == Some(2) && told.contains("data.csv") && told.contains("time [s]"), "{name}: {told}");
    }
    for (name, seconds) in [("seconds", 1.0), ("Minuten", 60.0), ("Time [min]", 60.0), ("Zeit (s)", 1.0), ("elapsed_h", 3600.0)] {
        let output = predict(&folder, "data.csv", log(name, 2.0), None);
        assert_eq!(output.status.code(), Some(0), "{name}: {}", message(&output));
        let found = json(&output);
        assert_eq!(found["readings"][3]["time_s"].as_f64(), Some(6.0 * seconds), "{name}");
        assert!(!found["account"]["assumed"].as_array().unwrap().is_empty(), "{name}");
    }
    // The number of a row is no time.
    let output = predict(&folder, "data.csv", log("Nr.", 1.0), None);
    assert!(output.status.code() == Some(0) && message(&output).contains("left out: 'Nr.'"), "{}", message(&output));
}

/// Numbers for no reading, sensors that the machine has not, and a clock set back in the first hour.
#[test]
fn signs_surplus_sensors_and_clocks() {
    let folder = scratch("signs");
    let data = format!("{HEADER},spare [degC],note\na,2,20,1000,22,45.5,21,x\nb,2,20.5,1000,25,-999,20,\nc,2,20.5,1000,25,-9999,20,\n");
    let output = predict(&folder, "data.csv", data, None);
    let told = message(&output);
    for said in [
        "row 2 (line 3) and 1 more, 'motor': -999 is the sign of a sensor",
        "columns with a unit that name nothing of this machine were left out: 'spare [degC]'",
        "left out: 'note'",
    ] {
        assert!(told.contains(said), "no '{said}' in {told}");
    }
    assert_eq!(measured(&json(&output)), [45.5]);
    let row = |time: &str| (time.to_string(), 30.0);
    let stamps = ["2024-10-27 02:50", "2024-10-27 02:00", "2024-10-27 02:10", "2024-10-27 02:20"].map(row);
    let output = predict(&folder, "data.csv", log_of(LOG, stamps), None);
    let told = message(&output);
    assert!(output.status.code() == Some(2) && told.contains("data.csv:3") && told.contains("one hour stands twice"), "{told}");
}
