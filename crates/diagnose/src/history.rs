//! What each hypothesis would do to logs, to first order.
//!
//! They are followed along the machine's own history, linearised in few unknowns ([`super::follow`]). Where the water stores much of the heat, fronts run through it that no few unknowns follow: there,
//! and for what acts on no node, a signature is the difference of two runs.

use std::sync::Arc;

use rayon::prelude::*;

use super::effects::{Hypothesis, Scales, UserKind};
use super::follow::{Followed, Follower, Linear};
use super::signature::{Signatures, difference};
use coldplate_base::error::Result;
use coldplate_evidence::identify::{self, Prediction, Runs};
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_explore::simulate::Start;
use coldplate_network::Load;
use coldplate_solve::study::{MachineParameter, Study};

/// Amplitudes of differences of runs, as a share of the prior's scale: what acts one way only, or moves a front, is followed
/// along a secant about as long as it is likely to be; the rest along a slope.
const SECANT: f64 = 0.5;
const STEP: f64 = 0.1;
/// What changes no reading by more than this many errors of a time step, for an amplitude of the prior's scale, is the solver's own error.
const VISIBLE: f64 = 3.0;
/// Water that stores more than this share of all heat makes fronts that count.
const FRONTS: f64 = 0.25;

/// Whether these are logs in which fronts count: the water of the circuits stores much of all the heat.
///
/// # Errors
/// A condition cannot be evaluated.
pub(crate) fn has_fronts(study: &Study, data: &Data) -> Result<bool> {
    let network = &study.model.network;
    let Some(row) = data.rows.first().filter(|_| data.is_transient()) else { return Ok(false) };
    let load = Load::at(&study.model.machine, &row.condition)?;
    let mut water = 0.0;
    for stream in &network.streams {
        let liquid = network.circuits[stream.circuit].circuit.liquid.at(load.inlets[stream.circuit])?;
        water += 0.25 * std::f64::consts::PI * stream.diameter.powi(2) * stream.length * liquid.density * liquid.specific_heat;
    }
    Ok(water > FRONTS * (water + network.capacity.iter().sum::<f64>()))
}

/// A machine and its logs.
pub(crate) struct Logs<'a> {
    /// The machine.
    pub study: &'a Study,
    /// The logs.
    pub data: &'a Data,
    /// How they are run.
    pub runs: Runs,
    /// Where laws are one.
    pub scales: &'a Scales,
    /// The user's kinds.
    pub user: &'a [UserKind],
}

impl Logs<'_> {
    /// Signatures; `known` is the machine linearised along the logs, where it was before.
    ///
    /// # Errors
    /// The machine as it is cannot be run through the data's conditions.
    pub fn signatures(&self, uncertain: &[MachineParameter], hypotheses: &[Hypothesis], known: Option<&Arc<Linear>>) -> Result<Signatures> {
        let Self { study, data, runs, .. } = *self;
        let Runs { start, tolerance } = runs;
        // A state that is steady but for some parts is no state of rest to linearise about.
        let is_rest = start != Start::Steady || !study.model.machine.has_starts();
        // A sensor that takes on part of its surroundings changes with these at once, which no node does.
        let is_by_places = study.model.machine.sensors.iter().all(|sensor| sensor.shows.surroundings == 0.0);
        if is_rest && is_by_places && !has_fronts(study, data)? {
            // A machine without a path to any given temperature, or readings of inlets alone, have no such unknowns.
            let linear = known.map_or_else(|| Linear::new(study, data, runs).map(Arc::new).ok(), |linear| Some(linear.clone()));
            let followed = linear.and_then(|linear| Some((self.followed(&linear, uncertain, hypotheses).ok()?, linear)));
            if let Some((followed, linear)) = followed {
                let values = linear.values.clone();
                let residual = difference(&whiten::readings(data), &values);
                let finish = |(h, column): (&Hypothesis, Option<Vec<f64>>)| column.unwrap_or_else(|| self.run(h, &values, &residual));
                let columns = hypotheses.par_iter().zip(followed.columns).map(finish).collect();
                let prediction = Prediction { values, slopes: followed.slopes, conditions: followed.conditions };
                return Ok(Signatures { residual, prediction, fields: Vec::new(), columns, linear: Some(linear) });
            }
        }
        let prediction = identify::predict_within(study, data, uncertain, start, tolerance)?;
        let residual = difference(&whiten::readings(data), &prediction.values);
        let columns = hypotheses.par_iter().map(|h| self.run(h, &prediction.values, &residual)).collect();
        Ok(Signatures { residual, prediction, fields: Vec::new(), columns, linear: None })
    }

    fn followed(&self, linear: &Arc<Linear>, uncertain: &[MachineParameter], hypotheses: &[Hypothesis]) -> Result<Followed> {
        let Self { study, data, runs, scales, user } = *self;
        Follower { study, data, runs, scales, user, linear }.follow(uncertain, hypotheses)
    }

    /// What a hypothesis does per unit of its amplitude: the difference of a run with it and one of the machine as it is.
    fn run(&self, h: &Hypothesis, values: &[f64], residual: &[f64]) -> Vec<f64> {
        if !h.is_bent() {
            return self.along(h, h.scale * if h.is_signed { STEP } else { SECANT }, values);
        }
        // More and less bend differently: the secant of the sign that the readings ask for.
        let explains = |column: &Vec<f64>, sign: f64| -> f64 {
            let (dot, square) = column.iter().zip(residual).fold((0.0, 0.0), |(d, s), (c, r)| (d + c * r, s + c * c));
            if square > 0.0 { (sign * dot).max(0.0).powi(2) / square } else { 0.0 }
        };
        let (more, less) = (self.along(h, SECANT * h.scale, values), self.along(h, -SECANT * h.scale, values));
        if explains(&less, -1.0) > explains(&more, 1.0) { less } else { more }
    }

    fn along(&self, h: &Hypothesis, step: f64, values: &[f64]) -> Vec<f64> {
        let none = || vec![0.0; values.len()];
        let moved = match h.sets(self.study, self.scales, self.user, step) {
            Ok(Some(sets)) if sets.is_empty() => Ok(values.to_vec()),
            Ok(Some(sets)) => {
                self.study.edited(&sets).and_then(|study| identify::values_within(&study, self.data, self.runs.start, self.runs.tolerance))
            }
            _ => return none(),
        };
        let Ok(moved) = moved else { return none() };
        let column: Vec<f64> = h
            .read((self.scales, &self.study.model.machine), self.data, &moved, step)
            .iter()
            .zip(values)
            .map(|(a, b)| (a - b) / step)
            .collect();
        let shows = h.is_sensor() || column.iter().any(|c| (c * h.scale).abs() > VISIBLE * self.runs.tolerance);
        if shows { column } else { none() }
    }
}
