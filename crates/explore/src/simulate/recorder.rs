//! Record of a run in the making: readings at the stops, settling, passings and limits, by whatever model they are found.

use super::limits::{Bounds, Limits};
use super::passing::Passing;
use super::settle::Settling;
use super::{History, SimulateOptions, Stop, condition_at, shown};
use crate::schedule::Schedule;
use coldplate_base::error;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_solve::transient::Energy;

/// Observations of a run so far, as a checkpoint holds them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Observations {
    /// Readings at the first stops, without the response of the sensors, K.
    pub(super) readings: Vec<Vec<f64>>,
    /// Heat flows at the first stops, W.
    pub(super) heat_flows: Vec<Vec<f64>>,
    /// Steady readings at the last condition, K, or why there are none.
    pub(super) steady: Result<Vec<f64>, String>,
    /// Time since when the readings have been near the steady ones.
    pub(super) settling: Settling,
    /// Values that have been passed.
    pub(super) passing: Passing,
}

/// Recorder of a run.
pub(super) struct Recorder<'a> {
    schedule: &'a Schedule,
    stops: &'a [Stop],
    pub(super) limits: Limits<'a>,
    pub(super) seen: Observations,
}

impl<'a> Recorder<'a> {
    /// Recorder before the first look; `steady` holds the steady readings at the last condition (K), or why there are none.
    pub(super) fn new(
        schedule: &'a Schedule,
        stops: &'a [Stop],
        limits: Limits<'a>,
        options: &SimulateOptions,
        steady: Result<Vec<f64>, String>,
    ) -> Self {
        let (settling, passing) = (Settling::new(options.within, limits.sensors()), limits.passing(&options.watched));
        let seen = Observations { readings: Vec::new(), heat_flows: Vec::new(), steady, settling, passing };
        Self { schedule, stops, limits, seen }
    }

    /// Recorder of a run that is taken up.
    pub(super) fn resumed(schedule: &'a Schedule, stops: &'a [Stop], limits: Limits<'a>, seen: Observations) -> Self {
        Self { schedule, stops, limits, seen }
    }

    /// The first stop without readings.
    pub(super) fn next_stop(&self) -> Option<&'a Stop> {
        self.stops.get(self.seen.readings.len())
    }

    /// Takes note of readings (K) at a time (s) and of values of the variables (SI).
    pub(super) fn look(&mut self, time: f64, readings: &[f64], variables: &[f64]) {
        self.settle(time, readings);
        self.pass(time, readings, variables);
    }

    /// Takes note of readings (K) for settling alone.
    pub(super) fn settle(&mut self, time: f64, readings: &[f64]) {
        self.seen.settling.see(time, readings, self.seen.steady.as_deref().ok());
    }

    /// Takes note of readings (K) and variables (SI) for passings and limits alone.
    pub(super) fn pass(&mut self, time: f64, readings: &[f64], variables: &[f64]) {
        self.seen.passing.see(time, &self.limits.beside(readings, variables));
    }

    /// Ends a stretch at a corner of the schedule.
    pub(super) fn corner(&mut self) {
        self.seen.passing.corner();
    }

    /// Records readings (K) and heat flows (W) at the next stop.
    pub(super) fn record(&mut self, readings: Vec<f64>, heat_flows: Vec<f64>) {
        self.seen.readings.push(readings);
        self.seen.heat_flows.push(heat_flows);
    }

    /// History of the whole run, without the numbers of the solver: steps, energy, and notes. Sensors of `machine` respond in
    /// their own way; `bounds` holds those of all readings at each stop (K or um).
    pub(super) fn history(mut self, machine: Option<&Machine>, bounds: Option<Vec<Vec<f64>>>) -> error::Result<History> {
        self.corner();
        let Observations { readings: temperatures, heat_flows, steady, settling, passing } = self.seen;
        let times: Vec<f64> = self.stops.iter().map(|stop| stop.time).collect();
        let (passes, limits) = self.limits.found(&passing, bounds.as_ref().map(|bounds| Bounds { times: &times, bounds }).as_ref());
        let settled = settling.settled(self.schedule.start(), steady.is_ok());
        let conditions: Vec<Condition> = self.stops.iter().map(|stop| condition_at(self.schedule, stop)).collect();
        let (readings, steady) = match machine {
            Some(machine) => {
                let around = machine.surroundings(&self.schedule.last_condition())?;
                let settled = |t: Vec<f64>| machine.sensors.iter().zip(t).map(|(sensor, t)| sensor.shows.settled(t, around)).collect();
                (shown(machine, &times, &conditions, &temperatures)?, steady.map(settled))
            }
            None => (temperatures.clone(), steady),
        };
        Ok(History {
            conditions,
            times,
            readings,
            temperatures,
            heat_flows,
            steady,
            within: settling.within,
            settled,
            passes,
            limits,
            steps: 0,
            rejected: 0,
            energy: Energy::default(),
            bounds,
            resumed_at: None,
            notes: Vec::new(),
        })
    }
}

/// Doubt about a run whose schedule states conditions outside the ranges of its model.
pub(super) fn outside(schedule: &Schedule, is_inside: impl Fn(&Condition) -> bool) -> Option<String> {
    let leaves = (0..schedule.rows().len()).any(|row| !is_inside(&schedule.stated(row)));
    leaves.then(|| "the schedule leaves the ranges that the model was made for; the bounds do not hold there".into())
}
