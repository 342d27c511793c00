//! Coefficients that change together: the conductances of one contact's joints, the exchange of the stations of all channels.
//!
//! All coefficients of a family follow few numbers (a factor, a film). Their vector therefore stays close to a space of two or three
//! dimensions, whatever the condition is. In that space a few of its entries determine the rest (empirical interpolation: Barrault et
//! al., C. R. Acad. Sci. Paris 339 (2004) 667; its greedy choice of entries likewise). The operator that they multiply is a sum of as
//! many small matrices.

use nalgebra::{DMatrix, DVector, RowDVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Cutoff of a family that leaves out nothing but rounding, a share of the largest coefficient. Chosen between
/// rounding and single precision of the operators.
pub(super) const EXACT: f64 = 1e-8;
/// Most entries that are evaluated, a count. Chosen: each adds a small matrix to every answer.
const MOST: usize = 64;

/// Operators whose coefficients all follow from a few evaluated ones.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct OperatorFamily {
    /// The coefficients that are evaluated.
    pub points: Vec<usize>,
    /// The operator that each evaluated coefficient multiplies; single precision suffices, and halves the bytes to
    /// read and to move.
    operators: Vec<DMatrix<f32>>,
}

impl OperatorFamily {
    /// A family from sampled coefficients (a row per member, a column per state). `operator` sums the members' operators with given
    /// weights. Coefficients that differ from a combination of the evaluated ones by less than `cutoff` of the largest are not evaluated.
    pub fn new(samples: &DMatrix<f64>, cutoff: f64, operator: impl Fn(&[f64]) -> DMatrix<f64> + Sync) -> Self {
        Self::told(samples, samples, cutoff, operator)
    }

    /// A family of members whose coefficients `samples` follow other coefficients `by`; some of the latter are
    /// evaluated in their place.
    pub fn told(by: &DMatrix<f64>, samples: &DMatrix<f64>, cutoff: f64, operator: impl Fn(&[f64]) -> DMatrix<f64> + Sync) -> Self {
        // Greedy choice: the row with the largest remainder, one after the other.
        let mut left = by.clone();
        let mut points = Vec::new();
        let mut directions: Vec<RowDVector<f64>> = Vec::new();
        let mut largest = 0.0;
        while points.len() < MOST.min(by.nrows()) {
            let norms = DVector::from_iterator(left.nrows(), left.row_iter().map(|row| row.norm()));
            let point = norms.imax();
            largest = f64::max(largest, norms[point]);
            if norms[point] <= cutoff * largest {
                break;
            }
            let direction = left.row(point) / norms[point];
            let along = &left * direction.transpose();
            left.ger(-1.0, &along, &direction.transpose(), 1.0);
            points.push(point);
            directions.push(direction);
        }
        if points.is_empty() {
            return Self { points, operators: Vec::new() };
        }
        let directions = DMatrix::from_rows(&directions).transpose();
        let Some(inverse) = (by.select_rows(&points) * &directions).try_inverse() else {
            return Self { points: Vec::new(), operators: Vec::new() };
        };
        let weights = samples * directions * inverse;
        let columns: Vec<_> = weights.column_iter().collect();
        let operators = columns.par_iter().map(|column| operator(column.as_slice()).map(|o| o as f32)).collect();
        Self { points, operators }
    }

    /// A family of which all `count` members are evaluated.
    pub(super) fn every(count: usize, operator: impl Fn(&[f64]) -> DMatrix<f64>) -> Self {
        let of = |own: usize| operator(&(0..count).map(|k| if k == own { 1.0 } else { 0.0 }).collect::<Vec<_>>()).map(|o| o as f32);
        Self { points: (0..count).collect(), operators: (0..count).map(of).collect() }
    }

    /// Whether the family has an operator of this shape for each point, or none at all.
    pub(super) fn is_of(&self, shape: (usize, usize)) -> bool {
        (self.operators.is_empty() || self.operators.len() == self.points.len()) && self.operators.iter().all(|o| o.shape() == shape)
    }

    /// Adds the operator at the coefficients of [`OperatorFamily::points`].
    pub fn add(&self, coefficients: impl Iterator<Item = f64>, to: &mut DMatrix<f64>) {
        for (operator, c) in self.operators.iter().zip(coefficients) {
            // Slices, because the compiler does not vectorise the sum of two matrices entry by entry.
            to.as_mut_slice().iter_mut().zip(operator.as_slice()).for_each(|(own, o)| *own += c * f64::from(*o));
        }
    }
}
