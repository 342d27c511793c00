//! Estimates with weights that are not the inverse of the covariance.
//!
//! A model that is wrong is not told by its covariance how to be wrong: weighing by the inverse of one that is correlated in time lets
//! fast changes, which the model may well have wrong, outvote levels. So parameters are found as if readings were independent, and what
//! that estimate may be off by follows from the whole covariance (working independence and the sandwich: Liang & Zeger 1986,
//! Biometrika 73, 13-22). The misfit counts as many times less as the readings are worth fewer, so that priors keep their weight.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::discrepancy::{ErrorParts, Level};
use super::measurement::Whitener;

/// What an estimate with given weights comes to.
#[derive(Debug, Clone)]
pub struct Sandwich {
    /// Curvature of half the misfit with these weights, priors included.
    pub curvature: DMatrix<f64>,
    /// Covariance of its slope.
    pub scatter: DMatrix<f64>,
}

impl Sandwich {
    /// Of readings whose covariance is that of `parts` at a level, with weights of independent noise; `slopes` are their changes with each
    /// parameter, K per unit, `prior` the inverse variance of each.
    pub fn of(slopes: &[Vec<f64>], weights: &Whitener, parts: &ErrorParts, level: &Level, prior: Vec<f64>) -> Self {
        let weighed: Vec<Vec<f64>> = slopes.iter().map(|slope| weights.weigh(slope)).collect();
        let products: Vec<Vec<f64>> = weighed.iter().map(|w| parts.times(level, w)).collect();
        let prior = DMatrix::from_diagonal(&DVector::from_vec(prior));
        Self { curvature: gram(&weighed, slopes) + &prior, scatter: gram(&weighed, &products) + prior }
    }

    /// Covariance of the estimate.
    pub fn covariance(&self) -> DMatrix<f64> {
        let inverse = pseudo_inverse(&self.curvature);
        &inverse * &self.scatter * &inverse
    }
}

/// How many times more readings there are than they are worth, at least one: the mean over parameters of the variance that a covariance
/// gives an estimate from readings that are weighed by their deviations alone, over the one it would have were they independent.
pub fn worth(slopes: &[Vec<f64>], deviations: &[f64], covariance: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
    let weighed: Vec<Vec<f64>> = slopes.iter().map(|c| c.iter().zip(deviations).map(|(c, d)| c / (d * d)).collect()).collect();
    let products: Vec<Vec<f64>> = weighed.iter().map(|w| covariance(w)).collect();
    let curvature = gram(&weighed, slopes);
    let known = curvature.diagonal().iter().filter(|c| **c > 0.0).count().max(1);
    ((pseudo_inverse(&curvature) * gram(&weighed, &products)).trace() / known as f64).max(1.0)
}

fn gram(a: &[Vec<f64>], b: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(a.len(), b.len(), |i, j| a[i].iter().zip(&b[j]).map(|(x, y)| x * y).sum::<f64>())
}

/// Inverse where there is information, infinite variance where there is none.
pub fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    if matrix.is_empty() {
        return matrix.clone();
    }
    let scale: Vec<f64> = matrix.diagonal().iter().map(|d| if *d > 0.0 { d.sqrt() } else { 1.0 }).collect();
    let unit = DMatrix::from_fn(scale.len(), scale.len(), |i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let eigen = SymmetricEigen::new(unit);
    let inverse = eigen.eigenvalues.map(|v| 1.0 / v.max(1e-12));
    let unit = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    DMatrix::from_fn(scale.len(), scale.len(), |i, j| unit[(i, j)] / (scale[i] * scale[j]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twelve readings of one level: each counts where they are independent, all of them once where their errors are the same.
    #[test]
    fn readings_are_worth_what_is_new_in_them() {
        let (slopes, deviations) = ([vec![1.0; 12]], [0.5; 12]);
        let independent = |v: &[f64]| v.iter().map(|v| 0.25 * v).collect();
        let common = |v: &[f64]| vec![0.25 * v.iter().sum::<f64>(); v.len()];
        assert!((worth(&slopes, &deviations, independent) - 1.0).abs() < 1e-12);
        assert!((worth(&slopes, &deviations, common) - 12.0).abs() < 1e-9);
    }
}
