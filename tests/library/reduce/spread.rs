//! Slopes and spreads of a reduced model against those of the full one.

use coldplate_base::progress::Silent;
use coldplate_describe::machine::Condition;
use coldplate_reduce::{ReducedModel, reduce};
use coldplate_solve::sensitivity::Derivatives;

use super::{settings, study};

const DRAWS: usize = 200;

#[test]
fn slopes_and_spreads_are_those_of_the_full_model() {
    let study = study("rig", 800);
    let model = reduce(&study, &settings(&study, true), &Silent).expect("a reduced model");
    let condition = Condition::from_si(model.ranges.iter().map(|(low, high)| low + 0.4 * (high - low)).collect());
    let (machine, network) = (&study.model.machine, &study.model.network);
    let found = model.slopes(&condition).expect("slopes");
    // Derivatives of the full model by its adjoint, each for one deviation of its parameter.
    let state = study.model.steady(&condition).expect("a full solve");
    let truth = Derivatives::at(&study, &condition, &state.solution.temperatures).expect("derivatives");
    let along = truth.along_open(&model.parameters).expect("slopes");
    let largest = along.iter().flatten().fold(0.0, |m: f64, s| m.max(s.abs()));
    let mut worst: f64 = 0.0;
    for (s, row) in along.iter().enumerate() {
        for ((parameter, own), truth) in model.parameters.iter().zip(&found.parameters).zip(row) {
            worst = worst.max((own[s] * parameter.deviation - truth).abs() / largest);
        }
    }
    assert_eq!(found.variables.len(), machine.variables.len());
    let reduced = model.spreads(&condition, DRAWS, 3, None).expect("spreads");
    let full = model.spreads(&condition, DRAWS, 3, Some(network)).expect("spreads in full");
    assert_eq!((reduced.draws, full.draws, full.failed), (DRAWS, DRAWS, 0));
    let mut most: f64 = 0.0;
    for (own, truth) in reduced.readings.iter().zip(&full.readings) {
        let apart = [own.mean - truth.mean, own.interval.0 - truth.interval.0, own.interval.1 - truth.interval.1];
        most = apart.iter().fold(most, |m, x| m.max(x.abs()));
        assert!(apart.iter().all(|x| x.abs() <= own.bound), "{apart:?} where the bound is {}", own.bound);
        assert!(truth.bound == 0.0);
    }
    let widest = full.readings.iter().fold(0.0, |m: f64, own| m.max(own.deviation));
    println!(
        "rig: slopes within {worst:.1e} of the largest, {DRAWS} draws: deviation up to {widest:.2} K, mean and ends within {most:.1e} K"
    );
    assert!(worst < 2e-2 && widest > 0.1);
}

#[test]
fn nothing_to_draw_is_said() {
    let study = study("rig", 400);
    let model: ReducedModel = reduce(&study, &settings(&study, false), &Silent).expect("a reduced model");
    let condition = Condition::from_si(model.ranges.iter().map(|(low, high)| 0.5 * (low + high)).collect());
    let text = model.spreads(&condition, 10, 1, None).expect_err("no parameters").to_string();
    assert!(text.contains("--uncertain"), "{text}");
}
