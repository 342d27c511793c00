//! A schema as tables of the documentation.

use super::check::formula_unit;
use super::json::quantity_text;
use super::{Key, KeyTable, Unstated, ValueForm};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::Dimension;

/// The line that ends a list of keys in a page.
const END: &str = "<!-- end of keys -->";

impl KeyTable {
    /// The keys of this table with their forms, their defaults and a line each, as a Markdown table.
    pub fn to_markdown(&self) -> String {
        let mut lines = vec!["| key | holds | default | meaning |".to_string(), "|---|---|---|---|".to_string()];
        lines.extend(self.keys().map(row));
        lines.join("\n") + "\n"
    }

    /// The table of a dotted name, with `*` for names of the user's choice: `contact.*.rough`; `file` is this table
    /// itself.
    pub fn table(&self, path: &str) -> Option<&KeyTable> {
        if path == "file" {
            return Some(self);
        }
        let (name, rest) = path.split_once('.').map_or((path, None), |(name, rest)| (name, Some(rest)));
        let inner = inner_table(&self.key(name)?.form)?;
        match rest.map(|rest| rest.strip_prefix('*').map_or(rest, |rest| rest.strip_prefix('.').unwrap_or(rest))) {
            None | Some("") => Some(inner),
            Some(rest) => inner.table(rest),
        }
    }

    /// A page with the tables between its marks `<!-- keys: TABLE -->` and `<!-- end of keys -->` written anew.
    ///
    /// # Errors
    /// A mark names no table, or has no end.
    pub fn fill(&self, page: &str) -> Result<String> {
        let mut filled = String::new();
        let mut lines = page.lines().enumerate();
        while let Some((at, line)) = lines.next() {
            filled += &format!("{line}\n");
            let Some(name) = line.strip_prefix("<!-- keys: ").and_then(|rest| rest.strip_suffix(" -->")) else { continue };
            let wrong = |what: String| Error::input(what).at_line(at + 1).read(line);
            let table = self.table(name).ok_or_else(|| wrong(format!("there is no table '{name}'")).help(self.tables().join(", ")))?;
            filled += &format!("\n{}\n{END}\n", table.to_markdown());
            if !lines.any(|(_, line)| line == END) {
                return Err(wrong("this list of keys has no end".into()).help(format!("add a line {END}")));
            }
        }
        Ok(filled)
    }

    /// The dotted names of all tables below this one, in order, for [`KeyTable::table`].
    pub fn tables(&self) -> Vec<String> {
        let mut found = Vec::new();
        for key in self.keys() {
            let Some(inner) = inner_table(&key.form) else { continue };
            let here = format!("{}{}", key.name, if is_named(&key.form) { ".*" } else { "" });
            found.push(here.clone());
            found.extend(inner.tables().into_iter().map(|below| format!("{here}.{below}")));
        }
        found
    }
}

fn inner_table(form: &ValueForm) -> Option<&'static KeyTable> {
    match form {
        ValueForm::Table(table) | ValueForm::Tables(table) | ValueForm::Named(table) => Some(table),
        ValueForm::Free(inner) => inner_table(inner),
        ValueForm::Either(forms) => forms.iter().find_map(inner_table),
        _ => None,
    }
}

fn is_named(form: &ValueForm) -> bool {
    matches!(form, ValueForm::Named(_) | ValueForm::Free(_))
}

fn row(key: &Key) -> String {
    let default = match key.default {
        Unstated::Nothing if key.is_required => "required".to_string(),
        Unstated::Nothing => String::new(),
        Unstated::Si(si) => match key.form.unit().filter(|unit| unit.dimension != Dimension::NUMBER) {
            Some(unit) => quantity_text(si, unit),
            None => format!("{si}"),
        },
        Unstated::Whole(number) => number.to_string(),
        Unstated::Flag(flag) => flag.to_string(),
        Unstated::Text(text) if key.form.formula().is_some() => format!("`{text}`"),
        Unstated::Text(text) => format!("`\"{text}\"`"),
        Unstated::Follows(what) => what.to_string(),
    };
    format!("| `{}` | {} | {default} | {} |", key.name, holds(&key.form), key.doc.replace('|', "\\|"))
}

/// A form in a few words.
fn holds(form: &ValueForm) -> String {
    match form {
        ValueForm::Text => "text".into(),
        ValueForm::Name(what) => what.to_string(),
        ValueForm::Flag => "true, false".into(),
        ValueForm::True => "true".into(),
        ValueForm::Whole(_) => "whole number".into(),
        ValueForm::Number => "number".into(),
        ValueForm::Quantity(unit) => unit.name.into(),
        ValueForm::AnyQuantity => "quantity".into(),
        ValueForm::Formula(unit) => format!("formula, {}", formula_unit(*unit)),
        ValueForm::Word(words) => words.iter().map(|word| format!("`\"{word}\"`")).collect::<Vec<_>>().join(", "),
        ValueForm::List(inner, Some(count)) => format!("{count} × {}", holds(inner)),
        ValueForm::List(inner, None) => format!("list of {}", holds(inner)),
        ValueForm::Curve(x, y) => format!("table {} to {}", x.name, y.name),
        ValueForm::Nested(what) => format!("lists of {what}s"),
        ValueForm::Either(forms) => forms.iter().map(holds).collect::<Vec<_>>().join(" or "),
        ValueForm::Table(_) => "table".into(),
        ValueForm::Tables(_) => "list of tables".into(),
        ValueForm::Named(_) | ValueForm::Free(_) => "table of names".into(),
    }
}
