//! From names and values with units to the numbers a surrogate takes.

use coldplate_runtime::{Surrogate, Variable};

use crate::error::{Error, Result, did_you_mean};
use crate::units::{self, Dimension};

/// A value this close to an end of the range, relative to the numbers involved, counts as that end:
/// "20.5 degC" must not fall outside a range to 20.5 degC because it went through kelvin.
const SNAP: f64 = 1e-12;

/// The condition that `given`, pairs of name and value with unit, describes.
///
/// # Errors
/// A name the surrogate does not know, one given twice or not at all, a value without its unit or in
/// a unit of another dimension.
pub fn condition(surrogate: &Surrogate<'_>, given: &[(String, String)]) -> Result<Vec<f64>> {
    complete(surrogate, partial(surrogate, given)?)
}

/// As [`condition`], with `None` for what is not given.
///
/// # Errors
/// As [`condition`].
pub fn partial(surrogate: &Surrogate<'_>, given: &[(String, String)]) -> Result<Vec<Option<f64>>> {
    let mut x = vec![None; surrogate.variable_count()];
    for (name, text) in given {
        let index = index_of(surrogate, name)?;
        let Some(variable) = surrogate.variable(index) else { continue };
        if x[index].is_some() {
            return Err(Error::input(format!("'{name}' is given twice")).at_key(name));
        }
        x[index] = Some(value_of(&variable, text).map_err(|e| e.at_key(name))?);
    }
    Ok(x)
}

/// The condition, if no variable is missing.
///
/// # Errors
/// Names the first missing variable.
pub fn complete(surrogate: &Surrogate<'_>, x: Vec<Option<f64>>) -> Result<Vec<f64>> {
    let values = x.into_iter().zip(surrogate.variables()).map(|(x, variable)| {
        x.ok_or_else(|| {
            let Variable { name, unit, low, high } = variable;
            Error::input(format!("'{name}' is missing"))
                .at_key(name)
                .help(format!("this surrogate asks for it, in {unit} or a unit like it; it was fitted from {low} to {high} {unit}"))
        })
    });
    values.collect()
}

/// Index of the variable called `name`; hyphens may stand for underscores.
///
/// # Errors
/// There is none; says which there are and which was probably meant.
pub fn index_of(surrogate: &Surrogate<'_>, name: &str) -> Result<usize> {
    let plain = name.trim().replace('-', "_");
    surrogate.variables().position(|v| v.name == name.trim() || v.name == plain).ok_or_else(|| {
        let known: Vec<&str> = surrogate.variables().map(|v| v.name).collect();
        let error = Error::input(format!("this surrogate has no variable '{name}'")).at_key(name);
        match did_you_mean(&plain, known.iter().copied()) {
            Some(meant) => error.help(format!("did you mean '{meant}'? Its variables are: {}", known.join(", "))),
            None => error.help(format!("its variables are: {}", known.join(", "))),
        }
    })
}

/// A value with its unit, in the unit of the variable.
///
/// # Errors
/// No unit, or a unit of another dimension.
pub fn value_of(variable: &Variable<'_>, text: &str) -> Result<f64> {
    let dimension = dimension_of(variable)?;
    Ok(snap(variable, units::express(units::parse(text, dimension)?, variable.unit, dimension)?))
}

/// A number whose unit stands in a column header, in the unit of the variable.
///
/// # Errors
/// A unit of another dimension, or a number that is not finite.
pub fn number_in(variable: &Variable<'_>, number: f64, unit: &str) -> Result<f64> {
    if !number.is_finite() {
        return Err(Error::input("the number is not finite").read(number));
    }
    if unit == variable.unit {
        return Ok(number);
    }
    let dimension = dimension_of(variable)?;
    Ok(snap(variable, units::express(units::convert(number, unit, dimension)?, variable.unit, dimension)?))
}

/// What kind of quantity a variable is: the four common ones by name, others by their unit.
///
/// # Errors
/// The surrogate gives the variable a unit that is unknown here.
pub fn dimension_of(variable: &Variable<'_>) -> Result<Dimension> {
    let named = match variable.name {
        "coolant_flow" => Some(Dimension::VOLUME_FLOW),
        "coolant_temperature" | "ambient_temperature" => Some(Dimension::TEMPERATURE),
        "motor_speed" => Some(Dimension::ANGULAR_SPEED),
        name if name.contains("temperature") => Some(Dimension::TEMPERATURE),
        _ => None,
    };
    match named.filter(|d| units::convert(1.0, variable.unit, *d).is_ok()) {
        Some(dimension) => Ok(dimension),
        None => units::dimension_of(variable.unit).map_err(|e| e.at_key(variable.name)),
    }
}

fn snap(variable: &Variable<'_>, value: f64) -> f64 {
    // Through kelvin, a small Celsius temperature carries the rounding of 273.15.
    let size =
        variable.low.abs().max(variable.high.abs()).max(if matches!(variable.unit, "degC" | "°C") { units::ZERO_CELSIUS } else { 0.0 });
    [variable.low, variable.high].into_iter().find(|end| (value - end).abs() <= SNAP * size).unwrap_or(value)
}
