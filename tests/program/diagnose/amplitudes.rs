//! `--amplitudes`: places and kinds by the amplitude that every row asks for.

use super::scratch;
use crate::common::{coldplate, json, write};

/// Three masses, of which the nut has a heat that follows no variable by any power: 20 W at middle speeds alone.
const MACHINE: &str = r#"
name = "Three masses in a room"
[node.room]
temperature = "ambient_temperature"
[node.motor]
capacity = "300 J/K"
[node.nut]
capacity = "150 J/K"
[node.frame]
capacity = "900 J/K"
[contact.motor_frame]
between = ["motor", "frame"]
total_conductance = "2 W/K"
[contact.nut_frame]
between = ["nut", "frame"]
total_conductance = "1.5 W/K"
[contact.frame_room]
between = ["frame", "room"]
total_conductance = "4 W/K"
[source.motor]
in = "motor"
power = "0.04 * motor_speed_rpm"
[sensor.motor]
node = "motor"
[sensor.nut]
node = "nut"
[sensor.frame]
node = "frame"
"#;

/// Steady readings to a hundredth of a kelvin, by hand: the frame takes all heat to the room.
fn rows() -> String {
    let mut text = "test,motor_speed [rpm],ambient_temperature [degC],motor [degC],nut [degC],frame [degC]\n".to_string();
    for (i, rpm) in [400.0f64, 700.0, 1000.0, 1300.0, 1600.0, 1900.0, 2200.0, 2500.0].into_iter().enumerate() {
        let (motor, nut) = (0.04 * rpm, extra(rpm));
        let frame = 20.0 + (motor + nut) / 4.0;
        text += &format!("t{i},{rpm},20,{:.2},{:.2},{frame:.2}\n", frame + motor / 2.0, frame + nut / 1.5);
    }
    text
}

fn extra(rpm: f64) -> f64 {
    20.0 * (-((rpm - 1400.0) / 300.0).powi(2)).exp()
}

#[test]
fn a_heat_by_no_known_law_is_found_with_its_curve() {
    let folder = scratch("amplitudes");
    let (machine, table) = (write(&folder, "masses.toml", MACHINE), write(&folder, "rows.csv", rows()));
    let found = json(&coldplate(&["diagnose", &machine, &table, "--amplitudes", "--json", "--quiet"]));
    let first = &found["amplitudes"]["sets"][0];
    let cause = &first["causes"][0];
    assert_eq!((&cause["kind"], &cause["place"]), (&"heat source".into(), &"nut".into()), "{first}");
    assert_eq!(first["causes"].as_array().unwrap().len(), 1, "{first}");
    assert!(cause["free"] == true || cause["over"] == "motor_speed", "{first}");
    for (row, rpm) in cause["rows"].as_array().unwrap().iter().zip([400.0, 700.0, 1000.0, 1300.0, 1600.0, 1900.0, 2200.0, 2500.0]) {
        let (low, high) = (row["amplitude"]["low"].as_f64().unwrap(), row["amplitude"]["high"].as_f64().unwrap());
        // An interval of 90 % widened by half: no row may lie far outside.
        let slack = 0.5 * (high - low);
        assert!(low - slack < extra(rpm) && extra(rpm) < high + slack, "{row} for {:.2} W", extra(rpm));
        assert_eq!(row["amplitude"]["unit"], "W");
    }
    assert!(found["amplitudes"]["settings"]["expected_causes"].is_number());
    let text = coldplate(&["diagnose", &machine, &table, "--amplitudes", "--quiet"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("by amplitude alone") && text.contains("heat source at nut"), "{text}");
}

/// A log by small steps of the balance: the contact of the nut opens with the time, to a third.
fn log() -> String {
    let mut text = "time [s],motor_speed [rpm],ambient_temperature [degC],motor [degC],nut [degC],frame [degC]\n".to_string();
    let (mut motor, mut nut, mut frame) = (20.0f64, 20.0f64, 20.0f64);
    let rpm = |time: f64| if ((time / 1500.0) as usize).is_multiple_of(2) { 2500.0 } else { 800.0 };
    for second in 0..=6000 {
        let time = f64::from(second);
        if second % 60 == 0 {
            text += &format!("{time},{},20,{motor:.3},{nut:.3},{frame:.3}\n", rpm(time));
        }
        let (of_motor, of_nut) = (2.0 * (motor - frame), 1.5 * opened(time) * (nut - frame));
        let power = 0.04
            * (rpm(60.0 * (time / 60.0).floor())
                + (time / 60.0).fract() * (rpm(60.0 * ((time / 60.0).floor() + 1.0)) - rpm(60.0 * (time / 60.0).floor())));
        motor += (power - of_motor) / 300.0;
        nut += (30.0 - of_nut) / 150.0;
        frame += (of_motor + of_nut - 4.0 * (frame - 20.0)) / 900.0;
    }
    text
}

/// Share of the contact that is left.
fn opened(time: f64) -> f64 {
    (-1.1 * time / 6000.0).exp()
}

#[test]
fn a_contact_of_a_log_is_found_with_its_course() {
    let folder = scratch("amplitudes-log");
    let heated = format!("{MACHINE}[source.nut]\nin = \"nut\"\npower = \"30 W\"\n");
    let (machine, table) = (write(&folder, "masses.toml", heated), write(&folder, "log.csv", log()));
    let arguments = ["diagnose", &machine, &table, "--joined", "motor_speed", "--amplitudes", "--from", "parts", "--quiet"];
    let found = json(&coldplate(&[&arguments[..], &["--json"]].concat()));
    let first = &found["amplitudes"]["sets"][0]["causes"];
    assert_eq!(first.as_array().map(Vec::len), Some(1), "{first}");
    let cause = &first[0];
    assert_eq!((cause["kind"].as_str(), cause["place"].as_str()), (Some("contact conductance"), Some("nut_frame")), "{cause}");
    assert_eq!(cause["over"], "time");
    for row in cause["rows"].as_array().unwrap().iter().step_by(10) {
        let (time, value) = (row["time_s"].as_f64().unwrap(), row["amplitude"]["value"].as_f64().unwrap());
        assert!((value / opened(time) - 1.0).abs() < 0.15, "{value} for {} at {time} s", opened(time));
    }
    let text = coldplate(&arguments);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("by amplitude alone, free in time") && text.contains("runs with time"), "{text}");
}

/// A number that was typed wrong is named with its line, and the cause beside it is found.
#[test]
fn a_reading_that_is_grossly_wrong_is_set_aside() {
    let folder = scratch("amplitudes-gross");
    let wrong = rows().replace("t5,1900,20,", "t5,1900,20,1");
    let (machine, table) = (write(&folder, "masses.toml", MACHINE), write(&folder, "rows.csv", wrong));
    let found = json(&coldplate(&["diagnose", &machine, &table, "--amplitudes", "--json", "--quiet"]));
    let first = &found["amplitudes"]["sets"][0];
    let own = &first["set_aside"][0];
    assert_eq!((&own["test"], &own["sensor"], &own["line"]), (&"t5".into(), &"motor".into(), &7.into()), "{first}");
    assert!((own["off"].as_f64().unwrap() - 100.0).abs() < 1.0, "{first}");
    assert_eq!((&first["causes"][0]["kind"], &first["causes"][0]["place"]), (&"heat source".into(), &"nut".into()), "{first}");
    let text = coldplate(&["diagnose", &machine, &table, "--amplitudes", "--quiet"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("set aside: the reading of motor in t5 (line 7): 100.0 K more than the others say"), "{text}");
}
