//! Model error that is learnt if the stated errors cannot explain the residual of a fit.
//!
//! The size is learnt from the residual beside the parameters ([`ErrorParts::learn`]). The parameters are found as if readings
//! were independent ([`Sandwich`]).

use nalgebra::DMatrix;

use super::IdentifyProblem;
use super::search::{Point, Search};
use crate::discrepancy::{DiscrepancySize, ErrorParts};
use crate::measurement::{MeasurementUncertainty, Whitener, whiten};
use crate::sandwich::{Sandwich, worth};
use coldplate_base::error::Result;

/// Probability of the misfit below which a model error is looked for. Chosen: the usual level of significance, stated in
/// docs/method/identification.md.
pub(super) const ALLOWED: f64 = 0.05;
/// Probability of the misfit below which chance is excluded. Chosen: a larger one lets chance widen the intervals of logs.
pub(super) const CERTAIN: f64 = 1e-3;
/// Most turns of learning the level and finding the parameters under it, count. Chosen: each costs a search.
const MOST_ROUNDS: usize = 4;
/// Share of the second differences, the largest ones, that may be jumps of the model and are left out. Chosen: a larger share
/// loses noise.
const JUMPS: f64 = 0.05;
/// Mean of the squares of a normal number of unit variance without the largest 5 % of them; dimensionless, by derivation.
const TRIMMED: f64 = 0.759;
/// Least number of second differences for an estimate of the noise, count. Chosen: fewer make it too uncertain.
const LEAST: usize = 10;
/// The parameters count as found if they move by less than this share of their standard deviation. Chosen: a smaller one costs
/// turns.
const RESTS: f64 = 0.05;

/// A fit with the model error that was learnt beside it.
pub(super) struct Learnt {
    /// End point, with derivatives with respect to the conditions.
    pub point: Point,
    /// Weights of the search: the inverse variance of each reading, divided by the number of readings per independent one.
    pub weights: Whitener,
    /// Curvature of half the misfit that the search descends, priors included.
    pub curvature: DMatrix<f64>,
    /// Covariance of the slope of half the misfit that the search descends.
    pub scatter: DMatrix<f64>,
    /// Whitening by the whole covariance of the readings.
    pub whitener: Whitener,
    /// Size of the model error.
    pub level: DiscrepancySize,
    /// Noise of each sensor, K: as stated, or larger.
    pub noise: Vec<f64>,
}

/// Learns the level beside the parameters and finds the parameters under it, in turns, until both rest. `None` if the data ask
/// for no model error: the fit then stands. In a log that the stated errors explain with a probability below [`CERTAIN`], the
/// stated error of its clock is added even if the level is zero.
///
/// Biases of sensors that had taken the place of parameters often form a valley of their own. Therefore the search also begins
/// anew at the parameters of the machine file.
pub(super) fn learnt(search: &mut Search<'_>, nominal: &Point, stated: &Point, explained: f64) -> Result<Option<Learnt>> {
    let is_timing = search.problem.data.is_transient() && explained < CERTAIN;
    let mut point = stated.clone();
    let mut level = DiscrepancySize::NONE;
    let uncertainty = scattered(search, stated);
    let mut rounds = 0..MOST_ROUNDS;
    loop {
        let parts = parts(search, &uncertainty, &point);
        let next = parts.learn(&search.left(&point), &search.broad_columns(&point), level, None);
        if next == DiscrepancySize::NONE && level == DiscrepancySize::NONE && !is_timing {
            return Ok(None);
        }
        let weights = weights(search, &point, &parts, &next);
        let Some(round) = rounds.next() else { return Ok(Some(filled(search, point, weights, &parts, next, uncertainty.noise))) };
        let is_same = round > 0 && next == level;
        level = next;
        point = search.under(point, &weights);
        if is_same && search.rests(&point, &weights, RESTS) {
            return Ok(Some(filled(search, point, weights, &parts, level, uncertainty.noise)));
        }
        let mut best = search.descend(point, &weights);
        if round == 0 {
            let begun = search.under(nominal.clone(), &weights);
            let other = search.descend(begun, &weights);
            best = if other.cost < best.cost { other } else { best };
        }
        (point, _) = search.whole(best.coordinates)?;
    }
}

impl Learnt {
    /// The fit at another point, with the level that was learnt.
    pub fn at(&self, search: &Search<'_>, point: Point) -> Self {
        let uncertainty = MeasurementUncertainty { noise: self.noise.clone(), ..search.problem.uncertainty.clone() };
        let parts = parts(search, &uncertainty, &point);
        let weights = weights(search, &point, &parts, &self.level);
        filled(search, point, weights, &parts, self.level, uncertainty.noise)
    }
}

fn parts(search: &Search<'_>, uncertainty: &MeasurementUncertainty, point: &Point) -> ErrorParts {
    let (problem, prediction) = (search.problem, &point.prediction);
    let machine = &problem.study.model.machine;
    let mut parts = ErrorParts::new(machine, &problem.data, uncertainty, 0.0, &prediction.values, &prediction.conditions);
    parts.extend(search.mesh.scatter.iter().cloned());
    parts
}

/// Stated uncertainty, with the noise of each sensor raised to the scatter of its readings in a log. The scatter is estimated
/// by second differences of the residual, from which lasting errors cancel.
fn scattered(search: &Search<'_>, at: &Point) -> MeasurementUncertainty {
    let data = &search.problem.data;
    let mut found = search.problem.uncertainty.clone();
    if !data.is_transient() {
        return found;
    }
    let (left, places) = (search.left(at), whiten::places(data));
    for (sensor, noise) in found.noise.iter_mut().enumerate() {
        let mut squares: Vec<f64> = Vec::new();
        for test in data.tests() {
            let own = |i: &usize| places[*i].1 == sensor && data.rows[places[*i].0].test == test;
            let series: Vec<f64> = (0..places.len()).filter(own).map(|i| left[i]).collect();
            squares.extend(series.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2) / 6.0));
        }
        // A wrong model jumps at the steps of conditions.
        squares.sort_by(f64::total_cmp);
        squares.truncate(squares.len() - (squares.len() as f64 * JUMPS).ceil() as usize);
        if squares.len() >= LEAST {
            let trimmed = squares.iter().sum::<f64>() / squares.len() as f64 / TRIMMED;
            *noise = noise.max(trimmed.sqrt());
        }
    }
    found
}

/// Weights at a point: the standard deviation of each reading alone.
fn weights(search: &Search<'_>, at: &Point, parts: &ErrorParts, level: &DiscrepancySize) -> Whitener {
    // Differences between tests do not lower the weight of a test or of a hot reading: they act on the intervals alone.
    let deviations = parts.marginal(&DiscrepancySize { between_tests: 0.0, ..*level });
    let worth = worth(&search.slopes(at), &deviations, |vector| parts.times(level, vector));
    Whitener::new(&deviations.iter().map(|d| d * worth.sqrt()).collect::<Vec<_>>(), &[])
}

/// The fit at a point: curvature, covariance of the slope and whitening with the given weights.
fn filled(search: &Search<'_>, point: Point, weights: Whitener, parts: &ErrorParts, level: DiscrepancySize, noise: Vec<f64>) -> Learnt {
    let Sandwich { curvature, scatter } = Sandwich::of(&search.slopes(&point), &weights, parts, &level, search.prior_information());
    let whitener = parts.whitener(&level, &(0..search.readings.len()).collect::<Vec<_>>());
    Learnt { point: search.under(point, &weights), weights, curvature, scatter, whitener, level, noise }
}

/// Estimate of the own error of one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorError {
    /// Column of the data.
    pub sensor: usize,
    /// Amount by which the sensor reads too high, K.
    pub value: f64,
    /// Stated standard deviation of the sensor's own error, K.
    pub stated: f64,
    /// Noise of the sensor from reading to reading, K: as stated, or at least the scatter of its readings if a model error was
    /// learnt.
    pub noise: f64,
}

/// The expectation of every sensor's own error under a covariance, from the residual (K) of a fit.
pub(super) fn sensor_errors(problem: &IdentifyProblem, residual: &[f64], whitener: &Whitener, noise: &[f64]) -> Vec<SensorError> {
    let left = whitener.apply(residual);
    let places = whiten::places(&problem.data);
    let of = |(sensor, stated): (usize, &f64)| {
        let own: Vec<f64> = places.iter().map(|(_, k)| if *k == sensor { *stated } else { 0.0 }).collect();
        let along: f64 = whitener.apply(&own).iter().zip(&left).map(|(a, b)| a * b).sum();
        SensorError { sensor, value: stated * along, stated: *stated, noise: noise[sensor] }
    };
    problem.uncertainty.bias.iter().enumerate().map(of).collect()
}
