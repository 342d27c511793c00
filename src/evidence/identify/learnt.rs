//! The model's own error where the stated ones cannot explain what a fit leaves.
//!
//! Its size is learnt from the residual beside the parameters ([`ErrorParts::learn`]), which are found as if readings were independent
//! ([`Sandwich`]).

use nalgebra::DMatrix;

use super::Problem;
use super::search::{Point, Search};
use crate::error::Result;
use crate::evidence::discrepancy::{ErrorParts, Level};
use crate::evidence::measurement::{Uncertainty, Whitener, whiten};
use crate::evidence::sandwich::{Sandwich, worth};

/// A misfit less probable than this is no longer put down to chance alone: the data are asked for more.
pub(super) const ALLOWED: f64 = 0.05;
/// Less probable than this, it is certainly not.
const CERTAIN: f64 = 1e-3;
/// Turns of learning the level and finding the parameters under it.
const MOST_ROUNDS: usize = 4;
/// Share of second differences, the largest ones, that may be jumps of the model; the mean of the other squares of a normal number;
/// and how many are needed.
const JUMPS: f64 = 0.05;
const TRIMMED: f64 = 0.759;
const LEAST: usize = 10;
/// Parameters rest within this share of their standard deviation.
const RESTS: f64 = 0.05;

/// A fit with the model error that was learnt beside it.
pub(super) struct Learnt {
    /// With derivatives with respect to the conditions.
    pub point: Point,
    /// What the search used: the standard deviation of each reading, and how many times more readings there are than they are
    /// worth.
    pub weights: Whitener,
    /// Curvature of half the misfit that the search descends, priors included.
    pub curvature: DMatrix<f64>,
    /// Covariance of its slope.
    pub scatter: DMatrix<f64>,
    /// The whole covariance of the readings.
    pub whitener: Whitener,
    pub level: Level,
    /// Noise of each sensor, K: as stated, or larger.
    pub noise: Vec<f64>,
}

/// Learns the level beside the parameters and finds them under it, in turns, until both rest. `None` where the data ask for no
/// model error, and the fit stands. In a log of which the stated errors explain less than [`CERTAIN`] that of its clock may.
///
/// What biases of sensors had been made to swallow is easily a valley of its own, so that the search also begins anew where the
/// machine file has the parameters.
pub(super) fn learnt(search: &mut Search<'_>, nominal: &Point, stated: &Point, explained: f64) -> Result<Option<Learnt>> {
    let is_timing = search.problem.data.is_transient() && explained < CERTAIN;
    let mut point = stated.clone();
    let mut level = Level::NONE;
    let uncertainty = scattered(search, stated);
    let mut rounds = 0..MOST_ROUNDS;
    loop {
        let parts = parts(search, &uncertainty, &point);
        let next = parts.learn(&search.left(&point), &search.broad_columns(&point), level, None);
        if next == Level::NONE && level == Level::NONE && !is_timing {
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
    /// The same at another point.
    pub fn at(&self, search: &Search<'_>, point: Point) -> Self {
        let uncertainty = Uncertainty { noise: self.noise.clone(), ..search.problem.uncertainty.clone() };
        let parts = parts(search, &uncertainty, &point);
        let weights = weights(search, &point, &parts, &self.level);
        filled(search, point, weights, &parts, self.level, uncertainty.noise)
    }
}

fn parts(search: &Search<'_>, uncertainty: &Uncertainty, point: &Point) -> ErrorParts {
    let (problem, prediction) = (search.problem, &point.prediction);
    let machine = &problem.study.model.machine;
    let mut parts = ErrorParts::new(machine, &problem.data, uncertainty, 0.0, &prediction.values, &prediction.conditions);
    parts.extend(search.mesh.scatter.iter().cloned());
    parts
}

/// The stated uncertainty, with each sensor's noise no smaller than its readings scatter in a log: by second differences of what a
/// fit leaves, in which nothing is left of an error that lasts.
fn scattered(search: &Search<'_>, at: &Point) -> Uncertainty {
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
        // Where conditions step a wrong model jumps.
        squares.sort_by(f64::total_cmp);
        squares.truncate(squares.len() - (squares.len() as f64 * JUMPS).ceil() as usize);
        if squares.len() >= LEAST {
            let trimmed = squares.iter().sum::<f64>() / squares.len() as f64 / TRIMMED;
            *noise = noise.max(trimmed.sqrt());
        }
    }
    found
}

/// The weights at a point: the standard deviation of each reading alone.
fn weights(search: &Search<'_>, at: &Point, parts: &ErrorParts, level: &Level) -> Whitener {
    // What differs from test to test weighs no test and no hot reading less: it is in the intervals alone.
    let deviations = parts.marginal(&Level { between_tests: 0.0, ..*level });
    let worth = worth(&search.slopes(at), &deviations, |vector| parts.times(level, vector));
    Whitener::new(&deviations.iter().map(|d| d * worth.sqrt()).collect::<Vec<_>>(), &[])
}

/// What a point comes to with its weights.
fn filled(search: &Search<'_>, point: Point, weights: Whitener, parts: &ErrorParts, level: Level, noise: Vec<f64>) -> Learnt {
    let Sandwich { curvature, scatter } = Sandwich::of(&search.slopes(&point), &weights, parts, &level, search.prior_information());
    let whitener = parts.whitener(&level, &(0..search.readings.len()).collect::<Vec<_>>());
    Learnt { point: search.under(point, &weights), weights, curvature, scatter, whitener, level, noise }
}

/// What a fit takes the own error of one sensor to be.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorError {
    /// Column of the data.
    pub sensor: usize,
    /// It reads higher by this, K.
    pub value: f64,
    /// What is stated of it, K: a standard deviation.
    pub stated: f64,
    /// Its noise from reading to reading, K: as stated, or where a model error was learnt no less than its readings scatter.
    pub noise: f64,
}

/// The expectation of every sensor's own error under a covariance, from the residual (K) of a fit.
pub(super) fn sensor_errors(problem: &Problem, residual: &[f64], whitener: &Whitener, noise: &[f64]) -> Vec<SensorError> {
    let left = whitener.apply(residual);
    let places = whiten::places(&problem.data);
    let of = |(sensor, stated): (usize, &f64)| {
        let own: Vec<f64> = places.iter().map(|(_, k)| if *k == sensor { *stated } else { 0.0 }).collect();
        let along: f64 = whitener.apply(&own).iter().zip(&left).map(|(a, b)| a * b).sum();
        SensorError { sensor, value: stated * along, stated: *stated, noise: noise[sensor] }
    };
    problem.uncertainty.bias.iter().enumerate().map(of).collect()
}
