//! Enclosures of formulas over a stretch of time, by interval arithmetic (Moore, Kearfott and Cloud, Introduction to Interval
//! Analysis, SIAM 2009): bounds on the value and on the derivative that no pulse between two looks can escape.
//!
//! Bounds are not rounded outward: they are exact but for rounding.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::program::{Function, Op};
use super::table::Table;

/// A closed interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// All numbers: nothing is known.
    pub const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
    /// Zero alone.
    pub const ZERO: Self = Self { low: 0.0, high: 0.0 };

    /// One number.
    pub fn point(value: f64) -> Self {
        Self::hull([value, value])
    }

    /// The smallest interval around some numbers; all numbers if one of these is not a number.
    pub fn hull<const N: usize>(values: [f64; N]) -> Self {
        if values.iter().any(|v| v.is_nan()) {
            return Self::ALL;
        }
        let [low, high] = [f64::min, f64::max].map(|choose| values.into_iter().reduce(choose).unwrap_or(0.0));
        Self { low, high }
    }

    /// Difference of the two ends.
    pub fn width(&self) -> f64 {
        self.high - self.low
    }

    fn is_point(&self) -> bool {
        self.low == self.high
    }

    fn has(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    fn joined(self, other: Self) -> Self {
        Self::hull([self.low, self.high, other.low, other.high])
    }

    /// Sum of two intervals.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self::hull([self.low + other.low, self.high + other.high])
    }

    fn negated(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }

    /// Product of two intervals.
    #[must_use]
    pub fn times(self, other: Self) -> Self {
        // Zero alone makes zero of any number, however large.
        if self == Self::ZERO || other == Self::ZERO {
            return Self::ZERO;
        }
        Self::hull([self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high])
    }

    fn over(self, other: Self) -> Self {
        if other.has(0.0) { Self::ALL } else { self.times(Self::hull([1.0 / other.low, 1.0 / other.high])) }
    }

    /// The interval of a function that is monotone on it.
    fn through(self, function: impl Fn(f64) -> f64) -> Self {
        Self::hull([function(self.low), function(self.high)])
    }

    /// The interval to a power that is one number.
    fn to(self, power: f64) -> Self {
        let ends = self.through(|x| x.powf(power));
        match (self.low < 0.0, power.fract() == 0.0) {
            (true, false) => Self::ALL,
            _ if power < 0.0 && self.has(0.0) => Self::ALL,
            _ if self.has(0.0) => ends.joined(Self::ZERO),
            _ => ends,
        }
    }

    fn sine(self) -> Self {
        if self.width().is_nan() || self.width() >= TAU {
            return Self { low: -1.0, high: 1.0 };
        }
        let reaches = |crest: f64| crest + TAU * ((self.low - crest) / TAU).ceil() <= self.high;
        let Self { low, high } = self.through(f64::sin);
        Self { low: if reaches(-FRAC_PI_2) { -1.0 } else { low }, high: if reaches(FRAC_PI_2) { 1.0 } else { high } }
    }

    fn shifted(self, by: f64) -> Self {
        Self { low: self.low + by, high: self.high + by }
    }
}

/// Bounds on a number over a stretch of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosure {
    /// Bounds on the value.
    pub value: Interval,
    /// Bounds on the derivative with respect to time, per second.
    pub slope: Interval,
    /// Whether no kink of `min`, `max` or `abs` can lie in the stretch.
    pub is_smooth: bool,
}

impl Enclosure {
    /// A number that holds.
    pub fn constant(value: f64) -> Self {
        Self { value: Interval::point(value), slope: Interval::ZERO, is_smooth: true }
    }

    /// A number that runs straight from one value to another in a time, s.
    pub fn straight(first: f64, last: f64, duration: f64) -> Self {
        if first == last {
            return Self::constant(first);
        }
        Self { value: Interval::hull([first, last]), slope: Interval::point((last - first) / duration), is_smooth: true }
    }

    /// This number times a factor, plus another number.
    #[must_use]
    pub fn scaled(self, factor: f64, offset: f64) -> Self {
        let factor = Interval::point(factor);
        Self { value: factor.times(self.value).shifted(offset), slope: factor.times(self.slope), ..self }
    }

    /// Bound on the distance from the straight line between the ends of a stretch of a duration, s: each half of it turns away by
    /// at most half the spread of slopes.
    pub fn bend(&self, duration: f64) -> f64 {
        // Slopes without bounds say less than the values do.
        (0.25 * self.slope.width() * duration).min(self.value.width())
    }

    fn negated(self) -> Self {
        Self { value: self.value.negated(), slope: self.slope.negated(), ..self }
    }

    /// The larger of two numbers.
    fn larger(self, other: Self) -> Self {
        if self.value.low >= other.value.high {
            return Self { is_smooth: self.is_smooth && other.is_smooth, ..self };
        }
        if other.value.low >= self.value.high {
            return Self { is_smooth: self.is_smooth && other.is_smooth, ..other };
        }
        let value = Interval { low: self.value.low.max(other.value.low), high: self.value.high.max(other.value.high) };
        Self { value, slope: self.slope.joined(other.slope), is_smooth: false }
    }

    fn called(self, function: Function) -> Self {
        let x = self.value;
        let (value, derivative) = match function {
            Function::Sqrt if x.low < 0.0 => (Interval::ALL, Interval::ALL),
            Function::Ln | Function::Log10 if x.low <= 0.0 => (Interval::ALL, Interval::ALL),
            Function::Sqrt | Function::Exp | Function::Ln | Function::Log10 => {
                (x.through(|x| function.at(x).0), x.through(|x| function.at(x).1))
            }
            Function::Abs => return self.larger(self.negated()),
            Function::Sin => (x.sine(), x.shifted(FRAC_PI_2).sine()),
            Function::Cos => (x.shifted(FRAC_PI_2).sine(), x.shifted(PI).sine()),
            Function::Tan => {
                let cosine = x.shifted(FRAC_PI_2).sine();
                if cosine.has(0.0) {
                    (Interval::ALL, Interval::ALL)
                } else {
                    (x.through(f64::tan), Interval::point(1.0).over(cosine.to(2.0)))
                }
            }
            Function::Tanh => {
                let slopes = x.through(|x| function.at(x).1);
                (x.through(f64::tanh), if x.has(0.0) { slopes.joined(Interval::point(1.0)) } else { slopes })
            }
        };
        Self { value, slope: derivative.times(self.slope), ..self }
    }

    fn through_table(self, table: &Table) -> Self {
        let (x, points) = (self.value, table.points());
        let inside = || points.iter().filter(|(at, _)| x.low < *at && *at < x.high);
        let value = inside().fold(x.through(|x| table.at(x).0), |all, (_, y)| all.joined(Interval::point(*y)));
        let pieces = points.windows(2).filter(|pair| pair[0].0 <= x.high && x.low < pair[1].0);
        let slopes = pieces.map(|pair| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0));
        let beyond = points.first().zip(points.last()).is_none_or(|(first, last)| x.low < first.0 || x.high >= last.0);
        let slopes = slopes.chain(beyond.then_some(0.0)).map(Interval::point).reduce(Interval::joined);
        let slope = slopes.unwrap_or(Interval::ALL).times(self.slope);
        Self { value, slope, is_smooth: self.is_smooth && inside().next().is_none() }
    }

    fn raised(self, power: Self) -> Self {
        let is_smooth = self.is_smooth && power.is_smooth;
        if power.value.is_point() && power.slope == Interval::ZERO {
            let n = power.value.low;
            let slope = if self.slope == Interval::ZERO || n == 0.0 {
                Interval::ZERO
            } else {
                Interval::point(n).times(self.value.to(n - 1.0)).times(self.slope)
            };
            return Self { value: self.value.to(n), slope, is_smooth };
        }
        // a^b = exp(b ln a)
        let log = self.called(Function::Ln);
        Self { is_smooth, ..power.product(log) }.called(Function::Exp)
    }

    fn product(self, other: Self) -> Self {
        let slope = self.slope.times(other.value).plus(self.value.times(other.slope));
        Self { value: self.value.times(other.value), slope, is_smooth: self.is_smooth && other.is_smooth }
    }
}

/// Enclosure of a program's value, where the slots have theirs.
pub(super) fn run(program: &[Op], slots: &[Enclosure]) -> Enclosure {
    let unknown = Enclosure { value: Interval::ALL, slope: Interval::ALL, is_smooth: true };
    let mut stack: Vec<Enclosure> = Vec::with_capacity(16);
    for op in program {
        let mut pop = || stack.pop().unwrap_or(unknown);
        let out = match op {
            Op::Number(number) => Enclosure::constant(*number),
            Op::Slot(at) => slots.get(*at).copied().unwrap_or(unknown),
            Op::Negate => pop().negated(),
            Op::Call(function) => pop().called(*function),
            Op::Table(table) => pop().through_table(table),
            Op::Add | Op::Subtract => {
                let b = pop();
                let (a, b) = (pop(), if *op == Op::Subtract { b.negated() } else { b });
                Enclosure { value: a.value.plus(b.value), slope: a.slope.plus(b.slope), is_smooth: a.is_smooth && b.is_smooth }
            }
            Op::Multiply => {
                let b = pop();
                pop().product(b)
            }
            Op::Divide => {
                let b = pop();
                // 1/b first: its slope is -b'/b².
                let one = Interval::point(1.0).over(b.value);
                let slope = b.slope.negated().times(one).times(one);
                pop().product(Enclosure { value: one, slope, is_smooth: b.is_smooth })
            }
            Op::Maximum => {
                let b = pop();
                pop().larger(b)
            }
            Op::Minimum => {
                let b = pop();
                pop().negated().larger(b.negated()).negated()
            }
            Op::Power => {
                let b = pop();
                pop().raised(b)
            }
        };
        stack.push(out);
    }
    stack.pop().unwrap_or(unknown)
}

#[cfg(test)]
mod tests {
    use super::super::program::compile;
    use super::*;

    fn enclosed(text: &str, from: f64, until: f64) -> Enclosure {
        let program = compile(text, &["t"], &|name| (name == "t").then_some(0)).unwrap();
        run(&program, &[Enclosure::straight(from, until, until - from)])
    }

    /// Values and differences at many places of a stretch lie within the bounds, for every operation.
    #[test]
    fn bounds_hold_everywhere() {
        let texts = [
            "3 - t",
            "t * (2 - t)",
            "1 / (1 + t^2)",
            "t^3",
            "(2 + t)^t",
            "sqrt(5 + t)",
            "exp(-t)",
            "ln(4 + t)",
            "log10(4 + t)",
            "abs(t)",
            "sin(3 * t)",
            "cos(2 * t)",
            "tan(t / 4)",
            "tanh(t)",
            "min(t, 1, 2 - t)",
            "max(0, t) * 4",
            "(3 + t)^-1.5",
            "interpolate(t, -1, 2, 0.1, 3, 0.35, -1, 2, 0)",
            "interpolate(t * t, 0, 1, 0.5, 0)",
            "t^4",
        ];
        for text in texts {
            let program = compile(text, &["t"], &|name| (name == "t").then_some(0)).unwrap();
            for (from, until) in [(-1.5, 1.7), (0.3, 0.4), (-0.7, -0.2), (0.0, 2.5)] {
                let bounds = run(&program, &[Enclosure::straight(from, until, until - from)]);
                for i in 0..=50 {
                    let t = from + (until - from) * f64::from(i) / 50.0;
                    let (value, slope) = super::super::program::run(&program, &[t], Some(&[1.0]));
                    let inside = |bounds: Interval, x: f64| bounds.low - 1e-12 <= x && x <= bounds.high + 1e-12;
                    assert!(inside(bounds.value, value), "{text} at {t}: {value} outside {bounds:?}");
                    // A kink at an end of the stretch has two slopes there, one of them outside.
                    assert!(i % 50 == 0 || inside(bounds.slope, slope), "{text} at {t}: slope {slope} outside {bounds:?}");
                }
            }
        }
    }

    /// A pulse is seen in a stretch of any length, a kink only where it lies.
    #[test]
    fn pulses_and_kinks_are_seen() {
        let pulse = "100 * max(0, min(1, 10 * min(t - 1800, 1801 - t)))";
        assert!(enclosed(pulse, 0.0, 3600.0).value.high == 100.0 && !enclosed(pulse, 0.0, 3600.0).is_smooth);
        let before = enclosed(pulse, 0.0, 1799.0);
        assert!(before.is_smooth && before.value == Interval::ZERO && before.bend(1799.0) == 0.0);
        let bell = enclosed("exp(-((t - 1800) / 0.4)^2)", 1000.0, 3600.0);
        assert!(bell.is_smooth && bell.bend(2600.0) >= 1.0, "{bell:?}");
        assert!(enclosed("max(3, 3) + 0 * t", 0.0, 1.0).is_smooth);
    }
}
