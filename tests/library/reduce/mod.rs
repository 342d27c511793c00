//! Reduced models against full solves: every reading within its bound, whatever the condition, and files that hold.

mod dynamics;
mod field;
mod format;
mod histories;
mod spread;
mod sweeps;

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_network::{Load, Network};
use coldplate_reduce::{ReduceSettings, ReducedModel, reduce};
use coldplate_solve::Solver;
use coldplate_solve::study::Study;

const ACCURACY: f64 = 1e-3;

fn study(machine: &str, cells: usize) -> Study {
    Study::read(format!("{}/machines/{machine}.toml", env!("CARGO_MANIFEST_DIR")), &[], Some(cells)).expect("the machine is read")
}

/// The four usual variables over their ranges, or those of every machine, the rest at their defaults.
fn settings(study: &Study, with_parameters: bool) -> ReduceSettings {
    let usual = [(3.925e-5, 3.14e-4), (291.15, 297.15), (26.2, 261.8), (291.15, 297.15)];
    let range = |(i, v): (usize, &coldplate_describe::machine::DescribedVariable)| match (usual.get(i), v.range, v.default) {
        (Some(_), Some(range), _) | (None, Some(range), None) => range,
        (Some(usual), None, _) => *usual,
        (None, _, Some(value)) => (value, value),
        (None, None, None) => panic!("{} has neither range nor default", v.name),
    };
    let ranges = study.model.machine.variables.iter().enumerate().map(range).collect();
    ReduceSettings { accuracy: ACCURACY, ranges, with_parameters, most: 400, histories: 0, with_field: false, seed: 1 }
}

/// What bound over error is, condition by condition, and how many readings are outside their bound.
struct Effectivity {
    ratios: Vec<f64>,
    outside: usize,
    largest_error: f64,
    largest_bound: f64,
}

/// Compares with full solves, on networks that have the parameters' values in them, at conditions the model has not seen.
fn effectivity(study: &Study, model: &ReducedModel, count: usize) -> Effectivity {
    let (machine, network) = (&study.model.machine, &study.model.network);
    let mut random = Random::new(2026);
    let mut found = Effectivity { ratios: Vec::new(), outside: 0, largest_error: 0.0, largest_bound: 0.0 };
    for _ in 0..count {
        let condition = Condition::from_si(model.ranges.iter().map(|(low, high)| low + random.unit() * (high - low)).collect());
        let parameters: Vec<f64> = model.parameters.iter().map(|p| p.low + random.unit() * (p.high - p.low)).collect();
        let (mut own, mut load) = (network.clone(), Load::at(machine, &condition).expect("a load"));
        model.parameters.iter().zip(&parameters).for_each(|(p, value)| p.set(*value, machine, &mut own, &mut load));
        let state = Solver::new(&own, &load).and_then(|s| s.steady(&load)).expect("a full solve");
        let answer = model.steady(&condition, &parameters).expect("an answer");
        assert!(answer.in_range);
        let errors = own.sensors.iter().zip(&answer.readings).map(|(s, r)| (s.read(&state.temperatures, &load) - r).abs());
        let errors: Vec<f64> = errors.collect();
        found.outside += errors.iter().zip(&answer.bounds).filter(|(e, b)| e > b).count();
        let largest = |values: &[f64]| values.iter().fold(0.0, |m: f64, v| m.max(*v));
        found.largest_error = found.largest_error.max(largest(&errors));
        found.largest_bound = found.largest_bound.max(largest(&answer.bounds));
        found.ratios.push(largest(&answer.bounds) / largest(&errors).max(1e-12));
    }
    found.ratios.sort_by(f64::total_cmp);
    found
}

/// Every reading is within its bound; the largest bound, K.
fn holds(name: &str, cells: usize, with_parameters: bool, most: usize, count: usize) -> (Study, ReducedModel, f64) {
    let study = study(name, cells);
    let settings = ReduceSettings { most, ..settings(&study, with_parameters) };
    let model = reduce(&study, &settings, &Silent).expect("a reduced model");
    let found = effectivity(&study, &model, count);
    let share = found.ratios.iter().filter(|r| (1.0..=20.0).contains(*r)).count() as f64 / count as f64;
    println!(
        "{name}: {} modes for {} nodes, {} of {} conductors, {} solved in {:.1} s; {count} conditions: error at most {:.1e} K, bound at most \
         {:.1e} K, bound over error {:.2} to {:.1}, {:.1} % within 1 to 20",
        model.coarse.len(),
        model.made.nodes,
        model.fine.patterns.ncols(),
        model.made.conductors,
        model.made.solved,
        model.made.seconds,
        found.largest_error,
        found.largest_bound,
        found.ratios[0],
        found.ratios[count - 1],
        100.0 * share
    );
    assert_eq!(found.outside, 0, "{name}: readings outside their bounds");
    (study, model, found.largest_bound)
}

#[test]
fn the_rig_keeps_its_bounds() {
    let (study, model, bound) = holds("rig", 3000, false, 400, 150);
    assert!(bound <= ACCURACY);
    // An iteration that ends by a step that was small by chance asks for solves without end.
    assert!(model.made.solved < 64, "{} solved", model.made.solved);
    let stations = |network: &Network| network.streams.iter().map(|s| s.stations.len()).sum::<usize>();
    let (own, full) = (stations(&model.fine.network), stations(&study.model.network));
    assert!(2 * own < full, "{own} of {full} stations");
}

#[test]
fn uncertain_parameters_may_vary() {
    let (study, model, bound) = holds("rig", 3000, true, 400, 100);
    assert!(bound <= ACCURACY);
    // Each of them reaches the answer: a reading moves by far more than the bound.
    let middle = study
        .model
        .machine
        .condition(&[])
        .unwrap_or_else(|_| Condition::from_si(model.ranges.iter().map(|(low, high)| 0.5 * (low + high)).collect()));
    let plain = model.steady(&middle, &[]).expect("an answer");
    for (i, parameter) in model.parameters.iter().enumerate() {
        let mut values: Vec<f64> = model.parameters.iter().map(|p| p.nominal).collect();
        values[i] = parameter.high;
        let moved = model.steady(&middle, &values).expect("an answer");
        let most = plain.readings.iter().zip(&moved.readings).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(most > 5.0 * ACCURACY, "{}: {most:.1e} K", parameter.name);
    }
}

#[test]
fn the_five_axis_machine_keeps_its_bounds() {
    let (_, _, bound) = holds("five_axis", 4000, false, 400, 60);
    assert!(bound <= ACCURACY);
}

#[test]
fn a_spindle_keeps_its_bounds() {
    holds("spindle", 2000, false, 80, 40);
}

#[test]
fn an_enclosure_keeps_its_bounds() {
    let (_, _, bound) = holds("enclosure", 2000, false, 96, 40);
    assert!(bound <= ACCURACY);
}

/// Two nodes that see each other alone: nothing but their enclosure bends.
const TWO: &str = r#"
name = "two nodes that see each other"
[variables]
motor_speed = { default = "2000 rpm", range = ["500 rpm", "3000 rpm"] }
ambient_temperature = { default = "22 degC", range = ["18 degC", "30 degC"] }
[node.room]
temperature = "ambient_temperature"
[node.motor]
capacity = "300 J/K"
[node.shield]
capacity = "100 J/K"
[contact.shield_room]
between = ["shield", "room"]
total_conductance = "1 W/K"
[enclosure.inside]
surfaces = [
    { node = "motor", emissivity = 0.8, area = "0.05 m2" },
    { node = "shield", emissivity = 0.5, area = "0.1 m2" },
]
view_factors = [[0.0, 1.0], [0.5, 0.5]]
[source.motor]
in = "motor"
power = "0.005 * motor_speed_rpm"
[sensor.motor]
node = "motor"
[sensor.shield]
node = "shield"
"#;

#[test]
fn an_enclosure_may_be_all_that_bends() {
    let study = Study::new(Document::parse(TWO, "two.toml").expect("a document"), None).expect("a machine");
    let model = reduce(&study, &settings(&study, false), &Silent).expect("a reduced model");
    let found = effectivity(&study, &model, 40);
    assert!(found.outside == 0 && found.largest_bound <= ACCURACY, "{} {:.1e}", found.outside, found.largest_bound);
}

/// Fewer solves than the accuracy takes: the bounds are wide, hold, and the model says that they are wider than was asked.
#[test]
fn what_is_not_reached_is_said() {
    let (_, model, bound) = holds("enclosure", 2000, false, 16, 40);
    assert!(bound > ACCURACY && model.made.largest_bound > ACCURACY);
}

#[test]
fn a_file_gives_the_same_answers_and_no_damage_passes() {
    let study = study("rig", 1500);
    let model = reduce(&study, &settings(&study, true), &Silent).expect("a reduced model");
    let bytes = model.to_bytes(study.document()).expect("bytes");
    let again = ReducedModel::from_bytes(&bytes).expect("the file is read");
    let condition = Condition::from_si(model.ranges.iter().map(|(low, high)| low + 0.3 * (high - low)).collect());
    let parameters: Vec<f64> = model.parameters.iter().map(|p| 0.4 * p.low + 0.6 * p.high).collect();
    for values in [&[][..], &parameters[..]] {
        let (a, b) = (model.steady(&condition, values).expect("an answer"), again.steady(&condition, values).expect("an answer"));
        assert_eq!((a.readings, a.bounds), (b.readings, b.bounds));
    }
    assert_eq!(again.to_bytes(study.document()).expect("bytes"), bytes);
    for at in (0..bytes.len()).step_by(bytes.len() / 200) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x20;
        assert!(ReducedModel::from_bytes(&damaged).is_err(), "byte {at}");
        assert!(ReducedModel::from_bytes(&bytes[..at]).is_err(), "cut at {at}");
    }
}

#[test]
fn outside_its_ranges_a_model_says_so() {
    let study = study("rig", 1500);
    let model = reduce(&study, &settings(&study, false), &Silent).expect("a reduced model");
    let (low, high) = model.ranges[2];
    let middle = |(low, high): &(f64, f64)| 0.5 * (low + high);
    let mut si: Vec<f64> = model.ranges.iter().map(middle).collect();
    si[2] = high + 0.1 * (high - low);
    assert!(!model.steady(&Condition::from_si(si), &[]).expect("an answer").in_range);
}

#[test]
fn what_no_model_can_be_made_of_is_said() {
    let study = study("rig", 300);
    let usual = settings(&study, false);
    let held = usual.ranges.iter().map(|(low, high)| (0.5 * (low + high), 0.5 * (low + high))).collect();
    let said = |settings: ReduceSettings| reduce(&study, &settings, &Silent).expect_err("no model").to_string();
    let text = said(ReduceSettings { ranges: held, ..usual.clone() });
    assert!(text.contains("nothing varies"), "{text}");
    let text = said(ReduceSettings { most: 3, ..usual });
    assert!(text.contains("--max-runs"), "{text}");
}

/// The same seed gives the same model, to the byte but for the seconds it took.
#[test]
fn a_seed_gives_the_same_model() {
    let study = study("rig", 800);
    let bytes = || {
        let mut model = reduce(&study, &settings(&study, false), &Silent).expect("a reduced model");
        model.made.seconds = 0.0;
        model.to_bytes(study.document()).expect("bytes")
    };
    assert_eq!(bytes(), bytes());
}
