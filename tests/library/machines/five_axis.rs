//! The five-axis machine: its heats, its axes at rest, its switches.

use super::Solved;

/// The whole-machine test; the other axes stand.
const TEST: [(&str, &str); 4] = [
    ("coolant_flow", "1.139e-4 m3/s"),
    ("coolant_temperature", "20.5 degC"),
    ("motor_speed", "250 rpm"),
    ("ambient_temperature", "23.5 degC"),
];
const COARSE: Option<usize> = Some(6000);

#[test]
fn plates_follow_the_water_and_standing_seats_sit_half_way() {
    let machine = Solved::new("five_axis.toml", &[], &TEST, COARSE);
    for axis in ["X1", "X2", "Y", "Z"] {
        for plate in ["motor plate", "reducer plate"] {
            let found = machine.read(&format!("{axis} {plate}"));
            assert!((20.5..20.75).contains(&found), "{axis} {plate}: {found}");
        }
    }
    for axis in ["X1", "X2", "Z"] {
        let (plate, seat) = (machine.read(&format!("{axis} reducer plate")), machine.read(&format!("{axis} bearing seat")));
        // Lumped: neck 16.3 x 0.0085 / 0.25 in series with its joints, 0.48 W/K, against 0.71 W/K to wall and bed.
        let share = (seat - plate) / (23.5 - plate);
        assert!((0.52..0.68).contains(&share), "{axis}: {share} of the way, {seat}");
    }
}

/// Table 1, as printed but for the motors of A and B, whose decimal point slipped.
#[test]
fn heats_of_every_axis() {
    let speeds = ["motor_speed", "x1_speed", "x2_speed", "z_speed", "a_speed", "b_speed"].map(|name| (name, "2500 rpm"));
    let published = [("bearing_preload", "150.5 N"), ("nut_preload", "160.88 N")];
    let condition: Vec<(&str, &str)> = speeds.into_iter().chain(published).collect();
    let machine = Solved::new("five_axis.toml", &[], &condition, COARSE);
    for (source, expected) in [
        ("x1_motor", 114.602),
        ("x2_motor", 114.602),
        ("y_motor", 113.729),
        ("z_motor", 72.717),
        ("a_motor", 31.03 + 13.962),
        ("b_motor", 13.34 + 6.004),
        ("x1_reducer", 51.571),
        ("y_reducer", 51.178),
        ("z_reducer", 32.723),
        ("y_bearing", 2.0 * 0.518),
        ("y_far_bearing", 0.518),
        ("x1_seat", 2.0 * 0.571),
        ("z_seat", 2.0 * 2.503),
        ("y_nut", 1.738 / 2.0),
        ("y_screw", 1.738 / 2.0),
        ("y_sliders", 4.165 / 2.0),
        ("y_rails", 4.165 / 2.0),
    ] {
        let found = machine.power(source);
        assert!((found - expected).abs() < 1.2e-3 * expected.max(1.0), "{source}: {found}, printed {expected}");
    }
}

/// Table 4 can be chosen in place of the drive's heats.
#[test]
fn heats_of_table_4() {
    let machine = Solved::new("five_axis.toml", &[("variables.table_4.default", "1")], &TEST, COARSE);
    for (source, expected) in [
        ("y_motor", 113.7),
        ("y_reducer", 51.7),
        ("y_bearing", 0.89),
        ("y_far_bearing", 0.89),
        ("y_nut", 3.05),
        ("y_screw", 3.05),
        ("y_sliders", 2.05),
        ("y_rails", 2.05),
    ] {
        assert!((machine.power(source) - expected).abs() < 1e-9, "{source}: {}", machine.power(source));
    }
}

/// With water and wall at one temperature and nothing turning, everything has that temperature.
#[test]
fn nothing_moves_nothing_warms() {
    let still =
        [("coolant_flow", "4e-5 m3/s"), ("coolant_temperature", "22 degC"), ("motor_speed", "0 rpm"), ("ambient_temperature", "22 degC")];
    let machine = Solved::new("five_axis.toml", &[], &still, COARSE);
    for sensor in &machine.model.machine.sensors {
        // What is left is the water's own friction: 0.05 W.
        let found = machine.read(&sensor.name);
        assert!((found - 22.0).abs() < 0.005, "{}: {found}", sensor.name);
    }
}

/// An axis with a speed of its own warms itself and leaves its neighbours alone.
#[test]
fn another_axis_can_move() {
    let still = Solved::new("five_axis.toml", &[], &TEST, COARSE);
    let mut condition = TEST.to_vec();
    condition.push(("x1_speed", "2500 rpm"));
    let moving = Solved::new("five_axis.toml", &[], &condition, COARSE);
    assert!(moving.read("X1 bearing seat") > still.read("X1 bearing seat") + 1.0);
    assert!(moving.outlet("x1_reducer_plate") > still.outlet("x1_reducer_plate") + 0.2);
    assert!((moving.read("X2 bearing seat") - still.read("X2 bearing seat")).abs() < 0.02);
    assert!((moving.read("Y bearing motor side") - still.read("Y bearing motor side")).abs() < 0.02);
}

/// What each variable is expected to do, from the paper's four one-factor sweeps: more flow cools the motor,
/// warm water warms the plates one to one, speed warms the bearing, the chamber moves what is far from water.
#[test]
fn variables_act_as_they_should() {
    let at = |name: &str, value: &'static str| {
        let mut condition = [
            ("coolant_flow", "1.57e-4 m3/s"),
            ("coolant_temperature", "20 degC"),
            ("motor_speed", "1250 rpm"),
            ("ambient_temperature", "23.5 degC"),
        ];
        condition.iter_mut().find(|(n, _)| *n == name).unwrap().1 = value;
        Solved::new("five_axis.toml", &[], &condition, COARSE)
    };
    let (low, high) = (at("coolant_flow", "3.925e-5 m3/s"), at("coolant_flow", "3.14e-4 m3/s"));
    assert!(low.read("Y motor") > high.read("Y motor") + 0.3);
    assert!((low.read("Y bearing far side") - high.read("Y bearing far side")).abs() < 0.01);
    let (low, high) = (at("coolant_temperature", "18 degC"), at("coolant_temperature", "24 degC"));
    assert!((high.read("Y motor plate") - low.read("Y motor plate") - 6.0).abs() < 0.2);
    assert!((high.read("Y bearing far side") - low.read("Y bearing far side")).abs() < 0.1);
    let (low, high) = (at("ambient_temperature", "18 degC"), at("ambient_temperature", "24 degC"));
    assert!((high.read("Y slider") - low.read("Y slider") - 6.0).abs() < 0.3);
    assert!((high.read("Y motor plate") - low.read("Y motor plate")).abs() < 0.1);
}
