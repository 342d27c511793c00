//! Dependence of a value, or of the difference of two, on the states at one condition.

use crate::belief::Known;
use crate::bytes::part;
use crate::evaluate::Monomials;
use crate::format::{MAX_PARAMETERS, MAX_POINTS};
use crate::limit::LimitKind;
use crate::math::sqrt;
use crate::model::Indices;
use crate::normal::NINETY_FIVE;
use crate::surrogate::Surrogate;
use crate::uncertain::Uncertainty;

/// Number of points whose slopes are kept for a whole verdict (count). Chosen: room on the stack against repeated sums.
const REMEMBERED: usize = 24;

/// Uncertainty of a value, as standard deviations in the point's unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Band {
    /// Standard deviation from the fit of the surrogate to the solver's results.
    pub fit: f64,
    /// Standard deviation from the mesh that the solver's results were found on; zero if the file does not state it.
    pub mesh: f64,
    /// Standard deviation from the parameters.
    pub parameters: f64,
    /// Standard deviation from the model error.
    pub misses: f64,
    /// Standard deviation from all of them. After learning, parameters and model error are anticorrelated, and this is
    /// less than the root of the sum of squares.
    pub total: f64,
}

impl Band {
    /// Half the width of the interval that holds the value with a probability of 95 %.
    #[must_use]
    pub fn half_width(self) -> f64 {
        NINETY_FIVE * self.total
    }
}

/// The points a limit compares: the first with a plus sign, the second with a minus sign.
pub(crate) fn compared(kind: LimitKind<Indices<'_>>, values: &[f64]) -> (usize, Option<usize>) {
    match kind {
        LimitKind::Maximum { point } | LimitKind::Rise { point, .. } => (point, None),
        LimitKind::Difference { first, second } => (first, Some(second)),
        LimitKind::Spread(points) => {
            let of = |p: usize| values.get(p).copied().unwrap_or(f64::NAN);
            let mut ends = (0, 0);
            for (place, p) in points.iter().enumerate() {
                if place == 0 {
                    ends = (p, p);
                }
                if of(p) > of(ends.0) {
                    ends.0 = p;
                }
                if of(p) < of(ends.1) {
                    ends.1 = p;
                }
            }
            (ends.0, Some(ends.1))
        }
    }
}

/// One condition, prepared for any number of directions there.
pub(crate) struct Here<'h> {
    surrogate: &'h Surrogate<'h>,
    uncertainty: &'h Uncertainty<'h>,
    monomials: Monomials,
    /// Relative variance that the distance from the measured conditions adds to the model error.
    growth: f64,
    /// Slopes of the first points, if they were asked for.
    slopes: [[f64; MAX_PARAMETERS]; REMEMBERED],
    remembered: usize,
}

impl Surrogate<'_> {
    pub(crate) fn here<'h>(&'h self, uncertainty: &'h Uncertainty<'h>, x: &[f64]) -> Here<'h> {
        let away = uncertainty.growth * uncertainty.distance(self, x);
        let monomials = self.monomials(&uncertainty.slope_terms, x);
        let slopes = [[0.0; MAX_PARAMETERS]; REMEMBERED];
        Here { surrogate: self, uncertainty, monomials, growth: away * away, slopes, remembered: 0 }
    }

    /// Variances of a point from its fit, and from the mesh.
    pub(crate) fn solved_variances(&self, point: usize) -> [f64; 2] {
        let [whole, mesh] = [self.half_width(point), self.mesh.at(point)].map(|half| half / NINETY_FIVE);
        [whole * whole - mesh * mesh, mesh * mesh]
    }

    /// The band of a quantity that depends on some points, of a file that does not state the uncertainty of its answers.
    pub(crate) fn solved_band(&self, points: impl Iterator<Item = usize>) -> Band {
        let [fit, mesh] = points.map(|point| self.solved_variances(point)).fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        Band { fit: root(fit), mesh: root(mesh), total: root(fit + mesh), ..Band::default() }
    }
}

impl Here<'_> {
    /// Computes the slopes of the first points once, for all later uses.
    pub(crate) fn remember(&mut self) {
        self.remembered = self.surrogate.point_count().min(REMEMBERED);
        for (point, slopes) in self.slopes.iter_mut().enumerate().take(self.remembered) {
            self.uncertainty.add_slopes(&self.monomials, point, 1.0, slopes);
        }
    }

    /// Adds the mean of the states to the values of all points.
    pub(crate) fn shift(&self, known: &Known<'_, '_, '_>, values: &mut [f64]) {
        if !known.is_prior() {
            values.iter_mut().enumerate().for_each(|(point, value)| *value += self.point(point).mean(known));
        }
    }

    /// Finds the bands of all points.
    pub(crate) fn fill(&self, known: &Known<'_, '_, '_>, bands: &mut [Band]) {
        bands.iter_mut().enumerate().for_each(|(point, band)| *band = self.point(point).band(known));
    }

    pub(crate) fn point(&self, point: usize) -> Direction {
        self.direction(point, None)
    }

    pub(crate) fn limit(&self, kind: LimitKind<Indices<'_>>, values: &[f64]) -> Direction {
        let (first, second) = compared(kind, values);
        self.direction(first, second)
    }

    fn direction(&self, first: usize, second: Option<usize>) -> Direction {
        let parameters = self.uncertainty.parameter_count();
        let states = parameters + self.surrogate.point_count().min(MAX_POINTS);
        let mut direction = Direction {
            parameters,
            slopes: [0.0; MAX_PARAMETERS],
            ends: [End { state: states, sign: 0.0, own: 0.0, solved: [0.0; 2] }; 2],
            common: 0.0,
            common_state: states,
            growth: self.growth,
        };
        // The difference of a point to itself depends on nothing.
        if second != Some(first) {
            for (end, (point, sign)) in direction.ends.iter_mut().zip([Some((first, 1.0)), second.map(|p| (p, -1.0))].into_iter().flatten())
            {
                let (own, common) = self.uncertainty.missed(point);
                *end = End { state: parameters + point, sign, own, solved: self.surrogate.solved_variances(point) };
                direction.common += sign * common;
                match self.slopes[..self.remembered].get(point) {
                    Some(own) => direction.slopes.iter_mut().zip(own).take(parameters).for_each(|(slope, own)| *slope += sign * own),
                    None => self.uncertainty.add_slopes(&self.monomials, point, sign, &mut direction.slopes),
                }
            }
        }
        direction
    }
}

impl Uncertainty<'_> {
    /// Distance of a condition from the mean of the measured conditions, in halves of the fitted ranges; zero if no
    /// measured condition is known.
    fn distance(&self, surrogate: &Surrogate<'_>, x: &[f64]) -> f64 {
        let rows = self.measured.len() / self.variables.max(1);
        if rows == 0 {
            return 0.0;
        }
        let mut square = 0.0;
        for (v, x) in x.iter().enumerate().take(self.variables) {
            let half = 0.5 * (surrogate.high(v) - surrogate.low(v));
            let mean = (0..rows).map(|row| self.measured.at(row * self.variables + v)).sum::<f64>() / rows as f64;
            let d = if half > 0.0 { (x - mean) / half } else { 0.0 };
            square += d * d;
        }
        sqrt(square)
    }

    /// Adds `weight` times the slopes of a point to `slopes`.
    fn add_slopes(&self, monomials: &Monomials, point: usize, weight: f64, slopes: &mut [f64; MAX_PARAMETERS]) {
        let parameters = self.records.len();
        let table = part(self.slopes.0, point * self.slope_terms.terms * parameters, self.slope_terms.terms * parameters);
        if parameters == 0 {
            return;
        }
        for (monomial, row) in monomials.values[..monomials.count].iter().zip(table.chunks_exact(parameters)) {
            let factor = weight * monomial;
            for (slope, entry) in slopes.iter_mut().zip(row) {
                *slope += factor * f64::from_le_bytes(*entry);
            }
        }
    }
}

/// One of the points that a quantity depends on.
#[derive(Clone, Copy)]
struct End {
    /// State of the point's own model error.
    state: usize,
    /// Sign of the point: 1, -1, or 0 if there is no point.
    sign: f64,
    /// Standard deviation of the point's own model error.
    own: f64,
    /// Variances of the point from its fit, and from the mesh.
    solved: [f64; 2],
}

/// Dependence of a quantity on the states, and its variance beside them.
pub(crate) struct Direction {
    parameters: usize,
    slopes: [f64; MAX_PARAMETERS],
    ends: [End; 2],
    /// Weight and state of the common model error of all points.
    common: f64,
    common_state: usize,
    /// Relative variance that the distance from the measured conditions adds to the model error.
    growth: f64,
}

impl Direction {
    pub(crate) fn slope(&self, parameter: usize) -> f64 {
        self.slopes.get(parameter).copied().unwrap_or(0.0)
    }

    /// States with their weights.
    fn weights(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let slopes = self.slopes.iter().take(self.parameters).copied().enumerate();
        slopes.chain(self.missing())
    }

    fn missing(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let owns = self.ends.iter().map(|end| (end.state, end.sign * end.own));
        owns.chain([(self.common_state, self.common)]).filter(|(_, weight)| *weight != 0.0)
    }

    /// Variances of the fit, of the mesh, and of the additional model error away from the measured conditions.
    pub(crate) fn beside(&self) -> [f64; 3] {
        let of = |value: fn(&End) -> f64| self.ends.iter().filter(|end| end.sign != 0.0).map(value).sum::<f64>();
        [of(|end| end.solved[0]), of(|end| end.solved[1]), self.growth * (of(|end| end.own * end.own) + self.common * self.common)]
    }

    /// Contribution of the mean of the states to the quantity.
    pub(crate) fn mean(&self, known: &Known<'_, '_, '_>) -> f64 {
        if known.is_prior() { 0.0 } else { self.weights().map(|(i, w)| w * known.mean(i)).sum() }
    }

    /// Covariance of the quantity with a state.
    pub(crate) fn towards(&self, known: &Known<'_, '_, '_>, state: usize) -> f64 {
        self.weights().map(|(i, w)| w * known.covariance(i, state)).sum()
    }

    /// Variance of the quantity from the states, given its covariance with each.
    pub(crate) fn variance_of(&self, towards: impl Fn(usize) -> f64) -> f64 {
        self.weights().map(|(i, w)| w * towards(i)).sum()
    }

    pub(crate) fn band(&self, known: &Known<'_, '_, '_>) -> Band {
        let (parameters, misses, states);
        if known.is_prior() {
            parameters = self.slopes.iter().take(self.parameters).map(|s| s * s).sum();
            misses = self.missing().map(|(_, w)| w * w).sum::<f64>();
            states = parameters + misses;
        } else {
            let square = |of: &dyn Fn(usize) -> bool| -> f64 {
                self.weights()
                    .filter(|(i, _)| of(*i))
                    .map(|(i, a)| a * self.weights().filter(|(j, _)| of(*j)).map(|(j, b)| b * known.covariance(i, j)).sum::<f64>())
                    .sum()
            };
            parameters = square(&|i| i < self.parameters);
            misses = square(&|i| i >= self.parameters);
            states = square(&|_| true);
        }
        let [fit, mesh, growth] = self.beside();
        let total = root(states + fit + mesh + growth);
        Band { fit: root(fit), mesh: root(mesh), parameters: root(parameters), misses: root(misses + growth), total }
    }

    /// Covariance with another quantity at the same condition.
    pub(crate) fn covariance(&self, other: &Self, known: &Known<'_, '_, '_>) -> f64 {
        let by_states: f64 = if known.is_prior() {
            let slopes: f64 = self.slopes.iter().zip(&other.slopes).take(self.parameters).map(|(a, b)| a * b).sum();
            let missing = self.missing().map(|(i, a)| a * other.missing().filter(|(j, _)| *j == i).map(|(_, b)| b).sum::<f64>());
            slopes + missing.sum::<f64>()
        } else {
            self.weights().map(|(i, a)| a * other.towards(known, i)).sum()
        };
        let mut beside = self.growth * self.common * other.common;
        for end in &self.ends {
            for its in other.ends.iter().filter(|its| its.state == end.state) {
                beside += end.sign * its.sign * (end.solved[0] + end.solved[1] + self.growth * end.own * end.own);
            }
        }
        by_states + beside
    }
}

/// Square root of a variance that rounding may have made negative.
fn root(variance: f64) -> f64 {
    if variance <= 0.0 { 0.0 } else { sqrt(variance) }
}
