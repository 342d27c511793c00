//! What a machine with causes in force comes to.

use super::effects::{Hypothesis, Scales, UserKind};
use coldplate_base::error::{Error, Result};
use coldplate_evidence::identify::{self, Runs};
use coldplate_evidence::measurement::Data;
use coldplate_solve::study::{StateTables, Study};

/// Difference step, as a share of the prior's scale.
const STEP: f64 = 0.02;
/// The same in logs, whose runs are known to the error of their time steps.
const STEP_OF_LOGS: f64 = 0.1;
/// The same to both sides of where fronts run, which are known to a part of a station and of a time step only.
const STEP_OF_FRONTS: f64 = 0.25;

/// Predicts readings with hypotheses in force.
#[derive(Debug, Clone, Copy)]
pub struct Predictor<'a> {
    /// The machine as it is.
    pub study: &'a Study,
    /// The data.
    pub data: &'a Data,
    /// What the machine as it is predicts for them, K.
    pub predicted: &'a [f64],
    /// Its temperatures of all nodes at each distinct condition, K, where solves begin; none of logs.
    pub fields: &'a [Vec<f64>],
    /// How logs are run.
    pub runs: Runs,
    /// Where laws are one.
    pub scales: &'a Scales,
    /// The user's kinds.
    pub user: &'a [UserKind],
    /// Whether fronts in the water make much of what the data show: a log of a pipe.
    pub fronts: bool,
    /// Slopes about the machine as it is.
    pub slopes: KnownSlopes<'a>,
}

/// Slopes that a screen made.
#[derive(Debug, Clone, Copy)]
pub struct KnownSlopes<'a> {
    /// The causes.
    pub catalogue: &'a [Hypothesis],
    /// What each changes in every prediction, K per unit.
    pub columns: &'a [Vec<f64>],
}

impl KnownSlopes<'_> {
    /// Of a cause.
    pub fn of(&self, h: &Hypothesis) -> Option<&[f64]> {
        let place = self.catalogue.iter().position(|own| own.is_same(h))?;
        self.columns.get(place).map(Vec::as_slice)
    }
}

/// A machine with causes in force.
#[derive(Debug, Clone)]
pub struct Extended {
    /// The machine.
    pub study: Study,
    /// The lines of its file that make it so.
    pub sets: Vec<(String, String)>,
}

impl Predictor<'_> {
    /// The machine with several hypotheses in force at once; `None` where its file has no words for one.
    ///
    /// # Errors
    /// As [`Hypothesis::sets`]; the machine with these lines is not valid.
    pub fn extended(&self, members: &[(&Hypothesis, f64)]) -> Result<Option<Extended>> {
        let mut all = Vec::new();
        let mut study = self.study.clone();
        for (h, amplitude) in members {
            let Some(sets) = h.sets(&study, self.scales, self.user, *amplitude)? else { return Ok(None) };
            if !sets.is_empty() {
                // The second edits what the first one left: both may speak of the same key.
                study = study.edited(&sets)?;
            }
            all.extend(sets);
        }
        Ok(Some(Extended { study, sets: all }))
    }

    /// The lines of a machine file in which several hypotheses are in force at once, what sensors show included; `None` where it
    /// has no words for one.
    ///
    /// # Errors
    /// As [`Predictor::extended`].
    pub fn written(&self, members: &[(&Hypothesis, f64)]) -> Result<Option<Vec<(String, String)>>> {
        let mut all: Vec<(String, String)> = Vec::new();
        let mut study = self.study.clone();
        let machine = members.iter().filter(|(h, _)| !h.is_sensor()).copied();
        for (h, amplitude) in machine.chain(in_order(members)) {
            let Some(sets) = h.written(&study, self.data, self.scales, self.user, amplitude)? else { return Ok(None) };
            if !sets.is_empty() {
                study = study.edited(&sets)?;
            }
            all.retain(|(key, _)| sets.iter().all(|(other, _)| other != key) || !key.starts_with("sensor."));
            all.extend(sets);
        }
        Ok(Some(all))
    }

    /// Predictions with hypotheses in force.
    ///
    /// # Errors
    /// The machine file has no words for one of them, or the machine with them cannot be solved.
    pub fn predict(&self, members: &[(&Hypothesis, f64)]) -> Result<Vec<f64>> {
        let solved = self.solve_near(members, self.fields)?;
        Ok(self.read(members, solved.values))
    }

    /// What the machine comes to, before its sensors' own errors, with the temperatures of all nodes; from those of a machine
    /// much like it, see [`identify::steady_near`].
    pub(super) fn solve_near(&self, members: &[(&Hypothesis, f64)], near: &[Vec<f64>]) -> Result<Solved> {
        if members.iter().all(|(h, _)| h.is_sensor()) {
            return Ok(Solved { values: self.predicted.to_vec(), fields: Vec::new() });
        }
        let Some(Extended { study, .. }) = self.extended(members)? else {
            return Err(Error::input("the machine file has no words for this cause"));
        };
        if self.data.is_transient() {
            Ok(Solved { values: identify::values_within(&study, self.data, self.runs.start, self.runs.tolerance)?, fields: Vec::new() })
        } else {
            let (values, fields) = identify::steady_near(&study, self.data, near)?;
            Ok(Solved { values, fields })
        }
    }

    /// How far predictions before the sensors' own errors (K) are from those of full solves with the same hypotheses in force: the
    /// largest difference, K; without end where there is no such solve.
    pub(super) fn off_in_full(&self, members: &[(&Hypothesis, f64)], values: &[f64]) -> f64 {
        let in_full = || -> Result<Vec<f64>> {
            let acting: Vec<(&Hypothesis, f64)> = members.iter().filter(|(h, _)| !h.is_sensor()).copied().collect();
            let found = self.extended(&acting)?.ok_or_else(|| Error::input("the machine file has no words for this cause"))?;
            Ok(identify::steady_near(&found.study.with_tables(StateTables::InFull), self.data, &[])?.0)
        };
        in_full().map_or(f64::INFINITY, |full| full.iter().zip(values).fold(0.0, |m: f64, (f, v)| m.max((f - v).abs())))
    }

    /// The step that slopes are made of, as a share of the prior's scale, and whether it is taken to both sides.
    pub(super) fn steps(&self) -> (f64, bool) {
        let is_log = self.data.is_transient();
        // Fronts bend: to both sides. So do logs of lumped nodes, whose runs cost little.
        let both = self.fronts || (is_log && self.study.model.mesh.cells == 0);
        let share = match (self.fronts, is_log) {
            (true, _) => STEP_OF_FRONTS,
            (false, true) => STEP_OF_LOGS,
            (false, false) => STEP,
        };
        (share, both)
    }

    /// Whether causes are fitted from slopes that are known, without a run for each: in logs of machines of cells, where no front runs.
    pub(super) fn has_slopes_of(&self, members: &[&Hypothesis]) -> bool {
        let is_costly = self.data.is_transient() && self.study.model.mesh.cells > 0 && !self.fronts;
        is_costly && members.iter().all(|h| !h.is_fixed() && (h.is_sensor() || self.slopes.of(h).is_some()))
    }

    /// What the sensors make of it.
    pub(super) fn read(&self, members: &[(&Hypothesis, f64)], values: Vec<f64>) -> Vec<f64> {
        in_order(members).fold(values, |values, (h, amplitude)| h.read(&self.study.model.machine, self.data, &values, amplitude))
    }
}

/// What acts on readings, in order: each sensor's own error, then exchanges of sensors with their errors.
pub(super) fn in_order<'a>(members: &'a [(&'a Hypothesis, f64)]) -> impl Iterator<Item = (&'a Hypothesis, f64)> {
    let own = members.iter().filter(|(h, _)| h.is_sensor() && !h.is_fixed());
    own.chain(members.iter().filter(|(h, _)| h.is_fixed())).copied()
}

/// What a machine comes to before its sensors' own errors.
#[derive(Debug, Clone)]
pub(super) struct Solved {
    /// Predictions, K.
    pub values: Vec<f64>,
    /// Temperatures of all nodes at each distinct condition, K; none of logs.
    pub fields: Vec<Vec<f64>>,
}
