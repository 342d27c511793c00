//! Probabilities of two and three normal numbers, and from them a lower bound for the probability that several are all
//! below their bounds.

use core::f64::consts::TAU;

use crate::math::{exp_minus, sqrt};
use crate::normal::{exp_minus_signed, probability_below};

/// Largest number of limits whose dependence is followed (count): of more, those most likely broken. Chosen: the time
/// grows with the square of the number, the loss is an upper bound added in full.
pub(crate) const MOST_LIMITS: usize = 8;
/// Correlation (dimensionless) from which on two limits count as limits of one quantity. Chosen: one but for rounding.
pub(crate) const SAME: f64 = 1.0 - 1e-9;
/// Nodes and weights (dimensionless) of the Gauss-Legendre rule with twelve nodes between 0 and 1.
const RULE: [(f64, f64); 12] = [
    (0.009_219_682_876_640_378, 0.023_587_668_193_255_706),
    (0.047_941_371_814_762_6, 0.053_469_662_997_659_53),
    (0.115_048_662_902_847_65, 0.080_039_164_271_673_21),
    (0.206_341_022_856_691_26, 0.101_583_713_361_532_87),
    (0.316_084_250_500_909_94, 0.116_746_268_269_177_3),
    (0.437_383_295_744_265_54, 0.124_573_522_906_701_34),
    (0.562_616_704_255_734_4, 0.124_573_522_906_701_34),
    (0.683_915_749_499_090_1, 0.116_746_268_269_177_3),
    (0.793_658_977_143_308_7, 0.101_583_713_361_532_87),
    (0.884_951_337_097_152_3, 0.080_039_164_271_673_21),
    (0.952_058_628_185_237_5, 0.053_469_662_997_659_53),
    (0.990_780_317_123_359_6, 0.023_587_668_193_255_706),
];
/// (2 pi)^(1/2), dimensionless.
const SQRT_TWO_PI: f64 = 2.506_628_274_631_000_7;
/// Correlation (dimensionless) from which on the integral starts from correlation one. Chosen between the errors of
/// both forms of the integral.
const STRONG: f64 = 0.9;
/// Probability of being broken below which a limit is not paired with others. Chosen: time against an error that is
/// small beside every confidence in use.
const ALONE: f64 = 1e-7;
/// Probability below which a third limit is ignored. Chosen: time against an error that is small beside every confidence
/// in use.
const ALONE_OF_THREE: f64 = 1e-6;
/// Difference by which a probability must exceed another to count as larger. Chosen: above rounding, so that rounding
/// decides nothing.
const LARGER: f64 = 1e-9;

/// The tangent of half the angle whose sine is `r`: as functions of it, the integrands below contain no root that
/// vanishes at the end.
fn half_tangent(r: f64) -> f64 {
    r / (1.0 + sqrt((1.0 - r) * (1.0 + r)))
}

/// Correlation r and 1 - r² at a half tangent, and the derivative of the angle with respect to it.
fn turned(tangent: f64) -> (f64, f64, f64) {
    let square = tangent * tangent;
    let under = 1.0 + square;
    let cosine = (1.0 - square) / under;
    (2.0 * tangent / under, cosine * cosine, 2.0 / under)
}

/// Probability that two standard normal numbers of correlation `r` are below `a` and `b`, given their single
/// probabilities `below_a` and `below_b`. The integral over the correlation starts from zero (Drezner and Wesolowsky
/// 1990). For a strong correlation it starts from one, without the terms that no rule of few nodes can follow (Genz
/// 2004).
pub(crate) fn both_below(a: f64, b: f64, r: f64, below_a: f64, below_b: f64) -> f64 {
    if r > STRONG {
        return f64::min(below_a, below_b) - missing(a, b, r);
    }
    if r < -STRONG {
        let least = below_a + below_b - 1.0;
        return if least > 0.0 { least } else { 0.0 } + missing(a, -b, -r);
    }
    let end = half_tangent(r);
    let mut sum = 0.0;
    for (node, weight) in RULE {
        let (r, left, step) = turned(node * end);
        sum += weight * step * exp_minus(0.5 * (a * a + b * b - 2.0 * r * a * b) / left);
    }
    below_a * below_b + end * sum / TAU
}

/// Difference between the probability that both are below at correlation one, and at correlation `r`. The integral is
/// over the root of 1 - r².
fn missing(a: f64, b: f64, r: f64) -> f64 {
    let end = sqrt((1.0 - r) * (1.0 + r));
    let apart = if a > b { a - b } else { b - a };
    if apart > 8.0 * end || end == 0.0 {
        return 0.0;
    }
    let (square, product) = (apart * apart, a * b);
    // The integrand at the narrow end is the sum of its first two terms times a factor with known integrals.
    let lead = exp_minus_signed(-0.5 * product);
    let bend = 0.5 - 0.125 * product;
    let edge = exp_minus(0.5 * square / (end * end));
    let flat = end * edge - apart * SQRT_TWO_PI * probability_below(-apart / end);
    let curved = (end * end * end * edge - square * flat) / 3.0;
    let mut sum = 0.0;
    for (node, weight) in RULE {
        let x = node * end;
        let cosine = sqrt((1.0 - x) * (1.0 + x));
        let whole = exp_minus_signed(-product / (1.0 + cosine)) / cosine;
        sum += weight * exp_minus(0.5 * square / (x * x)) * (whole - lead * (1.0 + bend * x * x));
    }
    (lead * (flat + bend * curved) + end * sum) / TAU
}

/// Limits, each as a standard normal number that breaks it, and the probabilities of pairs.
pub(crate) struct Breaking<'a> {
    /// Bound below which a number breaks its limit, and the probability of this.
    pub(crate) bound: &'a [f64],
    pub(crate) broken: &'a [f64],
    pub(crate) correlation: &'a [[f64; MOST_LIMITS]; MOST_LIMITS],
    both: [[f64; MOST_LIMITS]; MOST_LIMITS],
}

impl<'a> Breaking<'a> {
    pub(crate) fn new(bound: &'a [f64], broken: &'a [f64], correlation: &'a [[f64; MOST_LIMITS]; MOST_LIMITS]) -> Self {
        let mut both = [[0.0; MOST_LIMITS]; MOST_LIMITS];
        for i in 0..bound.len() {
            for j in 0..i {
                let least = f64::min(broken[i], broken[j]);
                if least > ALONE {
                    let p = both_below(bound[i], bound[j], correlation[i][j], broken[i], broken[j]).clamp(0.0, least);
                    (both[i][j], both[j][i]) = (p, p);
                }
            }
        }
        Self { bound, broken, correlation, both }
    }

    /// Probability that three limits are broken: an integral over two of the correlations, from zero (Plackett 1954),
    /// with the strongest correlation as the third. `None` if two of them limit one quantity.
    fn three(&self, of: [usize; 3]) -> Option<f64> {
        let size = |i: usize, j: usize| self.correlation[i][j].abs();
        let [i, j, k] = of;
        let [first, second, third] = if size(j, k) >= size(i, j) && size(j, k) >= size(i, k) {
            [i, j, k]
        } else if size(i, k) >= size(i, j) {
            [j, i, k]
        } else {
            [k, i, j]
        };
        if size(second, third) > SAME {
            return None;
        }
        let [a, b, c] = [first, second, third].map(|own| self.bound[own]);
        let p = self.correlation[second][third];
        let (to_b, to_c) = (half_tangent(self.correlation[first][second]), half_tangent(self.correlation[first][third]));
        let mut sum = 0.0;
        for (node, weight) in RULE {
            let (r, left_r, step_r) = turned(node * to_b);
            let (q, left_q, step_q) = turned(node * to_c);
            let determinant = (left_r - q * q - p * p + 2.0 * p * q * r).max(1e-14);
            let of_b = density_of_two(a, b, r, left_r)
                * probability_below((c * left_r - (q - p * r) * a - (p - q * r) * b) / sqrt(left_r * determinant));
            let of_c = density_of_two(a, c, q, left_q)
                * probability_below((b * left_q - (r - p * q) * a - (p - q * r) * c) / sqrt(left_q * determinant));
            sum += weight * (to_b * step_r * of_b + to_c * step_q * of_c);
        }
        let most = self.both[i][j].min(self.both[i][k]).min(self.both[j][k]);
        Some((self.broken[first] * self.both[second][third] + sum / TAU).clamp(0.0, most))
    }

    /// Lower bound for the probability that all limits are kept. The probability that a limit is broken while all
    /// before it are kept is at most the probability that it is broken while one or two of them are kept (Hunter 1976,
    /// Worsley 1982; Bukszar and Prekopa 2001). The bound is exact for two limits and for three.
    pub(crate) fn least_kept(&self) -> f64 {
        const NOWHERE: usize = usize::MAX;
        let count = self.bound.len();
        let mut is_in = [false; MOST_LIMITS];
        // For each limit: the limits already in the tree that are most likely broken together with it, at most two.
        let mut beside = [(0, NOWHERE); MOST_LIMITS];
        is_in[0] = true;
        let mut kept = 1.0 - self.broken[0];
        for _ in 1..count {
            let mut next = NOWHERE;
            for k in 0..count {
                if !is_in[k] && (next == NOWHERE || self.both[k][beside[k].0] > self.both[next][beside[next].0] + LARGER) {
                    next = k;
                }
            }
            let (first, second) = beside[next];
            let mut alone = self.broken[next] - self.both[next][first];
            if second != NOWHERE
                && alone.min(self.both[next][second]) > ALONE_OF_THREE
                && let Some(three) = self.three([next, first, second])
            {
                alone += three - self.both[next][second];
            }
            kept -= if alone > 0.0 { alone } else { 0.0 };
            is_in[next] = true;
            for (k, (first, second)) in beside.iter_mut().enumerate().take(count) {
                if self.both[k][next] > self.both[k][*first] + LARGER {
                    (*first, *second) = (next, *first);
                } else if *second == NOWHERE || self.both[k][next] > self.both[k][*second] + LARGER {
                    *second = next;
                }
            }
        }
        if kept > 0.0 { kept } else { 0.0 }
    }
}

/// The density of two standard normal numbers with a correlation, without its leading factors; `left` is 1 - r².
fn density_of_two(a: f64, b: f64, r: f64, left: f64) -> f64 {
    exp_minus(0.5 * (a * a + b * b - 2.0 * r * a * b) / left)
}
