//! Machines that nothing heats and nothing cools: their energy balance is relative to what their parts exchange.

use super::{coldplate, json, scratch, write};
use crate::common::message;

/// Two blocks of 100 and 300 J/K exchange heat through 2 W/K: both reach 37.5 degC, with a time constant of 37.5 s.
#[test]
fn two_blocks_exchange_heat() {
    let folder = scratch("closed");
    let machine = r#"
name = "two blocks"
[variables]
ambient_temperature = "20 degC"
coolant_flow = "1 L/min"
coolant_temperature = "20 degC"
motor_speed = "0 rpm"
[node.hot]
capacity = "100 J/K"
start = "90 degC"
[node.cold]
capacity = "300 J/K"
start = "20 degC"
[contact.joint]
between = ["hot", "cold"]
total_conductance = "2 W/K"
[sensor.hot]
node = "hot"
[sensor.cold]
node = "cold"
"#;
    let schedule = write(&folder, "schedule.csv", "time [s]\n0\n600\n");
    let run = |name: &str, machine: &str| {
        let machine = write(&folder, name, machine);
        let output = coldplate(&["simulate", &machine, &schedule, "--from", "20 degC", "--every", "37.5 s", "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", message(&output));
        json(&output)
    };
    let found = run("blocks.toml", machine);
    let hot = found["series"].as_object().unwrap().iter().find(|(key, _)| key.starts_with("hot")).unwrap().1;
    let hot = super::numbers(hot);
    let exact = |t: f64| 37.5 + 52.5 * (-t / 37.5).exp();
    for (i, value) in hot.iter().enumerate() {
        assert!((value - exact(37.5 * i as f64)).abs() < 0.02, "{i}: {value} for {}", exact(37.5 * i as f64));
    }
    assert!(found["energy"]["relative"].as_f64().unwrap() < 1e-8, "{}", found["energy"]);
    // At one temperature nothing moves at all.
    let still = run("still.toml", &machine.replace("90 degC", "20 degC"));
    assert_eq!(still["energy"]["relative"].as_f64(), Some(0.0), "{}", still["energy"]);
}
