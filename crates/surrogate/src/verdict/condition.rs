//! From names and values with units to the numbers a surrogate takes.
//!
//! A condition is one value per variable of the surrogate, in its order, and behind them one per variable that was held.
//! Held variables may be left out: their value is then the one at which the surrogate was made.

use coldplate_runtime::{Held, Surrogate, Variable};

use crate::fit::model::DEFAULT;
use coldplate_base::condition;
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{self, Dimension};

/// A value this close to an end of the range, relative to the numbers involved, counts as that end: "20.5 degC" must
/// not fall outside a range to 20.5 degC because it went through kelvin. Chosen: above the rounding of unit
/// conversions, below any digit a user writes.
const SNAP: f64 = 1e-12;

/// Everything a condition may state: the variables, then the held ones as variables whose range is one value.
pub fn variables<'a>(surrogate: &Surrogate<'a>) -> Vec<Variable<'a>> {
    let held = surrogate.held().map(|Held { name, unit, value }| Variable { name, unit, low: value, high: value });
    surrogate.variables().chain(held).collect()
}

/// The condition that `given`, pairs of name and value with unit, describes.
///
/// # Errors
/// A name the surrogate does not know, one given twice or not at all, a value without its unit or in
/// a unit of another dimension.
pub fn condition(surrogate: &Surrogate<'_>, given: &[(String, String)]) -> Result<Vec<f64>> {
    complete(surrogate, partial(surrogate, given)?)
}

/// Reads `given` like [`condition()`], with `None` for a variable that is not given.
///
/// # Errors
/// Errors of [`condition()`].
pub fn partial(surrogate: &Surrogate<'_>, given: &[(String, String)]) -> Result<Vec<Option<f64>>> {
    let variables = variables(surrogate);
    let mut x = vec![None; variables.len()];
    for (name, text) in given {
        let index = place_of(&variables, name)?;
        if x[index].is_some() {
            return Err(Error::input(format!("'{name}' is given twice")).at_key(name));
        }
        x[index] = Some(value_of(&variables[index], text).map_err(|e| e.at_key(name))?);
    }
    Ok(x)
}

/// The condition, if no variable is missing; held ones take the value they were held at, others the default of the machine file
/// that the surrogate carries.
///
/// # Errors
/// A variable is missing; the error names every one.
pub fn complete(surrogate: &Surrogate<'_>, mut x: Vec<Option<f64>>) -> Result<Vec<f64>> {
    let count = surrogate.variable_count();
    x.resize(count + surrogate.held().count(), None);
    let (varied, held) = x.split_at_mut(count);
    held.iter_mut().zip(surrogate.held()).for_each(|(x, held)| *x = x.or(Some(held.value)));
    for (x, variable) in varied.iter_mut().zip(surrogate.variables()).filter(|(x, _)| x.is_none()) {
        let default = surrogate.provenance().find(|(key, _)| key.strip_prefix(DEFAULT) == Some(variable.name));
        *x = default.map(|(_, text)| value_of(&variable, text)).transpose()?;
    }
    let missing: Vec<Variable<'_>> = varied.iter().zip(surrogate.variables()).filter(|(x, _)| x.is_none()).map(|(_, v)| v).collect();
    if !missing.is_empty() {
        let names: Vec<String> = missing.iter().map(|v| format!("'{}'", v.name)).collect();
        let (verb, keys): (_, Vec<&str>) = (if names.len() == 1 { "is" } else { "are" }, missing.iter().map(|v| v.name).collect());
        let fitted: Vec<String> = missing.iter().map(|v| format!("{} from {} to {} {}", v.name, v.low, v.high, v.unit)).collect();
        return Err(Error::input(format!("{} {verb} missing", names.join(", ")))
            .at_key(keys.join(", "))
            .help(format!("this surrogate asks for it, in its unit or one like it; it was fitted with {}", fitted.join(", "))));
    }
    Ok(x.into_iter().flatten().collect())
}

/// The values of the varied variables alone, for figures, which show nothing else. Values stated for held variables
/// must be the ones they were held at.
///
/// # Errors
/// A held variable has another value.
pub fn varied(surrogate: &Surrogate<'_>, mut x: Vec<Option<f64>>) -> Result<Vec<Option<f64>>> {
    let stated = x.split_off(surrogate.variable_count().min(x.len()));
    match surrogate.held().zip(stated).find(|(held, x)| x.is_some_and(|x| x != held.value)) {
        Some((Held { name, unit, value }, x)) => {
            Err(Error::input(format!("'{name}' was held at {value} {unit} when the surrogate was made, and says nothing elsewhere"))
                .at_key(name)
                .read(format!("{} {unit}", x.unwrap_or(f64::NAN)))
                .help("leave it out, or sweep over it"))
        }
        None => Ok(x),
    }
}

/// Index in [`variables`] of the one called `name`; hyphens may stand for underscores.
///
/// # Errors
/// No variable has this name; the error lists the variables and the one that was probably meant.
pub fn index_of(surrogate: &Surrogate<'_>, name: &str) -> Result<usize> {
    place_of(&variables(surrogate), name)
}

fn place_of(variables: &[Variable<'_>], name: &str) -> Result<usize> {
    let plain = name.trim().replace('-', "_");
    variables.iter().position(|v| v.name == name.trim() || v.name == plain).ok_or_else(|| {
        let known: Vec<&str> = variables.iter().map(|v| v.name).collect();
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

/// A value in SI, in the unit of the variable.
///
/// # Errors
/// A unit that is none of `dimension`.
pub fn of_si(variable: &Variable<'_>, si: f64, dimension: Dimension) -> Result<f64> {
    Ok(snap(variable, units::express(si, variable.unit, dimension)?))
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

/// Dimension of a variable: that of the four common ones by name, others by their unit.
///
/// # Errors
/// The surrogate gives the variable a unit that is unknown here.
pub fn dimension_of(variable: &Variable<'_>) -> Result<Dimension> {
    let usual = condition::VARIABLES.iter().find(|usual| usual.name == variable.name).map(|usual| usual.dimension);
    let named = usual.or_else(|| variable.name.contains("temperature").then_some(Dimension::TEMPERATURE));
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
