//! An interval of a parameter as it is written on the command line, for bounds and for axes of a scan alike.

use coldplate_base::error::{Error, Result};
use coldplate_base::units::{self, Dimension};
use coldplate_solve::study::{MachineParameter, Study};

/// Most values along the axis of a scan, count. Chosen: a guard against mistyped steps.
const MOST_VALUES: f64 = 1e5;

/// `LOW..HIGH`, or `LOW..HIGH/STEP`, in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterRange {
    /// Lower end, SI.
    pub low: f64,
    /// Upper end, SI.
    pub high: f64,
    /// Distance between neighbouring values, SI, if a step is given.
    pub step: Option<f64>,
}

impl ParameterRange {
    /// Reads an interval of `parameter`. Numbers carry their unit, or are in the unit of the machine file.
    ///
    /// # Errors
    /// No interval, a unit of another kind, an end that is not above the start.
    pub fn parse(text: &str, parameter: &MachineParameter) -> Result<Self> {
        let unit = if matches!(parameter.unit.as_str(), "1" | "") { String::new() } else { format!(" {}", parameter.unit) };
        let name = &parameter.name;
        let wrong = |what: &str| {
            let help =
                format!("write {name}=1{unit}..2{unit}, or the bare numbers 1..2 in the file's unit; a scan also takes a step: 1..2/0.1");
            Error::input(what).at_key(name).read(text).help(help)
        };
        let (low, rest) = text.split_once("..").ok_or_else(|| wrong("this is no interval"))?;
        // The last slash that is followed by a number: units hold slashes too.
        let is_step = |i: &usize| rest[i + 1..].trim_start().starts_with(|c: char| c.is_ascii_digit() || c == '.');
        let cut = rest.match_indices('/').map(|(i, _)| i).rfind(is_step);
        let (high, step) = cut.map_or((rest, None), |cut| (&rest[..cut], Some(&rest[cut + 1..])));
        let read = |text: &str, unit: &str, dimension: Dimension| match text.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => units::convert(number, unit, dimension).map_err(|e| e.at_key(name)),
            Ok(_) => Err(wrong("a number is not finite")),
            Err(_) => units::parse(text.trim(), dimension).map_err(|e| e.at_key(name)),
        };
        let of = |text: &str| read(text, &parameter.unit, parameter.dimension);
        // A step of a temperature is a difference.
        let step_of = |text: &str| if parameter.dimension.is_absolute() { read(text, "K", Dimension::DIFFERENCE) } else { of(text) };
        let interval = Self { low: of(low)?, high: of(high)?, step: step.map(step_of).transpose()? };
        if interval.low >= interval.high {
            return Err(wrong("the lower bound comes first"));
        }
        Ok(interval)
    }
}

/// The axis of a scan, `KEY=LOW..HIGH/STEP`: the parameter and its values, SI.
///
/// # Errors
/// Errors of [`ParameterRange::parse`]; no such key, or no step of a size that leads to the end.
pub fn axis(text: &str, study: &Study) -> Result<(MachineParameter, Vec<f64>)> {
    let malformed = || {
        Error::input("this is no axis of a scan").at_key("--scan").read(text).help(
            "write for example \"contact.motor.conductance=0 W/(m2 K)..1000 W/(m2 K)/10 W/(m2 K)\", or the bare numbers 0..1000/10 \
             in the file's unit",
        )
    };
    let (key, range) = text.split_once('=').ok_or_else(malformed)?;
    let parameter = study.parameter(key)?;
    if !range.contains("..") {
        return Err(malformed());
    }
    let ParameterRange { low, high, step } = ParameterRange::parse(range, &parameter)?;
    let step = step.filter(|step| *step > 0.0 && (high - low) / step < MOST_VALUES).ok_or_else(malformed)?;
    let count = ((high - low) / step + 1e-9).floor() as usize;
    Ok((parameter, (0..=count).map(|i| low + i as f64 * step).collect()))
}
