//! Finalists, fitted through the full solver.

use nalgebra::{DMatrix, DVector};

use super::catalogue::{Hypothesis, Scales, UserKind};
use crate::error::{Error, Result};
use crate::identify;
use crate::measure::{Data, Whitener};
use crate::sensitivity::Study;
use crate::simulate::Start;

/// Steps with the same slopes, and how often slopes are renewed.
const MOST_STEPS: usize = 3;
const MOST_RENEWALS: usize = 4;
/// Slopes are renewed until they moved the fit by less than this share of its standard deviation.
const RENEWED: f64 = 0.3;
/// Difference step, as a share of the prior's scale.
const STEP: f64 = 0.02;

/// What is needed to predict with a hypothesis in force.
#[derive(Debug, Clone, Copy)]
pub struct Bench<'a> {
    /// The machine as it is.
    pub study: &'a Study,
    /// The data.
    pub data: &'a Data,
    /// What the machine as it is predicts for them, K.
    pub predicted: &'a [f64],
    /// State logs begin with.
    pub start: Start,
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

impl Bench<'_> {
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

    /// Predictions with hypotheses in force.
    ///
    /// # Errors
    /// The machine file has no words for one of them, or the machine with them cannot be solved.
    pub fn predict(&self, members: &[(&Hypothesis, f64)]) -> Result<Vec<f64>> {
        let mut values = if members.iter().all(|(h, _)| h.is_sensor()) {
            self.predicted.to_vec()
        } else {
            let Some(Extended { study, .. }) = self.extended(members)? else {
                return Err(Error::input("the machine file has no words for this cause"));
            };
            identify::values(&study, self.data, self.start)?
        };
        for (h, amplitude) in members.iter().filter(|(h, _)| h.is_sensor()) {
            values = h.read(self.data, &values, *amplitude);
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
    let mut covariance = DMatrix::identity(k, k);
    for _ in 0..MOST_RENEWALS {
        let jacobian = slopes(&at, members, &here, &values, whitener)?;
        let mut matrix = jacobian.transpose() * &jacobian;
        members.iter().enumerate().for_each(|(j, h)| matrix[(j, j)] += 1.0 / (h.scale * h.scale));
        covariance = matrix.try_inverse().unwrap_or_else(|| DMatrix::identity(k, k));
        let begun = here.clone();
        for _ in 0..MOST_STEPS {
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
        }
        // Slopes, and with them the interval, are those of where the fit ended.
        if (0..k).all(|j| (here[j] - begun[j]).abs() < RENEWED * covariance[(j, j)].sqrt()) {
            break;
        }
    }
    let misfit = square(&residual);
    let scale: f64 = members.iter().map(|h| h.scale.ln()).sum();
    let evidence = -0.5 * misfit - 0.5 * prior(&here) + 0.5 * covariance.determinant().max(1e-300).ln() - scale;
    Ok(Fitted { deviations: (0..k).map(|j| covariance[(j, j)].max(0.0).sqrt()).collect(), amplitudes: here, misfit, values, evidence })
}

/// Whitened slopes of the predictions with respect to every amplitude, one column each.
fn slopes(
    at: &dyn Fn(&[f64]) -> Result<Vec<f64>>,
    members: &[&Hypothesis],
    here: &[f64],
    values: &[f64],
    whitener: &Whitener,
) -> Result<DMatrix<f64>> {
    let mut jacobian = DMatrix::zeros(values.len(), members.len());
    for (j, h) in members.iter().enumerate() {
        let step = STEP * h.scale;
        let mut moved = here.to_vec();
        moved[j] += step;
        let column: Vec<f64> = at(&moved)?.iter().zip(values).map(|(a, b)| (a - b) / step).collect();
        jacobian.set_column(j, &DVector::from_vec(whitener.apply(&column)));
    }
    Ok(jacobian)
}
