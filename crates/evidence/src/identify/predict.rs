//! Predictions of the readings, with their derivatives with respect to parameters and conditions.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::prediction::{Prediction, own_key};
use super::steady::{steady, steady_near};
use crate::measurement::whiten::places;
use crate::measurement::{Data, ReadingRow};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::Measurand;
use coldplate_describe::machine::{Condition, Machine, Sensor, SensorReading};
use coldplate_explore::schedule::{self, Schedule};
use coldplate_explore::simulate::{self, PlaceStart, RunInstant, Start, StartPlace};
use coldplate_network::Load;
use coldplate_solve::sensitivity::{Moment, Moments};
use coldplate_solve::study::{MachineParameter, ParameterKind, Study};

/// Default error allowed in each time step of a log, K. Chosen: small enough for differences between runs.
pub const TIME_TOLERANCE: f64 = 1e-3;
/// Share of the heat that time steps may leave open, per kelvin of the error allowed in them, 1/K. Chosen: a smaller one costs
/// Newton steps.
const BALANCE: f64 = 1e-5;
/// Relative step of a parameter for slopes by differences of whole runs; dimensionless. Chosen: a smaller one drowns in the
/// error of time steps, a larger one bends.
const RUN_STEP: f64 = 0.02;
/// Step of a parameter of value zero for such slopes, in steps of an exact derivative. Dimensionless; chosen larger because
/// runs carry the error of their time steps.
const RUN_STEP_FROM_ZERO: f64 = 100.0;
/// Step of a temperature for slopes by differences of whole runs, K. Chosen: a smaller one drowns in the error of time steps.
const RUN_KELVIN: f64 = 0.2;
/// Rows of a test above which the log of a lumped machine counts as long, count. Chosen: a long log is solved exactly if that
/// is possible.
const LONG: usize = 2000;
/// Rows of a test above which a lumped machine is followed through all turns of its conditions, count. Chosen: after thinning a
/// test only has so many rows if its conditions turn in nearly every one.
const MANY_TURNS: usize = 1000;

/// Instants of a test at which effects are followed in a machine of cells, count. Chosen: the time grows with their number.
const MOMENTS_OF_CELLS: usize = 32;
/// Instants of a test at which effects are followed in a machine of lumped nodes, count. Chosen: they cost little there.
const MOMENTS_OF_NODES: usize = 64;
/// Instants of a test at which effects are followed in a machine of lumped nodes if conditions never rest, count. Chosen:
/// four times more took three times as long in two months of a lumped machine, and named the same contact.
const MOMENTS_OF_MANY_TURNS: usize = 2048;

/// Ends of the time steps in which the logs of each test were run, s.
pub(super) type Steps = BTreeMap<String, Vec<f64>>;

/// Accuracy and time steps of the runs of logs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace<'a> {
    /// Error allowed in each time step, K.
    pub tolerance: f64,
    /// Steps to take in the named tests, whatever their error: machines that differ by little are compared in the same ones.
    pub steps: Option<&'a Steps>,
}

impl Pace<'_> {
    /// Runs that choose their own steps.
    pub fn own(tolerance: f64) -> Self {
        Self { tolerance, steps: None }
    }
}

/// Predictions and slopes with the machine of `study`.
///
/// # Errors
/// The machine cannot be solved at a condition, or a log cannot be run.
pub fn predict(study: &Study, data: &Data, parameters: &[MachineParameter], start: Start) -> Result<Prediction> {
    predict_within(study, data, parameters, start, TIME_TOLERANCE)
}

/// Predictions and slopes, with logs run to the error `tolerance` in each time step, K.
///
/// # Errors
/// Errors of [`predict`].
pub fn predict_within(study: &Study, data: &Data, parameters: &[MachineParameter], start: Start, tolerance: f64) -> Result<Prediction> {
    Ok(predict_some(study, data, parameters, true, start, Pace::own(tolerance))?.0)
}

/// Predictions, slopes and the time steps in which logs were run. Without `conditions` the slopes with respect to the condition
/// variables are left out (empty rows).
pub(super) fn predict_some(
    study: &Study,
    data: &Data,
    parameters: &[MachineParameter],
    conditions: bool,
    start: Start,
    pace: Pace<'_>,
) -> Result<(Prediction, Steps)> {
    if data.is_transient() {
        logs(study, data, parameters, conditions, start, pace)
    } else {
        Ok((steady(study, data, parameters, conditions)?, Steps::new()))
    }
}

/// Predictions alone.
///
/// # Errors
/// Errors of [`predict`].
pub fn values(study: &Study, data: &Data, start: Start) -> Result<Vec<f64>> {
    values_within(study, data, start, TIME_TOLERANCE)
}

/// Predictions alone, with logs run to the error `tolerance` in each time step, K.
///
/// # Errors
/// Errors of [`predict`].
pub fn values_within(study: &Study, data: &Data, start: Start, tolerance: f64) -> Result<Vec<f64>> {
    if data.is_transient() {
        return Ok(run_logs(study, data, start, None, Pace::own(tolerance))?.values);
    }
    Ok(steady_near(study, data, &[])?.0)
}

fn logs(
    study: &Study,
    data: &Data,
    parameters: &[MachineParameter],
    with_conditions: bool,
    start: Start,
    pace: Pace<'_>,
) -> Result<(Prediction, Steps)> {
    let Ran { values, temperatures, steps } = run_logs(study, data, start, None, pace)?;
    // The error of the time steps nearly cancels in differences of runs with the same steps.
    let beside = Pace { steps: Some(&steps), ..pace };
    let step = |p: &MachineParameter| match p.value {
        _ if p.dimension.is_absolute() || p.kind == ParameterKind::Offset => RUN_KELVIN,
        0.0 => RUN_STEP_FROM_ZERO * p.step(0.0),
        value => RUN_STEP * value.abs(),
    };
    let column = |p: &MachineParameter| -> Result<Vec<f64>> {
        // At the end of the valid range, such as an emissivity of one, the step goes back.
        let forward = step(p);
        let (step, study) = match study.with(&[(p, p.value + forward)]) {
            Ok(moved) => (forward, moved),
            Err(e) => (-forward, study.with(&[(p, p.value - forward)]).map_err(|_| e)?),
        };
        // A sensor's response does not act on the temperature of its place.
        let moved = match own_key(p, data) {
            Some(_) => in_rows(data, &shown(&study, data, None, &temperatures)?),
            None => run_logs(&study, data, start, None, beside)?.values,
        };
        Ok(moved.iter().zip(&values).map(|(a, b)| (a - b) / step).collect())
    };
    let columns: Vec<Vec<f64>> = parameters.par_iter().map(column).collect::<Result<_>>()?;
    let shifted = |v: usize| -> Result<Vec<f64>> {
        let variable = &study.model.machine.variables[v];
        let typical = data.rows.iter().map(|row| row.condition.si()[v].abs()).fold(0.0, f64::max);
        let step = if variable.dimension.is_absolute() { RUN_KELVIN } else { RUN_STEP * typical };
        if step == 0.0 || variable.name == schedule::TIME || !acts(study, data, v, step)? {
            return Ok(vec![0.0; values.len()]);
        }
        let moved = run_logs(study, data, start, Some((v, step)), beside)?.values;
        Ok(moved.iter().zip(&values).map(|(a, b)| (a - b) / step).collect())
    };
    let variables = if with_conditions { study.model.machine.variables.len() } else { 0 };
    let conditions: Vec<Vec<f64>> = (0..variables).into_par_iter().map(shifted).collect::<Result<_>>()?;
    let rows = |columns: &[Vec<f64>]| (0..values.len()).map(|i| columns.iter().map(|c| c[i]).collect()).collect();
    Ok((Prediction { slopes: rows(&columns), conditions: rows(&conditions), values }, steps))
}

/// Whether an increase of a variable by a step throughout a log acts on anything.
fn acts(study: &Study, data: &Data, variable: usize, step: f64) -> Result<bool> {
    let machine = &study.model.machine;
    if study.model.network.streams.iter().any(|stream| stream.has_film_formula()) {
        return Ok(true);
    }
    for row in &data.rows {
        let mut moved = row.condition.si().to_vec();
        moved[variable] += step;
        let (here, there) = (Load::at(machine, &row.condition)?, Load::at(machine, &Condition::from_si(moved))?);
        // The values of the variables themselves are no heat, flow or temperature.
        if (Load { variables: here.variables.clone(), names: here.names.clone(), ..there }) != here {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The predictions of every test in the order of the data.
pub(super) fn joined(data: &Data, tests: &[String], found: &[Prediction]) -> Prediction {
    let mut next = vec![0; tests.len()];
    let mut whole = Prediction { values: Vec::new(), slopes: Vec::new(), conditions: Vec::new() };
    for (r, _) in places(data) {
        let Some(t) = tests.iter().position(|t| *t == data.rows[r].test) else { continue };
        whole.values.push(found[t].values[next[t]]);
        whole.slopes.push(found[t].slopes[next[t]].clone());
        whole.conditions.push(found[t].conditions[next[t]].clone());
        next[t] += 1;
    }
    whole
}

/// Predictions of logs, and for each test (in the order of [`Data::tests`]) the instants between which it runs about straight.
///
/// # Errors
/// Errors of [`predict`].
pub fn histories(study: &Study, data: &Data, start: Start, tolerance: f64) -> Result<(Vec<f64>, Vec<Vec<Moment>>)> {
    let tests = data.tests();
    let run = |test: &String| -> Result<(Vec<Vec<f64>>, Vec<Moment>)> {
        let mut moments = Moments::new(match study.model.mesh.cells {
            0 if is_longer(study, data, test, MANY_TURNS) => MOMENTS_OF_MANY_TURNS,
            0 => MOMENTS_OF_NODES,
            _ => MOMENTS_OF_CELLS,
        });
        let mut look = |seen: &RunInstant<'_>| moments.see(seen.state.time, seen.condition, seen.load, &seen.state.temperatures);
        let (temperatures, _) = run_log(study, data, test, start, None, Pace::own(tolerance), Some(&mut look))?;
        Ok((temperatures, moments.into_kept()))
    };
    let (found, moments): (Vec<_>, Vec<_>) = tests.par_iter().map(run).collect::<Result<Vec<_>>>()?.into_iter().unzip();
    // Predictions to be compared with machines much like this one are solved as theirs: exactly, if nodes are few and linear.
    let values = if tests.iter().any(|test| is_long(study, data, test)) {
        values_within(study, data, start, tolerance)?
    } else {
        in_rows(data, &shown(study, data, None, &found)?)
    };
    Ok((values, moments))
}

/// Whether a test is a long log of lumped nodes: it is then solved exactly if that is possible.
fn is_long(study: &Study, data: &Data, test: &str) -> bool {
    is_longer(study, data, test, LONG)
}

fn is_longer(study: &Study, data: &Data, test: &str, rows: usize) -> bool {
    study.model.mesh.cells == 0 && data.rows.iter().filter(|row| row.test == test).count() > rows
}

/// Initial state of a test, and the places that begin at another temperature.
fn beginning(machine: &Machine, data: &Data, rows: &[&ReadingRow], start: Start) -> Result<(Start, Vec<PlaceStart>)> {
    if !matches!(start, Start::Readings | Start::Parts) {
        return Ok((start, Vec::new()));
    }
    // A sensor that has settled shows the temperature of its place by its response.
    let surroundings = rows.first().map_or(Ok(0.0), |row| machine.surroundings(&row.condition))?;
    let of = |(s, reading): (&usize, &Option<f64>)| {
        let sensor = &machine.sensors[*s];
        reading.filter(|_| sensor.measurand() == Measurand::Temperature).map(|r| (sensor, sensor.shows.temperature(r, surroundings)))
    };
    let first: Vec<(&Sensor, f64)> = rows.first().map_or(Vec::new(), |row| data.sensors.iter().zip(&row.readings).filter_map(of).collect());
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let all: Vec<f64> = first.iter().map(|(_, t)| *t).collect();
    if all.is_empty() {
        let error = Error::input("the first row of this test has no reading to begin with").at_key("--from");
        let error = error.help("give its first row a reading, or begin with --from steady or a temperature");
        return Err(match rows.first().and_then(|row| row.line) {
            Some(line) => error.at_line(line),
            None => error,
        });
    }
    let mut places: Vec<PlaceStart> = Vec::new();
    let place = |sensor: &Sensor| match &sensor.reads {
        SensorReading::Point(part, _) | SensorReading::PartMean(part) => StartPlace::Part(*part),
        SensorReading::Displacement(own) => StartPlace::Part(own.of.0),
        SensorReading::FaceMean(face) => StartPlace::Part(face.part),
        SensorReading::Node(node) => StartPlace::Node(*node),
        SensorReading::Inlet(channel) | SensorReading::Outlet(channel) => StartPlace::Channel(*channel),
    };
    for (sensor, _) in first.iter().filter(|_| start == Start::Parts) {
        let here = place(sensor);
        if places.iter().all(|known| known.place != here) {
            let own: Vec<f64> = first.iter().filter(|(other, _)| place(other) == here).map(|(_, t)| *t).collect();
            places.push(PlaceStart { place: here, temperature: mean(&own) });
        }
    }
    Ok((Start::Uniform(mean(&all)), places))
}

/// Temperatures of all sensors' places at the rows of each test, K.
type Courses = Vec<Vec<Vec<f64>>>;

/// Logs that were run.
pub(super) struct Ran {
    /// Readings that the sensors show, in the order of the data, K.
    pub values: Vec<f64>,
    /// Temperatures of the sensors' places, K.
    temperatures: Courses,
    pub steps: Steps,
}

/// Runs every test of a log; `shift` adds to one variable (SI) throughout.
pub(super) fn run_logs(study: &Study, data: &Data, start: Start, shift: Option<(usize, f64)>, pace: Pace<'_>) -> Result<Ran> {
    let tests = data.tests();
    let run = |test: &String| run_log(study, data, test, start, shift, pace, None);
    let (temperatures, steps): (Courses, Vec<Vec<f64>>) = tests.par_iter().map(run).collect::<Result<Vec<_>>>()?.into_iter().unzip();
    let values = in_rows(data, &shown(study, data, shift, &temperatures)?);
    Ok(Ran { values, temperatures, steps: tests.into_iter().zip(steps).collect() })
}

/// Readings that a machine's sensors show at the temperatures of their places, K; `shift` adds to one variable (SI) throughout.
fn shown(study: &Study, data: &Data, shift: Option<(usize, f64)>, temperatures: &Courses) -> Result<Courses> {
    let of = |(test, course): (&String, &Vec<Vec<f64>>)| {
        let rows = || data.rows.iter().filter(|row| row.test == *test);
        let times: Vec<f64> = rows().map(|row| row.time.unwrap_or(0.0)).collect();
        let conditions: Vec<Condition> = rows().map(|row| Condition::from_si(shifted(row, shift))).collect();
        simulate::shown(&study.model.machine, &times, &conditions, course)
    };
    data.tests().iter().zip(temperatures).map(of).collect()
}

/// Values of the variables in a row, SI; `shift` adds to one of them.
fn shifted(row: &ReadingRow, shift: Option<(usize, f64)>) -> Vec<f64> {
    let mut values = row.condition.si().to_vec();
    if let Some((v, step)) = shift {
        values[v] += step;
    }
    values
}

/// Runs one test; `shift` adds to one variable (SI) throughout. Returns the temperatures of all sensors' places at each of its rows, and the ends of the steps. Without an
/// observer of the steps only the rows count.
fn run_log(
    study: &Study,
    data: &Data,
    test: &str,
    start: Start,
    shift: Option<(usize, f64)>,
    Pace { tolerance, steps }: Pace<'_>,
    mut seen: Option<&mut dyn FnMut(&RunInstant<'_>)>,
) -> Result<(Vec<Vec<f64>>, Vec<f64>)> {
    let rows: Vec<&ReadingRow> = data.rows.iter().filter(|row| row.test == *test).collect();
    let moved = |row: &&ReadingRow| schedule::Breakpoint { time: row.time.unwrap_or(0.0), values: shifted(row, shift) };
    let schedule = Schedule::from_rows(rows.iter().map(moved).collect(), &data.held)?;
    let (start, places) = beginning(&study.model.machine, data, &rows, start)?;
    let options = simulate::SimulateOptions {
        start,
        places,
        tolerance,
        balance: BALANCE * tolerance,
        every: Some(f64::INFINITY),
        only_outputs: seen.is_none() && is_long(study, data, test),
        only_temperatures: true,
        steps: steps.and_then(|steps| steps.get(test)).cloned().unwrap_or_default(),
        ..simulate::SimulateOptions::default()
    };
    let mut ends: Vec<f64> = Vec::new();
    let mut note = |now: &RunInstant<'_>| {
        let begun = ends.last().copied().unwrap_or_else(|| schedule.start());
        ends.extend(Some(now.state.time).filter(|time| *time > begun));
        if let Some(seen) = &mut seen {
            seen(now);
        }
    };
    let history = simulate::run(&study.model, &schedule, &options, &mut note)?;
    let at = |row: &&ReadingRow| {
        nearest(&history.times, row.time.unwrap_or(0.0))
            .map(|i| history.temperatures[i].clone())
            .ok_or_else(|| Error::numerics("a run without output"))
    };
    Ok((rows.iter().map(at).collect::<Result<_>>()?, ends))
}

/// Index of the first of the times (ascending) nearest to a time.
fn nearest(times: &[f64], time: f64) -> Option<usize> {
    let later = times.partition_point(|t| *t < time);
    let Some(earlier) = later.checked_sub(1) else { return (!times.is_empty()).then_some(0) };
    if times.get(later).is_some_and(|t| t - time < time - times[earlier]) {
        return Some(later);
    }
    Some(times.partition_point(|t| *t < times[earlier]))
}

/// Readings of every test in the order of the data.
fn in_rows(data: &Data, found: &[Vec<Vec<f64>>]) -> Vec<f64> {
    let tests = data.tests();
    let mut next = vec![0; tests.len()];
    let mut of_row = Vec::with_capacity(data.rows.len());
    for row in &data.rows {
        let t = tests.iter().position(|t| *t == row.test).unwrap_or(0);
        of_row.push((t, next[t]));
        next[t] += 1;
    }
    places(data).into_iter().map(|(r, k)| found[of_row[r].0][of_row[r].1][data.sensors[k]]).collect()
}
