//! Numbers as text, and quantiles of statistics that several crates share.

/// Half width of a two-sided 95 % interval of a normal distribution, in standard deviations: its 97.5 % quantile.
pub const TWO_SIDED_95: f64 = 1.959_964;
/// Half width of a two-sided 90 % interval of a normal distribution, in standard deviations: its 95 % quantile.
pub const TWO_SIDED_90: f64 = 1.644_854;

/// Root mean square, in the unit of the values; zero for no values.
pub fn root_mean_square(values: &[f64]) -> f64 {
    (sum_of_squares(values) / values.len().max(1) as f64).sqrt()
}

/// Sum of the squares, in the square of the values' unit.
pub fn sum_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum()
}

/// A number with `digits` significant digits, in plain notation if that is short. Zeros at the end stay, because they
/// are known digits.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    if (-4..6).contains(&magnitude) {
        let decimals = (digits as i32 - 1 - magnitude).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.*e}", digits.saturating_sub(1))
    }
}

/// A number with at most `digits` significant digits, without zeros at the end: plain from 1e-4 to 1e7, else with an exponent.
pub fn compact(value: f64, digits: usize) -> String {
    let digits = digits.clamp(1, 17);
    let text = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if value == 0.0 || (-4..7).contains(&exponent) {
        // The mantissa is already rounded; parsing the rounded number makes the plain and the exponent form agree.
        let rounded: f64 = text.parse().unwrap_or(value);
        without_zeros(&format!("{rounded:.*}", (digits as i32 - 1 - exponent).max(0) as usize)).to_owned()
    } else {
        format!("{}e{exponent}", without_zeros(mantissa))
    }
}

/// A decimal fraction without the zeros that end it.
pub fn without_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// A value of a file as shown to a reader: without quotes around the whole, long numbers cut to six digits.
pub fn short(value: &str) -> String {
    let bare = value.strip_prefix('"').and_then(|v| v.strip_suffix('"')).filter(|v| !v.contains('"')).unwrap_or(value);
    let mut out = String::new();
    let mut rest = bare;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let number = &rest[start..];
        let end = number.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(number.len());
        let (digits, behind) = number.split_at(end);
        // Digits after a letter belong to a name.
        let is_name = rest[..start].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        out += &rest[..start];
        match digits.parse::<f64>() {
            Ok(v) if !is_name && digits.len() > 8 && digits.contains('.') && !behind.starts_with('e') => out += &significant(v, 6),
            _ => out += digits,
        }
        rest = behind;
    }
    out + rest
}

/// A time in words for a reader: `12.5 s`, `4 min 30 s`, `3 h 12 min`, `2 d 5 h`.
pub fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds.abs() < 59.95 {
        return format!("{} s", (seconds * 10.0).round() / 10.0);
    }
    let sign = if seconds < 0.0 { "-" } else { "" };
    let two = |large: f64, small: f64, names: [&str; 2]| {
        let parts = (seconds.abs() / small).round();
        let (whole, rest) = ((parts * small / large).floor(), parts % (large / small));
        if rest == 0.0 { format!("{sign}{whole} {}", names[0]) } else { format!("{sign}{whole} {} {rest} {}", names[0], names[1]) }
    };
    match seconds.abs() {
        s if s < 3599.5 => two(60.0, 1.0, ["min", "s"]),
        s if s < 172_770.0 => two(3600.0, 60.0, ["h", "min"]),
        _ => two(86400.0, 3600.0, ["d", "h"]),
    }
}

#[cfg(test)]
mod tests {
    use super::{compact, duration, short, significant};

    #[test]
    fn digits_are_kept_or_cut() {
        assert_eq!([significant(1.5, 4), significant(1.5e9, 2), significant(0.0, 3)], ["1.500", "1.5e9", "0"]);
        assert_eq!([compact(1.5, 4), compact(1.5e9, 2), compact(123_456.0, 3), compact(0.0, 3)], ["1.5", "1.5e9", "123000", "0"]);
    }

    #[test]
    fn long_numbers_are_cut() {
        for (value, shown) in [
            ("\"246.53102427256633 W/(m2 K)\"", "246.531 W/(m2 K)"),
            (
                "{ in = \"bracket\", power = \"(-5.987654321) * n1.123456789\" }",
                "{ in = \"bracket\", power = \"(-5.98765) * n1.123456789\" }",
            ),
            ("\"0.5\"", "0.5"),
            ("[1, 2]", "[1, 2]"),
        ] {
            assert_eq!(short(value), shown);
        }
    }

    #[test]
    fn times_read_well() {
        for (seconds, text) in [
            (0.0, "0 s"),
            (12.34, "12.3 s"),
            (59.99, "1 min"),
            (270.0, "4 min 30 s"),
            (3599.7, "1 h"),
            (61_200.0, "17 h"),
            (11_530.0, "3 h 12 min"),
            (190_800.0, "2 d 5 h"),
            (-90.0, "-1 min 30 s"),
        ] {
            assert_eq!(duration(seconds), text, "{seconds}");
        }
    }
}
