//! Numbers of many rows as text, with a given number of significant digits.

use coldplate_base::numbers::{significant, without_zeros};

/// Powers of ten that are exact.
const POWERS: [f64; 16] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
/// Powers of ten that a number below one is compared with.
const BELOW_ONE: [f64; 4] = [1e0, 1e-1, 1e-2, 1e-3];
/// Largest number of units of the last digit that is rounded as a product: 2⁴⁰, whose rounding is below 2⁻¹² of a unit.
const LARGEST: f64 = 1_099_511_627_776.0;
/// Distance from the half of a unit below which the product does not tell which way to round. Chosen: above 2⁻¹².
const DOUBTFUL: f64 = 1e-3;

/// Appends a number with at most `digits` significant digits, or as many as it needs to come back bit for bit.
pub(super) fn push(value: f64, digits: Option<usize>, out: &mut Vec<u8>) {
    let Some(digits) = digits else { return push_whole(value, out) };
    if !push_plain(value, digits, out) {
        let text = significant(value, digits);
        out.extend_from_slice(if text.contains('e') { &text } else { without_zeros(&text) }.as_bytes());
    }
}

/// Appends the shortest decimal number that reads back as the same, without an exponent.
fn push_whole(value: f64, out: &mut Vec<u8>) {
    // Beyond these sizes the formatter takes to exponents.
    if value == 0.0 || (1e-4..1e15).contains(&value.abs()) {
        let mut buffer = zmij::Buffer::new();
        let text = buffer.format_finite(value);
        out.extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
    } else {
        out.extend_from_slice(value.to_string().as_bytes());
    }
}

/// Appends the number if one multiplication tells its digits: exact decimals take ten times as long.
fn push_plain(value: f64, digits: usize, out: &mut Vec<u8>) -> bool {
    let size = value.abs();
    if !(1e-4..1e6).contains(&size) {
        return false;
    }
    // A number within rounding of a power of ten has one decimal more or less, which is a zero and is left out.
    let below = BELOW_ONE.iter().filter(|power| size < **power).count();
    let above = POWERS[1..6].iter().filter(|power| size >= **power).count();
    let decimals = (digits + below).saturating_sub(1 + above);
    let Some(power) = POWERS.get(decimals) else { return false };
    let units = size * power;
    let rest = units - units.floor();
    if units > LARGEST || (rest - 0.5).abs() < DOUBTFUL {
        return false;
    }
    let (mut number, mut decimals) = (units as u64 + u64::from(rest > 0.5), decimals);
    while decimals > 0 && number.is_multiple_of(10) {
        (number, decimals) = (number / 10, decimals - 1);
    }
    let mut text = [0; 24];
    let (mut at, mut done) = (text.len(), 0);
    while number > 0 || done <= decimals {
        if done == decimals && done > 0 {
            at -= 1;
            text[at] = b'.';
        }
        at -= 1;
        text[at] = b'0' + (number % 10) as u8;
        (number, done) = (number / 10, done + 1);
    }
    if value < 0.0 {
        out.push(b'-');
    }
    out.extend_from_slice(&text[at..]);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::random::Random;

    /// Texts are those of exact decimals, at ties and at changes of magnitude too.
    #[test]
    fn one_multiplication_gives_the_digits_of_exact_decimals() {
        let mut random = Random::new(5);
        let mut values =
            vec![0.0, -0.0, 0.125, 2.5, 0.5, 1.5, 99.5, 999_999.5, 99_999.95, 1e-4, 0.000_15, 35.25, -35.75, 1e6, 1.005, f64::NAN];
        for _ in 0..20_000 {
            let value = 10f64.powf(14.0 * random.unit() - 6.0) * if random.unit() < 0.3 { -1.0 } else { 1.0 };
            // Few binary digits make ties.
            values.extend([value, (value * 64.0).round() / 64.0, (value * 1000.0).round() / 1000.0]);
        }
        for value in values {
            for digits in 1..=17 {
                let exact = significant(value, digits);
                let exact = if exact.contains('e') { &exact } else { without_zeros(&exact) };
                assert_eq!(pushed(value, Some(digits)), exact, "{value:e} to {digits} digits");
            }
        }
    }

    fn pushed(value: f64, digits: Option<usize>) -> String {
        let mut text = Vec::new();
        push(value, digits, &mut text);
        String::from_utf8(text).unwrap()
    }

    /// Every bit comes back, by no more digits than the standard library writes. Where two numbers with as many digits are as near to the
    /// value, it may be the other one.
    #[test]
    fn whole_numbers_read_back_bit_for_bit() {
        let mut random = Random::new(7);
        let mut values = vec![0.0, -0.0, 1.0, -20.0, 0.1, 1e-4, 9.999_999e-5, 1e15, 9.007_199_254_740_993e15, 1e16, 1e22, 5e-324];
        values.extend([f64::MAX, f64::MIN_POSITIVE, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 123_456_789_012_345.6]);
        for _ in 0..20_000 {
            let value = 10f64.powf(40.0 * random.unit() - 20.0);
            values.extend([
                value,
                -value.round(),
                (value * 1000.0).round() / 1000.0,
                f64::from_bits((random.unit() * 2f64.powi(63)) as u64),
            ]);
        }
        for value in values {
            let text = pushed(value, None);
            assert_eq!(text.len(), value.to_string().len(), "{text} for {value}");
            assert!(value.is_nan() || text.parse::<f64>().unwrap().to_bits() == value.to_bits(), "{text}");
        }
    }
}
