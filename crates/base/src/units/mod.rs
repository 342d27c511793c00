//! The program computes in SI; in files, values carry their unit. Celsius and Kelvin are different types.
//!
//! ```
//! use coldplate_base::units::{parse, Dimension};
//! assert_eq!(parse("9.42 L/min", Dimension::VOLUME_FLOW).unwrap(), 9.42e-3 / 60.0);
//! assert_eq!(parse("20.5 degC", Dimension::TEMPERATURE).unwrap(), 293.65); // kelvin
//! assert!(parse("20.5", Dimension::TEMPERATURE).is_err()); // a bare number is refused
//! ```

mod known;
mod readings;
mod scale;
mod symbols;

use std::fmt;

use crate::error::{Error, Result, did_you_mean};
pub use known::{KnownQuantity, KnownUnit, quantities, si_unit, symbols};
pub use readings::Measurand;
pub use scale::{Celsius, Kelvin, ZERO_CELSIUS};
use symbols::{MISTAKEN, UNITS, plain};

/// Degrees Celsius of a temperature in kelvin, for display.
pub fn celsius(kelvin: f64) -> f64 {
    kelvin - ZERO_CELSIUS
}

impl fmt::Display for Celsius {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} degC", self.0)
    }
}

/// Exponents of metre, kilogram, second, kelvin and ampere, and whether an absolute temperature is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dimension {
    m: i8,
    kg: i8,
    s: i8,
    k: i8,
    a: i8,
    absolute: bool,
}

impl Dimension {
    const fn of(m: i8, kg: i8, s: i8, k: i8) -> Self {
        Self { m, kg, s, k, a: 0, absolute: false }
    }
    /// A pure number.
    pub const NUMBER: Self = Self::of(0, 0, 0, 0);
    /// m
    pub const LENGTH: Self = Self::of(1, 0, 0, 0);
    /// m²
    pub const AREA: Self = Self::of(2, 0, 0, 0);
    /// m³
    pub const VOLUME: Self = Self::of(3, 0, 0, 0);
    /// kg
    pub const MASS: Self = Self::of(0, 1, 0, 0);
    /// s
    pub const TIME: Self = Self::of(0, 0, 1, 0);
    /// Absolute temperature, stored in kelvin.
    pub const TEMPERATURE: Self = Self { m: 0, kg: 0, s: 0, k: 1, a: 0, absolute: true };
    /// Temperature difference, K.
    pub const DIFFERENCE: Self = Self::of(0, 0, 0, 1);
    /// 1/K
    pub const PER_KELVIN: Self = Self::of(0, 0, 0, -1);
    /// m/s
    pub const VELOCITY: Self = Self::of(1, 0, -1, 0);
    /// Angular speed, rad/s (`rpm` is accepted).
    pub const ANGULAR_SPEED: Self = Self::of(0, 0, -1, 0);
    /// m³/s
    pub const VOLUME_FLOW: Self = Self::of(3, 0, -1, 0);
    /// kg/s
    pub const MASS_FLOW: Self = Self::of(0, 1, -1, 0);
    /// W
    pub const POWER: Self = Self::of(2, 1, -3, 0);
    /// W/m²
    pub const HEAT_FLUX: Self = Self::of(0, 1, -3, 0);
    /// W/m³
    pub const POWER_DENSITY: Self = Self::of(-1, 1, -3, 0);
    /// W/(m K)
    pub const CONDUCTIVITY: Self = Self::of(1, 1, -3, -1);
    /// W/(m² K)
    pub const FILM: Self = Self::of(0, 1, -3, -1);
    /// m² K/W
    pub const AREA_RESISTANCE: Self = Self::of(0, -1, 3, 1);
    /// W/K
    pub const CONDUCTANCE: Self = Self::of(2, 1, -3, -1);
    /// kg/m³
    pub const DENSITY: Self = Self::of(-3, 1, 0, 0);
    /// J/(kg K)
    pub const SPECIFIC_HEAT: Self = Self::of(2, 0, -2, -1);
    /// J/K
    pub const CAPACITY: Self = Self::of(2, 1, -2, -1);
    /// Pa
    pub const PRESSURE: Self = Self::of(-1, 1, -2, 0);
    /// Stiffness per area, N/m³
    pub const BEDDING: Self = Self::of(-2, 1, -2, 0);
    /// N
    pub const FORCE: Self = Self::of(1, 1, -2, 0);
    /// N m
    pub const TORQUE: Self = Self::of(2, 1, -2, 0);
    /// kg m²
    pub const INERTIA: Self = Self::of(2, 1, 0, 0);
    /// Angle in rad (`deg` is accepted); a pure number dimensionally.
    pub const ANGLE: Self = Self::NUMBER;
    /// Pa s
    pub const VISCOSITY: Self = Self::of(-1, 1, -1, 0);
    /// A
    pub const CURRENT: Self = Self { m: 0, kg: 0, s: 0, k: 0, a: 1, absolute: false };
    /// V
    pub const VOLTAGE: Self = Self { m: 2, kg: 1, s: -3, k: 0, a: -1, absolute: false };
    /// Ω
    pub const RESISTANCE: Self = Self { m: 2, kg: 1, s: -3, k: 0, a: -2, absolute: false };

    /// Whether the dimension is an absolute temperature, whose zero depends on the scale.
    pub const fn is_absolute(self) -> bool {
        self.absolute
    }

    /// The dimension of a difference of two values of this dimension: a difference in kelvin for absolute temperatures.
    pub const fn of_differences(self) -> Self {
        Self { absolute: false, ..self }
    }

    /// The expected unit of a value of this dimension, with an example.
    pub fn example(self) -> &'static str {
        match self {
            Self::LENGTH => "\"0.25 m\" or \"250 mm\"",
            Self::AREA => "\"0.0143 m2\" or \"143 cm2\"",
            Self::VOLUME => "\"0.01 m3\" or \"10 L\"",
            Self::MASS => "\"12 kg\"",
            Self::TIME => "\"5 min\" or \"300 s\"",
            Self::TEMPERATURE => "\"20.5 degC\" or \"293.65 K\"",
            Self::DIFFERENCE => "\"0.5 K\"",
            Self::VELOCITY => "\"100 mm/s\"",
            Self::ANGULAR_SPEED => "\"2500 rpm\"",
            Self::VOLUME_FLOW => "\"9.42 L/min\" or \"1.57e-4 m3/s\"",
            Self::MASS_FLOW => "\"0.16 kg/s\"",
            Self::POWER => "\"113.7 W\"",
            Self::HEAT_FLUX => "\"2645 W/m2\"",
            Self::POWER_DENSITY => "\"2e5 W/m3\"",
            Self::CONDUCTIVITY => "\"16.3 W/(m K)\"",
            Self::FILM => "\"560 W/(m2 K)\"",
            Self::CONDUCTANCE => "\"7.3 W/K\"",
            Self::DENSITY => "\"7900 kg/m3\"",
            Self::SPECIFIC_HEAT => "\"500 J/(kg K)\"",
            Self::CAPACITY => "\"4000 J/K\"",
            Self::PRESSURE => "\"1e-3 Pa\" or \"0.2 MPa\"",
            Self::BEDDING => "\"1e12 N/m3\"",
            Self::FORCE => "\"3 kN\"",
            Self::TORQUE => "\"4 N m\"",
            Self::INERTIA => "\"1e-4 kg m2\"",
            Self::VISCOSITY => "\"0.89 mPa s\"",
            Self::CURRENT => "\"12 A\"",
            Self::VOLTAGE => "\"24 V\"",
            Self::RESISTANCE => "\"0.35 Ohm\"",
            _ => "\"0.5\"",
        }
    }
}

/// Zero of the scale of a temperature unit, K; `None` for a unit whose zero is absolute.
fn zero_of_scale(unit_text: &str) -> Option<f64> {
    match plain(unit_text).as_ref() {
        "degC" | "°C" => Some(ZERO_CELSIUS),
        "degF" | "°F" => Some(ZERO_CELSIUS - 32.0 * 5.0 / 9.0),
        _ => None,
    }
}

/// Factor and dimension of a unit expression such as `W/(m2 K)`, `J/kg/K`, `m^3/s`, `kg m2`.
fn unit(text: &str) -> Result<(f64, Dimension)> {
    let (mut factor, mut dim) = (1.0, Dimension::NUMBER);
    let mut sign = 1i8; // -1 behind a slash
    let mut in_group = false;
    let text = plain(text);
    let mut rest = text.as_ref();
    while let Some(c) = rest.chars().next() {
        match c {
            ' ' | '*' | '·' | '.' => {
                rest = &rest[c.len_utf8()..];
                continue;
            }
            '/' => {
                sign = -1;
                rest = &rest[1..];
                continue;
            }
            '(' => {
                in_group = true;
                rest = &rest[1..];
                continue;
            }
            ')' => {
                (in_group, sign) = (false, 1);
                rest = &rest[1..];
                continue;
            }
            _ => {}
        }
        let end = rest
            .char_indices()
            .find(|(i, c)| !(c.is_alphabetic() || *c == '°' || *c == '%' || (*i == 0 && *c == '1')))
            .map_or(rest.len(), |(i, _)| i);
        let symbol = &rest[..end];
        if symbol == "1" && rest[end..].starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            let number: String = rest.chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
            return Err(
                Error::input(format!("the number {number} has no place in a unit")).help("write the values in a unit without a factor")
            );
        }
        let Some((_, f, d)) = UNITS.iter().find(|(name, ..)| *name == symbol) else {
            let known: Vec<&str> = UNITS.iter().map(|(name, ..)| *name).collect();
            let error = Error::input(match rest.chars().next().filter(|_| symbol.is_empty()) {
                Some(c) => format!("'{c}' has no place in a unit"),
                None => format!("unknown unit '{symbol}'"),
            });
            if let Some((_, meant)) = MISTAKEN.iter().find(|(wrong, _)| *wrong == symbol) {
                return Err(error.help(format!("write {meant}")));
            }
            return Err(match did_you_mean(symbol, known.iter().copied()) {
                Some(meant) => error.help(format!("did you mean '{meant}'?")),
                None => error.help(format!("units known here: {}", known.join(" "))),
            });
        };
        rest = &rest[end..];
        let digits = rest.trim_start_matches('^');
        let n = digits.char_indices().take_while(|(i, c)| c.is_ascii_digit() || (*i == 0 && *c == '-')).count();
        let power: i8 = if n == 0 {
            match digits.chars().next() {
                Some('²') => 2,
                Some('³') => 3,
                _ => 1,
            }
        } else {
            digits[..n].parse().map_err(|_| Error::input(format!("unreadable exponent in the unit '{text}'")))?
        };
        rest = if n > 0 {
            &digits[n..]
        } else if let Some(c @ ('²' | '³')) = digits.chars().next() {
            &digits[c.len_utf8()..]
        } else {
            rest
        };
        let p = power.saturating_mul(sign);
        factor *= f.powi(i32::from(p));
        let add = |a: i8, b: i8| a.saturating_add(b.saturating_mul(p));
        dim = Dimension {
            m: add(dim.m, d.m),
            kg: add(dim.kg, d.kg),
            s: add(dim.s, d.s),
            k: add(dim.k, d.k),
            a: add(dim.a, d.a),
            absolute: false,
        };
        if !in_group {
            sign = 1;
        }
    }
    Ok((factor, dim))
}

/// Reads a value with its unit into SI.
///
/// # Errors
/// A missing or unknown unit, a unit of another dimension, a number that cannot be read or is not finite, a temperature
/// below absolute zero. Each error names the expected unit.
pub fn parse(text: &str, expected: Dimension) -> Result<f64> {
    let text = text.trim();
    let wants = || format!("write the value with its unit, for example {}", expected.example());
    let split = number_length(text);
    let (number, suffix) = text.split_at(split);
    let value: f64 = number.parse().map_err(|_| Error::input("no number can be read here").read(text).help(wants()))?;
    if !value.is_finite() {
        return Err(Error::input("the number is not finite").read(text).help(wants()));
    }
    let suffix = suffix.trim();
    if let Some(c) = suffix.chars().next().filter(|_| !is_quantity(text)) {
        let place = text.chars().count() - suffix.chars().count() + 1;
        return Err(Error::input(format!("'{c}' (character {place}) has no place in a number with its unit")).read(text).help(wants()));
    }
    if suffix.is_empty() && expected != Dimension::NUMBER {
        return Err(Error::input("a bare number, without its unit").read(text).help(wants()));
    }
    convert(value, suffix, expected).map_err(|e| e.read(text).help(wants()))
}

/// Length in bytes of the number at the start of `text`, `e` exponents included.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut i = 0;
    while i < bytes.len() {
        let part_of_number = match bytes[i] {
            b'0'..=b'9' | b'.' => true,
            b'+' | b'-' => i == 0 || matches!(bytes[i - 1], b'e' | b'E'),
            b'e' | b'E' => {
                i > 0
                    && bytes.get(i + 1).is_some_and(|next| {
                        next.is_ascii_digit() || (matches!(next, b'+' | b'-') && bytes.get(i + 2).is_some_and(u8::is_ascii_digit))
                    })
            }
            _ => false,
        };
        if !part_of_number {
            break;
        }
        i += 1;
    }
    i
}

/// Converts a number given in `unit_text` into SI, checking the dimension.
///
/// # Errors
/// Errors of [`parse`].
pub fn convert(value: f64, unit_text: &str, expected: Dimension) -> Result<f64> {
    let factor = factor(unit_text, expected)?;
    let zero = zero_of_scale(unit_text);
    if !expected.absolute {
        if zero.is_some() {
            return Err(Error::input(format!("'{unit_text}' is a temperature, and a difference of temperatures is meant here"))
                .help("write the difference in K"));
        }
        return Ok(value * factor);
    }
    if zero.is_none() && ["degC", "°C", "degF", "°F"].iter().any(|scale| plain(unit_text).contains(scale)) {
        return Err(Error::input(format!("'{unit_text}' is no unit of a temperature")).help("write degC, degF or K alone"));
    }
    let kelvin = match zero {
        Some(zero) => value * factor + zero,
        None => value * factor,
    };
    if kelvin < 0.0 {
        return Err(Error::input("a temperature below absolute zero"));
    }
    Ok(kelvin)
}

/// Factor to SI of a unit of the dimension `expected`.
fn factor(unit_text: &str, expected: Dimension) -> Result<f64> {
    let (factor, found) = unit(unit_text)?;
    let wanted = Dimension { absolute: false, ..expected };
    if found == wanted {
        return Ok(factor);
    }
    let error = Error::input(format!("'{unit_text}' is not the unit of this quantity"));
    // `W/m2 K` would multiply by K: a unit with several factors behind the slash needs brackets.
    if let Some((above, below)) = unit_text.split_once('/').filter(|(_, below)| !below.contains(['(', '/'])) {
        let bracketed = format!("{above}/({})", spaced(below));
        if unit(&bracketed).is_ok_and(|(_, found)| found == wanted) {
            return Err(error.help(format!("write {bracketed}: only the factor right behind a slash divides")));
        }
    }
    Err(error.help(format!("expected for example {}", expected.example())))
}

/// Factors of a unit set apart: `m²K` to `m2 K`.
fn spaced(text: &str) -> String {
    let mut out = String::new();
    let mut after_power = false;
    for c in text.trim().chars() {
        if after_power && c.is_alphabetic() {
            out.push(' ');
        }
        after_power = matches!(c, '²' | '³') || c.is_ascii_digit();
        out.push(match c {
            '²' => '2',
            '³' => '3',
            c => c,
        });
    }
    out
}

/// Whether `text` is meant as a number with a unit: a number, then nothing or the first letter or sign of a unit. Every
/// other text is an expression: `2 * pi`, `100 / 4`, `-(1 + x)`.
pub(crate) fn is_quantity(text: &str) -> bool {
    let text = text.trim();
    let (number, suffix) = text.split_at(number_length(text));
    let is_unit = |c: char| c.is_alphabetic() || matches!(c, '°' | '%' | '1');
    number.parse::<f64>().is_ok() && suffix.trim().chars().next().is_none_or(is_unit)
}

/// The dimension of a unit as it stands in a header: `degC` means an absolute temperature, `K` a difference.
///
/// # Errors
/// An unknown unit.
pub fn dimension_of(unit_text: &str) -> Result<Dimension> {
    let (_, dimension) = unit(unit_text)?;
    Ok(if zero_of_scale(unit_text).is_some() { Dimension::TEMPERATURE } else { dimension })
}

/// A unit as loggers and spreadsheets spell it, in the spelling of the files: `Deg C` and `C` are `degC`; `None` if it is none.
///
/// ```
/// # use coldplate_base::units::spelled;
/// assert_eq!(spelled("Deg. C").as_deref(), Some("degC"));
/// assert_eq!(spelled("LPM").as_deref(), Some("L/min"));
/// assert_eq!(spelled("RN"), None);
/// ```
pub fn spelled(text: &str) -> Option<String> {
    let text = plain(text);
    if text.is_empty() {
        return None;
    }
    if unit(&text).is_ok() {
        return Some(text.into_owned());
    }
    if let Some((_, meant)) = MISTAKEN.iter().find(|(wrong, meant)| *wrong == text && !meant.contains(" or ")) {
        return Some((*meant).to_string());
    }
    let letters: String = text.chars().filter(|c| c.is_alphabetic()).flat_map(char::to_lowercase).collect();
    let scale = ["degrees", "degree", "deg", "grad"].iter().find_map(|prefix| letters.strip_prefix(prefix))?;
    match scale {
        "c" | "celsius" => Some("degC".into()),
        "f" | "fahrenheit" => Some("degF".into()),
        _ => None,
    }
}

/// A text split into its number, its unit and the dimension of that unit; `None` if the text is no quantity.
///
/// ```
/// # use coldplate_base::units::{Dimension, quantity};
/// assert_eq!(quantity("560 W/(m2 K)"), Some((560.0, "W/(m2 K)", Dimension::FILM)));
/// assert_eq!(quantity("0.0453 * motor_speed_rpm"), None);
/// ```
pub fn quantity(text: &str) -> Option<(f64, &str, Dimension)> {
    let text = text.trim();
    let (number, suffix) = text.split_at(number_length(text));
    let value: f64 = number.parse().ok().filter(|v: &f64| v.is_finite())?;
    let suffix = suffix.trim();
    if suffix.is_empty() {
        return Some((value, "1", Dimension::NUMBER));
    }
    if !is_quantity(text) {
        return None;
    }
    dimension_of(suffix).ok().map(|dimension| (value, suffix, dimension))
}

/// A value in SI, converted to the unit that a reader of the files expects (degC for absolute temperatures).
///
/// # Errors
/// Errors of [`convert`].
pub fn express(si: f64, unit_text: &str, dimension: Dimension) -> Result<f64> {
    let factor = factor(unit_text, dimension)?;
    let zero = zero_of_scale(unit_text).filter(|_| dimension.absolute).unwrap_or(0.0);
    Ok((si - zero) / factor)
}

/// Factor a and offset b with which a value x in one unit is a x + b in another of the same quantity, as in headers: `degC` is an
/// absolute temperature, and `K` beside it too.
///
/// # Errors
/// An unknown unit, or units of different quantities.
///
/// ```
/// # use coldplate_base::units::rescaling;
/// assert_eq!(rescaling("m3/s", "L/min").unwrap(), (60_000.0, 0.0));
/// assert_eq!(rescaling("K", "degC").unwrap(), (1.0, -273.15));
/// assert!(rescaling("W", "degC").is_err());
/// ```
pub fn rescaling(from: &str, to: &str) -> Result<(f64, f64)> {
    let dimension = dimension_of(to)?;
    let (own, other) = (factor(from, dimension)?, factor(to, dimension)?);
    let is_scale = zero_of_scale(from).is_some() || zero_of_scale(to).is_some();
    let zero = |unit: &str| zero_of_scale(unit).unwrap_or(0.0);
    let offset = if is_scale { (zero(from) - zero(to)) / other } else { 0.0 };
    Ok((own / other, offset))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_units_of_the_contract() {
        let ok = |text: &str, dim: Dimension| parse(text, dim).unwrap();
        assert!((ok("9.42 L/min", Dimension::VOLUME_FLOW) - 1.57e-4).abs() < 1e-18);
        assert!((ok("1.57e-4 m3/s", Dimension::VOLUME_FLOW) - 1.57e-4).abs() < 1e-18);
        assert!((ok("20.5 degC", Dimension::TEMPERATURE) - 293.65).abs() < 1e-12);
        assert!((ok("293.65 K", Dimension::TEMPERATURE) - 293.65).abs() < 1e-12);
        assert!((ok("2500 rpm", Dimension::ANGULAR_SPEED) - 261.799_387_799).abs() < 1e-8);
        assert!((ok("100 mm/s", Dimension::VELOCITY) - 0.1).abs() < 1e-15);
        assert!((ok("560 W/(m2 K)", Dimension::FILM) - 560.0).abs() < 1e-12);
        assert!((ok("560 W/m2/K", Dimension::FILM) - 560.0).abs() < 1e-12);
        assert!((ok("560 W/(m²·K)", Dimension::FILM) - 560.0).abs() < 1e-12);
        assert!((ok("3 kN", Dimension::FORCE) - 3000.0).abs() < 1e-12);
        assert!((ok("4 N m", Dimension::TORQUE) - 4.0).abs() < 1e-12);
        assert!((ok("95 %", Dimension::NUMBER) - 0.95).abs() < 1e-15);
        assert!((ok("0.95", Dimension::NUMBER) - 0.95).abs() < 1e-15);
    }

    #[test]
    fn reads_the_units_of_other_countries() {
        let near = |text: &str, dim: Dimension, si: f64| {
            let read = parse(text, dim).unwrap();
            assert!((read - si).abs() <= 1e-12 * si.abs(), "{text}: {read}");
        };
        near("212 degF", Dimension::TEMPERATURE, 373.15);
        near("671.67 degR", Dimension::TEMPERATURE, 373.15);
        near("2 inch", Dimension::LENGTH, 0.0508);
        near("1 gpm", Dimension::VOLUME_FLOW, 6.309_019_64e-5);
        near("14.5 psi", Dimension::PRESSURE, 99_973.980_750_941_23);
        near("10 lbm", Dimension::MASS, 4.535_923_7);
        near("1 V A", Dimension::POWER, 1.0);
        near("2 V/A", Dimension::RESISTANCE, 2.0);
        assert!((express(373.15, "degF", Dimension::TEMPERATURE).unwrap() - 212.0).abs() < 1e-12);
    }

    #[test]
    fn a_number_with_a_unit_is_no_expression() {
        for text in ["2", "-2.5", "20 degC", "95 %", "560 W/(m2 K)", "3 1/K", "1e-3 m"] {
            assert!(is_quantity(text), "{text}");
        }
        for text in ["2 * pi", "100 / 4", "sqrt(4)", "1/0", "2 +", "-(1)", "pi", "2^3", "x"] {
            assert!(!is_quantity(text), "{text}");
        }
    }

    #[test]
    fn refuses_and_says_what_it_expected() {
        for (text, dim, needle) in [
            ("20.5", Dimension::TEMPERATURE, "degC"),
            ("9 bar", Dimension::VOLUME_FLOW, "L/min"),
            ("-300 degC", Dimension::TEMPERATURE, "degC"),
            ("abc", Dimension::LENGTH, "mm"),
            ("1e400 m", Dimension::LENGTH, "finite"),
            ("3 mmm", Dimension::LENGTH, "mm"),
            ("20 degC", Dimension::DIFFERENCE, "in K"),
            ("20 C", Dimension::TEMPERATURE, "write degC"),
            ("560 W/m2 K", Dimension::FILM, "write W/(m2 K)"),
            ("560 W/m²K", Dimension::FILM, "write W/(m2 K)"),
            ("5 mm/10", Dimension::LENGTH, "the number 10 has no place"),
            ("5 degC.", Dimension::TEMPERATURE, "alone"),
            ("5 m#", Dimension::LENGTH, "'#' has no place"),
            ("100 / 4 mm", Dimension::LENGTH, "'/' (character 5)"),
        ] {
            let message = parse(text, dim).unwrap_err().to_string();
            assert!(message.contains(needle), "{text}: {message}");
        }
    }
}
