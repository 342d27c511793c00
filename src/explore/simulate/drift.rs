//! How far displacements drift over a schedule: the figures by which tests of machine tools tell their thermal behaviour.

use serde::Serialize;

use super::{History, Subject};
use crate::units::Measurand;

/// The first stretch that tests of spindles and axes report on its own, s.
const FIRST: f64 = 3600.0;
/// Share of the whole way that may be left when a drift counts as done.
const LEFT: f64 = 0.1;

/// The drift of one displacement; ranges are largest minus smallest.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct Drift {
    /// The sensor.
    pub sensor: String,
    /// Range over the whole schedule, um.
    pub range_um: f64,
    /// Range in the first hour, um.
    pub first_hour_um: f64,
    /// From the beginning to the end, um.
    pub end_um: f64,
    /// From the beginning to the steady state of the last condition, um, where there is one.
    pub steady_um: Option<f64>,
    /// After what time it stays within a tenth of that way of the steady state, s; nothing where it does not.
    pub settled_s: Option<f64>,
}

impl History {
    /// The drift of every displacement of `model`.
    pub fn drifts(&self, model: &Subject<'_>) -> Vec<Drift> {
        let displacements = model.measurands.iter().zip(model.sensors).enumerate().filter(|(_, (own, _))| **own == Measurand::Displacement);
        displacements.filter_map(|(s, (_, name))| self.drift(s, name)).collect()
    }

    fn drift(&self, s: usize, name: &str) -> Option<Drift> {
        let (start, begun) = (*self.times.first()?, self.readings.first()?[s]);
        let range = |until: f64| {
            let own = self.times.iter().zip(&self.readings).filter(|(t, _)| **t <= until).map(|(_, r)| r[s]);
            let (low, high) = own.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| (low.min(u), high.max(u)));
            high - low
        };
        let steady = self.steady.as_ref().ok().map(|steady| steady[s]);
        Some(Drift {
            sensor: name.to_string(),
            range_um: range(f64::INFINITY),
            first_hour_um: range(start + FIRST),
            end_um: self.readings.last()?[s] - begun,
            steady_um: steady.map(|steady| steady - begun),
            settled_s: steady.and_then(|steady| self.near_from(s, steady, LEFT * (steady - begun).abs())).map(|at| at - start),
        })
    }

    /// The time from which on a reading stays near its steady value, s, straight between the outputs.
    fn near_from(&self, s: usize, steady: f64, near: f64) -> Option<f64> {
        let far = |i: usize| (self.readings[i][s] - steady).abs();
        let last_far = (0..self.times.len()).rev().find(|i| far(*i) > near);
        let Some(last) = last_far else { return self.times.first().copied() };
        let next = last + 1;
        let end = self.times.get(next)?;
        let share = (far(last) - near) / (far(last) - far(next));
        Some(self.times[last] + share.clamp(0.0, 1.0) * (end - self.times[last]))
    }
}
