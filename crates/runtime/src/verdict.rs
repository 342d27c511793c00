//! Limits and the verdict on a condition.

use crate::acceptability::{Acceptability, CONFIDENCE, Chance, LimitChance, LimitValue, Verdict, judged};
use crate::bytes::Numbers;
use crate::format::{MAX_POINTS, MEDIUM_RECORD};
use crate::limit::LimitKind;
use crate::model::Indices;
use crate::shape::{ShapeError, check};
use crate::surrogate::Surrogate;

impl Surrogate<'_> {
    /// The verdict at condition `x`, in the variables' units.
    ///
    /// Acceptable if every limit is kept at the upper end of its band; not acceptable if one is broken at the lower end
    /// of its band; uncertain otherwise, and always outside the fitted range, for values that are no numbers, for a
    /// wrong number of values, and without limits. If the file states the uncertainty of its answers, acceptable and
    /// not acceptable hold with a probability of 95 %; [`Surrogate::assess`] takes another probability.
    #[must_use]
    pub fn verdict(&self, x: &[f64]) -> Verdict {
        let mut buffer = [0.0; MAX_POINTS];
        let values = &mut buffer[..self.points.len().min(MAX_POINTS)];
        self.query(x, values).unwrap_or(Verdict {
            state: Acceptability::Uncertain,
            in_domain: false,
            binding: None,
            value: f64::NAN,
            margin: f64::NAN,
        })
    }

    /// Values of all points and the verdict at condition `x`, in one evaluation.
    ///
    /// # Errors
    /// `x` does not have one value per variable, or `values` does not have one place per point.
    pub fn query(&self, x: &[f64], values: &mut [f64]) -> Result<Verdict, ShapeError> {
        if self.uncertainty.is_some() {
            let chance = self.judge(x, None, CONFIDENCE, values, None)?;
            return Ok(self.binding_of(chance, x, values));
        }
        self.evaluate(x, values)?;
        Ok(self.verdict_by_bands(x, values))
    }

    /// The verdict that [`Surrogate::query`] gives beside the values, from the `values` of [`Surrogate::evaluate`] or
    /// [`Surrogate::evaluate_batch`] at condition `x`.
    ///
    /// # Errors
    /// `x` does not have one value per variable, or `values` does not have one per point.
    pub fn verdict_at(&self, x: &[f64], values: &[f64]) -> Result<Verdict, ShapeError> {
        if self.uncertainty.is_some() {
            return Ok(self.binding_of(self.chance_at(x, CONFIDENCE, values, None)?, x, values));
        }
        check("number of variables", self.variables.len(), x.len())?;
        check("number of points", self.points.len(), values.len())?;
        Ok(self.verdict_by_bands(x, values))
    }

    /// The verdict of a chance, with value and margin of the limit that decides.
    fn binding_of(&self, chance: Chance, x: &[f64], values: &[f64]) -> Verdict {
        let of = |list: &[f64], index: usize| list.get(index).copied().unwrap_or(f64::NAN);
        let limit = chance.binding.and_then(|index| Some((self.limits.get(index)?, self.maxima().at(index))));
        let (value, margin) = limit.map_or((f64::NAN, f64::NAN), |(record, maximum)| {
            let value = self.limit_kind(record).value(|point| of(values, point), |variable| of(x, variable));
            (value, maximum - value)
        });
        Verdict { state: chance.state, in_domain: chance.in_domain, binding: chance.binding, value, margin }
    }

    /// The verdict of a file that does not state the uncertainty of its answers.
    fn verdict_by_bands(&self, x: &[f64], values: &[f64]) -> Verdict {
        let in_domain = self.in_domain(x);
        let mut verdict = Verdict { state: Acceptability::Uncertain, in_domain, binding: None, value: f64::NAN, margin: f64::NAN };
        let widths = self.half_widths();
        let (mut worst, mut margin) = (Acceptability::Acceptable, f64::INFINITY);
        for (index, (record, maximum)) in self.limits.iter().zip(self.maxima().iter()).enumerate() {
            let (value, low, high) = self.limited(record, x, values, widths);
            let (state, own) = (judge(low, high, maximum), maximum - value);
            if (state > worst) | ((state == worst) & (own < margin)) {
                (worst, margin) = (state, own);
                (verdict.binding, verdict.value) = (Some(index), value);
            }
        }
        if verdict.binding.is_some() {
            verdict.margin = margin;
            if in_domain {
                verdict.state = worst;
            }
        }
        verdict
    }

    /// Limit `index` at condition `x`, given the points' values there; `None` if the limit does not exist. Its value is
    /// NaN if the slices are too short for it.
    ///
    /// If the file states the uncertainty of its answers, `values` must come from [`Surrogate::bands`] or
    /// [`Surrogate::query`], and the band holds the limited quantity with a probability of 95 %. Otherwise the band of
    /// a maximum or a rise is the point's band, and the band of a difference is the sum of both points' bands. The
    /// upper end of a spread is the largest difference of any two of its points with both bands against it; the lower
    /// end has both bands in its favour.
    #[must_use]
    pub fn limit_value(&self, index: usize, x: &[f64], values: &[f64]) -> Option<LimitValue> {
        if self.uncertainty.is_some() {
            let LimitChance { value, band, maximum, probability } = self.limit_chance(index, x, None, values)?;
            let half = band.half_width();
            let state = judged(probability, CONFIDENCE);
            return Some(LimitValue { value, low: value - half, high: value + half, maximum, margin: maximum - value, state });
        }
        let maximum = self.maxima().get(index)?;
        let (value, low, high) = self.limited(self.limits.get(index)?, x, values, self.half_widths());
        Some(LimitValue { value, low, high, maximum, margin: maximum - value, state: judge(low, high, maximum) })
    }

    /// The limited quantity and the ends of its band; NaN if `x` or `values` is too short.
    #[inline(always)]
    fn limited(&self, record: &[u8; MEDIUM_RECORD], x: &[f64], values: &[f64], widths: Numbers<'_>) -> (f64, f64, f64) {
        let of = |list: &[f64], index: usize| list.get(index).copied().unwrap_or(f64::NAN);
        let kind = self.limit_kind(record);
        let value = || kind.value(|point| of(values, point), |variable| of(x, variable));
        let (value, band) = match kind {
            LimitKind::Maximum { point } => (value(), widths.at(point)),
            LimitKind::Rise { point, .. } => (value(), widths.at(point)),
            LimitKind::Difference { first, second } => (value(), widths.at(first) + widths.at(second)),
            LimitKind::Spread(points) => return spread(points, values, widths),
        };
        (value, value - band, value + band)
    }
}

/// Value and band of a spread, in one pass over its points: the value of [`LimitKind::value`].
fn spread(points: Indices<'_>, values: &[f64], widths: Numbers<'_>) -> (f64, f64, f64) {
    let (mut largest, mut smallest) = (f64::NEG_INFINITY, f64::INFINITY);
    let (mut largest_low, mut smallest_low) = (f64::NEG_INFINITY, f64::INFINITY);
    let (mut largest_high, mut smallest_high) = (f64::NEG_INFINITY, f64::INFINITY);
    let (mut widest, mut sum) = (0.0, 0.0);
    for point in points.iter() {
        let (v, b) = (values.get(point).copied().unwrap_or(f64::NAN), widths.at(point));
        let (low, high) = (v - b, v + b);
        sum += v;
        (largest, smallest) = (greater(largest, v), lesser(smallest, v));
        (largest_low, smallest_low) = (greater(largest_low, low), lesser(smallest_low, low));
        (largest_high, smallest_high) = (greater(largest_high, high), lesser(smallest_high, high));
        widest = greater(widest, b);
    }
    if !sum.is_finite() {
        return (f64::NAN, f64::NAN, f64::NAN);
    }
    let mut high = largest_high - smallest_low;
    if 2.0 * widest >= high - 1e-9 * (largest_high.abs() + smallest_low.abs()) {
        // One band may reach from end to end (to rounding), but a spread is between two points.
        high = widest_pair(points, values, widths);
    }
    (largest - smallest, greater(largest_low - smallest_high, 0.0), high)
}

/// The largest upper end minus the smallest lower end of the bands of two different points.
fn widest_pair(points: Indices<'_>, values: &[f64], widths: Numbers<'_>) -> f64 {
    // The two best at either end are enough: one of the four pairs is of different points.
    let (mut top, mut bottom) = ([f64::NEG_INFINITY; 2], [f64::INFINITY; 2]);
    let (mut top_at, mut bottom_at) = (usize::MAX, usize::MAX);
    for point in points.iter() {
        let (v, b) = (values.get(point).copied().unwrap_or(f64::NAN), widths.at(point));
        let (low, high) = (v - b, v + b);
        if high > top[0] {
            (top, top_at) = ([high, top[0]], point);
        } else if high > top[1] {
            top[1] = high;
        }
        if low < bottom[0] {
            (bottom, bottom_at) = ([low, bottom[0]], point);
        } else if low < bottom[1] {
            bottom[1] = low;
        }
    }
    if top_at == bottom_at { greater(top[1] - bottom[0], top[0] - bottom[1]) } else { top[0] - bottom[0] }
}

fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Verdict of one limit. Comparisons with NaN are false and make it uncertain; a value that has overflown is never
/// acceptable.
#[inline(always)]
fn judge(low: f64, high: f64, maximum: f64) -> Acceptability {
    if high <= maximum && low > f64::NEG_INFINITY {
        Acceptability::Acceptable
    } else if low > maximum {
        Acceptability::NotAcceptable
    } else {
        Acceptability::Uncertain
    }
}
