//! Finalists, fitted through the full solver.

use nalgebra::{DMatrix, DVector};

use super::catalogue::{Hypothesis, Scales, UserKind};
use super::signature::TIME_TOLERANCE;
use crate::error::{Error, Result};
use crate::identify;
use crate::measure::{Data, Whitener};
use crate::sensitivity::Study;
use crate::simulate::Start;

const MOST_STEPS: usize = 4;
const MOST_STEPS_OF_LOGS: usize = 5;
/// Difference step, as a share of the prior's scale.
const STEP: f64 = 0.02;
/// The same in logs, where a front in the water is known to a part of a station and of a time step only.
const STEP_OF_LOGS: f64 = 0.25;

/// What is needed to predict with a hypothesis in force.
#[derive(Debug, Clone, Copy)]
pub struct Bench<'a> {
    /// The machine as it is.
    pub study: &'a Study,
    /// The data.
    pub data: &'a Data,
    /// State logs begin with.
    pub start: Start,
    /// Where laws are one.
    pub scales: &'a Scales,
    /// The user's kinds.
    pub user: &'a [UserKind],
    /// Predictions of the data with the machine as it is, K, where they are known: sensors' own errors need no more.
    pub base: Option<&'a [f64]>,
}

impl Bench<'_> {
    /// Lines of the machine file for several hypotheses at once; `None` where it has no words for one.
    ///
    /// # Errors
    /// As [`Hypothesis::sets`].
    pub fn sets(&self, members: &[(&Hypothesis, f64)]) -> Result<Option<Vec<(String, String)>>> {
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
        Ok(Some(all))
    }

    /// Predictions with hypotheses in force.
    ///
    /// # Errors
    /// The machine file has no words for one of them, or the machine with them cannot be solved.
    pub fn predict(&self, members: &[(&Hypothesis, f64)]) -> Result<Vec<f64>> {
        self.predicted(self.data, members, self.base)
    }

    /// The same of other data.
    ///
    /// # Errors
    /// As [`Bench::predict`].
    pub fn predict_for(&self, data: &Data, members: &[(&Hypothesis, f64)]) -> Result<Vec<f64>> {
        self.predicted(data, members, None)
    }

    fn predicted(&self, data: &Data, members: &[(&Hypothesis, f64)], base: Option<&[f64]>) -> Result<Vec<f64>> {
        let Some(sets) = self.sets(members)? else {
            return Err(Error::input("the machine file has no words for this cause"));
        };
        let mut values = match base {
            Some(base) if sets.is_empty() => base.to_vec(),
            None if sets.is_empty() => identify::values_within(self.study, data, self.start, TIME_TOLERANCE)?,
            _ => identify::values_within(&self.study.edited(&sets)?, data, self.start, TIME_TOLERANCE)?,
        };
        for (h, amplitude) in members.iter().filter(|(h, _)| h.is_sensor()) {
            values = h.read(data, &values, *amplitude);
        }
        Ok(values)
    }
}

/// A cause with its amplitudes as the full solver has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Amplitudes.
    pub amplitudes: Vec<f64>,
    /// Their standard deviations.
    pub deviations: Vec<f64>,
    /// Whitened misfit left.
    pub misfit: f64,
    /// Predictions, K.
    pub values: Vec<f64>,
    /// Evidence over that of a misfit of zero, without the prior of the hypothesis: Laplace's approximation.
    pub evidence: f64,
}

/// Fits amplitudes by Gauss and Newton's method from a first guess.
///
/// # Errors
/// As [`Bench::predict`].
pub fn fit(bench: &Bench<'_>, members: &[&Hypothesis], guess: &[f64], readings: &[f64], whitener: &Whitener) -> Result<Fitted> {
    let k = members.len();
    let at = |a: &[f64]| -> Result<Vec<f64>> { bench.predict(&members.iter().copied().zip(a.iter().copied()).collect::<Vec<_>>()) };
    let whiten = |values: &[f64]| -> Vec<f64> { whitener.apply(&readings.iter().zip(values).map(|(r, v)| r - v).collect::<Vec<_>>()) };
    let prior = |a: &[f64]| -> f64 { a.iter().zip(members).map(|(a, h)| (a / h.scale).powi(2)).sum() };
    let bounded = |a: f64, h: &Hypothesis| {
        let most = if h.unit.starts_with("ln") { 4.0 } else { 50.0 * h.scale };
        a.clamp(if h.is_signed { -most } else { 0.0 }, most)
    };
    let mut here: Vec<f64> = guess.iter().zip(members).map(|(a, h)| bounded(*a, h)).collect();
    // A first guess from a slope may lie where the machine cannot be solved.
    let mut values = at(&here);
    for _ in 0..4 {
        if values.is_ok() {
            break;
        }
        here.iter_mut().for_each(|a| *a *= 0.5);
        values = at(&here);
    }
    let mut values = values?;
    let mut residual = whiten(&values);
    let square = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
    let is_log = bench.data.is_transient();
    if is_log {
        // A front that is off by more than its width gives a slope that leads nowhere: the prior's scale may lie nearer.
        let far: Vec<f64> = here.iter().zip(members).map(|(a, h)| bounded(if *a < 0.0 { -h.scale } else { h.scale }, h)).collect();
        if let Ok(found) = at(&far) {
            let left = whiten(&found);
            if square(&left) + prior(&far) < square(&residual) + prior(&here) {
                (here, values, residual) = (far, found, left);
            }
        }
    }
    let slopes = |here: &[f64], values: &[f64]| -> Result<(DMatrix<f64>, DMatrix<f64>)> {
        let mut jacobian = DMatrix::zeros(readings.len(), k);
        for j in 0..k {
            let step = if is_log { STEP_OF_LOGS } else { STEP } * members[j].scale;
            let mut moved = here.to_vec();
            moved[j] += step;
            let column: Vec<f64> = at(&moved)?.iter().zip(values).map(|(a, b)| (a - b) / step).collect();
            jacobian.set_column(j, &DVector::from_vec(whitener.apply(&column)));
        }
        let mut matrix = jacobian.transpose() * &jacobian;
        members.iter().enumerate().for_each(|(j, h)| matrix[(j, j)] += 1.0 / (h.scale * h.scale));
        Ok((jacobian, matrix.try_inverse().unwrap_or_else(|| DMatrix::identity(k, k))))
    };
    // Slopes where the guess lies serve all steps of steady tables: what is left to go is short.
    let (mut jacobian, mut covariance) = slopes(&here, &values)?;
    for _ in 0..if is_log { MOST_STEPS_OF_LOGS } else { MOST_STEPS } {
        let mut right = jacobian.transpose() * DVector::from_vec(residual.clone());
        members.iter().enumerate().for_each(|(j, h)| right[j] -= here[j] / (h.scale * h.scale));
        let step = &covariance * right;
        if (0..k).all(|j| step[j].abs() < 0.05 * covariance[(j, j)].sqrt()) {
            break;
        }
        let before = square(&residual) + prior(&here);
        let mut share = 1.0;
        let mut moved = false;
        for _ in 0..3 {
            let to: Vec<f64> = (0..k).map(|j| bounded(here[j] + share * step[j], members[j])).collect();
            if to == here {
                break;
            }
            if let Ok(found) = at(&to) {
                let left = whiten(&found);
                if square(&left) + prior(&to) <= before {
                    (here, values, residual) = (to, found, left);
                    moved = true;
                    break;
                }
            }
            share *= 0.4;
        }
        if !moved {
            break;
        }
        if is_log {
            (jacobian, covariance) = slopes(&here, &values)?;
        }
    }
    let misfit = square(&residual);
    let scale: f64 = members.iter().map(|h| h.scale.ln()).sum();
    let evidence = -0.5 * misfit - 0.5 * prior(&here) + 0.5 * covariance.determinant().max(1e-300).ln() - scale;
    Ok(Fitted { deviations: (0..k).map(|j| covariance[(j, j)].max(0.0).sqrt()).collect(), amplitudes: here, misfit, values, evidence })
}
