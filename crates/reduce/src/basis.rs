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

impl ModeBasis {
    /// At most `most` modes of states, which are differences from one reference state (K; zero at held nodes).
    pub fn of(states: &[Vec<f64>], energy: &Symmetric<'_>, most: usize) -> Self {
        let image = |x: &Vec<f64>| {
            let mut y = vec![0.0; x.len()];
            energy.multiply(x, &mut y);
            y
        };
        let images: Vec<Vec<f64>> = states.par_iter().map(image).collect();
        let count = states.len();
        let rows: Vec<Vec<f64>> = (0..count).into_par_iter().map(|i| (0..=i).map(|j| dot(&states[i], &images[j])).collect()).collect();
        let gram = DMatrix::from_fn(count, count, |i, j| if j <= i { rows[i][j] } else { rows[j][i] });
        let decomposed = gram.symmetric_eigen();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| decomposed.eigenvalues[*b].total_cmp(&decomposed.eigenvalues[*a]));
        let largest = order.first().map_or(0.0, |i| decomposed.eigenvalues[*i]);
        order.retain(|i| decomposed.eigenvalues[*i] > ROUNDING * ROUNDING * largest);
        order.truncate(most);
        let mode = |i: &usize| {
            let scale = 1.0 / decomposed.eigenvalues[*i].sqrt();
            let mut mode = vec![0.0; states[0].len()];
            for (state, weight) in states.iter().zip(decomposed.eigenvectors.column(*i).iter()) {
                mode.iter_mut().zip(state).for_each(|(m, s)| *m += scale * weight * s);
            }
            mode
        };
        let modes = order.par_iter().map(mode).collect();
        Self { modes }
    }

    /// States without their projection on these modes.
    pub fn without(&self, states: &[Vec<f64>], energy: &Symmetric<'_>) -> Vec<Vec<f64>> {
        let left = |state: &Vec<f64>| {
            let (mut image, mut left) = (vec![0.0; state.len()], state.clone());
            energy.multiply(state, &mut image);
            for mode in &self.modes {
                let amplitude = dot(mode, &image);
                left.iter_mut().zip(mode).for_each(|(l, m)| *l -= amplitude * m);
            }
            left
        };
        states.par_iter().map(left).collect()
    }
}
