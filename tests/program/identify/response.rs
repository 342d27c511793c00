//! Sensors that lag, or have a gain or an offset of their own.

use super::scratch;
use crate::common::{coldplate, json, message, write};

/// 1000 J/K behind 2 W/K, 30 W: 15 K above the ambient temperature in the end, with a time constant of 500 s.
const NODE: &str = "name = \"one node\"\n[node.base]\ntemperature = \"ambient_temperature\"\n[node.motor]\ncapacity = \"1000 J/K\"\n\
                    [contact.first]\nbetween = [\"base\", \"motor\"]\ntotal_conductance = \"2 W/K\"\n[source.motor]\nin = \"motor\"\n\
                    power = \"30 W\"\n[limit.motor]\nsensor = \"motor\"\nmaximum = \"40 degC\"\n[sensor.motor]\nnode = \"motor\"\n";
const HEADER: &str = "test,time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";

/// What a sensor that lags by 50 s, with a gain of 0.98 and an offset of 0.3 K, shows of the motor warming up from 22 degC.
fn log() -> String {
    let shown = |t: f64| {
        let lagging = 22.0 + 15.0 * (1.0 - (500.0 * (-t / 500.0).exp() - 50.0 * (-t / 50.0).exp()) / 450.0);
        20.0 + 0.98 * (lagging - 20.0) + 0.3
    };
    let rows: String = (0..=150).map(|i| format!("warm,{},2,20,1000,22,{}\n", 10 * i, shown(10.0 * f64::from(i)))).collect();
    format!("{HEADER},motor [degC]\n{rows}")
}

#[test]
fn predictions_are_what_the_sensor_shows() {
    let folder = scratch("response");
    let plain = write(&folder, "plain.toml", NODE);
    let own = write(&folder, "own.toml", format!("{NODE}lag = \"50 s\"\noffset = \"0.3 K\"\ngain = 0.98\n"));
    let data = write(&folder, "log.csv", log());
    let rmse = |machine: &str| json(&coldplate(&["predict", machine, &data, "--from", "22 degC", "--json"]))["all"].clone();
    assert!(rmse(&own)["largest_K"].as_f64().unwrap().abs() < 3e-3, "{}", rmse(&own));
    assert!(rmse(&plain)["largest_K"].as_f64().unwrap().abs() > 0.8, "{}", rmse(&plain));

    // Over time and settled: 37 degC show as 20 + 0.98 * 17 + 0.3.
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,0\n100,0\n20000,0\n");
    let conditions = ["--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "22 degC"];
    let run = [&["simulate", &own, &schedule, "--from", "22 degC", "--every", "10 s", "--json"], &conditions[..]].concat();
    let found = json(&coldplate(&run));
    let series = found["series"]["motor"].as_array().unwrap();
    let wanted: Vec<f64> = log().lines().skip(1).map(|l| l.rsplit(',').next().unwrap().parse().unwrap()).collect();
    for (shown, wanted) in series.iter().zip(&wanted).take(100) {
        assert!((shown.as_f64().unwrap() - wanted).abs() < 3e-3, "{shown} {wanted}");
    }
    assert!((found["sensors"]["motor"]["steady_degC"].as_f64().unwrap() - 36.96).abs() < 1e-6, "{}", found["sensors"]);

    // A limit judges the temperature, not the reading.
    let hot = write(&folder, "hot.toml", format!("{NODE}offset = \"10 K\"\n"));
    let solve = [&["solve", &hot, "--motor-speed", "0 rpm"], &conditions[..]].concat();
    let solved = json(&coldplate(&[&solve[..], &["--json"]].concat()));
    assert!((solved["sensors"]["motor"].as_f64().unwrap() - 37.0).abs() < 1e-9, "{solved}");
    assert!((solved["readings"]["motor"].as_f64().unwrap() - 47.0).abs() < 1e-9, "{solved}");
    assert!((solved["limits"][0]["margin"].as_f64().unwrap() - 3.0).abs() < 1e-9, "{}", solved["limits"]);
    let text = String::from_utf8_lossy(&coldplate(&solve).stdout).into_owned();
    assert!(text.contains("37.000  reads 47.000") && text.contains("kept"), "{text}");
}

#[test]
fn lag_offset_and_gain_can_be_found() {
    let folder = scratch("response-free");
    let machine = write(&folder, "plain.toml", NODE);
    let data = write(&folder, "log.csv", log());
    write(&folder, "log.toml", "kind = \"standard deviations\"\nnoise = \"0.01 K\"\nbias = \"0.001 K\"\nmodel = \"0.001 K\"\n");
    let out = folder.join("found.toml");
    let free = ["--free", "sensor.motor.lag=0 s..400 s", "--free", "sensor.motor.offset=-2 K..2 K", "--free", "sensor.motor.gain"];
    let args =
        [&["identify", &machine, &data, "--from", "22 degC", "--brief", "--json", "--out", out.to_str().unwrap()], &free[..]].concat();
    let found = json(&coldplate(&args));
    for (key, planted, near) in [("lag", 50.0, 0.5), ("offset", 0.3, 0.02), ("gain", 0.98, 0.002)] {
        let p = &found["parameters"][format!("sensor.motor.{key}")];
        assert!((p["value"].as_f64().unwrap() - planted).abs() < near, "{key}: {p}");
    }
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("lag = \"") && text.contains("offset = \"") && text.contains("gain = \"0.9"), "{text}");
    let after = json(&coldplate(&["predict", out.to_str().unwrap(), &data, "--from", "22 degC", "--json"]));
    assert!(after["all"]["rmse_K"].as_f64().unwrap() < 2e-3, "{}", after["all"]);

    // In steady states, by exact derivatives: 37 and 52 degC shown as they would be.
    let steady = format!("{}\na,2,20,1000,22,36.96\nb,2,20,1000,37,51.66\n", HEADER.replace(",time [s]", "") + ",motor [degC]");
    let steady = write(&folder, "steady.csv", steady);
    let args =
        ["identify", &machine, &steady, "--brief", "--json", "--free", "sensor.motor.offset=-2 K..2 K", "--free", "sensor.motor.gain"];
    let found = json(&coldplate(&args));
    for (key, planted) in [("offset", 0.3), ("gain", 0.98)] {
        let p = &found["parameters"][format!("sensor.motor.{key}")];
        assert!((p["value"].as_f64().unwrap() - planted).abs() < 1e-4, "{key}: {p}");
    }

    for (line, needles) in [
        ("lag = \"-3 s\"", &["lag", "run ahead"][..]),
        ("gain = 0", &["gain"]),
        ("offset = \"3 degC\"", &["offset", "in K"]),
        ("laag = \"3 s\"", &["laag", "lag"]),
    ] {
        let wrong = write(&folder, "wrong.toml", format!("{NODE}{line}\n"));
        let refused = coldplate(&["check", &wrong]);
        assert_eq!(refused.status.code(), Some(2), "{line}");
        needles.iter().for_each(|n| assert!(message(&refused).contains(n), "{line}: {}", message(&refused)));
    }
}
