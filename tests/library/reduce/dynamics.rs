//! Surrogates that move, made from reduced models, against histories in full.

use coldplate_base::progress::Silent;
use coldplate_base::units::{celsius, express};
use coldplate_explore::schedule::Schedule;
use coldplate_explore::simulate::{self, SimulateOptions, Start};
use coldplate_explore::sweep::design;
use coldplate_jobs::dynamics_fit::with_dynamics;
use coldplate_jobs::fitting;
use coldplate_jobs::surrogate_run::SurrogateRun;
use coldplate_reduce::{ReducedModel, reduce};
use coldplate_surrogate::fit::model::SurrogateSpec;
use coldplate_surrogate::fit::{FitOptions, file};
use coldplate_tables::{Column, Table};

use crate::reduce::histories::{moving_model, schedule};
use crate::reduce::{settings, study};

/// A surrogate of the variables that have ranges, through answers of a reduced model.
fn surrogate(model: &ReducedModel) -> SurrogateSpec {
    let machine = &model.machine;
    let varied: Vec<usize> = (0..model.ranges.len()).filter(|v| model.ranges[*v].1 > model.ranges[*v].0).collect();
    let mut shares = design::latin_hypercube(200, varied.len(), 3);
    shares.extend(design::corners(varied.len()));
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); machine.variables.len() + machine.sensors.len()];
    for shares in &shares {
        let mut si: Vec<f64> = model.ranges.iter().map(|(low, _)| *low).collect();
        for (v, share) in varied.iter().zip(shares) {
            si[*v] += share * (model.ranges[*v].1 - si[*v]);
        }
        for ((column, variable), value) in columns.iter_mut().zip(&machine.variables).zip(&si) {
            column.push(express(*value, &variable.unit, variable.dimension).expect("its own unit"));
        }
        let answer = model.steady(&coldplate_describe::machine::Condition::from_si(si), &[]).expect("a steady state");
        let readings = columns[machine.variables.len()..].iter_mut().zip(&answer.finer);
        readings.for_each(|(column, reading)| column.push(celsius(*reading)));
    }
    let names = machine.variables.iter().map(|v| (&v.name, v.unit.clone())).chain(machine.sensors.iter().map(|s| (&s.name, "degC".into())));
    let column = |((name, unit), values): ((&String, String), Vec<f64>)| Column { name: name.clone(), unit, values };
    let table = Table {
        texts: Vec::new(),
        columns: names.zip(columns).map(column).collect(),
        inputs: machine.variables.len(),
        provenance: Vec::new(),
    };
    fitting::fit_table(&table, Some(&machine.scope()), &FitOptions::default()).expect("a fit").surrogate
}

/// Follows a schedule that neither was made from, and compares every reading with the full solver's.
fn followed(name: &str, cells: usize, hour: f64, most: f64) {
    let (study, model) = moving_model(name, cells);
    let mut surrogate = surrogate(model);
    with_dynamics(&mut surrogate, model, &Silent).expect("dynamics");
    let bytes = file::encode(&surrogate).expect("a file");
    assert!(file::decode(&bytes).expect("the same").in_time == surrogate.in_time);
    let opened = file::open(&bytes).expect("a file");
    let schedule: Schedule = schedule(&study.model.machine, model, hour);
    for start in [Start::Steady, Start::Uniform(293.15)] {
        let options = SimulateOptions { start, ..SimulateOptions::default() };
        let truth = simulate::run(&study.model, &schedule, &options, &mut |_| {}).expect("in full");
        let mut own = SurrogateRun::new(&opened).expect("it moves");
        let found = simulate::run_stepped(&mut own, &schedule, &options).expect("followed");
        assert_eq!(truth.times, found.times);
        let bounds = &found.bounds.as_ref().expect("bounds")[0];
        let (mut worst, mut squares, mut outside, mut count): (f64, f64, usize, usize) = (0.0, 0.0, 0, 0);
        for (truth, own) in truth.temperatures.iter().zip(&found.temperatures) {
            for ((t, r), b) in truth.iter().zip(own).zip(bounds) {
                let error = (t - r).abs();
                (worst, squares, count) = (worst.max(error), squares + error * error, count + 1);
                outside += usize::from(error > *b);
            }
        }
        let (rms, bound) = ((squares / count as f64).sqrt(), bounds.iter().fold(0.0, |m: f64, b| m.max(*b)));
        println!("{name} {start:?}: error rms {rms:.4}, largest {worst:.3} K, bound {bound:.3} K, {outside} of {count} outside");
        assert!(rms < most, "{rms}");
        assert!(outside * 200 <= count, "{outside} of {count} readings are outside");
    }
}

/// Water crosses the rig as slowly as its parts follow, and its fronts have no states.
#[test]
fn of_the_rig() {
    followed("rig", 1500, 120.0, 0.25);
}

#[test]
fn of_the_five_axis_machine() {
    followed("five_axis", 2500, 7200.0, 0.1);
}

#[test]
fn a_model_of_something_else_is_refused() {
    let study = study("rig", 600);
    let model = reduce(&study, &settings(&study, false), &Silent).expect("a model");
    let mut surrogate = surrogate(&model);
    let refused = |surrogate: &mut SurrogateSpec, model: &ReducedModel| {
        with_dynamics(surrogate, model, &Silent).expect_err("it does not fit").to_string()
    };
    assert!(refused(&mut surrogate, &model).contains("steady states only"));
    let (_, model) = moving_model("rig", 1500);
    let mut other = surrogate.clone();
    other.points[0].name = "elsewhere".into();
    assert!(refused(&mut other, model).contains("no sensor 'elsewhere'"));
    let mut wider = surrogate.clone();
    wider.variables[0].high *= 2.0;
    assert!(refused(&mut wider, model).contains("not made for all conditions"));
    let mut named = surrogate.clone();
    named.variables[0].name = "oil".into();
    assert!(refused(&mut named, model).contains("no variable 'oil'"));
    let bytes = file::encode(&surrogate).expect("a file");
    let error = SurrogateRun::new(&file::open(&bytes).expect("a file")).map(|_| ()).expect_err("it is steady");
    assert!(error.to_string().contains("steady states only"), "{error}");
}
