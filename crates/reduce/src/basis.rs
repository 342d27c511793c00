//! Modes from solved states: proper orthogonal decomposition in the norm of the linearised network's heat.

use nalgebra::DMatrix;
use rayon::prelude::*;

use coldplate_solve::Symmetric;
use coldplate_solve::csr::dot;

/// Modes in the order of their energy, the largest first.
#[derive(Debug, Clone)]
pub(crate) struct ModeBasis {
    /// Modes at all solid nodes, K, of norm one: a vector per mode.
    pub modes: Vec<Vec<f64>>,
}

/// Share of the first mode's amplitude below which a mode is rounding, dimensionless. Chosen: the square root of
/// double precision, since eigenvalues are squares of amplitudes.
const ROUNDING: f64 = 1e-8;

/// Share of a mode's energy that the modes before it must leave, dimensionless: a mode has all of it but for rounding, a direction of
/// rounding has next to none. Chosen between the two.
const INDEPENDENT: f64 = 0.5;

impl ModeBasis {
    /// A mode for each free node, so that every state is represented; `None` if the energy tells some nodes not apart.
    pub fn whole(free: &[usize], solids: usize, energy: &Symmetric<'_>) -> Option<Self> {
        let unit = |node: &usize| {
            let mut state = vec![0.0; solids];
            state[*node] = 1.0;
            image(energy, &state)
        };
        let images: Vec<Vec<f64>> = free.iter().map(unit).collect();
        let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| images[j][free[i]]);
        let columns = matrix.cholesky()?.l().transpose().solve_upper_triangular(&DMatrix::identity(free.len(), free.len()))?;
        let mode = |k: usize| {
            let mut mode = vec![0.0; solids];
            free.iter().enumerate().for_each(|(i, node)| mode[*node] = columns[(i, k)]);
            mode
        };
        Some(Self { modes: (0..free.len()).map(mode).collect() })
    }

    /// At most `most` modes of states, which are differences from one reference state (K; zero at held nodes).
    pub fn of(states: &[Vec<f64>], energy: &Symmetric<'_>, most: usize) -> Self {
        Self::above(states, energy, most, 0.0)
    }

    /// At most `most` modes of what these modes leave of states. Directions that these modes span already leave rounding alone, which
    /// is no mode: a machine of few nodes has no more modes than nodes.
    pub fn beyond(&self, states: &[Vec<f64>], energy: &Symmetric<'_>, most: usize) -> Self {
        let largest = states.iter().map(|state| dot(state, &image(energy, state))).fold(0.0, f64::max);
        Self::above(&self.without(states, energy), energy, most, ROUNDING * ROUNDING * largest)
    }

    /// At most `most` modes of states, each of more energy than `least`.
    fn above(states: &[Vec<f64>], energy: &Symmetric<'_>, most: usize, least: f64) -> Self {
        let images: Vec<Vec<f64>> = states.par_iter().map(|state| image(energy, state)).collect();
        let count = states.len();
        let rows: Vec<Vec<f64>> = (0..count).into_par_iter().map(|i| (0..=i).map(|j| dot(&states[i], &images[j])).collect()).collect();
        let gram = DMatrix::from_fn(count, count, |i, j| if j <= i { rows[i][j] } else { rows[j][i] });
        let decomposed = gram.symmetric_eigen();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| decomposed.eigenvalues[*b].total_cmp(&decomposed.eigenvalues[*a]));
        let largest = order.first().map_or(0.0, |i| decomposed.eigenvalues[*i]);
        order.retain(|i| decomposed.eigenvalues[*i] > least.max(ROUNDING * ROUNDING * largest));
        order.truncate(most);
        let mode = |i: &usize| {
            let scale = 1.0 / decomposed.eigenvalues[*i].sqrt();
            let mut mode = vec![0.0; states[0].len()];
            for (state, weight) in states.iter().zip(decomposed.eigenvectors.column(*i).iter()) {
                mode.iter_mut().zip(state).for_each(|(m, s)| *m += scale * weight * s);
            }
            mode
        };
        let candidates: Vec<Vec<f64>> = order.par_iter().map(mode).collect();
        Self { modes: independent(candidates, energy) }
    }

    /// States without their projection on these modes.
    fn without(&self, states: &[Vec<f64>], energy: &Symmetric<'_>) -> Vec<Vec<f64>> {
        let left = |state: &Vec<f64>| {
            let (image, mut left) = (image(energy, state), state.clone());
            for mode in &self.modes {
                let amplitude = dot(mode, &image);
                left.iter_mut().zip(mode).for_each(|(l, m)| *l -= amplitude * m);
            }
            left
        };
        states.par_iter().map(left).collect()
    }
}

/// Modes made orthonormal, without those that the ones before span already: eigenvalues near rounding belong to no direction of
/// their own. A machine of few nodes has no more modes than nodes.
fn independent(candidates: Vec<Vec<f64>>, energy: &Symmetric<'_>) -> Vec<Vec<f64>> {
    let mut found: Vec<(Vec<f64>, Vec<f64>)> = Vec::with_capacity(candidates.len());
    for mut mode in candidates {
        for (known, image) in &found {
            let amplitude = dot(&mode, image);
            mode.iter_mut().zip(known).for_each(|(m, k)| *m -= amplitude * k);
        }
        let mut image = image(energy, &mode);
        let left = dot(&mode, &image);
        if left > INDEPENDENT {
            let scale = 1.0 / left.sqrt();
            [&mut mode, &mut image].into_iter().flatten().for_each(|v| *v *= scale);
            found.push((mode, image));
        }
    }
    found.into_iter().map(|(mode, _)| mode).collect()
}

/// Product of the matrix of the energy with a state.
fn image(energy: &Symmetric<'_>, state: &[f64]) -> Vec<f64> {
    let mut found = vec![0.0; state.len()];
    energy.multiply(state, &mut found);
    found
}
