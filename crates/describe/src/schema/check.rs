//! Check for keys that the schema does not know.

use super::{Key, KeyTable, Unit, ValueForm};
use coldplate_base::document::{Section, Value, suggestion};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::Dimension;

/// A formula with the unit of its result.
pub(super) const FORMULA: KeyTable = KeyTable {
    doc: "an expression with the unit of its result",
    keys: &[&[
        Key::new("formula", ValueForm::Text, "the expression").required(),
        Key::new("unit", ValueForm::Text, "unit of its result").required(),
    ]],
    one_of: &[],
};

impl KeyTable {
    /// Checks for keys that the schema does not know, in this table and in all tables below.
    ///
    /// # Errors
    /// The first unknown key in the order of the file, with the key that was probably meant and all known keys of its
    /// table.
    pub fn check(&self, section: &Section<'_>) -> Result<()> {
        for name in section.keys() {
            let Some(key) = self.key(name) else {
                return Err(self.unknown(section, name));
            };
            check_value(&section.value(name)?, &key.form)?;
        }
        Ok(())
    }

    /// An error about a key that this table does not have.
    pub(super) fn unknown(&self, section: &Section<'_>, name: &str) -> Error {
        section.error_at(name, format!("unknown key '{name}'")).help(self.suggestion(name))
    }

    /// Help text for an unknown key of this table.
    fn suggestion(&self, name: &str) -> String {
        let known: Vec<&str> = self.keys().map(|key| key.name).collect();
        match self.keys().find(|key| key.also.iter().any(|other| other.eq_ignore_ascii_case(name))) {
            Some(meant) => format!("did you mean '{}'? Known here: {}", meant.name, known.join(", ")),
            None => suggestion(name, &known),
        }
    }
}

/// Checks the tables inside a value; the reader checks whether other values fit their form.
fn check_value(value: &Value<'_>, form: &ValueForm) -> Result<()> {
    match form {
        ValueForm::Table(table) if value.is_table() => table.check(&value.section()?),
        ValueForm::Formula(_) if value.is_table() => FORMULA.check(&value.section()?),
        ValueForm::Named(table) if value.is_table() => {
            let all = value.section()?;
            all.keys().map(|name| all.value(name)).try_for_each(|entry| check_value(&entry?, &ValueForm::Table(table)))
        }
        ValueForm::Free(inner) if value.is_table() => {
            let all = value.section()?;
            all.keys().map(|name| all.value(name)).try_for_each(|entry| check_value(&entry?, inner))
        }
        ValueForm::Tables(table) if value.is_list() => {
            value.list()?.iter().filter(|entry| entry.is_table()).try_for_each(|entry| table.check(&entry.section()?))
        }
        ValueForm::Either(forms) => forms.iter().try_for_each(|form| check_value(value, form)),
        _ => Ok(()),
    }
}

/// Unit of the results of formulas without a unit of their own.
pub(super) fn formula_unit(unit: Unit) -> &'static str {
    if unit.dimension == Dimension::NUMBER { "a pure number" } else { unit.name }
}
