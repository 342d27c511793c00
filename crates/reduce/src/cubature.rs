//! A few of many conductors, weighted so that their sum stands for all.
//!
//! The heats of thousands of open faces follow the same law at temperatures that few modes span. A few dozen of them, each with a
//! non-negative weight, therefore give the generalised forces of all (energy-conserving sampling and weighting: Farhat et al.,
//! Int. J. Numer. Meth. Engng 98 (2014) 625). Weights are found by non-negative least squares (Lawson and Hanson, Solving Least
//! Squares Problems, 1974, chapter 23), several conductors at a time. Without negative weights none is large, and none work
//! against each other.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Chosen conductors and their weights.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cubature {
    /// Indices of the chosen conductors.
    pub chosen: Vec<usize>,
    /// Weight of each.
    pub weights: Vec<f64>,
}

/// Chooses at most `most` columns of `forces` (a row per training equation, a column per conductor) and their weights. The residual is
/// at most `tolerance` times the norm of `goal`, the sum of all columns, including those that are no candidates, unless `most` is
/// reached before.
pub fn sample(forces: &DMatrix<f64>, goal: &DVector<f64>, tolerance: f64, most: usize) -> Cubature {
    let scale = goal.norm();
    if scale == 0.0 || forces.ncols() == 0 {
        return Cubature::default();
    }
    let norms: Vec<f64> = forces.column_iter().map(|c| c.norm().max(1e-300)).collect();
    let mut fit = Fit::default();
    let mut left = goal.clone();
    let mut best = (f64::INFINITY, 0);
    let mut barred = vec![false; forces.ncols()];
    while left.norm() > tolerance * scale && fit.chosen.len() < most {
        let scores: Vec<f64> = (0..forces.ncols()).into_par_iter().map(|c| forces.column(c).dot(&left) / norms[c]).collect();
        let mut order: Vec<usize> = (0..scores.len()).filter(|c| scores[*c] > 0.0 && !barred[*c] && !fit.chosen.contains(c)).collect();
        order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]).then(a.cmp(b)));
        order.truncate((fit.chosen.len() / 16).max(1));
        if order.is_empty() {
            break;
        }
        order.iter().for_each(|c| fit.take(*c, forces, goal));
        fit.settle(&mut barred);
        left = goal.clone();
        for (c, w) in fit.chosen.iter().zip(&fit.weights) {
            left.axpy(-w, &forces.column(*c), 1.0);
        }
        // Stop when rounding keeps the residual from falling.
        best = if left.norm() < 0.999 * best.0 { (left.norm(), 0) } else { (best.0, best.1 + 1) };
        if best.1 > 20 {
            break;
        }
    }
    Cubature { chosen: fit.chosen, weights: fit.weights }
}

/// Normal equations of the columns chosen so far.
#[derive(Default)]
struct Fit {
    chosen: Vec<usize>,
    weights: Vec<f64>,
    /// Scalar products of the chosen columns with one another, lower triangle row by row.
    products: Vec<Vec<f64>>,
    /// Scalar products of the chosen columns with the goal.
    right: Vec<f64>,
}

impl Fit {
    /// Adds a column, with weight zero at first.
    fn take(&mut self, column: usize, forces: &DMatrix<f64>, goal: &DVector<f64>) {
        let own = forces.column(column);
        self.chosen.push(column);
        self.weights.push(0.0);
        self.products.push(self.chosen.iter().map(|c| own.dot(&forces.column(*c))).collect());
        self.right.push(own.dot(goal));
    }

    /// Solves for the weights; columns whose weight would turn negative are removed and barred.
    fn settle(&mut self, barred: &mut [bool]) {
        while !self.chosen.is_empty() {
            let count = self.chosen.len();
            let mut normal = DMatrix::from_fn(count, count, |i, j| self.products[i.max(j)][i.min(j)]);
            let ridge = 1e-14 * normal.diagonal().max();
            (0..count).for_each(|i| normal[(i, i)] += ridge);
            let Some(factor) = normal.cholesky() else { return };
            let found = factor.solve(&DVector::from_column_slice(&self.right));
            if found.iter().all(|w| *w > 0.0) {
                self.weights = found.iter().copied().collect();
                barred.fill(false);
                return;
            }
            // Go towards the solution until the first weight reaches zero.
            let share = |(own, new): (&f64, &f64)| if *new <= 0.0 { own / (own - new) } else { 1.0 };
            let step = self.weights.iter().zip(found.iter()).map(share).fold(1.0, f64::min);
            self.weights.iter_mut().zip(found.iter()).for_each(|(w, new)| *w += step * (new - *w));
            let gone: Vec<usize> = (0..count).rev().filter(|i| found[*i] <= 0.0 && self.weights[*i] <= 1e-12).collect();
            if gone.is_empty() {
                return;
            }
            for i in gone {
                barred[self.chosen[i]] = true;
                self.chosen.remove(i);
                self.weights.remove(i);
                self.right.remove(i);
                self.products.remove(i);
                self.products[i..].iter_mut().for_each(|row| {
                    row.remove(i);
                });
            }
        }
    }
}
