//! Temperatures of a surface in few modes, whose amplitudes are linear in what a surrogate knows.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use coldplate_base::error::{Error, Result};
use coldplate_runtime::Surrogate;

use super::packed;
use super::snapshots::{Moving, Snapshots};

/// Modes of the steady field at most, a count; twice as many where it moves. Chosen: beyond it lie the solver's own errors.
const MOST_MODES: usize = 12;
/// Error that the modes may leave, K, root mean square over the surface. Chosen: a fiftieth of what thermometers resolve.
const LEFT_BY_MODES: f64 = 0.002;
/// Penalties of the regression that are tried, on features of unit variance. Chosen: from rounding to one that forgets the features; which
/// one counts is decided by conditions that are left out.
const PENALTIES: [f64; 9] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];
/// Vertices of a self-test, a count.
const TESTED: usize = 7;

/// Temperatures everywhere, as a page reads them.
#[derive(Debug, Serialize)]
pub(super) struct SceneField {
    /// Features that the amplitudes are linear in: a constant, these variables, then these points, all in the surrogate's units.
    variables: Vec<String>,
    points: Vec<String>,
    /// Mean temperature of each vertex, then of each station, degC, packed `f32`.
    center: String,
    /// Modes at all of these, packed `i16`; the unit of each, K; and the coefficients of its amplitude.
    modes: Vec<String>,
    scales: Vec<f64>,
    coefficients: Vec<Vec<f64>>,
    /// Error of conditions that were predicted from all others, K.
    #[serde(flatten)]
    error: FieldError,
    /// Conditions at which the field was known.
    conditions: usize,
    /// Largest error of the reduced model that gave it, K; none if it was solved.
    #[serde(skip_serializing_if = "Option::is_none")]
    bound: Option<f64>,
    /// The field over time.
    #[serde(skip_serializing_if = "Option::is_none")]
    moving: Option<MovingField>,
    self_tests: Vec<FieldTest>,
}

/// Error of temperatures of a surface, K.
#[derive(Debug, Serialize)]
struct FieldError {
    /// Root mean square.
    error: f64,
    largest_error: f64,
}

/// Amplitudes of the modes over time, beyond those of the steady state.
#[derive(Debug, Serialize)]
struct MovingField {
    /// Coefficients of each amplitude: one for each state of the surrogate less its steady one.
    coefficients: Vec<Vec<f64>>,
    /// Error of histories that were predicted from all others, K.
    #[serde(flatten)]
    error: FieldError,
    histories: usize,
    /// Largest bound of the readings of the reduced model over time, K.
    bound: Option<f64>,
}

/// Temperatures that a page must find at a condition.
#[derive(Debug, Serialize)]
struct FieldTest {
    condition: Vec<f64>,
    /// States less the steady ones; empty in the steady state.
    away: Vec<f64>,
    vertices: Vec<usize>,
    values: Vec<f64>,
}

/// The field of a surface over the features of a surrogate.
pub(super) fn field(surrogate: &Surrogate<'_>, snapshots: &Snapshots) -> Result<SceneField> {
    let Snapshots { conditions, steady, histories, .. } = snapshots;
    let places = steady.first().map_or(0, Vec::len);
    let n = steady.len();
    let points: Vec<usize> = (0..surrogate.point_count()).filter(|p| surrogate.point(*p).is_some_and(|own| own.unit == "degC")).collect();
    let features_of = |x: &Vec<f64>| {
        let mut values = vec![0.0; surrogate.point_count()];
        surrogate.evaluate(x, &mut values).map_err(|e| Error::input(e.to_string()))?;
        Ok(x.iter().copied().chain(points.iter().map(|p| values[*p])).collect::<Vec<f64>>())
    };
    let features: Vec<Vec<f64>> = conditions.iter().map(features_of).collect::<Result<_>>()?;
    let center: Vec<f64> = (0..places).map(|j| steady.iter().map(|own| own[j]).sum::<f64>() / n as f64).collect();
    let moved: Vec<&Moving> = histories.iter().flatten().collect();
    let rises = DMatrix::from_fn(n + moved.len(), places, |i, j| if i < n { steady[i][j] - center[j] } else { moved[i - n].rise[j] });
    let most = if moved.is_empty() { MOST_MODES } else { 2 * MOST_MODES };
    let (amplitudes, modes) = modes(&rises, most);
    let fit = Regression::new(&features, &amplitudes.rows(0, n).into_owned());
    let left = rises.rows(0, n) - amplitudes.rows(0, n) * &modes + &fit.left_out * &modes;
    let moving = (!moved.is_empty()).then(|| {
        let own = amplitudes.rows(n, moved.len()).into_owned();
        let (coefficients, left_out) = over_time(histories, &own);
        let left = rises.rows(n, moved.len()) - own * &modes + left_out * &modes;
        MovingField { coefficients, error: FieldError::of(&left), histories: histories.len(), bound: snapshots.bound_in_time }
    });
    let (mut units, mut packed_modes) = (Vec::new(), Vec::new());
    for mode in modes.row_iter() {
        let scale = mode.iter().fold(1e-12, |most: f64, x| most.max(x.abs())) / f64::from(i16::MAX);
        packed_modes.push(packed(mode.iter().map(|x| ((x / scale).round() as i16).to_le_bytes())));
        units.push(scale);
    }
    let test = |x: &Vec<f64>, away: &[f64]| -> Result<FieldTest> {
        let features = features_of(x)?;
        let beyond = |k: usize| moving.as_ref().map_or(0.0, |own| own.coefficients[k].iter().zip(away).map(|(c, a)| c * a).sum());
        let found = (0..modes.nrows()).map(|k| fit.at(k, &features) + beyond(k)).collect::<Vec<f64>>();
        let vertices: Vec<usize> = (0..TESTED).map(|k| k * places / TESTED).collect();
        let value = |v: &usize| center[*v] + found.iter().enumerate().map(|(k, a)| a * modes[(k, *v)]).sum::<f64>();
        Ok(FieldTest { condition: x.clone(), away: away.to_vec(), values: vertices.iter().map(value).collect(), vertices })
    };
    let tested = conditions.iter().step_by((n / 2).max(1)).map(|x| test(x, &[]));
    let tested = tested.chain(moved.first().map(|own| test(&own.x, &own.away)));
    let self_tests = tested.collect::<Result<_>>()?;
    Ok(SceneField {
        variables: surrogate.variables().map(|v| v.name.to_string()).collect(),
        points: points.iter().filter_map(|p| surrogate.point(*p)).map(|p| p.name.to_string()).collect(),
        center: packed(center.iter().map(|x| (*x as f32).to_le_bytes())),
        modes: packed_modes,
        scales: units,
        self_tests,
        coefficients: fit.coefficients,
        error: FieldError::of(&left),
        conditions: n,
        bound: snapshots.bound,
        moving,
    })
}

impl FieldError {
    /// Error of differences at conditions (rows) and places (columns), K.
    fn of(left: &DMatrix<f64>) -> Self {
        Self { error: (left.norm_squared() / left.len().max(1) as f64).sqrt(), largest_error: left.amax() }
    }
}

/// Amplitudes (conditions by modes) and modes (by places) that leave little of a rise: the singular vectors of largest value.
fn modes(rise: &DMatrix<f64>, most: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let eigen = (rise * rise.transpose()).symmetric_eigen();
    let mut order: Vec<usize> = (0..rise.nrows()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let may_be_left = LEFT_BY_MODES.powi(2) * (rise.nrows() * rise.ncols()) as f64;
    let left_after = |count: usize| order[count..].iter().map(|k| eigen.eigenvalues[*k].max(0.0)).sum::<f64>();
    let count = (1..most.min(order.len())).find(|count| left_after(*count) <= may_be_left).unwrap_or(most.min(order.len()));
    let value = |k: usize| eigen.eigenvalues[order[k]].max(1e-24).sqrt();
    let amplitudes = DMatrix::from_fn(rise.nrows(), count, |i, k| eigen.eigenvectors[(i, order[k])] * value(k));
    let lengths = DVector::from_fn(count, |k, _| value(k).powi(-2));
    let modes = DMatrix::from_diagonal(&lengths) * amplitudes.transpose() * rise;
    (amplitudes, modes)
}

/// Coefficients of amplitudes over time on the states of a surrogate, and the amplitudes of each history less what all others say of
/// them. The penalty is the one that predicts histories best that are left out.
fn over_time(histories: &[Vec<Moving>], amplitudes: &DMatrix<f64>) -> (Vec<Vec<f64>>, DMatrix<f64>) {
    let away: Vec<&[f64]> = histories.iter().flatten().map(|own| own.away.as_slice()).collect();
    let (n, states) = (away.len(), away.first().map_or(0, |own| own.len()));
    let raw = DMatrix::from_fn(n, states, |i, j| away[i][j]);
    let spreads: Vec<f64> = raw.column_iter().map(|own| (own.norm_squared() / n as f64).sqrt().max(1e-12)).collect();
    let standard = DMatrix::from_fn(n, states, |i, j| raw[(i, j)] / spreads[j]);
    let ends: Vec<usize> = std::iter::once(0)
        .chain(histories.iter().scan(0, |sum, own| {
            *sum += own.len();
            Some(*sum)
        }))
        .collect();
    let (all, all_targets) = (standard.tr_mul(&standard), standard.tr_mul(amplitudes));
    let slopes = |gram: &DMatrix<f64>, targets: &DMatrix<f64>, penalty: f64| {
        let damped = gram + DMatrix::identity(states, states) * (penalty * n as f64);
        damped.cholesky().map_or_else(|| DMatrix::zeros(states, amplitudes.ncols()), |own| own.solve(targets))
    };
    let left_out = |penalty: f64| {
        let mut left = amplitudes.clone();
        for own in ends.windows(2) {
            let (from, count) = (own[0], own[1] - own[0]);
            let (x, y) = (standard.rows(from, count), amplitudes.rows(from, count));
            let others = slopes(&(&all - x.tr_mul(&x)), &(&all_targets - x.tr_mul(&y)), penalty);
            let mut rows = left.rows_mut(from, count);
            rows -= x * others;
        }
        (left.norm_squared(), penalty, left)
    };
    let best = PENALTIES.into_iter().map(left_out).min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, penalty, left) = best.unwrap_or_else(|| left_out(1.0));
    let found = slopes(&all, &all_targets, penalty);
    let of = |k: usize| (0..states).map(|j| found[(j, k)] / spreads[j]).collect();
    ((0..amplitudes.ncols()).map(of).collect(), left)
}

/// Ridge regression of amplitudes on features.
struct Regression {
    /// Coefficients of each amplitude: a constant, then one for each feature.
    coefficients: Vec<Vec<f64>>,
    /// Amplitudes of each condition less what all other conditions say of them.
    left_out: DMatrix<f64>,
}

impl Regression {
    /// The regression with the penalty that predicts conditions best that are left out.
    fn new(features: &[Vec<f64>], amplitudes: &DMatrix<f64>) -> Self {
        let (n, m) = (features.len(), features.first().map_or(0, Vec::len));
        let raw = DMatrix::from_fn(n, m, |i, j| features[i][j]);
        let means = raw.row_mean();
        let spread = |j: usize| (raw.column(j).iter().map(|x| (x - means[j]).powi(2)).sum::<f64>() / n as f64).sqrt().max(1e-12);
        let spreads: Vec<f64> = (0..m).map(spread).collect();
        let standard = DMatrix::from_fn(n, m, |i, j| (raw[(i, j)] - means[j]) / spreads[j]);
        let level = amplitudes.row_mean();
        let target = DMatrix::from_fn(n, amplitudes.ncols(), |i, k| amplitudes[(i, k)] - level[k]);
        let svd = standard.svd(true, true);
        let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else {
            return Self { coefficients: level.iter().map(|a| vec![*a]).collect(), left_out: target };
        };
        let projected = u.transpose() * &target;
        let with = |penalty: f64| {
            let shrink = svd.singular_values.map(|s| s * s / (s * s + penalty * n as f64));
            let leverage =
                DVector::from_fn(n, |i, _| 1.0 / n as f64 + (0..shrink.len()).map(|k| u[(i, k)].powi(2) * shrink[k]).sum::<f64>());
            let left = &target - u * DMatrix::from_diagonal(&shrink) * &projected;
            let left_out = DMatrix::from_fn(n, target.ncols(), |i, k| left[(i, k)] / (1.0 - leverage[i]).max(1e-6));
            (left_out.norm_squared(), penalty, left_out)
        };
        let best = PENALTIES.into_iter().map(with).min_by(|a, b| a.0.total_cmp(&b.0));
        let (_, penalty, left_out) = best.unwrap_or_else(|| with(1.0));
        let inverse = svd.singular_values.map(|s| s / (s * s + penalty * n as f64));
        let slopes = v_t.transpose() * DMatrix::from_diagonal(&inverse) * projected;
        let of = |k: usize| {
            let own: Vec<f64> = (0..m).map(|j| slopes[(j, k)] / spreads[j]).collect();
            let constant = level[k] - own.iter().zip(means.iter()).map(|(c, x)| c * x).sum::<f64>();
            std::iter::once(constant).chain(own).collect()
        };
        Self { coefficients: (0..target.ncols()).map(of).collect(), left_out }
    }

    /// An amplitude at some features.
    fn at(&self, amplitude: usize, features: &[f64]) -> f64 {
        let own = &self.coefficients[amplitude];
        own[0] + own[1..].iter().zip(features).map(|(c, x)| c * x).sum::<f64>()
    }
}
