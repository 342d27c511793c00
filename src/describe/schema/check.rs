//! Keys that the schema does not know.

use super::{Form, Key, Table, Unit};
use crate::error::Result;
use crate::foundation::document::{Section, Value, suggestion};
use crate::units::Dimension;

/// A formula with the unit of its result.
pub(super) const FORMULA: Table = Table {
    doc: "an expression with the unit of its result",
    keys: &[&[Key::new("formula", Form::Text, "the expression").required(), Key::new("unit", Form::Text, "unit of its result").required()]],
    one_of: &[],
};

impl Table {
    /// Looks for keys that the schema does not know, in this table and in all below it.
    ///
    /// # Errors
    /// The first such key in the order of the file, with the key that was probably meant and all that are known there.
    pub fn check(&self, section: &Section<'_>) -> Result<()> {
        for name in section.keys() {
            let Some(key) = self.key(name) else {
                return Err(section.error_at(name, format!("unknown key '{name}'")).help(self.suggestion(name)));
            };
            check_value(&section.value(name)?, &key.form)?;
        }
        Ok(())
    }

    /// What to say about a key that is not known here.
    fn suggestion(&self, name: &str) -> String {
        let known: Vec<&str> = self.keys().map(|key| key.name).collect();
        match self.keys().find(|key| key.also.iter().any(|other| other.eq_ignore_ascii_case(name))) {
            Some(meant) => format!("did you mean '{}'? Known here: {}", meant.name, known.join(", ")),
            None => suggestion(name, &known),
        }
    }
}

/// Looks into tables; whether the value fits its form otherwise is for the reader to say.
fn check_value(value: &Value<'_>, form: &Form) -> Result<()> {
    match form {
        Form::Table(table) if value.is_table() => table.check(&value.section()?),
        Form::Formula(_) if value.is_table() => FORMULA.check(&value.section()?),
        Form::Named(table) if value.is_table() => {
            let all = value.section()?;
            all.keys().map(|name| all.value(name)).try_for_each(|entry| check_value(&entry?, &Form::Table(table)))
        }
        Form::Free(inner) if value.is_table() => {
            let all = value.section()?;
            all.keys().map(|name| all.value(name)).try_for_each(|entry| check_value(&entry?, inner))
        }
        Form::Tables(table) if value.is_list() => {
            value.list()?.iter().filter(|entry| entry.is_table()).try_for_each(|entry| table.check(&entry.section()?))
        }
        Form::Either(forms) => forms.iter().try_for_each(|form| check_value(value, form)),
        _ => Ok(()),
    }
}

/// The unit that results of formulas without a unit of their own have.
pub(super) fn formula_unit(unit: Unit) -> &'static str {
    if unit.dimension == Dimension::NUMBER { "a pure number" } else { unit.name }
}
