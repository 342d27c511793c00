//! Gross errors: with a small probability a reading, a whole row or a whole sensor is wrong altogether, and then says nothing.
//!
//! Each reading y is that of the model with a probability 1 - ρ, else anywhere in a range R: p(y) = (1 - ρ) N(y) + ρ / R, and so are a row and
//! a sensor as a whole. Of the mixture's terms the largest one counts, found within every hypothesis: the part whose density given all other
//! readings is lowest is set aside, the set is fitted anew, and so on while its posterior grows. What is set aside pays ln ρ and the density
//! 1 / R of each reading, so that a part is dropped only where no cause explains it better at its own price. A part that a later set explains
//! is taken back by the same rule. A sensor that is stuck has one value anywhere in the range, and its noise about that. A row that states a
//! wrong value of one condition keeps its readings: they say together by how much, as far as the values of the table go. In logs single
//! readings may be wrong.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::others::{Others, Predicted};
use super::rows::Errors;
use super::search::{FITTED, Fit, Search, sorted};
use super::settings::AmplitudeSettings;
use super::wrong::{Part, Wrong, log_odds};
use crate::Problem;
use coldplate_describe::machine::DescribedVariable;
use coldplate_evidence::measurement::whiten;

/// Gross errors that one disturbance may hide together: none of them alone makes it smaller. Chosen: one table seldom has more.
const HIDDEN_TOGETHER: usize = 4;

/// Part of the data that one set of causes calls wrong: one reading, or all of a row, or all of a sensor, or what a row states of a condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aside {
    /// Row of the problem's data; none for a whole sensor.
    pub row: Option<usize>,
    /// Column of the problem's data; none for a whole row or a condition.
    pub sensor: Option<usize>,
    /// Variable of the machine, of a condition.
    pub variable: Option<usize>,
    /// Reading less what all that is not set aside says of it, K (or um); of a whole row or sensor the root mean square; of a condition what is
    /// stated less what the readings ask for, in the variable's SI unit.
    pub off: f64,
    /// Value of a sensor that shows one throughout, K (or um).
    pub stuck_at: Option<f64>,
}

/// A table in which parts may be wrong, or a log in which readings may be.
pub struct Gross<'a> {
    search: &'a Search<'a>,
    /// Row and column of each reading in the data.
    places: Vec<(usize, usize)>,
    /// Every reading, K.
    values: Vec<f64>,
    /// Change of every reading with each variable that conditions of the table differ in, K, by as much as a value that may be anywhere among
    /// them is off; and so much, in the variable's SI unit.
    conditions: BTreeMap<usize, (Vec<f64>, f64)>,
}

impl<'a> Gross<'a> {
    /// Data beside their search; `slopes` are those of every reading along the conditions, K per SI unit. A log states one condition in many
    /// rows, and what is wrong with it is no single row's.
    pub fn new(search: &'a Search<'a>, problem: &Problem, slopes: &[Vec<f64>]) -> Self {
        let data = &problem.data;
        let condition = |(v, variable): (usize, &DescribedVariable)| {
            let values = || data.rows.iter().map(|row| row.condition.si()[v]);
            let wide = (values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)) / TAU.sqrt();
            let is_stated = problem.states(&variable.name) && wide > 0.0 && !search.is_log();
            is_stated.then(|| (v, (slopes.iter().map(|own| wide * own[v]).collect(), wide)))
        };
        let conditions = problem.study.model.machine.variables.iter().enumerate().filter_map(condition).collect();
        Self { search, places: whiten::places(data), values: whiten::readings(data), conditions }
    }

    fn settings(&self) -> &AmplitudeSettings {
        self.search.settings
    }

    /// Readings of a part, rising.
    fn readings(&self, part: Part) -> Vec<usize> {
        let all = 0..self.places.len();
        match part {
            Part::Reading(own) => vec![own],
            Part::Row(row) | Part::Condition { row, .. } => all.filter(|i| self.search.errors.row_of[*i] == row).collect(),
            Part::Sensor(sensor) => all.filter(|i| self.places[*i].1 == sensor).collect(),
        }
    }

    /// Change of every reading with what a row states of a condition that is wrong, K.
    fn column(&self, part: Part) -> Option<Vec<f64>> {
        let Part::Condition { row, variable } = part else { return None };
        let (column, _) = self.conditions.get(&variable)?;
        Some(column.iter().zip(&self.search.errors.row_of).map(|(c, own)| if *own == row { *c } else { 0.0 }).collect())
    }

    /// Readings that some parts leave nothing of, rising.
    fn of_all(&self, wrong: &[Wrong]) -> Vec<usize> {
        let mut all: Vec<usize> = wrong.iter().filter(|wrong| !wrong.is_condition()).flat_map(|wrong| self.readings(wrong.part)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// All parts of a table that can be wrong; rows and sensors where these have several readings.
    fn parts(&self) -> Vec<Wrong> {
        let s = self.settings();
        let mut all: Vec<Wrong> = (0..self.places.len()).map(|i| self.reading(i)).collect();
        let rows = self.search.errors.row_of.last().map_or(0, |last| last + 1);
        let sensors = self.places.iter().map(|(_, k)| k + 1).max().unwrap_or(0);
        let whole = (0..rows).map(|r| Wrong::with_rate(Part::Row(r), s.wrong_row));
        let whole = whole.chain((0..sensors).map(|k| self.or_stuck(Wrong::with_rate(Part::Sensor(k), s.wrong_sensor))));
        // A row with no more readings than conditions does not tell which of these is wrong.
        let tells = |row: &usize| self.readings(Part::Row(*row)).len() > self.conditions.len();
        let of_row = |row: usize| self.conditions.keys().map(move |variable| Part::Condition { row, variable: *variable });
        let conditions = (0..rows).filter(tells).flat_map(of_row).map(|part| Wrong::with_rate(part, s.wrong_reading));
        all.extend(whole.chain(conditions).filter(|wrong| self.readings(wrong.part).len() > 1));
        all
    }

    fn reading(&self, i: usize) -> Wrong {
        Wrong::with_rate(Part::Reading(i), self.settings().wrong_reading)
    }

    /// A wrong sensor as a stuck one where its readings are more probable so. With their noise σ about one value in the range R, of which
    /// they leave open τ² = 1 / Σ σ⁻², their density is that of the noise about their mean times τ √2π / R.
    fn or_stuck(&self, wrong: Wrong) -> Wrong {
        let readings = self.readings(wrong.part);
        let noise = |i: &usize| self.search.errors.noise[*i];
        let weight: f64 = readings.iter().map(|i| noise(i).powi(-2)).sum();
        let mean = readings.iter().map(|i| self.values[*i] * noise(i).powi(-2)).sum::<f64>() / weight;
        let of = |i: &usize| -0.5 * ((self.values[*i] - mean) / noise(i)).powi(2) - noise(i).ln();
        let stuck = readings.iter().map(of).sum::<f64>() - 0.5 * weight.ln() - self.wide().ln();
        let more = stuck + readings.len() as f64 * self.wide().ln();
        if more > 0.0 { Wrong { log_odds: wrong.log_odds + more, stuck_at: Some(mean), ..wrong } } else { wrong }
    }

    /// Readings that may be set aside where the largest part among them has so many: of a few sensors one may be dead.
    fn most(&self, largest: usize) -> usize {
        let all = self.places.len();
        if 2 * largest > all || self.settings().most_wrong == 0.0 {
            0
        } else {
            largest + (self.settings().most_wrong * (all - largest) as f64) as usize
        }
    }

    /// Standard deviation of the noise that stands for a reading anywhere in its range, K: with no residual it has the density of that.
    fn wide(&self) -> f64 {
        self.settings().wrong_range / TAU.sqrt()
    }

    /// A fit without what it calls wrong, as far as its posterior grows by that.
    pub fn cleared(&self, fit: Fit) -> Fit {
        let mut best = fit;
        while let Some(aside) = self.next(&best) {
            let found = self.with_aside(&best, aside);
            if found.log_posterior() <= best.log_posterior() {
                break;
            }
            best = found;
        }
        best
    }

    /// The machine as it is without what it calls wrong. A disturbance that took the place of gross errors goes only as they are set aside, so
    /// that these are sought without it too.
    pub fn nothing(&self, whole: &Fit) -> Fit {
        let mut best = self.cleared(whole.clone());
        let (mut own, mut without_gain) = (best.clone(), 0);
        while without_gain < HIDDEN_TOGETHER {
            let still = Fit { looseness: self.search.still(own.looseness), ..own.clone() };
            let Some(aside) = self.next(&still) else { break };
            own = self.with_aside(&own, aside);
            without_gain += 1;
            if own.log_posterior() > best.log_posterior() {
                (best, without_gain) = (own.clone(), 0);
            }
        }
        best
    }

    /// The machine as it is with what it calls wrong, and without each row and sensor among that: a cause may be what makes that look wrong.
    pub fn beginnings(&self, nothing: &Fit) -> Vec<Fit> {
        let without = |at: usize| nothing.aside.iter().enumerate().filter(|(other, _)| *other != at).map(|(_, wrong)| *wrong).collect();
        let is_large = |at: &usize| !matches!(nothing.aside[*at].part, Part::Reading(_));
        let less = (0..nothing.aside.len()).filter(is_large).map(without).filter(|aside: &Vec<Wrong>| !aside.is_empty());
        let whole = (!nothing.aside.is_empty()).then(|| nothing.clone());
        whole.into_iter().chain(less.map(|aside| self.with_aside(nothing, aside))).collect()
    }

    /// A fit with one cause more that acts on some sensors alone, with all parts taken back that it acts on: an exchange of sensors from a row on.
    /// Beside any of these parts it explains nothing, and with one of them taken back little.
    pub fn instead(&self, fit: &Fit) -> Vec<Fit> {
        let of = |further: usize| {
            let acting = self.search.acting(further);
            let acts_on = |wrong: &Wrong| self.readings(wrong.part).iter().any(|i| acting.binary_search(i).is_ok());
            let (own, others): (Vec<Wrong>, Vec<Wrong>) =
                fit.aside.iter().copied().partition(|wrong| !wrong.is_condition() && acts_on(wrong));
            if own.len() < 2 || fit.members.contains(&further) || acting.len() == self.places.len() {
                return None;
            }
            let begun = self.begun(fit, others);
            self.search.with_errors_of(&begun).begun(&begun, further)
        };
        if fit.aside.len() < 2 {
            return Vec::new();
        }
        let mut begun = sorted((0..self.search.candidates.len()).filter_map(of).collect());
        begun.truncate(FITTED);
        sorted(begun.into_iter().map(|own| self.search.with_errors_of(&own).fit(own.clone())).collect())
    }

    /// A fit with other parts set aside, fitted anew.
    fn with_aside(&self, fit: &Fit, aside: Vec<Wrong>) -> Fit {
        let begun = self.begun(fit, aside);
        self.search.with_errors_of(&begun).fit(begun.clone())
    }

    /// A fit with other parts set aside, not fitted yet.
    fn begun(&self, fit: &Fit, aside: Vec<Wrong>) -> Fit {
        let own = fit.errors.as_deref().unwrap_or(self.search.errors).clone();
        let wrong_conditions = aside.iter().filter_map(|wrong| self.column(wrong.part)).collect();
        let errors = Errors { aside: self.of_all(&aside), wide: self.wide(), wrong_conditions, ..own };
        Fit { errors: Some(Arc::new(errors)), aside, ..fit.clone() }
    }

    /// Parts that are better set aside, by the one that promises most: one more or one less than now; `None` where each promises less.
    fn next(&self, fit: &Fit) -> Option<Vec<Wrong>> {
        let others = self.others(fit)?;
        let residual = self.search.linear_about(fit).residual;
        let now = self.of_all(&fit.aside);
        let wide = self.wide();
        let mut best: (f64, Option<Vec<Wrong>>) = (0.0, None);
        let mut offer = |gain: f64, aside: Vec<Wrong>| {
            if gain > best.0 {
                best = (gain, Some(aside));
            }
        };
        // A row that states a wrong condition counts as one that is wrong.
        let doubtful: usize = fit.aside.iter().filter(|other| other.is_condition()).map(|other| self.readings(other.part).len()).sum();
        if self.search.is_log() {
            let (gain, further) = self.further_of_log(&others, &now);
            offer(gain, [&fit.aside[..], &further].concat());
        }
        let parts = if self.search.is_log() { Vec::new() } else { self.parts() };
        for wrong in parts {
            let all = self.readings(wrong.part);
            let own: Vec<usize> = all.iter().filter(|i| now.binary_search(i).is_err()).copied().collect();
            let largest = fit.aside.iter().map(|other| self.readings(other.part).len()).fold(all.len(), usize::max);
            if own.is_empty() || now.len() + doubtful + own.len() > self.most(largest) {
                continue;
            }
            let Some(predicted) = others.predict(&own) else { continue };
            if let Some(column) = self.column(wrong.part) {
                if fit.aside.iter().all(|other| other.part != wrong.part)
                    && let Some(density) = with_column(&predicted, &own, &column, 1.0)
                {
                    offer(density - predicted.log_density + wrong.log_odds, fit.aside.iter().copied().chain([wrong]).collect());
                }
                continue;
            }
            let density = -(own.len() as f64) * wide.ln();
            // A row takes the place of its own readings.
            let is_within = |other: &Wrong| self.readings(other.part).iter().all(|i| all.binary_search(i).is_ok());
            let (within, mut aside): (Vec<Wrong>, Vec<Wrong>) = fit.aside.iter().copied().partition(is_within);
            aside.push(wrong);
            offer(density - predicted.log_density + wrong.log_odds - log_odds(&within), aside);
        }
        let as_they_are = |readings: &[usize]| {
            let predicted = others.predict(readings)?;
            Some((self.as_they_are(&predicted, readings, &residual, fit.looseness.noise)?, predicted.log_density))
        };
        for (at, wrong) in fit.aside.iter().enumerate() {
            let mut aside = fit.aside.clone();
            aside.remove(at);
            if let Some(column) = self.column(wrong.part) {
                let own: Vec<usize> = self.readings(wrong.part).into_iter().filter(|i| now.binary_search(i).is_err()).collect();
                if let Some(predicted) = others.predict(&own)
                    && let Some(density) = with_column(&predicted, &own, &column, -1.0)
                {
                    offer(density - predicted.log_density - wrong.log_odds, aside);
                }
                continue;
            }
            let still = self.of_all(&aside);
            let own: Vec<usize> = self.readings(wrong.part).into_iter().filter(|i| still.binary_search(i).is_err()).collect();
            if let Some((right, wide)) = as_they_are(&own) {
                offer(right - wide - wrong.log_odds, aside.clone());
            }
            // Few readings of a row or a sensor may be wrong, and the others right.
            let alone = |i: &usize| self.reading(*i);
            let is_wrong = |i: &usize| as_they_are(&[*i]).is_none_or(|(right, _)| right < alone(i).log_odds - wide.ln());
            let (bad, good): (Vec<usize>, Vec<usize>) = own.iter().copied().partition(is_wrong);
            if own.len() > 1
                && !bad.is_empty()
                && let Some((right, wide)) = as_they_are(&good)
            {
                let bad: Vec<Wrong> = bad.iter().map(alone).collect();
                offer(right - wide - wrong.log_odds + log_odds(&bad), [aside, bad].concat());
            }
        }
        best.1
    }

    /// Readings of a log that are better set aside, and how much they promise: the one that promises most of each sensor in each stretch, for those
    /// beside it are predicted by it.
    fn further_of_log(&self, others: &Others, now: &[usize]) -> (f64, Vec<Wrong>) {
        let wide = self.wide();
        let mut best: BTreeMap<(usize, usize), (f64, Wrong)> = BTreeMap::new();
        for i in (0..self.places.len()).filter(|i| now.binary_search(i).is_err()) {
            let (wrong, Some(predicted)) = (self.reading(i), others.predict(&[i])) else { continue };
            let gain = wrong.log_odds - wide.ln() - predicted.log_density;
            let own = best.entry((self.search.errors.row_of[i], self.places[i].1)).or_insert((0.0, wrong));
            if gain > own.0 {
                *own = (gain, wrong);
            }
        }
        let mut found: Vec<(f64, Wrong)> = best.into_values().filter(|(gain, _)| *gain > 0.0).collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(self.most(1).saturating_sub(now.len()));
        (found.iter().map(|(gain, _)| gain).sum(), found.into_iter().map(|(_, wrong)| wrong).collect())
    }

    /// Logarithm of the density of readings that are set aside, given all others, were they right, with so many times their stated noise.
    fn as_they_are(&self, predicted: &Predicted, readings: &[usize], residual: &[f64], times: f64) -> Option<f64> {
        let (wide, noise) = (self.wide(), &self.search.errors.noise);
        let residual = DVector::from_iterator(readings.len(), readings.iter().map(|i| residual[*i]));
        let more = DVector::from_iterator(readings.len(), readings.iter().map(|i| (times * noise[*i]).powi(2) - wide * wide));
        predicted.log_density_with(&residual, DMatrix::from_diagonal(&more))
    }

    /// What the readings say of each other under a fit.
    fn others(&self, fit: &Fit) -> Option<Others> {
        let search = self.search.with_errors_of(fit);
        let explained = search.explained(&search.linear_about(fit), fit.looseness, &search.followed(&fit.freedoms))?;
        Some(explained.posterior(&fit.freedoms, fit.looseness)?.others())
    }

    /// What a fit sets aside, by its place in the data and how far it is off.
    pub fn aside(&self, fit: &Fit) -> Vec<Aside> {
        if fit.aside.is_empty() {
            return Vec::new();
        }
        let Some(others) = self.others(fit) else { return Vec::new() };
        let residual = self.search.linear_about(fit).residual;
        let of = |wrong: &Wrong| {
            let readings = self.readings(wrong.part);
            let errors = others.predict(&readings).map_or(Vec::new(), |own| own.error.as_slice().to_vec());
            let off: Vec<f64> = readings.iter().zip(errors).map(|(i, error)| error + residual[*i]).collect();
            let size = (off.iter().map(|v| v * v).sum::<f64>() / off.len().max(1) as f64).sqrt();
            let (row, sensor) = self.places[readings[0]];
            let part = Aside { row: None, sensor: None, variable: None, off: size, stuck_at: wrong.stuck_at };
            match wrong.part {
                Part::Reading(_) => Aside { row: Some(row), sensor: Some(sensor), off: off.first().copied().unwrap_or(0.0), ..part },
                Part::Row(_) => Aside { row: Some(row), ..part },
                Part::Sensor(_) => Aside { sensor: Some(sensor), ..part },
                Part::Condition { variable, .. } => {
                    let column = self.column(wrong.part).unwrap_or_default();
                    let own = DVector::from_iterator(readings.len(), readings.iter().map(|i| column[*i]));
                    let asked = others.predict(&readings).map_or(0.0, |predicted| predicted.coefficient(&own));
                    Aside { row: Some(row), variable: Some(variable), off: -asked * self.conditions[&variable].1, ..part }
                }
            }
        };
        fit.aside.iter().map(of).collect()
    }
}

/// Logarithm of the density of some readings given all others, where their covariance has a column (K) of all readings so many times more.
fn with_column(predicted: &Predicted, readings: &[usize], column: &[f64], times: f64) -> Option<f64> {
    let own = DVector::from_iterator(readings.len(), readings.iter().map(|i| column[*i]));
    predicted.log_density_with(&DVector::zeros(own.len()), times * &own * own.transpose())
}
