//! The normal distribution, and the chi-square distribution through the normal one.

use crate::math::{exp_minus, ln, sqrt};

/// Half the width of the interval that holds 95 % of a normal distribution, in standard deviations: its 97.5 %
/// quantile.
pub const NINETY_FIVE: f64 = 1.959_963_984_540_054;

/// Density of the standard normal distribution at zero (dimensionless): (2 pi)^(-1/2).
const DENSITY_AT_ZERO: f64 = 0.398_942_280_401_432_7;

/// Probability that a standard normal variable is at most `x`; NaN stays. Relative error in either tail under 1e-9, by the
/// rational function of Hart (1968, no. 5666) up to 7 and a continued fraction beyond.
#[must_use]
pub fn probability_below(x: f64) -> f64 {
    if x.is_nan() {
        return f64::NAN;
    }
    let size = if x < 0.0 { -x } else { x };
    let tail = if size > 38.0 { 0.0 } else { tail(size) };
    if x < 0.0 { tail } else { 1.0 - tail }
}

fn tail(x: f64) -> f64 {
    let density = exp_minus(0.5 * x * x);
    if x < 7.0 {
        let over = [
            0.035_262_496_599_891_1,
            0.700_383_064_443_688,
            6.373_962_203_531_65,
            33.912_866_078_383,
            112.079_291_497_871,
            221.213_596_169_931,
            220.206_867_912_376,
        ];
        let under = [
            0.088_388_347_648_318_4,
            1.755_667_163_182_64,
            16.064_177_579_207,
            86.780_732_202_946_1,
            296.564_248_779_674,
            637.333_633_378_831,
            793.826_512_519_948,
            440.413_735_824_752,
        ];
        return density * horner(&over, x) / horner(&under, x);
    }
    let mut fraction = x;
    for k in (1..=12).rev() {
        fraction = x + f64::from(k) / fraction;
    }
    density * DENSITY_AT_ZERO / fraction
}

fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().fold(0.0, |sum, c| sum * x + c)
}

/// Density of the standard normal distribution.
pub(crate) fn density(x: f64) -> f64 {
    DENSITY_AT_ZERO * exp_minus(0.5 * x * x)
}

/// Probability that the sum of the squares of `degrees` standard normal variables is larger than `chi_square`, by the
/// approximation of Wilson and Hilferty (1931): to 0.01 for one degree, to 0.001 from three on.
#[must_use]
pub fn probability_above_chi_square(chi_square: f64, degrees: usize) -> f64 {
    if degrees == 0 || chi_square.is_nan() {
        return 1.0;
    }
    if chi_square <= 0.0 {
        return 1.0;
    }
    let spread = 2.0 / (9.0 * degrees as f64);
    let cube_root = exp_minus_signed(ln(chi_square / degrees as f64) / 3.0);
    probability_below((1.0 - spread - cube_root) / sqrt(spread))
}

/// exp(x) for either sign.
pub(crate) fn exp_minus_signed(x: f64) -> f64 {
    if x < 0.0 { exp_minus(-x) } else { 1.0 / exp_minus(x) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_agree_with_published_values() {
        // Abramowitz and Stegun, tables 26.1 and 26.2.
        for (x, exact) in [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_543),
            (2.0, 0.977_249_868_051_821),
            (-3.0, 0.001_349_898_031_630_09),
            (-6.0, 9.865_876_450_377e-10),
            (-8.0, 6.220_960_574_271_8e-16),
            (-10.0, 7.619_853_024_160_5e-24),
        ] {
            let found = probability_below(x);
            assert!((found / exact - 1.0).abs() < 1e-8, "{x}: {found:e}");
        }
        assert!((probability_below(NINETY_FIVE) - 0.975).abs() < 1e-14);
        assert_eq!(probability_below(f64::INFINITY), 1.0);
        assert_eq!(probability_below(f64::NEG_INFINITY), 0.0);
        assert!(probability_below(f64::NAN).is_nan());
    }

    #[test]
    fn chi_square_agrees_with_published_values() {
        // The 5 % points.
        for (degrees, point, within) in [(1, 3.841, 0.01), (3, 7.815, 0.001), (10, 18.307, 0.001), (100, 124.342, 0.001)] {
            let found = probability_above_chi_square(point, degrees);
            assert!((found - 0.05).abs() < within, "{degrees}: {found}");
        }
        assert_eq!(probability_above_chi_square(0.0, 5), 1.0);
    }
}
