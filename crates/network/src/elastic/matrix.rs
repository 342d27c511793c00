//! A symmetric matrix of 3 x 3 blocks, a row of blocks for each node.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Rows below which one thread is as fast, a count. Chosen.
const CHUNK: usize = 1024;

/// Stiffness of a structure, N/m. Rows of held directions are those of the unit matrix.
#[derive(Debug, Clone)]
pub(crate) struct Matrix {
    /// First block of each node's row, and one past the last.
    starts: Vec<usize>,
    /// Node of each block, ascending in a row.
    columns: Vec<u32>,
    blocks: Vec<Matrix3<f64>>,
    /// Inverses of the diagonal blocks.
    inverse: Vec<Matrix3<f64>>,
}

/// A vector with three entries for each node.
pub(crate) type NodeVectors = Vec<Vector3<f64>>;

impl Matrix {
    /// A zero matrix in which the nodes of every group are coupled.
    pub fn coupling<'a>(nodes: usize, groups: impl Iterator<Item = &'a [u32]>) -> Self {
        let mut rows: Vec<Vec<u32>> = (0..nodes).map(|n| vec![n as u32]).collect();
        for group in groups {
            for node in group {
                rows[*node as usize].extend_from_slice(group);
                let row = &mut rows[*node as usize];
                // Often enough that no row grows long, seldom enough that sorting costs little.
                if row.len() > 256 {
                    row.sort_unstable();
                    row.dedup();
                }
            }
        }
        rows.par_iter_mut().for_each(|row| {
            row.sort_unstable();
            row.dedup();
        });
        let mut starts = vec![0];
        starts.extend(rows.iter().scan(0, |sum, row| {
            *sum += row.len();
            Some(*sum)
        }));
        let columns: Vec<u32> = rows.into_iter().flatten().collect();
        let blocks = vec![Matrix3::zeros(); columns.len()];
        Self { starts, columns, blocks, inverse: Vec::new() }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Adds to the block of two coupled nodes.
    pub fn add(&mut self, row: u32, column: u32, block: Matrix3<f64>) {
        let own = self.starts[row as usize]..self.starts[row as usize + 1];
        if let Ok(at) = self.columns[own.clone()].binary_search(&column) {
            self.blocks[own.start + at] += block;
        }
    }

    /// Holds directions of nodes: their rows and columns become those of the unit matrix.
    pub fn hold(&mut self, held: &[[bool; 3]]) {
        for row in 0..self.len() {
            for at in self.starts[row]..self.starts[row + 1] {
                let column = self.columns[at] as usize;
                for (i, j) in (0..9).map(|e| (e % 3, e / 3)) {
                    if held[row][i] || held[column][j] {
                        self.blocks[at][(i, j)] = if row == column && i == j { 1.0 } else { 0.0 };
                    }
                }
            }
        }
    }

    /// Inverts the diagonal; `None` where a node is stiff in no direction.
    #[must_use]
    pub fn finished(mut self) -> Option<Self> {
        let of = |row: usize| self.row(row).find(|(column, _)| *column == row).and_then(|(_, block)| block.try_inverse());
        self.inverse = (0..self.len()).map(of).collect::<Option<_>>()?;
        Some(self)
    }

    /// Blocks of a row with their columns.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, &Matrix3<f64>)> {
        let own = self.starts[row]..self.starts[row + 1];
        self.columns[own.clone()].iter().map(|c| *c as usize).zip(&self.blocks[own])
    }

    /// y = b - A x
    pub fn residual(&self, x: &NodeVectors, b: &NodeVectors, y: &mut NodeVectors) {
        y.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(row, y)| {
            *y = self.row(row).fold(b[row], |sum, (column, block)| sum - block * x[column]);
        });
    }

    /// y = A x
    pub fn multiply(&self, x: &NodeVectors, y: &mut NodeVectors) {
        y.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(row, y)| {
            *y = self.row(row).fold(Vector3::zeros(), |sum, (column, block)| sum + block * x[column]);
        });
    }

    /// One sweep of Gauss and Seidel for A x = b, by nodes, forwards or backwards.
    pub fn sweep(&self, x: &mut NodeVectors, b: &NodeVectors, forwards: bool) {
        let mut relax = |row: usize| {
            let left = self.row(row).filter(|(column, _)| *column != row).fold(b[row], |sum, (column, block)| sum - block * x[column]);
            x[row] = self.inverse[row] * left;
        };
        if forwards { (0..self.len()).for_each(&mut relax) } else { (0..self.len()).rev().for_each(relax) }
    }
}
