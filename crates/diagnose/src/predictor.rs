//! What a machine with causes in force comes to.

use std::borrow::Cow;

use super::amplitude::{Acting, Courses, runs};
use super::effects::{Hypothesis, Scales, UserKind};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_evidence::identify::{self, Runs};
use coldplate_evidence::measurement::Data;
use coldplate_solve::study::{StateTables, Study};

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
        Ok(self.read(members, self.without_sensors(members)?))
    }

    /// Temperatures of the places of all sensors, before the sensors' own errors, K.
    pub(super) fn without_sensors(&self, members: &[(&Hypothesis, f64)]) -> Result<Vec<f64>> {
        if members.iter().all(|(h, _)| h.is_sensor()) {
            return Ok(self.predicted.to_vec());
        }
        let (study, data) = self.acting(members)?;
        if data.is_transient() {
            identify::values_within(&study, &data, self.runs.start, self.runs.tolerance)
        } else {
            Ok(identify::steady_near(&study, &data, self.fields)?.0)
        }
    }

    /// Predictions (K) with one cause at each of several amplitudes, which are alike in all rows; `None` where it cannot be solved. One machine serves
    /// them all where a variable of a table can hold the amplitude.
    pub(super) fn at_each(&self, h: &Hypothesis, amplitudes: &[f64]) -> Vec<Option<Vec<f64>>> {
        let alike = |amplitude: &f64| [Acting { hypothesis: h, values: vec![*amplitude; self.data.rows.len()], is_held: false }];
        let may_run = !self.data.is_transient() && !h.is_sensor() && runs(self, h);
        let courses = amplitudes.first().filter(|_| may_run).and_then(|own| Courses::new(self, (self.study, self.data), &alike(own)));
        let by_course = |courses: &Courses, amplitude: &f64| {
            let data = courses.data(&self.study.model.machine.variables, self.data, &alike(amplitude));
            Some(identify::steady_near(&courses.study, &data, self.fields).ok()?.0)
        };
        let at = |amplitude: &f64| match &courses {
            Some(courses) => by_course(courses, amplitude),
            None => self.predict(&[(h, *amplitude)]).ok(),
        };
        amplitudes.iter().map(at).collect()
    }

    /// The machine with hypotheses in force, with its data. One that depends on the order of the rows gets a variable with its amplitude in every
    /// row.
    fn acting(&self, members: &[(&Hypothesis, f64)]) -> Result<(Study, Cow<'_, Data>)> {
        let unsaid = || Error::input("the machine file has no words for this cause");
        let is_in_order = |h: &Hypothesis| !h.is_sensor() && !self.scales.has_formula(h.law);
        let (in_order, by_formula): (Vec<_>, Vec<_>) = members.iter().copied().partition(|(h, _)| is_in_order(h));
        let Extended { study, .. } = self.extended(&by_formula)?.ok_or_else(unsaid)?;
        if in_order.is_empty() {
            return Ok((study, Cow::Borrowed(self.data)));
        }
        let conditions: Vec<&Condition> = self.data.rows.iter().map(|row| &row.condition).collect();
        let course = |h: &Hypothesis, amplitude: f64| self.scales.factors(h.law, &conditions).iter().map(|f| amplitude * f).collect();
        let runs = in_order.iter().filter(|(h, _)| runs(self, h));
        let acting: Vec<Acting<'_>> =
            runs.map(|(h, amplitude)| Acting { hypothesis: h, values: course(h, *amplitude), is_held: true }).collect();
        let found = if acting.len() == in_order.len() { Courses::new(self, (&study, self.data), &acting) } else { None };
        let courses = found.ok_or_else(unsaid)?;
        let data = courses.data(&study.model.machine.variables, self.data, &acting);
        Ok((courses.study, Cow::Owned(data)))
    }

    /// How far predictions before the sensors' own errors (K) are from those of full solves with the same hypotheses in force: the
    /// largest difference, K; without end where there is no such solve.
    pub(super) fn off_in_full(&self, members: &[(&Hypothesis, f64)], values: &[f64]) -> f64 {
        let in_full = || -> Result<Vec<f64>> {
            let acting: Vec<(&Hypothesis, f64)> = members.iter().filter(|(h, _)| !h.is_sensor()).copied().collect();
            let (study, data) = self.acting(&acting)?;
            Ok(identify::steady_near(&study.with_tables(StateTables::InFull), &data, &[])?.0)
        };
        in_full().map_or(f64::INFINITY, |full| full.iter().zip(values).fold(0.0, |m: f64, (f, v)| m.max((f - v).abs())))
    }

    /// What the sensors make of it.
    pub(super) fn read(&self, members: &[(&Hypothesis, f64)], values: Vec<f64>) -> Vec<f64> {
        in_order(members)
            .fold(values, |values, (h, amplitude)| h.read((self.scales, &self.study.model.machine), self.data, &values, amplitude))
    }
}

/// What acts on readings, in order: each sensor's own error, then exchanges of sensors with their errors.
pub(super) fn in_order<'a>(members: &'a [(&'a Hypothesis, f64)]) -> impl Iterator<Item = (&'a Hypothesis, f64)> {
    let own = members.iter().filter(|(h, _)| h.is_sensor() && !h.is_fixed());
    own.chain(members.iter().filter(|(h, _)| h.is_fixed())).copied()
}
