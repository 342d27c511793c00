//! Variables, definitions and drives: the names that formulas may use.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use super::keys::heat as keys;
use super::symbols::{DRIVE_NAMES, Meaning, Symbols};
use crate::schema::{Key, Unstated};
use coldplate_base::condition::{self, ConditionVariable};
use coldplate_base::document::{Section, Value};
use coldplate_base::error::{Error, Result};
use coldplate_base::formula::{Formula, suffix};
use coldplate_base::numbers::significant;
use coldplate_base::units::{self, Dimension};
use coldplate_physics::drive::Parameters;

/// A condition variable.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribedVariable {
    /// Name, for example `coolant_flow`.
    pub name: String,
    /// Unit in which values are shown, for example `L/min`.
    pub unit: String,
    /// Physical dimension of the variable.
    pub dimension: Dimension,
    /// Default value (SI), if the file states one.
    pub default: Option<f64>,
    /// Range of sensible values (SI), if the file states one.
    pub range: Option<(f64, f64)>,
}

/// A named intermediate formula.
#[derive(Debug, Clone)]
pub struct NamedFormula {
    /// Name under which later formulas use it.
    pub name: String,
    /// Formula of the definition; the value is used without unit conversion.
    pub formula: Formula,
}

/// One feed drive: motor, reducer, screw, rails, bearings (equations 1-5 of the source paper).
#[derive(Debug, Clone)]
pub struct Drive {
    /// Prefix of its quantities in formulas.
    pub name: String,
    /// Motor speed, rad/s.
    pub speed: Formula,
    /// Physical parameters; see [`coldplate_physics::drive`].
    pub parameters: Parameters,
}

/// Dimensions that a variable of the file may have; the unit selects one.
const DIMENSIONS: [Dimension; 29] = [
    Dimension::NUMBER,
    Dimension::LENGTH,
    Dimension::AREA,
    Dimension::VOLUME,
    Dimension::MASS,
    Dimension::TIME,
    Dimension::DIFFERENCE,
    Dimension::VELOCITY,
    Dimension::ANGULAR_SPEED,
    Dimension::VOLUME_FLOW,
    Dimension::MASS_FLOW,
    Dimension::POWER,
    Dimension::HEAT_FLUX,
    Dimension::POWER_DENSITY,
    Dimension::CONDUCTIVITY,
    Dimension::FILM,
    Dimension::CONDUCTANCE,
    Dimension::SPECIFIC_HEAT,
    Dimension::CAPACITY,
    Dimension::PRESSURE,
    Dimension::FORCE,
    Dimension::TORQUE,
    Dimension::INERTIA,
    Dimension::DENSITY,
    Dimension::VISCOSITY,
    Dimension::PER_KELVIN,
    Dimension::CURRENT,
    Dimension::VOLTAGE,
    Dimension::RESISTANCE,
];

/// Reads a formula in a slot of `dimension`: text, a pure number, or `{ formula = "...", unit = "L/min" }`.
///
/// # Errors
/// Errors of [`Formula::parse`], with their place.
pub(super) fn formula(value: &Value<'_>, dimension: Dimension, symbols: &Symbols) -> Result<Formula> {
    let place = value.error("").location().clone();
    if value.is_table() {
        let section = value.section()?;
        let (text, unit) = (section.text("formula")?, section.text("unit")?);
        section.finish()?;
        return symbols.parse(&text, dimension, Some(&unit), place).map_err(|e| value.place(e));
    }
    if value.is_number() {
        return Ok(Formula::constant(value.quantity(dimension)?));
    }
    symbols.parse(&value.text()?, dimension, None, place).map_err(|e| value.place(e))
}

/// Reads the formula under `key`, or its default.
pub(super) fn formula_or(section: &Section<'_>, key: &Key, symbols: &Symbols) -> Result<Formula> {
    match (section.opt(key.name), key.default) {
        (None, Unstated::Text(default)) => {
            let place = section.error_at(key.name, "").location().clone();
            symbols.parse(default, key.dimension(), None, place).map_err(|e| section.error_at(key.name, e.what()))
        }
        _ => formula(&section.value(key.name)?, key.dimension(), symbols),
    }
}

/// Reads `[variables]` and gives the names to `symbols`.
pub(super) fn variables(root: &Section<'_>, symbols: &mut Symbols) -> Result<Vec<DescribedVariable>> {
    let given = root.opt_section("variables")?;
    let mut found = Vec::new();
    for ConditionVariable { name, unit, si_unit, dimension } in condition::VARIABLES {
        let mut variable = DescribedVariable { name: name.into(), unit: unit.into(), dimension, default: None, range: None };
        if let Some(value) = given.as_ref().and_then(|section| section.opt(name)) {
            read_variable(&value, &mut variable)?;
        }
        add_variable(symbols, found.len(), &variable, &[si_unit])?;
        found.push(variable);
    }
    let Some(given) = given else { return Ok(found) };
    for name in given.keys().filter(|name| !condition::NAMES.contains(name)) {
        let value = given.value(name)?;
        let section = own_variable_section(&value)?;
        let unit = section.text("unit")?;
        let dimension = dimension_of(&unit).ok_or_else(|| {
            section
                .error_at("unit", "the unit is not known here")
                .help("for example \"W\", \"degC\", \"m/s\", \"N m\", \"Pa\", \"1\" for a pure number")
        })?;
        let mut variable = DescribedVariable { name: name.into(), unit, dimension, default: None, range: None };
        read_variable(&value, &mut variable)?;
        let more: &[&str] = if dimension == Dimension::TEMPERATURE { &["K"] } else { &[] };
        add_variable(symbols, found.len(), &variable, more).map_err(|e| value.place(e))?;
        found.push(variable);
    }
    given.finish()?;
    Ok(found)
}

fn own_variable_section<'a>(value: &Value<'a>) -> Result<Section<'a>> {
    if value.is_table() {
        return value.section();
    }
    Err(value
        .error("a variable of one's own needs a table")
        .help(format!("write {{ unit = \"W\", default = \"5 W\" }}; if one of the usual was meant: {}", condition::NAMES.join(", "))))
}

/// Dimension of a unit; `degC` is an absolute temperature, `K` a difference.
fn dimension_of(unit: &str) -> Option<Dimension> {
    if matches!(unit, "degC" | "°C") {
        return Some(Dimension::TEMPERATURE);
    }
    DIMENSIONS.into_iter().find(|dimension| units::convert(1.0, unit, *dimension).is_ok_and(|scale| scale.is_finite() && scale > 0.0))
}

/// Reads default and range: a bare value is the default.
fn read_variable(value: &Value<'_>, variable: &mut DescribedVariable) -> Result<()> {
    if !value.is_table() {
        variable.default = Some(value.quantity(variable.dimension)?);
    } else {
        let section = value.section()?;
        if let Some(unit) = section.opt_text("unit")?
            && let Err(error) = scale_of(&unit, variable.dimension).map(|_| variable.unit = unit)
        {
            return Err(section.value("unit")?.place(error));
        }
        variable.default = section.opt_quantity("default", variable.dimension)?;
        variable.range = section.opt_range("range", variable.dimension)?;
        if let (Some(default), Some((low, high))) = (variable.default, variable.range)
            && !(low..=high).contains(&default)
        {
            return Err(section.error_at("default", "the default lies outside the range").help("widen the range or move the default"));
        }
        section.finish()?;
    }
    let lowest = variable.range.map(|range| range.0).into_iter().chain(variable.default).fold(f64::INFINITY, f64::min);
    check_variable(&variable.name, lowest).map_err(|e| value.place(e))
}

fn add_variable(symbols: &mut Symbols, index: usize, variable: &DescribedVariable, more: &[&str]) -> Result<()> {
    symbols.names.add_bare(&variable.name, variable.dimension)?;
    symbols.meanings.push(Meaning::Si(index));
    for unit in std::iter::once(variable.unit.as_str()).chain(more.iter().copied()) {
        let name = format!("{}_{}", variable.name, suffix(unit));
        if suffix(unit).is_empty() || symbols.names.slot(&name).is_some() {
            continue;
        }
        let (scale, offset) = scale_of(unit, variable.dimension)?;
        let slot = symbols.add(&name, Meaning::InUnit { variable: index, scale, offset })?;
        if unit == "K" && variable.dimension == Dimension::TEMPERATURE {
            symbols.kelvins.insert(slot);
        }
    }
    // The standard names, which work whatever unit the file uses for the four variables.
    if let Some(four) = condition::VARIABLES.iter().find(|four| four.name == variable.name && four.unit != variable.unit) {
        let name = format!("{}_{}", variable.name, suffix(four.unit));
        if symbols.names.slot(&name).is_none() {
            let (scale, offset) = scale_of(four.unit, variable.dimension)?;
            symbols.add(&name, Meaning::InUnit { variable: index, scale, offset })?;
        }
    }
    Ok(())
}

impl DescribedVariable {
    /// A value (SI) in the variable's own unit, with `digits` significant digits.
    pub fn with_unit(&self, si: f64, digits: usize) -> String {
        let shown = units::express(si, &self.unit, self.dimension).unwrap_or(si);
        format!("{} {}", significant(shown, digits), self.unit)
    }

    /// Checks that a condition may state this value (SI).
    ///
    /// # Errors
    /// The value is a negative coolant flow.
    pub fn check(&self, si: f64) -> Result<()> {
        check_variable(&self.name, si)
    }

    /// A name under which expressions may use the variable, and the unit its value has there: kelvin for absolute
    /// temperatures, else the unit it is shown in.
    pub fn in_expressions(&self) -> (String, String) {
        let unit = if self.dimension == Dimension::TEMPERATURE { "K" } else { self.unit.as_str() };
        let suffix = suffix(unit);
        // Unit "1" would give a suffix too, but a pure number keeps its own name.
        let name = if self.dimension == Dimension::NUMBER { self.name.clone() } else { format!("{}_{suffix}", self.name) };
        (name, unit.to_string())
    }
}

/// Checks a value against the range of the four variables that always exist.
pub(super) fn check_variable(name: &str, si: f64) -> Result<()> {
    if name == condition::COOLANT_FLOW && si < 0.0 {
        return Err(Error::input("the coolant flow is negative").help("write the amount; the circuit says the direction"));
    }
    Ok(())
}

/// Factor to SI and SI value of zero, for a variable shown in a unit.
pub(super) fn scale_of(unit: &str, dimension: Dimension) -> Result<(f64, f64)> {
    match (dimension == Dimension::TEMPERATURE, unit) {
        (true, "K") => Ok((1.0, 0.0)),
        (true, _) => units::convert(0.0, unit, dimension).map(|_| (1.0, units::ZERO_CELSIUS)),
        _ if dimension == Dimension::ANGULAR_SPEED && unit == "rpm" => Ok((PI / 30.0, 0.0)),
        _ => units::convert(1.0, unit, dimension).map(|scale| (scale, 0.0)),
    }
}

/// Reads `[drive.NAME]` and gives its quantities to `symbols`.
pub(super) fn drives(root: &Section<'_>, symbols: &mut Symbols) -> Result<Vec<Drive>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("drive")? {
        let speed = formula_or(&section, &keys::SPEED, symbols)?;
        found.push((Drive { parameters: parameters(&section)?, name, speed }, section.error("")));
        section.finish()?;
    }
    // Names are added last: a drive's speed cannot depend on a drive.
    for (index, (drive, place)) in found.iter().enumerate() {
        for (quantity, suffix) in DRIVE_NAMES.iter().enumerate() {
            symbols.add(&format!("{}_{suffix}", drive.name), Meaning::Drive(index, quantity)).map_err(|e| at(e, place))?;
        }
    }
    Ok(found.into_iter().map(|(drive, _)| drive).collect())
}

/// Gives an error the place of another error.
fn at(error: Error, place: &Error) -> Error {
    let location = place.location();
    let mut error = error;
    if let Some(file) = &location.file {
        error = error.in_file(file);
    }
    if let Some(line) = location.line {
        error = error.at_line(line);
    }
    if let Some(key) = &location.key {
        error = error.at_key(key);
    }
    error
}

fn parameters(section: &Section<'_>) -> Result<Parameters> {
    let mut p = Parameters::default();
    for (key, target) in keys::PARAMETERS.iter().zip(keys::fields(&mut p)) {
        *target = key.read(section)?;
    }
    if let Some(value) = section.opt(keys::REFERENCE_SPEED.name) {
        let as_printed = value.is_text() && value.text()? == "actual";
        p.reference_speed = if as_printed { None } else { Some(value.quantity(Dimension::ANGULAR_SPEED)?) };
    }
    p.starting_torque = section.opt_quantity(keys::STARTING_TORQUE.name, Dimension::TORQUE)?;
    p.check().map_err(|error| {
        let key = error.location().key.clone().unwrap_or_default();
        section.error_at(&key, error.what()).help(error.remedy().unwrap_or("see docs/reference/machine-file.md"))
    })?;
    Ok(p)
}

/// Reads `[define]`, sorted so that each definition can be evaluated after the ones before it, and gives the names to
/// `symbols`.
pub(super) fn definitions(root: &Section<'_>, symbols: &mut Symbols) -> Result<Vec<NamedFormula>> {
    let Some(section) = root.opt_section("define")? else { return Ok(Vec::new()) };
    let names: Vec<&str> = section.keys().collect();
    let mut slots = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let slot = symbols.add(name, Meaning::Definition(i));
        slots.push(slot.map_err(|e| section.error_at(name, e.what()).help(e.remedy().unwrap_or("choose another name")))?);
    }
    let formulas = names.iter().map(|name| formula(&section.value(name)?, Dimension::NUMBER, symbols)).collect::<Result<Vec<_>>>()?;
    // For each definition: its dependents, and the number of definitions it waits for. Next comes the first of the file
    // that waits for none.
    let of_slot: BTreeMap<usize, usize> = slots.iter().copied().enumerate().map(|(i, slot)| (slot, i)).collect();
    let mut needed_by = vec![Vec::new(); names.len()];
    let mut waits = vec![0_usize; names.len()];
    for (i, formula) in formulas.iter().enumerate() {
        for needed in formula.slots().filter_map(|slot| of_slot.get(&slot)).collect::<BTreeSet<_>>() {
            needed_by[*needed].push(i);
            waits[i] += 1;
        }
    }
    let mut ready: BTreeSet<usize> = (0..names.len()).filter(|i| waits[*i] == 0).collect();
    let mut formulas: Vec<Option<Formula>> = formulas.into_iter().map(Some).collect();
    let mut ordered = Vec::new();
    while let Some(i) = ready.pop_first() {
        for other in &needed_by[i] {
            waits[*other] -= 1;
            if waits[*other] == 0 {
                ready.insert(*other);
            }
        }
        symbols.definition_slots.push(slots[i]);
        ordered.extend(formulas[i].take().map(|formula| NamedFormula { name: names[i].into(), formula }));
    }
    let circle: Vec<&str> = formulas.iter().zip(&names).filter(|(formula, _)| formula.is_some()).map(|(_, name)| *name).collect();
    if !circle.is_empty() {
        return Err(section
            .error_at(circle[0], "these definitions need one another")
            .help(format!("break the circle among: {}", circle.join(", "))));
    }
    section.finish()?;
    Ok(ordered)
}
