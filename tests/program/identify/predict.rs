//! `coldplate predict`: predictions beside readings, nothing fitted.

use coldplate_testing::machines::SERIES;

use super::scratch;
use crate::common::{coldplate, json, message, write};

const HEADER: &str = "test,coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";

/// 30 W through 2 and 4 W/K: middle 15 K and motor 22.5 K above the ambient temperature.
#[test]
fn steady_readings_have_their_residuals_and_nothing_is_written() {
    let folder = scratch("predict");
    let machine = write(&folder, "nodes.toml", SERIES);
    let data =
        write(&folder, "data.csv", format!("{HEADER},motor [degC],middle [degC]\nfirst,2,20,1000,22,45.5,37\nsecond,2,20,1000,25,,39\n"));
    let found = json(&coldplate(&["predict", &machine, &data, "--json"]));
    let near = |found: &serde_json::Value, wanted: f64| assert!((found.as_f64().unwrap() - wanted).abs() < 1e-6, "{found} {wanted}");
    // Measured less predicted: +1 and 0 in the first test, -1 in the second.
    let readings = found["readings"].as_array().unwrap();
    assert_eq!(readings.len(), 3);
    for (reading, (sensor, predicted, residual)) in
        readings.iter().zip([("motor", 44.5, 1.0), ("middle", 37.0, 0.0), ("middle", 40.0, -1.0)])
    {
        assert_eq!(reading["sensor"], sensor);
        near(&reading["predicted_degC"], predicted);
        near(&reading["residual_K"], residual);
    }
    near(&found["tests"]["first"]["rmse_K"], 0.5f64.sqrt());
    near(&found["tests"]["second"]["mean_K"], -1.0);
    near(&found["sensors"]["middle"]["rmse_K"], 0.5f64.sqrt());
    near(&found["sensors"]["motor"]["largest_K"], 1.0);
    near(&found["all"]["rmse_K"], (2.0f64 / 3.0).sqrt());
    assert_eq!(found["all"]["readings"], 3);

    let text = coldplate(&["predict", &machine, &data, "--quiet"]);
    assert!(text.stderr.is_empty(), "{}", message(&text));
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    for word in ["44.50", "+1.00", "-1.00", "0.707", "3 readings: RMSE 0.816 K", "second", "middle"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    // One test, one sensor less, another value.
    let part =
        coldplate(&["predict", &machine, &data, "--use", "first", "--without", "motor", "--set", "source.motor.power=34 W", "--json"]);
    near(&json(&part)["all"]["mean_K"], -2.0);
    // Nothing but the two files is there.
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);

    let csv = coldplate(&["predict", &machine, &data, "--csv"]);
    let csv = String::from_utf8_lossy(&csv.stdout).into_owned();
    let header = csv.lines().find(|l| l.starts_with("test")).unwrap();
    assert!(
        header
            .ends_with("motor [degC],motor predicted [degC],motor residual [K],middle [degC],middle predicted [degC],middle residual [K]"),
        "{header}"
    );
    let second: Vec<&str> = csv.lines().find(|l| l.starts_with("second")).unwrap().split(',').collect();
    assert_eq!(second[5..8], ["", "", ""], "a missing reading has no residual");
    let table = folder.join("compared.csv");
    let wrote = coldplate(&["predict", &machine, &data, "--out", table.to_str().unwrap()]);
    assert_eq!(wrote.status.code(), Some(0), "{}", message(&wrote));
    assert_eq!(std::fs::read_to_string(&table).unwrap().trim_end(), csv.trim_end());
    let refused = coldplate(&["predict", &machine, &data, "--out", &data]);
    assert!(refused.status.code() == Some(2) && message(&refused).contains("inputs are kept"), "{}", message(&refused));
}

/// A node of 1000 J/K behind 4 W/K in front of 2 W/K: a log that begins at 22 degC everywhere.
#[test]
fn logs_are_run_from_where_they_say() {
    let folder = scratch("predict-log");
    let one_node = "name = \"one node\"\n[node.base]\ntemperature = \"ambient_temperature\"\n[node.motor]\ncapacity = \"1000 J/K\"\n\
                    [contact.first]\nbetween = [\"base\", \"motor\"]\ntotal_conductance = \"2 W/K\"\n[source.motor]\nin = \"motor\"\n\
                    power = \"30 W\"\n[sensor.motor]\nnode = \"motor\"\n";
    let machine = write(&folder, "node.toml", one_node);
    let header = HEADER.replacen("test", "test,time [s]", 1);
    let rows: String =
        [0, 250, 500, 1000].map(|t| format!("warm,{t},2,20,1000,22,{}\n", 22.0 + 15.0 * (1.0 - (-f64::from(t) / 500.0).exp()))).concat();
    let data = write(&folder, "log.csv", format!("{header},motor [degC]\n{rows}"));
    for from in ["22 degC", "readings"] {
        let found = json(&coldplate(&["predict", &machine, &data, "--from", from, "--json"]));
        assert!(found["all"]["largest_K"].as_f64().unwrap().abs() < 2e-3, "{from}: {}", found["all"]);
        assert_eq!(found["readings"][2]["time_s"], 500.0);
    }
    let steady = json(&coldplate(&["predict", &machine, &data, "--json"]));
    assert!((steady["readings"][0]["residual_K"].as_f64().unwrap() + 15.0).abs() < 1e-6);
    let text = coldplate(&["predict", &machine, &data, "--from", "readings"]);
    assert!(String::from_utf8_lossy(&text.stdout).contains("4 readings: RMSE 0.00"), "{}", String::from_utf8_lossy(&text.stdout));
}
