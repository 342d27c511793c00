//! The search itself, and what the curvature at its end says.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{Prediction, Problem};
use crate::error::{Error, Result};
use crate::measure::{Whitener, whiten};
use crate::sensitivity::Kind;

/// The search ends when no coordinate moves by more than this share of its standard deviation.
const STEP_TOLERANCE: f64 = 1e-3;
const MOST_STEPS: usize = 40;
/// Half width of a 95 % interval in standard deviations.
pub(super) const TWO_SIDED_95: f64 = 1.959_964;
/// A direction whose standard deviation is larger than this (in logarithms: 65 %) counts as open.
const OPEN: f64 = 0.5;
/// The same for parameters that are no logarithms, in units of their step size: 1.
const OPEN_LINEAR: f64 = 5.0;

/// How to search.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Number of starting points: the machine file's values and others around them.
    pub starts: usize,
    /// Seed of those others.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { starts: 3, seed: 1 }
    }
}

/// A direction in which the data say next to nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Undetermined {
    /// Weight of each free parameter's coordinate, of unit length.
    pub weights: Vec<f64>,
    /// Standard deviation along it; infinite where nothing depends on it.
    pub deviation: f64,
    /// The direction in words.
    pub text: String,
}

/// What was found.
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
    /// Whitened misfit of the data before and after.
    pub misfit: (f64, f64),
    /// Readings less effective parameters.
    pub freedom: usize,
    /// Probability of a misfit this large or larger if nothing else were wrong.
    pub probability: f64,
    /// Directions the data leave open.
    pub undetermined: Vec<Undetermined>,
    /// Predictions of the data at the machine file's values and at those found, K.
    pub predictions: (Vec<f64>, Vec<f64>),
    /// Misfit each start ended with.
    pub ends: Vec<f64>,
    /// Predictions computed.
    pub evaluations: usize,
}

/// A point of the search.
struct Point {
    coordinates: Vec<f64>,
    prediction: Prediction,
    whitener: Whitener,
    cost: f64,
}

/// Finds the free parameters.
///
/// # Errors
/// Nothing to find or no data; the machine cannot be solved where the search begins.
pub fn identify(problem: &Problem, options: &Options, progress: &mut dyn FnMut(&str)) -> Result<Estimate> {
    if problem.free.is_empty() {
        return Err(Error::input("no parameter is free")
            .at_key("--free")
            .help("name at least one, for example --free contact.motor.conductance"));
    }
    let start: Vec<f64> = problem.free.iter().map(|f| f.coordinate(f.parameter.value.clamp(f.bounds.0, f.bounds.1))).collect();
    let values = |c: &[f64]| -> Vec<f64> { problem.free.iter().zip(c).map(|(f, c)| f.value(*c)).collect() };
    let nominal = problem.predict(&values(&start))?;
    let readings = whiten::readings(&problem.data);
    let whitener = Whitener::of(&problem.data, &problem.uncertainty, &nominal.conditions);
    let before = square(&whitener.apply(&difference(&readings, &nominal.values)));
    let mut evaluations = 1;
    let mut ends: Vec<(f64, Point)> = Vec::new();
    let mut noise = Uniform(options.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let mut failure = None;
    for s in 0..options.starts.max(1) {
        let from: Vec<f64> = if s == 0 {
            start.clone()
        } else {
            // Within a factor of three, or within the bounds if these are closer.
            let around = |(f, c): (&super::Free, &f64)| {
                let (low, high) = (f.coordinate(f.bounds.0), f.coordinate(f.bounds.1));
                let reach = if f.is_logarithmic { 3f64.ln() } else { 0.1 * (high - low) };
                (c + reach * (2.0 * noise.next() - 1.0)).clamp(low, high)
            };
            problem.free.iter().zip(&start).map(around).collect()
        };
        progress(&format!("start {} of {}", s + 1, options.starts.max(1)));
        match search(problem, from, &readings, &mut evaluations) {
            Ok(end) => ends.push((end.cost, end)),
            Err(e) => failure = Some(e),
        }
    }
    let costs: Vec<f64> = ends.iter().map(|(cost, _)| *cost).collect();
    let Some((_, best)) = ends.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) else {
        return Err(failure.unwrap_or_else(|| Error::numerics("no start led anywhere")));
    };
    let jacobian = whitened_jacobian(problem, &best);
    let information = jacobian.transpose() * &jacobian;
    let undetermined = open_directions(problem, &information);
    let mut whole = information.clone();
    for (k, free) in problem.free.iter().enumerate() {
        if let Some((value, deviation)) = free.prior {
            let spread = if free.is_logarithmic { deviation / value } else { deviation };
            whole[(k, k)] += 1.0 / (spread * spread);
        }
    }
    let covariance = pseudo_inverse(&whole);
    let deviations: Vec<f64> =
        (0..problem.free.len()).map(|k| if covariance[(k, k)] > 0.0 { covariance[(k, k)].sqrt() } else { f64::INFINITY }).collect();
    let correlation = DMatrix::from_fn(deviations.len(), deviations.len(), |i, j| {
        if i == j { 1.0 } else { (covariance[(i, j)] / (deviations[i] * deviations[j])).clamp(-1.0, 1.0) }
    });
    let residual = best.whitener.apply(&difference(&readings, &best.prediction.values));
    let after = square(&residual);
    let smooth = (&information * &covariance).trace();
    let freedom = (readings.len() as f64 - smooth).round().max(0.0) as usize;
    let interval = |k: usize| {
        let free = &problem.free[k];
        let reach = TWO_SIDED_95 * deviations[k];
        let at = |c: f64| free.value(c).clamp(free.bounds.0, free.bounds.1);
        (at(best.coordinates[k] - reach), at(best.coordinates[k] + reach))
    };
    let at_bound = problem.free.iter().zip(&best.coordinates).map(|(f, c)| {
        let (low, high) = (f.coordinate(f.bounds.0), f.coordinate(f.bounds.1));
        (c - low).abs() < 1e-6 * (high - low) || (high - c).abs() < 1e-6 * (high - low)
    });
    Ok(Estimate {
        values: values(&best.coordinates),
        intervals: (0..problem.free.len()).map(interval).collect(),
        at_bound: at_bound.collect(),
        deviations,
        covariance,
        correlation,
        misfit: (before, after),
        freedom,
        probability: chi_square_tail(after, freedom),
        undetermined,
        predictions: (nominal.values, best.prediction.values),
        ends: costs,
        evaluations,
    })
}

/// Levenberg and Marquardt's method from one point.
fn search(problem: &Problem, from: Vec<f64>, readings: &[f64], evaluations: &mut usize) -> Result<Point> {
    let mut here = evaluate(problem, from, readings, None, evaluations)?;
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let jacobian = whitened_jacobian(problem, &here);
        let residual = DVector::from_vec(here.whitener.apply(&difference(readings, &here.prediction.values)));
        let (mut matrix, mut right) = (jacobian.transpose() * &jacobian, jacobian.transpose() * residual);
        for (k, free) in problem.free.iter().enumerate() {
            if let Some((at, spread)) = prior(free) {
                matrix[(k, k)] += 1.0 / (spread * spread);
                right[k] += (at - here.coordinates[k]) / (spread * spread);
            }
        }
        // What stands at a bound and wants out stays.
        let stuck = |k: usize, g: f64| {
            let free = &problem.free[k];
            let (low, high) = (free.coordinate(free.bounds.0), free.coordinate(free.bounds.1));
            (here.coordinates[k] <= low && g < 0.0) || (here.coordinates[k] >= high && g > 0.0)
        };
        let stuck: Vec<bool> = (0..problem.free.len()).map(|k| stuck(k, right[k])).collect();
        let largest = matrix.diagonal().max().max(1e-300);
        let mut improved = false;
        for _ in 0..8 {
            let mut damped = matrix.clone();
            let mut aim = right.clone();
            for k in 0..problem.free.len() {
                damped[(k, k)] += damping * matrix[(k, k)].max(1e-9 * largest);
                if stuck[k] {
                    damped.row_mut(k).fill(0.0);
                    damped.column_mut(k).fill(0.0);
                    damped[(k, k)] = 1.0;
                    aim[k] = 0.0;
                }
            }
            let Some(factor) = damped.cholesky() else {
                damping *= 10.0;
                continue;
            };
            let step = factor.solve(&aim);
            let to: Vec<f64> = problem
                .free
                .iter()
                .enumerate()
                .map(|(k, f)| {
                    let reach = if f.is_logarithmic { 1.5 } else { f64::INFINITY };
                    (here.coordinates[k] + step[k].clamp(-reach, reach)).clamp(f.coordinate(f.bounds.0), f.coordinate(f.bounds.1))
                })
                .collect();
            let small = (0..to.len()).all(|k| {
                (to[k] - here.coordinates[k]).abs() <= STEP_TOLERANCE / matrix[(k, k)].max(1e-300).sqrt().min(1e12)
                    || to[k] == here.coordinates[k]
            });
            // A machine that cannot be solved there is no place to go.
            let Ok(there) = evaluate(problem, to, readings, Some(&here.whitener), evaluations) else {
                damping = (damping * 10.0).max(1e-2);
                continue;
            };
            if there.cost <= here.cost {
                let gain = here.cost - there.cost;
                here = there;
                damping = (damping * 0.2).max(1e-9);
                improved = true;
                if small || gain <= 1e-9 * here.cost.max(1e-12) {
                    return settle(problem, here, readings);
                }
                break;
            }
            if small {
                return settle(problem, here, readings);
            }
            damping = (damping * 8.0).max(1e-4);
        }
        if !improved {
            break;
        }
    }
    settle(problem, here, readings)
}

/// The end of a search with the covariance as it is there.
fn settle(problem: &Problem, mut end: Point, readings: &[f64]) -> Result<Point> {
    end.whitener = Whitener::of(&problem.data, &problem.uncertainty, &end.prediction.conditions);
    end.cost = cost(problem, &end.coordinates, &end.prediction, &end.whitener, readings);
    Ok(end)
}

fn evaluate(
    problem: &Problem,
    coordinates: Vec<f64>,
    readings: &[f64],
    whitener: Option<&Whitener>,
    evaluations: &mut usize,
) -> Result<Point> {
    let values: Vec<f64> = problem.free.iter().zip(&coordinates).map(|(f, c)| f.value(*c)).collect();
    let prediction = problem.predict(&values)?;
    *evaluations += 1;
    let whitener = match whitener {
        Some(known) => known.clone(),
        None => Whitener::of(&problem.data, &problem.uncertainty, &prediction.conditions),
    };
    let cost = cost(problem, &coordinates, &prediction, &whitener, readings);
    Ok(Point { coordinates, prediction, whitener, cost })
}

fn cost(problem: &Problem, coordinates: &[f64], prediction: &Prediction, whitener: &Whitener, readings: &[f64]) -> f64 {
    let priors: f64 =
        problem.free.iter().zip(coordinates).filter_map(|(f, c)| prior(f).map(|(at, spread)| ((c - at) / spread).powi(2))).sum();
    square(&whitener.apply(&difference(readings, &prediction.values))) + priors
}

/// Prior of the coordinate: centre and standard deviation.
fn prior(free: &super::Free) -> Option<(f64, f64)> {
    free.prior.map(|(value, deviation)| if free.is_logarithmic { (value.ln(), deviation / value) } else { (value, deviation) })
}

/// Whitened derivatives with respect to the coordinates.
fn whitened_jacobian(problem: &Problem, at: &Point) -> DMatrix<f64> {
    let n = at.prediction.values.len();
    let mut jacobian = DMatrix::zeros(n, problem.free.len());
    for (k, free) in problem.free.iter().enumerate() {
        let scale = if free.is_logarithmic { free.value(at.coordinates[k]) } else { 1.0 };
        let column: Vec<f64> = at.prediction.slopes.iter().map(|row| row[k] * scale).collect();
        jacobian.set_column(k, &DVector::from_vec(at.whitener.apply(&column)));
    }
    jacobian
}

/// Directions along which the data alone leave a standard deviation that is no knowledge.
fn open_directions(problem: &Problem, information: &DMatrix<f64>) -> Vec<Undetermined> {
    let scale: Vec<f64> = problem.free.iter().map(|f| if f.is_logarithmic { OPEN } else { OPEN_LINEAR }).collect();
    let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| information[(i, j)] * scale[i] * scale[j]);
    let eigen = SymmetricEigen::new(scaled);
    let largest = eigen.eigenvalues.max().max(1e-300);
    let mut found: Vec<Undetermined> = Vec::new();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value >= 1.0 {
            continue;
        }
        let deviation = if *value > 1e-14 * largest { 1.0 / value.sqrt() } else { f64::INFINITY };
        let mut weights: Vec<f64> = vector.iter().zip(&scale).map(|(w, s)| w * s).collect();
        let length = square(&weights).sqrt();
        let strongest = weights.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(1.0);
        weights.iter_mut().for_each(|w| *w /= length * strongest.signum());
        found.push(Undetermined { deviation, text: in_words(problem, &weights), weights });
    }
    found.sort_by(|a, b| b.deviation.total_cmp(&a.deviation));
    found
}

/// A direction in words: the product of powers or the sum of parameters that the data do not fix.
fn in_words(problem: &Problem, weights: &[f64]) -> String {
    let largest = weights.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    let mut parts: Vec<(f64, &str)> =
        problem.free.iter().zip(weights).filter(|(_, w)| w.abs() > 0.15 * largest).map(|(f, w)| (*w, f.parameter.name.as_str())).collect();
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

/// Whether a factor, for words.
pub(super) fn is_factor(free: &super::Free) -> bool {
    free.parameter.kind == Kind::Factor
}

pub(super) fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

pub(super) fn square(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum()
}

/// Evenly spread numbers in 0..1, the same on every machine (xorshift64*, Vigna 2016).
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }
}
