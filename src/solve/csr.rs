//! Compressed sparse rows and the few vector operations the solver needs.
//!
//! Everything runs over chunks of fixed length, so that results are bitwise the same for any number
//! of threads: sums are formed per chunk and added up in order.

use rayon::prelude::*;

/// Rows or entries handled by one task.
pub const CHUNK: usize = 8192;

/// A square or rectangular sparse matrix; columns ascend within each row.
#[derive(Debug, Clone, Default)]
pub struct Csr {
    /// Number of columns.
    pub columns: usize,
    /// Start of each row in `cols` and `values`, and the end of the last: `rows() + 1` entries.
    pub starts: Vec<usize>,
    /// Column of each entry.
    pub cols: Vec<u32>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

impl Csr {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Columns and values of a row.
    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let range = self.starts[i]..self.starts[i + 1];
        (&self.cols[range.clone()], &self.values[range])
    }

    /// Place of an entry in `values`; the entry must be part of the pattern.
    pub fn position(&self, row: u32, column: u32) -> usize {
        let range = self.starts[row as usize]..self.starts[row as usize + 1];
        let found = self.cols[range.clone()].binary_search(&column);
        debug_assert!(found.is_ok(), "entry ({row}, {column}) is not in the pattern");
        range.start + found.unwrap_or(0)
    }

    /// The pattern that holds a set of (row, column) entries and the diagonal, with zero values.
    pub fn pattern(rows: usize, entries: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut counts = vec![1usize; rows + 1];
        for (i, _) in entries.clone() {
            counts[i as usize] += 1;
        }
        let mut starts = Vec::with_capacity(rows + 1);
        let mut total = 0;
        for count in &counts[..rows] {
            starts.push(total);
            total += count;
        }
        starts.push(total);
        let mut cols = vec![0u32; total];
        let mut next: Vec<usize> = starts[..rows].to_vec();
        let mut put = |i: u32, j: u32| {
            cols[next[i as usize]] = j;
            next[i as usize] += 1;
        };
        (0..rows as u32).for_each(|i| put(i, i));
        entries.for_each(|(i, j)| put(i, j));
        // Sort each row and drop what is there twice.
        let mut kept = 0;
        let mut packed_starts = Vec::with_capacity(rows + 1);
        for i in 0..rows {
            packed_starts.push(kept);
            cols[starts[i]..starts[i + 1]].sort_unstable();
            let mut last = None;
            for at in starts[i]..starts[i + 1] {
                if last != Some(cols[at]) {
                    last = Some(cols[at]);
                    cols[kept] = cols[at];
                    kept += 1;
                }
            }
        }
        packed_starts.push(kept);
        cols.truncate(kept);
        cols.shrink_to_fit();
        Self { columns: rows, starts: packed_starts, values: vec![0.0; kept], cols }
    }

    /// y = A x
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        for_chunks(y, |first, part| {
            for (k, out) in part.iter_mut().enumerate() {
                let (cols, values) = self.row(first + k);
                *out = cols.iter().zip(values).map(|(c, v)| v * x[*c as usize]).sum();
            }
        });
    }

    /// r = b - A x
    pub fn residual(&self, x: &[f64], b: &[f64], r: &mut [f64]) {
        for_chunks(r, |first, part| {
            for (k, out) in part.iter_mut().enumerate() {
                let (cols, values) = self.row(first + k);
                *out = b[first + k] - cols.iter().zip(values).map(|(c, v)| v * x[*c as usize]).sum::<f64>();
            }
        });
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
        let (mut cols, mut values) = (vec![0u32; self.cols.len()], vec![0.0; self.cols.len()]);
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
        let mut product = Self { columns: other.columns, starts: vec![0], cols: Vec::new(), values: Vec::new() };
        let total = chunks.iter().map(|(_, c, _)| c.len()).sum();
        product.cols.reserve_exact(total);
        product.values.reserve_exact(total);
        let mut end = 0;
        for (lengths, cols, values) in chunks {
            for length in lengths {
                end += length;
                product.starts.push(end);
            }
            product.cols.extend(cols);
            product.values.extend(values);
        }
        product
    }
}

/// Runs `work(first index, chunk)` over the chunks of a vector.
pub fn for_chunks(y: &mut [f64], work: impl Fn(usize, &mut [f64]) + Sync) {
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
    let chunk = |(a, b): (&[f64], &[f64])| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    if a.len() <= 2 * CHUNK {
        return a.chunks(CHUNK).zip(b.chunks(CHUNK)).map(chunk).sum();
    }
    let parts: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(chunk).collect();
    parts.iter().sum()
}

/// Euclidean norm.
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// y += a x
pub fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for_chunks(y, |first, part| {
        let n = part.len();
        part.iter_mut().zip(&x[first..first + n]).for_each(|(y, x)| *y += a * x);
    });
}
