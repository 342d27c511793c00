//! Estimates with weights that are not the inverse of the covariance.
//!
//! The covariance does not describe how a wrong model is wrong. Weights by the inverse of a covariance that is correlated in
//! time let fast changes, which the model may well have wrong, outvote levels. Parameters are therefore found as if readings
//! were independent, and the error of that estimate follows from the whole covariance (working independence and the sandwich:
//! Liang & Zeger 1986, Biometrika 73, 13-22). The misfit is divided by the number of readings per independent one, so that
//! priors keep their weight.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::discrepancy::{DiscrepancySize, ErrorParts};
use super::measurement::Whitener;

/// Curvature and covariance of the slope of an estimate with given weights.
#[derive(Debug, Clone)]
pub struct Sandwich {
    /// Curvature of half the misfit with these weights, priors included.
    pub curvature: DMatrix<f64>,
    /// Covariance of the slope of half the misfit with these weights.
    pub scatter: DMatrix<f64>,
}

impl Sandwich {
    /// Curvature and covariance of the slope for readings whose covariance is that of `parts` at a level, with weights of
    /// independent noise. `slopes` are the changes of the readings with each parameter, K per unit; `prior` is the inverse
    /// variance of each parameter.
    pub fn of(slopes: &[Vec<f64>], weights: &Whitener, parts: &ErrorParts, level: &DiscrepancySize, prior: Vec<f64>) -> Self {
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

/// Number of readings per independent one, at least one. For each parameter, the estimate by weights of the deviations alone
/// has one variance under the covariance and another one if readings were independent; the result is the mean ratio of the two.
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

/// Inverse of a symmetric matrix, scaled to a unit diagonal. Eigenvalues below 1e-12 count as 1e-12, so that directions without
/// information get a very large variance.
pub(crate) fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
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

    /// Twelve readings of one level: each counts if they are independent, all of them count once if they have one common error.
    #[test]
    fn readings_are_worth_what_is_new_in_them() {
        let (slopes, deviations) = ([vec![1.0; 12]], [0.5; 12]);
        let independent = |v: &[f64]| v.iter().map(|v| 0.25 * v).collect();
        let common = |v: &[f64]| vec![0.25 * v.iter().sum::<f64>(); v.len()];
        assert!((worth(&slopes, &deviations, independent) - 1.0).abs() < 1e-12);
        assert!((worth(&slopes, &deviations, common) - 12.0).abs() < 1e-9);
    }
}
