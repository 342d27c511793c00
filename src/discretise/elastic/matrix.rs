//! A symmetric matrix of 3 x 3 blocks, a row of blocks for each node.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Rows below which one thread is as fast.
const CHUNK: usize = 1024;

/// Stiffness of a structure, N/m. Rows of held directions are those of the unit matrix.
#[derive(Debug, Clone)]
pub struct Matrix {
    /// First block of each node's row, and one past the last.
    starts: Vec<usize>,
    /// Node of each block, ascending in a row.
    columns: Vec<u32>,
    blocks: Vec<Matrix3<f64>>,
    /// Inverses of the diagonal blocks.
    inverse: Vec<Matrix3<f64>>,
    /// Where the diagonal block of each row is.
    diagonal: Vec<usize>,
}

/// A vector with three entries for each node.
pub type Field = Vec<Vector3<f64>>;

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
        Self { starts, columns, blocks, inverse: Vec::new(), diagonal: Vec::new() }
    }

    /// Nodes.
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
        let place = |row: usize| (self.starts[row]..self.starts[row + 1]).find(|at| self.columns[*at] as usize == row);
        self.diagonal = (0..self.len()).map(place).collect::<Option<_>>()?;
        self.inverse = self.diagonal.iter().map(|at| self.blocks[*at].try_inverse()).collect::<Option<_>>()?;
        Some(self)
    }

    /// Blocks of a row with their columns.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, &Matrix3<f64>)> {
        self.blocks(self.starts[row]..self.starts[row + 1])
    }

    fn blocks(&self, own: std::ops::Range<usize>) -> impl Iterator<Item = (usize, &Matrix3<f64>)> {
        self.columns[own.clone()].iter().map(|c| *c as usize).zip(&self.blocks[own])
    }

    /// y = A x
    pub fn multiply(&self, x: &Field, y: &mut Field) {
        y.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(row, y)| {
            *y = self.row(row).fold(Vector3::zeros(), |sum, (column, block)| sum + block * x[column]);
        });
    }

    /// One forward sweep of Gauss and Seidel by nodes for A x = b that begins with zeros, and what it leaves of b: each reads half of
    /// the matrix, whose size is what the time goes into.
    pub fn first_sweep(&self, x: &mut Field, b: &Field, left: &mut Field) {
        for row in 0..self.len() {
            let below = self.blocks(self.starts[row]..self.diagonal[row]);
            x[row] = self.inverse[row] * below.fold(b[row], |sum, (column, block)| sum - block * x[column]);
        }
        left.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(row, left)| {
            let above = self.blocks(self.diagonal[row] + 1..self.starts[row + 1]);
            *left = above.fold(Vector3::zeros(), |sum, (column, block)| sum - block * x[column]);
        });
    }

    /// One backward sweep for A x = b.
    pub fn last_sweep(&self, x: &mut Field, b: &Field) {
        for row in (0..self.len()).rev() {
            let beside = self.blocks(self.starts[row]..self.diagonal[row]).chain(self.blocks(self.diagonal[row] + 1..self.starts[row + 1]));
            x[row] = self.inverse[row] * beside.fold(b[row], |sum, (column, block)| sum - block * x[column]);
        }
    }
}
