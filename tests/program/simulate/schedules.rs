//! Schedules good and bad, the report's shape, tables and pictures.

use super::{coldplate, json, numbers, scratch, write};

const USUAL: [&str; 6] = ["--coolant-flow", "6 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "22 degC"];

#[test]
fn mistakes_name_file_line_column_and_remedy() {
    let folder = scratch("mistakes");
    for (name, text, more, needles) in [
        ("unsorted", "time [s],motor_speed [rpm]\n0,1\n60,1\n30,1\n", &[][..], &["unsorted.csv:4", "time", "sort"][..]),
        ("empty", "", &[], &["empty.csv", "no table"]),
        ("rows", "time [s],motor_speed [rpm]\n", &[], &["no rows"]),
        ("one", "time [s],motor_speed [rpm]\n0,1\n", &[], &["one row", "--until"]),
        ("instant", "time [s],motor_speed [rpm]\n5,1\n5,2\n", &[], &["same time"]),
        ("gap", "# note\ntime [s],motor_speed [rpm]\n0,1\n60,\n", &[], &["gap.csv:4", "motor_speed [rpm]", "missing"]),
        ("nan", "time [s],motor_speed [rpm]\n0,NaN\n60,1\n", &[], &["nan.csv:2", "motor_speed"]),
        ("no-time-cell", "time [s],motor_speed [rpm]\n,1\n60,1\n", &[], &["cell.csv:2", "time"]),
        ("unit", "time [s],motor_speed [furlong]\n0,1\n60,1\n", &[], &["unit.csv:1", "motor_speed [furlong]", "furlong"]),
        ("other-unit", "time [s],motor_speed [L/min]\n0,1\n60,1\n", &[], &["motor_speed [L/min]", "rpm"]),
        ("time-unit", "time [K],motor_speed [rpm]\n0,1\n60,1\n", &[], &["unit.csv:1", "time"]),
        ("no-unit", "time [s],motor_speed\n0,1\n60,1\n", &[], &["motor_speed [unit]"]),
        ("time-no-unit", "time,motor_speed [rpm]\n0,1\n60,1\n", &[], &["time [unit]"]),
        ("no-time", "motor_speed [rpm]\n1\n2\n", &[], &["no time column", "time [s]"]),
        ("twice", "time [s],motor_speed [rpm]\n0,1\n60,1\n", &["--motor-speed", "1 rpm"], &["motor_speed", "command line"]),
        ("negative", "time [s],motor_speed [rpm],coolant_flow [L/min]\n0,1,1\n60,1,-1\n", &[], &["negative"]),
        ("until", "time [s],motor_speed [rpm]\n10,1\n60,1\n", &["--until", "5 s"], &["--until"]),
        ("repeat", "time [s],motor_speed [rpm]\n10,1\n60,1\n", &["--repeat", "0"], &["--repeat"]),
        ("every", "time [s],motor_speed [rpm]\n10,1\n60,1\n", &["--every", "0 s"], &["--every"]),
        ("chart", "time [s],motor_speed [rpm]\n10,1\n60,1\n", &["--chart", "x.pdf"], &["x.pdf", ".svg"]),
        ("from", "time [s],motor_speed [rpm]\n10,1\n60,1\n", &["--from", "20"], &["--from", "steady"]),
    ] {
        let schedule = write(&folder, &format!("{name}.csv"), text);
        let conditions: &[&str] = if name == "negative" { &USUAL[2..] } else { &USUAL };
        let output = coldplate(&[&["simulate", "machines/slab.toml", &schedule, "--cells", "300"], conditions, more].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name}: {message}");
        assert!(output.stdout.is_empty(), "{name}");
        for needle in needles {
            assert!(message.contains(needle), "{name}: '{needle}' is not in\n{message}");
        }
    }
}

/// A measured file as it is: minutes, sensor columns and text beside the conditions; its own output is read back.
#[test]
fn a_measured_file_goes_in_and_a_readable_one_comes_out() {
    let folder = scratch("measured");
    let text = "test,time [min],motor_speed [rpm],block [degC],note\na,0,0,20.1,\na,0,2000,20.1,door open\na,10,2000,,\na,20,1000,31.5,\n";
    let schedule = write(&folder, "m.csv", text);
    let (out, svg, png) = (folder.join("o.csv"), folder.join("c.svg"), folder.join("c.png"));
    let files = ["--out", out.to_str().unwrap(), "--chart", svg.to_str().unwrap()];
    let base = [&["simulate", "machines/slab.toml", &schedule, "--cells", "300", "--json", "--every", "4 min"], &USUAL[..]].concat();
    let output = coldplate(&[&base[..], &files[..]].concat());
    let report = json(&output);
    let notes = String::from_utf8_lossy(&output.stderr);
    assert!(notes.contains("block [degC]") && notes.contains("left aside"), "{notes}");
    let series = &report["series"];
    // Rows (the step twice) and every four minutes.
    assert_eq!(numbers(&series["time_s"]), [0.0, 0.0, 240.0, 480.0, 600.0, 720.0, 960.0, 1200.0]);
    for (name, sensor) in report["sensors"].as_object().unwrap() {
        let values = numbers(&series[name]);
        assert_eq!(values.len(), 8);
        assert_eq!(values[0], sensor["start_degC"].as_f64().unwrap());
        assert_eq!(values[7], sensor["end_degC"].as_f64().unwrap());
        assert!(sensor["steady_degC"].is_number() && sensor.get("within_s").is_some());
    }
    for key in ["entered_J", "left_J", "stored_J", "relative"] {
        assert!(report["energy"][key].is_number(), "{key}");
    }
    assert!(report["energy"]["relative"].as_f64().unwrap() <= 1e-8);
    assert!(report["steps"].as_u64().unwrap() > 5 && report["rejected"].is_u64() && report["seconds"].is_number());
    let table = coldplate_tables::Table::read(&out).unwrap();
    assert_eq!(rounded(&table), [0.0, 2000.0, 2000.0, 2000.0, 2000.0, 1800.0, 1400.0, 1000.0]);
    // The same digits are in both; what reads JSON here may miss the last bit of a number.
    for (csv, json) in table.column("block").unwrap().values.iter().zip(numbers(&series["block"])) {
        assert!((csv - json).abs() <= f64::EPSILON * json.abs(), "{csv} {json}");
    }
    assert_eq!((table.column("time").unwrap().unit.as_str(), table.column("block").unwrap().unit.as_str()), ("s", "degC"));
    assert!(std::fs::read_to_string(&svg).unwrap().contains("time [min]"));

    // What came out is a schedule that gives the same again.
    let again =
        ["simulate", "machines/slab.toml", out.to_str().unwrap(), "--cells", "300", "--json", "--quiet", "--chart", png.to_str().unwrap()];
    let again = json(&coldplate(&[&again[..], &["--every", "1 h"]].concat()));
    assert_eq!(again["series"]["time_s"], series["time_s"]);
    let end = |report: &serde_json::Value| report["sensors"]["block"]["end_degC"].as_f64().unwrap();
    assert!((end(&again) - end(&report)).abs() < 0.02, "{} {}", end(&again), end(&report));
    assert_eq!(&std::fs::read(&png).unwrap()[1..4], b"PNG");
}

/// Motor speeds of a table, rpm, to a millionth: units there and back leave their rounding.
fn rounded(table: &coldplate_tables::Table) -> Vec<f64> {
    table.column("motor_speed").unwrap().values.iter().map(|v| (v * 1e6).round() / 1e6).collect()
}

#[test]
fn values_are_held_repeated_and_continued() {
    let folder = scratch("shapes");
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,1000\n60,2000\n");
    let speeds = |more: &[&str]| {
        let out = folder.join("o.csv");
        let base =
            ["simulate", "machines/slab.toml", &schedule, "--cells", "300", "--every", "30 s", "--quiet", "--out", out.to_str().unwrap()];
        let output = coldplate(&[&base[..], &USUAL, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let table = coldplate_tables::Table::read(&out).unwrap();
        (table.column("time").unwrap().values.clone(), rounded(&table))
    };
    assert_eq!(speeds(&[]), (vec![0.0, 30.0, 60.0], vec![1000.0, 1500.0, 2000.0]));
    assert_eq!(speeds(&["--hold"]), (vec![0.0, 30.0, 60.0], vec![1000.0, 1000.0, 2000.0]));
    assert_eq!(
        speeds(&["--repeat", "2"]),
        (vec![0.0, 30.0, 60.0, 60.0, 90.0, 120.0], vec![1000.0, 1500.0, 2000.0, 1000.0, 1500.0, 2000.0])
    );
    assert_eq!(speeds(&["--repeat", "2", "--hold"]), (vec![0.0, 30.0, 60.0, 90.0, 120.0], vec![1000.0, 1000.0, 1000.0, 1000.0, 2000.0]));
    assert_eq!(speeds(&["--until", "2 min"]).1, [1000.0, 1500.0, 2000.0, 2000.0, 2000.0]);
    assert_eq!(speeds(&["--until", "45 s"]), (vec![0.0, 30.0, 45.0], vec![1000.0, 1500.0, 1750.0]));
}
