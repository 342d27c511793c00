//! Descent from a point: steps, their damping, and when it ends.

use nalgebra::{DMatrix, DVector};

use super::search::{Point, Search};
use super::search_end::SearchEnd;
use super::step::least_within;
use crate::measurement::Whitener;

/// The search ends if no coordinate moves by more than this share of its standard deviation. Chosen: far below the interval.
const STEP_TOLERANCE: f64 = 1e-3;
/// Fall of the misfit, as a share of it, that is below the rounding of its sum. Chosen.
const ROUNDING: f64 = 1e-9;
/// Most steps of a search, count. Chosen: a guard against a search that does not end.
pub(super) const MOST_STEPS: usize = 60;
/// Damping that counts as none, relative to the diagonal of the curvature. Chosen.
const UNDAMPED: f64 = 1e-9;
/// Damping of the first step, relative to the diagonal of the curvature. Chosen.
const DAMPED: f64 = 1e-4;
/// Least expected fall of the misfit for which a search through logs goes on, as a share of the misfit per degree of freedom:
/// time steps leave some noise. At 0.02 a coordinate is within a seventh of its standard deviation, the root of 0.02. The noise
/// grows with the residuals that it adds to. If the stated errors explain ever less of these, the end need not be known as
/// well: the share grows as the root of the factor by which the misfit is too large.
const LEAST_GAIN: f64 = 0.02;
/// Largest expected fall of the misfit, as a share of it, that counts as noise of time steps. Chosen: a misfit that can fall by
/// more than a thousandth is not at its least, however few the readings are.
const MOST_NOISE: f64 = 1e-3;
/// Damping up to which a step is nearly Newton's, so that its length is the distance to the minimum. Dimensionless; chosen.
const FREE: f64 = 1e-2;
/// Most trials of one step, each more damped than the one before, count. Chosen: each costs a prediction.
const MOST_TRIALS: usize = 10;
/// Two starts have the same end if no coordinate differs by more than this share of its standard deviation. Chosen: a larger
/// one saves runs.
const THERE: f64 = 0.5;
/// Change of a coordinate, over the size of its parameter, beyond which the slopes of a log are not carried along. Chosen: a
/// factor of 4.5, over which the effect of a conductance changes its size.
const FAR: f64 = 1.5;

/// A step of the linear model.
struct Step {
    /// Coordinates of the point to which it leads.
    to: Vec<f64>,
    /// Fall of the misfit that the model promises.
    gain: f64,
}

impl Search<'_> {
    /// A damped step within the limits; `None` if the curvature is not positive.
    fn step(&self, at: &Point, matrix: &DMatrix<f64>, right: &DVector<f64>, damping: f64) -> Option<Step> {
        let mut damped = matrix.clone();
        (0..right.len()).for_each(|k| damped[(k, k)] *= 1.0 + damping);
        let reach = |k: usize| if self.frozen.contains(&k) { (0.0, 0.0) } else { self.free[k].reach(at.coordinates[k]) };
        let step = least_within(&damped, right, &(0..right.len()).map(reach).collect::<Vec<_>>())?;
        let to = |(k, c): (usize, &f64)| {
            let (low, high) = self.free[k].coordinate_limits();
            // A coordinate that does not move keeps its digits.
            if step[k] == 0.0 { *c } else { self.free[k].moved(*c, step[k]).clamp(low, high) }
        };
        let to: Vec<f64> = at.coordinates.iter().enumerate().map(to).collect();
        let gain = 2.0 * right.dot(&step) - step.dot(&(matrix * &step));
        to.iter().all(|c| c.is_finite()).then_some(Step { to, gain })
    }

    /// Whether no coordinate moves by more than a share of its standard deviation.
    fn is_small(from: &[f64], to: &[f64], matrix: &DMatrix<f64>, share: f64) -> bool {
        (0..to.len()).all(|k| to[k] == from[k] || (to[k] - from[k]).abs() <= share / matrix[(k, k)].max(1e-300).sqrt())
    }

    /// Whether an undamped step under this covariance would move a point by less than a share of its standard deviation, and
    /// lower the misfit by less than that is worth.
    pub fn rests(&self, at: &Point, whitener: &Whitener, share: f64) -> bool {
        let (matrix, right) = self.normal(at, whitener);
        let Some(step) = self.step(at, &matrix, &right, UNDAMPED) else { return true };
        step.gain <= self.least_gain(at.cost)
            || (Self::is_small(&at.coordinates, &step.to, &matrix, share) && step.gain <= (share * share).max(ROUNDING * at.cost))
    }

    /// Gain below which no further step is made at a misfit of `cost`; zero in steady tables.
    fn least_gain(&self, cost: f64) -> f64 {
        if !self.problem.data.is_transient() {
            return 0.0;
        }
        let freedom = self.readings.len().saturating_sub(self.free.len()).max(1) as f64;
        let noise = LEAST_GAIN * (self.tolerance / self.accuracy) * (cost / freedom).max(1.0).powf(1.5);
        // Readings that are explained leave a misfit of about one each, however few they are.
        noise.min((MOST_NOISE * cost).max(LEAST_GAIN * (self.tolerance / self.accuracy)))
    }

    /// Descends from one point with the covariance held. Ends if steps are small or no step leads down.
    pub(super) fn descend(&mut self, here: Point, whitener: &Whitener) -> Point {
        self.descend_unless(here, whitener, &[], MOST_STEPS)
    }

    /// Descends as [`Search::descend`] does, by so many steps at most. A search that comes to the end of another start returns that
    /// end.
    pub(super) fn descend_unless(&mut self, mut here: Point, whitener: &Whitener, ends: &[Point], most: usize) -> Point {
        self.ended = SearchEnd::AtRest;
        // A point without free coordinates was predicted without its slopes.
        if (0..here.coordinates.len()).all(|k| self.frozen.contains(&k)) {
            return here;
        }
        let mut damping = DAMPED;
        for _ in 0..most {
            let (matrix, right) = self.normal(&here, whitener);
            let is_there = |end: &&Point| end.cost <= here.cost && Self::is_small(&here.coordinates, &end.coordinates, &matrix, THERE);
            if let Some(end) = ends.iter().find(is_there) {
                return end.clone();
            }
            let promised = self.step(&here, &matrix, &right, UNDAMPED).map_or(f64::INFINITY, |step| step.gain);
            if promised <= self.least_gain(here.cost) {
                return here;
            }
            let is_spent = promised <= (STEP_TOLERANCE * STEP_TOLERANCE).max(ROUNDING * here.cost);
            match self.advance(&here, (&matrix, &right), whitener, &mut damping, is_spent) {
                Advance::To(there) => here = *there,
                Advance::Last(there) => return *there,
                Advance::AtRest => return here,
                Advance::Nowhere if here.is_sloped => {
                    self.ended = SearchEnd::NoStep;
                    return here;
                }
                Advance::Nowhere => {
                    // Slopes carried from elsewhere lead nowhere; the search may go on with slopes computed here.
                    match self.point(here.coordinates.clone(), whitener) {
                        Ok(sloped) => here = sloped,
                        Err(_) => {
                            self.ended = SearchEnd::NoStep;
                            return here;
                        }
                    }
                }
            }
        }
        self.ended = SearchEnd::StepLimit;
        here
    }

    /// One step of a descent, damped until it leads down. `is_spent` says that the model promises nothing more.
    fn advance(
        &mut self,
        here: &Point,
        (matrix, right): (&DMatrix<f64>, &DVector<f64>),
        whitener: &Whitener,
        damping: &mut f64,
        is_spent: bool,
    ) -> Advance {
        for _ in 0..MOST_TRIALS {
            let Some(Step { to, .. }) = self.step(here, matrix, right, *damping) else {
                *damping *= 10.0;
                continue;
            };
            if to == here.coordinates {
                return Advance::AtRest;
            }
            let is_small = is_spent && Self::is_small(&here.coordinates, &to, matrix, STEP_TOLERANCE);
            if is_small && *damping <= FREE {
                return Advance::AtRest;
            }
            // No step to a point at which the machine cannot be solved.
            let Ok(mut there) = self.after(here, to, matrix, whitener) else {
                *damping = (*damping * 10.0).max(1e-2);
                continue;
            };
            // A damped step may gain little far from the end.
            let noise = if *damping <= FREE { self.least_gain(here.cost) } else { 0.0 };
            if there.cost <= here.cost {
                let gain = here.cost - there.cost;
                self.reached = Some((there.coordinates.clone(), there.cost));
                if gain <= noise.max(ROUNDING * here.cost.max(1e-12)) {
                    return Advance::Last(Box::new(there));
                }
                if !there.is_sloped && self.is_far(here, &there) {
                    there = self.point(there.coordinates.clone(), whitener).unwrap_or(there);
                }
                *damping = (*damping * 0.1).max(UNDAMPED);
                return Advance::To(Box::new(there));
            }
            if is_small || there.cost - here.cost <= noise {
                return Advance::AtRest;
            }
            if !here.is_sloped {
                break;
            }
            *damping = (*damping * 8.0).max(DAMPED);
        }
        Advance::Nowhere
    }

    /// Whether any coordinate moved so far that slopes change their size.
    fn is_far(&self, here: &Point, there: &Point) -> bool {
        let of = |(k, (h, t)): (usize, (&f64, &f64))| (t - h).abs() > FAR * self.free[k].size(self.free[k].value(*h));
        here.coordinates.iter().zip(&there.coordinates).enumerate().any(of)
    }
}

/// Outcome of one step of a descent.
enum Advance {
    To(Box<Point>),
    /// A point that is hardly lower than the last one.
    Last(Box<Point>),
    AtRest,
    Nowhere,
}
