//! From samples to a surrogate: candidates, cross-validation of each whole procedure, choice, band.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::evaluate::{evaluate, scale_row};
use super::least_squares::{max_abs, rms};
use super::model::{Kernel, Point, PointModel, Polynomial, RbfBasis, Surrogate, Transform};
use super::polynomial::{Fitted, Search};
use super::rbf::{Solved, System, least_tail, spread};
use super::tune::{Tuned, retune, tune};
use super::validation::{folds, half_width};
use super::{Candidate, Family, Fit, FitOptions, PointReport, Residuals, Samples};
use crate::error::{Error, Result};
use crate::foundation::progress::Progress;

/// Radial functions cost a query more than a polynomial: they must beat it by this share of the held-out error.
const RADIAL_MUST_BEAT: f64 = 0.95;
/// Scales of its own must reduce an output's error to this share of the one with shared scales.
const OWN_MUST_REACH: f64 = 0.7;
/// A change of transforms, kernel or tail must lower the mean log of squared errors by this much (2.5 % of the error).
const CLEARLY: f64 = 0.05;
/// Length scales are tuned on at most this many rows.
const TUNE_ROWS: usize = 400;
/// Radial functions are not tried on more rows: every row is a centre.
const MOST_CENTRES: usize = 1500;
/// Steps of the tuning on all rows and in each fold.
const STEPS: usize = 30;
const FOLD_STEPS: usize = 10;
/// Largest sum of weights' magnitudes over the largest value (at least one): it multiplies the rounding of every query.
const MOST_WEIGHT: f64 = 1e6;
/// Kernel and tail combinations that go into cross-validation: all where that is cheap, for there the choice among them is
/// also where chance misleads most; fewer on more rows. Pairs of most rows and number.
const SHORTLIST: [(usize, usize); 3] = [(60, usize::MAX), (120, 4), (usize::MAX, 2)];

/// Fits every output of `samples`, saying how it comes along.
///
/// The result depends only on the samples and options, not on the number of threads.
///
/// # Errors
/// Bad input: rows and values that do not match, a missing condition, too few rows for an output (three more than varying
/// variables are needed), nothing to choose from in `options`. Numerics: no candidate could be fitted to an output.
pub fn fit_heard(samples: &Samples, options: &FitOptions, progress: &dyn Progress) -> Result<Fit> {
    let samples = samples.checked()?;
    if options.folds < 2 || !(options.coverage > 0.0 && options.coverage < 1.0) || options.max_degree > 12 {
        return Err(Error::input("options of the fit: at least 2 folds, coverage between 0 and 1, degree at most 12"));
    }
    if !options.polynomials && options.kernels.is_empty() {
        return Err(Error::input("options of the fit leave neither polynomials nor radial functions to choose from"));
    }
    let mut notes = Vec::new();
    let active: Vec<bool> = samples.variables.iter().map(|v| v.high > v.low).collect();
    for (variable, _) in samples.variables.iter().zip(&active).filter(|(_, active)| !**active) {
        notes.push(format!("{} does not vary (always {} {}): the fit leaves it out", variable.name, variable.low, variable.unit));
    }
    // Outputs present on the same rows share their length scales and are treated together.
    let mut groups: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
    for (o, output) in samples.outputs.iter().enumerate() {
        let rows: Vec<usize> = (0..samples.rows.len()).filter(|i| !output.values[*i].is_nan()).collect();
        let need = active.iter().filter(|a| **a).count() + 3;
        if rows.len() < need {
            return Err(Error::input(format!("too few rows to fit: {} of {} have a value", rows.len(), samples.rows.len()))
                .at_key(output.name.clone())
                .help(format!("at least {need} are needed, ten times the number of variables is a good start")));
        }
        if rows.len() < samples.rows.len() {
            let missing = samples.rows.len() - rows.len();
            notes.push(format!("{}: {missing} of {} rows have no value and are left out", output.name, samples.rows.len()));
        }
        groups.entry(rows).or_default().push(o);
    }
    let mut surrogate = Surrogate { variables: samples.variables.clone(), ..Surrogate::default() };
    let mut found: Vec<Option<(PointModel, PointReport)>> = vec![None; samples.outputs.len()];
    let many = groups.len();
    for (rows, outputs) in groups {
        let group = Group::new(&samples, options, &active, rows, outputs);
        progress.at(&format!("fit of {} outputs on {} rows: polynomials", group.outputs.len(), group.rows.len()));
        let bases = if many == 1 { options.max_bases } else { options.max_bases.min(1) };
        for (o, model, report) in group.fit(bases, &mut surrogate.bases, progress)? {
            found[o] = Some((model, report));
        }
    }
    let mut points = Vec::new();
    for (model, report) in found.into_iter().flatten() {
        let half_width = report.half_width;
        surrogate.points.push(Point { name: report.name.clone(), unit: report.unit.clone(), model, half_width });
        points.push(report);
    }
    if let Some((o, i)) = (0..points.len())
        .flat_map(|o| (0..samples.rows.len()).map(move |i| (o, i)))
        .find(|(o, i)| !evaluate(&surrogate, *o, &samples.rows[*i]).is_ok_and(f64::is_finite))
    {
        return Err(Error::numerics(format!("the fit of {} has no finite value at row {}", points[o].name, i + 1)));
    }
    Ok(Fit { surrogate, points, notes })
}

/// Outputs that are present on the same rows.
struct Group<'a> {
    samples: &'a Samples,
    options: &'a FitOptions,
    search: Search<'a>,
    rows: Vec<&'a [f64]>,
    outputs: Vec<usize>,
    /// Values of the outputs on the rows.
    y: Vec<Vec<f64>>,
    folds: Vec<usize>,
    fold_count: usize,
}

/// Kernel, tail and how the variables enter.
#[derive(Debug, Clone, PartialEq)]
struct Shape {
    kernel: Kernel,
    tail: usize,
    transforms: Vec<Transform>,
}

/// A shape with tuned parameters.
#[derive(Debug, Clone)]
struct Radial {
    shape: Shape,
    tuned: Tuned,
}

/// Residuals by row, one list per output treated.
type Rows = Vec<Vec<f64>>;

impl<'a> Group<'a> {
    fn new(samples: &'a Samples, options: &'a FitOptions, active: &'a [bool], rows: Vec<usize>, outputs: Vec<usize>) -> Self {
        let y = outputs.iter().map(|o| rows.iter().map(|i| samples.outputs[*o].values[*i]).collect()).collect();
        let rows: Vec<&[f64]> = rows.iter().map(|i| samples.rows[*i].as_slice()).collect();
        let search = Search { variables: &samples.variables, active, max_degree: options.max_degree };
        let fold_count = options.folds.min(rows.len());
        let folds = folds(&rows, fold_count, options.seed);
        Self { samples, options, search, rows, outputs, y, folds, fold_count }
    }

    fn fit(&self, most_bases: usize, bases: &mut Vec<RbfBasis>, progress: &dyn Progress) -> Result<Vec<(usize, PointModel, PointReport)>> {
        let scores = self.search.transform_scores(&self.rows, &self.y);
        let (polynomials, polynomial_held_out) = if self.options.polynomials {
            (Some(self.polynomials(&self.rows, &self.y, &scores)), Some(self.polynomial_folds()))
        } else {
            (None, None)
        };
        let usable =
            !self.options.kernels.is_empty() && most_bases > 0 && self.rows.len() <= MOST_CENTRES && self.search.active.contains(&true);
        if usable {
            progress.at(&format!("fit of {} outputs on {} rows: radial functions", self.outputs.len(), self.rows.len()));
        }
        let radial = if usable { self.radial(&scores, polynomial_held_out.as_ref(), most_bases) } else { None };
        let shared_basis = bases.len();
        let mut own_bases: BTreeMap<usize, usize> = BTreeMap::new();
        let mut shared_used = false;
        let mut result = Vec::new();
        for (k, o) in self.outputs.iter().enumerate() {
            let mut candidates = Vec::new();
            // The candidates: index, its held-out residuals, the share by which it must beat those before.
            let mut choices: Vec<(usize, &[f64], f64)> = Vec::new();
            if let (Some(fitted), Some(held_out)) = (&polynomials, &polynomial_held_out) {
                candidates.push(polynomial_candidate(&fitted[k], &held_out[k]));
                choices.push((0, &held_out[k], 1.0));
            }
            if let Some(radial) = &radial {
                for (index, one) in radial.considered.iter().enumerate() {
                    let held_out = (index == 0).then_some(radial.held_out[k].as_slice());
                    candidates.push(self.radial_candidate(one, false, &radial.left_out[index][k], held_out));
                    choices.extend(held_out.map(|held_out| (candidates.len() - 1, held_out, RADIAL_MUST_BEAT)));
                }
                if let Some(own) = radial.own.get(&k) {
                    candidates.push(self.radial_candidate(&own.radial, true, &own.solved.left_out[0], Some(&own.held_out)));
                    choices.push((candidates.len() - 1, &own.held_out, RADIAL_MUST_BEAT));
                }
            }
            let chosen = choose(&choices, |_| true).map(|index| (index, self.held_out_of_choice(&choices)));
            let output = &self.samples.outputs[*o];
            let Some((index, held_out)) = chosen else {
                return Err(Error::numerics("no model could be fitted").at_key(output.name.clone()));
            };
            let model = match (&candidates[index].family, &polynomials, &radial) {
                (Family::Polynomial { .. }, Some(fitted), _) => PointModel::Polynomial(fitted[k].expanded()),
                (Family::Rbf { own: false, .. }, _, Some(radial)) => {
                    shared_used = true;
                    self.model(&radial.considered[0], &radial.solved, k, shared_basis)
                }
                (Family::Rbf { own: true, .. }, _, Some(radial)) => {
                    own_bases.insert(k, index);
                    let own = &radial.own[&k];
                    self.model(&own.radial, &own.solved, 0, usize::MAX)
                }
                _ => return Err(Error::numerics("no model could be fitted").at_key(output.name.clone())),
            };
            // Rounding alone leaves errors of a few units in the last place.
            let floor = 64.0 * f64::EPSILON * max_abs(&self.y[k]);
            let report = PointReport {
                name: output.name.clone(),
                unit: output.unit.clone(),
                rows: self.rows.len(),
                chosen: candidates[index].clone(),
                half_width: half_width(&held_out, self.options.coverage).max(floor),
                candidates,
            };
            result.push((*o, model, report));
        }
        if let Some(radial) = &radial {
            if shared_used {
                bases.push(self.basis(&radial.considered[0]));
            }
            for (k, own) in radial.own.iter().filter(|(k, _)| own_bases.contains_key(k)) {
                if let PointModel::Rbf { basis, .. } = &mut result[*k].1 {
                    *basis = bases.len();
                }
                bases.push(self.basis(&own.radial));
            }
        }
        Ok(result)
    }

    /// Held-out residuals of the choice too: those of a fold come from the model that the other folds would choose.
    fn held_out_of_choice(&self, choices: &[(usize, &[f64], f64)]) -> Vec<f64> {
        let by_fold: Vec<Option<usize>> = (0..self.fold_count).map(|fold| choose(choices, |row| self.folds[row] != fold)).collect();
        let residual = |row: usize| {
            let index = by_fold.get(self.folds[row]).copied().flatten()?;
            choices.iter().find(|c| c.0 == index)?.1.get(row).copied()
        };
        (0..self.rows.len()).map(|row| residual(row).unwrap_or(f64::INFINITY)).collect()
    }

    // ---- polynomials ----

    fn polynomials(&self, rows: &[&[f64]], y: &[Vec<f64>], scores: &[(Vec<Transform>, Vec<f64>)]) -> Vec<Fitted> {
        y.par_iter()
            .enumerate()
            .map(|(k, y)| {
                let scores: Vec<(Vec<Transform>, f64)> = scores.iter().map(|(t, s)| (t.clone(), s[k])).collect();
                self.search.fit(rows, y, &scores)
            })
            .collect()
    }

    /// Held-out residuals of the whole polynomial procedure, transforms and terms chosen in each fold.
    fn polynomial_folds(&self) -> Rows {
        self.by_fold(&self.y, |train, test, y| {
            let scores = self.search.transform_scores(train, y);
            let fitted = self.polynomials(train, y, &scores);
            fitted.iter().map(|f| test.iter().map(|x| f.value(&self.samples.variables, x)).collect()).collect()
        })
    }

    /// Residuals of predictions of each fold made from the other folds: `predict(train, test, outputs on train)`.
    fn by_fold(&self, y: &[Vec<f64>], predict: impl Fn(&[&[f64]], &[&[f64]], &[Vec<f64>]) -> Rows + Sync) -> Rows {
        let parts: Vec<(Vec<usize>, Rows)> = (0..self.fold_count)
            .into_par_iter()
            .map(|fold| {
                let (test, train): (Vec<usize>, Vec<usize>) = (0..self.rows.len()).partition(|i| self.folds[*i] == fold);
                let take = |index: &[usize]| index.iter().map(|i| self.rows[*i]).collect::<Vec<_>>();
                let known: Vec<Vec<f64>> = y.iter().map(|y| train.iter().map(|i| y[*i]).collect()).collect();
                let predicted = predict(&take(&train), &take(&test), &known);
                (test, predicted)
            })
            .collect();
        let mut residuals: Rows = y.iter().map(|y| vec![f64::INFINITY; y.len()]).collect();
        for (test, predicted) in &parts {
            for ((residuals, y), predicted) in residuals.iter_mut().zip(y).zip(predicted) {
                test.iter().zip(predicted).for_each(|(i, p)| residuals[*i] = y[*i] - p);
            }
        }
        residuals
    }

    // ---- radial functions ----

    fn system(&self, rows: &[&[f64]], shape: &Shape, y: &[Vec<f64>]) -> Option<System> {
        let u = rows.iter().map(|x| scale_row(&self.samples.variables, &shape.transforms, x)).collect();
        let active = (0..self.search.active.len()).filter(|k| self.search.active[*k]).collect();
        System::new(u, active, self.search.terms(shape.tail), y.to_vec())
    }

    fn solve(&self, one: &Radial, y: &[Vec<f64>]) -> Option<Solved> {
        self.system(&self.rows, &one.shape, y)?.solve(one.shape.kernel, &one.tuned.scales(), one.tuned.smoothing())
    }

    /// The rows on which length scales are tuned: all, or an even share of the shuffled folds.
    fn tuning_rows(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.rows.len()).collect();
        if order.len() > TUNE_ROWS {
            let spread_out = folds(&self.rows, self.rows.len(), self.options.seed.wrapping_add(1));
            order.sort_by_key(|i| spread_out[*i]);
            order.truncate(TUNE_ROWS);
            order.sort_unstable();
        }
        order
    }

    fn tune_on(&self, index: &[usize], shape: &Shape, y: &[Vec<f64>], begin: Option<&[f64]>, steps: usize) -> Option<Tuned> {
        let rows: Vec<&[f64]> = index.iter().map(|i| self.rows[*i]).collect();
        let y: Vec<Vec<f64>> = y.iter().map(|y| index.iter().map(|i| y[*i]).collect()).collect();
        let system = self.system(&rows, shape, &y)?;
        match begin {
            Some(begin) => retune(&system, shape.kernel, self.options.tuning, begin, steps),
            None => tune(&system, shape.kernel, self.options.tuning, steps),
        }
    }

    fn radial(&self, scores: &[(Vec<Transform>, Vec<f64>)], rival: Option<&Rows>, most_bases: usize) -> Option<RadialResult> {
        let rows = self.tuning_rows();
        let candidates = |shapes: Vec<Shape>| -> Vec<Radial> {
            shapes
                .into_par_iter()
                .filter_map(|shape| self.tune_on(&rows, &shape, &self.y, None, STEPS).map(|tuned| Radial { shape, tuned }))
                .collect()
        };
        // How the variables enter, by the first kernel with a linear tail: the identity, what suits the polynomials best, or
        // that with ln x for 1/x, which stretches the small end less.
        let joint = |s: &[f64]| s.iter().map(|s| s.max(f64::MIN_POSITIVE).ln()).sum::<f64>();
        let best = scores.iter().min_by(|a, b| joint(&a.1).total_cmp(&joint(&b.1))).map(|(t, _)| t.clone())?;
        let milder = best.iter().map(|t| if *t == Transform::Reciprocal { Transform::Log } else { *t }).collect();
        let mut ways = vec![vec![Transform::Identity; self.samples.variables.len()], best, milder];
        ways.dedup();
        let kernel = *self.options.kernels.first()?;
        let first = candidates(ways.into_iter().map(|transforms| Shape { kernel, tail: 1, transforms }).collect());
        let first = first.into_iter().reduce(|a, b| if b.tuned.score < a.tuned.score - CLEARLY { b } else { a })?;
        let transforms = first.shape.transforms.clone();
        let rest: Vec<Shape> = self
            .options
            .kernels
            .iter()
            .flat_map(|kernel| (least_tail(*kernel)..=2).map(|tail| Shape { kernel: *kernel, tail, transforms: transforms.clone() }))
            .filter(|shape| *shape != first.shape)
            .collect();
        let mut considered = candidates(rest);
        considered.push(first);
        considered.sort_by(|a, b| a.tuned.score.total_cmp(&b.tuned.score));
        let solved: Vec<Option<Solved>> = considered.par_iter().map(|one| self.solve(one, &self.y)).collect();
        let mut both: Vec<(Radial, Solved)> = considered.into_iter().zip(solved).filter_map(|(c, s)| s.map(|s| (c, s))).collect();
        if both.iter().any(|(_, s)| self.well_conditioned(s)) {
            both.retain(|(_, s)| self.well_conditioned(s));
        }
        let (considered, solved): (Vec<Radial>, Vec<Solved>) = both.into_iter().unzip();
        let shortlisted = SHORTLIST.iter().find(|(most, _)| self.rows.len() <= *most).map_or(1, |(_, number)| *number);
        let shortlist: Vec<Radial> = considered.iter().take(shortlisted).cloned().collect();
        let held_out = self.radial_folds(&shortlist, &self.y);
        let left_out = solved.iter().map(|s| s.left_out.clone()).collect();
        let solved = solved.into_iter().next()?;
        // Scales of their own are tried where radial functions win already.
        let wins = |k: usize| rival.is_none_or(|rival| rms(&held_out[k]) < RADIAL_MUST_BEAT * rms(&rival[k]));
        let open: Vec<usize> = (0..self.y.len()).filter(|k| wins(*k)).collect();
        let own = self.own(&considered[0], &solved, &held_out, (&rows, &open), most_bases.saturating_sub(1));
        Some(RadialResult { considered, left_out, solved, held_out, own })
    }

    /// Whether rounding in a query stays below about 1e-9 of the values.
    fn well_conditioned(&self, solved: &Solved) -> bool {
        solved.weights.iter().zip(&self.y).all(|(w, y)| w.iter().map(|w| w.abs()).sum::<f64>() <= MOST_WEIGHT * max_abs(y).max(1.0))
    }

    /// Held-out residuals of the radial procedure: in each fold the shortlisted shapes are tuned anew from scratch, for
    /// parameters that have seen the fold would make its residuals too small, and the best by leave-one-out predicts.
    fn radial_folds(&self, shortlist: &[Radial], y: &[Vec<f64>]) -> Rows {
        self.by_fold(y, |train, test, y| {
            let fallback = || y.iter().map(|y| vec![y.iter().sum::<f64>() / y.len() as f64; test.len()]).collect();
            let tuned = shortlist.iter().filter_map(|one| {
                let system = self.system(train, &one.shape, y)?;
                let tuned = if train.len() <= TUNE_ROWS {
                    tune(&system, one.shape.kernel, self.options.tuning, FOLD_STEPS)?
                } else {
                    one.tuned.clone()
                };
                Some((one, system, tuned))
            });
            let Some((one, system, tuned)) = tuned.min_by(|a, b| a.2.score.total_cmp(&b.2.score)) else { return fallback() };
            let Some(solved) = system.solve(one.shape.kernel, &tuned.scales(), tuned.smoothing()) else { return fallback() };
            let trained = Radial { shape: one.shape.clone(), tuned };
            let mut surrogate = Surrogate {
                variables: self.samples.variables.clone(),
                bases: vec![self.basis_on(&trained, train)],
                ..Surrogate::default()
            };
            for k in 0..y.len() {
                let model = self.model(&trained, &solved, k, 0);
                surrogate.points.push(Point { name: String::new(), unit: String::new(), model, half_width: 0.0 });
            }
            (0..y.len()).map(|k| test.iter().map(|x| evaluate(&surrogate, k, x).unwrap_or(f64::INFINITY)).collect()).collect()
        })
    }

    /// Those among the outputs `open` for which scales of their own, tuned on `rows`, are clearly better; at most `most`.
    fn own(
        &self,
        shared: &Radial,
        solved: &Solved,
        held_out: &Rows,
        (rows, open): (&[usize], &[usize]),
        most: usize,
    ) -> BTreeMap<usize, Own> {
        if most == 0 || self.y.len() < 2 {
            return BTreeMap::new();
        }
        let tried: Vec<Option<(usize, f64, Radial, Solved)>> = open
            .par_iter()
            .map(|k| {
                let k = *k;
                let y = std::slice::from_ref(&self.y[k]);
                let tuned = self.tune_on(rows, &shared.shape, y, Some(&shared.tuned.parameters), STEPS)?;
                let radial = Radial { shape: shared.shape.clone(), tuned };
                let own = self.solve(&radial, y)?;
                let share = rms(&own.left_out[0]) / rms(&solved.left_out[k]);
                (share < OWN_MUST_REACH && rms(&own.left_out[0]) > 1e-9 * spread(&self.y[k])).then_some((k, share, radial, own))
            })
            .collect();
        let mut better: Vec<(usize, f64, Radial, Solved)> = tried.into_iter().flatten().collect();
        better.sort_by(|a, b| a.1.total_cmp(&b.1));
        better.truncate(most);
        better
            .into_iter()
            .filter_map(|(k, _, radial, solved)| {
                let own = self.radial_folds(std::slice::from_ref(&radial), std::slice::from_ref(&self.y[k])).pop()?;
                (rms(&own) < OWN_MUST_REACH * rms(&held_out[k])).then_some((k, Own { radial, solved, held_out: own }))
            })
            .collect()
    }

    fn basis(&self, one: &Radial) -> RbfBasis {
        self.basis_on(one, &self.rows)
    }

    fn basis_on(&self, one: &Radial, rows: &[&[f64]]) -> RbfBasis {
        RbfBasis {
            kernel: one.shape.kernel,
            transforms: one.shape.transforms.clone(),
            scales: self.all_scales(one),
            centres: rows.iter().map(|x| scale_row(&self.samples.variables, &one.shape.transforms, x)).collect(),
        }
    }

    /// Inverse length scales of all variables, zero for those that do not vary.
    fn all_scales(&self, one: &Radial) -> Vec<f64> {
        let mut tuned = one.tuned.scales().into_iter();
        self.search.active.iter().map(|active| if *active { tuned.next().unwrap_or(0.0) } else { 0.0 }).collect()
    }

    fn model(&self, one: &Radial, solved: &Solved, k: usize, basis: usize) -> PointModel {
        let tail = Polynomial {
            transforms: one.shape.transforms.clone(),
            terms: self.search.terms(one.shape.tail),
            coefficients: solved.tails[k].clone(),
        };
        PointModel::Rbf { basis, weights: solved.weights[k].clone(), tail }
    }

    fn radial_candidate(&self, one: &Radial, own: bool, left_out: &[f64], held_out: Option<&[f64]>) -> Candidate {
        let family = Family::Rbf {
            kernel: one.shape.kernel,
            tail: one.shape.tail,
            scales: self.all_scales(one),
            smoothing: one.tuned.smoothing(),
            own,
        };
        Candidate { family, transforms: one.shape.transforms.clone(), leave_one_out: residuals(left_out), k_fold: held_out.map(residuals) }
    }
}

/// Radial functions with shared scales, best first, and those of single outputs.
struct RadialResult {
    considered: Vec<Radial>,
    /// Left-out residuals by candidate and output.
    left_out: Vec<Rows>,
    /// Weights of the best.
    solved: Solved,
    /// Held-out residuals of the procedure, by output.
    held_out: Rows,
    own: BTreeMap<usize, Own>,
}

/// Scales tuned for one output.
struct Own {
    radial: Radial,
    solved: Solved,
    held_out: Vec<f64>,
}

/// Index of the candidate to take, judged by its held-out residuals on the rows that `counts` admits.
fn choose(choices: &[(usize, &[f64], f64)], counts: impl Fn(usize) -> bool) -> Option<usize> {
    let error = |residuals: &[f64]| rms(&residuals.iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, e)| *e).collect::<Vec<_>>());
    let mut best: Option<(usize, f64)> = None;
    for (index, residuals, share) in choices {
        let error = error(residuals);
        if best.is_none_or(|(_, least)| error < share * least) {
            best = Some((*index, error));
        }
    }
    best.map(|(index, _)| index)
}

fn polynomial_candidate(fitted: &Fitted, held_out: &[f64]) -> Candidate {
    Candidate {
        family: Family::Polynomial { degree: fitted.degree(), terms: fitted.expanded().terms.len() },
        transforms: fitted.transforms.clone(),
        leave_one_out: residuals(&fitted.left_out),
        k_fold: Some(residuals(held_out)),
    }
}

fn residuals(values: &[f64]) -> Residuals {
    Residuals { rms: rms(values), max: max_abs(values) }
}
