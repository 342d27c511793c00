//! A schedule run through a reduced model: the same history, with a bound on every reading.

use std::ops::Range;

use super::full::own_starts;
use super::limits::Limits;
use super::recorder::{Recorder, outside};
use super::stepped::check_beginning;
use super::stretch::corners;
use super::{History, SimulateOptions, condition_at, stops};
use crate::schedule::{Schedule, ScheduleSegment};
use coldplate_base::error::{Error, Result};
use coldplate_reduce::{ConditionStretch, ReducedModel};

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
    let beginning = options.start.of_schedule()?;
    check_beginning(beginning, || model.temperature_range())?;
    let stops = stops(schedule, options.every)?;
    let mut stretches: Vec<ConditionStretch<'_>> = Vec::new();
    let mut segments: Vec<(ScheduleSegment, Range<usize>)> = Vec::new();
    for (at, stop) in stops.iter().enumerate().skip(1) {
        if segments.last().is_none_or(|(segment, _)| *segment != stop.segment) {
            let segment = stop.segment;
            segments.push((segment, at..at));
            stretches.push(ConditionStretch {
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
    let steady = model.steady(&schedule.last_condition(), &[]).map(|answer| answer.finer).map_err(|e| e.what().to_string());
    let limits = Limits::new(&model.machine.limits, &model.fine.network.measurands);
    let mut recorder = Recorder::new(schedule, &stops, limits, options, steady);
    recorder.look(schedule.start(), &course.readings[0], schedule.stated(0).si());
    let corners = corners(schedule, &stops);
    for ((segment, range), path) in segments.into_iter().zip(&course.path) {
        if corners.binary_search(&range.start).is_ok() {
            recorder.corner();
        }
        let mut outputs = range.peekable();
        for (time, readings) in path {
            while let Some(stop) = outputs.next_if(|stop| stops[*stop].time < *time) {
                let time = stops[stop].time;
                recorder.look(time, &course.readings[stop], schedule.condition(segment, time).si());
            }
            recorder.look(*time, readings, schedule.condition(segment, *time).si());
        }
        // At the end of the stretch, sensors of the entering water show the condition behind a step.
        for stop in outputs {
            recorder.look(stops[stop].time, &course.readings[stop], condition_at(schedule, &stops[stop]).si());
        }
    }
    course.readings.into_iter().for_each(|readings| recorder.record(readings, Vec::new()));
    Ok(History {
        steps: course.steps,
        notes: outside(schedule, |condition| model.is_inside(condition)).into_iter().collect(),
        ..recorder.history(Some(&model.machine), Some(bounds))?
    })
}
