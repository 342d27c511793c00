//! The covariance of a table's readings without any cause, row by row.
//!
//! Readings of one row share errors that no other row has: those of the condition, and the disturbance, a heat in every part that is new in
//! every row. All rows share biases of sensors and numbers of the machine. The covariance is D + U V Uᵀ with D in one block per row and few
//! columns U, so that nothing larger than a row or a column is ever factored.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};
use coldplate_base::numbers::significant;
use serde::Serialize;
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
}

/// What a model leaves open beside its causes, as the data have it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Looseness {
    /// Standard deviation of the logarithm of every number of the machine.
    pub spread: f64,
    /// Standard deviation of a heat in every part, new in every row, as a share of the machine's mean heat.
    pub disturbance: f64,
}

impl Looseness {
    /// In words; empty where nothing is left open.
    pub fn in_words(&self) -> String {
        let percent = |share: f64| significant(100.0 * share, 2);
        let numbers = (self.spread > 0.0).then(|| format!("numbers of the machine file off by {} %", percent(self.spread)));
        let heats = (self.disturbance > 0.0)
            .then(|| format!("heats in every part, new in every row, of {} % of the machine's heat", percent(self.disturbance)));
        numbers.into_iter().chain(heats).collect::<Vec<_>>().join("; ")
    }
}

/// Readings whitened by what belongs to their own row, with the columns that all rows share.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Readings of each row.
    pub ranges: Vec<Range<usize>>,
    factors: Vec<Cholesky<f64, Dyn>>,
    /// Shared columns, whitened: stated ones, then numbers.
    pub shared: DMatrix<f64>,
    /// Place of each of them among [`Errors::stated`] and, behind these, [`Errors::numbers`].
    pub of: Vec<usize>,
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
        let mut shared: Vec<(usize, &Vec<f64>)> = Vec::new();
        let mut local: Vec<(usize, &Vec<f64>)> = Vec::new();
        for (place, column) in errors.stated.iter().enumerate() {
            match own_row(column) {
                Some(Some(row)) => local.push((row, column)),
                Some(None) => shared.push((place, column)),
                None => {}
            }
        }
        let stated = shared.len();
        let numbers = errors.numbers.iter().enumerate().filter(|(_, column)| own_row(column).is_some());
        shared.extend(numbers.map(|(k, column)| (errors.stated.len() + k, column)));
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
        let of = shared.iter().map(|(place, _)| *place).collect();
        let (none, gram) = (DMatrix::zeros(errors.row_of.len(), 0), DMatrix::zeros(0, 0));
        let mut all = Self { ranges, factors, shared: none, of, gram, stated, log_determinant };
        let mut whitened = DMatrix::zeros(errors.row_of.len(), shared.len());
        shared.iter().enumerate().for_each(|(k, (_, column))| whitened.set_column(k, &all.whiten(column)));
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

    /// Logarithm of the determinant of the root of a row's block, K for each reading.
    pub fn log_of_row(&self, row: usize) -> f64 {
        self.factors[row].l_dirty().diagonal().iter().map(|d| d.ln()).sum()
    }

    /// Logarithm of the determinant of all blocks, K² for each reading.
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Standard deviation of each shared column's coefficient.
    pub fn deviations(&self, spread: f64) -> DVector<f64> {
        DVector::from_fn(self.shared.ncols(), |k, _| if k < self.stated { 1.0 } else { spread })
    }

    /// The whole covariance where every number of the machine is off by a spread.
    pub fn metric(&self, spread: f64) -> Metric<'_> {
        let mut columns = self.shared.clone();
        columns.column_iter_mut().zip(&self.deviations(spread)).for_each(|(mut column, d)| column *= *d);
        let eigen = SymmetricEigen::new(columns.tr_mul(&columns));
        // The inverse root of I + UU' is I - U Q f(l) Q' U', where U'U = Q l Q'.
        let of = |l: f64| if l > 1e-12 { (1.0 - (1.0 + l).sqrt().recip()) / l } else { 0.5 };
        let mut scaled = eigen.eigenvectors.clone();
        scaled.column_iter_mut().zip(&eigen.eigenvalues).for_each(|(mut column, l)| column *= of(*l));
        Metric { rows: self, root: scaled * eigen.eigenvectors.transpose(), columns }
    }
}

/// The inverse of a covariance, as an inverse root.
pub struct Metric<'a> {
    rows: &'a Rows,
    columns: DMatrix<f64>,
    root: DMatrix<f64>,
}

impl Metric<'_> {
    /// Readings (K) in standard deviations, uncorrelated.
    pub fn whitened(&self, readings: &[f64]) -> DVector<f64> {
        let own = self.rows.whiten(readings);
        let along = &self.root * self.columns.tr_mul(&own);
        own - &self.columns * along
    }

    /// Sum of the squares of readings (K) in standard deviations.
    pub fn square(&self, readings: &[f64]) -> f64 {
        self.whitened(readings).norm_squared()
    }
}
