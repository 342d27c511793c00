//! Readings given all others: from the inverse covariance of a table, the error and the density of a few readings that the rest predicts.
//!
//! With S the covariance of all readings, r their residual and B some of them, the others predict those of B with an error
//! (S⁻¹_BB)⁻¹ (S⁻¹ r)_B of covariance (S⁻¹_BB)⁻¹. S⁻¹ is one block per row less a product of few columns, and is never formed.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::ops::Range;

/// The inverse covariance of readings, and its product with their residual.
pub struct Others {
    /// Readings of each row; of a log each reading by itself.
    pub ranges: Vec<Range<usize>>,
    /// Block of each of them, 1/K².
    pub blocks: Vec<DMatrix<f64>>,
    /// Columns C of the product C Cᵀ that all rows lack, 1/K.
    pub across: DMatrix<f64>,
    /// Inverse covariance times the residual, 1/K.
    pub pull: DVector<f64>,
}

/// Some readings as all others predict them.
pub struct Predicted {
    precision: Cholesky<f64, Dyn>,
    /// Readings less what the others say, K.
    pub error: DVector<f64>,
    /// Logarithm of their density, without the constant of the number of readings.
    pub log_density: f64,
}

impl Others {
    /// Some readings, rising, given all others; `None` where rounding leaves no positive matrix.
    pub fn predict(&self, readings: &[usize]) -> Option<Predicted> {
        let row_of = |i: usize| self.ranges.partition_point(|range| range.end <= i);
        let rows: Vec<usize> = readings.iter().map(|i| row_of(*i)).collect();
        let across = self.across.select_rows(readings);
        let mut precision = &across * across.transpose();
        precision.neg_mut();
        for (a, (i, row)) in readings.iter().zip(&rows).enumerate() {
            let start = self.ranges[*row].start;
            for (b, j) in readings.iter().enumerate().filter(|(b, _)| rows[*b] == *row) {
                precision[(a, b)] += self.blocks[*row][(i - start, j - start)];
            }
        }
        let precision = Cholesky::new(precision)?;
        let pull = self.pull.select_rows(readings);
        let error = precision.solve(&pull);
        let log_density = precision.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>() - 0.5 * pull.dot(&error);
        Some(Predicted { precision, error, log_density })
    }
}

impl Predicted {
    /// The most probable coefficient of a column (K) that is among what the readings may be off by, with unit variance.
    pub fn coefficient(&self, column: &DVector<f64>) -> f64 {
        let factor = self.precision.l();
        factor.tr_mul(&self.error).dot(&factor.tr_mul(column))
    }

    /// Logarithm of the density of the readings with other errors and another covariance: so many K and K² more than they have here.
    pub fn log_density_with(&self, more: &DVector<f64>, covariance: DMatrix<f64>) -> Option<f64> {
        let covariance = covariance + self.precision.inverse();
        let error = &self.error + more;
        let factor = Cholesky::new(covariance)?;
        let log = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        Some(-0.5 * error.dot(&factor.solve(&error)) - log)
    }
}
