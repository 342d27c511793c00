//! The machine over time in few states: polynomials of the condition, fitted to linear dynamics at several
//! conditions.

pub(super) mod section;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::evaluate::{monomial, scale_row};
use super::least_squares::{Orthonormal, axpy, dot};
use super::model::{InTimeSpec, SharedTerms, SurrogateSpec};
use super::polynomial::{PolynomialSearch, monomial_columns};
use coldplate_base::error::{Error, Result};

/// Largest number of terms of the steady states, and their largest degree. Chosen: more terms fit better, but make
/// every step slower.
const STEADY: (usize, usize) = (30, 4);
/// Largest number of terms of the rates and outputs, and their largest degree. Chosen far smaller, because there are states
/// times states rates per term.
const MOVING: (usize, usize) = (6, 3);
/// Residual, as a share of all values (root mean square), at which no further term is added. Chosen: smaller than any
/// error that matters.
const ENOUGH: f64 = 1e-6;
/// Factor on the covariance of the steady states: states start as far from the steady one as two conditions are from
/// each other. The variance of a difference of two independent numbers is twice theirs.
const AWAY: f64 = 2.0;

/// Linear dynamics at a condition: z' = -rates (z - steady), points moved by outputs (z - steady).
#[derive(Debug, Clone)]
pub struct DynamicsSample {
    /// The condition, in the variables' units.
    pub x: Vec<f64>,
    /// States in the steady state.
    pub steady: Vec<f64>,
    /// Rates, column by column, 1/s.
    pub rates: Vec<f64>,
    /// Outputs, point by point, in the point's unit.
    pub outputs: Vec<f64>,
}

impl InTimeSpec {
    /// Fits samples that cover the range; `uniform` are the states of one temperature everywhere, at zero and per unit. The errors
    /// are left at zero.
    ///
    /// # Errors
    /// Samples of different sizes, too few of them, or numbers that are not finite.
    pub fn fit(surrogate: &SurrogateSpec, samples: &[DynamicsSample], uniform: [Vec<f64>; 2]) -> Result<Self> {
        let points = surrogate.points.len();
        let states = uniform[0].len();
        let is_whole = |s: &DynamicsSample| {
            s.steady.len() == states
                && s.rates.len() == states * states
                && s.outputs.len() == points * states
                && s.steady.iter().chain(&s.rates).chain(&s.outputs).all(|v| v.is_finite())
        };
        if samples.len() <= STEADY.0 || states == 0 || uniform[1].len() != states || !samples.iter().all(is_whole) {
            return Err(Error::numerics("the dynamics of this machine cannot be fitted: too few conditions, or numbers that are none"));
        }
        let steady: Vec<Vec<f64>> = (0..states).map(|k| samples.iter().map(|s| s.steady[k]).collect()).collect();
        let (steady_terms, steady) = shared(surrogate, samples, &steady, STEADY.0, STEADY.1)?;
        // Errors of a rate are relative to the state's own rate.
        let own: Vec<f64> = (0..states).map(|k| samples[0].rates[k * (states + 1)].abs().max(f64::MIN_POSITIVE)).collect();
        let of_rates = (0..states * states).map(|k| samples.iter().map(|s| s.rates[k] / own[k % states]).collect());
        let of_outputs = (0..points * states).map(|k| samples.iter().map(|s| s.outputs[k]).collect());
        let moving: Vec<Vec<f64>> = of_rates.chain(of_outputs).collect();
        for most in (1..=MOVING.0).rev() {
            let (moving_terms, all) = shared(surrogate, samples, &moving, most, MOVING.1)?;
            let scale = |row: &[f64]| row.iter().enumerate().map(|(k, c)| c * own[k % states]).collect();
            let rates: Vec<Vec<f64>> = all.iter().map(|row| scale(&row[..states * states])).collect();
            if !is_stable(surrogate, samples, &moving_terms, &rates, states) {
                continue;
            }
            let of_point = |point: usize| all.iter().flat_map(|row| row[(states + point) * states..][..states].to_vec()).collect();
            let outputs = (0..points).map(of_point).collect();
            let largest =
                |k: usize| samples.iter().flat_map(|s| s.outputs[k..].iter().step_by(states)).fold(0.0, |m: f64, c| m.max(c.abs()));
            return Ok(Self {
                states,
                steady_terms,
                moving_terms,
                steady,
                rates,
                outputs,
                uniform,
                reach: (0..states).map(largest).collect(),
                spread: spread(samples, states),
                errors: vec![0.0; points],
            });
        }
        Err(Error::numerics("the fitted dynamics of this machine grow without bound").help("fit a smaller range of conditions"))
    }
}

/// Terms that all columns of values share, and their coefficients, term by term. They are chosen one after the other by
/// their reduction of the residual of all columns together.
fn shared(
    surrogate: &SurrogateSpec,
    samples: &[DynamicsSample],
    values: &[Vec<f64>],
    most: usize,
    degree: usize,
) -> Result<(SharedTerms, Vec<Vec<f64>>)> {
    let variables = &surrogate.variables;
    let active: Vec<bool> = variables.iter().map(|v| v.high > v.low).collect();
    let search = PolynomialSearch { variables, active: &active, max_degree: degree };
    let rows: Vec<&[f64]> = samples.iter().map(|s| s.x.as_slice()).collect();
    let terms = search.terms(degree);
    let tried = search.transforms(&rows).into_par_iter().map(|transforms| {
        let scaled: Vec<Vec<f64>> = rows.iter().map(|x| scale_row(variables, &transforms, x)).collect();
        let columns = monomial_columns(&scaled, &terms);
        let (picked, left) = picked(&columns, values, most);
        (left, transforms, columns, picked)
    });
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0)).ok_or_else(|| Error::numerics("no polynomial follows the dynamics"))?;
    let (_, transforms, columns, picked) = best;
    let mut basis = Orthonormal::new();
    let picked: Vec<usize> = picked.into_iter().filter(|k| basis.push(&columns[*k])).collect();
    let solved: Vec<Vec<f64>> = (values.iter())
        .map(|values| {
            let mut residuals = values.clone();
            basis.back_substitute(&basis.project_out(&mut residuals))
        })
        .collect();
    let coefficients = (0..picked.len()).map(|k| solved.iter().map(|own| own[k]).collect()).collect();
    Ok((SharedTerms { transforms, terms: picked.iter().map(|k| terms[*k].clone()).collect() }, coefficients))
}

/// Columns in the order of their reduction of the residual of all values together, and the remaining sum of squares.
fn picked(columns: &[Vec<f64>], values: &[Vec<f64>], most: usize) -> (Vec<usize>, f64) {
    let mut candidates: Vec<Option<Vec<f64>>> = columns.iter().cloned().map(Some).collect();
    let mut residuals = values.to_vec();
    let square = |all: &[Vec<f64>]| all.iter().map(|r| dot(r, r)).sum::<f64>();
    let whole = square(&residuals);
    let mut found = Vec::new();
    while found.len() < most && square(&residuals) > ENOUGH * ENOUGH * whole {
        let gain = |column: &Vec<f64>| residuals.iter().map(|r| dot(column, r).powi(2)).sum::<f64>() / dot(column, column);
        let gains = candidates.iter().enumerate().filter_map(|(k, column)| Some((k, gain(column.as_ref()?))));
        let Some((best, _)) = gains.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let Some(mut own) = candidates[best].take() else { break };
        let size = dot(&own, &own).sqrt();
        own.iter_mut().for_each(|v| *v /= size);
        for residual in &mut residuals {
            let share = dot(&own, residual);
            axpy(residual, -share, &own);
        }
        for (candidate, column) in candidates.iter_mut().zip(columns) {
            if let Some(left) = candidate {
                let share = dot(&own, left);
                axpy(left, -share, &own);
                if dot(left, left) < 1e-12 * dot(column, column) {
                    *candidate = None;
                }
            }
        }
        found.push(best);
    }
    (found, square(&residuals))
}

/// Whether all states decay at the samples and at the corners of the range.
fn is_stable(surrogate: &SurrogateSpec, samples: &[DynamicsSample], shared: &SharedTerms, rates: &[Vec<f64>], states: usize) -> bool {
    let variables = &surrogate.variables;
    let corner = |number: usize| -> Vec<f64> {
        variables.iter().enumerate().map(|(k, v)| if number >> k & 1 == 0 { v.low } else { v.high }).collect()
    };
    let corners = (0..1_usize << variables.len().min(8)).map(corner);
    let places: Vec<Vec<f64>> = samples.iter().map(|s| s.x.clone()).chain(corners).collect();
    places.par_iter().all(|x| {
        let u = scale_row(variables, &shared.transforms, x);
        let mut matrix = DMatrix::zeros(states, states);
        for (term, coefficients) in shared.terms.iter().zip(rates) {
            matrix += DMatrix::from_column_slice(states, states, coefficients) * monomial(term, &u);
        }
        matrix.complex_eigenvalues().iter().all(|e| e.re > 0.0)
    })
}

/// Packed lower triangle of the covariance of the difference between the steady states of two conditions.
fn spread(samples: &[DynamicsSample], states: usize) -> Vec<f64> {
    let count = samples.len() as f64;
    let mean: Vec<f64> = (0..states).map(|k| samples.iter().map(|s| s.steady[k]).sum::<f64>() / count).collect();
    let product = |i: usize, j: usize| samples.iter().map(|s| (s.steady[i] - mean[i]) * (s.steady[j] - mean[j])).sum::<f64>() / count;
    (0..states).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| AWAY * product(i, j)).collect()
}
