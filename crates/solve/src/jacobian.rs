//! The linearised network: change of every node's residual with small changes of the temperatures.
//!
//! Structured blocks act through their tables, with differences formed first; everything else (contacts,
//! radiative links, water) stands in a short list of sparse rows. A product moves the two vectors and
//! little more: about 24 bytes per unknown, where compressed rows would move a hundred.

use rayon::prelude::*;

use super::csr::for_chunks;
use coldplate_network::Network;
use coldplate_network::block::{BlockReal, FaceCoefficients};

/// Derivatives of the residual with respect to all temperatures, W/K.
#[derive(Debug, Clone)]
pub struct Jacobian<'a> {
    network: &'a Network,
    /// Conduction in each block of the network.
    pub(super) blocks: Vec<Conduction>,
    /// Coefficient of each node's own temperature, conduction in blocks left out.
    pub(super) diagonal: Vec<f64>,
    /// Coefficients of other nodes' temperatures, conduction in blocks left out.
    pub(super) rest: SparseRows<f64>,
    is_transposed: bool,
}

/// Linearised conduction in a block.
#[derive(Debug, Clone)]
pub(super) enum Conduction {
    /// Constant conductivity: heat is g times the difference.
    Constant(FaceCoefficients<f64>),
    /// Conductivity that changes with temperature: derivatives of the heat from a cell to the next one, W/K, by axis and cell.
    Varying {
        /// With respect to the cell's own temperature.
        out: [Vec<f64>; 3],
        /// With respect to the next cell's temperature, sign turned.
        into: [Vec<f64>; 3],
    },
}

impl<'a> Jacobian<'a> {
    pub(super) fn new(network: &'a Network, blocks: Vec<Conduction>, diagonal: Vec<f64>, rest: SparseRows<f64>) -> Self {
        Self { network, blocks, diagonal, rest, is_transposed: false }
    }

    /// Number of unknowns.
    pub fn rows(&self) -> usize {
        self.diagonal.len()
    }

    /// y = J x
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        for_chunks(y, |first, part| {
            self.product(first, x, part);
        });
    }

    /// Adds to the coefficient of each of the first nodes' own temperature, for example capacity over time step, W/K.
    pub fn add_diagonal(&mut self, values: impl Iterator<Item = f64>) {
        self.diagonal.iter_mut().zip(values).for_each(|(d, v)| *d += v);
    }

    /// The transposed operator.
    pub(crate) fn transposed(&self) -> Self {
        Self { rest: self.rest.transposed(self.rows()), is_transposed: !self.is_transposed, ..self.clone() }
    }

    /// The rows of J x from `first` on.
    pub(super) fn product(&self, first: usize, x: &[f64], part: &mut [f64]) {
        let range = first..first + part.len();
        part.iter_mut().zip(&self.diagonal[range.clone()]).zip(&x[range.clone()]).for_each(|((y, d), x)| *y = d * x);
        for (block, conduction) in self.network.blocks.iter().zip(&self.blocks) {
            let (out, into) = match conduction {
                Conduction::Constant(profile) => {
                    block.add_conduction(profile, first, x, part);
                    continue;
                }
                Conduction::Varying { out, into } => (out, into),
            };
            for segment in block.segments(range.clone()) {
                let y = &mut part[segment.node - first..][..segment.along.len()];
                segment.each_face(block.cells[0], |at, d, other, is_next, _| {
                    let node = segment.node + at;
                    let (xi, xj) = (x[node], x[other]);
                    y[at] += match (is_next, self.is_transposed) {
                        (true, false) => out[d][node - block.first] * xi - into[d][node - block.first] * xj,
                        (false, false) => into[d][other - block.first] * xi - out[d][other - block.first] * xj,
                        (true, true) => out[d][node - block.first] * (xi - xj),
                        (false, true) => into[d][other - block.first] * (xi - xj),
                    };
                });
            }
        }
        self.rest.add_product(first, x, part);
    }
}

/// Sparse rows of which most are empty: off-diagonal entries by row.
#[derive(Debug, Clone, Default)]
pub(super) struct SparseRows<T> {
    /// Rows that have entries, ascending.
    pub rows: Vec<u32>,
    /// Start of each row in `cols`, and the end of the last.
    pub starts: Vec<usize>,
    /// Columns, ascending within a row.
    pub cols: Vec<u32>,
    /// Values.
    pub values: Vec<T>,
}

impl<T: BlockReal> SparseRows<T> {
    /// The pattern that holds a set of (row, column) entries, with zero values.
    pub fn pattern(mut entries: Vec<(u32, u32)>) -> Self {
        entries.par_sort_unstable();
        entries.dedup();
        let mut found = Self { rows: Vec::new(), starts: Vec::new(), cols: Vec::with_capacity(entries.len()), values: Vec::new() };
        for (row, column) in entries {
            if found.rows.last() != Some(&row) {
                found.rows.push(row);
                found.starts.push(found.cols.len());
            }
            found.cols.push(column);
        }
        found.starts.push(found.cols.len());
        found.values = vec![T::default(); found.cols.len()];
        found
    }

    /// Place of an entry of the pattern, or `None`.
    pub fn position(&self, row: u32, column: u32) -> Option<usize> {
        let r = self.rows.binary_search(&row).ok()?;
        let range = self.starts[r]..self.starts[r + 1];
        self.cols[range.clone()].binary_search(&column).ok().map(|at| range.start + at)
    }

    /// The rows of entries (row, column, value); entries at one place add up.
    pub(crate) fn of_entries(mut entries: Vec<(u32, u32, T)>) -> Self {
        entries.par_sort_by_key(|(row, column, _)| (*row, *column));
        let mut found = Self { rows: Vec::new(), starts: Vec::new(), cols: Vec::with_capacity(entries.len()), values: Vec::new() };
        let mut last = None;
        for (row, column, value) in entries {
            match found.values.last_mut() {
                Some(sum) if last == Some((row, column)) => *sum += value,
                _ => {
                    if found.rows.last() != Some(&row) {
                        found.rows.push(row);
                        found.starts.push(found.cols.len());
                    }
                    found.cols.push(column);
                    found.values.push(value);
                }
            }
            last = Some((row, column));
        }
        found.starts.push(found.cols.len());
        found
    }

    /// Entries of every row: row, columns and values.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &[u32], &[T])> {
        let bounds = self.starts.windows(2);
        self.rows.iter().zip(bounds).map(|(row, w)| (*row, &self.cols[w[0]..w[1]], &self.values[w[0]..w[1]]))
    }

    /// Adds the product with `x` to `part`, the rows from `first` on.
    pub fn add_product(&self, first: usize, x: &[T], part: &mut [T]) {
        let from = self.rows.partition_point(|r| (*r as usize) < first);
        for (row, bounds) in self.rows[from..].iter().zip(self.starts[from..].windows(2)) {
            let Some(y) = part.get_mut(*row as usize - first) else { break };
            for (c, v) in self.cols[bounds[0]..bounds[1]].iter().zip(&self.values[bounds[0]..bounds[1]]) {
                *y += *v * x[*c as usize];
            }
        }
    }

    /// The transpose, of a square matrix of `n` rows.
    fn transposed(&self, n: usize) -> Self {
        let mut starts = vec![0usize; n + 1];
        for c in &self.cols {
            starts[*c as usize + 1] += 1;
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let (mut cols, mut values) = (vec![0u32; self.cols.len()], vec![T::default(); self.cols.len()]);
        for (row, row_cols, row_values) in self.iter() {
            for (c, v) in row_cols.iter().zip(row_values) {
                let at = next[*c as usize];
                next[*c as usize] += 1;
                (cols[at], values[at]) = (row, *v);
            }
        }
        let rows: Vec<u32> = (0..n as u32).filter(|i| starts[*i as usize + 1] > starts[*i as usize]).collect();
        let mut kept: Vec<usize> = rows.iter().map(|i| starts[*i as usize]).collect();
        kept.push(self.cols.len());
        Self { rows, starts: kept, cols, values }
    }
}
