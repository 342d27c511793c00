//! Reduced models over time, against histories in full that they have not seen.

use std::sync::OnceLock;

use coldplate_base::progress::Silent;
use coldplate_describe::machine::Machine;
use coldplate_explore::schedule::{Breakpoint, Schedule};
use coldplate_explore::simulate::{self, SimulateOptions, SimulatedMachine, Start};
use coldplate_reduce::{ReducedModel, reduce};
use coldplate_solve::study::Study;

use crate::reduce::{settings, study};

/// Error of each step of the histories in full, K: at the usual 0.01 K a front of the rig's water is off by 0.015 K.
const TRUTH: f64 = 0.0005;

/// Steps, a ramp and reversed duty between shares of the ranges.
pub fn schedule(machine: &Machine, model: &ReducedModel, hour: f64) -> Schedule {
    let at = |time: f64, shares: [f64; 4]| {
        let value = |(v, (low, high)): (usize, &(f64, f64))| low + shares.get(v).copied().unwrap_or(0.5) * (high - low);
        Breakpoint { time: time * hour, values: model.ranges.iter().enumerate().map(value).collect() }
    };
    assert_eq!(machine.variables.len(), model.ranges.len());
    let rows = vec![
        at(0.0, [0.5, 0.3, 0.1, 0.4]),
        at(0.5, [0.5, 0.3, 0.1, 0.4]),
        at(0.5, [0.5, 0.3, 1.0, 0.4]),
        at(1.5, [0.5, 0.3, 1.0, 0.4]),
        at(2.5, [0.1, 0.8, 0.4, 0.9]),
        at(3.0, [0.1, 0.8, 0.4, 0.9]),
        at(3.0, [0.9, 0.0, 0.0, 0.9]),
        at(4.0, [0.9, 0.0, 0.0, 0.9]),
    ];
    Schedule::from_rows(rows, &[]).expect("a schedule")
}

/// Largest error and bound of a model over the schedule, and readings outside their bound.
fn compared(study: &Study, model: &ReducedModel, start: Start, hour: f64) -> (f64, f64, usize) {
    let schedule = schedule(&study.model.machine, model, hour);
    let options = SimulateOptions { start, ..SimulateOptions::default() };
    let truth =
        simulate::run(&study.model, &schedule, &SimulateOptions { tolerance: TRUTH, ..options.clone() }, &mut |_| {}).expect("in full");
    let found = simulate::run_reduced(model, &schedule, &options).expect("reduced");
    let bounds = found.bounds.as_ref().expect("bounds");
    let (mut error, mut bound, mut outside): (f64, f64, usize) = (0.0, 0.0, 0);
    for ((truth, own), bounds) in truth.readings.iter().zip(&found.readings).zip(bounds) {
        for ((t, r), b) in truth.iter().zip(own).zip(bounds) {
            (error, bound) = (error.max((t - r).abs()), bound.max(*b));
            outside += usize::from((t - r).abs() > *b);
        }
    }
    assert_eq!(truth.times, found.times);
    (error, bound, outside)
}

/// A machine and its reduced model from four histories, made once.
pub fn moving_model(name: &str, cells: usize) -> &'static (Study, ReducedModel) {
    static RIG: OnceLock<(Study, ReducedModel)> = OnceLock::new();
    static FIVE_AXIS: OnceLock<(Study, ReducedModel)> = OnceLock::new();
    let place = if name == "rig" { &RIG } else { &FIVE_AXIS };
    place.get_or_init(|| {
        let study = study(name, cells);
        let settings = coldplate_reduce::ReduceSettings { histories: 4, ..settings(&study, false) };
        let model = reduce(&study, &settings, &Silent).expect("a model");
        (study, model)
    })
}

fn followed(name: &str, cells: usize, hour: f64, most: f64) {
    let (study, model) = moving_model(name, cells);
    let made = model.in_time.clone().expect("it follows histories");
    println!("{name}: {} modes, at the checks error {:.4} K, bound {:.3} K", model.fine.len(), made.largest_error, made.largest_bound);
    for start in [Start::Steady, Start::Uniform(293.15)] {
        let (error, bound, outside) = compared(study, model, start, hour);
        println!("  {start:?}: error {error:.4} K, bound {bound:.3} K, {outside} outside");
        assert_eq!(outside, 0);
        assert!(error < most, "{error} K");
    }
    // A file gives the same course.
    let bytes = model.to_bytes(study.document()).expect("bytes");
    let again = ReducedModel::from_bytes(&bytes).expect("the same model");
    let (schedule, options) = (schedule(&model.machine, model, hour), SimulateOptions::default());
    let [a, b] = [model, &again].map(|model| simulate::run_reduced(model, &schedule, &options).expect("a history"));
    assert_eq!(a.readings, b.readings);
    let table = a.table(&SimulatedMachine::from(&again)).expect("a table");
    assert!(table.columns.iter().any(|c| c.name.ends_with(" bound")));
}

#[test]
fn of_the_rig() {
    followed("rig", 1500, 120.0, 0.04);
}

#[test]
fn of_the_five_axis_machine() {
    followed("five_axis", 2500, 7200.0, 0.1);
}

/// Its history ends a stretch a rounding error behind a step: a step to there tells nothing of how the next one bends.
#[test]
fn a_sliver_of_time_stops_no_history() {
    let study = study("slab", 300);
    let ranges = vec![(2.0 / 6e4, 8.0 / 6e4), (291.15, 297.15), (0.0, 314.16), (291.15, 301.15)];
    let settings = coldplate_reduce::ReduceSettings { histories: 2, ranges, ..settings(&study, false) };
    let made = reduce(&study, &settings, &Silent).expect("a model").in_time.expect("it follows histories");
    assert!(made.largest_error < 0.01, "{} K", made.largest_error);
}

#[test]
fn a_model_of_steady_states_says_so() {
    let study = study("rig", 600);
    let model = reduce(&study, &settings(&study, false), &Silent).expect("a model");
    let schedule = schedule(&study.model.machine, &model, 100.0);
    let error = simulate::run_reduced(&model, &schedule, &SimulateOptions::default()).expect_err("it was not made for that");
    assert!(error.to_string().contains("steady states only"), "{error}");
}
