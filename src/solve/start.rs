//! Where the solution of a further condition starts: the combination of known solutions that leaves the
//! smallest residual.
//!
//! A machine's temperatures change smoothly with the condition, so a dozen known states span most of
//! every other one. The combination is found by least squares on the linearised residual, whatever the
//! condition's variables are; it costs one product with the matrix per known state.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::csr::{CHUNK, dot_chunk, for_chunks};
use super::jacobian::Jacobian;

/// Directions of less weight than this, relative to the largest, are left out.
const CUTOFF: f64 = 1e-10;

/// Known states, as differences from the reference state, K.
#[derive(Debug, Clone, Default)]
pub struct Anchors {
    differences: Vec<Vec<f32>>,
}

impl Anchors {
    /// Takes in a state.
    pub fn add(&mut self, reference: &[f64], state: &[f64]) {
        self.differences.push(state.iter().zip(reference).map(|(t, r)| (t - r) as f32).collect());
    }

    /// Whether there is any.
    pub fn is_empty(&self) -> bool {
        self.differences.is_empty()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.differences.len()
    }

    /// Moves `temperatures` (K) along the known differences to where the linearised residual is smallest.
    pub fn improve(&self, jacobian: &Jacobian<'_>, residual: &[f64], temperatures: &mut [f64]) {
        self.improve_weighed(jacobian, residual, None, temperatures);
    }

    /// The same with a weight of each node's residual: without, water, whose coefficients are large, counts for more than what hardly
    /// holds to anything.
    pub fn improve_weighed(&self, jacobian: &Jacobian<'_>, residual: &[f64], weights: Option<&[f64]>, temperatures: &mut [f64]) {
        let weigh = |values: &mut [f64]| {
            if let Some(weights) = weights {
                values.iter_mut().zip(weights).for_each(|(v, w)| *v *= w);
            }
        };
        let mut residual = residual.to_vec();
        weigh(&mut residual);
        let m = self.differences.len();
        let (mut wide, mut product) = (vec![0.0; residual.len()], vec![0.0; residual.len()]);
        let mut images: Vec<Vec<f32>> = Vec::with_capacity(m);
        let mut right = DVector::zeros(m);
        for (i, difference) in self.differences.iter().enumerate() {
            for_chunks(&mut wide, |first, part| part.iter_mut().zip(&difference[first..]).for_each(|(w, d)| *w = f64::from(*d)));
            jacobian.multiply(&wide, &mut product);
            weigh(&mut product);
            let parts: Vec<f64> = product.par_chunks(CHUNK).zip(residual.par_chunks(CHUNK)).map(|(p, r)| dot_chunk(p, r)).collect();
            right[i] = -parts.iter().sum::<f64>();
            let mut image = vec![0.0f32; product.len()];
            for_chunks(&mut image, |first, part| part.iter_mut().zip(&product[first..]).for_each(|(i, p)| *i = *p as f32));
            images.push(image);
        }
        let gram = |c: usize| -> Vec<f64> {
            let range = c * CHUNK..((c + 1) * CHUNK).min(residual.len());
            let mut sums = Vec::with_capacity(m * (m + 1) / 2);
            let mut row = vec![0.0f64; range.len()];
            for i in 0..m {
                row.iter_mut().zip(&images[i][range.clone()]).for_each(|(r, v)| *r = f64::from(*v));
                sums.extend((0..=i).map(|j| dot_chunk(&images[j][range.clone()], &row)));
            }
            sums
        };
        let parts: Vec<Vec<f64>> = (0..residual.len().div_ceil(CHUNK)).into_par_iter().map(gram).collect();
        let mut matrix = DMatrix::zeros(m, m);
        let mut at = 0;
        for i in 0..m {
            for j in 0..=i {
                let sum: f64 = parts.iter().map(|p| p[at]).sum();
                (matrix[(i, j)], matrix[(j, i)]) = (sum, sum);
                at += 1;
            }
        }
        let decomposed = matrix.symmetric_eigen();
        let largest = decomposed.eigenvalues.max();
        let mut weights: DVector<f64> = DVector::zeros(m);
        for (value, vector) in decomposed.eigenvalues.iter().zip(decomposed.eigenvectors.column_iter()) {
            if *value > CUTOFF * largest {
                weights += vector * (vector.dot(&right) / value);
            }
        }
        for (difference, weight) in self.differences.iter().zip(weights.iter()) {
            for_chunks(temperatures, |first, part| {
                part.iter_mut().zip(&difference[first..]).for_each(|(t, d)| *t += weight * f64::from(*d))
            });
        }
    }
}
