//! Limits and the verdict on a condition.

use crate::evaluate::ShapeError;
use crate::format::MAX_POINTS;
use crate::surrogate::{LimitKind, Surrogate};

/// Whether a condition, or one limit at it, is acceptable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Every limit is kept even at the upper end of its band.
    Acceptable,
    /// Some limit is broken even at the lower end of its band.
    NotAcceptable,
    /// Too close to call, outside the fitted range, not a number, or no limit to judge by.
    Uncertain,
}

/// One limit at one condition, in the points' unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitValue {
    /// The limited quantity.
    pub value: f64,
    /// Lower end of its band.
    pub low: f64,
    /// Upper end of its band.
    pub high: f64,
    /// The largest value allowed.
    pub maximum: f64,
    /// `maximum - value`: positive where the limit is kept.
    pub margin: f64,
    /// What this limit alone says, inside the fitted range.
    pub state: State,
}

/// The verdict on a condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// The verdict.
    pub state: State,
    /// True if every variable lies within its fitted range.
    pub in_domain: bool,
    /// The limit that decides: among the limits in the worst state, the one with the smallest
    /// margin. `None` without limits, or where no limit has a finite value.
    pub binding: Option<usize>,
    /// Value of the binding limit; NaN without one.
    pub value: f64,
    /// Margin of the binding limit; NaN without one.
    pub margin: f64,
}

impl Surrogate<'_> {
    /// True if `x` has one value per variable and each lies within its fitted range, ends included.
    #[must_use]
    pub fn in_domain(&self, x: &[f64]) -> bool {
        x.len() == self.variables.len() && x.iter().enumerate().all(|(i, x)| self.low(i) <= *x && *x <= self.high(i))
    }

    /// The verdict at condition `x`, in the variables' units.
    ///
    /// Acceptable if every limit is kept at the upper end of its band; not acceptable if one is
    /// broken at the lower end of its band; uncertain otherwise, and always outside the fitted
    /// range, for values that are no numbers, for a wrong number of values, and without limits.
    #[must_use]
    pub fn verdict(&self, x: &[f64]) -> Verdict {
        let mut buffer = [0.0; MAX_POINTS];
        let values = &mut buffer[..self.points.len().min(MAX_POINTS)];
        self.query(x, values).unwrap_or(Verdict {
            state: State::Uncertain,
            in_domain: false,
            binding: None,
            value: f64::NAN,
            margin: f64::NAN,
        })
    }

    /// Values of all points and the verdict at condition `x`, in one evaluation.
    ///
    /// # Errors
    /// If `x` does not have one value per variable, or `values` one place per point.
    pub fn query(&self, x: &[f64], values: &mut [f64]) -> Result<Verdict, ShapeError> {
        self.evaluate(x, values)?;
        let in_domain = self.in_domain(x);
        let mut verdict = Verdict { state: State::Uncertain, in_domain, binding: None, value: f64::NAN, margin: f64::NAN };
        let mut worst = State::Acceptable;
        for index in 0..self.limits.len() {
            let Some(limit) = self.limit_value(index, x, values) else { continue };
            let worse = severity(limit.state) > severity(worst);
            if worse {
                worst = limit.state;
            }
            let same = limit.state == worst;
            let smaller = verdict.binding.is_none() || limit.margin < verdict.margin;
            if limit.margin.is_finite() && (worse || same && smaller) {
                (verdict.binding, verdict.value, verdict.margin) = (Some(index), limit.value, limit.margin);
            }
        }
        if in_domain && !self.limits.is_empty() {
            verdict.state = worst;
        }
        Ok(verdict)
    }

    /// Limit `index` at condition `x`, given the points' values there; `None` if there is no such
    /// limit or the slices are too short for it.
    ///
    /// The band of a maximum or a rise is the point's, that of a difference the sum of both points'.
    /// The upper end of a spread is the largest difference of any two of its points with both
    /// bands against it, and the lower end that with both bands in its favour.
    #[must_use]
    pub fn limit_value(&self, index: usize, x: &[f64], values: &[f64]) -> Option<LimitValue> {
        let limit = self.limit(index)?;
        let value_of = |point: usize| values.get(point).copied();
        let (value, low, high) = match limit.kind {
            LimitKind::Maximum { point } => around(value_of(point)?, self.half_width(point)),
            LimitKind::Rise { point, variable } => around(value_of(point)? - x.get(variable)?, self.half_width(point)),
            LimitKind::Difference { first, second } => {
                around(value_of(first)? - value_of(second)?, self.half_width(first) + self.half_width(second))
            }
            LimitKind::Spread(points) => {
                let (mut largest, mut smallest) = (f64::NEG_INFINITY, f64::INFINITY);
                let (mut largest_low, mut smallest_high) = (f64::NEG_INFINITY, f64::INFINITY);
                // The largest pair of different points needs the two best at either end.
                let (mut top, mut bottom) = ([f64::NEG_INFINITY; 2], [f64::INFINITY; 2]);
                let (mut top_at, mut bottom_at) = (usize::MAX, usize::MAX);
                let mut finite = true;
                for point in points.iter() {
                    let (v, b) = (value_of(point)?, self.half_width(point));
                    finite &= v.is_finite();
                    (largest, smallest) = (largest.max(v), smallest.min(v));
                    (largest_low, smallest_high) = (largest_low.max(v - b), smallest_high.min(v + b));
                    if v + b > top[0] {
                        (top, top_at) = ([v + b, top[0]], point);
                    } else if v + b > top[1] {
                        top[1] = v + b;
                    }
                    if v - b < bottom[0] {
                        (bottom, bottom_at) = ([v - b, bottom[0]], point);
                    } else if v - b < bottom[1] {
                        bottom[1] = v - b;
                    }
                }
                let high = if top_at == bottom_at { (top[1] - bottom[0]).max(top[0] - bottom[1]) } else { top[0] - bottom[0] };
                if finite { (largest - smallest, (largest_low - smallest_high).max(0.0), high) } else { (f64::NAN, f64::NAN, f64::NAN) }
            }
        };
        let state = if !(value.is_finite() && low.is_finite() && high.is_finite()) {
            State::Uncertain
        } else if high <= limit.maximum {
            State::Acceptable
        } else if low > limit.maximum {
            State::NotAcceptable
        } else {
            State::Uncertain
        };
        Some(LimitValue { value, low, high, maximum: limit.maximum, margin: limit.maximum - value, state })
    }
}

fn around(value: f64, band: f64) -> (f64, f64, f64) {
    (value, value - band, value + band)
}

fn severity(state: State) -> u8 {
    match state {
        State::Acceptable => 0,
        State::Uncertain => 1,
        State::NotAcceptable => 2,
    }
}
