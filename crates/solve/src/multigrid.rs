//! Multigrid, as a preconditioner.
//!
//! The finest level is the network itself: structured blocks act through their tables and are coarsened
//! by threes (`tensor`); from there on, or at once where a network has no blocks, coarse levels
//! come from smoothed aggregation (`aggregation`) with Galerkin products. One cycle with the
//! same polynomial smoother before and after the coarse correction is symmetric, so it may precondition
//! conjugate gradients; coarse levels are visited twice. The smoother is Chebyshev's of the fourth kind (Lottes, Numerical Linear Algebra
//! with Applications 30 (2023) e2518), which needs no lower bound of the spectrum. Levels are stored and
//! applied in single precision: a preconditioner need not be exact, and half the bytes move. The coarsest level is solved
//! directly, and so is the network itself where that costs no more than a cycle.

use super::aggregation::{aggregates, smoothed_prolongation};
use super::csr::{CHUNK, Csr, for_chunks};
use super::direct::Direct;
use super::jacobian::SparseRows;
use super::system::Symmetric;
use super::tensor::Transfer;
use coldplate_base::error::Result;
use coldplate_network::Block;
use coldplate_network::block::FaceCoefficients;

/// Rows at which the coarsest level is solved directly, a count. Chosen: number of levels against the cost of the decomposition.
const COARSEST: usize = 400;
/// Rows up to which a direct solve of the network itself is considered, a count. Chosen: decompositions against iterations.
const DIRECT: usize = 8000;
/// Entries per row of the factor up to which a direct solve is taken, a count. Chosen: cost of a direct solve against that of a cycle.
const MOST_FILL: f64 = 60.0;
/// Couplings weaker than this, relative to the geometric mean of the diagonals, do not bind aggregates; dimensionless, and half as much
/// on each further level: the value of Vanek, Mandel and Brezina (see [`super::aggregation`]).
const STRENGTH: f64 = 0.08;
/// Blocks are coarsened while the next level has less than this share of the rows, dimensionless. Chosen.
const WORTHWHILE: f64 = 0.6;
/// Cells in a line of a block, on the mean, below which a list of neighbours costs less than tables of the line; a count. Chosen with
/// the time of one cycle on the five-axis machine (docs/record/speed.md).
const SHORT: usize = 8;
/// Products with the matrix in each smoothing (degree of its polynomial), a count. Chosen: cost of a cycle against iterations.
const DEGREE: usize = 4;

/// A hierarchy of matrices.
#[derive(Debug, Clone)]
pub struct Multigrid {
    levels: Vec<Level>,
    coarsest: Direct,
}

#[derive(Debug, Clone)]
struct Level {
    operator: Operator,
    /// Coefficient of each node's own value that the operator does not hold, W/K.
    own: Vec<f32>,
    /// The coefficients `own` without a shift, kept once there is one.
    steady: Option<Vec<f32>>,
    inverse_diagonal: Vec<f32>,
    /// Largest eigenvalue of the matrix scaled by its diagonal: an upper bound.
    bound: f32,
    /// Heat capacity carried by the nodes, J/K.
    capacity: Vec<f64>,
    step: Step,
}

#[derive(Debug, Clone)]
enum Operator {
    /// The network itself.
    Network { blocks: Vec<Block>, profiles: Vec<FaceCoefficients<f32>>, rest: SparseRows<f32> },
    /// Compressed rows.
    Rows(Csr<f32>),
}

/// The way to the next level and back.
#[derive(Debug, Clone)]
enum Step {
    Blocks(Transfer),
    Aggregates { prolongation: Csr<f32>, restriction: Csr<f32> },
}

/// Vectors for one cycle; one set per thread.
#[derive(Debug, Clone)]
pub struct Workspace {
    levels: Vec<[Vec<f32>; 3]>,
}

impl Multigrid {
    /// Builds the hierarchy. `capacity` (J/K, by solid node) serves [`Multigrid::shift`].
    ///
    /// # Errors
    /// The matrix is not positive definite: some node has no path to any given temperature.
    pub fn new(matrix: &Symmetric<'_>, capacity: &[f64]) -> Result<Self> {
        let rows = matrix.to_given.len();
        let most = if rows <= COARSEST { f64::INFINITY } else { MOST_FILL };
        if rows <= DIRECT
            && let Some(coarsest) = Direct::within(rows_of(matrix), capacity.to_vec(), most)?
        {
            return Ok(Self { levels: Vec::new(), coarsest });
        }
        let mut levels = Vec::new();
        let along: Vec<_> = matrix.profiles.iter().map(end_conductances).collect();
        let mut transfer = Transfer::new(matrix.blocks, &along, matrix.to_given.len());
        let (mut current, mut carried) = if matrix.blocks.is_empty() {
            (rows_of(matrix), capacity.to_vec())
        } else {
            let coarse = (transfer.galerkin(matrix), transfer.lump(capacity));
            let (blocks, along) = transfer.coarse_blocks();
            let next = Transfer::new(&blocks, &along, transfer.coarse());
            levels.push(network_level(matrix, capacity, std::mem::replace(&mut transfer, next)));
            coarse
        };
        while current.rows() > COARSEST && levels.len() < 20 {
            let rows = current.rows();
            let diagonal = diagonal(&current);
            let (step, coarse, lumped) = if (transfer.coarse() as f64) < WORTHWHILE * rows as f64 {
                let prolongation = transfer.prolongation();
                let coarse = prolongation.transpose().product(&current.product(&prolongation));
                let lumped = transfer.lump(&carried);
                let (blocks, along) = transfer.coarse_blocks();
                let next = Transfer::new(&blocks, &along, transfer.coarse());
                (Step::Blocks(std::mem::replace(&mut transfer, next)), coarse, lumped)
            } else {
                let theta = STRENGTH * 0.5f64.powi(levels.len() as i32);
                let (aggregate, count) = aggregates(&current, &diagonal, theta);
                if count == 0 || count as f64 > 0.8 * rows as f64 {
                    break; // no further coarsening: the direct solve takes over
                }
                let prolongation = smoothed_prolongation(&current, &diagonal, &aggregate, count, theta);
                let restriction = prolongation.transpose();
                let coarse = restriction.product(&current.product(&prolongation));
                let mut lumped = vec![0.0; count];
                restriction.multiply(&carried, &mut lumped);
                transfer = Transfer::new(&[], &[], count);
                (Step::Aggregates { prolongation: prolongation.to_single(), restriction: restriction.to_single() }, coarse, lumped)
            };
            let bound = (0..rows).map(|i| current.row(i).1.iter().map(|v| v.abs()).sum::<f64>() / diagonal[i]).fold(1.0, f64::max);
            levels.push(Level {
                own: vec![0.0; rows],
                steady: None,
                inverse_diagonal: diagonal.iter().map(|d| (1.0 / d) as f32).collect(),
                bound: bound as f32,
                capacity: std::mem::replace(&mut carried, lumped),
                operator: Operator::Rows(current.to_single()),
                step,
            });
            current = coarse;
        }
        Ok(Self { levels, coarsest: Direct::new(current, carried)? })
    }

    /// Vectors for [`Multigrid::apply`].
    pub fn workspace(&self) -> Workspace {
        let of = |n: usize| [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut levels: Vec<_> = self.levels.iter().map(|l| of(l.own.len())).collect();
        levels.push(of(self.coarsest.rows()));
        Workspace { levels }
    }

    /// x = M b with one cycle.
    pub fn apply(&self, b: &[f64], x: &mut [f64], work: &mut Workspace) {
        for_chunks(&mut work.levels[0][0], |first, part| part.iter_mut().zip(&b[first..]).for_each(|(w, b)| *w = *b as f32));
        self.cycle(0, work, true);
        for_chunks(x, |first, part| part.iter_mut().zip(&work.levels[0][1][first..]).for_each(|(x, w)| *x = f64::from(*w)));
    }

    /// One cycle on level `l`: right-hand side in the first vector, result in the second, which holds a guess unless `from_zero`.
    /// Levels below the second are visited twice: they cost little, and find errors that reach through the whole network.
    fn cycle(&self, l: usize, work: &mut Workspace, from_zero: bool) {
        let Some(level) = self.levels.get(l) else {
            let [b, x, _] = &mut work.levels[l];
            let mut solved: Vec<f64> = b.iter().map(|b| f64::from(*b)).collect();
            self.coarsest.solve(&mut solved);
            x.iter_mut().zip(solved.iter()).for_each(|(x, s)| *x = *s as f32);
            return;
        };
        let (above, below) = work.levels.split_at_mut(l + 1);
        let [b, x, other] = &mut above[l];
        level.smooth(b, x, other, from_zero);
        level.residual(b, x, other);
        match &level.step {
            Step::Blocks(transfer) => transfer.restrict(other, &mut below[0][0]),
            Step::Aggregates { restriction, .. } => restriction.multiply(other, &mut below[0][0]),
        }
        let visits = if l > 0 && l + 1 < self.levels.len() { 2 } else { 1 };
        for visit in 0..visits {
            self.cycle(l + 1, work, visit == 0);
        }
        let (above, below) = work.levels.split_at_mut(l + 1);
        let [b, x, other] = &mut above[l];
        match &level.step {
            Step::Blocks(transfer) => transfer.prolong(&below[0][1], x),
            Step::Aggregates { prolongation, .. } => {
                for_chunks(x, |first, part| prolongation.add_product(first, &below[0][1], part, false))
            }
        }
        level.smooth(b, x, other, false);
    }

    /// Adds `rate` (1/s) times the capacity to the matrix, in place of a rate added before: the matrix of an implicit time step, on the
    /// hierarchy of the steady one.
    ///
    /// # Errors
    /// Errors of [`Multigrid::new`].
    pub fn shift(&mut self, rate: f64) -> Result<()> {
        for level in &mut self.levels {
            level.shift(rate);
        }
        self.coarsest.shift(rate)
    }
}

impl Level {
    /// The rows of A x from `first` on.
    fn product(&self, first: usize, x: &[f32], part: &mut [f32]) {
        let range = first..first + part.len();
        part.iter_mut().zip(&self.own[range.clone()]).zip(&x[range.clone()]).for_each(|((y, d), x)| *y = d * x);
        match &self.operator {
            Operator::Network { blocks, profiles, rest } => {
                for (block, profile) in blocks.iter().zip(profiles) {
                    block.add_conduction(profile, first, x, part);
                }
                rest.add_product(first, x, part);
            }
            Operator::Rows(matrix) => matrix.add_product(first, x, part, false),
        }
    }

    /// r = b - A x
    fn residual(&self, b: &[f32], x: &[f32], r: &mut [f32]) {
        for_chunks(r, |first, part| {
            self.product(first, x, part);
            part.iter_mut().zip(&b[first..]).for_each(|(r, b)| *r = b - *r);
        });
    }

    /// Chebyshev's polynomial of the fourth kind; `other` is overwritten. With `from_zero` x need not be set.
    fn smooth(&self, b: &[f32], x: &mut Vec<f32>, other: &mut Vec<f32>, from_zero: bool) {
        let scale = 1.0 / self.bound;
        for k in 1..=DEGREE {
            let k = k as f32;
            let (memory, gain) = ((2.0 * k - 3.0).max(0.0) / (2.0 * k + 1.0), (8.0 * k - 4.0) / (2.0 * k + 1.0) * scale);
            let (is_first, starts_empty) = (k == 1.0, k == 1.0 && from_zero);
            // The new iterate takes the place of the one before the last.
            for_chunks(other, |first, part| {
                let range = first..first + part.len();
                let inverse = &self.inverse_diagonal[range.clone()];
                if starts_empty {
                    part.iter_mut().zip(&b[range]).zip(inverse).for_each(|((n, b), d)| *n = gain * d * b);
                    return;
                }
                let mut product = [0.0f32; CHUNK];
                let product = &mut product[..part.len()];
                self.product(first, x, product);
                let now = x[range.clone()].iter().zip(&b[range]).zip(inverse).zip(product.iter());
                if is_first {
                    part.iter_mut().zip(now).for_each(|(n, (((x, b), d), ax))| *n = x + gain * d * (b - ax));
                } else if from_zero && k == 2.0 {
                    part.iter_mut().zip(now).for_each(|(n, (((x, b), d), ax))| *n = x + memory * x + gain * d * (b - ax));
                } else {
                    part.iter_mut().zip(now).for_each(|(n, (((x, b), d), ax))| *n = x + memory * (x - *n) + gain * d * (b - ax));
                }
            });
            std::mem::swap(x, other);
        }
    }

    /// Diagonal of the operator, without the nodes' own coefficients.
    fn held_diagonal(&self) -> Vec<f32> {
        match &self.operator {
            Operator::Network { blocks, profiles, .. } => conduction_diagonal(self.own.len(), blocks, profiles),
            Operator::Rows(matrix) => {
                let of = |i: usize| {
                    let (cols, values) = matrix.row(i);
                    cols.binary_search(&(i as u32)).map_or(0.0, |at| values[at])
                };
                (0..matrix.rows()).map(of).collect()
            }
        }
    }

    fn shift(&mut self, rate: f64) {
        let steady = self.steady.get_or_insert_with(|| self.own.clone());
        for ((own, steady), c) in self.own.iter_mut().zip(steady.iter()).zip(&self.capacity) {
            *own = steady + (rate * c) as f32;
        }
        self.inverse_diagonal = self.held_diagonal().iter().zip(&self.own).map(|(held, own)| 1.0 / (held + own)).collect();
    }
}

/// Conductance between neighbours along each axis, W/K, at both ends of the first one.
fn end_conductances(profile: &FaceCoefficients<f64>) -> [[f64; 3]; 2] {
    let n = profile[1].len();
    // A line of one cell has no face within.
    let face = |i: usize| if n > 1 { profile[0][i] } else { 0.0 };
    [(face(1), 0), (face(n - 1), n - 1)].map(|(along, i)| [along, profile[1][i], profile[2][i]])
}

/// The finest level, from the network itself.
fn network_level(matrix: &Symmetric<'_>, capacity: &[f64], transfer: Transfer) -> Level {
    let rows = matrix.to_given.len();
    let profiles: Vec<FaceCoefficients<f32>> =
        matrix.profiles.iter().map(|p| p.each_ref().map(|g| g.iter().map(|g| *g as f32).collect())).collect();
    let rest = SparseRows::of_entries(matrix.couplings.iter().flat_map(|(a, b, g)| [(*a, *b, -*g as f32), (*b, *a, -*g as f32)]).collect());
    let mut own: Vec<f64> = matrix.to_given.clone();
    for (a, b, g) in &matrix.couplings {
        own[*a as usize] += g;
        own[*b as usize] += g;
    }
    let held = conduction_diagonal(rows, matrix.blocks, &profiles);
    let own: Vec<f32> = own.iter().map(|o| *o as f32).collect();
    // Gershgorin: twice the diagonal where no conductance is negative, as they are in obtuse tetrahedra.
    let excess = rest.iter().map(|(row, _, values)| {
        let i = row as usize;
        (2.0 * held[i] + own[i] + values.iter().map(|v| v.abs()).sum::<f32>()) / (held[i] + own[i])
    });
    let bound = excess.fold(2.0, f32::max);
    let inverse_diagonal = held.iter().zip(&own).map(|(h, o)| 1.0 / (h + o)).collect();
    let (operator, own) = if has_short_lines(matrix.blocks) {
        (Operator::Rows(rows_of(matrix).to_single()), vec![0.0; rows])
    } else {
        (Operator::Network { blocks: matrix.blocks.to_vec(), profiles, rest }, own)
    };
    Level { inverse_diagonal, own, steady: None, bound, capacity: capacity.to_vec(), operator, step: Step::Blocks(transfer) }
}

fn has_short_lines(blocks: &[Block]) -> bool {
    let lines: usize = blocks.iter().map(|b| b.cells[1] * b.cells[2]).sum();
    blocks.iter().map(Block::len).sum::<usize>() < SHORT * lines
}

fn conduction_diagonal(rows: usize, blocks: &[Block], profiles: &[FaceCoefficients<f32>]) -> Vec<f32> {
    let mut diagonal = vec![0.0f32; rows];
    for (block, profile) in blocks.iter().zip(profiles) {
        for_chunks(&mut diagonal[block.nodes()], |first, part| {
            let start = block.first + first;
            for segment in block.segments(start..start + part.len()) {
                segment.add_diagonal(profile, &mut part[segment.node - start..segment.node - start + segment.along.len()]);
            }
        });
    }
    diagonal
}

/// The network as compressed rows.
fn rows_of(matrix: &Symmetric<'_>) -> Csr {
    let n = matrix.to_given.len();
    let mut rows: Vec<Vec<(u32, f64)>> = matrix.to_given.iter().enumerate().map(|(i, g)| vec![(i as u32, *g)]).collect();
    let mut join = |a: u32, b: u32, g: f64| {
        rows[a as usize].push((b, -g));
        rows[a as usize][0].1 += g;
    };
    for (a, b, g) in &matrix.couplings {
        join(*a, *b, *g);
        join(*b, *a, *g);
    }
    for (block, profile) in matrix.blocks.iter().zip(&matrix.profiles) {
        for segment in block.segments(block.nodes()) {
            segment.each_face(block.cells[0], |at, axis, other, _, owner| {
                // Along the first axis an entry belongs to the face below a cell.
                join((segment.node + at) as u32, other as u32, profile[axis][owner + usize::from(axis == 0)]);
            });
        }
    }
    let (mut lengths, mut cols, mut values) = (vec![0usize; n], Vec::new(), Vec::new());
    for (row, length) in rows.iter_mut().zip(&mut lengths) {
        row.sort_unstable_by_key(|(col, _)| *col);
        row.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            kept.1 += if is_same { next.1 } else { 0.0 };
            is_same
        });
        *length = row.len();
        cols.extend(row.iter().map(|(col, _)| *col));
        values.extend(row.iter().map(|(_, value)| *value));
    }
    Csr::from_chunks(n, vec![(lengths, cols, values)])
}

fn diagonal(matrix: &Csr) -> Vec<f64> {
    let of = |i: usize| {
        let (cols, values) = matrix.row(i);
        cols.binary_search(&(i as u32)).map_or(0.0, |at| values[at])
    };
    (0..matrix.rows()).map(of).collect()
}
