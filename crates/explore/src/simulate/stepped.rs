//! A schedule run through any model that moves step by step, such as a surrogate that knows the machine over time.

use std::ops::Range;

use super::limits::Limits;
use super::recorder::{Recorder, outside};
use super::stretch::corners;
use super::{History, SimulateOptions, condition_at, stops};
use crate::schedule::Schedule;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Measurand, celsius};
use coldplate_describe::machine::{Condition, MachineLimit};
use coldplate_reduce::Beginning;

/// Steps from output to output while a condition moves, count; each holds the condition of its middle. Chosen: more cost time.
const PIECES: usize = 16;
/// Looks within a step at a condition that holds, count. Fast changes come at the beginning of the step, so the looks stand
/// closer there. Chosen: more cost time.
const LOOKS: usize = 8;
/// Halvings of the time between two looks around a passing, count. Chosen: 40 reach 1e-12 of the time.
const HALVINGS: usize = 40;

/// A model that moves by steps of one condition each. Temperatures are in K.
pub trait Stepper {
    /// Begins at a condition.
    ///
    /// # Errors
    /// A condition that the model cannot evaluate.
    fn begin(&mut self, beginning: Beginning, condition: &Condition) -> Result<()>;

    /// Advances by a time (s) at a condition that holds.
    ///
    /// # Errors
    /// A condition that the model cannot evaluate.
    fn advance(&mut self, seconds: f64, condition: &Condition) -> Result<()>;

    /// Readings of all sensors after a time (s) at a condition that holds. The model stays where it is.
    ///
    /// # Errors
    /// Errors of [`Stepper::advance`].
    fn ahead(&self, seconds: f64, condition: &Condition) -> Result<Vec<f64>>;

    /// Readings of all sensors now, at a condition.
    ///
    /// # Errors
    /// Errors of [`Stepper::advance`].
    fn read(&self, condition: &Condition) -> Result<Vec<f64>>;

    /// Readings of all sensors in the steady state of a condition.
    ///
    /// # Errors
    /// Errors of [`Stepper::advance`].
    fn steady(&self, condition: &Condition) -> Result<Vec<f64>>;

    /// Bound on the error of each reading.
    fn bounds(&self) -> Vec<f64>;

    /// Measurand of each sensor.
    fn measurands(&self) -> &[Measurand];

    /// Limits on the readings.
    fn limits(&self) -> &[MachineLimit];

    /// Whether the model was made for a condition.
    fn is_inside(&self, condition: &Condition) -> bool;
}

/// Runs `schedule` through a model. Settling and passing are looked for between the outputs too.
///
/// # Errors
/// A checkpoint is asked for; parts begin at temperatures of their own; errors of the model.
pub fn run_stepped(model: &mut dyn Stepper, schedule: &Schedule, options: &SimulateOptions) -> Result<History> {
    if options.checkpoint.is_some() {
        return Err(Error::input("this model is run anew sooner than a checkpoint is read").at_key("--checkpoint").help("leave it out"));
    }
    if !options.places.is_empty() {
        return Err(Error::input("parts cannot begin at temperatures of their own here").help("simulate the machine file"));
    }
    let stops = stops(schedule, options.every)?;
    let corners = corners(schedule, &stops);
    let first = schedule.stated(0);
    model.begin(options.start.of_schedule()?, &first)?;
    let readings = model.read(&first)?;
    let steady = model.steady(&schedule.last_condition()).map_err(|e| e.what().to_string());
    let (limits, measurands) = (model.limits().to_vec(), model.measurands().to_vec());
    let mut recorder = Recorder::new(schedule, &stops, Limits::new(&limits, &measurands), options, steady);
    recorder.look(schedule.start(), &readings, first.si());
    recorder.record(readings, Vec::new());
    let (mut now, mut steps) = (schedule.start(), 0);
    for (at, stop) in stops.iter().enumerate().skip(1) {
        let (begin, end) = (schedule.condition(stop.segment, now), schedule.condition(stop.segment, stop.time));
        if corners.binary_search(&at).is_ok() {
            recorder.corner();
            recorder.look(now, &model.read(&begin)?, begin.si());
        }
        let pieces = if begin == end { 1 } else { PIECES };
        let length = (stop.time - now) / pieces as f64;
        if begin == end {
            look_ahead(&mut recorder, model, now..stop.time, &begin)?;
        }
        for piece in 0..pieces {
            let middle = schedule.condition(stop.segment, now + (piece as f64 + 0.5) * length);
            model.advance(length, &middle)?;
            let time = if piece + 1 == pieces { stop.time } else { now + (piece as f64 + 1.0) * length };
            let condition = schedule.condition(stop.segment, time);
            recorder.look(time, &model.read(&condition)?, condition.si());
        }
        steps += pieces;
        now = stop.time;
        recorder.record(model.read(&condition_at(schedule, stop))?, Vec::new());
    }
    let bounds = vec![model.bounds(); stops.len()];
    Ok(History {
        steps,
        notes: outside(schedule, |condition| model.is_inside(condition)).into_iter().collect(),
        ..recorder.history(None, Some(bounds))?
    })
}

/// Refuses to begin a reduced model or a surrogate at one temperature outside the `range` (K) that its bounds are known for.
///
/// # Errors
/// The temperature lies outside; errors of `range`.
pub fn check_beginning(beginning: Beginning, range: impl FnOnce() -> Result<(f64, f64)>) -> Result<()> {
    let Beginning::Uniform(temperature) = beginning else { return Ok(()) };
    let (low, high) = range()?;
    if (low..=high).contains(&temperature) {
        return Ok(());
    }
    let range = format!("{:.1} to {:.1} degC", celsius(low), celsius(high));
    Err(Error::input("nothing in the range that this model was made for is at this temperature, so its error is not known from there")
        .at_key("--from")
        .read(format!("{:.2} degC", celsius(temperature)))
        .help(format!("begin at {range}, or simulate the machine file")))
}

/// Looks ahead over a time (s) with a constant condition, and at every passing in it.
fn look_ahead(recorder: &mut Recorder<'_>, model: &dyn Stepper, time: Range<f64>, condition: &Condition) -> Result<()> {
    let (begin, length) = (time.start, time.end - time.start);
    let passing = &recorder.seen.passing;
    if passing.is_idle() || length <= 0.0 {
        return Ok(());
    }
    let ahead = |seconds: f64| model.ahead(seconds, condition);
    let beside = |readings: &[f64]| recorder.limits.beside(readings, condition.si());
    let mut looks: Vec<(f64, Vec<f64>)> = vec![(0.0, ahead(0.0)?)];
    let mut passed = Vec::new();
    for look in 1..=LOOKS {
        let late = length * (look as f64 / LOOKS as f64).powi(2);
        let readings = ahead(late)?;
        let (early, before) = &looks[look - 1];
        let (before, behind) = (beside(before), beside(&readings));
        for watch in passing.between(&before, &behind) {
            let is_passed = |values: &[f64]| (values[watch.sensor] < watch.value) == (behind[watch.sensor] < watch.value);
            let (mut low, mut high) = (*early, late);
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(low, high);
                if is_passed(&beside(&ahead(middle)?)) { high = middle } else { low = middle }
            }
            passed.push((high, ahead(high)?));
        }
        looks.push((late, readings));
    }
    looks.extend(passed);
    // The beginning has been seen, and the end will be once the model is there.
    looks.retain(|(seconds, _)| *seconds > 0.0 && *seconds < length);
    looks.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (seconds, readings) in looks {
        recorder.look(begin + seconds, &readings, condition.si());
    }
    Ok(())
}
