//! Profile likelihood: the least misfit for given values of one parameter, all others refitted.

use super::IdentifyProblem;
use super::estimate::Estimate;
use super::search::{Point, Search};
use coldplate_base::error::Result;
use coldplate_base::progress::{Progress, Silent};

/// Misfit above the least one at the ends of a 95 % interval: quantile of chi-square with one degree of freedom, dimensionless.
const RISE_95: f64 = 3.841_459;
/// Points along a parameter to either side, in standard deviations. Chosen, and stated in docs/method/identification.md.
const PLACES: [f64; 3] = [1.0, 2.0, 3.0];

/// The profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterProfile {
    /// Index of the free parameter.
    pub parameter: usize,
    /// Values (SI) and the misfit there (priors included) above the least one, in the order of values.
    pub points: Vec<(f64, f64)>,
    /// Values at which the misfit rises by 3.84 (times [`Estimate::rises`]), SI; `None` if it does not within the bounds.
    pub interval: (Option<f64>, Option<f64>),
}

/// Profiles one parameter around an estimate, under the covariance of the estimate. The profile ends at values with which the
/// machine can no longer be solved.
///
/// # Errors
/// Errors of [`IdentifyProblem::predict`].
pub fn profile(problem: &IdentifyProblem, estimate: &Estimate, parameter: usize) -> Result<ParameterProfile> {
    profile_heard(problem, estimate, parameter, &Silent)
}

/// Profiles one parameter as [`profile`] does, and reports progress.
///
/// # Errors
/// Errors of [`profile`].
pub fn profile_heard(
    problem: &IdentifyProblem,
    estimate: &Estimate,
    parameter: usize,
    progress: &dyn Progress,
) -> Result<ParameterProfile> {
    let free = &estimate.free[parameter];
    let best: Vec<f64> = estimate.free.iter().zip(&estimate.values).map(|(f, v)| f.coordinate(*v)).collect();
    let (low, high) = free.coordinate_bounds();
    let spread = estimate.deviations[parameter].min((high - low) / 4.0);
    let rise = RISE_95 * estimate.rises[parameter];
    let mut search = Search::new(problem, progress).corrected(estimate.mesh.clone());
    search.free.clone_from(&estimate.free);
    search.stride = estimate.stride.clone();
    search.frozen = (0..estimate.free.len()).filter(|k| *k == parameter || estimate.kept[*k]).collect();
    let mut points = vec![(best[parameter], 0.0)];
    for side in [-1.0, 1.0] {
        let mut last = Point { coordinates: best.clone(), ..estimate.end.clone() };
        for place in PLACES {
            let coordinate = best[parameter] + side * place * spread;
            if coordinate < low || coordinate > high {
                break;
            }
            // The other parameters first move as the curvature predicts, if their variances are finite; from there they are
            // refitted.
            let moved = coordinate - last.coordinates[parameter];
            let own = estimate.given[(parameter, parameter)];
            let from = |(k, f): (usize, &super::Free)| {
                let (low, high) = f.coordinate_bounds();
                let along = estimate.given[(k, parameter)] / own * moved;
                if k == parameter { coordinate } else { (last.coordinates[k] + along.clamp(-1.0, 1.0)).clamp(low, high) }
            };
            let from: Vec<f64> = estimate.free.iter().enumerate().map(from).collect();
            // The slopes of a log are carried from point to point; those of a steady table are found anew.
            let start = if problem.data.is_transient() {
                let (matrix, _) = search.normal(&last, &estimate.whitener);
                search.after(&last, from, &matrix, &estimate.whitener)
            } else {
                search.point(from, &estimate.whitener)
            };
            let Ok(start) = start else { break };
            let end = if search.frozen.len() < estimate.free.len() { search.descend(start, &estimate.whitener) } else { start };
            points.push((coordinate, end.cost - estimate.least));
            last = end;
        }
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let crossing = |upwards: bool| -> Option<f64> {
        let at = points.iter().position(|p| p.0 == best[parameter])?;
        let side: Vec<&(f64, f64)> = if upwards { points[at..].iter().collect() } else { points[..=at].iter().rev().collect() };
        side.windows(2).find(|pair| pair[0].1 < rise && pair[1].1 >= rise).map(|pair| {
            // Between two points the root of the rise is nearly straight.
            let (a, b) = (pair[0].1.max(0.0).sqrt(), pair[1].1.sqrt());
            let share = (rise.sqrt() - a) / (b - a);
            free.value(pair[0].0 + share * (pair[1].0 - pair[0].0))
        })
    };
    let interval = (crossing(false), crossing(true));
    Ok(ParameterProfile { parameter, points: points.into_iter().map(|(c, rise)| (free.value(c), rise)).collect(), interval })
}
