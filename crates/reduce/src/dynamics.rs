//! A reduced model over time in few states: linear dynamics at several conditions, with slow states common to all of them.
//!
//! At a condition the amplitudes decay to the steady ones as M a' = -J (a - a_s). The slow states z span most of the responses to
//! steps from condition to condition. These are a rational Krylov sequence (s M + J)⁻¹ M (a_1 - a_2) over shifts s, from the inverse
//! of [`QUICKEST`] to that of the slowest time constant. The span is cut to the wanted number by singular values, weighted by the
//! sensors and the stored heat, and the balance is projected on it (Galerkin). Readings are the steady ones plus the effect of the
//! states' distance from theirs, so that steady states stay exact. Water follows the walls at once and has no states here.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use super::conductors::conductors;
use super::model::ReducedModel;
use super::reduced_network::{ReducedState, follow};
use super::storing::Storing;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_network::Load;

/// Time constant of the quickest responses that the states are chosen by, s. Chosen: shorter spends states on
/// responses that sensors hardly show.
const QUICKEST: f64 = 20.0;
/// Number of shifts from [`QUICKEST`] to the slowest time constant, in equal ratios. Chosen: each costs a
/// factorisation per condition.
const SHIFTS: usize = 12;
/// Most conditions whose responses the states are chosen by, a count. Chosen: each costs [`SHIFTS`] factorisations.
const CHOSEN_BY: usize = 24;
/// Share of the largest singular value below which one counts as noise, dimensionless. Chosen above rounding.
const NOISE: f64 = 1e-9;

/// Linear dynamics at a condition.
#[derive(Debug, Clone)]
pub struct SlowSample {
    /// States of the steady state: s.
    pub steady: DVector<f64>,
    /// z' = -rates (z - steady), 1/s: s x s.
    pub rates: DMatrix<f64>,
    /// Derivatives of the readings with respect to the states: sensors x s.
    pub outputs: DMatrix<f64>,
}

/// A reduced model in few states.
#[derive(Debug, Clone)]
pub struct Slow {
    /// One for each condition.
    pub samples: Vec<SlowSample>,
    /// States of one temperature everywhere: at 0 K, and for each kelvin more.
    pub uniform: [DVector<f64>; 2],
    /// The slowest time constant at the first condition, s.
    pub slowest: f64,
}

/// The dynamics at a condition, in coordinates along the `p` directions of the modes that store heat.
struct Linear {
    state: ReducedState,
    /// Coordinates of the steady state.
    steady: DVector<f64>,
    /// Derivatives of the heat that leaves, W/K: p x p.
    jacobian: DMatrix<f64>,
    /// Derivatives of the readings with respect to the coordinates, water included, which follows the walls: sensors x
    /// p.
    outputs: DMatrix<f64>,
}

impl ReducedModel {
    /// Dynamics of the finer network at `conditions`, in at most `states` states, with the file's values of all parameters.
    ///
    /// # Errors
    /// Fewer than two conditions; one of them has no steady state; the machine stores no heat.
    pub fn slow(&self, conditions: &[Condition], states: usize) -> Result<Slow> {
        let level = &self.fine;
        let storing = Storing::of(&level.capacity);
        if storing.capacity.is_empty() {
            return Err(Error::numerics("this machine stores no heat: it is steady at once"));
        }
        let linear: Vec<Linear> = conditions.par_iter().map(|condition| self.linear(condition, &storing)).collect::<Result<_>>()?;
        let [at_zero, at_one] = [0.0, 1.0].map(|temperature| storing.coordinates(&level.uniform(temperature)));
        if linear.len() < 2 {
            return Err(Error::input("dynamics need at least two conditions"));
        }
        let middle = self.temperature_of(&linear[0].state);
        let even = &at_zero + (&at_one - &at_zero) * middle;
        let slowest = level.slowest(&Load::at(&self.machine, &conditions[0])?)?;
        let responses = responses(&storing, &linear, &even, slowest)?;
        // Coordinates scaled by the root of the capacity, in which scalar products are stored energy.
        let root = storing.capacity.map(f64::sqrt);
        let total = level.stored.column(0).iter().map(|v| v.abs()).sum::<f64>().max(f64::MIN_POSITIVE);
        let mut chosen = span(&(&storing.capacity / total), &linear[0].outputs, &responses, states)?;
        chosen.column_iter_mut().for_each(|mut column| column.component_mul_assign(&root));
        let slow = chosen.qr().q();
        let mut modes = slow.clone();
        modes.column_iter_mut().for_each(|mut column| column.component_div_assign(&root));
        let reduced = |own: &Linear| SlowSample {
            steady: slow.tr_mul(&root.component_mul(&own.steady)),
            rates: modes.tr_mul(&(&own.jacobian * &modes)),
            outputs: &own.outputs * &modes,
        };
        let samples: Vec<SlowSample> = linear.iter().map(reduced).collect();
        let even = |coordinates: &DVector<f64>| slow.tr_mul(&root.component_mul(coordinates));
        let uniform = [even(&at_zero), even(&(&at_one - &at_zero))];
        Ok(scaled(Slow { samples, uniform, slowest }))
    }

    /// The steady state and the dynamics around it. Modes that store no heat follow the others.
    fn linear(&self, condition: &Condition, storing: &Storing) -> Result<Linear> {
        let (level, network) = (&self.fine, &self.fine.network);
        let load = Load::at(&self.machine, condition)?;
        let state = level.steady(network, &load, &DVector::zeros(level.len()))?;
        let given = level.given(network, &load);
        let acting = conductors(network, &load, &state.temperatures);
        let water = level.channels().alongside(&state.streams);
        let jacobian = level.jacobian(network, &state.streams, &water, &given, &acting);
        let read = |a: &DVector<f64>| {
            let mut t = level.temperatures(network, &load, a, Some(&state.temperatures));
            follow(network, &load, &state.streams, water.walls_of_steps(a).as_slice(), &mut t);
            DVector::from_vec(level.readings_of(network, &load, a, &t))
        };
        let here = read(&state.amplitudes);
        let moved = |mode: usize| {
            let mut a = state.amplitudes.clone();
            a[mode] += 1.0;
            read(&a) - &here
        };
        let outputs = DMatrix::from_columns(&(0..level.len()).map(moved).collect::<Vec<_>>());
        let (kept, free) = (&storing.kept, &storing.balanced);
        let along = if storing.is_whole() {
            kept.clone()
        } else {
            let followed = (free.tr_mul(&jacobian) * free).lu().solve(&free.tr_mul(&(&jacobian * kept)));
            kept - free * followed.ok_or_else(|| Error::numerics("modes that store no heat have no balance"))?
        };
        let steady = kept.tr_mul(&state.amplitudes);
        Ok(Linear { state, steady, jacobian: kept.tr_mul(&(&jacobian * &along)), outputs: outputs * along })
    }

    /// Mean temperature of the sampled solids, K.
    fn temperature_of(&self, state: &ReducedState) -> f64 {
        let solids = &state.temperatures[..self.fine.network.solids];
        solids.iter().sum::<f64>() / solids.len().max(1) as f64
    }
}

/// Responses to steps from each condition to the next, and from one temperature everywhere to each: coordinates as columns.
fn responses(storing: &Storing, linear: &[Linear], even: &DVector<f64>, slowest: f64) -> Result<DMatrix<f64>> {
    let by = &linear[..linear.len().min(CHOSEN_BY)];
    let ratio = (slowest / QUICKEST).max(2.0);
    let of = |(k, own): (usize, &Linear)| -> Result<Vec<DVector<f64>>> {
        let steps = [&by[(k + 1) % by.len()].steady, even].map(|from| from - &own.steady);
        let mut found: Vec<DVector<f64>> = steps.to_vec();
        for shift in 0..SHIFTS {
            let s = 1.0 / (QUICKEST * ratio.powf(shift as f64 / (SHIFTS - 1) as f64));
            let stored = &storing.capacity * s;
            let lu = (DMatrix::from_diagonal(&stored) + &own.jacobian).lu();
            for step in &steps {
                let response = lu.solve(&stored.component_mul(step));
                found.push(response.ok_or_else(|| Error::numerics("the reduced model has no response to a step"))?);
            }
        }
        Ok(found)
    };
    let all: Vec<Vec<DVector<f64>>> = by.par_iter().enumerate().map(of).collect::<Result<_>>()?;
    Ok(DMatrix::from_columns(&all.concat()))
}

/// Span of the largest responses, weighted by the sensors and by the shares of the coordinates in the stored heat: p x states.
fn span(shares: &DVector<f64>, outputs: &DMatrix<f64>, responses: &DMatrix<f64>, states: usize) -> Result<DMatrix<f64>> {
    let seen = outputs.tr_mul(outputs) / outputs.nrows().max(1) as f64 + DMatrix::from_diagonal(shares);
    let singular = || Error::numerics("nothing sees the modes of this reduced model");
    let root = seen.cholesky().ok_or_else(singular)?.l();
    let weighted = root.tr_mul(responses);
    let eigen = SymmetricEigen::new(&weighted * weighted.transpose());
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let least = NOISE * NOISE * eigen.eigenvalues[order[0]];
    let columns: Vec<DVector<f64>> = (order.iter().take(states))
        .filter(|i| eigen.eigenvalues[**i] > least)
        .map(|i| eigen.eigenvectors.column(*i).into_owned())
        .collect();
    root.transpose().solve_upper_triangular(&DMatrix::from_columns(&columns)).ok_or_else(singular)
}

/// Scales the states so that each has standard deviation one over the conditions.
fn scaled(mut slow: Slow) -> Slow {
    let count = slow.samples.len() as f64;
    let mean: DVector<f64> = slow.samples.iter().map(|s| &s.steady).sum::<DVector<f64>>() / count;
    let spread = slow.samples.iter().map(|s| (&s.steady - &mean).map(|v| v * v)).sum::<DVector<f64>>() / count;
    let largest = spread.max().sqrt();
    let sizes = spread.map(|v| if v.sqrt() > NOISE * largest { v.sqrt() } else { 1.0 });
    for sample in &mut slow.samples {
        sample.steady.component_div_assign(&sizes);
        for (k, size) in sizes.iter().enumerate() {
            sample.rates.row_mut(k).scale_mut(1.0 / size);
            sample.rates.column_mut(k).scale_mut(*size);
            sample.outputs.column_mut(k).scale_mut(*size);
        }
    }
    slow.uniform.iter_mut().for_each(|u| u.component_div_assign(&sizes));
    slow
}
