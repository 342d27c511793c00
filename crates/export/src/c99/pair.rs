//! Numbers in two parts of single precision, with the arithmetic of `pairs.c` in its order.

use coldplate_runtime::{Kernel, Transform};

use crate::content::{Basis, Scaling};

/// A number as the sum of two, the second smaller than the last place of the first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) high: f32,
    pub(super) low: f32,
}

/// Natural logarithm of 2 (dimensionless).
const LN_2: f64 = std::f64::consts::LN_2;
/// Argument x (dimensionless) from which on exp(-x) is taken as zero: exp(-87) is near the smallest normal number of
/// single precision.
const FAR: f32 = 87.0;
/// Taylor coefficients 1/7!, 1/6!, ..., 1/0! of exp (dimensionless).
const SERIES: [f64; 8] = [1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
/// Taylor coefficients 1/13!, ..., 1/8! of exp (dimensionless): the rest of the series is small enough for single
/// precision.
const REST: [f32; 6] = [1.0 / 6_227_020_800.0, 1.0 / 479_001_600.0, 1.0 / 39_916_800.0, 1.0 / 3_628_800.0, 1.0 / 362_880.0, 1.0 / 40_320.0];

impl Pair {
    /// The pair nearest to a number.
    pub(super) fn of(value: f64) -> Self {
        let high = value as f32;
        Self { high, low: (value - f64::from(high)) as f32 }
    }

    fn alone(high: f32) -> Self {
        Self { high, low: 0.0 }
    }

    fn settled(high: f32, low: f32) -> Self {
        let sum = high + low;
        Self { high: sum, low: low - (sum - high) }
    }

    fn negative(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }

    fn plus(self, other: Self) -> Self {
        let sum = self.high + other.high;
        let part = sum - self.high;
        let lost = (self.high - (sum - part)) + (other.high - part);
        Self::settled(sum, lost + (self.low + other.low))
    }

    fn times(self, other: Self) -> Self {
        let product = self.high * other.high;
        let lost = lost(self.high, other.high, product);
        Self::settled(product, lost + (self.high * other.low + self.low * other.high))
    }

    fn over(self, other: Self) -> Self {
        let quotient = self.high / other.high;
        let back = Self::alone(quotient).times(other);
        Self::settled(quotient, ((self.high - back.high) + (self.low - back.low)) / other.high)
    }

    fn root(self) -> Self {
        if self.high > 0.0 {
            let first = self.high.sqrt();
            let square = first * first;
            let rest = ((self.high - square) - lost(first, first, square)) + self.low;
            return Self::settled(first, rest / (first + first));
        }
        Self::alone(self.high)
    }

    fn exp(self) -> Self {
        if self.high < -FAR {
            return Self::alone(0.0);
        }
        let k = (self.high * std::f32::consts::LOG2_E).round_ties_even();
        let r = self.plus(Self::alone(-k).times(Self::of(LN_2)));
        let rest = Self::alone(REST.into_iter().fold(0.0, |rest, next| rest * r.high + next));
        let sum = SERIES.into_iter().fold(rest, |sum, next| sum.times(r).plus(Self::of(next)));
        let power = 2.0_f32.powi(k as i32);
        Self { high: sum.high * power, low: sum.low * power }
    }

    fn ln(self) -> Self {
        let first = self.high.ln();
        let ratio = self.times(Self::alone(-first).exp());
        let rest = (ratio.high - 1.0) + ratio.low;
        Self::settled(first, rest - 0.5 * rest * rest)
    }

    fn kernel(kernel: Kernel, square: Self) -> Self {
        match kernel {
            Kernel::ThinPlate => {
                let normal = if square.high < f32::MIN_POSITIVE { Self::alone(f32::MIN_POSITIVE) } else { square };
                Self::alone(0.5).times(square).times(normal.ln())
            }
            Kernel::Cubic => square.times(square.root()),
            Kernel::Multiquadric => Self::alone(1.0).plus(square).root(),
            Kernel::Gaussian => square.negative().exp(),
        }
    }
}

/// Rounding error of the product of two numbers.
fn lost(a: f32, b: f32, product: f32) -> f32 {
    (f64::from(a) * f64::from(b) - f64::from(product)) as f32
}

/// A radial basis whose numbers are pairs.
pub(super) struct PairedBasis<'c> {
    own: &'c Basis,
    /// Low end, factor and offset of the scaling of each variable.
    scalings: Vec<(usize, Transform, [Pair; 3])>,
    scales: Vec<Pair>,
    centres: Vec<Pair>,
    weights: Vec<Pair>,
}

impl<'c> PairedBasis<'c> {
    pub(super) fn new(own: &'c Basis, scalings: &[Scaling]) -> Self {
        let pairs = |values: &[f64]| values.iter().map(|value| Pair::of(*value)).collect::<Vec<_>>();
        let scaling =
            |scaling: &Scaling| (scaling.variable, scaling.transform, [scaling.low, scaling.factor, scaling.offset].map(Pair::of));
        Self {
            own,
            scalings: own.scalings.iter().map(|place| scaling(&scalings[*place])).collect(),
            scales: pairs(&own.scales),
            centres: pairs(&own.centres),
            weights: pairs(&own.weights),
        }
    }

    /// Adds the basis to the values of all points.
    pub(super) fn add(&self, x: &[f64], values: &mut [f32]) {
        let u: Vec<Pair> = self.scalings.iter().map(|(variable, transform, own)| scaled(x[*variable] as f32, *transform, own)).collect();
        let mut sums = vec![Pair::alone(0.0); self.own.points.len()];
        for (centre, weights) in self.centres.chunks(u.len()).zip(self.weights.chunks(sums.len())) {
            let distances = u.iter().zip(centre).zip(&self.scales).map(|((u, centre), scale)| u.plus(centre.negative()).times(*scale));
            let square = distances.fold(Pair::alone(0.0), |square, d| square.plus(d.times(d)));
            let kernel = Pair::kernel(self.own.kernel, square);
            for (sum, weight) in sums.iter_mut().zip(weights) {
                *sum = sum.plus(kernel.times(*weight));
            }
        }
        for (point, sum) in self.own.points.iter().zip(sums) {
            values[*point] += sum.high;
        }
    }
}

fn scaled(x: f32, transform: Transform, [low, factor, offset]: &[Pair; 3]) -> Pair {
    let x = Pair::alone(x);
    let g = match transform {
        Transform::Identity => x,
        Transform::Reciprocal => Pair::alone(1.0).over(x),
        Transform::Log => x.ln(),
    };
    g.plus(low.negative()).times(*factor).plus(*offset)
}

#[cfg(test)]
mod tests {
    use super::Pair;

    #[test]
    fn pairs_keep_fourteen_digits() {
        let apart = |found: Pair, exact: f64| (f64::from(found.high) + f64::from(found.low) - exact).abs() / exact.abs();
        for k in 1..2000 {
            let (a, b) = (f64::from(k) * 0.003_141_592_653_589_793, 7.0 / f64::from(k));
            let (x, y) = (Pair::of(a), Pair::of(b));
            for (what, found, exact) in [
                ("sum", x.plus(y), a + b),
                ("product", x.times(y), a * b),
                ("quotient", x.over(y), a / b),
                ("root", x.root(), a.sqrt()),
                ("exp", x.negative().exp(), (-a).exp()),
                ("ln", Pair::of(a + 2.0).ln(), (a + 2.0).ln()),
            ] {
                assert!(apart(found, exact) < 5e-14, "{what} of {a} and {b}: {:e}", apart(found, exact));
            }
        }
    }
}
