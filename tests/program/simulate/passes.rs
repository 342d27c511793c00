//! When a sensor passes a value: against the exponential of one node.

use super::{coldplate, json, scratch, write};

/// 1000 J/K behind 2 W/K: a time constant of 500 s; 30 W raise it by 15 K.
pub const NODE: &str = "name = \"one node\"\n[node.base]\ntemperature = \"ambient_temperature\"\n[node.motor]\ncapacity = \"1000 J/K\"\n\
                        [contact.first]\nbetween = [\"base\", \"motor\"]\ntotal_conductance = \"2 W/K\"\n[source.motor]\nin = \"motor\"\n\
                        power = \"0.03 * motor_speed_rpm\"\n[sensor.motor]\nnode = \"motor\"\n";
const USUAL: [&str; 6] = ["--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "22 degC"];

/// Warming up for 1500 s from 22 degC, then cooling down: T = 22 + 15 (1 - exp(-t/500)), and from there to 22 again.
#[test]
fn first_crossings_are_those_of_the_exponential() {
    let folder = scratch("passes");
    let machine = write(&folder, "node.toml", NODE);
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,1000\n1500,1000\n1500,0\n4000,0\n");
    let args = ["simulate", &machine, &schedule, "--from", "22 degC", "--passes", "motor=30 degC", "--passes", "motor=60 degC"];
    let args = [&args[..], &USUAL].concat();
    let rising = -500.0 * (1.0f64 - 8.0 / 15.0).ln();
    let top = 15.0 * (1.0 - (-3.0f64).exp());
    let falling = 1500.0 + 500.0 * (top / 8.0).ln();
    for (tolerance, near) in [("0.01 K", 0.5), ("1e-4 K", 0.02), ("1e-6 K", 3e-3)] {
        let found = json(&coldplate(&[&args[..], &["--tolerance", tolerance, "--json"]].concat()));
        let [first, second] = [&found["passes"][0], &found["passes"][1]];
        assert_eq!((&first["sensor"], &second["sensor"]), (&"motor".into(), &"motor".into()));
        assert!((first["value_degC"].as_f64().unwrap() - 30.0).abs() < 1e-9);
        let off = |key: &str, wanted: f64| (first[key].as_f64().unwrap() - wanted).abs();
        assert!(off("rising_s", rising) < near && off("falling_s", falling) < near, "{tolerance}: {first}, {rising} {falling}");
        assert!(second["rising_s"].is_null() && second["falling_s"].is_null(), "{second}");
    }
    let text = coldplate(&args);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("rising at") && text.contains("6 min 21 s") && text.contains("never"), "{text}");
    for (wrong, needles) in
        [("motr=3 degC", ["motr", "did you mean 'motor'"]), ("motor=3", ["--passes", "unit"]), ("motor", ["--passes", "="])]
    {
        let refused = coldplate(&[&args[..], &["--passes", wrong]].concat());
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{wrong}");
        needles.iter().for_each(|n| assert!(message.contains(n), "{wrong}: {message}"));
    }
}

/// Taken up again from a checkpoint, a run finds the same.
#[test]
fn a_run_taken_up_again_finds_the_same() {
    let folder = scratch("passes-resume");
    let machine = write(&folder, "node.toml", NODE);
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,1000\n1500,1000\n1500,0\n4000,0\n");
    let state = folder.join("state").to_str().unwrap().to_string();
    let args = ["simulate", &machine, &schedule, "--from", "22 degC", "--passes", "motor=30 degC", "--json", "--checkpoint", &state];
    let args = [&args[..], &USUAL].concat();
    let first = json(&coldplate(&args))["passes"].clone();
    let again = json(&coldplate(&[&args[..], &["--resume"]].concat()));
    assert!(again["resumed_at_s"].is_number() && again["passes"] == first, "{again} {first}");
    // Waiting for something else is another run.
    let other = coldplate(&[&args[..], &["--resume", "--passes", "motor=25 degC"]].concat());
    assert!(String::from_utf8_lossy(&other.stderr).contains("--passes"), "{}", String::from_utf8_lossy(&other.stderr));
}
