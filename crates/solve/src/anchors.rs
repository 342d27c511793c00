//! Start of the solution of a further condition: the combination of known solutions that leaves the smallest residual.
//!
//! A machine's temperatures change smoothly with the condition, so a dozen known states span most of every other one. The combination
//! is found by least squares on the linearised residual, for any condition variables. The cost per known state is a product with some
//! rows of the matrix.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};
use rayon::prelude::*;

use super::adjoint::sizes;
use super::csr::{dot_chunk, for_chunks};
use super::jacobian::Jacobian;

/// Eigenvalues of the least-squares matrix below this share of the largest are left out. Chosen: use of nearly dependent states against
/// rounding.
const CUTOFF: f64 = 1e-10;
/// Rows of a strip, a count. Chosen.
const STRIP: usize = 1024;
/// Rows that are looked at in networks of more than twice as many nodes, a count: about so many, in even strips. Chosen: a dozen
/// numbers are sought.
const ROWS: usize = 60_000;

/// Known states, as differences from a reference state, K.
#[derive(Debug, Clone, Default)]
pub(crate) struct Anchors {
    differences: Vec<Vec<f32>>,
    /// Weight of each node's residual: one over the root of its coefficients, (W/K)^-½, so that the square of a weighed residual is an
    /// energy. Unweighed, water with its large coefficients would count for more than a weakly bound part.
    weights: Arc<[f64]>,
}

impl Anchors {
    /// No states yet, for a network whose matrix is like this one.
    pub fn new(matrix: &Jacobian<'_>) -> Self {
        let weights = sizes(matrix).into_iter().map(|size| if size > 0.0 { size.sqrt().recip() } else { 0.0 });
        Self { differences: Vec::new(), weights: weights.collect() }
    }

    /// No states yet, for the same network.
    pub fn empty(&self) -> Self {
        Self { differences: Vec::new(), weights: self.weights.clone() }
    }

    /// Adds a state (K, of every node), as its difference from a reference state.
    pub fn add(&mut self, reference: &[f64], state: &[f64]) {
        self.differences.push(state.iter().zip(reference).map(|(t, r)| (t - r) as f32).collect());
    }

    /// Whether no state is known.
    pub fn is_empty(&self) -> bool {
        self.differences.is_empty()
    }

    /// Number of known states.
    pub fn len(&self) -> usize {
        self.differences.len()
    }

    /// Products of a linearised network's matrix with the known differences; in a large network of some strips of its rows alone.
    pub(crate) fn seen_by(&self, jacobian: &Jacobian<'_>) -> Combination<'_> {
        let (m, rows) = (self.differences.len(), self.weights.len());
        let strips: Vec<usize> = (0..rows).step_by(STRIP * (rows / ROWS).max(1)).collect();
        let mut wide = vec![0.0; rows];
        let mut images: Vec<Strips> = Vec::with_capacity(m);
        for difference in &self.differences {
            for_chunks(&mut wide, |first, part| part.iter_mut().zip(&difference[first..]).for_each(|(w, d)| *w = f64::from(*d)));
            images.push(self.weighed(&strips, |strip, image| jacobian.product(strip, &wide, image)));
        }
        let mut matrix = DMatrix::zeros(m, m);
        for i in 0..m {
            for j in 0..=i {
                let sum = product(&images[i], &images[j]);
                (matrix[(i, j)], matrix[(j, i)]) = (sum, sum);
            }
        }
        Combination { anchors: self, strips, images, decomposed: matrix.symmetric_eigen() }
    }

    /// Weighed rows of all strips; `fill` writes the rows of the strip that begins at a row.
    fn weighed(&self, strips: &[usize], fill: impl Fn(usize, &mut [f64]) + Sync) -> Strips {
        let of = |strip: &usize| -> Vec<f64> {
            let mut rows = vec![0.0; STRIP.min(self.weights.len() - strip)];
            fill(*strip, &mut rows);
            rows.iter_mut().zip(&self.weights[*strip..]).for_each(|(v, w)| *v *= w);
            rows
        };
        strips.par_iter().map(of).collect()
    }
}

/// Rows of a vector, strip after strip.
type Strips = Vec<Vec<f64>>;

fn product(a: &Strips, b: &Strips) -> f64 {
    let parts: Vec<f64> = a.par_iter().zip(b).map(|(a, b)| dot_chunk(a, b)).collect();
    parts.iter().sum()
}

/// Known states, each with the residual (W) that it adds in a linearised network.
pub(crate) struct Combination<'a> {
    anchors: &'a Anchors,
    strips: Vec<usize>,
    images: Vec<Strips>,
    decomposed: SymmetricEigen<f64, Dyn>,
}

impl Combination<'_> {
    /// Moves `temperatures` (K) along the known differences to the smallest residual; `residual` (W) is the one before the move.
    pub fn improve(&self, residual: &[f64], temperatures: &mut [f64]) {
        let open = self.anchors.weighed(&self.strips, |strip, rows| rows.copy_from_slice(&residual[strip..][..rows.len()]));
        let right = DVector::from_fn(self.images.len(), |i, _| -product(&self.images[i], &open));
        let largest = self.decomposed.eigenvalues.max();
        let mut weights: DVector<f64> = DVector::zeros(right.len());
        for (value, vector) in self.decomposed.eigenvalues.iter().zip(self.decomposed.eigenvectors.column_iter()) {
            if *value > CUTOFF * largest {
                weights += vector * (vector.dot(&right) / value);
            }
        }
        for_chunks(temperatures, |first, part| {
            for (difference, weight) in self.anchors.differences.iter().zip(weights.iter()) {
                part.iter_mut().zip(&difference[first..]).for_each(|(t, d)| *t += weight * f64::from(*d));
            }
        });
    }
}
