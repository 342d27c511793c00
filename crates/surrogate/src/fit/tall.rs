//! Least squares on many rows.
//!
//! The columns are made block by block of rows, and kept are their products alone: the time is proportional to the rows, the
//! memory does not depend on them.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixViewMut};
use rayon::prelude::*;

use super::dense::inverse_factor;

/// Rows whose columns are in memory together, a count. Chosen: matrix products pay for large blocks, 2000 columns of as
/// many rows take 33 MB.
const BLOCK: usize = 2048;
/// Rows of a block that one thread makes at a time, a count. Chosen: enough for a fast matrix product.
const PIECE: usize = 256;
/// Columns of the products that one thread makes at a time, a count. Chosen for the same reason.
const STRIP: usize = 128;
/// Least share of a row that the others must leave undetermined for its left-out residual: below, rounding decides.
const UNDETERMINED: f64 = 1e-9;

/// Columns of many rows: those of `block`, turned by `turn`.
pub(super) struct Tall<'a> {
    /// Number of rows.
    pub rows: usize,
    /// Columns as they are evaluated, on a range of rows.
    pub block: &'a (dyn Fn(Range<usize>) -> DMatrix<f64> + Sync),
    /// The columns that coefficients are sought of are B T with B the columns of `block`; without T they are B.
    pub turn: Option<&'a DMatrix<f64>>,
}

/// Products of the turned columns X with themselves and with outputs Y.
pub(super) struct Products {
    /// Lower triangle of XᵀX.
    square: DMatrix<f64>,
    /// XᵀY.
    values: DMatrix<f64>,
}

/// Coefficients and left-out residuals, one list of each per output.
pub(super) struct TallSolution {
    /// Coefficients of the columns of the block.
    pub coefficients: Vec<Vec<f64>>,
    /// Leave-one-out residuals e_i / (1 - h_i).
    pub left_out: Vec<Vec<f64>>,
}

impl Tall<'_> {
    /// XᵀX and XᵀY, summed in an order that does not depend on the number of threads.
    pub fn products(&self, outputs: &[Vec<f64>]) -> Products {
        let width = self.turn.map(|turn| turn.ncols());
        let mut found: Option<Products> = None;
        for block in ranges(0..self.rows, BLOCK) {
            let pieces: Vec<DMatrix<f64>> = ranges(block.clone(), PIECE)
                .into_par_iter()
                .map(|piece| {
                    let own = (self.block)(piece);
                    self.turn.map_or_else(|| own.transpose(), |turn| (&own * turn).transpose())
                })
                .collect();
            // Rows of the table are columns here, so that pieces stand one behind the other.
            let width = width.unwrap_or_else(|| pieces[0].nrows());
            let numbers: Vec<f64> = pieces.into_iter().flat_map(|piece| piece.as_slice().to_vec()).collect();
            let across = DMatrix::from_vec(width, block.len(), numbers);
            let down = across.transpose();
            let sums = found
                .get_or_insert_with(|| Products { square: DMatrix::zeros(width, width), values: DMatrix::zeros(width, outputs.len()) });
            sums.square.as_mut_slice().par_chunks_mut(width * STRIP).enumerate().for_each(|(strip, numbers)| {
                let (first, count) = (strip * STRIP, numbers.len() / width);
                let mut strip = DMatrixViewMut::from_slice(numbers, width, count);
                let below = &mut strip.rows_mut(first, width - first);
                below.gemm(1.0, &across.rows(first, width - first), &down.columns(first, count), 1.0);
            });
            sums.values.gemm(1.0, &across, &outputs_on(outputs, block), 1.0);
        }
        found.unwrap_or_else(|| Products { square: DMatrix::zeros(0, 0), values: DMatrix::zeros(0, outputs.len()) })
    }

    /// Least squares with `penalty` added to the diagonal of XᵀX. Coefficients from products lose half of the digits; one
    /// step of refinement by the residuals themselves gives most of them back. `None` where the columns depend on each other.
    pub fn solve(&self, products: &Products, penalty: &[f64], outputs: &[Vec<f64>]) -> Option<TallSolution> {
        let mut square = products.square.clone();
        penalty.iter().enumerate().for_each(|(i, penalty)| square[(i, i)] += penalty);
        let factor = inverse_factor(square, &mut 0.0)?;
        let back = factor.transpose();
        let solved = |right: &DMatrix<f64>| &back * (&factor * right);
        let turned = |z: &DMatrix<f64>| self.turn.map_or_else(|| z.clone(), |turn| turn * z);
        let mut z = solved(&products.values);
        let (_, mut gradient) = self.residuals(&turned(&z), outputs);
        if let Some(turn) = self.turn {
            gradient = turn.transpose() * gradient;
        }
        for (mut gradient, z) in gradient.column_iter_mut().zip(z.column_iter()) {
            gradient.iter_mut().zip(&z).zip(penalty).for_each(|((g, z), penalty)| *g -= penalty * z);
        }
        z += solved(&gradient);
        let coefficients = turned(&z);
        let (residuals, _) = self.residuals(&coefficients, outputs);
        let leverages = self.leverages(&turned(&back));
        let left_out = |e: &Vec<f64>| e.iter().zip(&leverages).map(|(e, h)| e / (1.0 - h).max(UNDETERMINED)).collect();
        Some(TallSolution {
            left_out: residuals.iter().map(left_out).collect(),
            coefficients: coefficients.column_iter().map(|column| column.iter().copied().collect()).collect(),
        })
    }

    /// Residuals of the outputs, and BᵀR of them.
    fn residuals(&self, coefficients: &DMatrix<f64>, outputs: &[Vec<f64>]) -> (Vec<Vec<f64>>, DMatrix<f64>) {
        let mut residuals: Vec<Vec<f64>> = vec![Vec::with_capacity(self.rows); outputs.len()];
        let mut gradient = DMatrix::zeros(coefficients.nrows(), outputs.len());
        for block in ranges(0..self.rows, BLOCK) {
            let of_piece = |piece: Range<usize>| {
                let columns = (self.block)(piece.clone());
                let rest = outputs_on(outputs, piece) - &columns * coefficients;
                let gradient = columns.transpose() * &rest;
                (rest, gradient)
            };
            let pieces: Vec<_> = ranges(block, PIECE).into_par_iter().map(of_piece).collect();
            for (rest, own) in pieces {
                gradient += own;
                residuals.iter_mut().zip(rest.column_iter()).for_each(|(all, rest)| all.extend(rest.iter()));
            }
        }
        (residuals, gradient)
    }

    /// Diagonal of the hat matrix: squared rows of B W, where W turns the columns so that they are orthonormal but for the penalty.
    fn leverages(&self, orthonormal: &DMatrix<f64>) -> Vec<f64> {
        let of_piece =
            |piece: Range<usize>| -> Vec<f64> { ((self.block)(piece) * orthonormal).row_iter().map(|row| row.norm_squared()).collect() };
        ranges(0..self.rows, PIECE).into_par_iter().flat_map_iter(of_piece).collect()
    }
}

fn outputs_on(outputs: &[Vec<f64>], rows: Range<usize>) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), outputs.len(), |i, o| outputs[o][rows.start + i])
}

/// A range cut into parts of `most` and a rest.
fn ranges(all: Range<usize>, most: usize) -> Vec<Range<usize>> {
    all.clone().step_by(most).map(|start| start..(start + most).min(all.end)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::least_squares::least_squares;

    /// Coefficients and left-out residuals of a table of several blocks are those of orthonormalised columns.
    #[test]
    fn blocks_solve_what_all_rows_at_once_do() {
        let rows = 2 * BLOCK + 300;
        let place = |i: usize| 2.0 * (i as f64 + 0.5) / rows as f64 - 1.0;
        let column = |i: usize, k: usize| (k as f64 * place(i).acos()).cos();
        let y: Vec<f64> = (0..rows).map(|i| (3.0 * place(i)).exp() + 0.1 * ((i * i) as f64).sin()).collect();
        let block = |piece: Range<usize>| DMatrix::from_fn(piece.len(), 9, |i, k| column(piece.start + i, k));
        let turn = DMatrix::from_fn(9, 9, |i, j| if i == j { 2.0 } else { 1.0 / (1.0 + (i + 2 * j) as f64) });
        let columns: Vec<Vec<f64>> = (0..9).map(|k| (0..rows).map(|i| column(i, k)).collect()).collect();
        let wanted = least_squares(&columns, &y).unwrap();
        let outputs = [y.clone(), y.iter().map(|y| -2.0 * y).collect()];
        for turn in [None, Some(&turn)] {
            let tall = Tall { rows, block: &block, turn };
            let found = tall.solve(&tall.products(&outputs), &[0.0; 9], &outputs).unwrap();
            for (o, factor) in [1.0, -2.0].into_iter().enumerate() {
                for (c, wanted) in found.coefficients[o].iter().zip(&wanted.coefficients) {
                    assert!((c - factor * wanted).abs() < 1e-12, "{c} {wanted}");
                }
                for (e, wanted) in found.left_out[o].iter().zip(&wanted.left_out) {
                    assert!((e - factor * wanted).abs() < 1e-11, "{e} {wanted}");
                }
            }
        }
    }

    /// With a penalty P, c solves (XᵀX + P) c = Xᵀy, and a left-out residual is that of a solution without the row.
    #[test]
    fn penalised_residuals_left_out_are_those_of_refitting() {
        let column = |i: usize, k: usize| ((i + 1) as f64 * 0.37 * (k + 1) as f64).sin();
        let y: Vec<f64> = (0..40).map(|i| (i as f64 * 0.2).cos()).collect();
        let penalty = [0.5, 0.0, 2.0];
        let solve = |kept: &[usize]| {
            let block = |piece: Range<usize>| DMatrix::from_fn(piece.len(), 3, |i, k| column(kept[piece.start + i], k));
            let outputs = [kept.iter().map(|i| y[*i]).collect::<Vec<f64>>()];
            let tall = Tall { rows: kept.len(), block: &block, turn: None };
            tall.solve(&tall.products(&outputs), &penalty, &outputs).unwrap()
        };
        let all: Vec<usize> = (0..40).collect();
        let found = solve(&all);
        for (left, reading) in y.iter().enumerate() {
            let others: Vec<usize> = all.iter().copied().filter(|i| *i != left).collect();
            let value: f64 = solve(&others).coefficients[0].iter().enumerate().map(|(k, c)| c * column(left, k)).sum();
            assert!((found.left_out[0][left] - (reading - value)).abs() < 1e-12);
        }
    }
}
