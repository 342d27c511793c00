//! Changes some values in the text of a file and keeps everything else, comments included.

use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::tree::quoted;
use super::{Step, split_key};
use crate::error::{Error, Result};

/// Gives every key of `sets` its value (TOML) in `text`. A missing key is added to its table; a missing table is added
/// at the end.
///
/// # Errors
/// The text is not TOML, a key is malformed, or a key leads through an entry that is no table.
pub fn edited(text: &str, file: &Path, sets: &[(String, String)]) -> Result<String> {
    let mut text = text.to_string();
    for (key, value) in sets {
        text = with(&text, key, value).map_err(|e| e.in_file(file).at_key(key))?;
    }
    Ok(text)
}

/// The place in the text that a key leads to.
enum Place {
    /// A value at these bytes.
    Value(std::ops::Range<usize>),
    /// No value, but a table in braces: the byte of its closing brace, and whether the table is empty.
    Inline(usize, bool),
    /// No value: this many leading steps of the key are tables with a header of their own.
    Header(usize),
}

fn with(text: &str, key: &str, value: &str) -> Result<String> {
    let steps = split_key(key).ok_or_else(|| Error::input(format!("'{key}' is not a key")))?;
    let root = DeTable::parse(text).map_err(|e| Error::input(format!("this is not valid TOML: {}", e.message())))?;
    let place = find(text, root.get_ref(), &steps)?;
    let names: Vec<String> = steps.iter().map(|s| if let Step::Name(n) = s { quoted(n) } else { String::new() }).collect();
    let last = names.last().cloned().unwrap_or_default();
    Ok(match place {
        // A table with a header of its own is replaced by one with the entries of the new value.
        Place::Value(span) if text[span.clone()].starts_with('[') && value.trim_start().starts_with('{') => {
            let start = text[..span.start].rfind('\n').map_or(0, |i| i + 1);
            let after = text[span.end..].find("\n[").map_or(text.len(), |i| span.end + i + 1);
            format!("{}[{}]\n{}\n{}", &text[..start], names.join("."), entries(value)?, &text[after..])
        }
        Place::Value(span) => format!("{}{value}{}", &text[..span.start], &text[span.end..]),
        Place::Inline(end, is_empty) => {
            let comma = if is_empty { "" } else { ", " };
            let before = text[..end].trim_end();
            format!("{before}{comma}{last} = {value} {}", &text[end..])
        }
        Place::Header(_) if steps.len() == 1 => format!("{last} = {value}\n{text}"),
        Place::Header(known) => {
            // The new line goes under the header of its table, above the entries there; without a header, into a new
            // table at the end.
            let header = if known + 1 == steps.len() { header_end(text, &names[..known]) } else { None };
            let gap = if text.ends_with('\n') { "" } else { "\n" };
            match header {
                Some(end) => format!("{}\n{last} = {value}{}", &text[..end], &text[end..]),
                None if value.trim_start().starts_with('{') => format!("{text}{gap}\n[{}]\n{}", names.join("."), entries(value)?),
                None => format!("{text}{gap}\n[{}]\n{last} = {value}\n", names[..names.len() - 1].join(".")),
            }
        }
    })
}

/// The entries of a table in braces, a line each.
fn entries(value: &str) -> Result<String> {
    let whole = format!("table = {value}");
    let root = DeTable::parse(&whole).map_err(|e| Error::input(format!("this is not valid TOML: {}", e.message())))?;
    let mut lines = String::new();
    for (_, table) in root.get_ref().iter() {
        let DeValue::Table(table) = table.get_ref() else { continue };
        for (key, value) in table.iter() {
            lines += &format!("{} = {}\n", quoted(key.get_ref()), &whole[value.span()]);
        }
    }
    Ok(lines)
}

fn find(text: &str, root: &DeTable<'_>, steps: &[Step]) -> Result<Place> {
    let mut table = root;
    let mut here: Option<&Spanned<DeValue<'_>>> = None;
    for (depth, step) in steps.iter().enumerate() {
        let next = match (step, here.map(|h| h.get_ref())) {
            (Step::Name(name), None | Some(DeValue::Table(_))) => match table.iter().find(|(k, _)| k.get_ref().as_ref() == name.as_str()) {
                Some((_, value)) => value,
                None => {
                    let braces = here.map(Spanned::span).filter(|s| text[s.clone()].starts_with('{'));
                    return match braces {
                        Some(span) if depth + 1 == steps.len() => {
                            let is_empty = text[span.start + 1..span.end - 1].trim().is_empty();
                            Ok(Place::Inline(span.end - 1, is_empty))
                        }
                        Some(_) => Err(Error::input("a table written in braces has no such table inside")),
                        None => Ok(Place::Header(depth)),
                    };
                }
            },
            (Step::Index(n), Some(DeValue::Array(items))) => {
                items.get(n.wrapping_sub(1)).ok_or_else(|| Error::input(format!("there is no entry number {n}")))?
            }
            _ => return Err(Error::input("the key leads through something that is no table")),
        };
        if let DeValue::Table(inner) = next.get_ref() {
            table = inner;
        }
        here = Some(next);
    }
    here.map(|h| Place::Value(h.span())).ok_or_else(|| Error::input("the key is empty"))
}

/// Byte at which the line of the header `[a.b]` ends.
fn header_end(text: &str, names: &[String]) -> Option<usize> {
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let bare = line.split('#').next().unwrap_or("").trim();
        if let Some(inner) = bare.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            let found = split_key(inner.trim());
            let wanted = split_key(&names.join("."));
            if found.is_some() && found == wanted {
                return Some(start + line.trim_end().len());
            }
        }
        start += line.len();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_with_a_header_is_replaced() {
        let text = "[a.b]\nx = 1\ny = 2 # gone\n\n[c]\nz = 3\n";
        let found = edited(text, Path::new("m.toml"), &[("a.b".into(), "{ x = 1, t = [[1, 2]] }".into())]).unwrap();
        assert_eq!(found, "[a.b]\nt = [[1, 2]]\nx = 1\n\n[c]\nz = 3\n");
    }

    #[test]
    fn a_new_entry_of_tables_with_headers_gets_one_too() {
        let text = "[source.motor]\npower = \"3 W\"";
        let sets = [("source.\"a b\"".to_string(), "{ in = \"bed\", power = \"2 W\" }".to_string()), ("cells".into(), "7".into())];
        let found = edited(text, Path::new("m.toml"), &sets).unwrap();
        assert_eq!(found, "cells = 7\n[source.motor]\npower = \"3 W\"\n\n[source.\"a b\"]\nin = \"bed\"\npower = \"2 W\"\n");
    }

    #[test]
    fn values_are_replaced_and_added_in_place() {
        let text = "# head\nname = \"a\" # keep\n[contact.motor] # joint\nbetween = [\"a\", \"b\"]\nconductance = \"560 W/(m2 K)\" # known\n[part.\"b c\"]\nsurface = { area = \"1 m2\" }\n";
        let sets = [
            ("contact.motor.conductance", "\"571.5 W/(m2 K)\""),
            ("contact.motor.area", "\"2 m2\""),
            ("part.\"b c\".surface.emissivity", "0.4"),
            ("chamber.pressure", "\"1 Pa\""),
        ];
        let sets: Vec<(String, String)> = sets.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        let found = edited(text, Path::new("m.toml"), &sets).unwrap();
        let expected = "# head\nname = \"a\" # keep\n[contact.motor] # joint\narea = \"2 m2\"\nbetween = [\"a\", \"b\"]\nconductance = \"571.5 W/(m2 K)\" # known\n[part.\"b c\"]\nsurface = { area = \"1 m2\", emissivity = 0.4 }\n\n[chamber]\npressure = \"1 Pa\"\n";
        assert_eq!(found, expected);
    }
}
