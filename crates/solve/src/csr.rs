//! Compressed sparse rows and the few vector operations the solver needs.
//!
//! Everything runs over chunks of fixed length, so that results are bitwise the same for any number
//! of threads: sums are formed per chunk and added up in order.

use rayon::prelude::*;

use coldplate_network::block::BlockReal;

/// Rows or entries handled by one task, a count. Chosen: cost of starting a task against balance between threads.
pub const CHUNK: usize = 8192;

/// A square or rectangular sparse matrix; columns ascend within each row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Csr<T = f64> {
    /// Number of columns.
    pub columns: usize,
    /// Start of each row in `cols` and `values`, and the end of the last: `rows() + 1` entries.
    pub starts: Vec<usize>,
    /// Column of each entry.
    pub cols: Vec<u32>,
    /// Value of each entry.
    pub values: Vec<T>,
}

impl<T: BlockReal> Csr<T> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Columns and values of a row.
    pub fn row(&self, i: usize) -> (&[u32], &[T]) {
        let range = self.starts[i]..self.starts[i + 1];
        (&self.cols[range.clone()], &self.values[range])
    }

    /// y = A x
    pub fn multiply(&self, x: &[T], y: &mut [T]) {
        for_chunks(y, |first, part| self.add_product(first, x, part, true));
    }

    /// Adds the rows of A x from `first` on to `part`, or overwrites `part` with them if `set`.
    pub fn add_product(&self, first: usize, x: &[T], part: &mut [T], set: bool) {
        for (k, out) in part.iter_mut().enumerate() {
            let (cols, values) = self.row(first + k);
            let mut sum = if set { T::default() } else { *out };
            for (c, v) in cols.iter().zip(values) {
                sum += *v * x[*c as usize];
            }
            *out = sum;
        }
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        let mut starts = vec![0usize; self.columns + 1];
        for c in &self.cols {
            starts[*c as usize + 1] += 1;
        }
        for i in 0..self.columns {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let (mut cols, mut values) = (vec![0u32; self.cols.len()], vec![T::default(); self.cols.len()]);
        for i in 0..self.rows() {
            let (row_cols, row_values) = self.row(i);
            for (c, v) in row_cols.iter().zip(row_values) {
                let at = next[*c as usize];
                next[*c as usize] += 1;
                (cols[at], values[at]) = (i as u32, *v);
            }
        }
        Self { columns: self.rows(), starts, cols, values }
    }
}

impl Csr {
    /// This matrix in single precision.
    pub(crate) fn to_single(&self) -> Csr<f32> {
        let values = self.values.iter().map(|v| *v as f32).collect();
        Csr { columns: self.columns, starts: self.starts.clone(), cols: self.cols.clone(), values }
    }

    /// The product of two matrices (Gustavson's row-by-row scheme), columns sorted.
    pub fn product(&self, other: &Self) -> Self {
        let rows = self.rows();
        let chunks: Vec<(Vec<usize>, Vec<u32>, Vec<f64>)> = (0..rows.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let (mut lengths, mut cols, mut values) = (Vec::with_capacity(CHUNK), Vec::new(), Vec::new());
                let mut place = vec![u32::MAX; other.columns];
                let mut row: Vec<(u32, f64)> = Vec::new();
                for i in chunk * CHUNK..((chunk + 1) * CHUNK).min(rows) {
                    row.clear();
                    let (a_cols, a_values) = self.row(i);
                    for (k, a) in a_cols.iter().zip(a_values) {
                        let (b_cols, b_values) = other.row(*k as usize);
                        for (j, b) in b_cols.iter().zip(b_values) {
                            let at = place[*j as usize];
                            if at == u32::MAX {
                                place[*j as usize] = row.len() as u32;
                                row.push((*j, a * b));
                            } else {
                                row[at as usize].1 += a * b;
                            }
                        }
                    }
                    for (j, _) in &row {
                        place[*j as usize] = u32::MAX;
                    }
                    row.sort_unstable_by_key(|(j, _)| *j);
                    lengths.push(row.len());
                    cols.extend(row.iter().map(|(j, _)| *j));
                    values.extend(row.iter().map(|(_, v)| *v));
                }
                (lengths, cols, values)
            })
            .collect();
        Self::from_chunks(other.columns, chunks)
    }

    /// A matrix of consecutive pieces: lengths of rows, columns and values.
    pub(crate) fn from_chunks(columns: usize, chunks: Vec<(Vec<usize>, Vec<u32>, Vec<f64>)>) -> Self {
        let mut found = Self { columns, starts: vec![0], cols: Vec::new(), values: Vec::new() };
        let total = chunks.iter().map(|(_, c, _)| c.len()).sum();
        found.cols.reserve_exact(total);
        found.values.reserve_exact(total);
        let mut end = 0;
        for (lengths, cols, values) in chunks {
            for length in lengths {
                end += length;
                found.starts.push(end);
            }
            found.cols.extend(cols);
            found.values.extend(values);
        }
        found
    }
}

/// Runs `work(first index, chunk)` over the chunks of a vector.
pub fn for_chunks<T: Send>(y: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
    if y.len() <= 2 * CHUNK {
        for (i, part) in y.chunks_mut(CHUNK).enumerate() {
            work(i * CHUNK, part);
        }
    } else {
        y.par_chunks_mut(CHUNK).enumerate().for_each(|(i, part)| work(i * CHUNK, part));
    }
}

/// Scalar product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let chunk = |(a, b): (&[f64], &[f64])| dot_chunk(a, b);
    if a.len() <= 2 * CHUNK {
        return a.chunks(CHUNK).zip(b.chunks(CHUNK)).map(chunk).sum();
    }
    let parts: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(chunk).collect();
    parts.iter().sum()
}

/// Scalar product of two short vectors, in eight interleaved sums that the processor can form side by side.
pub(crate) fn dot_chunk<T: Copy + Into<f64>>(a: &[T], b: &[f64]) -> f64 {
    let mut sums = [0.0f64; 8];
    let (whole_a, whole_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let left: f64 = whole_a.remainder().iter().zip(whole_b.remainder()).map(|(a, b)| (*a).into() * b).sum();
    for (a, b) in whole_a.zip(whole_b) {
        for i in 0..8 {
            sums[i] += a[i].into() * b[i];
        }
    }
    sums.iter().sum::<f64>() + left
}

/// Euclidean norm.
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// y += a x
pub(crate) fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for_chunks(y, |first, part| {
        let n = part.len();
        part.iter_mut().zip(&x[first..first + n]).for_each(|(y, x)| *y += a * x);
    });
}
