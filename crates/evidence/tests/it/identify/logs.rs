//! Emissivity and conductance from a log: warming up, then standing.

use coldplate_base::progress::Silent;
use coldplate_evidence::identify::{Free, IdentifyOptions, IdentifyProblem, identify};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, VariableUncertainty};
use coldplate_explore::schedule::{self, Schedule};
use coldplate_explore::simulate::{self, Start};
use coldplate_solve::study::Study;
use rayon::prelude::*;

use super::common::{Normal, condition, study};

/// A block that cools by radiation and through one joint to a plate of the ambient temperature.
const BLOCK: &str = r#"
name = "a block on a stand"
[part.block]
material = "aluminium 6061"
box = ["120 mm", "80 mm", "60 mm"]
surface = { emissivity = 0.5 }
[part.foot]
material = "aluminium 6061"
box = ["120 mm", "80 mm", "20 mm"]
at = ["0 mm", "0 mm", "-20 mm"]
surface = { emissivity = 0.1 }
[contact.foot]
between = ["block", "foot"]
conductance = "20 W/(m2 K)"
[boundary.ground]
faces = ["foot.-z"]
temperature = "ambient_temperature"
[source.block]
in = "block"
power = "0.03 * motor_speed_rpm"
[sensor.block]
part = "block"
[sensor.foot]
part = "foot"
"#;
const PLANTED: [(&str, f64); 2] = [("part.block.surface.emissivity", 0.8), ("contact.foot.conductance", 30.0)];
const SEEDS: usize = 16;

/// Rows every twenty minutes: two hours at 2000 rpm, then standing. The row at which the speed falls has no readings.
fn plan(file: &Study) -> Vec<(f64, coldplate_describe::machine::Condition)> {
    let at = |speed: f64| condition(file, [2.0, 20.0, speed, 22.0]);
    let running = (0..=6).map(|i| (1200.0 * f64::from(i), at(2000.0)));
    let standing = (7..=15).map(|i| (1200.0 * f64::from(i), at(0.0)));
    running.chain([(7201.0, at(0.0))]).chain(standing).collect()
}

fn truth(file: &Study, plan: &[(f64, coldplate_describe::machine::Condition)]) -> Vec<Vec<f64>> {
    let rows = plan.iter().map(|(time, c)| schedule::Breakpoint { time: *time, values: c.si().to_vec() }).collect();
    let options = simulate::SimulateOptions {
        start: Start::Uniform(22.0 + 273.15),
        tolerance: 1e-5,
        every: Some(f64::INFINITY),
        ..simulate::SimulateOptions::default()
    };
    let history = simulate::run(&file.model, &Schedule::from_rows(rows, &[]).unwrap(), &options, &mut |_| {}).unwrap();
    let at = |time: f64| history.times.iter().position(|t| (t - time).abs() < 1e-6).unwrap();
    plan.iter().map(|(time, _)| history.readings[at(*time)].clone()).collect()
}

#[test]
fn emissivity_and_conductance_come_from_warming_up_and_standing() {
    let fine = study(BLOCK, Some(800));
    let planted: Vec<_> = PLANTED.iter().map(|(name, value)| (fine.parameter(name).unwrap(), *value)).collect();
    let fine = fine.with(&planted.iter().map(|(p, v)| (p, *v)).collect::<Vec<_>>()).unwrap();
    let coarse = study(BLOCK, Some(60));
    let plan = plan(&coarse);
    let truth = truth(&fine, &plan);
    let one = |seed: usize| {
        let mut noise = Normal(seed as u64 + 17);
        let bias = [0.05 * noise.next(), 0.05 * noise.next()];
        let rows = plan.iter().zip(&truth).map(|((time, condition), readings)| {
            let mut read = |k: usize| (*time != 7201.0).then(|| readings[k] + bias[k] + 0.05 * noise.next());
            ReadingRow { test: "log".into(), time: Some(*time), condition: condition.clone(), readings: vec![read(0), read(1)], line: None }
        });
        let rows: Vec<ReadingRow> = rows.collect();
        let data = Data { source: "log".into(), sensors: vec![0, 1], names: vec!["block".into(), "foot".into()], rows, ..Data::default() };
        let mut u = MeasurementUncertainty::usual(&data, &coarse.model.machine);
        (u.noise, u.bias) = (vec![0.05; 2], vec![0.05; 2]);
        u.variables = vec![VariableUncertainty::default(); 4];
        let free = PLANTED.iter().map(|(name, _)| Free::parse(name, &coarse).unwrap()).collect();
        let problem = IdentifyProblem { study: coarse.clone(), data, uncertainty: u, free, start: Start::Uniform(22.0 + 273.15) };
        identify(&problem, &IdentifyOptions { starts: 1, seed: 1 }, &Silent).unwrap()
    };
    let found: Vec<_> = (0..SEEDS).into_par_iter().map(one).collect();
    for (k, (name, planted)) in PLANTED.iter().enumerate() {
        let covered = found.iter().filter(|f| f.intervals[k].0 <= *planted && *planted <= f.intervals[k].1).count();
        let worst = found.iter().map(|f| (f.values[k] / planted - 1.0).abs()).fold(0.0, f64::max);
        println!("{name}: {covered} of {SEEDS} intervals, largest error {worst:.4}, deviation {:.4}", found[0].deviations[k]);
        assert!(super::common::is_likely(covered, SEEDS, 0.95), "{name}: {covered} of {SEEDS}");
        assert!(worst < 0.05, "{name}: {worst}");
    }
    let low = found.iter().filter(|f| f.probability < 0.05).count();
    assert!(super::common::is_likely(low, SEEDS, 0.05), "{low}");
    // Both act on the same cooling: their errors go against each other, but they are told apart.
    assert!(found[0].correlation[(0, 1)] < -0.3 && found[0].undetermined.is_empty(), "{}", found[0].correlation);
}
