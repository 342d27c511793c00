//! The estimate: best values, and their intervals from the curvature there.

use nalgebra::{DMatrix, SymmetricEigen};

use super::MeshShare;
use super::ended::{Ended, fit_of};
use super::free::Free;
use super::learnt::{SensorError, sensor_errors};
use super::search::{Point, Search, Stride};
use super::search_end::SearchEnd;
use super::settle::is_at_bound;
use super::wider::WiderSearch;
use crate::discrepancy::DiscrepancySize;
use crate::measurement::Whitener;
use crate::sandwich::pseudo_inverse;
use coldplate_base::numbers::{TWO_SIDED_95, sum_of_squares};

/// A direction whose standard deviation is larger than this share of the value counts as open. Chosen, and stated in
/// docs/method/identification.md.
const OPEN: f64 = 0.5;
/// Probability of the misfit, with the model error that was learnt, below which the intervals are widened by the root of its
/// ratio to the expected one. Chosen, and stated in docs/method/identification.md.
const HELD: f64 = 0.01;

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
    /// Misfit (priors included) each start ended with: under the covariance at the machine file's values, or, if these are far
    /// from the data, with the stated deviation of each reading alone.
    pub ends: Vec<f64>,
    /// The parameters with the scales and ranges of the result: one that cannot be told from zero has a linear scale.
    pub free: Vec<Free>,
    /// How the search ended. If it did not come to rest, nothing is said of what the data determine.
    pub search_end: SearchEnd,
    /// The wider search that a misfit asked for which the stated errors do not explain.
    pub wider: Option<WiderSearch>,
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

/// Course of a search beside its end point.
pub(super) struct Outcome {
    /// Parameters that keep the file's values.
    pub kept: Vec<usize>,
    /// Whether intervals widen with what the errors do not explain.
    pub widens: bool,
    /// Misfit that each start ended with.
    pub ends: Vec<f64>,
    pub wider: Option<WiderSearch>,
    pub end: SearchEnd,
}

/// The estimate at the end of a search.
pub(super) fn summary(search: &Search<'_>, nominal: &Point, ended: Ended, outcome: Outcome) -> Estimate {
    let Outcome { kept, widens, ends, wider, end } = outcome;
    let problem = search.problem;
    let n = search.free.len();
    let is_held = !widens || ended.fit.freedom == 0 || ended.fit.probability >= HELD;
    let widened = if is_held { 1.0 } else { (ended.fit.misfit / ended.fit.freedom as f64).sqrt().max(1.0) };
    let (covariance, given) = (ended.covariance(&[]) * (widened * widened), ended.covariance(&kept) * (widened * widened));
    let curved = pseudo_inverse(&ended.curvature);
    let Ended { point: best, fit, whitener, weights, learnt, .. } = ended;
    let mut values = search.values(&best.coordinates);
    kept.iter().for_each(|k| values[*k] = search.free[*k].parameter.value);
    let stated = match learnt {
        Some(_) => search.stated(&best.prediction),
        None => whitener.clone(),
    };
    let beside = fit_of(search, &best, &stated);
    let undetermined = open_directions(&search.free, &values, &fit.information);
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
        let (low, high) = (at(best.coordinates[k] - reach), at(best.coordinates[k] + reach));
        (if free.is_like_zero { 0.0 } else { low }, high)
    };
    let at_bound = search.free.iter().zip(&best.coordinates).map(|(f, c)| is_at_bound(f, *c));
    let corrected = |values: &[f64]| values.iter().zip(&search.mesh.correction).map(|(v, m)| v + m).collect();
    Estimate {
        values,
        intervals: search.free.iter().enumerate().map(interval).collect(),
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
        free: search.free.clone(),
        search_end: end,
        wider,
        off_in_full: None,
        end: best,
        stride: search.stride.clone(),
    }
}

/// Directions along which the data alone leave too large a standard deviation.
fn open_directions(all: &[Free], values: &[f64], information: &DMatrix<f64>) -> Vec<Undetermined> {
    let scale: Vec<f64> = all.iter().zip(values).map(|(free, value)| free.size(*value)).collect();
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
        found.push(Undetermined { deviation, text: in_words(all, &weights), weights });
    }
    found.sort_by(|a, b| b.deviation.total_cmp(&a.deviation));
    found
}

/// A direction in words: the product of powers or the sum of parameters that the data do not fix.
fn in_words(all: &[Free], weights: &[f64]) -> String {
    let largest = weights.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    let mut parts: Vec<(f64, String)> =
        all.iter().zip(weights).filter(|(_, w)| w.abs() > 0.15 * largest).map(|(f, w)| (*w, f.name())).collect();
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
