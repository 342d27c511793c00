//! Temperatures at the start: of parts and nodes by the file, and of logs by their own first readings.

use super::passes::NODE;
use super::{coldplate, json, scratch, write};

const USUAL: [&str; 6] = ["--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "22 degC"];

#[test]
fn parts_and_nodes_begin_where_the_file_says() {
    let folder = scratch("start");
    // A hot node cools down by itself: 22 + 38 exp(-t/500), whatever the rest begins with.
    let machine = write(&folder, "hot.toml", NODE.replacen("capacity = \"1000 J/K\"", "capacity = \"1000 J/K\"\nstart = \"60 degC\"", 1));
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,0\n1000,0\n");
    for from in ["steady", "22 degC"] {
        let args = ["simulate", &machine, &schedule, "--from", from, "--every", "500 s", "--tolerance", "1e-4 K", "--json"];
        let found = json(&coldplate(&[&args[..], &USUAL].concat()));
        let shown: Vec<f64> = found["series"]["motor"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        for (shown, t) in shown.iter().zip([0.0, 500.0, 1000.0]) {
            assert!((shown - 22.0 - 38.0 * (-t / 500.0f64).exp()).abs() < 0.01, "{from}: {shown} at {t} s");
        }
        assert!(found["energy"]["relative"].as_f64().unwrap() < 1e-8);
    }
    // A part, by a formula of the first row's condition; the other begins as --from says.
    let slab = std::fs::read_to_string("machines/slab.toml").unwrap();
    let slab = slab.replacen("[part.block]", "[part.block]\nstart = \"ambient_temperature_degC + 30\"", 1);
    let slab = write(&folder, "slab.toml", &slab);
    let args = ["simulate", &slab, &schedule, "--from", "22 degC", "--every", "1 s", "--until", "2 s", "--cells", "300", "--json"];
    let found = json(&coldplate(&[&args[..], &USUAL].concat()));
    let sensor = |name: &str| found["sensors"][name]["start_degC"].as_f64().unwrap();
    assert!((sensor("block") - 52.0).abs() < 1e-6, "{}", found["sensors"]);
    for (text, needles) in [
        (
            NODE.replacen("temperature = \"ambient_temperature\"", "temperature = \"ambient_temperature\"\nstart = \"30 degC\"", 1),
            ["start", "held"],
        ),
        (NODE.replacen("capacity = \"1000 J/K\"", "start = \"30 K/min\"", 1), ["start", "degC"]),
    ] {
        let wrong = write(&folder, "wrong.toml", &text);
        let refused = coldplate(&["check", &wrong]);
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{message}");
        needles.iter().for_each(|n| assert!(message.contains(n), "{n}: {message}"));
    }
}

/// Two nodes that share nothing, each with its own temperature in the first row of each test: `--from parts`.
#[test]
fn each_part_of_a_log_begins_at_its_own_first_readings() {
    let folder = scratch("start-parts");
    let second = NODE.lines().skip(1).collect::<Vec<_>>().join("\n").replace("motor]", "gear]").replace("\"motor\"", "\"gear\"");
    let second = second.replacen("[node.base]\ntemperature = \"ambient_temperature\"\n", "", 1).replace("contact.first", "contact.second");
    let machine = write(&folder, "two.toml", format!("{NODE}{second}\n"));
    let header = "test,time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
    let mut rows = String::new();
    for (test, motor, gear) in [("a", 60.0, 30.0), ("b", 25.0, 45.0)] {
        for t in [0.0, 250.0, 500.0, 1000.0] {
            let cooled = |from: f64| 22.0 + (from - 22.0) * (-t / 500.0f64).exp();
            rows += &format!("{test},{t},2,20,0,22,{},{}\n", cooled(motor), cooled(gear));
        }
    }
    let data = write(&folder, "log.csv", format!("{header},motor [degC],gear [degC]\n{rows}"));
    let largest = |from: &str, machine: &str| {
        let found = json(&coldplate(&["predict", machine, &data, "--from", from, "--json"]));
        found["all"]["largest_K"].as_f64().unwrap().abs()
    };
    assert!(largest("parts", &machine) < 5e-3, "{}", largest("parts", &machine));
    assert!(largest("readings", &machine) > 5.0);
    // A sensor that reads 3 K too high does not make its part begin hotter.
    let high = write(&folder, "high.toml", format!("{NODE}offset = \"3 K\"\n{second}\n"));
    let shifted: String = rows
        .lines()
        .map(|l| {
            let cells: Vec<&str> = l.split(',').collect();
            format!("{},{},{}\n", cells[..6].join(","), cells[6].parse::<f64>().unwrap() + 3.0, cells[7])
        })
        .collect();
    let other = write(&folder, "shifted.csv", format!("{header},motor [degC],gear [degC]\n{shifted}"));
    let found = json(&coldplate(&["predict", &high, &other, "--from", "parts", "--json"]));
    assert!(found["all"]["largest_K"].as_f64().unwrap().abs() < 5e-3, "{}", found["all"]);
    // The temperature at the start is a number like others: it can be found.
    let hot = write(&folder, "hot.toml", format!("{}{second}\n", NODE.replacen("1000 J/K\"", "1000 J/K\"\nstart = \"30 degC\"", 1)));
    let args = ["identify", &hot, &data, "--use", "a", "--without", "gear", "--free", "node.motor.start", "--brief", "--json"];
    let found = json(&coldplate(&[&args[..], &["--from", "22 degC"]].concat()));
    let start = found["parameters"]["node.motor.start"]["value"].as_f64().unwrap();
    assert!((start - 60.0).abs() < 0.05, "{start}");
}
