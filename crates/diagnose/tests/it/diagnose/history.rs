//! Signatures of logs, followed in a few unknowns, beside differences of whole runs.

use coldplate_describe::machine::Machine;
use coldplate_diagnose::{Effect, Hypothesis, Law, LawForm, Leak, Radiation, Scales, hypotheses, signatures, under_rarer_laws};
use coldplate_evidence::identify;
use coldplate_explore::simulate::Start;

use crate::diagnose::logs::{CELLS, ROW, logs, study, table};

/// Error of the runs' time steps, K, and the change they are to show, as a share of the prior's scale.
const TOLERANCE: f64 = 1e-4;
const STEP: f64 = 0.05;
/// How much further apart the two may be where they do not say the same exactly.
const LOOSE: f64 = 5.0;

fn compare(start: Start, lines: &[(String, String)]) {
    compare_some(start, lines, |catalogue, _, _| catalogue, 20);
}

type Chosen = fn(Vec<Hypothesis>, &Machine, &Scales) -> Vec<Hypothesis>;

fn compare_some(start: Start, lines: &[(String, String)], chosen: Chosen, least: usize) {
    let study = study(CELLS, lines);
    let data = table(logs(&study, ROW), &study);
    let scales = Scales::of(&data, &study.model.machine);
    let catalogue = chosen(hypotheses(&study, &data, &[]), &study.model.machine, &scales);
    let uncertain = [study.parameter("material.steel.specific_heat").unwrap(), study.parameter("contact.gear.conductance").unwrap()];
    let found = signatures(&study, &data, start, &uncertain, &catalogue, &scales, &[]).unwrap();
    let run = |study: &coldplate_solve::study::Study| identify::values_within(study, &data, start, TOLERANCE).unwrap();
    let mut followed = 0;
    let mut worst: (f64, String) = (0.0, String::new());
    for (h, column) in catalogue.iter().zip(&found.columns).filter(|(h, _)| !h.is_sensor()) {
        let at = |step: f64| h.sets(&study, &scales, &[], step).unwrap().map(|sets| run(&study.edited(&sets).unwrap()));
        // Gas saturates: it is followed over the whole of its prior.
        let step = if h.effect == Effect::Radiation(Radiation::Gas) { h.scale } else { STEP * h.scale };
        let (Some(more), Some(less)) = (at(step), if h.is_signed { at(-step) } else { at(0.0) }) else { continue };
        let width = if h.is_signed { 2.0 * step } else { step };
        let slope: Vec<f64> = more.iter().zip(&less).map(|(a, b)| (a - b) / width).collect();
        let size = slope.iter().map(|s| s * s).sum::<f64>().sqrt() * h.scale;
        if size < 0.5 {
            continue;
        }
        followed += 1;
        let apart = slope.iter().zip(column).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt() * h.scale / size;
        let own = column.iter().map(|s| s * s).sum::<f64>().sqrt() * h.scale;
        println!("{apart:.4} of {size:.2} K, followed {own:.2} K: {} at {} {}", h.kind(), h.place, h.law.words());
        // What is spread over a part in the screen enters over its surface in the file.
        let is_loose =
            matches!(h.effect, Effect::Leak(Leak::Surroundings(_) | Leak::Link(..)) | Effect::Radiation(Radiation::Exchange(..)));
        if apart / if is_loose { LOOSE } else { 1.0 } > worst.0 {
            worst = (apart, format!("{} at {} {}", h.kind(), h.place, h.law.words()));
        }
    }
    assert!(followed > least, "{followed}");
    assert!(worst.0 < 0.05, "{worst:?}");
}

#[test]
fn from_the_steady_state() {
    compare(Start::Steady, &[]);
}

#[test]
fn from_one_temperature() {
    compare(Start::Uniform(293.15), &[]);
}

/// What a cause does is seen through the sensors' own lag and gain.
#[test]
fn through_sensors_that_lag() {
    let line = |key: &str, value: &str| (key.to_string(), value.to_string());
    let lines = [line("sensor.motor.lag", "\"400 s\""), line("sensor.gear.gain", "0.8"), line("sensor.plate.offset", "\"2 K\"")];
    compare(Start::Steady, &lines);
}

/// Causes that grow with the time, or set in while nothing else happens and nearly as the condition changes.
#[test]
fn as_the_time_passes() {
    let time = ("variables.time".to_string(), "{ unit = \"s\", default = \"0 s\" }".to_string());
    let chosen: Chosen = |catalogue, machine, scales| {
        let is_some = |h: &Hypothesis| matches!(h.law, Law::Of(_, LawForm::Passed | LawForm::After(3125 | 6250) | LawForm::Power(150)));
        under_rarer_laws(&catalogue, machine, scales).into_iter().filter(is_some).collect()
    };
    compare_some(Start::Steady, &[time], chosen, 20);
}
