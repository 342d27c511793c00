//! What follows the clock: a variable named `time` is given by the schedule itself.

use crate::simulate::{coldplate, json, numbers, scratch, write};

/// A node of 100 J/K and 1 W/K beside a gas that warms by 0.01 K/s: T = T0 + r (t - tau (1 - exp(-t/tau))), tau = 100 s.
const NODE: &str = r#"
name = "node"
[variables]
coolant_flow = "1 L/min"
coolant_temperature = "20 degC"
motor_speed = "0 rpm"
ambient_temperature = "20 degC"
time = { unit = "s", default = "0 s" }
[node.body]
capacity = "100 J/K"
[boundary.oven]
node = "body"
area = "100 cm2"
film = "100 W/(m2 K)"
fluid_temperature = "20 + 0.01 * time_s"
[sensor.body]
node = "body"
"#;

#[test]
fn a_boundary_follows_the_clock() {
    let folder = scratch("clock");
    let machine = write(&folder, "m.toml", NODE);
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm]\n0,0\n1000,0\n");
    let found = json(&coldplate(&["simulate", &machine, &schedule, "--json", "--every", "50 s", "--tolerance", "0.0001 K"]));
    let (times, readings) = (numbers(&found["series"]["time_s"]), numbers(&found["series"]["body"]));
    assert!(times.len() > 15, "{times:?}");
    for (t, reading) in times.iter().zip(readings) {
        let exact = 20.0 + 0.01 * (t - 100.0 * (1.0 - (-t / 100.0).exp()));
        assert!((reading - exact).abs() < 2e-3, "{t} s: {reading}, exact {exact}");
    }
}
