//! The estimate: best values, and their intervals from the curvature there.

use nalgebra::{DMatrix, SymmetricEigen};

use super::ended::{Ended, chi_square_tail, fit_of};
use super::learnt::{ALLOWED, SensorError, learnt, sensor_errors};
use super::search::{Point, Search, Stride};
use super::{Free, IdentifyProblem, MeshShare, Pace};
use crate::discrepancy::DiscrepancySize;
use crate::measurement::{Whitener, whiten};
use crate::sandwich::pseudo_inverse;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::{TWO_SIDED_95, sum_of_squares};
use coldplate_base::progress::Progress;
use coldplate_base::random::Random;
use coldplate_solve::study::StateTables;

/// The covariance is renewed until the estimate moves by less than this share of its standard deviation. Chosen: a smaller one
/// costs further rounds.
const RENEWED: f64 = 1e-2;
/// Most renewals of the covariance, count. Chosen: each costs a search.
const MOST_RENEWALS: usize = 5;
/// A direction whose standard deviation is larger than this share of the value counts as open. Chosen, and stated in
/// docs/method/identification.md.
const OPEN: f64 = 0.5;
/// Error allowed in each time step of a log while other starts are tried, over that of the estimate; dimensionless. Chosen: a
/// larger one is faster and hides shallow minima.
const EXPLORED: f64 = 10.0;
/// Probability of the misfit, with the model error that was learnt, below which the intervals are widened by the root of its
/// ratio to the expected one. Chosen, and stated in docs/method/identification.md.
const HELD: f64 = 0.01;
/// Largest error of predictions on the reduced model at the values found, K. Chosen: far below the noise of thermometers; a
/// larger one saves full solves.
const ACCURACY: f64 = 1e-3;
/// Rise of the misfit below which a parameter counts as not determined: 95 % quantile of chi-square with one degree of freedom;
/// dimensionless.
const HARDLY: f64 = 3.841_459;

/// Options of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifyOptions {
    /// Number of starting points: the machine file's values and others around them.
    pub starts: usize,
    /// Seed of the other starting points.
    pub seed: u64,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self { starts: 3, seed: 1 }
    }
}

/// A combination of parameters that the data do not determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Undetermined {
    /// Unit vector over the free parameters. One unit is a logarithm of one (a factor e), the value of a linear parameter, or
    /// 10 K of a temperature.
    pub weights: Vec<f64>,
    /// Standard deviation along the direction in these units; infinite if no reading depends on it.
    pub deviation: f64,
    /// The direction in words.
    pub text: String,
}

/// The result of an identification.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Values of the free parameters, SI.
    pub values: Vec<f64>,
    /// 95 % intervals from the curvature, SI, cut at the bounds.
    pub intervals: Vec<(f64, f64)>,
    /// Standard deviations of the coordinates: of a kept one as the data leave it, of the others with the kept ones held.
    pub deviations: Vec<f64>,
    /// Covariance of all coordinates.
    pub covariance: DMatrix<f64>,
    /// Covariance of the coordinates with the kept ones held: zero in their rows and columns.
    pub given: DMatrix<f64>,
    /// Correlations of all coordinates.
    pub correlation: DMatrix<f64>,
    /// Whether each parameter ended at a bound.
    pub at_bound: Vec<bool>,
    /// Whether each parameter is undetermined by the data: it keeps the value of the file, and the intervals of the others are
    /// those with it held.
    pub kept: Vec<bool>,
    /// Whitened misfit of the data before and after, both under the stated errors at the values found.
    pub misfit: (f64, f64),
    /// Readings less effective parameters.
    pub freedom: usize,
    /// Probability of a misfit this large or larger if only the stated errors act.
    pub probability: f64,
    /// Model error learnt if the stated errors do not explain the residual, and the misfit with it.
    pub model_error: Option<FittedModelError>,
    /// Factor by which the intervals were widened if the misfit is too large even with the model error; 1 otherwise.
    pub widened: f64,
    /// Estimate of each sensor's own error.
    pub sensor_errors: Vec<SensorError>,
    /// Least misfit of the search, priors included.
    pub least: f64,
    /// Ratio of the rise of the search's misfit along each parameter to the rise of a likelihood.
    pub rises: Vec<f64>,
    /// Directions the data leave open.
    pub undetermined: Vec<Undetermined>,
    /// Predictions of the data at the machine file's values and at those found, K, with the mesh's share.
    pub predictions: (Vec<f64>, Vec<f64>),
    /// Change of the predictions at the values found from the model's own mesh to an endlessly fine one; none if it was not
    /// asked for.
    pub mesh: MeshShare,
    /// Misfit (priors included) each start ended with, under the covariance at the machine file's values.
    pub ends: Vec<f64>,
    /// Whitening that the search used: by the stated errors, or by the standard deviation of each reading if a model error was
    /// learnt.
    pub whitener: Whitener,
    /// Predictions computed.
    pub evaluations: usize,
    /// For a table on the reduced model: largest difference of the predictions at the values found from those of full solves,
    /// K.
    pub off_in_full: Option<f64>,
    /// End point of the search.
    pub(super) end: Point,
    /// Time steps in which the search runs logs near the end point.
    pub(super) stride: Stride,
}

/// A model error and the misfit with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedModelError {
    /// Size of the model error.
    pub level: DiscrepancySize,
    /// Whitened misfit with it.
    pub misfit: f64,
    /// Readings less effective parameters.
    pub freedom: usize,
    /// Probability of a misfit this large or larger.
    pub probability: f64,
}

/// Finds the free parameters under the stated errors.
///
/// Every start descends under the covariance at the machine file's values; from the best end the covariance is renewed
/// until the estimate rests.
///
/// # Errors
/// No free parameter, one named twice, or no data; the machine cannot be solved at the start of the search.
pub fn identify(problem: &IdentifyProblem, options: &IdentifyOptions, progress: &dyn Progress) -> Result<Estimate> {
    found(problem, options, false, progress)
}

/// Finds the free parameters as [`identify`] does, with two further errors: that of the mesh, and a model error that is learnt
/// if the stated errors do not explain the residual. Parameters that the data do not determine keep the file's values.
///
/// # Errors
/// Errors of [`identify`].
pub fn identify_and_learn(problem: &IdentifyProblem, options: &IdentifyOptions, progress: &dyn Progress) -> Result<Estimate> {
    found(problem, options, true, progress)
}

/// Estimate by [`searched`]. Tables are solved on the reduced model, and the end result once in full. If the two differ by more
/// than [`ACCURACY`], everything is solved in full.
fn found(problem: &IdentifyProblem, options: &IdentifyOptions, learns: bool, progress: &dyn Progress) -> Result<Estimate> {
    let found = searched(problem, options, learns, progress)?;
    if problem.study.tables == StateTables::InFull || problem.data.is_transient() {
        return Ok(found);
    }
    let study = problem.study.clone().with_tables(StateTables::InFull);
    let in_full = IdentifyProblem { study, ..problem.clone() };
    let own = found.predictions.1.iter().zip(&found.mesh.correction).map(|(p, m)| p - m);
    let off = in_full
        .predict_free(&found.values, false, Pace::own(problem.accuracy()))
        .map_or(f64::INFINITY, |full| full.values.iter().zip(own).fold(0.0, |m: f64, (f, v)| m.max((f - v).abs())));
    if off <= ACCURACY {
        return Ok(Estimate { off_in_full: Some(off), ..found });
    }
    progress.say(&format!("the reduced model is off by {off:.1e} K: everything again in full"));
    searched(&in_full, options, learns, progress)
}

fn searched(problem: &IdentifyProblem, options: &IdentifyOptions, learns: bool, progress: &dyn Progress) -> Result<Estimate> {
    check(problem)?;
    let mut search = Search::new(problem, progress);
    let start: Vec<f64> = problem.free.iter().map(|f| f.coordinate(f.parameter.value.clamp(f.bounds.0, f.bounds.1))).collect();
    let (mut nominal, mut whitener) = search.whole(start.clone())?;
    // If no finer mesh can be had, predictions stay those of the model's own mesh.
    let mut continues = learns;
    if continues {
        progress.say("the mesh's share");
        continues = search.continue_from(&nominal).unwrap_or_else(|e| {
            progress.say(&format!("predictions are not continued to a finer mesh: {e}"));
            false
        });
        whitener = search.stated(&nominal.prediction);
        nominal = search.under(nominal, &whitener);
    }
    let mut noise = Random::new(options.seed);
    let mut ends: Vec<Point> = Vec::new();
    for s in 0..options.starts.max(1) {
        progress.say(&format!("start {} of {}", s + 1, options.starts.max(1)));
        if s == 0 {
            ends.push(search.descend(nominal.clone(), &whitener));
            continue;
        }
        // Further starts only look for a better end. One that is better is refined to the full accuracy.
        search.tolerance = EXPLORED * search.accuracy;
        let from = around(&mut search, &start, &whitener, &mut noise);
        let end = search.descend_unless(from.unwrap_or(nominal.clone()), &whitener, &ends);
        search.tolerance = search.accuracy;
        let least = ends.iter().map(|end| end.cost).fold(f64::INFINITY, f64::min);
        let is_better = problem.data.is_transient() && end.cost < least;
        let begun = if is_better { search.point(end.coordinates.clone(), &whitener).ok() } else { None };
        ends.push(begun.map_or(end, |begun| search.descend_unless(begun, &whitener, &ends)));
    }
    let costs: Vec<f64> = ends.iter().map(|end| end.cost).collect();
    let Some(mut best) = ends.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)) else {
        return Err(Error::numerics("no start led anywhere"));
    };
    for round in 0..MOST_RENEWALS {
        (best, whitener) = search.whole(best.coordinates)?;
        if round == 0 && continues {
            if let Err(e) = search.continue_from(&best) {
                progress.say(&format!("the mesh's share stays that of the machine file: {e}"));
            }
            whitener = search.stated(&best.prediction);
            best = search.under(best, &whitener);
        }
        if search.rests(&best, &whitener, RENEWED) {
            break;
        }
        best = search.descend(best, &whitener);
    }
    if best.prediction.conditions.iter().any(Vec::is_empty) {
        (best, whitener) = search.whole(best.coordinates)?;
    }
    if !learns {
        let ended = Ended::stated(&search, best, whitener);
        return Ok(summary(&search, &nominal, ended, Vec::new(), false, costs));
    }
    let probability = explained(&search, &best, &whitener);
    // No more readings than parameters do not inform about the model.
    let ended = if probability < ALLOWED && search.readings.len() > problem.free.len() {
        progress.say("the model's own error");
        learnt(&mut search, &nominal, &best, probability)?.map(|learnt| Ended::learnt(&search, learnt))
    } else {
        None
    };
    let ended = ended.unwrap_or_else(|| Ended::stated(&search, best, whitener));
    let (ended, kept) = keep(&mut search, ended)?;
    Ok(summary(&search, &nominal, ended, kept, true, costs))
}

/// Probability that the stated errors explain the residual: the smaller one of the whole misfit and of the common errors of
/// sensors and conditions that the residual asks for. If the noise of many readings is stated too large, the misfit alone would
/// hide that these common errors take the place of parameters.
fn explained(search: &Search<'_>, at: &Point, whitener: &Whitener) -> f64 {
    let problem = search.problem;
    let left = search.residual(&at.prediction, whitener);
    let common = whiten::common_errors(&problem.data, &problem.uncertainty, &at.prediction.conditions);
    let common: Vec<Vec<f64>> = common.into_iter().filter(|c| c.iter().any(|v| *v != 0.0)).collect();
    let pull = |column: &Vec<f64>| whitener.apply(column).iter().zip(&left).map(|(c, l)| c * l).sum::<f64>().powi(2);
    fit_of(search, at, whitener).probability.min(chi_square_tail(common.iter().map(pull).sum(), common.len()))
}

/// Puts parameters that the data do not determine back to the file's values, one after another, the least known first, and
/// finds the others anew. Candidates are parameters whose 95 % interval is wider than their bounds, or which ran to a bound.
/// One stays at the file's value if the misfit rises by less than [`HARDLY`].
fn keep(search: &mut Search<'_>, mut ended: Ended) -> Result<(Ended, Vec<usize>)> {
    let problem = search.problem;
    let mut kept: Vec<usize> = Vec::new();
    let mut tried: Vec<usize> = Vec::new();
    loop {
        let covariance = ended.covariance(&kept);
        let open = |k: usize| -> f64 {
            let (free, c) = (&problem.free[k], ended.point.coordinates[k]);
            let (low, high) = free.coordinate_bounds();
            let width = 2.0 * TWO_SIDED_95 * covariance[(k, k)].max(0.0).sqrt() / (high - low);
            if is_at_bound(free, c) { width.max(1.0) } else { width }
        };
        let may = |k: &usize| {
            let free = &problem.free[*k];
            !tried.contains(k) && (free.bounds.0..=free.bounds.1).contains(&free.parameter.value)
        };
        let Some(k) = (0..problem.free.len()).filter(may).filter(|k| open(*k) >= 1.0).max_by(|a, b| open(*a).total_cmp(&open(*b))) else {
            return Ok((ended, kept));
        };
        tried.push(k);
        let mut to = ended.point.coordinates.clone();
        to[k] = problem.free[k].coordinate(problem.free[k].parameter.value);
        search.frozen = kept.iter().copied().chain([k]).collect();
        let Ok(begun) = search.point(to, &ended.weights) else { continue };
        let back = search.descend(begun, &ended.weights);
        if back.cost - ended.point.cost < HARDLY {
            let (point, _) = search.whole(back.coordinates)?;
            let point = search.under(point, &ended.weights);
            ended = ended.at(search, point);
            kept.push(k);
        }
    }
}

fn is_at_bound(free: &Free, coordinate: f64) -> bool {
    let (low, high) = free.coordinate_bounds();
    (coordinate - low).abs() < 1e-6 * (high - low) || (high - coordinate).abs() < 1e-6 * (high - low)
}

fn check(problem: &IdentifyProblem) -> Result<()> {
    if problem.free.is_empty() {
        return Err(Error::input("no parameter is free")
            .at_key("--free")
            .help("name at least one, for example --free contact.motor.conductance"));
    }
    let names: Vec<String> = problem.free.iter().map(Free::name).collect();
    if let Some(k) = (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
        return Err(Error::input("this parameter is named twice").at_key(&names[k]).help("name it once"));
    }
    let tests = problem.data.tests();
    if let Some(free) = problem.free.iter().find(|f| f.test.as_ref().is_some_and(|test| !tests.contains(test))) {
        return Err(Error::input("no test of this name is used").at_key(free.name()).help(format!("the tests are: {}", tests.join(", "))));
    }
    if problem.data.count() == 0 {
        return Err(Error::input("there is no reading"));
    }
    Ok(())
}

/// Another point to start from: within a factor of three, or within the bounds if these are closer. If the machine cannot be
/// solved there, half-way back.
fn around(search: &mut Search<'_>, start: &[f64], whitener: &Whitener, noise: &mut Random) -> Option<Point> {
    let one = |(f, c): (&Free, &f64)| {
        let (low, high) = f.coordinate_bounds();
        let reach = if f.is_logarithmic { 3f64.ln() } else { 0.1 * (high - low) };
        (c + reach * (2.0 * noise.unit() - 1.0)).clamp(low, high)
    };
    let mut to: Vec<f64> = search.problem.free.iter().zip(start).map(one).collect();
    for _ in 0..4 {
        match search.point(to.clone(), whitener) {
            Ok(point) => return Some(point),
            Err(_) => to.iter_mut().zip(start).for_each(|(c, s)| *c = 0.5 * (*c + s)),
        }
    }
    None
}

fn summary(search: &Search<'_>, nominal: &Point, ended: Ended, kept: Vec<usize>, widens: bool, ends: Vec<f64>) -> Estimate {
    let problem = search.problem;
    let n = problem.free.len();
    let is_held = !widens || ended.fit.freedom == 0 || ended.fit.probability >= HELD;
    let widened = if is_held { 1.0 } else { (ended.fit.misfit / ended.fit.freedom as f64).sqrt().max(1.0) };
    let (covariance, given) = (ended.covariance(&[]) * (widened * widened), ended.covariance(&kept) * (widened * widened));
    let curved = pseudo_inverse(&ended.curvature);
    let Ended { point: best, fit, whitener, weights, learnt, .. } = ended;
    let mut values = search.values(&best.coordinates);
    kept.iter().for_each(|k| values[*k] = problem.free[*k].parameter.value);
    let stated = match learnt {
        Some(_) => search.stated(&best.prediction),
        None => whitener.clone(),
    };
    let beside = fit_of(search, &best, &stated);
    let undetermined = open_directions(problem, &values, &fit.information);
    let deviation = |variance: f64| if variance > 0.0 { variance.sqrt() } else { f64::INFINITY };
    let own = |k: usize| deviation(if kept.contains(&k) { covariance[(k, k)] } else { given[(k, k)] });
    let deviations: Vec<f64> = (0..n).map(own).collect();
    let all: Vec<f64> = (0..n).map(|k| deviation(covariance[(k, k)])).collect();
    let correlation = DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 } else { (covariance[(i, j)] / (all[i] * all[j])).clamp(-1.0, 1.0) });
    let noise = learnt.as_ref().map_or(&problem.uncertainty.noise, |l| &l.noise);
    let sensor_errors = sensor_errors(problem, &search.left(&best), &whitener, noise);
    let model_error = learnt.as_ref().map(|l| FittedModelError {
        level: l.level,
        misfit: fit.misfit,
        freedom: fit.freedom,
        probability: fit.probability,
    });
    let interval = |(k, free): (usize, &Free)| {
        let reach = TWO_SIDED_95 * deviations[k];
        let at = |c: f64| free.value(c).clamp(free.bounds.0, free.bounds.1);
        (at(best.coordinates[k] - reach), at(best.coordinates[k] + reach))
    };
    let at_bound = problem.free.iter().zip(&best.coordinates).map(|(f, c)| is_at_bound(f, *c));
    let corrected = |values: &[f64]| values.iter().zip(&search.mesh.correction).map(|(v, m)| v + m).collect();
    Estimate {
        values,
        intervals: problem.free.iter().enumerate().map(interval).collect(),
        at_bound: at_bound.collect(),
        kept: (0..n).map(|k| kept.contains(&k)).collect(),
        deviations,
        correlation,
        misfit: (sum_of_squares(&search.residual(&nominal.prediction, &stated)), beside.misfit),
        freedom: beside.freedom,
        probability: beside.probability,
        model_error,
        widened,
        sensor_errors,
        least: best.cost,
        rises: (0..n).map(|k| if curved[(k, k)] > 0.0 { covariance[(k, k)] / curved[(k, k)] } else { 1.0 }).collect(),
        undetermined,
        predictions: (corrected(&nominal.prediction.values), corrected(&best.prediction.values)),
        mesh: search.mesh.clone(),
        ends,
        whitener: weights,
        covariance,
        given,
        evaluations: search.evaluations,
        off_in_full: None,
        end: best,
        stride: search.stride.clone(),
    }
}

/// Directions along which the data alone leave too large a standard deviation.
fn open_directions(problem: &IdentifyProblem, values: &[f64], information: &DMatrix<f64>) -> Vec<Undetermined> {
    let scale: Vec<f64> = problem.free.iter().zip(values).map(|(free, value)| free.size(*value)).collect();
    let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| information[(i, j)] * scale[i] * scale[j]);
    let eigen = SymmetricEigen::new(scaled);
    let largest = eigen.eigenvalues.max().max(1e-300);
    let mut found: Vec<Undetermined> = Vec::new();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value >= 1.0 / (OPEN * OPEN) {
            continue;
        }
        // Derivatives hold about nine digits, squared here.
        let deviation = if *value > 1e-14 * largest { 1.0 / value.sqrt() } else { f64::INFINITY };
        let strongest = vector.iter().copied().fold(0.0f64, |m, w| if w.abs() > m.abs() * (1.0 + 1e-9) { w } else { m });
        let weights: Vec<f64> = vector.iter().map(|w| w * strongest.signum()).collect();
        found.push(Undetermined { deviation, text: in_words(problem, &weights), weights });
    }
    found.sort_by(|a, b| b.deviation.total_cmp(&a.deviation));
    found
}

/// A direction in words: the product of powers or the sum of parameters that the data do not fix.
fn in_words(problem: &IdentifyProblem, weights: &[f64]) -> String {
    let largest = weights.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    let mut parts: Vec<(f64, String)> =
        problem.free.iter().zip(weights).filter(|(_, w)| w.abs() > 0.15 * largest).map(|(f, w)| (*w, f.name())).collect();
    parts.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    if let [(_, name)] = parts.as_slice() {
        return format!("'{name}' alone");
    }
    let moves = parts.iter().map(|(w, name)| {
        let way = if *w > 0.0 { "more" } else { "less" };
        format!("{way} '{name}' ({:.2})", w.abs())
    });
    format!("together: {}", moves.collect::<Vec<_>>().join(", "))
}
