//! Faulty readings, by the commands that leave them out.

use coldplate_testing::two_masses::{LUMPED, log};

use super::scratch;
use crate::common::{coldplate, json, message, write};

/// The commands name the fault, go on without it, and keep it where that is asked for.
#[test]
fn commands_say_what_they_leave_out() {
    let folder = scratch("faults");
    let machine = write(&folder, "lumped.toml", LUMPED);
    let (_, mut data, _) = log(&[], 40);
    data.rows[50].readings[1] = Some(273.15 + 85.0);
    let mut text = String::from("time [s],motor_speed [rpm],motor [degC],nut [degC],foot [degC]\n");
    for row in &data.rows {
        let readings: Vec<String> = row.readings.iter().flatten().map(|t| format!("{:.2}", t - 273.15)).collect();
        text += &format!("{},{:.3},{}\n", row.time.unwrap(), row.condition.si()[2] * 60.0 / std::f64::consts::TAU, readings.join(","));
    }
    let table = write(&folder, "readings.csv", text);
    write(&folder, "readings.toml", "kind = \"standard deviations\"\nnoise = \"0.05 K\"\n");
    for command in [&["predict"][..], &["diagnose"], &["identify", "--free", "contact.motor_nut.total_conductance", "--brief"]] {
        let asked = |more: &[&str]| coldplate(&[&[command[0], machine.as_str(), table.as_str(), "--quiet"], &command[1..], more].concat());
        let found = json(&asked(&["--json"]));
        let faults = found["faults"].as_array().unwrap();
        assert_eq!(faults.len(), 1, "{command:?}: {faults:#?}");
        let one = &faults[0];
        assert_eq!(
            (&one["kind"], &one["row"], &one["line"], &one["sensor"]),
            (&"wrong_reading".into(), &51.into(), &52.into(), &"nut".into())
        );
        assert_eq!((&one["left_out"], found["readings"].as_array().unwrap().len()), (&true.into(), 542), "{command:?}");
        let said = asked(&[]);
        let said = String::from_utf8_lossy(&said.stdout);
        assert!(said.contains("row 51 (line 52), 'nut': 85.0 degC is ") && said.contains("left out"), "{command:?}: {said}");
        if command[0] != "diagnose" {
            let kept = json(&asked(&["--json", "--keep-all"]));
            assert_eq!((kept["faults"].as_array().unwrap().len(), kept["readings"].as_array().unwrap().len()), (0, 543), "{command:?}");
        }
    }
}

/// Two rows at one time whose conditions differ are a step; -127 degC is no answer.
#[test]
fn steps_and_signs_in_a_file() {
    let folder = scratch("steps");
    let machine = write(&folder, "lumped.toml", LUMPED);
    let rows = "0,500,30,28,26\n60,500,30.1,28.1,26\n60,2500,30.1,28.1,26\n120,2500,35,-127,27\n120,2500,35,-127,27\n180,2500,38,32,28\n";
    let table = write(&folder, "step.csv", format!("time [s],motor_speed [rpm],motor [degC],nut [degC],foot [degC]\n{rows}"));
    let output = coldplate(&["predict", &machine, &table, "--json", "--from", "readings"]);
    let (found, said) = (json(&output), message(&output));
    assert_eq!(found["readings"].as_array().unwrap().len(), 11, "{found:#}");
    assert!(said.contains("'nut': -127 is the sign of a sensor that does not answer"), "{said}");
    assert_eq!(found["faults"][0]["kind"], "duplicate_row");
    assert_eq!(found["faults"][0]["line"], 6);
    let twice = write(&folder, "twice.csv", "time [s],motor_speed [rpm],motor [degC]\n0,500,30\n60,500,31\n60,500,32\n");
    let output = coldplate(&["predict", &machine, &twice]);
    assert!(
        output.status.code() == Some(0) && message(&output).contains("1 row stands at the time of the row above"),
        "{}",
        message(&output)
    );
}
