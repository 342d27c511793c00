//! A few of many conductors, weighted so that they do what all do together.
//!
//! The heats of thousands of open faces follow the same law at temperatures that few modes span. So a few dozen of them, each
//! with a weight that is not negative, give the same generalised forces as all (energy-conserving sampling and weighting: Farhat
//! et al., Int. J. Numer. Meth. Engng 98 (2014) 625). Weights are found by non-negative least squares (Lawson and Hanson, Solving
//! Least Squares Problems, 1974, chapter 23), several conductors at a time. With no negative weight a sampled network stays
//! dissipative.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Chosen conductors and their weights.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    /// Which.
    pub chosen: Vec<usize>,
    /// Weight of each.
    pub weights: Vec<f64>,
}

/// Chooses columns of `forces` (a row per training equation, a column per conductor) and weights that leave no more than
/// `tolerance` of the `goal` (the sum of all columns, also of those that are no candidates), relative, but no more than `most` columns.
pub fn sample(forces: &DMatrix<f64>, goal: &DVector<f64>, tolerance: f64, most: usize) -> Sample {
    let scale = goal.norm();
    if scale == 0.0 || forces.ncols() == 0 {
        return Sample::default();
    }
    let norms: Vec<f64> = forces.column_iter().map(|c| c.norm().max(1e-300)).collect();
    let mut chosen: Vec<usize> = Vec::new();
    let mut weights: Vec<f64> = Vec::new();
    let mut left = goal.clone();
    let mut best = (f64::INFINITY, 0);
    let mut barred = vec![false; forces.ncols()];
    while left.norm() > tolerance * scale && chosen.len() < most {
        let scores: Vec<f64> = (0..forces.ncols()).into_par_iter().map(|c| forces.column(c).dot(&left) / norms[c]).collect();
        let mut order: Vec<usize> = (0..scores.len()).filter(|c| scores[*c] > 0.0 && !barred[*c] && !chosen.contains(c)).collect();
        order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]).then(a.cmp(b)));
        order.truncate((chosen.len() / 16).max(1));
        if order.is_empty() {
            break;
        }
        chosen.extend(&order);
        weights.resize(chosen.len(), 0.0);
        settle(forces, goal, &mut chosen, &mut weights, &mut barred);
        left = goal.clone();
        for (c, w) in chosen.iter().zip(&weights) {
            left.axpy(-w, &forces.column(*c), 1.0);
        }
        // Rounding ends the descent.
        best = if left.norm() < 0.999 * best.0 { (left.norm(), 0) } else { (best.0, best.1 + 1) };
        if best.1 > 20 {
            break;
        }
    }
    Sample { chosen, weights }
}

/// Least squares over the chosen columns; those whose weight would turn negative are let go.
fn settle(forces: &DMatrix<f64>, goal: &DVector<f64>, chosen: &mut Vec<usize>, weights: &mut Vec<f64>, barred: &mut [bool]) {
    while !chosen.is_empty() {
        let columns = forces.select_columns(chosen.iter());
        let (mut normal, right) = (columns.tr_mul(&columns), columns.tr_mul(goal));
        let ridge = 1e-14 * normal.diagonal().max();
        (0..chosen.len()).for_each(|i| normal[(i, i)] += ridge);
        let Some(factor) = normal.cholesky() else { return };
        let found = factor.solve(&right);
        if found.iter().all(|w| *w > 0.0) {
            *weights = found.iter().copied().collect();
            barred.fill(false);
            return;
        }
        // As far towards the solution as no weight turns negative.
        let share = |(own, new): (&f64, &f64)| if *new <= 0.0 { own / (own - new) } else { 1.0 };
        let step = weights.iter().zip(found.iter()).map(share).fold(1.0, f64::min);
        weights.iter_mut().zip(found.iter()).for_each(|(w, new)| *w += step * (new - *w));
        let kept: Vec<bool> = weights.iter().zip(found.iter()).map(|(w, new)| *new > 0.0 || *w > 1e-12).collect();
        for (c, kept) in chosen.iter().zip(&kept) {
            barred[*c] |= !kept;
        }
        let mut flags = kept.iter();
        chosen.retain(|_| *flags.next().unwrap_or(&true));
        let mut flags = kept.iter();
        weights.retain(|_| *flags.next().unwrap_or(&true));
        if kept.iter().all(|k| *k) {
            return;
        }
    }
}
