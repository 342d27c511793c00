//! Smoothed aggregation: coarse nodes for any sparse matrix.
//!
//! Vanek, Mandel and Brezina, Computing 56 (1996) 179: strongly coupled nodes form aggregates, and the
//! piecewise-constant prolongation is smoothed by one damped Jacobi step of the filtered matrix.

use super::csr::Csr;

/// Damping of the prolongation smoother, dimensionless: 4/3 over the bound 2 on the spectral radius of a scaled M-matrix.
const DAMPING: f64 = 2.0 / 3.0;
/// Marks a node that belongs to no aggregate.
const NOWHERE: u32 = u32::MAX;

fn is_strong(v: f64, di: f64, dj: f64, theta: f64) -> bool {
    v * v > theta * theta * di * dj
}

/// Aggregate of each node, and the number of aggregates.
pub(crate) fn aggregates(matrix: &Csr, diagonal: &[f64], theta: f64) -> (Vec<u32>, usize) {
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
    // Each node that is still free founds an aggregate with its free neighbours; a node held by its own diagonal stays out.
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
pub(crate) fn smoothed_prolongation(matrix: &Csr, diagonal: &[f64], aggregate: &[u32], count: usize, theta: f64) -> Csr {
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
