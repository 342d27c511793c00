//! A schedule run through anything that moves step by step, such as a surrogate that knows the machine over time.

use super::{History, SimulateOptions, Start, Stop, condition_at, settled_and_passed, stops};
use crate::describe::machine::Condition;
use crate::error::{Error, Result};
use crate::explore::schedule::Schedule;
use crate::solve::transient::Energy;

/// Steps from output to output while a condition moves; each holds the condition of its middle.
const PIECES: usize = 16;

/// A model that moves by steps of one condition each. Temperatures are in K.
pub trait Follower {
    /// Begins at a condition.
    ///
    /// # Errors
    /// A start that the model does not know, or a condition that it cannot evaluate.
    fn begin(&mut self, start: Start, condition: &Condition) -> Result<()>;

    /// Moves by so many seconds at a condition that holds.
    ///
    /// # Errors
    /// A condition that it cannot evaluate.
    fn advance(&mut self, seconds: f64, condition: &Condition) -> Result<()>;

    /// What all sensors read now, at a condition.
    ///
    /// # Errors
    /// As [`Follower::advance`].
    fn read(&self, condition: &Condition) -> Result<Vec<f64>>;

    /// What they read in the steady state of a condition.
    ///
    /// # Errors
    /// As [`Follower::advance`].
    fn steady(&self, condition: &Condition) -> Result<Vec<f64>>;

    /// How far each reading may be off.
    fn bounds(&self) -> Vec<f64>;

    /// Whether the model was made for a condition.
    fn is_inside(&self, condition: &Condition) -> bool;
}

/// Runs `schedule` through a model. When something settles or passes is known from the outputs alone.
///
/// # Errors
/// A checkpoint is asked for; parts begin at temperatures of their own; as the model's own.
pub fn run_stepped(model: &mut dyn Follower, schedule: &Schedule, options: &SimulateOptions) -> Result<History> {
    if options.checkpoint.is_some() {
        return Err(Error::input("this model is run anew sooner than a checkpoint is read").at_key("--checkpoint").help("leave it out"));
    }
    if !options.places.is_empty() {
        return Err(Error::input("parts cannot begin at temperatures of their own here").help("simulate the machine file"));
    }
    let stops: Vec<Stop> = stops(schedule, options.every)?;
    let first = schedule.stated(0);
    model.begin(options.start, &first)?;
    let mut readings = vec![model.read(&first)?];
    let (mut now, mut steps) = (schedule.start(), 0);
    for stop in &stops[1..] {
        let (begin, end) = (schedule.condition(stop.segment, now), schedule.condition(stop.segment, stop.time));
        let pieces = if begin == end { 1 } else { PIECES };
        let length = (stop.time - now) / pieces as f64;
        for piece in 0..pieces {
            let middle = schedule.condition(stop.segment, now + (piece as f64 + 0.5) * length);
            model.advance(length, &middle)?;
        }
        steps += pieces;
        now = stop.time;
        readings.push(model.read(&condition_at(schedule, stop))?);
    }
    let times: Vec<f64> = stops.iter().map(|stop| stop.time).collect();
    let conditions: Vec<Condition> = stops.iter().map(|stop| condition_at(schedule, stop)).collect();
    let steady = model.steady(&schedule.last_condition()).map_err(|e| e.what().to_string());
    let (settled, passes) = settled_and_passed(schedule, &stops, &readings, steady.as_deref().ok(), options);
    let mut notes = Vec::new();
    if conditions.iter().any(|condition| !model.is_inside(condition)) {
        notes.push("the schedule leaves the ranges that the model was made for; the bounds do not hold there".to_string());
    }
    Ok(History {
        heat_flows: vec![Vec::new(); times.len()],
        bounds: Some(vec![model.bounds(); times.len()]),
        times,
        conditions,
        settled,
        temperatures: readings.clone(),
        readings,
        steady,
        within: options.within,
        passes,
        steps,
        rejected: 0,
        energy: Energy::default(),
        resumed_at: None,
        notes,
    })
}
