//! Bands with everything that is uncertain in them, and verdicts with a probability.

use crate::belief::{Belief, Known};
use crate::evaluate::ShapeError;
use crate::format::{MAX_PARAMETERS, MAX_POINTS};
use crate::limit::LimitKind;
use crate::math::sqrt;
use crate::normal::{NINETY_FIVE, density, probability_below};
use crate::surrogate::{Indices, Surrogate};
use crate::uncertain::{Monomials, Uncertainty};
use crate::verdict::{Acceptability, judged};

/// Limits whose dependence on each other is followed; of more, those that are most likely broken.
const MOST_LIMITS: usize = 8;
/// Points whose slopes are found once for a whole verdict.
const REMEMBERED: usize = 24;
/// Probability below which a limit that may be broken needs no company.
const NEGLIGIBLE: f64 = 1e-12;
/// Correlation from which on two limits are of one quantity.
const SAME: f64 = 1.0 - 1e-9;

/// How uncertain a value is, as standard deviations in the point's unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Band {
    /// Of the function that was fitted to the solver's results.
    pub fit: f64,
    /// Of the parameters.
    pub parameters: f64,
    /// Of what the model misses.
    pub misses: f64,
    /// Of all of it. After learning, parameters and misses make up for each other, and this is less than the root of the
    /// sum of squares.
    pub total: f64,
}

impl Band {
    /// Half the width of the interval that holds the value with a probability of 95 %.
    #[must_use]
    pub fn half_width(self) -> f64 {
        NINETY_FIVE * self.total
    }
}

/// One limit at one condition, with everything that is uncertain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitChance {
    /// The limited quantity, in the points' unit.
    pub value: f64,
    /// Its band.
    pub band: Band,
    /// The largest value allowed.
    pub maximum: f64,
    /// Probability that it is kept.
    pub probability: f64,
}

/// The verdict on a condition at a stated confidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chance {
    /// Acceptable if all limits together are kept with at least the probability asked for, not acceptable if with at most one
    /// minus that, uncertain between; always uncertain outside the fitted range, without limits, and where a value is no
    /// number.
    pub state: Acceptability,
    /// True if every variable lies within its fitted range.
    pub in_domain: bool,
    /// Probability that all limits are kept; NaN without one.
    pub probability: f64,
    /// The limit that is most likely broken.
    pub binding: Option<usize>,
}

impl Surrogate<'_> {
    /// Values and bands of all points at condition `x`, by what the file knows of its parameters or by a belief of the caller's.
    /// A file without uncertainty has the band of its fit alone.
    ///
    /// # Errors
    /// If a slice has another length than it should.
    pub fn bands(&self, x: &[f64], belief: Option<&Belief<'_>>, values: &mut [f64], bands: &mut [Band]) -> Result<(), ShapeError> {
        self.evaluate_fit(x, values)?;
        if bands.len() != self.points.len() {
            return Err(ShapeError { argument: "number of bands", expected: self.points.len(), found: bands.len() });
        }
        let Some(uncertainty) = self.uncertainty else {
            for (point, band) in bands.iter_mut().enumerate() {
                let fit = self.half_width(point) / NINETY_FIVE;
                *band = Band { fit, total: fit, ..Band::default() };
            }
            return Ok(());
        };
        let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
        self.here(&uncertainty, x).fill(&known, values, bands);
        Ok(())
    }

    /// One limit at condition `x`, given the points' values there as [`Surrogate::bands`] finds them. Of a spread, the hottest
    /// and the coldest point there are compared. `None` if there is no such limit.
    #[must_use]
    pub fn limit_chance(&self, index: usize, x: &[f64], belief: Option<&Belief<'_>>, values: &[f64]) -> Option<LimitChance> {
        let maximum = self.maxima().get(index)?;
        let kind = self.limit_kind(self.limits.get(index)?);
        let of = |list: &[f64], index: usize| list.get(index).copied().unwrap_or(f64::NAN);
        let value = kind.value(|point| of(values, point), |variable| of(x, variable));
        let band = match self.uncertainty {
            Some(uncertainty) => {
                let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
                self.here(&uncertainty, x).limit(kind, values).band(&known)
            }
            None => {
                let (first, second) = compared(kind, values);
                let fit = sqrt(self.fit_variance(first) + second.map_or(0.0, |second| self.fit_variance(second)));
                Band { fit, total: fit, ..Band::default() }
            }
        };
        Some(LimitChance { value, band, maximum, probability: kept(maximum - value, band.total) })
    }

    /// Values, bands and the verdict at condition `x`: whether all limits together are kept with probability `confidence`, which
    /// lies between one half and one.
    ///
    /// # Errors
    /// If a slice has another length than it should.
    pub fn assess(
        &self,
        x: &[f64],
        belief: Option<&Belief<'_>>,
        confidence: f64,
        values: &mut [f64],
        bands: &mut [Band],
    ) -> Result<Chance, ShapeError> {
        if bands.len() != self.points.len() {
            return Err(ShapeError { argument: "number of bands", expected: self.points.len(), found: bands.len() });
        }
        self.judge(x, belief, confidence, values, Some(bands))
    }

    /// The verdict, with the bands where they are asked for.
    pub(crate) fn judge(
        &self,
        x: &[f64],
        belief: Option<&Belief<'_>>,
        confidence: f64,
        values: &mut [f64],
        bands: Option<&mut [Band]>,
    ) -> Result<Chance, ShapeError> {
        let Some(uncertainty) = &self.uncertainty else {
            match bands {
                Some(bands) => self.bands(x, belief, values, bands)?,
                None => self.evaluate_fit(x, values)?,
            }
            let independent = |limit: usize| self.limit_chance(limit, x, None, values);
            return Ok(self.judge_together(x, confidence, independent, |_, _| 0.0));
        };
        self.evaluate_fit(x, values)?;
        let known = belief.map_or(Known::File(uncertainty), Known::Memory);
        let mut here = self.here(uncertainty, x);
        here.remember();
        match bands {
            Some(bands) => here.fill(&known, values, bands),
            None => here.shift(&known, values),
        }
        let direction = |limit: usize| self.limits.get(limit).map(|record| here.limit(self.limit_kind(record), values));
        let chance = |limit: usize| {
            let (kind, maximum) = (self.limit_kind(self.limits.get(limit)?), self.maxima().at(limit));
            let of = |list: &[f64], index: usize| list.get(index).copied().unwrap_or(f64::NAN);
            let value = kind.value(|point| of(values, point), |variable| of(x, variable));
            let band = here.limit(kind, values).band(&known);
            Some(LimitChance { value, band, maximum, probability: kept(maximum - value, band.total) })
        };
        let shared = |a: usize, b: usize| match (direction(a), direction(b)) {
            (Some(a), Some(b)) => a.covariance(&b, &known),
            _ => 0.0,
        };
        Ok(self.judge_together(x, confidence, chance, shared))
    }

    /// The verdict on all limits together, from each of them and from the covariance of two.
    fn judge_together(
        &self,
        x: &[f64],
        confidence: f64,
        chance_of: impl Fn(usize) -> Option<LimitChance>,
        shared: impl Fn(usize, usize) -> f64,
    ) -> Chance {
        let in_domain = self.in_domain(x);
        let mut chance = Chance { state: Acceptability::Uncertain, in_domain, probability: f64::NAN, binding: None };
        // The limits most likely broken, the most likely first; what the others may add counts in full.
        let mut worst = [Critical::NONE; MOST_LIMITS];
        let (mut count, mut broken_elsewhere) = (0, 0.0);
        for index in 0..self.limits.len() {
            let Some(limit) = chance_of(index) else { continue };
            if limit.probability.is_nan() {
                return Chance { binding: Some(index), ..chance };
            }
            let slack = (limit.maximum - limit.value) / limit.band.total.max(f64::MIN_POSITIVE);
            let mut own = Critical { index, slack, broken: 1.0 - limit.probability, variance: limit.band.total * limit.band.total };
            for place in &mut worst {
                if own.index != usize::MAX && (place.index == usize::MAX || own.slack < place.slack) {
                    core::mem::swap(place, &mut own);
                }
            }
            if own.index == usize::MAX { count += 1 } else { broken_elsewhere += own.broken }
        }
        if count == 0 {
            return chance;
        }
        // What is as good as never broken depends on nothing.
        let doubtful = worst[..count].iter().skip(1).take_while(|own| own.broken > NEGLIGIBLE).count() + 1;
        let worst = &worst[..doubtful.min(count)];
        let mut correlation = [[0.0; MOST_LIMITS]; MOST_LIMITS];
        for (i, a) in worst.iter().enumerate() {
            correlation[i][i] = 1.0;
            for (j, b) in worst[..i].iter().enumerate() {
                let scale = sqrt(a.variance * b.variance);
                let r = if scale > 0.0 { (shared(a.index, b.index) / scale).clamp(-1.0, 1.0) } else { 0.0 };
                (correlation[i][j], correlation[j][i]) = (r, r);
            }
        }
        let together = all_kept(worst, correlation) - broken_elsewhere;
        chance.probability = if together > 0.0 { together } else { 0.0 };
        chance.binding = Some(worst[0].index);
        if in_domain && chance.probability.is_finite() {
            chance.state = judged(chance.probability, confidence);
        }
        chance
    }

    /// Share of each parameter in the variance that the parameters give limit `index` at condition `x`, into `shares`, one place
    /// per parameter. They add up to one; where parameters are correlated, one of them can be negative.
    ///
    /// # Errors
    /// If `shares` has another length, or there is no such limit.
    pub fn shares(
        &self,
        index: usize,
        x: &[f64],
        belief: Option<&Belief<'_>>,
        values: &[f64],
        shares: &mut [f64],
    ) -> Result<(), ShapeError> {
        let parameters = self.uncertainty.map_or(0, |u| u.parameter_count());
        let wrong = |argument, expected, found| Err(ShapeError { argument, expected, found });
        if shares.len() != parameters {
            return wrong("places for shares", parameters, shares.len());
        }
        let Some(record) = self.limits.get(index) else { return wrong("index of the limit", self.limits.len(), index) };
        let Some(uncertainty) = self.uncertainty else { return Ok(()) };
        let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
        let direction = self.here(&uncertainty, x).limit(self.limit_kind(record), values);
        let of = |k: usize| {
            let along: f64 = (0..parameters).map(|j| direction.slope(j) * known.covariance(k, j)).sum();
            direction.slope(k) * along
        };
        let total: f64 = (0..parameters).map(of).sum();
        for (k, share) in shares.iter_mut().enumerate() {
            *share = if total > 0.0 { of(k) / total } else { 0.0 };
        }
        Ok(())
    }

    /// The share of the variance of limit `index` at condition `x` that one reading of a point there would take away, if its
    /// instrument has the standard deviation `deviation`; `None` if there is no such limit or point.
    #[must_use]
    pub fn worth(&self, index: usize, x: &[f64], belief: Option<&Belief<'_>>, values: &[f64], point: usize, deviation: f64) -> Option<f64> {
        let uncertainty = self.uncertainty?;
        let record = self.limits.get(index)?;
        self.check_point(x, point).ok()?;
        let known = belief.map_or(Known::File(&uncertainty), Known::Memory);
        let here = self.here(&uncertainty, x);
        let (limit, reading) = (here.limit(self.limit_kind(record), values), here.point(point));
        let shared = limit.covariance(&reading, &known);
        let read = reading.band(&known).total;
        let own = limit.band(&known).total;
        let variance = (read * read + deviation * deviation) * own * own;
        Some(if variance > 0.0 { shared * shared / variance } else { 0.0 })
    }

    /// What the answers of this file leave open, where it says so.
    #[must_use]
    pub fn uncertainty(&self) -> Option<Uncertainty<'_>> {
        self.uncertainty
    }

    fn fit_variance(&self, point: usize) -> f64 {
        let fit = self.half_width(point) / NINETY_FIVE;
        fit * fit
    }

    pub(crate) fn here<'h>(&'h self, uncertainty: &'h Uncertainty<'h>, x: &[f64]) -> Here<'h> {
        let away = uncertainty.growth * uncertainty.distance(self, x);
        let monomials = uncertainty.monomials(self, x);
        Here { surrogate: self, uncertainty, monomials, growth: away * away, slopes: [[0.0; MAX_PARAMETERS]; REMEMBERED], remembered: 0 }
    }
}

/// Probability that a margin is kept by a value of this standard deviation.
fn kept(margin: f64, deviation: f64) -> f64 {
    if deviation > 0.0 {
        return probability_below(margin / deviation);
    }
    if margin.is_nan() {
        return f64::NAN;
    }
    f64::from(u8::from(margin >= 0.0))
}

/// The points a limit compares: the first with a plus sign, the second with a minus sign.
fn compared(kind: LimitKind<Indices<'_>>, values: &[f64]) -> (usize, Option<usize>) {
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

/// One condition, ready for any number of directions there.
pub(crate) struct Here<'h> {
    surrogate: &'h Surrogate<'h>,
    uncertainty: &'h Uncertainty<'h>,
    monomials: Monomials,
    /// Variance that the distance from the measured conditions adds, as a share of what the model misses.
    growth: f64,
    /// Slopes of the first points, where they were asked for.
    slopes: [[f64; MAX_PARAMETERS]; REMEMBERED],
    remembered: usize,
}

impl Here<'_> {
    /// Finds the slopes of the first points once, for all that looks at them.
    fn remember(&mut self) {
        self.remembered = self.surrogate.point_count().min(REMEMBERED);
        for (point, slopes) in self.slopes.iter_mut().enumerate().take(self.remembered) {
            self.uncertainty.add_slopes(&self.monomials, point, 1.0, slopes);
        }
    }

    /// Adds what is known of the states to the values of all points.
    fn shift(&self, known: &Known<'_, '_, '_>, values: &mut [f64]) {
        if !known.is_prior() {
            values.iter_mut().enumerate().for_each(|(point, value)| *value += self.point(point).mean(known));
        }
    }

    /// The same, and finds their bands.
    fn fill(&self, known: &Known<'_, '_, '_>, values: &mut [f64], bands: &mut [Band]) {
        for (point, (value, band)) in values.iter_mut().zip(bands).enumerate() {
            let direction = self.point(point);
            *value += direction.mean(known);
            *band = direction.band(known);
        }
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
            ends: [End { state: states, sign: 0.0, own: 0.0, fit: 0.0 }; 2],
            common: 0.0,
            common_state: states,
            growth: self.growth,
        };
        // A point against itself depends on nothing.
        if second != Some(first) {
            for (end, (point, sign)) in direction.ends.iter_mut().zip([Some((first, 1.0)), second.map(|p| (p, -1.0))].into_iter().flatten())
            {
                let (own, common) = self.uncertainty.missed(point);
                *end = End { state: parameters + point, sign, own, fit: self.surrogate.fit_variance(point) };
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

/// One of the points that a quantity looks at.
#[derive(Clone, Copy)]
struct End {
    /// State of what the model misses there alone.
    state: usize,
    /// One, minus one, or zero where there is no such point.
    sign: f64,
    /// Standard deviation of what the model misses there alone.
    own: f64,
    /// Variance of its fit.
    fit: f64,
}

/// How a quantity depends on the states, and its variance beside them.
pub(crate) struct Direction {
    parameters: usize,
    slopes: [f64; MAX_PARAMETERS],
    ends: [End; 2],
    /// Weight and state of what all points miss together.
    common: f64,
    common_state: usize,
    /// Variance that the distance from the measured conditions adds, as a share of what the model misses.
    growth: f64,
}

impl Direction {
    fn slope(&self, parameter: usize) -> f64 {
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

    /// Variances of the fit, and of what is new away from the measured conditions.
    pub(crate) fn beside(&self) -> (f64, f64) {
        let of = |value: fn(&End) -> f64| self.ends.iter().filter(|end| end.sign != 0.0).map(value).sum::<f64>();
        (of(|end| end.fit), self.growth * (of(|end| end.own * end.own) + self.common * self.common))
    }

    /// What the mean of the states adds.
    pub(crate) fn mean(&self, known: &Known<'_, '_, '_>) -> f64 {
        if known.is_prior() { 0.0 } else { self.weights().map(|(i, w)| w * known.mean(i)).sum() }
    }

    /// Covariance of it with a state.
    pub(crate) fn towards(&self, known: &Known<'_, '_, '_>, state: usize) -> f64 {
        self.weights().map(|(i, w)| w * known.covariance(i, state)).sum()
    }

    /// Its variance by the states, from its covariance with each.
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
        let (fit, growth) = self.beside();
        Band { fit: root(fit), parameters: root(parameters), misses: root(misses + growth), total: root(states + fit + growth) }
    }

    /// Covariance with another quantity at the same condition.
    fn covariance(&self, other: &Self, known: &Known<'_, '_, '_>) -> f64 {
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
                beside += end.sign * its.sign * (end.fit + self.growth * end.own * end.own);
            }
        }
        by_states + beside
    }
}

/// Square root of a variance that rounding may have made negative.
fn root(variance: f64) -> f64 {
    if variance > 0.0 { sqrt(variance) } else { 0.0 }
}

/// A limit that may be broken.
#[derive(Clone, Copy)]
struct Critical {
    index: usize,
    /// Margin over its standard deviation.
    slack: f64,
    broken: f64,
    variance: f64,
}

impl Critical {
    const NONE: Self = Self { index: usize::MAX, slack: f64::INFINITY, broken: 0.0, variance: 0.0 };
}

/// Probability that all of some limits are kept: one after the other, each given those before, as if what is left stayed normal
/// (Mendell and Elston 1974), and never outside what their own probabilities allow.
fn all_kept(limits: &[Critical], mut correlation: [[f64; MOST_LIMITS]; MOST_LIMITS]) -> f64 {
    let mut slack = [0.0; MOST_LIMITS];
    slack.iter_mut().zip(limits).for_each(|(slack, limit)| *slack = limit.slack);
    let (mut together, mut least, mut broken) = (1.0, 1.0, 0.0);
    for (i, limit) in limits.iter().enumerate() {
        least = f64::min(least, 1.0 - limit.broken);
        broken += limit.broken;
        if slack[i] == f64::INFINITY {
            continue;
        }
        let own = probability_below(slack[i]);
        together *= own;
        if own < 1e-300 {
            return 0.0;
        }
        // Mean and loss of variance of a normal variable that is cut off above its slack.
        let a = density(slack[i]) / own;
        let loss = a * (a + slack[i]);
        for j in i + 1..limits.len() {
            let r = correlation[i][j];
            if r > SAME {
                // The same quantity with more room: kept where this one is.
                slack[j] = f64::INFINITY;
                continue;
            }
            let left = 1.0 - r * r * loss;
            slack[j] = if left > 1e-12 { (slack[j] + r * a) / sqrt(left) } else { slack[j] + r * a };
        }
        let row = correlation[i];
        for j in i + 1..limits.len() {
            for k in i + 1..limits.len() {
                if j != k {
                    let (left_j, left_k) = (1.0 - row[j] * row[j] * loss, 1.0 - row[k] * row[k] * loss);
                    let scale = sqrt(left_j.max(1e-12) * left_k.max(1e-12));
                    correlation[j][k] = ((correlation[j][k] - row[j] * row[k] * loss) / scale).clamp(-1.0, 1.0);
                }
            }
        }
    }
    together.clamp(if broken < 1.0 { 1.0 - broken } else { 0.0 }, least)
}
