//! Further starts of a search: those that are asked for, and those that a misfit asks for that the stated errors do not explain.

use super::descent::MOST_STEPS;
use super::free::Free;
use super::search::{Point, Search};
use super::search_end::SearchEnd;
use crate::measurement::Whitener;
use coldplate_base::random::Random;

/// Points that a wider search looks at, count. Chosen: each costs a prediction without slopes.
const SCREENED: usize = 16;
/// Points of these, those of the least misfit, from which it descends; count. Chosen: each costs a search.
const DESCENDED: usize = 2;
/// Steps after which a descent that is not better yet is given up if the misfit is no more than [`LARGE`], count. Chosen: a model that
/// is a little wrong has such a misfit at its best, and longer descents are spared there.
const STEPS: usize = 12;
/// Misfit per reading up to which a model may well be at its best, dimensionless. Chosen: residuals of five deviations.
const LARGE: f64 = 25.0;
/// Factor by which positive parameters are varied to either side of the file's value or of that found; dimensionless. Chosen.
const WIDE: f64 = 30.0;
/// Share of the range of other parameters by which they are varied to either side, dimensionless. Chosen.
const WIDE_SHARE: f64 = 0.2;

/// Outcome of a wider search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WiderSearch {
    /// Points that were looked at.
    pub points: usize,
    /// Misfit before it, priors included.
    pub before: f64,
    /// Misfit after it.
    pub after: f64,
}

/// Another point to start from: within a factor of three, or within the bounds if these are closer. If the machine cannot be
/// solved there, half-way back.
pub(super) fn around(search: &mut Search<'_>, start: &[f64], whitener: &Whitener, noise: &mut Random) -> Option<Point> {
    let one = |(f, c): (&Free, &f64)| {
        let (low, high) = f.coordinate_bounds();
        let reach = if f.is_logarithmic { 3f64.ln() } else { 0.1 * (high - low) };
        (c + reach * (2.0 * noise.unit() - 1.0)).clamp(low, high)
    };
    let mut to: Vec<f64> = search.free.iter().zip(start).map(one).collect();
    for _ in 0..4 {
        match search.point(to.clone(), whitener) {
            Ok(point) => return Some(point),
            Err(_) => to.iter_mut().zip(start).for_each(|(c, s)| *c = 0.5 * (*c + s)),
        }
    }
    None
}

/// The best end of descents from points far around those known, if any is better than `best`; with an account of the search.
pub(super) fn wider(
    search: &mut Search<'_>,
    start: &[f64],
    best: &Point,
    whitener: &Whitener,
    noise: &mut Random,
) -> (Option<Point>, WiderSearch) {
    let mut looked: Vec<Point> = Vec::new();
    for _ in 0..SCREENED {
        let one = |(free, (given, found)): (&Free, (&f64, &f64))| {
            let (low, high) = free.coordinate_limits();
            let reach = if free.is_logarithmic { WIDE.ln() } else { WIDE_SHARE * (free.bounds.1 - free.bounds.0) };
            // A number that ran to a limit went astray.
            let is_within = low + reach < *found && *found < high - reach;
            let middle = if is_within && noise.unit() < 0.5 { *found } else { *given };
            (middle + reach * (2.0 * noise.unit() - 1.0)).clamp(low, high)
        };
        let to: Vec<f64> = search.free.iter().zip(start.iter().zip(&best.coordinates)).map(one).collect();
        looked.extend(search.predicted(to, false, whitener).ok());
    }
    let points = looked.len();
    looked.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let most = if best.cost > LARGE * search.readings.len() as f64 { MOST_STEPS } else { STEPS };
    let mut ends = vec![best.clone()];
    for begun in looked.into_iter().take(DESCENDED) {
        let Ok(begun) = search.point(begun.coordinates, whitener) else { continue };
        let mut end = search.descend_unless(begun, whitener, &ends, most);
        if end.cost < best.cost && search.ended == SearchEnd::StepLimit {
            end = search.descend(end, whitener);
        }
        ends.push(end);
    }
    let least = ends.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).filter(|end| end.cost < best.cost);
    let after = least.as_ref().map_or(best.cost, |end| end.cost);
    (least, WiderSearch { points, before: best.cost, after })
}
