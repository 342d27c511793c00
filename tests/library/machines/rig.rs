//! The rig against a hand calculation and its published conditions.

use super::Solved;

const WC1: [(&str, &str); 4] = [
    ("coolant_flow", "3.33e-5 m3/s"),
    ("coolant_temperature", "26 degC"),
    ("motor_speed", "2500 rpm"),
    ("ambient_temperature", "28.5 degC"),
];
const WC2: [(&str, &str); 4] =
    [("coolant_flow", "6.67e-5 m3/s"), ("coolant_temperature", "26 degC"), ("motor_speed", "1250 rpm"), ("ambient_temperature", "29 degC")];

/// One of the two chains wall - block - contact - plate - water, plate at one temperature.
struct Chain {
    heat: f64,
    radiating_area: f64,
    contact: f64,
    /// Spreading in the plate under the pad, K/W, from the double Fourier series of a rectangular patch.
    spreading: f64,
    channel_length: f64,
}

/// Block and water after it, degC, for water that enters at `water`.
fn by_hand(chain: &Chain, water: f64, flow: f64, film: f64, wall: f64) -> (f64, f64) {
    let rate = 4.1674e6 * flow;
    let effectiveness = 1.0 - (-film * std::f64::consts::PI * 0.010 * chain.channel_length / rate).exp();
    let mut block = 35.0;
    let mut heat = chain.heat;
    for _ in 0..50 {
        let radiated = 0.55 * 5.670374e-8 * chain.radiating_area * ((block + 273.15f64).powi(4) - (wall + 273.15f64).powi(4));
        heat = chain.heat - radiated;
        block = water + heat * (1.0 / (rate * effectiveness) + chain.spreading + 1.0 / chain.contact);
    }
    (block, water + heat / rate)
}

fn motor(heat: f64) -> Chain {
    Chain { heat, radiating_area: 0.060, contact: 560.0 * 0.130 * 0.110, spreading: 1.14 / 110.7, channel_length: 2.4 }
}

fn reducer(heat: f64) -> Chain {
    Chain { heat, radiating_area: 0.035, contact: 510.0 * 0.103 * 0.103, spreading: 0.55 / 50.0, channel_length: 1.8 }
}

#[test]
fn agrees_with_the_hand_calculation() {
    // Film coefficients of Gnielinski's law at 26 degC, 10 mm: 2252 and 4523 W/(m2 K).
    for (condition, share, flow, film, wall) in [(WC1, 1.0, 3.33e-5, 2252.0, 28.5), (WC2, 0.5, 6.67e-5, 4523.0, 29.0)] {
        let rig = Solved::new("rig.toml", &[], &condition, None);
        let (motor_shell, water) = by_hand(&motor(113.729 * share), 26.0, flow, film, wall);
        let (reducer_shell, outlet) = by_hand(&reducer(51.178 * share), water, flow, film, wall);
        for (sensor, expected, within) in
            [("motor shell", motor_shell, 0.5), ("reducer shell", reducer_shell, 0.5), ("water outlet", outlet, 0.05)]
        {
            let found = rig.read(sensor);
            assert!((found - expected).abs() < within, "{sensor}: {found:.3} by hand {expected:.3}");
        }
    }
}

/// The plates warm along the water's path; where the sensors sit the hand calculation gives these.
#[test]
fn plates_where_the_sensors_sit() {
    for (condition, motor_plate, reducer_plate) in [(WC1, 26.65, 27.19), (WC2, 26.17, 26.30)] {
        let rig = Solved::new("rig.toml", &[], &condition, None);
        assert!((rig.read("motor plate") - motor_plate).abs() < 0.4, "{}", rig.read("motor plate"));
        assert!((rig.read("reducer plate") - reducer_plate).abs() < 0.4, "{}", rig.read("reducer plate"));
    }
}

/// Tables 2 and 3: 113.73 W; Table 2: 51.178 W (Table 3 prints 51.12).
#[test]
fn heats_of_the_tables() {
    for (speed, motor, reducer) in
        [("250 rpm", 11.373, 5.118), ("750 rpm", 34.119, 15.353), ("1250 rpm", 56.865, 25.589), ("2500 rpm", 113.729, 51.178)]
    {
        let mut condition = WC1;
        condition[2].1 = speed;
        let rig = Solved::new("rig.toml", &[], &condition, Some(500));
        assert!((rig.power("motor") - motor).abs() < 6e-4, "{speed}: {}", rig.power("motor"));
        assert!((rig.power("reducer") - reducer).abs() < 6e-4, "{speed}: {}", rig.power("reducer"));
    }
}

#[test]
fn the_true_contact_area_is_told_apart_from_the_stated_one() {
    let rig = Solved::new("rig.toml", &[], &WC1, Some(500));
    assert!((rig.contact("motor").area - 0.0143).abs() < 1e-9);
    assert!((rig.contact("reducer").area - 0.010609).abs() < 1e-9);
    let inventory = coldplate_solve::meshed::inventory(&rig.model, Some(&rig.condition)).unwrap();
    for part in ["'motor'", "'reducer'"] {
        assert!(inventory.warnings.iter().any(|w| w.contains(part) && w.contains("flux area")), "{:?}", inventory.warnings);
    }
}

/// All heat but what the surfaces radiate leaves with the water.
#[test]
fn heat_balance_of_the_water() {
    let rig = Solved::new("rig.toml", &[], &WC1, None);
    let balance = &rig.state.solution.balance;
    let rise = rig.read("water outlet") - 26.0;
    let expected = (113.729 + 51.178 + balance.radiation + balance.gas + balance.dissipation) / (4.1654e6 * 3.33e-5);
    assert!((rise - expected).abs() < 2e-3, "{rise} {expected}");
    assert!((1.1..1.2).contains(&rise), "the printed rise of 0.5 K cannot take up 165 W");
}

/// Where the blocks are nearly isothermal and the plates thin, the mesh hardly matters.
#[test]
fn mesh_does_not_matter() {
    let coarse = Solved::new("rig.toml", &[], &WC1, None);
    let fine = Solved::new("rig.toml", &[], &WC1, Some(64_000));
    for sensor in ["motor shell", "reducer shell", "motor plate", "reducer plate", "water outlet"] {
        assert!((coarse.read(sensor) - fine.read(sensor)).abs() < 0.15, "{sensor}: {} {}", coarse.read(sensor), fine.read(sensor));
    }
}
