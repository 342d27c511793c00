//! Polynomials in the scaled variables, their terms chosen by leave-one-out.
//!
//! Terms are products of Legendre polynomials, nearly orthogonal on a space-filling design, so one term says little about
//! another and few are needed. A forward search adds the term that reduces the residual most after both are made orthogonal
//! to the terms already in (orthogonal least squares: Chen, Billings, Luo 1989); the leave-one-out error of every length of
//! that path comes from the hat matrix. The chosen terms are expanded into monomials at the end.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::evaluate::{monomial, scale_row, scaled};
use super::least_squares::{Orthonormal, axpy, dot, left_out};
use super::model::{PolynomialSpec, Transform, VariableSpec};
use super::one_factor::{legendre, legendre_powers};
use super::tall::Tall;
use coldplate_base::numbers::root_mean_square;

/// Least ratio of the largest to the smallest value at which transforms are tried, dimensionless. Below, 1/x and ln x
/// differ from a straight line by no more than a quadratic takes up. Chosen.
const TRANSFORM_RATIO: f64 = 2.0;
/// Widest gap without rows, as a share of the range, that a transform may leave. Chosen: across a wider one 1/x would be
/// extrapolated.
const WIDEST_GAP: f64 = 1.0 / 3.0;
/// Largest ratio of the gap with a transform to the gap without, dimensionless; the larger of both limits holds. Chosen for the
/// same reason.
const WIDER_GAP: f64 = 2.0;
/// Ratio of leave-one-out errors below which a transform beats the identity, or a longer model a shorter one. Chosen:
/// smaller gains may be chance.
const CLEARLY: f64 = 0.95;
/// Largest number of terms as a share of the rows. Chosen: with more, leave-one-out no longer shows overfitting.
const MOST_TERMS: f64 = 0.5;
/// Number of further terms without a better leave-one-out error after which the forward search ends. Chosen: more
/// find later gains, at the cost of time.
const PATIENCE: usize = 12;

/// A polynomial as fitted, before expansion.
#[derive(Debug, Clone)]
pub(crate) struct FittedPolynomial {
    /// One per variable.
    pub transforms: Vec<Transform>,
    /// Legendre degrees, one row per term.
    pub terms: Vec<Vec<u8>>,
    /// One per term.
    pub coefficients: Vec<f64>,
    /// Leave-one-out residual of each row, the terms held fixed.
    pub left_out: Vec<f64>,
}

impl FittedPolynomial {
    /// Value at a condition.
    pub fn value(&self, variables: &[VariableSpec], x: &[f64]) -> f64 {
        let u = scale_row(variables, &self.transforms, x);
        self.terms.iter().zip(&self.coefficients).map(|(term, c)| c * legendre_product(term, &u)).sum()
    }

    /// Largest total degree of a term.
    pub fn degree(&self) -> usize {
        self.terms.iter().map(|t| total_degree(t)).max().unwrap_or(0)
    }

    /// The polynomial in monomials of the scaled variables, terms by total degree.
    pub(crate) fn expanded(&self) -> PolynomialSpec {
        let mut sums: BTreeMap<(usize, Vec<u8>), f64> = BTreeMap::new();
        for (term, c) in self.terms.iter().zip(&self.coefficients) {
            let mut parts = vec![(Vec::new(), *c)];
            for degree in term {
                let powers = legendre_powers(usize::from(*degree));
                parts = parts
                    .iter()
                    .flat_map(|(exponents, c)| {
                        powers.iter().enumerate().filter(|(_, p)| **p != 0.0).map(move |(power, p)| {
                            let mut exponents: Vec<u8> = exponents.clone();
                            exponents.push(power as u8);
                            (exponents, c * p)
                        })
                    })
                    .collect();
            }
            for (exponents, c) in parts {
                *sums.entry((total_degree(&exponents), exponents)).or_insert(0.0) += c;
            }
        }
        let (terms, coefficients) = sums.into_iter().map(|((_, exponents), c)| (exponents, c)).unzip();
        PolynomialSpec { transforms: self.transforms.clone(), terms, coefficients }
    }
}

/// The dictionary of the search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PolynomialSearch<'a> {
    /// The variables, with their ranges.
    pub variables: &'a [VariableSpec],
    /// Whether each variable varies; the others never enter.
    pub active: &'a [bool],
    /// Largest total degree.
    pub max_degree: usize,
}

impl PolynomialSearch<'_> {
    /// Every total-degree set of exponents of the active variables, lower degrees first.
    pub fn terms(&self, degree: usize) -> Vec<Vec<u8>> {
        let mut terms = vec![Vec::new()];
        for active in self.active {
            terms = terms
                .into_iter()
                .flat_map(|term: Vec<u8>| {
                    let room = if *active { degree - total_degree(&term) } else { 0 };
                    (0..=room).map(move |e| {
                        let mut term = term.clone();
                        term.push(e as u8);
                        term
                    })
                })
                .collect();
        }
        terms.sort_by_key(|term| (total_degree(term), std::cmp::Reverse(term.clone())));
        terms
    }

    /// Number of terms of total degree `degree`: (active + degree)! / active! degree!.
    fn count(&self, degree: usize) -> usize {
        let active = self.active.iter().filter(|a| **a).count();
        (1..=degree).fold(1, |n, k| n * (active + k) / k)
    }

    /// Largest degree whose full set has at most `most` terms.
    fn degree_within(&self, most: usize) -> usize {
        (0..=self.max_degree).rev().find(|d| self.count(*d) <= most).unwrap_or(0)
    }

    /// The widest part of a variable's range without a row, as a share of the range.
    fn gap(&self, rows: &[&[f64]], variable: usize, transform: Transform) -> f64 {
        let u = rows.iter().map(|row| scaled(&self.variables[variable], transform, row[variable]));
        let mut u: Vec<f64> = u.chain([-1.0, 1.0]).collect();
        u.sort_by(f64::total_cmp);
        u.windows(2).map(|pair| 0.5 * (pair[1] - pair[0])).fold(0.0, f64::max)
    }

    /// Every combination of transforms worth trying on these rows, the identity first.
    pub fn transforms(&self, rows: &[&[f64]]) -> Vec<Vec<Transform>> {
        let choices: Vec<Vec<Transform>> = self
            .variables
            .iter()
            .zip(self.active)
            .enumerate()
            .map(|(k, (v, active))| {
                let wide = *active && v.low > 0.0 && v.high >= TRANSFORM_RATIO * v.low;
                let all = if wide { &[Transform::Identity, Transform::Reciprocal, Transform::Log][..] } else { &[Transform::Identity] };
                let widest = if wide { WIDEST_GAP.max(WIDER_GAP * self.gap(rows, k, Transform::Identity)) } else { 1.0 };
                let is_covered = |t: Transform| t == Transform::Identity || self.gap(rows, k, t) <= widest;
                all.iter().copied().filter(|t| t.is_allowed(v.low, v.high) && is_covered(*t)).collect()
            })
            .collect();
        let mut all = vec![Vec::new()];
        // More than four wide variables: the further ones keep the identity, 3^n combinations would be too many.
        for (k, choice) in choices.iter().enumerate() {
            let wide_before = choices[..k].iter().filter(|c| c.len() > 1).count();
            let choice = if wide_before >= 4 { &choice[..1] } else { &choice[..] };
            all = all
                .into_iter()
                .flat_map(|row: Vec<Transform>| {
                    choice.iter().map(move |t| {
                        let mut row = row.clone();
                        row.push(*t);
                        row
                    })
                })
                .collect();
        }
        all
    }

    pub(super) fn columns(&self, rows: &[&[f64]], transforms: &[Transform], terms: &[Vec<u8>]) -> Vec<Vec<f64>> {
        let most = terms.iter().flatten().copied().max().unwrap_or(0);
        let tables: Vec<Vec<Vec<f64>>> = rows
            .iter()
            .map(|x| {
                let u = scale_row(self.variables, transforms, x);
                u.iter().map(|u| (0..=usize::from(most)).map(|k| legendre(k, *u)).collect()).collect()
            })
            .collect();
        terms
            .iter()
            .map(|term| tables.iter().map(|row| term.iter().zip(row).map(|(e, powers)| powers[usize::from(*e)]).product()).collect())
            .collect()
    }

    /// Root mean square leave-one-out error of the full polynomial of moderate degree (a quarter as many terms as rows),
    /// for each combination of transforms and each output: `scores[combination][output]`.
    pub(crate) fn transform_scores(&self, rows: &[&[f64]], outputs: &[Vec<f64>]) -> Vec<(Vec<Transform>, Vec<f64>)> {
        let terms = self.terms(self.degree_within(rows.len() / 4));
        self.transforms(rows)
            .into_iter()
            .map(|transforms| {
                let mut basis = Orthonormal::new();
                for column in self.columns(rows, &transforms, &terms) {
                    basis.push(&column);
                }
                let h = basis.leverages(rows.len());
                let scores = outputs
                    .iter()
                    .map(|y| {
                        let mut residuals = y.clone();
                        basis.project_out(&mut residuals);
                        root_mean_square(&left_out(&residuals, &h))
                    })
                    .collect();
                (transforms, scores)
            })
            .collect()
    }

    /// Degrees of the dictionaries worth trying on this many rows, the smallest first: from the largest degree with a quarter
    /// as many terms as rows on.
    pub fn degrees(&self, rows: usize) -> Vec<usize> {
        (self.degree_within(rows / 4)..=self.max_degree).collect()
    }

    /// The whole procedure for dictionaries, all terms up to each of `degrees`: transforms and terms by leave-one-out;
    /// `fitted[degree][output]`. The choice of the dictionary is not made here, since the terms of a large one, chosen on the same
    /// rows, make leave-one-out too small. `scores` are the results of [`PolynomialSearch::transform_scores`] on these rows.
    ///
    /// The columns are made once for all outputs of the same transforms, and those of a smaller dictionary are the first of them.
    pub fn fit(
        &self,
        rows: &[&[f64]],
        outputs: &[Vec<f64>],
        scores: &[(Vec<Transform>, Vec<f64>)],
        degrees: &[usize],
    ) -> Vec<Vec<FittedPolynomial>> {
        let mut by_transforms: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for k in 0..outputs.len() {
            let best = (0..scores.len()).min_by(|a, b| scores[*a].1[k].total_cmp(&scores[*b].1[k]));
            let chosen = best.filter(|best| scores[*best].1[k] < CLEARLY * scores[0].1[k]).unwrap_or(0);
            by_transforms.entry(chosen).or_default().push(k);
        }
        let most = ((rows.len() as f64 * MOST_TERMS) as usize).max(1);
        let terms = self.terms(degrees.iter().copied().max().unwrap_or(0));
        let mut fitted: Vec<Vec<FittedPolynomial>> = degrees.iter().map(|_| outputs.iter().map(|y| self.constant(y)).collect()).collect();
        for (chosen, members) in by_transforms {
            let Some((transforms, _)) = scores.get(chosen) else { continue };
            let columns = self.columns(rows, transforms, &terms);
            let of_degrees = |k: &usize| -> Vec<FittedPolynomial> {
                let of_degree = |degree: &usize| {
                    let columns = &columns[..self.count(*degree)];
                    solve(columns, &terms, &forward(columns, &outputs[*k], most, true), &outputs[*k], transforms)
                };
                degrees.iter().map(of_degree).collect()
            };
            let found: Vec<Vec<FittedPolynomial>> = members.par_iter().map(of_degrees).collect();
            for (k, found) in members.into_iter().zip(found) {
                fitted.iter_mut().zip(found).for_each(|(all, one)| all[k] = one);
            }
        }
        fitted
    }

    /// A polynomial of the same transforms and terms with coefficients by least squares on more rows; as it is where these do not
    /// determine them.
    pub fn with_all(&self, rows: &[&[f64]], y: &[f64], fitted: FittedPolynomial) -> FittedPolynomial {
        let block = |range: Range<usize>| {
            let columns = self.columns(&rows[range.clone()], &fitted.transforms, &fitted.terms);
            DMatrix::from_iterator(range.len(), columns.len(), columns.into_iter().flatten())
        };
        let tall = Tall { rows: rows.len(), block: &block, turn: None };
        let outputs = [y.to_vec()];
        let solved = tall.solve(&tall.products(&outputs), &vec![0.0; fitted.terms.len()], &outputs);
        match solved.map(|found| (found.coefficients.into_iter().next(), found.left_out.into_iter().next())) {
            Some((Some(coefficients), Some(left_out))) => FittedPolynomial { coefficients, left_out, ..fitted },
            _ => fitted,
        }
    }

    fn constant(&self, y: &[f64]) -> FittedPolynomial {
        let n = y.len() as f64;
        let mean = y.iter().sum::<f64>() / n;
        FittedPolynomial {
            transforms: vec![Transform::Identity; self.variables.len()],
            terms: vec![vec![0; self.variables.len()]],
            coefficients: vec![mean],
            left_out: y.iter().map(|y| (y - mean) * n / (n - 1.0)).collect(),
        }
    }
}

/// Forward search by the corrected leave-one-out error. Returns the columns of the best length, in order.
///
/// The search keeps, of every column x, the square of its part orthogonal to the terms already in, and its product with the residual.
/// A new term q lowers them by (qᵀx)² and by qᵀx times the coefficient of q: one product with each column a step.
pub(super) fn forward(columns: &[Vec<f64>], y: &[f64], most: usize, has_level: bool) -> Vec<usize> {
    let n = y.len();
    let sizes: Vec<f64> = columns.iter().map(|c| dot(c, c)).collect();
    let mut left = sizes.clone();
    let mut along: Vec<f64> = columns.iter().map(|c| dot(c, y)).collect();
    let mut terms: Vec<Vec<f64>> = Vec::new();
    let (mut residual, mut h) = (y.to_vec(), vec![0.0; n]);
    let (mut picked, mut path): (Vec<usize>, Vec<f64>) = (Vec::new(), Vec::new());
    let floor = 1e-14 * root_mean_square(y);
    while picked.len() < most.min(columns.len()) {
        // A column that nearly depends on earlier ones would bring in rounding errors.
        let gain = |j: usize| if left[j] > 1e-10 * sizes[j] { along[j].powi(2) / left[j] } else { -1.0 };
        // The constant comes first where there is one: every model of temperatures has a level.
        let next = if has_level && picked.is_empty() {
            Some(0)
        } else {
            let gains = (0..columns.len()).map(|j| (j, gain(j))).filter(|(_, g)| *g > 0.0);
            gains.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))).map(|(j, _)| j)
        };
        let Some(j) = next else { break };
        left[j] = 0.0;
        let mut q = columns[j].clone();
        for term in &terms {
            let d = dot(term, &q);
            axpy(&mut q, -d, term);
        }
        let size = dot(&q, &q).sqrt();
        q.iter_mut().for_each(|x| *x /= size);
        let c = dot(&q, &residual);
        axpy(&mut residual, -c, &q);
        h.iter_mut().zip(&q).for_each(|(h, q)| *h += q * q);
        for ((column, left), along) in columns.iter().zip(&mut left).zip(&mut along).filter(|((_, left), _)| **left > 0.0) {
            let g = dot(&q, column);
            *left -= g * g;
            *along -= g * c;
        }
        terms.push(q);
        picked.push(j);
        let p = picked.len() as f64;
        // Terms were picked by the same rows; n / (n - p) keeps the path's score from rewarding that.
        path.push(root_mean_square(&left_out(&residual, &h)) * (n as f64 / (n as f64 - p).max(1.0)).sqrt());
        let best = path.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(k, _)| k);
        if path.len() > best + PATIENCE || root_mean_square(&residual) < floor {
            break;
        }
    }
    let best = path.iter().copied().fold(f64::INFINITY, f64::min);
    // The shortest path that is as good as the best to within five per cent.
    let length = path.iter().position(|s| *s * CLEARLY <= best).map_or(picked.len(), |k| k + 1);
    picked.truncate(length);
    picked
}

fn solve(columns: &[Vec<f64>], terms: &[Vec<u8>], picked: &[usize], y: &[f64], transforms: &[Transform]) -> FittedPolynomial {
    let mut order = picked.to_vec();
    order.sort_unstable();
    let mut basis = Orthonormal::new();
    order.retain(|j| basis.push(&columns[*j]));
    let mut residuals = y.to_vec();
    let c = basis.project_out(&mut residuals);
    FittedPolynomial {
        transforms: transforms.to_vec(),
        coefficients: basis.back_substitute(&c),
        left_out: left_out(&residuals, &basis.leverages(y.len())),
        terms: order.iter().map(|j| terms[*j].clone()).collect(),
    }
}

fn total_degree(term: &[u8]) -> usize {
    term.iter().map(|e| usize::from(*e)).sum()
}

fn legendre_product(term: &[u8], u: &[f64]) -> f64 {
    term.iter().zip(u).map(|(k, u)| legendre(usize::from(*k), *u)).product()
}

/// Monomials of total degree up to `degree` in scaled rows, as columns: the tail of radial functions.
pub(super) fn monomial_columns(rows: &[Vec<f64>], terms: &[Vec<u8>]) -> Vec<Vec<f64>> {
    terms.iter().map(|term| rows.iter().map(|u| monomial(term, u)).collect()).collect()
}
