//! The estimate: best values, and their intervals from the curvature there.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::learnt::{ALLOWED, Learnt, SensorError, learnt, sensor_errors};
use super::search::{Point, Search, pseudo_inverse, square};
use super::{Free, Problem};
use crate::error::{Error, Result};
use crate::evidence::discrepancy::Level;
use crate::evidence::measurement::{Whitener, whiten};
use crate::foundation::numbers::TWO_SIDED_95;
use crate::foundation::progress::Progress;
use crate::foundation::random::Random;

/// The covariance is renewed until the estimate rests within this share of its standard deviation.
const RENEWED: f64 = 1e-2;
const MOST_RENEWALS: usize = 5;
/// A direction whose standard deviation is larger than this share of the value counts as open.
const OPEN: f64 = 0.5;
/// A misfit less probable than this, with whatever was learnt, widens the intervals by the root of its ratio to what was expected.
const HELD: f64 = 0.01;

/// How to search.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifyOptions {
    /// Number of starting points: the machine file's values and others around them.
    pub starts: usize,
    /// Seed of those others.
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
    /// Unit vector over the free parameters. One unit is a logarithm of one (a factor e), the value of a linear
    /// parameter, or 10 K of a temperature.
    pub weights: Vec<f64>,
    /// Standard deviation along it in the same measure; infinite where nothing depends on it.
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
    /// Standard deviations of the coordinates.
    pub deviations: Vec<f64>,
    /// Covariance of the coordinates.
    pub covariance: DMatrix<f64>,
    /// Correlations of the coordinates.
    pub correlation: DMatrix<f64>,
    /// Which ended at a bound.
    pub at_bound: Vec<bool>,
    /// Whitened misfit of the data before and after, both under the stated errors at the values found.
    pub misfit: (f64, f64),
    /// Readings less effective parameters.
    pub freedom: usize,
    /// Probability of a misfit this large or larger if nothing were wrong but what is stated.
    pub probability: f64,
    /// The model error that was learnt where the stated errors do not explain what is left, and the misfit beside it.
    pub model_error: Option<ModelError>,
    /// What the intervals were widened by where even so more is left than there should be; 1 otherwise.
    pub widened: f64,
    /// What the fit takes each sensor's own error to be.
    pub sensor_errors: Vec<SensorError>,
    /// Least misfit as the search had it, priors included.
    pub least: f64,
    /// How many times more that misfit rises by than one that is a likelihood would, along each parameter.
    pub rises: Vec<f64>,
    /// Directions the data leave open.
    pub undetermined: Vec<Undetermined>,
    /// Predictions of the data at the machine file's values and at those found, K.
    pub predictions: (Vec<f64>, Vec<f64>),
    /// Misfit (priors included) each start ended with, under the covariance at the machine file's values.
    pub ends: Vec<f64>,
    /// The whitening that the search used: by the stated errors, or where a model error was learnt by the standard deviation of
    /// each reading.
    pub whitener: Whitener,
    /// Predictions computed.
    pub evaluations: usize,
}

/// A model error and what is left beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelError {
    /// How large it is.
    pub level: Level,
    /// Whitened misfit with it.
    pub misfit: f64,
    /// Readings less effective parameters.
    pub freedom: usize,
    /// Probability of a misfit this large or larger.
    pub probability: f64,
}

/// Finds the free parameters.
///
/// Every start descends under the covariance at the machine file's values; from the best end the covariance is renewed
/// until the estimate rests. Where the stated errors do not explain what is left, a model error is learnt and the parameters are
/// found again under it.
///
/// # Errors
/// Nothing to find, the same twice, or no data; the machine cannot be solved where the search begins.
pub fn identify(problem: &Problem, options: &IdentifyOptions, progress: &dyn Progress) -> Result<Estimate> {
    check(problem)?;
    let mut search = Search::new(problem, progress);
    let start: Vec<f64> = problem.free.iter().map(|f| f.coordinate(f.parameter.value.clamp(f.bounds.0, f.bounds.1))).collect();
    let (nominal, mut whitener) = search.whole(start.clone())?;
    let mut noise = Random::new(options.seed);
    let mut ends: Vec<Point> = Vec::new();
    for s in 0..options.starts.max(1) {
        progress.say(&format!("start {} of {}", s + 1, options.starts.max(1)));
        let from = if s == 0 { nominal.clone() } else { around(&mut search, &start, &whitener, &mut noise).unwrap_or(nominal.clone()) };
        ends.push(search.descend(from, &whitener));
    }
    let costs: Vec<f64> = ends.iter().map(|end| end.cost).collect();
    let Some(mut best) = ends.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)) else {
        return Err(Error::numerics("no start led anywhere"));
    };
    for _ in 0..MOST_RENEWALS {
        (best, whitener) = search.whole(best.coordinates)?;
        if search.rests(&best, &whitener, RENEWED) {
            break;
        }
        best = search.descend(best, &whitener);
    }
    if best.prediction.conditions.iter().any(Vec::is_empty) {
        (best, whitener) = search.whole(best.coordinates)?;
    }
    let probability = explained(&search, &best, &whitener);
    // As many readings as parameters say nothing of the model.
    if probability < ALLOWED && search.readings.len() > problem.free.len() {
        progress.say("the model's own error");
        if let Some(learnt) = learnt(&mut search, &nominal, &best, probability)? {
            return Ok(summary(&search, &nominal, Ended::learnt(&search, learnt), costs));
        }
    }
    Ok(summary(&search, &nominal, Ended::stated(&search, best, whitener), costs))
}

/// The probability that the stated errors explain what is left: of the misfit, and of what the common ones of sensors and
/// conditions would have to be. Many readings of a noise stated too large would hide that these swallow what parameters should
/// explain.
fn explained(search: &Search<'_>, at: &Point, whitener: &Whitener) -> f64 {
    let problem = search.problem;
    let left = search.residual(&at.prediction, whitener);
    let common = whiten::common_errors(&problem.data, &problem.uncertainty, &at.prediction.conditions);
    let common: Vec<Vec<f64>> = common.into_iter().filter(|c| c.iter().any(|v| *v != 0.0)).collect();
    let pull = |column: &Vec<f64>| whitener.apply(column).iter().zip(&left).map(|(c, l)| c * l).sum::<f64>().powi(2);
    fit_of(search, at, whitener).probability.min(chi_square_tail(common.iter().map(pull).sum(), common.len()))
}

/// What a fit leaves under a covariance.
struct Fit {
    /// Of the data alone.
    information: DMatrix<f64>,
    covariance: DMatrix<f64>,
    misfit: f64,
    freedom: usize,
    probability: f64,
}

fn fit_of(search: &Search<'_>, at: &Point, whitener: &Whitener) -> Fit {
    let jacobian = search.jacobian(at, whitener);
    let information = jacobian.transpose() * &jacobian;
    let whole = &information + DMatrix::from_diagonal(&DVector::from_vec(search.prior_information()));
    let covariance = pseudo_inverse(&whole);
    let misfit = square(&search.residual(&at.prediction, whitener));
    let smooth = (&information * &covariance).trace();
    let freedom = (search.readings.len() as f64 - smooth).round().max(0.0) as usize;
    Fit { information, covariance, misfit, freedom, probability: chi_square_tail(misfit, freedom) }
}

/// Where the search ended, and what is known there.
struct Ended {
    point: Point,
    /// Under the covariance that is believed.
    fit: Fit,
    /// Of the coordinates.
    covariance: DMatrix<f64>,
    /// The covariance that is believed.
    whitener: Whitener,
    /// What the search used.
    weights: Whitener,
    model_error: Option<ModelError>,
    /// Of each sensor, K.
    noise: Vec<f64>,
}

impl Ended {
    fn stated(search: &Search<'_>, point: Point, whitener: Whitener) -> Self {
        let fit = fit_of(search, &point, &whitener);
        Self {
            covariance: fit.covariance.clone(),
            weights: whitener.clone(),
            model_error: None,
            noise: search.problem.uncertainty.noise.clone(),
            point,
            fit,
            whitener,
        }
    }

    fn learnt(search: &Search<'_>, Learnt { point, weights, covariance, whitener, level, noise }: Learnt) -> Self {
        let mut fit = fit_of(search, &point, &whitener);
        // Least squares do not end where this covariance would have the parameters: to first order the rest of the way is no misfit.
        let left = DVector::from_vec(search.residual(&point.prediction, &whitener));
        let along = search.jacobian(&point, &whitener).tr_mul(&left);
        fit.misfit = (fit.misfit - along.dot(&(&fit.covariance * &along))).max(0.0);
        fit.probability = chi_square_tail(fit.misfit, fit.freedom);
        let model_error = Some(ModelError { level, misfit: fit.misfit, freedom: fit.freedom, probability: fit.probability });
        Self { point, fit, covariance, whitener, weights, model_error, noise }
    }
}

fn check(problem: &Problem) -> Result<()> {
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

/// Another point to start from: within a factor of three, or within the bounds if these are closer. Where the machine cannot be
/// solved, half-way back.
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

fn summary(search: &Search<'_>, nominal: &Point, ended: Ended, ends: Vec<f64>) -> Estimate {
    let problem = search.problem;
    let Ended { point: best, fit, covariance, whitener, weights, model_error, noise } = ended;
    let values = search.values(&best.coordinates);
    let stated = match model_error {
        Some(_) => Whitener::of(&problem.data, &problem.uncertainty, &best.prediction.conditions),
        None => whitener.clone(),
    };
    let beside = fit_of(search, &best, &stated);
    let undetermined = open_directions(problem, &values, &fit.information);
    let is_held = fit.freedom == 0 || fit.probability >= HELD;
    let widened = if is_held { 1.0 } else { (fit.misfit / fit.freedom as f64).sqrt().max(1.0) };
    let covariance = covariance * (widened * widened);
    let curved = fit_of(search, &best, &weights).covariance;
    let deviations: Vec<f64> =
        (0..problem.free.len()).map(|k| if covariance[(k, k)] > 0.0 { covariance[(k, k)].sqrt() } else { f64::INFINITY }).collect();
    let correlation = DMatrix::from_fn(deviations.len(), deviations.len(), |i, j| {
        if i == j { 1.0 } else { (covariance[(i, j)] / (deviations[i] * deviations[j])).clamp(-1.0, 1.0) }
    });
    let interval = |(k, free): (usize, &Free)| {
        let reach = TWO_SIDED_95 * deviations[k];
        let at = |c: f64| free.value(c).clamp(free.bounds.0, free.bounds.1);
        (at(best.coordinates[k] - reach), at(best.coordinates[k] + reach))
    };
    let at_bound = problem.free.iter().zip(&best.coordinates).map(|(f, c)| {
        let (low, high) = f.coordinate_bounds();
        (c - low).abs() < 1e-6 * (high - low) || (high - c).abs() < 1e-6 * (high - low)
    });
    Estimate {
        values,
        intervals: problem.free.iter().enumerate().map(interval).collect(),
        at_bound: at_bound.collect(),
        deviations,
        correlation,
        misfit: (square(&search.residual(&nominal.prediction, &stated)), beside.misfit),
        freedom: beside.freedom,
        probability: beside.probability,
        model_error,
        widened,
        sensor_errors: sensor_errors(problem, &search.left(&best), &whitener, &noise),
        least: best.cost,
        rises: (0..problem.free.len()).map(|k| if curved[(k, k)] > 0.0 { covariance[(k, k)] / curved[(k, k)] } else { 1.0 }).collect(),
        undetermined,
        predictions: (nominal.prediction.values.clone(), best.prediction.values),
        ends,
        whitener: weights,
        covariance,
        evaluations: search.evaluations,
    }
}

/// Directions along which the data alone leave too large a standard deviation.
fn open_directions(problem: &Problem, values: &[f64], information: &DMatrix<f64>) -> Vec<Undetermined> {
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
fn in_words(problem: &Problem, weights: &[f64]) -> String {
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

/// Probability of a chi-square of `freedom` degrees of freedom above `value`.
pub fn chi_square_tail(value: f64, freedom: usize) -> f64 {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    if freedom == 0 {
        return 1.0;
    }
    ChiSquared::new(freedom as f64).map_or(f64::NAN, |d| d.sf(value.max(0.0)))
}
