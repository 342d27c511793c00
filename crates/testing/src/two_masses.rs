//! Two masses in a room, their log of one hour, and its noise.

use coldplate_base::document::Document;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

/// Two masses in a room, one with a heater: `power_W` is the machine's own variable.
pub const LUMPED: &str = r#"
name = "Two masses"
[variables.coolant_flow]
unit = "L/min"
default = "4 L/min"
[variables.coolant_temperature]
unit = "degC"
default = "20 degC"
[variables.motor_speed]
unit = "rpm"
default = "0 rpm"
range = ["0 rpm", "3000 rpm"]
[variables.ambient_temperature]
unit = "degC"
default = "22 degC"
[node.room]
temperature = "ambient_temperature"
[node.motor]
capacity = "300 J/K"
[node.nut]
capacity = "150 J/K"
[node.foot]
capacity = "400 J/K"
[contact.motor_nut]
between = ["motor", "nut"]
total_conductance = "0.8 W/K"
[contact.motor_foot]
between = ["motor", "foot"]
total_conductance = "1.2 W/K"
[contact.foot_room]
between = ["foot", "room"]
total_conductance = "1 W/K"
[contact.nut_room]
between = ["nut", "room"]
total_conductance = "0.2 W/K"
[source.motor]
in = "motor"
power = "0.02 * motor_speed_rpm"
[sensor.motor]
node = "motor"
[sensor.nut]
node = "nut"
[sensor.foot]
node = "foot"
"#;
/// Standard deviation of a reading, K.
pub const NOISE: f64 = 0.05;

/// A log of one hour in steps of 20 s, the speed in blocks, on a truth with lines changed.
pub fn log(lines: &[(&str, &str)], seed: u64) -> (Study, Data, MeasurementUncertainty) {
    let machine = Document::parse(LUMPED, "lumped.toml").unwrap();
    let mut truth = machine.clone();
    lines.iter().for_each(|(key, value)| truth.apply_set(key, value).unwrap());
    let (study, truth) = (Study::new(machine, None).unwrap(), Study::new(truth, None).unwrap());
    let rpm = std::f64::consts::TAU / 60.0;
    let speed = |i: usize| [500.0, 2500.0, 1200.0, 3000.0][(i / 45) % 4] * rpm;
    let row = |i: usize| ReadingRow {
        test: "log".into(),
        time: Some(20.0 * i as f64),
        condition: Condition::from_si(vec![4.0 / 60_000.0, 293.15, speed(i), 295.15]),
        readings: vec![Some(300.0); 3],
        line: Some(i + 2),
    };
    let mut data = Data {
        source: "a log".into(),
        sensors: vec![0, 1, 2],
        names: vec!["motor".into(), "nut".into(), "foot".into()],
        rows: (0..181).map(row).collect(),
        ..Data::default()
    };
    let values = identify::values(&truth, &data, Start::Steady).unwrap();
    noisy(&mut data, &values, seed);
    let uncertainty = MeasurementUncertainty { noise: vec![NOISE; 3], ..MeasurementUncertainty::usual(&data, &study.model.machine) };
    (study, data, uncertainty)
}

/// Replaces readings by values with noise.
pub fn noisy(data: &mut Data, values: &[f64], seed: u64) {
    let mut random = Random::new(seed);
    let sensors = data.names.len();
    for (row, values) in data.rows.iter_mut().zip(values.chunks(sensors)) {
        for (reading, value) in row.readings.iter_mut().zip(values) {
            *reading = Some(value + NOISE * random.normal());
        }
    }
}
