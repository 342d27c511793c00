//! Predictions that a diagnosis compares are those of an endlessly fine mesh.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Problem, diagnose};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::machines::SMALL;

const CELLS: usize = 600;
const FINE: usize = 60_000;

fn study(cells: usize, sets: &[(&str, &str)]) -> Study {
    let mut document = Document::parse(SMALL, "small.toml").unwrap();
    sets.iter().for_each(|(key, value)| document.apply_set(key, value).unwrap());
    Study::new(document, Some(cells)).unwrap()
}

/// Two flows at each of three speeds, with the readings of a machine on a mesh a hundred times as fine.
fn data(sets: &[(&str, &str)]) -> Data {
    let truth = study(FINE, sets);
    let machine = &truth.model.machine;
    let place = |name: &str| machine.variables.iter().position(|v| v.name == name).unwrap();
    let (flow, speed) = (place("coolant_flow"), place("motor_speed"));
    let row = |i: usize| {
        let mut values: Vec<f64> = machine.variables.iter().map(|v| v.default.unwrap()).collect();
        values[flow] *= [1.0, 0.6][i % 2];
        values[speed] *= [1.0, 0.7, 0.4][i / 2];
        let readings = vec![Some(300.0); machine.sensors.len()];
        ReadingRow { test: format!("test {i}"), time: None, condition: Condition::from_si(values), readings, line: None }
    };
    let names: Vec<String> = machine.sensors.iter().map(|s| s.name.clone()).collect();
    let sensors = (0..names.len()).collect();
    let mut data = Data { source: String::new(), sensors, names, rows: (0..6).map(row).collect(), ..Data::default() };
    let values = identify::values(&truth, &data, Start::Steady).unwrap();
    for (row, values) in data.rows.iter_mut().zip(values.chunks(machine.sensors.len())) {
        row.readings = values.iter().map(|v| Some(*v)).collect();
    }
    data
}

fn rms(a: &[f64], b: impl Iterator<Item = f64>) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// Continued to their limit they are nearer to it than those of three times as many cells.
#[test]
fn predictions_are_those_of_the_limit() {
    let data = data(&[]);
    let found = diagnose(&Problem::new(study(CELLS, &[]), data.clone()), &Silent).unwrap();
    let measured = || data.rows.iter().flat_map(|row| row.readings.iter().flatten().copied());
    let own = rms(&identify::values(&study(CELLS, &[]), &data, Start::Steady).unwrap(), measured());
    let finest = rms(&identify::values(&study(3 * CELLS, &[]), &data, Start::Steady).unwrap(), measured());
    let continued = rms(&found.residuals.predicted, measured());
    println!("own mesh {own:.4} K, three times as many cells {finest:.4} K, continued {continued:.4} K");
    assert!(continued < 0.7 * finest, "{continued} {finest} {own}");
}

/// Good readings ask for more cells than poor ones: their predictions are nearer to the limit.
#[test]
fn good_readings_are_compared_on_a_finer_mesh() {
    let data = data(&[]);
    let off = |noise: f64| -> f64 {
        let mut random = Random::new(5);
        let mut read = data.clone();
        read.rows.iter_mut().flat_map(|row| row.readings.iter_mut().flatten()).for_each(|reading| *reading += noise * random.normal());
        let mut problem = Problem::new(study(CELLS, &[]), read);
        problem.uncertainty.noise.iter_mut().for_each(|deviation| *deviation = noise);
        let predicted = diagnose(&problem, &Silent).unwrap().residuals.predicted;
        rms(&predicted, data.rows.iter().flat_map(|row| row.readings.iter().flatten().copied()))
    };
    let (poor, good) = (off(1.0), off(0.002));
    println!("off the limit by {poor:.4} K where readings are poor, by {good:.4} K where they are good");
    assert!(good < 0.7 * poor, "{good} {poor}");
}

/// A contact that is found from a coarse mesh is as large as it is, within its interval and a hundredth.
#[test]
fn a_contact_on_a_coarse_mesh() {
    let data = data(&[("contact.motor.conductance", "\"250 W/(m2 K)\"")]);
    let found = diagnose(&Problem::new(study(CELLS, &[]), data), &Silent).unwrap();
    let cause = &found.explanations[0].causes[0];
    assert_eq!(cause.hypothesis.kind_and_place(), "contact conductance at motor");
    let (low, high) = cause.interval();
    println!("{} ({} to {})", cause.amplitude.exp(), low.exp(), high.exp());
    assert!(low < 0.5f64.ln() && 0.5f64.ln() < high, "{low} {high}");
    assert!((cause.amplitude.exp() / 0.5 - 1.0).abs() < 0.01, "{}", cause.amplitude.exp());
}
