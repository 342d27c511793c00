//! All mistakes of a file that the schema alone can see, for a message that names them at once.

use super::check::FORMULA;
use super::{Key, KeyTable, ValueForm};
use coldplate_base::document::{Section, Value};
use coldplate_base::error::{Error, Result};
use coldplate_base::units;

impl KeyTable {
    /// Keys that the schema does not know, required keys that are missing, and values that do not have their form, in this
    /// table and in all tables below, in the order of the file.
    ///
    /// A file that is read without an error has none. A formula is looked at only where it is a number with a unit.
    pub fn mistakes(&self, section: &Section<'_>) -> Vec<Error> {
        let mut found = Vec::new();
        self.collect(section, &mut found);
        found
    }

    fn collect(&self, section: &Section<'_>, found: &mut Vec<Error>) {
        let before = found.len();
        for name in section.keys() {
            match (self.key(name), section.opt(name)) {
                (Some(key), Some(value)) => in_value(&value, &key.form, key.is_positive, found),
                _ => found.push(self.unknown(section, name)),
            }
        }
        // The key that is missing may be one that is written wrongly.
        if found.len() == before {
            let missing = |key: &&Key| key.is_required && !section.has(key.name);
            found.extend(self.keys().filter(missing).map(|key| {
                section.error_at(key.name, format!("'{}' is missing", key.name)).help(format!("add '{}': {}", key.name, key.doc))
            }));
        }
    }
}

/// Mistakes of a value and of the tables inside it.
fn in_value(value: &Value<'_>, form: &ValueForm, is_positive: bool, found: &mut Vec<Error>) {
    let mut in_section = |table: &KeyTable, value: &Value<'_>| match value.section() {
        Ok(section) => table.collect(&section, found),
        Err(error) => found.push(error),
    };
    match form {
        ValueForm::Table(table) => in_section(table, value),
        ValueForm::Formula(_) if value.is_table() => in_section(&FORMULA, value),
        ValueForm::Named(table) => entries(value, &ValueForm::Table(table), found),
        ValueForm::Free(inner) => entries(value, inner, found),
        ValueForm::Tables(table) => match value.list() {
            Ok(list) => list.iter().for_each(|entry| in_section(table, entry)),
            Err(error) => found.push(error),
        },
        ValueForm::List(inner, count) => match value.list() {
            Ok(list) if count.is_none_or(|count| count == list.len()) => {
                list.iter().for_each(|entry| in_value(entry, inner, is_positive, found));
            }
            Ok(list) => found.push(value.error(format!("{} entries are wanted here, not {}", count.unwrap_or(0), list.len()))),
            Err(error) => found.push(error),
        },
        ValueForm::Either(forms) => either(value, forms, is_positive, found),
        _ => found.extend(single(value, form, is_positive).err()),
    }
}

/// Mistakes of all entries of a table whose names the user chose.
fn entries(value: &Value<'_>, form: &ValueForm, found: &mut Vec<Error>) {
    match value.section() {
        Ok(section) => section.keys().filter_map(|name| section.opt(name)).for_each(|entry| in_value(&entry, form, false, found)),
        Err(error) => found.push(error),
    }
}

/// Mistakes of a value that has one of some forms: none if it has one of them; otherwise those of the form that it comes
/// closest to: the first that is written in the same way, or else the first.
fn either(value: &Value<'_>, forms: &[ValueForm], is_positive: bool, found: &mut Vec<Error>) {
    let of = |form: &ValueForm| {
        let mut own = Vec::new();
        in_value(value, form, is_positive, &mut own);
        own
    };
    let is_alike = |form: &ValueForm| match form {
        ValueForm::Table(_) | ValueForm::Named(_) | ValueForm::Free(_) => value.is_table(),
        ValueForm::List(..) | ValueForm::Curve(..) | ValueForm::Tables(_) => value.is_list(),
        ValueForm::Word(_) => false,
        _ => !value.is_table() && !value.is_list(),
    };
    if forms.iter().all(|form| !of(form).is_empty()) {
        let closest = forms.iter().find(|form| is_alike(form)).or(forms.first());
        found.extend(closest.map(of).unwrap_or_default());
    }
}

/// Checks a value without parts of its own.
fn single(value: &Value<'_>, form: &ValueForm, is_positive: bool) -> Result<()> {
    match form {
        ValueForm::Text | ValueForm::Name(_) => value.text().map(drop),
        ValueForm::Flag | ValueForm::True => value.flag().map(drop),
        ValueForm::Whole(least) => value.integer(*least).map(drop),
        ValueForm::Number if is_positive => value.positive(units::Dimension::NUMBER).map(drop),
        ValueForm::Number => value.number().map(drop),
        ValueForm::Quantity(unit) if is_positive => value.positive(unit.dimension).map(drop),
        ValueForm::Quantity(unit) => value.quantity(unit.dimension).map(drop),
        ValueForm::Formula(unit) if has_unit(value) => value.quantity(unit.dimension).map(drop),
        ValueForm::Word(words) => value.choice(words).map(drop),
        ValueForm::Curve(x, y) => value.curve(x.dimension, y.dimension).map(drop),
        _ => Ok(()),
    }
}

/// Whether this is a number and a unit that is known, so that no variable is meant.
fn has_unit(value: &Value<'_>) -> bool {
    let text = value.text().unwrap_or_default();
    text.trim().split_once(' ').is_some_and(|(number, unit)| number.parse::<f64>().is_ok() && units::dimension_of(unit.trim()).is_ok())
}
