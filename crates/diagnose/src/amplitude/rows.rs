//! The covariance of a table's readings without any cause, row by row.
//!
//! Readings of one row share errors that no other row has: those of the condition, and the disturbance, a heat in every part that is new in
//! every row. All rows share biases of sensors and numbers of the machine. The covariance is D + U V Uᵀ with D in one block per row and few
//! columns U, so that nothing larger than a row or a column is ever factored.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::ops::Range;

/// Errors of the readings of a table, K.
#[derive(Debug, Clone)]
pub struct Errors {
    /// Row of every reading, rising.
    pub row_of: Vec<usize>,
    /// Standard deviation of the noise of every reading, K.
    pub noise: Vec<f64>,
    /// Errors of unit variance that readings share, one column each, K.
    pub stated: Vec<Vec<f64>>,
    /// Change of every reading with the logarithm of each number of the machine, K.
    pub numbers: Vec<Vec<f64>>,
    /// Change of every reading with a heat in each part as large as the machine's mean heat, K: the disturbance has its own in every row.
    pub heats: Vec<Vec<f64>>,
    /// Readings that are grossly wrong, rising: their noise is wide, and their residual says nothing.
    pub aside: Vec<usize>,
}

/// The size of what is learnt about a model that has no cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Looseness {
    /// Standard deviation of the logarithm of every number of the machine.
    pub spread: f64,
    /// Standard deviation of a heat in every part, new in every row, as a share of the machine's mean heat.
    pub disturbance: f64,
}

/// Readings whitened by what belongs to their own row, with the columns that all rows share.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Readings of each row.
    pub ranges: Vec<Range<usize>>,
    factors: Vec<Cholesky<f64, Dyn>>,
    /// Shared columns, whitened: stated ones, then numbers.
    pub shared: DMatrix<f64>,
    gram: DMatrix<f64>,
    stated: usize,
    log_determinant: f64,
}

/// Rows of rising row numbers as ranges.
fn ranges(row_of: &[usize]) -> Vec<Range<usize>> {
    let mut all: Vec<Range<usize>> = Vec::new();
    for (i, row) in row_of.iter().enumerate() {
        match all.last_mut() {
            Some(range) if row_of[range.start] == *row => range.end = i + 1,
            _ => all.push(i..i + 1),
        }
    }
    all
}

impl Rows {
    /// The rows under a disturbance of a size; `None` where a block is not positive, for lack of noise.
    pub fn new(errors: &Errors, disturbance: f64) -> Option<Self> {
        let ranges = ranges(&errors.row_of);
        // A column that acts in one row alone belongs to that row's block.
        let own_row = |column: &Vec<f64>| -> Option<Option<usize>> {
            let mut acting = column.iter().enumerate().filter(|(_, c)| **c != 0.0).map(|(i, _)| errors.row_of[i]);
            let first = acting.next()?;
            Some(acting.all(|row| row == first).then_some(first))
        };
        let mut shared: Vec<&Vec<f64>> = Vec::new();
        let mut local: Vec<(usize, &Vec<f64>)> = Vec::new();
        for column in &errors.stated {
            match own_row(column) {
                Some(Some(row)) => local.push((row, column)),
                Some(None) => shared.push(column),
                None => {}
            }
        }
        let stated = shared.len();
        shared.extend(errors.numbers.iter().filter(|column| own_row(column).is_some()));
        let mut factors = Vec::with_capacity(ranges.len());
        for range in &ranges {
            let size = range.len();
            let mut block = DMatrix::from_diagonal(&DVector::from_iterator(size, errors.noise[range.clone()].iter().map(|n| n * n)));
            let mut add = |column: &[f64], scale: f64| {
                let own = DVector::from_column_slice(&column[range.clone()]);
                block.ger(scale * scale, &own, &own, 1.0);
            };
            let row = errors.row_of[range.start];
            local.iter().filter(|(own, _)| *own == row).for_each(|(_, column)| add(column, 1.0));
            if disturbance > 0.0 {
                errors.heats.iter().for_each(|column| add(column, disturbance));
            }
            factors.push(Cholesky::new(block)?);
        }
        let log_determinant = factors.iter().map(|f| 2.0 * f.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()).sum();
        let mut all =
            Self { ranges, factors, shared: DMatrix::zeros(errors.row_of.len(), 0), gram: DMatrix::zeros(0, 0), stated, log_determinant };
        let mut whitened = DMatrix::zeros(errors.row_of.len(), shared.len());
        shared.iter().enumerate().for_each(|(k, column)| whitened.set_column(k, &all.whiten(column)));
        all.gram = whitened.tr_mul(&whitened);
        all.shared = whitened;
        Some(all)
    }

    /// Readings (K) whitened by the block of their row.
    pub fn whiten(&self, readings: &[f64]) -> DVector<f64> {
        let mut whitened = DVector::from_column_slice(readings);
        for (range, factor) in self.ranges.iter().zip(&self.factors) {
            let mut own = whitened.rows_range_mut(range.clone());
            factor.l_dirty().solve_lower_triangular_mut(&mut own);
        }
        whitened
    }

    /// Scalar products of the shared columns.
    pub fn gram(&self) -> &DMatrix<f64> {
        &self.gram
    }

    /// Columns that are whitened by the blocks of all rows, multiplied by the transposed root of the inverse of these: S⁻¹ of columns is this
    /// of their whitened ones.
    pub fn unwhiten(&self, whitened: &DMatrix<f64>) -> DMatrix<f64> {
        let mut found = whitened.clone();
        for (range, factor) in self.ranges.iter().zip(&self.factors) {
            let mut own = found.rows_range_mut(range.clone());
            factor.l_dirty().tr_solve_lower_triangular_mut(&mut own);
        }
        found
    }

    /// A whitened precision of a row's readings as that of the readings themselves, 1/K².
    pub fn unwhiten_row(&self, row: usize, mut precision: DMatrix<f64>) -> DMatrix<f64> {
        let factor = self.factors[row].l_dirty();
        factor.tr_solve_lower_triangular_mut(&mut precision);
        precision.transpose_mut();
        factor.tr_solve_lower_triangular_mut(&mut precision);
        precision
    }

    /// Logarithm of the determinant of all blocks, K² for each reading.
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Standard deviation of each shared column's coefficient.
    pub fn deviations(&self, spread: f64) -> DVector<f64> {
        DVector::from_fn(self.shared.ncols(), |k, _| if k < self.stated { 1.0 } else { spread })
    }
}
