//! Square root, logarithm and exponential, which `core` does not provide.
//!
//! Each is a straight line of additions and multiplications without branches or tables: loops over them vectorise, and
//! every platform with IEEE 754 arithmetic gives equal bits. Errors, measured against the standard library in the tests
//! below: under 1e-15 relative.

/// Bits of the exponent of a double (IEEE 754).
const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
/// Bits of 1.0.
const ONE: u64 = 0x3ff0_0000_0000_0000;
/// Bits of sqrt(1/2): mantissas are brought into [sqrt(1/2), sqrt(2)).
const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
/// ln 2 (dimensionless) cut to 38 binary places, so that its product with an exponent is exact.
const LN2_HIGH: f64 = 0.693_147_180_558_298_7;
/// The rest of ln 2 behind [`LN2_HIGH`] (dimensionless).
const LN2_LOW: f64 = 1.646_594_958_289_708_2e-12;
/// 1.5 * 2^52: adding it leaves the nearest integer in the low bits of the sum.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Coefficients of (atanh(s)/s - 1)/s² in powers of s², interpolated at the Chebyshev nodes of
/// the range of s² below; the remainder is under 5e-18.
const ATANH: [f64; 7] = [
    0.333_333_333_333_333_5,
    0.199_999_999_999_494_44,
    0.142_857_143_131_269_18,
    0.111_111_055_446_897_48,
    0.090_914_462_162_684_35,
    0.076_658_058_610_275_04,
    0.073_089_035_767_086_63,
];

/// ln x for a positive, normal, finite x; anything else gives an unspecified number.
#[inline(always)]
pub(crate) fn ln_normal(x: f64) -> f64 {
    // x = 2^k m with m in [sqrt(1/2), sqrt(2)); ln m = 2 atanh((m - 1)/(m + 1)).
    let bits = x.to_bits();
    let biased = bits.wrapping_add(ONE.wrapping_sub(SQRT_HALF));
    let m = f64::from_bits(bits.wrapping_sub(biased & EXPONENT).wrapping_add(ONE));
    // The biased exponent as a float, by way of the low bits of 2^52.
    let k = f64::from_bits((biased >> 52) | 0x4330_0000_0000_0000) - (4_503_599_627_370_496.0 + 1023.0);
    let f = m - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let z2 = z * z;
    let [c0, c1, c2, c3, c4, c5, c6] = ATANH;
    let series = (c0 + c1 * z) + z2 * ((c2 + c3 * z) + z2 * ((c4 + c5 * z) + z2 * c6));
    let twice = s + s;
    k * LN2_HIGH + (twice + (twice * z * series + k * LN2_LOW))
}

/// ln x for every x: NaN for negative x, minus infinity at zero.
pub(crate) fn ln(x: f64) -> f64 {
    if x.is_nan() || x < 0.0 {
        f64::NAN
    } else if x == 0.0 {
        f64::NEG_INFINITY
    } else if x == f64::INFINITY {
        x
    } else if x < f64::MIN_POSITIVE {
        // 2^54 lifts a subnormal number into the normal range.
        ln_normal(x * 18_014_398_509_481_984.0) - 54.0 * LN2_HIGH - 54.0 * LN2_LOW
    } else {
        ln_normal(x)
    }
}

/// Taylor coefficient of exp of order 13 (dimensionless).
const EXP: f64 = 1.0 / 6_227_020_800.0;
/// Taylor coefficients of exp of orders 12 to 9 (dimensionless).
const EXP_12: [f64; 4] = [1.0 / 479_001_600.0, 1.0 / 39_916_800.0, 1.0 / 3_628_800.0, 1.0 / 362_880.0];
/// Taylor coefficients of exp of orders 8 to 5 (dimensionless).
const EXP_8: [f64; 4] = [1.0 / 40_320.0, 1.0 / 5_040.0, 1.0 / 720.0, 1.0 / 120.0];
/// Taylor coefficients of exp of orders 4 to 2 (dimensionless).
const EXP_4: [f64; 3] = [1.0 / 24.0, 1.0 / 6.0, 0.5];

/// exp(-x) for x >= 0; zero beyond 708, where the result would leave the normal range.
#[inline(always)]
pub(crate) fn exp_minus(x: f64) -> f64 {
    let (r, power) = exponent(x);
    end_of_exp(horner(horner(EXP, r, EXP_12), r, EXP_8), r, power)
}

/// exp(-x) for many x >= 0, in place. Each step of a series waits for the one before it, and a processor looks only
/// some way ahead. The function goes over the numbers in short passes, so that several numbers are in work at once.
#[inline(always)]
pub(crate) fn exp_minus_all(x: &mut [f64]) {
    for x in x.chunks_mut(TURN) {
        let (mut r, mut power) = ([0.0; TURN], [0.0; TURN]);
        for (x, (r, power)) in x.iter_mut().zip(r.iter_mut().zip(&mut power)) {
            (*r, *power) = exponent(*x);
        }
        x.iter_mut().zip(&r).for_each(|(series, r)| *series = horner(EXP, *r, EXP_12));
        x.iter_mut().zip(&r).for_each(|(series, r)| *series = horner(*series, *r, EXP_8));
        x.iter_mut().zip(r.iter().zip(&power)).for_each(|(series, (r, power))| *series = end_of_exp(*series, *r, *power));
    }
}

/// Number of numbers per pass (count). Chosen: fits the nearest cache.
const TURN: usize = 64;

/// -x = k ln 2 + r with |r| <= ln 2 / 2: r, and 2 to the power of k. The Taylor series of exp r to r^13 leaves 4e-18.
#[inline(always)]
fn exponent(x: f64) -> (f64, f64) {
    let clamped = if x > 708.0 { 708.0 } else { x };
    let shifted = ROUNDER - clamped * core::f64::consts::LOG2_E;
    let k = shifted - ROUNDER;
    let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(ONE));
    ((-clamped - k * LN2_HIGH) - k * LN2_LOW, if x > 708.0 { 0.0 } else { power })
}

#[inline(always)]
fn horner<const N: usize>(series: f64, r: f64, terms: [f64; N]) -> f64 {
    terms.into_iter().fold(series, |series, term| series * r + term)
}

#[inline(always)]
fn end_of_exp(series: f64, r: f64, power: f64) -> f64 {
    (1.0 + (r + r * r * horner(series, r, EXP_4))) * power
}

/// sqrt x for x >= 0, zero and infinity included; anything else gives NaN or an unspecified number.
#[inline(always)]
pub(crate) fn sqrt(x: f64) -> f64 {
    // Halving the exponent gives 1/sqrt(x) to 3.5 %; four Newton steps, each squaring the error, reduce it to rounding.
    let half = 0.5 * x;
    let mut y = f64::from_bits(0x5fe6_eb3b_e000_0000_u64.wrapping_sub(x.to_bits() >> 1));
    y *= 1.5 - half * y * y;
    y *= 1.5 - half * y * y;
    y *= 1.5 - half * y * y;
    y *= 1.5 - half * y * y;
    let root = x * y;
    // One step on the root itself removes the rounding of the steps on its reciprocal.
    let root = root + 0.5 * y * (x - root * root);
    if x > 1e300 { f64::INFINITY } else { root }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    fn sweep(mut check: impl FnMut(f64)) {
        // 200 000 arguments spread evenly in the exponent from 1e-290 to 1e290, and a dense set around 1.
        for i in 0..200_000 {
            check(f64::powf(10.0, -290.0 + 580.0 * f64::from(i) / 200_000.0));
            check(0.5 + 1.5 * f64::from(i) / 200_000.0);
        }
    }

    #[test]
    fn square_root_agrees_with_the_standard_library() {
        let mut worst: f64 = 0.0;
        sweep(|x| worst = worst.max((sqrt(x) / x.sqrt() - 1.0).abs()));
        assert!(worst < 1e-15, "{worst:e}");
        assert_eq!(sqrt(0.0), 0.0);
        assert!(sqrt(f64::NAN).is_nan());
    }

    #[test]
    fn logarithm_agrees_with_the_standard_library() {
        let mut worst: f64 = 0.0;
        sweep(|x| {
            let exact = x.ln();
            worst = worst.max(if exact == 0.0 { ln(x).abs() } else { (ln(x) / exact - 1.0).abs() });
        });
        assert!(worst < 1e-15, "{worst:e}");
        assert_eq!(ln(1.0), 0.0);
        assert_eq!(ln(0.0), f64::NEG_INFINITY);
        assert!(ln(-1.0).is_nan() && ln(f64::NAN).is_nan());
        assert_eq!(ln(f64::INFINITY), f64::INFINITY);
        let subnormal = 5e-320_f64;
        assert!((ln(subnormal) / subnormal.ln() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn exponential_agrees_with_the_standard_library() {
        let mut worst: f64 = 0.0;
        for i in 0..400_000 {
            let x = 708.0 * (f64::from(i) / 400_000.0).powi(3);
            worst = worst.max((exp_minus(x) / (-x).exp() - 1.0).abs());
        }
        assert!(worst < 1e-15, "{worst:e}");
        assert_eq!(exp_minus(0.0), 1.0);
        assert_eq!(exp_minus(1e9), 0.0);
        assert_eq!(exp_minus(f64::INFINITY), 0.0);
        assert!(exp_minus(f64::NAN).is_nan());
    }
}
