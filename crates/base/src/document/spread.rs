//! Numbers that are uncertain, as they are written: `"560 +- 40 W/(m2 K)"`, `"0.55 +- 10 %"`, `"500 .. 620 W/(m2 K)"`.

use crate::units;

/// Uncertainty of a number.
#[derive(Debug, Clone, PartialEq)]
pub enum StatedSpread {
    /// A standard deviation as a share of the number.
    Share(f64),
    /// A standard deviation with its unit, which has the dimension of the number; unit `1` for a number without unit.
    Deviation(f64, String),
    /// Half the width of a range in which all values are equally probable, with its unit, which has the dimension of
    /// the number.
    Limits(f64, String),
}

impl StatedSpread {
    /// Splits a text into the number without its uncertainty, and the uncertainty; `None` if the text states no
    /// uncertain quantity.
    pub(super) fn split(text: &str) -> Option<(String, Self)> {
        if let Some((middle, rest)) = text.split_once("+-").or_else(|| text.split_once('±')) {
            let (middle, rest) = (middle.trim(), rest.trim());
            let (_, own_unit, own) = units::quantity(middle)?;
            if let Some(percent) = rest.strip_suffix('%') {
                return Some((middle.to_string(), Self::Share(percent.trim().parse::<f64>().ok().filter(|p| p.is_finite())? / 100.0)));
            }
            let (spread, unit, dimension) = units::quantity(rest)?;
            // A single unit behind both numbers belongs to both.
            let plain = if own_unit == "1" && unit != "1" { format!("{middle} {unit}") } else { middle.to_string() };
            let is_alike = own_unit == "1" || own.of_differences() == dimension.of_differences();
            return is_alike.then(|| (plain, Self::Deviation(spread, unit.to_string())));
        }
        let (low, high) = text.split_once("..")?;
        let (high, unit, _) = units::quantity(high)?;
        let low: f64 = low.trim().parse().ok().filter(|l: &f64| l.is_finite() && *l < high)?;
        let unit_after = if unit == "1" { String::new() } else { format!(" {unit}") };
        Some((format!("{:?}{unit_after}", 0.5 * (low + high)), Self::Limits(0.5 * (high - low), unit.to_string())))
    }
}

impl StatedSpread {
    /// The number's text with this uncertainty behind it; [`StatedSpread::split`] is the inverse.
    pub(super) fn written(&self, plain: &str) -> String {
        let with = |amount: f64, unit: &str| if unit == "1" { format!("{amount:?}") } else { format!("{amount:?} {unit}") };
        match (self, units::quantity(plain)) {
            (Self::Share(share), _) => format!("{plain} +- {:?} %", 100.0 * share),
            (Self::Limits(half, unit), Some((middle, _, _))) => format!("{:?} .. {}", middle - half, with(middle + half, unit)),
            (Self::Deviation(amount, unit) | Self::Limits(amount, unit), _) => format!("{plain} +- {}", with(*amount, unit)),
        }
    }
}

/// A number of a file that is uncertain.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    /// Dotted key of the number, as for [`super::Document::apply_set`].
    pub key: String,
    /// Uncertainty of the number.
    pub spread: StatedSpread,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_what_is_uncertain_of_them() {
        let unit = || "W/(m2 K)".to_string();
        let deviation = |plain: &str, d: f64, unit: &str| Some((plain.to_string(), StatedSpread::Deviation(d, unit.to_string())));
        assert_eq!(StatedSpread::split("560 +- 40 W/(m2 K)"), deviation("560 W/(m2 K)", 40.0, &unit()));
        assert_eq!(StatedSpread::split("560 W/(m2 K) ± 40 W/(m2 K)"), deviation("560 W/(m2 K)", 40.0, &unit()));
        assert_eq!(StatedSpread::split("20 degC +- 0.3 K"), deviation("20 degC", 0.3, "K"));
        for text in ["560 W/(m2 K) +- 40.0 W/(m2 K)", "0.55 +- 10.0 %", "20 degC +- 0.3 K", "500.0 .. 620.0 W/(m2 K)", "0.5 .. 0.6"] {
            let (plain, spread) = StatedSpread::split(text).unwrap();
            assert_eq!(StatedSpread::split(&spread.written(&plain)).map(|(plain, _)| plain), Some(plain.clone()), "{text}");
        }
        assert_eq!(StatedSpread::Share(0.1).written("0.55"), "0.55 +- 10.0 %");
        assert_eq!(StatedSpread::split("0.55 +- 0.1"), deviation("0.55", 0.1, "1"));
        assert_eq!(StatedSpread::split("0.55 +- 10 %"), Some(("0.55".into(), StatedSpread::Share(0.1))));
        assert_eq!(StatedSpread::split("560 W/(m2 K) +- 7%"), Some(("560 W/(m2 K)".into(), StatedSpread::Share(0.07))));
        assert_eq!(StatedSpread::split("500 .. 620 W/(m2 K)"), Some(("560.0 W/(m2 K)".into(), StatedSpread::Limits(60.0, unit()))));
        for no in ["560 W/(m2 K)", "560 +- forty W", "motor +- 2", "620 .. 500 W", "560 W +- 3 K", "0.1 * speed +- 3"] {
            assert_eq!(StatedSpread::split(no), None, "{no}");
        }
    }
}
