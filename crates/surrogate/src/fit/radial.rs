//! Radial functions of a group of outputs: one basis for all, and further bases for outputs that it serves badly.

use rayon::prelude::*;

use super::evaluate::{evaluate, scale_row};
use super::group::{OutputGroup, ResidualRows, Scores};
use super::model::{Kernel, PointModel, PointSpec, PolynomialSpec, RbfBasis, SurrogateSpec, Transform};
use super::rbf::{RbfSolution, RbfSystem, least_tail, spread};
use super::sparse::SparseSystem;
use super::tune::{Tuned, retune, settle, tune};
use super::validation::share;
use coldplate_base::numbers::root_mean_square;

/// Share to which a further basis must reduce an output's leave-one-out error with the shared basis, and its held-out error with
/// polynomials or the shared basis. Chosen: each further basis costs every query.
const OWN_MUST_REACH: f64 = 0.7;
/// Largest ratio of an output's leave-one-out error with another output's further basis to that with a basis of its
/// own, at which it joins. Chosen: fewer bases against smaller errors.
const MAY_JOIN: f64 = 1.15;
/// Error, as a share of an output's standard deviation, below which it needs no further basis. Chosen: each further
/// basis costs every query.
const KNOWN: f64 = 1e-3;
/// Least decrease of the mean log of squared errors for a change of transforms, kernel or tail (2.5 % of the error).
/// Chosen: smaller ones may be chance.
const CLEARLY: f64 = 0.05;
/// Most rows that length scales are tuned on, a count. Chosen: the time of a step grows with the third power.
const TUNE_ROWS: usize = 400;
/// Least rows that a search begins on before it goes on to more, per variable that varies. Chosen: the usual size of a first design
/// (Loeppky, Sacks, Welch 2009).
const COARSE_PER_VARIABLE: usize = 10;
/// Least rows that a search begins on, per term of the tail. Chosen: a tail of as many terms as rows leaves nothing to tell length scales by.
const COARSE_PER_TERM: usize = 3;
/// Most centres of a basis, a count; on more rows a basis has so many, spread over the rows. Chosen: they cost memory and every
/// query, and the time of a fit grows with their square.
const MOST_CENTRES: usize = 1500;
/// Most steps of the tuning on all rows, a count. Chosen: the search mostly ends before.
const STEPS: usize = 30;
/// Most steps of the tuning in each fold, a count. Chosen fewer, since every fold is tuned from scratch.
const FOLD_STEPS: usize = 10;
/// Number of kernel and tail combinations that go into cross-validation, as pairs of most rows and number. Chosen: all on
/// few rows, where cross-validation is cheap and chance misleads the choice most; fewer on more rows.
const SHORTLIST: [(usize, usize); 3] = [(60, usize::MAX), (120, 4), (usize::MAX, 2)];

/// Kernel, tail and how the variables enter.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RadialShape {
    pub(super) kernel: Kernel,
    pub(super) tail: usize,
    pub(super) transforms: Vec<Transform>,
}

/// A shape with tuned parameters.
#[derive(Debug, Clone)]
pub(super) struct Radial {
    pub(super) shape: RadialShape,
    pub(super) tuned: Tuned,
}

impl OutputGroup<'_> {
    fn system(&self, rows: &[&[f64]], shape: &RadialShape, y: &[Vec<f64>]) -> Option<RbfSystem> {
        let u = rows.iter().map(|x| scale_row(&self.samples.variables, &shape.transforms, x)).collect();
        let active = (0..self.search.active.len()).filter(|k| self.search.active[*k]).collect();
        RbfSystem::new(u, active, self.search.terms(shape.tail), y.to_vec())
    }

    /// Solves a basis on all rows, with as much more smoothing as its weights need.
    fn solve(&self, Radial { shape, tuned }: Radial, y: &[Vec<f64>]) -> Option<(Radial, RbfSolution)> {
        let (tuned, solved) = settle(&self.system(&self.rows, &shape, y)?, shape.kernel, tuned)?;
        Some((Radial { shape, tuned }, solved))
    }

    /// Solves a basis whose centres are some of the rows by least squares on all of them.
    fn solve_sparse(&self, one: Radial) -> Option<(Radial, RbfSolution)> {
        let rows: Vec<Vec<f64>> = self.rows.iter().map(|x| scale_row(&self.samples.variables, &one.shape.transforms, x)).collect();
        let (scales, tail) = (self.all_scales(&one), self.search.terms(one.shape.tail));
        let Radial { shape, tuned } = one;
        let system = SparseSystem { rows: &rows, scales: &scales, kernel: shape.kernel, tail: &tail, outputs: &self.y };
        let (tuned, solved) = system.solve(tuned, MOST_CENTRES)?;
        Some((Radial { shape, tuned }, solved))
    }

    /// Tunes on some of the rows, from nearly right parameters or from scratch.
    fn tune_on(&self, index: &[usize], shape: &RadialShape, y: &[Vec<f64>], begin: Option<&[f64]>) -> Option<Tuned> {
        let rows: Vec<&[f64]> = index.iter().map(|i| self.rows[*i]).collect();
        let y: Vec<Vec<f64>> = y.iter().map(|y| index.iter().map(|i| y[*i]).collect()).collect();
        match begin {
            Some(begin) => retune(&self.system(&rows, shape, &y)?, shape.kernel, self.options.tuning, begin, STEPS),
            None => self.tune_from_scratch(&rows, shape, &y, STEPS),
        }
    }

    /// Tunes on a quarter or half of the rows before all of them.
    fn tune_from_scratch(&self, rows: &[&[f64]], shape: &RadialShape, y: &[Vec<f64>], steps: usize) -> Option<Tuned> {
        let varying = self.search.active.iter().filter(|active| **active).count();
        let least = (COARSE_PER_VARIABLE * varying).max(COARSE_PER_TERM * self.search.terms(shape.tail).len());
        let coarse = [4, 2].into_iter().map(|share| rows.len() / share).filter(|count| *count >= least);
        let systems = coarse.chain([rows.len()]).map(|count| {
            let index = share(rows, count, self.options.seed);
            let y: Vec<Vec<f64>> = y.iter().map(|y| index.iter().map(|i| y[*i]).collect()).collect();
            self.system(&index.iter().map(|i| rows[*i]).collect::<Vec<_>>(), shape, &y)
        });
        tune(&systems.collect::<Option<Vec<_>>>()?, shape.kernel, self.options.tuning, steps)
    }

    pub(super) fn radial(&self, scores: &Scores, rival: &[f64], most_bases: usize) -> Option<RadialResult> {
        let rows = share(&self.rows, TUNE_ROWS, self.options.seed.wrapping_add(1));
        let candidates = |shapes: Vec<RadialShape>| -> Vec<Radial> {
            shapes
                .into_par_iter()
                .filter_map(|shape| self.tune_on(&rows, &shape, &self.y, None).map(|tuned| Radial { shape, tuned }))
                .collect()
        };
        // Transforms of the variables, chosen by the first kernel with a linear tail: the identity, the choice of the
        // polynomials, or that choice with ln x for 1/x, which stretches the small end less.
        let joint = |s: &[f64]| s.iter().map(|s| s.max(f64::MIN_POSITIVE).ln()).sum::<f64>();
        let best = scores.iter().min_by(|a, b| joint(&a.1).total_cmp(&joint(&b.1))).map(|(t, _)| t.clone())?;
        let milder = best.iter().map(|t| if *t == Transform::Reciprocal { Transform::Log } else { *t }).collect();
        let mut ways = vec![vec![Transform::Identity; self.samples.variables.len()], best, milder];
        ways.dedup();
        let kernel = *self.options.kernels.first()?;
        let first = candidates(ways.into_iter().map(|transforms| RadialShape { kernel, tail: 1, transforms }).collect());
        let first = first.into_iter().reduce(|a, b| if b.tuned.score < a.tuned.score - CLEARLY { b } else { a })?;
        let transforms = first.shape.transforms.clone();
        let rest: Vec<RadialShape> = self
            .options
            .kernels
            .iter()
            .flat_map(|kernel| (least_tail(*kernel)..=2).map(|tail| RadialShape { kernel: *kernel, tail, transforms: transforms.clone() }))
            .filter(|shape| *shape != first.shape)
            .collect();
        let mut considered = candidates(rest);
        considered.push(first);
        let shortlisted = SHORTLIST.iter().find(|(most, _)| self.rows.len() <= *most).map_or(1, |(_, number)| *number);
        let is_sparse = self.rows.len() > MOST_CENTRES;
        let mut both: Vec<(Radial, RbfSolution)> = if is_sparse {
            considered.sort_by(|a, b| a.tuned.score.total_cmp(&b.tuned.score));
            considered.into_iter().take(shortlisted).filter_map(|one| self.solve_sparse(one)).collect()
        } else {
            considered.into_par_iter().filter_map(|one| self.solve(one, &self.y)).collect()
        };
        both.sort_by(|a, b| a.0.tuned.score.total_cmp(&b.0.tuned.score));
        let (considered, solved): (Vec<Radial>, Vec<RbfSolution>) = both.into_iter().unzip();
        let left_out: Vec<ResidualRows> = solved.iter().map(|s| s.left_out.clone()).collect();
        let held_out = if is_sparse {
            left_out.first()?.clone()
        } else {
            self.radial_folds(&considered.iter().take(shortlisted).cloned().collect::<Vec<_>>(), &self.y)
        };
        let solved = solved.into_iter().next()?;
        let is_worth_trying = self.y.len() > 1 && most_bases > 1 && self.rows.len() <= TUNE_ROWS;
        let simpler = |k: usize| rival[k].min(root_mean_square(&held_out[k]));
        let open: Vec<Unserved> = (0..self.y.len())
            .filter(|k| is_worth_trying && simpler(*k) > KNOWN * spread(&self.y[*k]))
            .map(|k| Unserved { output: k, left_out: root_mean_square(&solved.left_out[k]), held_out: simpler(k) })
            .collect();
        let further = self.further(&considered[0], scores, &rows, open, most_bases.saturating_sub(1));
        Some(RadialResult { considered, left_out, solved, held_out, further })
    }

    /// Held-out residuals of the radial procedure for as few rows as can all be centres. In each fold the shortlisted shapes are tuned anew from scratch, and
    /// the best by leave-one-out predicts: parameters that have seen the fold would make its residuals too small.
    fn radial_folds(&self, shortlist: &[Radial], y: &[Vec<f64>]) -> ResidualRows {
        self.by_fold(y, |train, test, y| {
            let fallback = || y.iter().map(|y| vec![y.iter().sum::<f64>() / y.len() as f64; test.len()]).collect();
            let tuned = shortlist.iter().filter_map(|one| {
                let system = self.system(train, &one.shape, y)?;
                let tuned =
                    if train.len() <= TUNE_ROWS { self.tune_from_scratch(train, &one.shape, y, FOLD_STEPS)? } else { one.tuned.clone() };
                Some((one, system, tuned))
            });
            let settled = tuned.filter_map(|(one, system, tuned)| Some((one, settle(&system, one.shape.kernel, tuned)?)));
            let best = settled.min_by(|a, b| a.1.0.score.total_cmp(&b.1.0.score));
            let Some((one, (tuned, solved))) = best else { return fallback() };
            let trained = Radial { shape: one.shape.clone(), tuned };
            let mut surrogate = SurrogateSpec {
                variables: self.samples.variables.clone(),
                bases: vec![self.basis_on(&trained, train)],
                ..SurrogateSpec::default()
            };
            for k in 0..y.len() {
                let model = self.model(&trained, &solved, k, 0);
                surrogate.points.push(PointSpec { name: String::new(), unit: String::new(), model, half_width: 0.0 });
            }
            (0..y.len()).map(|k| test.iter().map(|x| evaluate(&surrogate, k, x).unwrap_or(f64::INFINITY)).collect()).collect()
        })
    }

    /// Further bases, at most `most`, for outputs that polynomials and the `shared` basis serve badly. Each is tuned, on `rows`,
    /// for the output that gains most, and joined by outputs that it serves as well.
    fn further(&self, shared: &Radial, scores: &Scores, rows: &[usize], open: Vec<Unserved>, most: usize) -> Vec<FurtherBasis> {
        let alone = |open: Unserved| -> Option<(f64, Unserved, Radial)> {
            let y = std::slice::from_ref(&self.y[open.output]);
            let tuned = |shape: RadialShape| {
                let begin = (shape == shared.shape).then_some(shared.tuned.parameters.as_slice());
                let tuned = self.tune_on(rows, &shape, y, begin)?;
                self.solve(Radial { shape, tuned }, y)
            };
            let shapes = self.shapes_of(shared, scores, open.output).into_iter().filter_map(tuned);
            let (radial, solved) = shapes.min_by(|a, b| a.0.tuned.score.total_cmp(&b.0.tuned.score))?;
            let left_out = root_mean_square(&solved.left_out[0]);
            let share = left_out / open.left_out.max(f64::MIN_POSITIVE);
            (share < OWN_MUST_REACH).then_some((share, Unserved { left_out, ..open }, radial))
        };
        let tried: Vec<Option<(f64, Unserved, Radial)>> = open.into_par_iter().map(alone).collect();
        let mut unserved: Vec<(f64, Unserved, Radial)> = tried.into_iter().flatten().collect();
        unserved.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found = Vec::new();
        while found.len() < most && !unserved.is_empty() {
            let (_, first, radial) = unserved.remove(0);
            let is_served = |other: &Unserved| {
                let solved = self.solve(radial.clone(), std::slice::from_ref(&self.y[other.output]));
                solved.is_some_and(|(_, solved)| root_mean_square(&solved.left_out[0]) < MAY_JOIN * other.left_out)
            };
            let (joined, rest): (Vec<_>, Vec<_>) = unserved.into_iter().partition(|(_, other, _)| is_served(other));
            unserved = rest;
            let members: Vec<Unserved> = std::iter::once(first).chain(joined.into_iter().map(|(_, other, _)| other)).collect();
            let y: Vec<Vec<f64>> = members.iter().map(|m| self.y[m.output].clone()).collect();
            let Radial { shape, tuned } = radial;
            let tuned = self.tune_on(rows, &shape, &y, Some(&tuned.parameters)).unwrap_or(tuned);
            let Some((radial, solved)) = self.solve(Radial { shape, tuned }, &y) else { continue };
            let held_out = self.radial_folds(std::slice::from_ref(&radial), &y);
            let members: Vec<Option<usize>> = (members.iter().zip(&held_out))
                .map(|(m, held_out)| (root_mean_square(held_out) < OWN_MUST_REACH * m.held_out).then_some(m.output))
                .collect();
            if members.iter().any(Option::is_some) {
                found.push(FurtherBasis { radial, members, solved, held_out });
            }
        }
        found
    }

    /// Shapes that are tried for one output alone: the shape that suits all, and Gaussians in the untransformed variables
    /// and in those of its polynomial.
    fn shapes_of(&self, shared: &Radial, scores: &Scores, output: usize) -> Vec<RadialShape> {
        let mut shapes = vec![shared.shape.clone()];
        let best = scores.iter().min_by(|a, b| a.1[output].total_cmp(&b.1[output])).map(|(t, _)| t.clone());
        for transforms in std::iter::once(vec![Transform::Identity; self.samples.variables.len()]).chain(best) {
            for kernel in [Kernel::Gaussian, Kernel::Multiquadric] {
                let shape = RadialShape { kernel, tail: 1, transforms: transforms.clone() };
                if !shapes.contains(&shape) && self.options.kernels.contains(&kernel) {
                    shapes.push(shape);
                }
            }
        }
        shapes
    }

    pub(super) fn basis(&self, one: &Radial, solved: &RbfSolution) -> RbfBasis {
        self.basis_on(one, &solved.centres.iter().map(|row| self.rows[*row]).collect::<Vec<_>>())
    }

    fn basis_on(&self, one: &Radial, centres: &[&[f64]]) -> RbfBasis {
        RbfBasis {
            kernel: one.shape.kernel,
            transforms: one.shape.transforms.clone(),
            scales: self.all_scales(one),
            centres: centres.iter().map(|x| scale_row(&self.samples.variables, &one.shape.transforms, x)).collect(),
        }
    }

    /// Inverse length scales of all variables, zero for those that do not vary.
    pub(super) fn all_scales(&self, one: &Radial) -> Vec<f64> {
        let mut tuned = one.tuned.scales().into_iter();
        self.search.active.iter().map(|active| if *active { tuned.next().unwrap_or(0.0) } else { 0.0 }).collect()
    }

    pub(super) fn model(&self, one: &Radial, solved: &RbfSolution, k: usize, basis: usize) -> PointModel {
        let tail = PolynomialSpec {
            transforms: one.shape.transforms.clone(),
            terms: self.search.terms(one.shape.tail),
            coefficients: solved.tails[k].clone(),
        };
        PointModel::Rbf { basis, weights: solved.weights[k].clone(), tail }
    }
}

/// Radial functions with shared scales, best first, and those of some outputs alone.
pub(super) struct RadialResult {
    pub(super) considered: Vec<Radial>,
    /// Left-out residuals by candidate and output.
    pub(super) left_out: Vec<ResidualRows>,
    /// Weights of the best candidate.
    pub(super) solved: RbfSolution,
    /// Held-out residuals of the procedure, by output; on more rows than centres those left out with shape and scales fixed.
    pub(super) held_out: ResidualRows,
    pub(super) further: Vec<FurtherBasis>,
}

impl RadialResult {
    /// The further basis that serves an output: its place, itself, and the output's place in it.
    pub(super) fn further_of(&self, output: usize) -> Option<(usize, &FurtherBasis, usize)> {
        let place = |f: &FurtherBasis| f.members.iter().position(|m| *m == Some(output));
        self.further.iter().enumerate().find_map(|(at, f)| Some((at, f, place(f)?)))
    }
}

/// An output that might gain from another basis, with the errors to be beaten.
struct Unserved {
    output: usize,
    left_out: f64,
    held_out: f64,
}

/// A basis tuned for some outputs; those that gain too little by it are `None`.
pub(super) struct FurtherBasis {
    pub(super) radial: Radial,
    pub(super) members: Vec<Option<usize>>,
    pub(super) solved: RbfSolution,
    pub(super) held_out: ResidualRows,
}
