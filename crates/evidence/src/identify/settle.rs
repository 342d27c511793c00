//! Parameters that the data do not determine, or determine only on one side.

use super::ended::Ended;
use super::free::Free;
use super::search::{Point, Search};
use super::search_end::SearchEnd;
use crate::measurement::Whitener;
use coldplate_base::error::Result;
use coldplate_base::numbers::TWO_SIDED_95;

/// Rise of the misfit below which a parameter counts as not determined: 95 % quantile of chi-square with one degree of freedom;
/// dimensionless.
const HARDLY: f64 = 3.841_459;
/// A search is at rest if no coordinate would move by more than this share of its standard deviation. Chosen: far below the
/// interval, and above the noise that time steps leave in logs.
const RESTS: f64 = 0.3;
/// Standard deviation of a logarithm above which a value cannot be told from zero at 95 %: half of the value.
const LIKE_ZERO: f64 = 0.5;
/// Share of its standard deviation below which a value counts as zero, if the misfit does not rise by more than this. Chosen.
const ZERO: f64 = 1e-2;

/// How a search ended that led to a point with some coordinates held.
pub(super) fn end_of(search: &mut Search<'_>, at: &Point, weights: &Whitener, held: &[usize]) -> SearchEnd {
    search.frozen = held.to_vec();
    match search.ended {
        _ if search.rests(at, weights, RESTS) => SearchEnd::AtRest,
        SearchEnd::AtRest => SearchEnd::NoStep,
        other => other,
    }
}

/// Puts parameters that left their usual range back to its end, one after another, and finds the others anew. One stays there
/// if the misfit rises by less than [`HARDLY`]: then the data do not ask for more. From here on each range is that of the value
/// found, and nothing leaves it.
pub(super) fn into_ranges(search: &mut Search<'_>, mut best: Point, whitener: &Whitener) -> Point {
    for k in 0..search.free.len() {
        let value = search.free[k].value(best.coordinates[k]);
        if search.free[k].is_unusual(value) && search.free[k].bounds != search.free[k].limits {
            let bound = if value < search.free[k].bounds.0 { search.free[k].bounds.0 } else { search.free[k].bounds.1 };
            let mut to = best.coordinates.clone();
            to[k] = search.free[k].coordinate(bound);
            search.frozen = vec![k];
            let back = search.point(to, whitener).map(|begun| search.descend(begun, whitener));
            search.frozen.clear();
            match back {
                Ok(back) if back.cost - best.cost < HARDLY => best = back,
                _ => search.free[k].widen(value),
            }
        }
        search.free[k].limits = search.free[k].bounds;
    }
    best
}

/// Gives parameters a linear scale that the data determine on one side only: their values cannot be told from zero, and an upper
/// end of their interval on that scale is refuted by a run.
pub(super) fn on_linear_scale(search: &mut Search<'_>, mut ended: Ended) -> Result<Ended> {
    for k in 0..search.free.len() {
        let free = &search.free[k];
        let deviation = ended.covariance(&[])[(k, k)].max(0.0).sqrt();
        if !free.is_logarithmic || !free.has_usual_range || free.prior.is_some() || deviation < LIKE_ZERO {
            continue;
        }
        let value = free.value(ended.point.coordinates[k]);
        let spread = deviation * value;
        let high = value + TWO_SIDED_95 * spread;
        if !high.is_finite() || !is_refuted(search, &ended, k, high) {
            continue;
        }
        search.free[k].on_linear_scale(high);
        let mut point = ended.point.clone();
        point.coordinates[k] = value;
        if value < ZERO * spread && search.free[k].is_valid(&search.problem.study, 0.0) {
            let mut none = point.coordinates.clone();
            none[k] = 0.0;
            if let Ok(none) = search.point(none, &ended.weights)
                && none.cost <= point.cost + ZERO
            {
                search.free[k].bounds.0 = 0.0;
                search.free[k].limits.0 = 0.0;
                point = none;
            }
        }
        let (whole, _) = search.whole(point.coordinates)?;
        let point = search.under(whole, &ended.weights);
        ended = ended.at(search, point);
    }
    Ok(ended)
}

/// Whether a value of one parameter, with the others found anew, raises the misfit as a standard deviation does at least.
fn is_refuted(search: &mut Search<'_>, ended: &Ended, k: usize, value: f64) -> bool {
    let mut to = ended.point.coordinates.clone();
    to[k] = search.free[k].coordinate(value);
    search.frozen = vec![k];
    let back = search.point(to, &ended.weights).map(|begun| search.descend(begun, &ended.weights));
    search.frozen.clear();
    back.is_ok_and(|back| back.cost - ended.point.cost >= 1.0)
}

/// Puts parameters that the data do not determine back to the file's values, one after another, the least known first, and
/// finds the others anew. Candidates are parameters whose 95 % interval is wider than their bounds, or which ran to a bound.
/// One stays at the file's value if the misfit rises by less than [`HARDLY`].
pub(super) fn keep(search: &mut Search<'_>, mut ended: Ended) -> Result<(Ended, Vec<usize>)> {
    let free = search.free.clone();
    let mut kept: Vec<usize> = Vec::new();
    let mut tried: Vec<usize> = Vec::new();
    loop {
        let covariance = ended.covariance(&kept);
        let open = |k: usize| -> f64 {
            let c = ended.point.coordinates[k];
            let (low, high) = free[k].coordinate_bounds();
            let width = 2.0 * TWO_SIDED_95 * covariance[(k, k)].max(0.0).sqrt() / (high - low);
            // Data may well say that a value is hardly above zero.
            if is_at_bound(&free[k], c) && !free[k].is_like_zero { width.max(1.0) } else { width }
        };
        let may = |k: &usize| !tried.contains(k) && !free[*k].is_unusual(free[*k].parameter.value);
        let Some(k) = (0..free.len()).filter(may).filter(|k| open(*k) >= 1.0).max_by(|a, b| open(*a).total_cmp(&open(*b))) else {
            return Ok((ended, kept));
        };
        tried.push(k);
        let mut to = ended.point.coordinates.clone();
        to[k] = free[k].coordinate(free[k].parameter.value);
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

/// Whether a coordinate is at an end of its bounds.
pub(super) fn is_at_bound(free: &Free, coordinate: f64) -> bool {
    let (low, high) = free.coordinate_bounds();
    (coordinate - low).abs() < 1e-6 * (high - low) || (high - coordinate).abs() < 1e-6 * (high - low)
}
