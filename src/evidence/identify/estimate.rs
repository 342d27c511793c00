//! The estimate: best values, and their intervals from the curvature there.

use nalgebra::{DMatrix, SymmetricEigen};

use super::search::{Point, Search, prior, square};
use super::{Free, Problem};
use crate::error::{Error, Result};
use crate::evidence::measurement::Whitener;
use crate::foundation::numbers::TWO_SIDED_95;
use crate::foundation::progress::Progress;
use crate::foundation::random::Random;
use crate::solve::sensitivity::Kind;

/// The covariance is renewed until the estimate rests within this share of its standard deviation.
const RENEWED: f64 = 1e-2;
const MOST_RENEWALS: usize = 5;
/// A direction whose standard deviation is larger than this share of the value counts as open.
const OPEN: f64 = 0.5;
/// Reference for a temperature's standard deviation, K: 5 K count as open.
const OPEN_KELVIN: f64 = 10.0;

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
    /// Whitened misfit of the data before and after, both under the covariance found.
    pub misfit: (f64, f64),
    /// Readings less effective parameters.
    pub freedom: usize,
    /// Probability of a misfit this large or larger if nothing else were wrong.
    pub probability: f64,
    /// Directions the data leave open.
    pub undetermined: Vec<Undetermined>,
    /// Predictions of the data at the machine file's values and at those found, K.
    pub predictions: (Vec<f64>, Vec<f64>),
    /// Misfit (priors included) each start ended with, under the covariance at the machine file's values.
    pub ends: Vec<f64>,
    /// The whitening by the covariance found.
    pub whitener: Whitener,
    /// Predictions computed.
    pub evaluations: usize,
}

/// Finds the free parameters.
///
/// Every start descends under the covariance at the machine file's values; from the best end the covariance is renewed
/// until the estimate rests.
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
    Ok(summary(&search, &nominal, best, whitener, costs))
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

fn summary(search: &Search<'_>, nominal: &Point, best: Point, whitener: Whitener, ends: Vec<f64>) -> Estimate {
    let problem = search.problem;
    let jacobian = search.jacobian(&best, &whitener);
    let information = jacobian.transpose() * &jacobian;
    let values = search.values(&best.coordinates);
    let undetermined = open_directions(problem, &values, &information);
    let mut whole = information.clone();
    for (k, free) in problem.free.iter().enumerate() {
        if let Some((_, spread)) = prior(free) {
            whole[(k, k)] += 1.0 / (spread * spread);
        }
    }
    let covariance = pseudo_inverse(&whole);
    let deviations: Vec<f64> =
        (0..problem.free.len()).map(|k| if covariance[(k, k)] > 0.0 { covariance[(k, k)].sqrt() } else { f64::INFINITY }).collect();
    let correlation = DMatrix::from_fn(deviations.len(), deviations.len(), |i, j| {
        if i == j { 1.0 } else { (covariance[(i, j)] / (deviations[i] * deviations[j])).clamp(-1.0, 1.0) }
    });
    let misfit = (square(&search.residual(&nominal.prediction, &whitener)), square(&search.residual(&best.prediction, &whitener)));
    let smooth = (&information * &covariance).trace();
    let freedom = (search.readings.len() as f64 - smooth).round().max(0.0) as usize;
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
        covariance,
        correlation,
        misfit,
        freedom,
        probability: chi_square_tail(misfit.1, freedom),
        undetermined,
        predictions: (nominal.prediction.values.clone(), best.prediction.values),
        ends,
        whitener,
        evaluations: search.evaluations,
    }
}

/// Directions along which the data alone leave too large a standard deviation.
fn open_directions(problem: &Problem, values: &[f64], information: &DMatrix<f64>) -> Vec<Undetermined> {
    let typical = |(free, value): (&Free, &f64)| {
        let p = &free.parameter;
        let size = value.abs().max(p.value.abs());
        if free.is_logarithmic {
            1.0
        } else if p.dimension.is_absolute() || p.kind == Kind::Offset {
            OPEN_KELVIN
        } else if size > 0.0 {
            size
        } else {
            0.1 * (free.bounds.1 - free.bounds.0)
        }
    };
    let scale: Vec<f64> = problem.free.iter().zip(values).map(typical).collect();
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

/// Inverse where there is information, infinite variance where there is none.
fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let scale: Vec<f64> = matrix.diagonal().iter().map(|d| if *d > 0.0 { d.sqrt() } else { 1.0 }).collect();
    let unit = DMatrix::from_fn(scale.len(), scale.len(), |i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let eigen = SymmetricEigen::new(unit);
    let inverse = eigen.eigenvalues.map(|v| 1.0 / v.max(1e-12));
    let unit = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    DMatrix::from_fn(scale.len(), scale.len(), |i, j| unit[(i, j)] / (scale[i] * scale[j]))
}

/// Probability of a chi-square of `freedom` degrees of freedom above `value`.
pub fn chi_square_tail(value: f64, freedom: usize) -> f64 {
    use statrs::distribution::{ChiSquared, ContinuousCDF};
    if freedom == 0 {
        return 1.0;
    }
    ChiSquared::new(freedom as f64).map_or(f64::NAN, |d| d.sf(value.max(0.0)))
}
