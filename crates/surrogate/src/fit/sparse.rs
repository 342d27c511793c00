//! Radial functions of fewer centres than rows, by penalised least squares on all rows.
//!
//! With centres z_k among the rows, K_ik = φ(|S (u_i - z_k)|) between rows and centres, C the same between centres, and F
//! the tail, weights w and coefficients c minimise
//!
//! ```text
//! |y - K w - F c|² + λ wᵀ C w     with Fᵀ w = 0 at the centres
//! ```
//!
//! If every row is a centre, this is the smoothed interpolant of [`super::rbf`]; with fewer it is the Gaussian process of the
//! *subset of regressors* (Quiñonero-Candela, Rasmussen 2005). The constraint is met by w = N L⁻ᵀ v with N from reflections
//! of the tail and L Lᵀ = Nᵀ C N, so that the penalty is λ |v|² and the columns are nearly orthogonal. Time is rows × centres².
//!
//! The centres are spread out by their scaled distances: each is the row farthest from those before it.

use std::ops::Range;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::dense::{Reflections, inverse_factor};
use super::evaluate::{monomial, radial};
use super::model::Kernel;
use super::rbf::{RbfSolution, left_out_score, sign};
use super::tall::Tall;
use super::tune::{MORE, MOST_RAISES, Tuned};

/// Share of the mean diagonal of Nᵀ C N that is added to it at first, and the factor by which it is raised until the matrix
/// can be factored. Chosen: the rounding of a matrix of 1000 rows. The functions spanned stay the same, only their penalty changes.
const RIDGE: (f64, f64) = (1e-13, 10.0);
/// Most raises of that share. Chosen: up to a hundredth.
const MOST_RIDGES: usize = 11;

/// Rows in scaled variables and outputs on them.
pub(super) struct SparseSystem<'a> {
    /// Rows, one value per variable each.
    pub rows: &'a [Vec<f64>],
    /// Inverse length scales of all variables, zero for those that do not vary.
    pub scales: &'a [f64],
    /// Kernel.
    pub kernel: Kernel,
    /// Exponents of the tail.
    pub tail: &'a [Vec<u8>],
    /// Values, output by output.
    pub outputs: &'a [Vec<f64>],
}

impl SparseSystem<'_> {
    /// Weights of `count` centres, the centres themselves, and the parameters with as much more smoothing as the weights need;
    /// their score is the mean log of the squared left-out residuals.
    pub fn solve(&self, mut tuned: Tuned, count: usize) -> Option<(Tuned, RbfSolution)> {
        let stretched = self.stretched();
        let centres = spread_out(&stretched, count);
        let at = |centre: &usize| stretched[*centre].as_slice();
        let width = self.tail.len() + centres.len();
        let block = |range: Range<usize>| {
            let value = |i: usize, k: usize| match centres.get(k) {
                Some(centre) => sign(self.kernel) * radial(self.kernel, distance_square(&stretched[range.start + i], at(centre))),
                None => monomial(&self.tail[k - centres.len()], &self.rows[range.start + i]),
            };
            DMatrix::from_fn(range.len(), width, value)
        };
        let turn = self.turn(&stretched, &centres)?;
        let tall = Tall { rows: self.rows.len(), block: &block, turn: Some(&turn) };
        let products = tall.products(self.outputs);
        let penalised = turn.ncols() - self.tail.len();
        for _ in 0..MOST_RAISES {
            let penalty: Vec<f64> = (0..turn.ncols()).map(|k| if k < penalised { tuned.smoothing() } else { 0.0 }).collect();
            let solved = tall.solve(&products, &penalty, self.outputs);
            if let Some(found) = solved {
                let weights = |c: &Vec<f64>| c[..centres.len()].iter().map(|w| sign(self.kernel) * w).collect();
                let solution = RbfSolution {
                    weights: found.coefficients.iter().map(weights).collect(),
                    tails: found.coefficients.iter().map(|c| c[centres.len()..].to_vec()).collect(),
                    left_out: found.left_out,
                    centres: centres.clone(),
                };
                if solution.is_well_conditioned(self.outputs) {
                    tuned.score = left_out_score(&solution.left_out, self.outputs);
                    return Some((tuned, solution));
                }
            }
            *tuned.parameters.last_mut()? += MORE.ln();
        }
        None
    }

    fn stretched(&self) -> Vec<Vec<f64>> {
        self.rows.iter().map(|u| u.iter().zip(self.scales).map(|(u, s)| u * s).collect()).collect()
    }

    /// N L⁻ᵀ for the weights, and the identity for the tail.
    fn turn(&self, stretched: &[Vec<f64>], centres: &[usize]) -> Option<DMatrix<f64>> {
        let tail: Vec<Vec<f64>> =
            self.tail.iter().map(|term| centres.iter().map(|centre| monomial(term, &self.rows[*centre])).collect()).collect();
        let reflections = Reflections::of(&tail)?;
        let between =
            |i: usize, j: usize| sign(self.kernel) * radial(self.kernel, distance_square(&stretched[centres[i]], &stretched[centres[j]]));
        let reduced = reflections.reduce(DMatrix::from_fn(centres.len(), centres.len(), between));
        let mean = reduced.trace() / reduced.nrows().max(1) as f64;
        let factor = (0..MOST_RIDGES).find_map(|raises| {
            let ridge = mean * RIDGE.0 * RIDGE.1.powi(raises as i32);
            let mut ridged = reduced.clone();
            (0..ridged.nrows()).for_each(|i| ridged[(i, i)] += ridge);
            inverse_factor(ridged, &mut 0.0)
        })?;
        let own = reflections.expand_columns(&factor.transpose());
        let mut turn = DMatrix::zeros(own.nrows() + self.tail.len(), own.ncols() + self.tail.len());
        turn.view_mut((0, 0), own.shape()).copy_from(&own);
        turn.view_mut(own.shape(), (self.tail.len(), self.tail.len())).fill_with_identity();
        Some(turn)
    }
}

fn distance_square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Indices of `count` places far from each other, in rising order: the first is nearest to the middle of all, each further one is
/// the place farthest from those before it.
fn spread_out(places: &[Vec<f64>], count: usize) -> Vec<usize> {
    let width = places.first().map_or(0, Vec::len);
    let middle: Vec<f64> = (0..width).map(|k| places.iter().map(|u| u[k]).sum::<f64>() / places.len() as f64).collect();
    let mut to_nearest: Vec<f64> = places.par_iter().map(|u| -distance_square(u, &middle)).collect();
    let mut chosen = Vec::with_capacity(count);
    while chosen.len() < count.min(places.len()) {
        // The first of equals, so that the choice is the same everywhere.
        let farthest = (0..places.len()).reduce(|a, b| if to_nearest[b] > to_nearest[a] { b } else { a });
        let Some(next) = farthest else { break };
        if chosen.is_empty() {
            to_nearest.fill(f64::INFINITY);
        }
        chosen.push(next);
        let own = &places[next];
        to_nearest.par_iter_mut().zip(places).for_each(|(nearest, u)| *nearest = nearest.min(distance_square(u, own)));
    }
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::rbf::RbfSystem;
    use coldplate_base::random::Random;

    /// With every row a centre, values and left-out residuals are those of the saddle system. The weights are not: some of their
    /// combinations change no value.
    #[test]
    fn with_all_rows_as_centres_it_is_the_smoothed_interpolant() {
        let mut random = Random::new(3);
        let rows: Vec<Vec<f64>> = (0..70).map(|_| (0..2).map(|_| 2.0 * random.unit() - 1.0).collect()).collect();
        let outputs =
            vec![rows.iter().map(|u| (2.0 * u[0]).sin() + u[1]).collect(), rows.iter().map(|u| 20.0 + (u[0] * u[1]).exp()).collect()];
        let tail = [vec![0, 0], vec![1, 0], vec![0, 1]];
        let scales = [0.9, 1.4];
        for kernel in [Kernel::Gaussian, Kernel::Multiquadric, Kernel::ThinPlate, Kernel::Cubic] {
            for smoothing in [1e-5, 0.05] {
                let dense = RbfSystem::new(rows.clone(), vec![0, 1], tail.to_vec(), outputs.clone()).unwrap();
                let wanted = dense.solve(kernel, &scales, smoothing).unwrap();
                let system = SparseSystem { rows: &rows, scales: &scales, kernel, tail: &tail, outputs: &outputs };
                let parameters = scales.iter().chain([&smoothing]).map(|p| p.ln()).collect();
                let (tuned, found) = system.solve(Tuned { parameters, score: 0.0 }, rows.len()).unwrap();
                assert!((tuned.smoothing() / smoothing - 1.0).abs() < 1e-12);
                assert_eq!(found.centres, wanted.centres);
                for o in 0..outputs.len() {
                    let value = |own: &RbfSolution, u: &[f64]| -> f64 {
                        let square = |z: &[f64]| u.iter().zip(z).zip(&scales).map(|((u, z), s)| (s * (u - z)).powi(2)).sum();
                        let radial: f64 = own.weights[o].iter().zip(&rows).map(|(w, z)| w * radial(kernel, square(z))).sum();
                        radial + own.tails[o].iter().zip(&tail).map(|(c, term)| c * monomial(term, u)).sum::<f64>()
                    };
                    for u in [[0.1, -0.3], [0.95, 0.9], [-0.6, 0.2]] {
                        let error = value(&found, &u) - value(&wanted, &u);
                        assert!(error.abs() < 1e-7, "{kernel:?} {smoothing}: {error:e}");
                    }
                    for (a, b) in found.left_out[o].iter().zip(&wanted.left_out[o]) {
                        assert!((a - b).abs() < 1e-7, "{kernel:?} {smoothing}: {a} left out, {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn centres_are_spread_out() {
        // The middle, then both ends, then the middles of what is left.
        let places: Vec<Vec<f64>> = (0..9).map(|i| vec![f64::from(i)]).collect();
        assert_eq!(spread_out(&places, 5), [0, 2, 4, 6, 8]);
        assert_eq!(spread_out(&places, 20).len(), 9);
    }
}
