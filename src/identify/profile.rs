//! Profile likelihood: the least misfit for given values of one parameter, all others refitted.

use super::estimate::{Estimate, Options, identify};
use super::{Free, Problem};
use crate::error::Result;

/// Misfit above the least one at the ends of a 95 % interval: chi-square of one degree of freedom.
const RISE_95: f64 = 3.841_459;
/// Places along a parameter, in standard deviations.
const PLACES: [f64; 6] = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0];

/// The profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Index of the free parameter.
    pub parameter: usize,
    /// Values (SI) and the misfit there above the least one, in the order of values.
    pub points: Vec<(f64, f64)>,
    /// Where the misfit rises by 3.84, SI; `None` where it does not within the bounds.
    pub interval: (Option<f64>, Option<f64>),
}

/// Profiles one parameter around an estimate.
///
/// # Errors
/// As [`identify`].
pub fn profile(problem: &Problem, estimate: &Estimate, parameter: usize) -> Result<Profile> {
    let free = &problem.free[parameter];
    let centre = free.coordinate(estimate.values[parameter]);
    let (low, high) = (free.coordinate(free.bounds.0), free.coordinate(free.bounds.1));
    let spread = if estimate.deviations[parameter].is_finite() { estimate.deviations[parameter] } else { (high - low) / 6.0 };
    let spread = spread.min((high - low) / 4.0);
    let mut points = vec![(estimate.values[parameter], 0.0)];
    let others: Vec<Free> = problem.free.iter().enumerate().filter(|(k, _)| *k != parameter).map(|(_, f)| f.clone()).collect();
    for place in PLACES {
        let coordinate = centre + place * spread;
        if coordinate < low || coordinate > high {
            continue;
        }
        let value = free.value(coordinate);
        let study = problem.study.with(&[(&free.parameter, value)])?;
        // A prior of the profiled parameter counts too.
        let own = free.prior.map_or(0.0, |(at, deviation)| {
            let spread = if free.is_logarithmic { deviation / at } else { deviation };
            let square = |c: f64| ((c - free.coordinate(at)) / spread).powi(2);
            square(coordinate) - square(centre)
        });
        let misfit = if others.is_empty() {
            let prediction = super::predict(&study, &problem.data, &[], problem.start)?;
            misfit(problem, &prediction)
        } else {
            let mut others = others.clone();
            for (k, other) in (0..problem.free.len()).filter(|k| *k != parameter).zip(&mut others) {
                other.parameter.value = estimate.values[k];
            }
            let problem = Problem { study, free: others, ..problem.clone() };
            identify(&problem, &Options { starts: 1, seed: 1 }, &mut |_| {})?.misfit.1
        };
        points.push((value, misfit - estimate.misfit.1 + own));
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let crossing = |upwards: bool| -> Option<f64> {
        let at = points.iter().position(|p| p.0 == estimate.values[parameter])?;
        let side: Vec<&(f64, f64)> = if upwards { points[at..].iter().collect() } else { points[..=at].iter().rev().collect() };
        side.windows(2).find(|pair| pair[0].1 < RISE_95 && pair[1].1 >= RISE_95).map(|pair| {
            // Between two places the root of the rise runs nearly straight.
            let (a, b) = (pair[0].1.max(0.0).sqrt(), pair[1].1.sqrt());
            let share = (RISE_95.sqrt() - a) / (b - a);
            free.value(free.coordinate(pair[0].0) + share * (free.coordinate(pair[1].0) - free.coordinate(pair[0].0)))
        })
    };
    let interval = (crossing(false), crossing(true));
    Ok(Profile { parameter, points, interval })
}

/// Whitened misfit of a prediction.
pub(super) fn misfit(problem: &Problem, prediction: &super::Prediction) -> f64 {
    use super::estimate::{difference, square};
    use crate::measure::{Whitener, whiten};
    let whitener = Whitener::of(&problem.data, &problem.uncertainty, &prediction.conditions);
    square(&whitener.apply(&difference(&whiten::readings(&problem.data), &prediction.values)))
}
