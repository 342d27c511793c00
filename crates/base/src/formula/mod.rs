//! Numbers of a machine that depend on the condition: constants, variables, expressions.
//!
//! A slot of the machine file (a power, a temperature, a flow) holds one of
//!
//! * a constant with its unit, `"20.5 degC"`;
//! * the bare name of a condition variable of the right dimension, `"ambient_temperature"`;
//! * an expression of plain numbers, `"0.0453 * motor_speed_rpm + 2"`. Its names say their unit, its result is in the
//!   slot's own unit ([`slot_unit`]), or in a unit that is given with the expression.
//!
//! ```
//! use coldplate_base::error::Location;
//! use coldplate_base::formula::{Formula, FormulaNames, FormulaValues};
//! use coldplate_base::units::Dimension;
//! let mut names = FormulaNames::default();
//! names.add("motor_speed_rpm").unwrap();
//! let power = Formula::parse("0.0453 * motor_speed_rpm + 2", Dimension::POWER, None, &names, Location::default()).unwrap();
//! assert!((power.evaluate(&FormulaValues(vec![2500.0])).unwrap() - 115.25).abs() < 1e-12);
//! assert_eq!(power.derivative(&FormulaValues(vec![2500.0]), &FormulaValues(vec![1.0])).unwrap(), 0.0453);
//! ```
//!
//! Temperatures of parts are no names here: a source that depends on them would make the formulas part of Newton's
//! iteration. A later version could add such a name, whose value changes from step to step.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::{Error, Location, Result};
use crate::units::{self, Dimension, ZERO_CELSIUS};

mod enclosure;
mod program;
mod table;

pub use enclosure::{Enclosure, Interval};
use program::Op;

/// The names formulas may use, each with its slot in [`FormulaValues`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FormulaNames {
    /// Slot names in order, the bare names of condition variables (in SI) included.
    names: Vec<String>,
    by_name: BTreeMap<String, usize>,
    /// Dimensions of the bare condition variables.
    bare: BTreeMap<String, Dimension>,
}

impl FormulaNames {
    /// Adds a name for expressions and returns its slot.
    ///
    /// # Errors
    /// The name is no identifier, is a function's name, or exists already.
    pub fn add(&mut self, name: &str) -> Result<usize> {
        let mut chars = name.chars();
        let identifier = chars.next().is_some_and(|c| c.is_alphabetic() || c == '_') && chars.all(|c| c.is_alphanumeric() || c == '_');
        if !identifier {
            return Err(Error::input(format!("'{name}' cannot be used in formulas")).help("use letters, digits and _, not a digit first"));
        }
        if name == "pi" || program::FUNCTIONS.contains(&name) {
            return Err(Error::input(format!("'{name}' is the name of a function or constant")).help("choose another name"));
        }
        if self.by_name.contains_key(name) {
            return Err(Error::input(format!("the name '{name}' is there already")).help("choose another name"));
        }
        self.names.push(name.to_string());
        self.by_name.insert(name.to_string(), self.names.len() - 1);
        Ok(self.names.len() - 1)
    }

    /// Adds a condition variable under its bare name, with its value in SI, and returns its slot. Expressions see the
    /// bare name only if the variable is a pure number.
    ///
    /// # Errors
    /// Errors of [`FormulaNames::add`].
    pub fn add_bare(&mut self, name: &str, dimension: Dimension) -> Result<usize> {
        let slot = self.add(name)?;
        self.bare.insert(name.to_string(), dimension);
        Ok(slot)
    }

    /// The slot of a name.
    pub fn slot(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Number of slots.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether there are no slots.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// The names an expression may use.
    fn in_expressions(&self) -> Vec<&str> {
        let usable = |name: &&str| self.bare.get(*name).is_none_or(|dimension| *dimension == Dimension::NUMBER);
        self.names.iter().map(String::as_str).filter(usable).collect()
    }
}

/// A number for every slot of [`FormulaNames`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FormulaValues(pub Vec<f64>);

/// A number that may depend on the condition. Cheap to clone and to evaluate.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    program: Arc<[Op]>,
    /// SI value = `scale` times the program's value + `offset`.
    scale: f64,
    offset: f64,
    text: Arc<str>,
    place: Arc<Location>,
}

/// The unit an expression's result has in a slot of this dimension.
///
/// Units: degC, rpm, and SI for the rest: W, m3/s, W/(m2 K), W/m2, m/s ...
pub(crate) fn slot_unit(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::TEMPERATURE => "degC",
        Dimension::ANGULAR_SPEED => "rpm",
        Dimension::LENGTH => "m",
        Dimension::AREA => "m2",
        Dimension::TIME => "s",
        Dimension::DIFFERENCE => "K",
        Dimension::VELOCITY => "m/s",
        Dimension::VOLUME_FLOW => "m3/s",
        Dimension::MASS_FLOW => "kg/s",
        Dimension::POWER => "W",
        Dimension::HEAT_FLUX => "W/m2",
        Dimension::POWER_DENSITY => "W/m3",
        Dimension::CONDUCTIVITY => "W/(m K)",
        Dimension::FILM => "W/(m2 K)",
        Dimension::CONDUCTANCE => "W/K",
        Dimension::CAPACITY => "J/K",
        Dimension::PRESSURE => "Pa",
        Dimension::FORCE => "N",
        Dimension::TORQUE => "N m",
        Dimension::MASS => "kg",
        Dimension::INERTIA => "kg m2",
        Dimension::CURRENT => "A",
        Dimension::VOLTAGE => "V",
        Dimension::RESISTANCE => "Ohm",
        _ => "1",
    }
}

/// A unit as part of a name: `L/min` is `L_min`, `W/(m2 K)` is `W_m2_K`, `%` is `percent`.
pub fn suffix(unit: &str) -> String {
    let spelled = unit.replace('%', "percent").replace('°', "deg");
    let parts: Vec<&str> = spelled.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty()).collect();
    parts.join("_")
}

impl Formula {
    /// A formula with one SI value for all conditions.
    pub fn constant(si: f64) -> Self {
        Self {
            program: Arc::new([Op::Number(si)]),
            scale: 1.0,
            offset: 0.0,
            text: Arc::from(si.to_string()),
            place: Arc::new(Location::default()),
        }
    }

    /// Reads the text of a slot of `dimension`. `unit` is the unit of an expression's result if it is not
    /// [`slot_unit`]. Later errors name `place`.
    ///
    /// # Errors
    /// The text is neither a constant with a unit of this dimension, nor a variable of this dimension, nor an
    /// expression of known names. The error does not carry `place`.
    pub fn parse(text: &str, dimension: Dimension, unit: Option<&str>, names: &FormulaNames, place: Location) -> Result<Self> {
        let text = text.trim();
        let formula =
            |program: Vec<Op>, scale, offset| Self { program: program.into(), scale, offset, text: text.into(), place: Arc::new(place) };
        let result_unit = unit.unwrap_or(slot_unit(dimension));
        if unit.is_none() {
            if let Some((slot, found)) = names.slot(text).zip(names.bare.get(text)) {
                if *found != dimension {
                    let help = format!("expected a value such as {}, or a formula in {result_unit}", dimension.example());
                    return Err(Error::input(format!("the variable '{text}' is not of this kind")).help(help));
                }
                return Ok(formula(vec![Op::Slot(slot)], 1.0, 0.0));
            }
            // A text that names a variable is an expression, whatever its first characters are.
            let has_variable = || program::names_in(text).iter().any(|name| names.slot(name).is_some());
            if text.is_empty() || units::is_quantity(text) && !has_variable() {
                let si = units::parse(text, dimension)?;
                if !si.is_finite() {
                    return Err(Error::input("the number is too large"));
                }
                return Ok(formula(vec![Op::Number(si)], 1.0, 0.0));
            }
        }
        let one = units::convert(1.0, result_unit, dimension)?;
        let (scale, offset) = match (dimension == Dimension::TEMPERATURE, result_unit.trim()) {
            (true, "K") => (1.0, 0.0),
            (true, _) => (1.0, ZERO_CELSIUS),
            _ => (one, 0.0),
        };
        let known = names.in_expressions();
        let slot = |name: &str| names.slot(name).filter(|_| known.contains(&name));
        let program = program::compile(text, &known, &slot).map_err(|error| match names_with_unit(&error, text, names) {
            Some(better) => better,
            None => error,
        })?;
        Ok(formula(program, scale, offset))
    }

    /// The SI value at the condition of `values`.
    ///
    /// # Errors
    /// The value is not finite; the error names the formula and its place.
    pub fn evaluate(&self, values: &FormulaValues) -> Result<f64> {
        let value = if let [Op::Number(number)] = *self.program { number } else { program::run(&self.program, &values.0, None).0 };
        self.finite(self.scale * value + self.offset, "value")
    }

    /// Derivative of the SI value along `tangent`, the derivatives of all names (see `Machine::tangent`).
    ///
    /// At a kink of `min` or `max` the result is one of the one-sided derivatives, at the kink of `abs` zero.
    ///
    /// # Errors
    /// The derivative is not finite.
    pub fn derivative(&self, values: &FormulaValues, tangent: &FormulaValues) -> Result<f64> {
        self.finite(self.scale * program::run(&self.program, &values.0, Some(&tangent.0)).1, "derivative")
    }

    /// Bounds on the SI value over a stretch of time over which every name has its own.
    pub fn enclosure(&self, names: &[Enclosure]) -> Enclosure {
        match self.as_constant() {
            Some(value) => Enclosure::constant(value),
            None => enclosure::run(&self.program, names).scaled(self.scale, self.offset),
        }
    }

    /// The SI value, if it is equal at all conditions.
    pub fn as_constant(&self) -> Option<f64> {
        if let [Op::Number(number)] = *self.program { Some(self.scale * number + self.offset) } else { None }
    }

    /// The text as written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The slots of [`FormulaNames`] that the formula depends on.
    pub fn slots(&self) -> impl Iterator<Item = usize> + '_ {
        self.program.iter().filter_map(|op| if let Op::Slot(slot) = op { Some(*slot) } else { None })
    }

    fn finite(&self, number: f64, what: &str) -> Result<f64> {
        if number.is_finite() {
            return Ok(number);
        }
        let error = Error::input(format!("the {what} of this formula is not finite at this condition"))
            .read(&self.text)
            .help("look for a division by zero, or a root, logarithm or power of a negative number");
        Err(self.place(error))
    }

    /// Gives an error about the value of the formula the formula's place.
    pub fn place(&self, mut error: Error) -> Error {
        if let Some(file) = &self.place.file {
            error = error.in_file(file);
        }
        if let Some(line) = self.place.line {
            error = error.at_line(line);
        }
        if let Some(key) = &self.place.key {
            error = error.at_key(key);
        }
        error
    }
}

/// A better error for a condition variable used in an expression without its unit.
fn names_with_unit(error: &Error, text: &str, names: &FormulaNames) -> Option<Error> {
    let used = program::names_in(text);
    let name = used.into_iter().find(|name| names.bare.contains_key(*name) && error.what().contains(&format!("'{name}'")))?;
    let with_unit: Vec<&str> = names.in_expressions().into_iter().filter(|n| n.starts_with(&format!("{name}_"))).collect();
    Some(Error::input(format!("in an expression, '{name}' needs its unit")).help(format!("write {}", with_unit.join(" or "))))
}
