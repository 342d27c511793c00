//! Parameters: a condition variable, or a number of the machine file by its dotted key.

use coldplate_base::document::{Document, Leaf, quoted};
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{self, Dimension};
use coldplate_describe::machine::{Machine, SCHEMA};
use coldplate_describe::schema::{Unstated, ValueForm};

/// Relative step of differences, dimensionless; with four points the error is near the fourth power, 1e-12 of the slope. Chosen: error
/// of the difference against rounding.
const RELATIVE_STEP: f64 = 1e-3;
/// Step from a value of zero, in the unit of the file. Chosen: small against the unit.
const ZERO_STEP: f64 = 1e-4;
/// Step of temperatures, K. Chosen: error of the difference against rounding.
const KELVIN_STEP: f64 = 0.05;

/// Kind of a parameter's value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// A condition variable, SI.
    Condition,
    /// A quantity of the file, SI.
    Quantity,
    /// A factor on a formula, a table or a list; 1 leaves the file's values.
    Factor,
    /// A shift of a formula for a temperature, K; 0 leaves the file's value.
    Offset,
}

/// A parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineParameter {
    /// Variable name or dotted key.
    pub name: String,
    /// Kind of the value.
    pub kind: ParameterKind,
    /// Value that the file (or, for a condition variable, its default; else 0) gives: SI, kelvin; 1 for a factor, 0 for an
    /// offset.
    pub value: f64,
    /// Unit it is shown in: that of the file; `1` for factors, `K` for offsets.
    pub unit: String,
    /// Dimension of that unit.
    pub dimension: Dimension,
    place: ParameterPlace,
}

#[derive(Debug, Clone, PartialEq)]
enum ParameterPlace {
    Variable(usize),
    Key(Leaf),
}

impl MachineParameter {
    /// A parameter by its name; `None` if there is none, without a search for similar names.
    pub fn known(name: &str, document: &Document, machine: &Machine) -> Option<Self> {
        let is_stated = || matches!(document.leaf(name), Ok(Some(_)));
        let has_default = || default_of(&Document::names_in(name).unwrap_or_default(), document).is_some();
        let is_there = machine.variables.iter().any(|v| v.name == name) || is_stated() || has_default();
        if is_there { Self::find(name, document, machine).ok() } else { None }
    }

    /// Finds a parameter by its name.
    ///
    /// # Errors
    /// Neither a variable nor a key of the file (the nearest is named), or something that cannot vary continuously.
    pub fn find(name: &str, document: &Document, machine: &Machine) -> Result<Self> {
        let name = name.trim();
        if let Some(at) = machine.variables.iter().position(|v| v.name == name) {
            let variable = &machine.variables[at];
            return Ok(Self {
                name: name.to_string(),
                kind: ParameterKind::Condition,
                value: variable.default.unwrap_or(0.0),
                unit: variable.unit.clone(),
                dimension: variable.dimension,
                place: ParameterPlace::Variable(at),
            });
        }
        let names = Document::names_in(name).unwrap_or_default();
        let leaf = match document.leaf(name)? {
            Some(leaf) => leaf,
            None => default_of(&names, document).ok_or_else(|| unknown(name, &names, document, machine))?,
        };
        let form = SCHEMA.find(&names.iter().map(String::as_str).collect::<Vec<_>>()).map(|found| found.form);
        let refuse = |what: &str, help: &str| {
            Err(Error::input(format!("'{name}' {what}")).at_key(name).read(leaf.to_toml()).in_file(document.file()).help(help))
        };
        if form.is_some_and(|form| form.counts()) {
            return refuse("counts something", "a derivative needs a quantity that varies continuously; solve twice with --set instead");
        }
        let made = |kind, value, unit: &str, dimension| {
            let place = ParameterPlace::Key(leaf.clone());
            Ok(Self { name: name.to_string(), kind, value, unit: unit.to_string(), dimension, place })
        };
        let factor = || made(ParameterKind::Factor, 1.0, "1", Dimension::NUMBER);
        // Whether a formula may stand here: `Some(true)` for that of a temperature.
        let slot = form.and_then(|form| form.formula()).map(|unit| unit.dimension == Dimension::TEMPERATURE);
        let formula = |is_temperature: bool| {
            if is_temperature { made(ParameterKind::Offset, 0.0, "K", Dimension::DIFFERENCE) } else { factor() }
        };
        match &leaf {
            Leaf::Number(text) | Leaf::Integer(text) => match text.replace('_', "").parse::<f64>() {
                Ok(number) if number.is_finite() => made(ParameterKind::Quantity, number, "1", Dimension::NUMBER),
                _ => refuse("is no finite number", "write a finite number"),
            },
            Leaf::Text(text) => match (units::quantity(text), slot) {
                (Some((number, unit, dimension)), _) => {
                    made(ParameterKind::Quantity, units::convert(number, unit, dimension)?, unit, dimension)
                }
                (None, _) if form.is_some_and(|form| form.has_word(text)) => refuse("is a word, not a number", "name a key with a number"),
                (None, Some(is_temperature)) => formula(is_temperature),
                (None, None) => refuse("is a word, not a number", "name a key with a number"),
            },
            Leaf::Table(entries) if entries.iter().any(|(k, _)| k == "formula") && slot.is_some() => formula(slot == Some(true)),
            Leaf::Table(_) => refuse("is a table", &format!("name a number in it, for example {name}.KEY")),
            Leaf::List(items) if items.iter().all(|item| !matches!(item, Leaf::List(_) | Leaf::Table(_))) => {
                if items.iter().all(|item| number_of(item).is_some()) { factor() } else { refuse("is a list of names", "name a number") }
            }
            Leaf::List(_) if form.is_some_and(|form| form.has_curve()) => factor(),
            Leaf::List(_) => refuse("is a list of lists", &format!("name one entry, counted from 1: {name}[1][2]")),
            Leaf::Flag(_) | Leaf::Date(_) => refuse("does not vary continuously", "solve twice with --set instead"),
        }
    }

    /// Index of the condition variable, if it is one.
    pub fn variable(&self) -> Option<usize> {
        if let ParameterPlace::Variable(at) = self.place { Some(at) } else { None }
    }

    /// The `--set` (key, value) that gives the parameter a value; `None` for a condition variable.
    ///
    /// # Errors
    /// The formula is a bare variable that the machine does not have.
    pub fn to_set(&self, value: f64, machine: &Machine) -> Result<Option<(String, String)>> {
        let ParameterPlace::Key(leaf) = &self.place else { return Ok(None) };
        let changed = match self.kind {
            ParameterKind::Condition => return Ok(None),
            ParameterKind::Quantity => quantity_text(leaf, units::express(value, &self.unit, self.dimension)?, &self.unit),
            ParameterKind::Factor => match leaf {
                Leaf::List(items) => scaled(items, value),
                formula => operated(formula, machine, |text| format!("({text}) * {value:?}"))?,
            },
            // A sum with a negative number in parentheses reads well in both signs.
            ParameterKind::Offset => operated(leaf, machine, |text| format!("({text}) + ({value:?})"))?,
        };
        Ok(Some((self.name.clone(), changed.to_toml())))
    }

    /// The value in the unit it is shown in.
    pub fn shown(&self, value: f64) -> f64 {
        units::express(value, &self.unit, self.dimension).unwrap_or(value)
    }

    /// A derivative per SI unit, per shown unit (kelvin for temperatures).
    pub fn per_unit(&self, slope: f64) -> f64 {
        // The scale of a unit does not depend on where the zero lies.
        slope
            * (units::express(1.0, &self.unit, self.dimension)
                .map_or(1.0, |one| if self.dimension.is_absolute() { 1.0 } else { 1.0 / one }))
    }

    /// The unit of a difference of values: `K` for temperatures.
    pub fn step_unit(&self) -> &str {
        if self.dimension.is_absolute() { "K" } else { &self.unit }
    }

    /// Change for one percent of `value` more, from a derivative per SI unit; `None` for temperatures, whose percent means nothing.
    pub fn per_percent(&self, slope: f64, value: f64) -> Option<f64> {
        (!self.dimension.is_absolute() && self.kind != ParameterKind::Offset).then_some(slope * value / 100.0)
    }

    /// Change for one percent more, or for one kelvin of a temperature; parameters are ranked by it.
    pub fn importance(&self, slope: f64, value: f64) -> f64 {
        self.per_percent(slope, value).unwrap_or(slope).abs()
    }

    /// Step of differences at `value`, SI.
    pub fn step(&self, value: f64) -> f64 {
        if self.dimension.is_absolute() || self.kind == ParameterKind::Offset {
            KELVIN_STEP
        } else if value == 0.0 {
            // Small against the unit it is written in: nothing else tells the scale.
            ZERO_STEP / units::express(1.0, &self.unit, self.dimension).unwrap_or(1.0)
        } else {
            RELATIVE_STEP * value.abs()
        }
    }

    /// Whether the value is zero and zero is where its range may end.
    pub(crate) fn is_at_edge(&self, value: f64) -> bool {
        value == 0.0 && !self.dimension.is_absolute() && self.kind != ParameterKind::Offset
    }
}

/// The default of a key that is not given, in a table that is.
fn default_of(names: &[String], document: &Document) -> Option<Leaf> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (_, parents) = names.split_last()?;
    // `[chamber]` and its like need not be there.
    if parents.len() > 1 {
        document.leaf(&dotted(&parents[..2])).ok()??;
    }
    if let ["part", part, "surface", key @ ("emissivity" | "effective_emissivity")] = names.as_slice() {
        return match group_of(part, document) {
            Some(group) => document.leaf(&dotted(&["surfaces", "group", &group, key])).ok()?,
            None => document.leaf(&format!("surfaces.{key}")).ok()?,
        };
    }
    // A circuit fed by others has their flow, temperature and pressure, not the defaults.
    if let ["circuit", circuit, "flow" | "inlet_temperature" | "pressure"] = names.as_slice()
        && document.leaf(&dotted(&["circuit", circuit, "from"])).ok()?.is_some()
    {
        return None;
    }
    if parents.len() > 2 {
        document.leaf(&dotted(parents)).ok()??;
    }
    let key = SCHEMA.find(&names)?.key;
    let text = key.default_toml()?;
    Some(match key.default {
        Unstated::Whole(_) => Leaf::Integer(text),
        Unstated::Flag(flag) => Leaf::Flag(flag),
        _ => match text.strip_prefix('"').and_then(|t| t.strip_suffix('"')) {
            Some(inner) => Leaf::Text(inner.to_string()),
            None => Leaf::Number(text),
        },
    })
}

/// The group of `[surfaces]` that a part is in.
fn group_of(part: &str, document: &Document) -> Option<String> {
    let Leaf::Table(groups) = document.leaf("surfaces.group").ok()?? else { return None };
    let names = |group: &Leaf| {
        let Leaf::Table(entries) = group else { return false };
        let is_own = |item: &Leaf| matches!(item, Leaf::Text(name) if name == part);
        entries.iter().any(|(key, list)| key == "parts" && matches!(list, Leaf::List(items) if items.iter().any(is_own)))
    };
    groups.into_iter().find(|(_, group)| names(group)).map(|(name, _)| name)
}

fn dotted(names: &[&str]) -> String {
    names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(".")
}

fn unknown(name: &str, names: &[String], document: &Document, machine: &Machine) -> Error {
    let error = Error::input(format!("'{name}' is neither a condition variable nor a key of the machine file"))
        .at_key(name)
        .in_file(document.file());
    let variables = machine.variables.iter().map(|v| v.name.clone());
    // Keys of the file, and keys of the named table that are left at their defaults.
    let parents: Vec<&str> = names.iter().map(String::as_str).rev().skip(1).collect::<Vec<_>>().into_iter().rev().collect();
    let table = SCHEMA.find(&parents).and_then(|found| if let ValueForm::Table(table) = found.form { Some(table) } else { None });
    let defaults = table.into_iter().flat_map(|table| table.keys()).filter(|key| key.default_toml().is_some());
    let defaults: Vec<String> = defaults.map(|key| format!("{}.{}", dotted(&parents), key.name)).collect();
    let known: Vec<String> = variables.chain(document.keys()).chain(defaults).collect();
    match did_you_mean(name, known.iter().map(String::as_str)) {
        Some(near) => error.help(format!("did you mean '{near}'?")),
        None => error.help("write a condition variable such as coolant_flow, or a dotted key such as contact.motor.conductance"),
    }
}

fn number_of(leaf: &Leaf) -> Option<(f64, &str)> {
    match leaf {
        Leaf::Number(text) | Leaf::Integer(text) => text.replace('_', "").parse().ok().map(|number| (number, "")),
        Leaf::Text(text) => units::quantity(text).map(|(number, unit, _)| (number, unit)),
        _ => None,
    }
}

/// A leaf of this kind with another number in the same unit.
fn quantity_text(leaf: &Leaf, number: f64, unit: &str) -> Leaf {
    match leaf {
        Leaf::Text(text) if units::quantity(text).is_some_and(|q| text.trim_end().ends_with(q.1)) => {
            Leaf::Text(format!("{number:?} {unit}"))
        }
        Leaf::Text(_) => Leaf::Text(format!("{number:?}")),
        _ => Leaf::Number(format!("{number:?}")),
    }
}

/// A list with every number times `factor`; of pairs every second one.
fn scaled(items: &[Leaf], factor: f64) -> Leaf {
    let is_pair = |item: &Leaf| matches!(item, Leaf::List(pair) if pair.len() == 2 && pair.iter().all(|e| number_of(e).is_some()));
    let scale = |leaf: &Leaf| number_of(leaf).map_or(leaf.clone(), |(number, unit)| quantity_text(leaf, number * factor, unit));
    Leaf::List(
        items
            .iter()
            .map(|item| match item {
                Leaf::List(pair) if is_pair(item) => Leaf::List(vec![pair[0].clone(), scale(&pair[1])]),
                Leaf::List(inner) => scaled(inner, factor),
                other => scale(other),
            })
            .collect(),
    )
}

/// A formula changed as text. A bare variable becomes an expression in a unit of its own.
fn operated(leaf: &Leaf, machine: &Machine, change: impl Fn(&str) -> String) -> Result<Leaf> {
    match leaf {
        Leaf::Table(entries) => {
            let changed = entries.iter().map(|(name, value)| match value {
                Leaf::Text(text) if name == "formula" => (name.clone(), Leaf::Text(change(text))),
                other => (name.clone(), other.clone()),
            });
            Ok(Leaf::Table(changed.collect()))
        }
        Leaf::Text(text) => match machine.variables.iter().find(|v| v.name == text.trim()) {
            Some(variable) => {
                let (name, unit) = variable.in_expressions();
                Ok(Leaf::Table(vec![("formula".into(), Leaf::Text(change(&name))), ("unit".into(), Leaf::Text(unit))]))
            }
            None => Ok(Leaf::Text(change(text))),
        },
        other => Ok(other.clone()),
    }
}
