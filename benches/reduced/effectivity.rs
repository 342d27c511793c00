//! Bound over true error at random conditions that no model has seen.

use std::path::Path;

use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::{Condition, DescribedVariable};
use coldplate_network::Load;
use coldplate_reduce::{ReduceSettings, reduce};
use coldplate_solve::Solver;
use coldplate_solve::study::Study;
use rayon::prelude::*;

use super::plot;

const MACHINES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/machines");
const IMAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/images/effectivity.svg");
/// Every shipped machine and its cells; the bare one of the pipe is its twin but for what a diagnosis adds.
const CASES: [(&str, usize); 8] = [
    ("five_axis", 4000),
    ("rig", 3000),
    ("spindle", 2000),
    ("column", 2000),
    ("enclosure", 2000),
    ("bracket", 2000),
    ("hot_water_pipe", 1500),
    ("slab", 1500),
];
/// Ranges of the usual variables where a machine file has none.
const USUAL: [(f64, f64); 4] = [(3.925e-5, 3.14e-4), (291.15, 297.15), (26.2, 261.8), (291.15, 297.15)];
const ACCURACY: f64 = 1e-3;
/// Most conditions solved in full for a model.
const MOST: usize = 120;
/// What a bound should be at most, times the error, and what it must never be below.
const GOOD: (f64, f64) = (1.0, 20.0);
/// Errors below it are those of the full solver, K.
const SOLVER: f64 = 1e-5;

/// One machine.
struct Found {
    /// Largest bound over largest error of a condition, ascending.
    ratios: Vec<f64>,
    /// The same of conditions whose error is above that of the full solver.
    above: Vec<f64>,
    /// Readings outside their bound, of all.
    outside: (usize, usize),
    error: f64,
    bound: f64,
    modes: usize,
    solved: usize,
}

/// Prints the table and draws the histogram.
pub fn run(count: usize) {
    println!(
        "| machine | solved | modes | conditions | error, K | bound, K | 1 to 20 | below 1 | above the solver's own | 1 to 20 | readings outside |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    let mut drawn = Vec::new();
    for (machine, cells) in CASES {
        let found = one(machine, cells, count);
        let share = |ratios: &[f64]| match ratios.len() {
            0 => "".into(),
            all => format!("{:.1} %", 100.0 * ratios.iter().filter(|r| (GOOD.0..=GOOD.1).contains(*r)).count() as f64 / all as f64),
        };
        println!(
            "| {machine} | {} | {} | {} | {:.1e} | {:.1e} | {} | {} | {} | {} | {} of {} |",
            found.solved,
            found.modes,
            found.ratios.len(),
            found.error,
            found.bound,
            share(&found.ratios),
            found.ratios.iter().filter(|r| **r < GOOD.0).count(),
            found.above.len(),
            share(&found.above),
            found.outside.0,
            found.outside.1
        );
        drawn.push((machine.replace('_', " "), found.ratios));
    }
    plot::histogram(Path::new(IMAGE), "Bound over true error", &drawn, GOOD);
}

fn ranges(study: &Study) -> Vec<(f64, f64)> {
    let range = |(i, v): (usize, &DescribedVariable)| match (v.range, USUAL.get(i), v.default) {
        (Some(range), ..) => range,
        (None, Some(usual), _) => *usual,
        (None, None, default) => {
            default.map(|value| (value, value)).unwrap_or_else(|| panic!("'{}' has neither range nor default", v.name))
        }
    };
    study.model.machine.variables.iter().enumerate().map(range).collect()
}

fn one(machine: &str, cells: usize, count: usize) -> Found {
    let study = Study::read(format!("{MACHINES}/{machine}.toml"), &[], Some(cells)).unwrap_or_else(|e| panic!("{e}"));
    let (own, network) = (&study.model.machine, &study.model.network);
    let ranges = ranges(&study);
    let settings = ReduceSettings {
        accuracy: ACCURACY,
        ranges: ranges.clone(),
        with_parameters: false,
        most: MOST,
        histories: 0,
        with_field: false,
        seed: 1,
    };
    let model = reduce(&study, &settings, &Silent).unwrap_or_else(|e| panic!("{machine}: {e}"));
    let load = |condition: &Condition| Load::at(own, condition).unwrap_or_else(|e| panic!("{machine}: {e}"));
    let middle = Condition::from_si(ranges.iter().map(|(low, high)| 0.5 * (low + high)).collect());
    let solver = Solver::new(network, &load(&middle)).unwrap_or_else(|e| panic!("{machine}: {e}"));
    let mut random = Random::new(2026);
    let mut draw = || Condition::from_si(ranges.iter().map(|(low, high)| low + random.unit() * (high - low)).collect());
    let conditions: Vec<Condition> = (0..count).map(|_| draw()).collect();
    let compare = |condition: &Condition| {
        let load = load(condition);
        let (truth, answer) = (solver.steady(&load).ok()?, model.steady(condition, &[]).ok()?);
        let error = |(sensor, reading): (&coldplate_network::SensorTerm, &f64)| (sensor.read(&truth.temperatures, &load) - reading).abs();
        Some((network.sensors.iter().zip(&answer.readings).map(error).collect::<Vec<_>>(), answer.bounds))
    };
    let compared: Vec<(Vec<f64>, Vec<f64>)> = conditions.par_iter().filter_map(compare).collect();
    let most = |values: &[f64]| values.iter().fold(0.0, |m: f64, v| m.max(*v));
    let pairs: Vec<(f64, f64)> = compared.iter().map(|(errors, bounds)| (most(errors), most(bounds))).collect();
    let sorted = |least: f64| {
        let mut ratios: Vec<f64> = pairs.iter().filter(|(e, _)| *e > least).map(|(e, b)| b / e.max(1e-12)).collect();
        ratios.sort_by(f64::total_cmp);
        ratios
    };
    let outside: usize = compared.iter().map(|(errors, bounds)| errors.iter().zip(bounds).filter(|(e, b)| e > b).count()).sum();
    Found {
        ratios: sorted(-1.0),
        above: sorted(SOLVER),
        outside: (outside, compared.iter().map(|(errors, _)| errors.len()).sum()),
        error: pairs.iter().fold(0.0, |m, (e, _)| m.max(*e)),
        bound: pairs.iter().fold(0.0, |m, (_, b)| m.max(*b)),
        modes: model.coarse.len(),
        solved: model.made.solved,
    }
}
