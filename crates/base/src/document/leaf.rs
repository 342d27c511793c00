//! Values under a key, taken out of the file, changed and written back by `--set`.

use super::Document;
use super::spread::Uncertain;
use super::tree::{ASSUMED, Item, Node, Step, join, quoted, split_key};
use crate::error::{Error, Result};

/// A value of a file without its place.
#[derive(Debug, Clone, PartialEq)]
pub enum Leaf {
    /// Text.
    Text(String),
    /// A number as written.
    Number(String),
    /// A whole number as written.
    Integer(String),
    /// `true` or `false`.
    Flag(bool),
    /// A date.
    Date(String),
    /// A list.
    List(Vec<Leaf>),
    /// A table in the order of the file, without `assumed`.
    Table(Vec<(String, Leaf)>),
}

impl Leaf {
    fn of(item: &Item) -> Self {
        match &item.node {
            Node::Text(text) => Self::Text(text.clone()),
            Node::Integer(text, _) => Self::Integer(text.clone()),
            Node::Float(text) => Self::Number(text.clone()),
            Node::Flag(flag) => Self::Flag(*flag),
            Node::Date(text) => Self::Date(text.clone()),
            Node::List(items) => Self::List(items.iter().map(Self::of).collect()),
            Node::Table(entries) => {
                Self::Table(entries.iter().filter(|(k, _)| k != ASSUMED).map(|(k, item)| (k.clone(), Self::of(item))).collect())
            }
        }
    }

    /// The value as TOML, for [`Document::apply_set`].
    pub fn to_toml(&self) -> String {
        match self {
            Self::Text(text) => format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")),
            Self::Number(text) | Self::Integer(text) | Self::Date(text) => text.clone(),
            Self::Flag(flag) => flag.to_string(),
            Self::List(items) => format!("[{}]", items.iter().map(Self::to_toml).collect::<Vec<_>>().join(", ")),
            Self::Table(entries) => {
                let entries: Vec<String> = entries.iter().map(|(name, leaf)| format!("{} = {}", join("", name), leaf.to_toml())).collect();
                format!("{{ {} }}", entries.join(", "))
            }
        }
    }
}

impl Document {
    /// The value under a dotted key (written as for [`Document::apply_set`]), if there is one.
    ///
    /// # Errors
    /// The key is malformed.
    pub fn leaf(&self, key: &str) -> Result<Option<Leaf>> {
        let steps = split_key(key).ok_or_else(|| {
            Error::input(format!("'{key}' is not a key"))
                .help("write a dotted key, e.g. contact.motor.conductance or part.bed.blocks[2].at")
        })?;
        let mut item = &self.root;
        for step in &steps {
            let next = match (step, &item.node) {
                (Step::Name(name), Node::Table(entries)) => entries.iter().find(|(k, _)| k == name).map(|(_, item)| item),
                (Step::Index(n), Node::List(items)) => items.get(n.wrapping_sub(1)),
                _ => None,
            };
            let Some(next) = next else { return Ok(None) };
            item = next;
        }
        Ok(Some(Leaf::of(item)))
    }

    /// The names in a dotted key, without quotes; numbers of list entries are left out. `None` if the key is malformed.
    pub fn names_in(key: &str) -> Option<Vec<String>> {
        let names = |step| if let Step::Name(name) = step { Some(name) } else { None };
        split_key(key).map(|steps| steps.into_iter().filter_map(names).collect())
    }

    /// The dotted keys of all values of the file except tables, in the order of the file. A list is one value unless
    /// its entries are tables. Names stand without quotes where `apply_set` needs none.
    pub fn keys(&self) -> Vec<String> {
        fn walk(item: &Item, key: &str, found: &mut Vec<String>) {
            let entries = match &item.node {
                Node::Table(entries) => entries,
                Node::List(items) if items.iter().any(|i| matches!(i.node, Node::Table(_))) => {
                    return items.iter().enumerate().for_each(|(i, item)| walk(item, &format!("{key}[{}]", i + 1), found));
                }
                _ => return found.push(key.to_string()),
            };
            for (name, item) in entries.iter().filter(|(name, _)| name != ASSUMED) {
                let name = if name.contains(['.', '[', ']', '"', '\'']) { quoted(name) } else { name.clone() };
                walk(item, &if key.is_empty() { name } else { format!("{key}.{name}") }, found);
            }
        }
        let mut found = Vec::new();
        walk(&self.root, "", &mut found);
        found
    }

    /// All numbers stated as uncertain, in the order of the file.
    pub fn uncertain(&self) -> Vec<Uncertain> {
        fn walk(item: &Item, key: &str, found: &mut Vec<Uncertain>) {
            if let Some(spread) = &item.spread {
                found.push(Uncertain { key: key.to_string(), spread: spread.clone() });
            }
            match &item.node {
                Node::List(items) => items.iter().enumerate().for_each(|(i, item)| walk(item, &format!("{key}[{}]", i + 1), found)),
                Node::Table(entries) => {
                    for (name, item) in entries.iter().filter(|(name, _)| name != ASSUMED) {
                        let name = if name.contains(['.', '[', ']', '"', '\'']) { quoted(name) } else { name.clone() };
                        walk(item, &if key.is_empty() { name } else { format!("{key}.{name}") }, found);
                    }
                }
                _ => {}
            }
        }
        let mut found = Vec::new();
        walk(&self.root, "", &mut found);
        found
    }
}
