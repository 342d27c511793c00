//! Conditions between two rows of a log: held or joined, as the command line, a header or the file beside the data says.

use coldplate_testing::machines::SERIES;

use super::scratch;
use crate::common::{coldplate, json, message, write};

/// A heater that is switched once, halfway through a log of one row a minute.
#[test]
fn a_single_step_is_joined_with_a_word_and_every_statement_is_heard() {
    let folder = scratch("between");
    let machine = SERIES.replace("power = \"30 W\"", "power = \"0.03 * motor_speed_rpm\"").replace("1000 J/K", "60 J/K");
    let machine = write(&folder, "nodes.toml", machine);
    let header = "time [s],coolant_flow [L/min],coolant_temperature [degC],motor_speed [rpm],ambient_temperature [degC]";
    let rows: String = (0..40).map(|r| format!("{},2,20,{},22\n", 60 * r, if r < 20 { 2000 } else { 0 })).collect();
    let schedule = write(&folder, "schedule.csv", format!("{header}\n{rows}"));
    let log = folder.join("log.csv").display().to_string();
    let ran = coldplate(&["simulate", &machine, &schedule, "--hold", "--from", "22 degC", "--every", "60 s", "--out", &log]);
    assert_eq!(ran.status.code(), Some(0), "{}", message(&ran));
    let text = std::fs::read_to_string(&log).unwrap();
    let told = |text: &str, toml: Option<&str>, options: &[&str]| {
        write(&folder, "log.csv", text);
        let _ = std::fs::remove_file(folder.join("log.toml"));
        if let Some(toml) = toml {
            write(&folder, "log.toml", toml);
        }
        coldplate(&[&["predict", &machine, &log, "--from", "22 degC", "--json", "--keep-all"][..], options].concat())
    };
    let by_header = |word: &str| text.replace("motor_speed [rpm]", &format!("\"motor_speed [rpm, {word}]\""));
    let (held, joined) = ("held = [\"motor_speed\"]\n", "joined = [\"motor_speed\"]\n");
    for (text, toml, options, is_held, said) in [
        (text.clone(), None, &[][..], false, "'motor_speed' runs straight (--held motor_speed if it steps)"),
        (text.clone(), None, &["--joined", "motor_speed"], false, "runs straight, as the command line says"),
        (text.clone(), Some(joined), &[], false, "runs straight, as the file beside the data says"),
        (text.clone(), Some(joined), &["--held", "motor_speed"], true, "is held, as the command line says"),
        (by_header("held"), None, &[], true, "is held, as its header says"),
        (by_header("joined"), None, &[], false, "runs straight, as its header says"),
        (by_header("joined"), Some(held), &["--held", "motor_speed"], true, "is held, as the command line says"),
    ] {
        let output = told(&text, toml, options);
        assert!(output.status.code() == Some(0) && message(&output).contains(said), "no '{said}' in {}", message(&output));
        let rmse = json(&output)["all"]["rmse_K"].as_f64().unwrap();
        assert!(if is_held { rmse < 0.01 } else { rmse > 0.2 }, "{said}: {rmse}");
    }
    for (text, toml, options, needle) in [
        (by_header("held"), Some(joined), &[][..], "held by its header and joined by the file"),
        (text.clone(), None, &["--held", "motor_speed", "--joined", "motor_speed"], "as held and as joined"),
        (text.clone(), None, &["--held", "motor_sped"], "did you mean 'motor_speed'"),
    ] {
        let output = told(&text, toml, options);
        assert!(output.status.code() == Some(2) && message(&output).contains(needle), "no '{needle}' in {}", message(&output));
    }
    // A schedule of `simulate` has the same words in its header.
    let stepped = write(&folder, "stepped.csv", format!("{}\n{rows}", header.replace("motor_speed [rpm]", "motor_speed [rpm held]")));
    let again = folder.join("again.csv").display().to_string();
    let ran = coldplate(&["simulate", &machine, &stepped, "--from", "22 degC", "--every", "60 s", "--out", &again]);
    assert_eq!(ran.status.code(), Some(0), "{}", message(&ran));
    write(&folder, "log.csv", std::fs::read_to_string(&again).unwrap());
    let output = coldplate(&["predict", &machine, &log, "--from", "22 degC", "--json", "--keep-all", "--held", "motor_speed"]);
    assert!(json(&output)["all"]["rmse_K"].as_f64().unwrap() < 0.01, "{}", message(&output));
}
