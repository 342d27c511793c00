//! Numbers of many rows as text, with a given number of significant digits.

use coldplate_base::numbers::{significant, without_zeros};

/// Powers of ten that are exact.
const POWERS: [f64; 16] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
/// Largest number of units of the last digit that is rounded as a product: 2⁴⁰, whose rounding is below 2⁻¹² of a unit.
const LARGEST: f64 = 1_099_511_627_776.0;
/// Distance from the half of a unit below which the product does not tell which way to round. Chosen: above 2⁻¹².
const DOUBTFUL: f64 = 1e-3;

/// Appends a number with at most `digits` significant digits.
pub(super) fn push(value: f64, digits: usize, out: &mut String) {
    if !push_plain(value, digits, out) {
        let text = significant(value, digits);
        out.push_str(if text.contains('e') { &text } else { without_zeros(&text) });
    }
}

/// Appends the number if one multiplication tells its digits: exact decimals take ten times as long.
fn push_plain(value: f64, digits: usize, out: &mut String) -> bool {
    let size = value.abs();
    if !(1e-4..1e6).contains(&size) {
        return false;
    }
    let decimals = (digits as i32 - 1 - size.log10().floor() as i32).max(0) as usize;
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
        out.push('-');
    }
    out.extend(text[at..].iter().map(|digit| char::from(*digit)));
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
                let mut text = String::new();
                push(value, digits, &mut text);
                assert_eq!(text, exact, "{value:e} to {digits} digits");
            }
        }
    }
}
