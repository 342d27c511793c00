//! A schedule run through a reduced model: the same history, with a bound on every reading.

use std::ops::Range;

use super::full::own_starts;
use super::limits::{Bounds, Limits};
use super::passing::Passing;
use super::settle::Settling;
use super::stretch::corners;
use super::{History, SimulateOptions, Start, condition_at, shown, stops};
use crate::schedule::{Schedule, Segment};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_reduce::{Beginning, ReducedModel, Stretch};
use coldplate_solve::transient::Energy;

/// Runs `schedule` through a reduced model. Settling and passing are looked for at the ends of the finer network's steps and at
/// the outputs between them.
///
/// # Errors
/// The model was not made for histories; the machine file states temperatures at the start; a checkpoint is asked for; a
/// condition cannot be evaluated, or the reduced network cannot follow it.
pub fn run_reduced(model: &ReducedModel, schedule: &Schedule, options: &SimulateOptions) -> Result<History> {
    let Some(in_time) = &model.in_time else {
        return Err(Error::input("this reduced model knows steady states only").help("make it with `coldplate reduce MACHINE --histories`"));
    };
    if options.checkpoint.is_some() {
        return Err(Error::input("a reduced model is run anew sooner than a checkpoint is read")
            .at_key("--checkpoint")
            .help("leave it out"));
    }
    if !own_starts(&model.machine, &schedule.stated(0))?.is_empty() || !options.places.is_empty() {
        return Err(Error::input("parts of this machine begin at temperatures of their own, which a reduced model cannot")
            .help("simulate the machine file"));
    }
    let beginning = match options.start {
        Start::Steady => Beginning::Steady,
        Start::Uniform(temperature) => Beginning::Uniform(temperature),
        Start::Readings | Start::Parts => {
            return Err(Error::input("a schedule has no readings to begin with").at_key("--from").help("give a temperature"));
        }
    };
    let stops = stops(schedule, options.every)?;
    let mut stretches: Vec<Stretch<'_>> = Vec::new();
    let mut segments: Vec<(Segment, Range<usize>)> = Vec::new();
    for (at, stop) in stops.iter().enumerate().skip(1) {
        if segments.last().is_none_or(|(segment, _)| *segment != stop.segment) {
            let segment = stop.segment;
            segments.push((segment, at..at));
            stretches.push(Stretch {
                until: segment.until,
                condition: Box::new(move |time| schedule.condition(segment, time)),
                at_end: Some(schedule.stated(segment.row + 1)),
                outputs: Vec::new(),
            });
        }
        if let (Some(stretch), Some((_, range))) = (stretches.last_mut(), segments.last_mut()) {
            stretch.outputs.push(stop.time);
            range.end = at + 1;
        }
    }
    let course = model.course(beginning, schedule.start(), &stretches)?;
    let bounds = in_time.bounds(&course.readings, &course.coarser);
    let times: Vec<f64> = stops.iter().map(|stop| stop.time).collect();
    let steady = model.steady(&schedule.last_condition(), &[]).map(|answer| answer.finer).map_err(|e| e.what().to_string());
    let limits = Limits::new(&model.machine.limits, &model.fine.network.measurands);
    let mut settling = Settling::new(options.within, model.fine.network.sensors.len());
    let mut passing = limits.passing(&options.watched);
    let mut see = |time: f64, readings: &[f64], condition: &Condition, passing: &mut Passing| {
        settling.see(time, readings, steady.as_deref().ok());
        passing.see(time, &limits.beside(readings, condition.si()));
    };
    see(schedule.start(), &course.readings[0], &schedule.stated(0), &mut passing);
    let corners = corners(schedule, &stops);
    for ((segment, range), path) in segments.into_iter().zip(&course.path) {
        if corners.binary_search(&range.start).is_ok() {
            passing.corner();
        }
        let mut outputs = range.peekable();
        for (time, readings) in path {
            while let Some(stop) = outputs.next_if(|stop| stops[*stop].time < *time) {
                let time = stops[stop].time;
                see(time, &course.readings[stop], &schedule.condition(segment, time), &mut passing);
            }
            see(*time, readings, &schedule.condition(segment, *time), &mut passing);
        }
        // At the end of the stretch, sensors of the entering water show the condition behind a step.
        for stop in outputs {
            see(stops[stop].time, &course.readings[stop], &condition_at(schedule, &stops[stop]), &mut passing);
        }
    }
    passing.corner();
    let (passes, limits) = limits.found(&passing, Some(&Bounds { times: &times, bounds: &bounds }));
    let is_outside = |row: &crate::schedule::Row| !model.is_inside(&Condition::from_si(row.values.clone()));
    let mut notes = Vec::new();
    if schedule.rows().iter().any(is_outside) {
        notes.push("the schedule leaves the ranges that the model was made for; the bounds do not hold there".to_string());
    }
    let shows = |t: Vec<f64>| model.machine.sensors.iter().zip(t).map(|(s, t)| s.shows.settled(t)).collect();
    Ok(History {
        readings: shown(&model.machine, &times, &course.readings),
        heat_flows: vec![Vec::new(); times.len()],
        times,
        conditions: stops.iter().map(|stop| condition_at(schedule, stop)).collect(),
        settled: settling.settled(schedule.start(), steady.is_ok()),
        temperatures: course.readings,
        steady: steady.map(shows),
        within: options.within,
        passes,
        limits,
        steps: course.steps,
        rejected: 0,
        energy: Energy::default(),
        bounds: Some(bounds),
        resumed_at: None,
        notes,
    })
}
