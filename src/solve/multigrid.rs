//! Algebraic multigrid by smoothed aggregation, as a preconditioner.
//!
//! Vanek, Mandel and Brezina, Computing 56 (1996) 179: strongly coupled nodes form aggregates, the
//! piecewise-constant prolongation is smoothed by one damped Jacobi step of the filtered matrix, and
//! coarse matrices are Galerkin products. One V-cycle with a forward Gauss-Seidel sweep before and a
//! backward sweep after the coarse correction is symmetric, so it may precondition conjugate gradients.
//! The sweeps treat the coupling between chunks of rows as Jacobi does, which makes them parallel and
//! independent of the number of threads.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::csr::{CHUNK, Csr, for_chunks};
use crate::error::{Error, Result};

/// Rows at which the coarsest level is solved directly.
const COARSEST: usize = 600;
/// Couplings weaker than this, relative to the geometric mean of the diagonals, do not bind aggregates.
const STRENGTH: f64 = 0.08;
/// Damping of the prolongation smoother: 4/3 over the bound 2 on the spectral radius of a scaled M-matrix.
const DAMPING: f64 = 2.0 / 3.0;
/// Marks a node that belongs to no aggregate.
const NOWHERE: u32 = u32::MAX;

/// A hierarchy of matrices.
#[derive(Debug, Clone)]
pub struct Multigrid {
    levels: Vec<Level>,
    coarsest: Coarsest,
}

#[derive(Debug, Clone)]
struct Level {
    matrix: Csr,
    inverse_diagonal: Vec<f64>,
    prolongation: Csr,
    restriction: Csr,
}

#[derive(Debug, Clone)]
struct Coarsest {
    rows: usize,
    factor: Cholesky<f64, Dyn>,
}

/// Vectors for one V-cycle; one set per thread.
#[derive(Debug, Clone)]
pub struct Workspace {
    levels: Vec<(Vec<f64>, Vec<f64>, Vec<f64>)>,
}

impl Multigrid {
    /// Builds the hierarchy of a symmetric positive definite matrix with non-positive off-diagonals.
    ///
    /// # Errors
    /// The matrix is not positive definite: some node has no path to any given temperature.
    pub fn new(matrix: Csr) -> Result<Self> {
        let mut levels = Vec::new();
        let mut current = matrix;
        while current.rows() > COARSEST && levels.len() < 20 {
            let theta = STRENGTH * 0.5f64.powi(levels.len() as i32);
            let diagonal = diagonal(&current);
            let (aggregate, count) = aggregates(&current, &diagonal, theta);
            if count == 0 || count as f64 > 0.8 * current.rows() as f64 {
                break; // no further coarsening: the direct solve takes over
            }
            let prolongation = smoothed_prolongation(&current, &diagonal, &aggregate, count, theta);
            let restriction = prolongation.transpose();
            let coarse = restriction.product(&current.product(&prolongation));
            let inverse_diagonal = diagonal.iter().map(|d| 1.0 / d).collect();
            levels.push(Level { matrix: current, inverse_diagonal, prolongation, restriction });
            current = coarse;
        }
        let rows = current.rows();
        let mut dense = DMatrix::zeros(rows, rows);
        for i in 0..rows {
            let (cols, values) = current.row(i);
            for (j, v) in cols.iter().zip(values) {
                dense[(i, *j as usize)] = *v;
            }
        }
        let factor = Cholesky::new(dense).ok_or_else(|| {
            Error::numerics("the network's matrix is not positive definite")
                .help("some part has no path for its heat: connect it by a contact, or let it radiate to the chamber")
        })?;
        Ok(Self { levels, coarsest: Coarsest { rows, factor } })
    }

    /// Vectors for [`Multigrid::apply`].
    pub fn workspace(&self) -> Workspace {
        let of = |n: usize| (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut levels: Vec<_> = self.levels.iter().map(|l| of(l.matrix.rows())).collect();
        levels.push(of(self.coarsest.rows));
        Workspace { levels }
    }

    /// x = M b with one V-cycle.
    pub fn apply(&self, b: &[f64], x: &mut [f64], work: &mut Workspace) {
        work.levels[0].0.copy_from_slice(b);
        self.cycle(0, work);
        x.copy_from_slice(&work.levels[0].1);
    }

    /// One V-cycle on level `l`: right-hand side in the first vector, result in the second.
    fn cycle(&self, l: usize, work: &mut Workspace) {
        let Some(level) = self.levels.get(l) else {
            let (b, x, _) = &mut work.levels[l];
            let solved = self.coarsest.factor.solve(&DVector::from_column_slice(b));
            x.copy_from_slice(solved.as_slice());
            return;
        };
        {
            let (b, x, r) = &mut work.levels[l];
            level.forward_from_zero(b, x);
            level.matrix.residual(x, b, r);
        }
        let (above, below) = work.levels.split_at_mut(l + 1);
        level.restriction.multiply(&above[l].2, &mut below[0].0);
        self.cycle(l + 1, work);
        let (above, below) = work.levels.split_at_mut(l + 1);
        let (b, x, r) = &mut above[l];
        level.prolongation.multiply(&below[0].1, r);
        x.iter_mut().zip(r.iter()).for_each(|(x, c)| *x += c);
        r.copy_from_slice(x);
        level.backward(b, x, r);
    }

    /// Rows of each level, finest first.
    pub fn sizes(&self) -> Vec<usize> {
        self.levels.iter().map(|l| l.matrix.rows()).chain([self.coarsest.rows]).collect()
    }

    /// Entries of all levels over entries of the finest.
    pub fn operator_complexity(&self) -> f64 {
        let entries: Vec<f64> = self.levels.iter().map(|l| l.matrix.values.len() as f64).collect();
        match entries.first() {
            Some(first) => (entries.iter().sum::<f64>() + (self.coarsest.rows * self.coarsest.rows) as f64) / first,
            None => 1.0,
        }
    }
}

impl Level {
    /// A forward Gauss-Seidel sweep from zero: only the lower triangle inside each chunk acts.
    fn forward_from_zero(&self, b: &[f64], x: &mut [f64]) {
        for_chunks(x, |first, part| {
            for k in 0..part.len() {
                let i = first + k;
                let (cols, values) = self.matrix.row(i);
                let mut sum = b[i];
                for (c, v) in cols.iter().zip(values) {
                    let c = *c as usize;
                    if c >= i {
                        break;
                    }
                    if c >= first {
                        sum -= v * part[c - first];
                    }
                }
                part[k] = sum * self.inverse_diagonal[i];
            }
        });
    }

    /// A backward Gauss-Seidel sweep; `old` holds x as it was before the sweep.
    fn backward(&self, b: &[f64], x: &mut [f64], old: &[f64]) {
        for_chunks(x, |first, part| {
            let end = first + part.len();
            for k in (0..part.len()).rev() {
                let i = first + k;
                let (cols, values) = self.matrix.row(i);
                let mut sum = b[i];
                for (c, v) in cols.iter().zip(values) {
                    let c = *c as usize;
                    if c != i {
                        sum -= v * if (first..end).contains(&c) { part[c - first] } else { old[c] };
                    }
                }
                part[k] = sum * self.inverse_diagonal[i];
            }
        });
    }
}

fn diagonal(matrix: &Csr) -> Vec<f64> {
    (0..matrix.rows()).map(|i| matrix.values[matrix.position(i as u32, i as u32)]).collect()
}

fn is_strong(v: f64, di: f64, dj: f64, theta: f64) -> bool {
    v * v > theta * theta * di * dj
}

/// Aggregate of each node, and how many there are.
fn aggregates(matrix: &Csr, diagonal: &[f64], theta: f64) -> (Vec<u32>, usize) {
    let n = matrix.rows();
    let mut aggregate = vec![NOWHERE; n];
    let mut count = 0u32;
    let strong = |i: usize| {
        let (cols, values) = matrix.row(i);
        cols.iter()
            .zip(values)
            .filter(move |(j, v)| **j as usize != i && is_strong(**v, diagonal[i], diagonal[**j as usize], theta))
            .map(|(j, v)| (*j as usize, *v))
    };
    // Nodes whose whole strong neighbourhood is free found an aggregate.
    for i in 0..n {
        if aggregate[i] != NOWHERE {
            continue;
        }
        let (mut any, mut free) = (false, true);
        for (j, _) in strong(i) {
            any = true;
            free &= aggregate[j] == NOWHERE;
        }
        if any && free {
            aggregate[i] = count;
            for (j, _) in strong(i) {
                aggregate[j] = count;
            }
            count += 1;
        }
    }
    // The rest join the aggregate they are bound to most strongly.
    let founded = aggregate.clone();
    for (i, own) in aggregate.iter_mut().enumerate() {
        if *own == NOWHERE {
            let best = strong(i).filter(|(j, _)| founded[*j] != NOWHERE).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            if let Some((j, _)) = best {
                *own = founded[j];
            }
        }
    }
    // What is still free gathers its free neighbours; a node that its own diagonal holds stays out.
    for i in 0..n {
        if aggregate[i] != NOWHERE {
            continue;
        }
        let (cols, values) = matrix.row(i);
        let off: f64 = cols.iter().zip(values).filter(|(j, _)| **j as usize != i).map(|(_, v)| v.abs()).sum();
        if off < 0.1 * diagonal[i] {
            continue;
        }
        aggregate[i] = count;
        for (j, _) in strong(i) {
            if aggregate[j] == NOWHERE {
                aggregate[j] = count;
            }
        }
        count += 1;
    }
    (aggregate, count as usize)
}

/// P = (I - w D^-1 A_F) P_0, with weak couplings of A lumped into the diagonal of A_F.
fn smoothed_prolongation(matrix: &Csr, diagonal: &[f64], aggregate: &[u32], count: usize, theta: f64) -> Csr {
    let n = matrix.rows();
    let mut prolongation = Csr { columns: count, starts: Vec::with_capacity(n + 1), cols: Vec::new(), values: Vec::new() };
    prolongation.starts.push(0);
    let mut row: Vec<(u32, f64)> = Vec::new();
    for i in 0..n {
        row.clear();
        let (cols, values) = matrix.row(i);
        let mut filtered_diagonal = diagonal[i];
        for (j, v) in cols.iter().zip(values) {
            let j = *j as usize;
            if j != i && !is_strong(*v, diagonal[i], diagonal[j], theta) {
                filtered_diagonal += v;
            }
        }
        // A row that is all weak would divide by nearly nothing: it keeps its own diagonal.
        let filtered_diagonal = filtered_diagonal.max(0.05 * diagonal[i]);
        let mut add = |a: u32, w: f64| {
            if a == NOWHERE {
                return;
            }
            match row.iter_mut().find(|(c, _)| *c == a) {
                Some((_, sum)) => *sum += w,
                None => row.push((a, w)),
            }
        };
        add(aggregate[i], 1.0 - DAMPING);
        for (j, v) in cols.iter().zip(values) {
            let j = *j as usize;
            if j != i && is_strong(*v, diagonal[i], diagonal[j], theta) {
                add(aggregate[j], -DAMPING * v / filtered_diagonal);
            }
        }
        row.sort_unstable_by_key(|(c, _)| *c);
        prolongation.cols.extend(row.iter().map(|(c, _)| *c));
        prolongation.values.extend(row.iter().map(|(_, v)| *v));
        prolongation.starts.push(prolongation.cols.len());
    }
    prolongation
}

// One chunk of rows is one task everywhere; a power of two keeps chunk borders off most block borders.
const _: () = assert!(CHUNK.is_power_of_two());
