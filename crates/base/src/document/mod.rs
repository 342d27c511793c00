//! Strict reading of TOML files: every error names the file, the line, the key, the value and a remedy.
//!
//! A [`Document`] is walked through [`Section`]s (tables) and [`Value`]s. Each accessor notes the key it
//! asked for, and [`Section::finish`] turns every key nobody asked for into an error with a "did you mean".
//!
//! ```
//! use coldplate_base::document::Document;
//! use coldplate_base::units::Dimension;
//! let mut file = Document::parse("[contact.motor]\nconductance = '560 W/(m2 K)'", "rig.toml").unwrap();
//! file.apply_set("contact.motor.conductance", "600 W/(m2 K)").unwrap();
//! let root = file.root();
//! for (name, contact) in root.sections("contact").unwrap() {
//!     assert_eq!((name.as_str(), contact.quantity("conductance", Dimension::FILM).unwrap()), ("motor", 600.0));
//!     contact.finish().unwrap();
//! }
//! root.finish().unwrap();
//! ```
//!
//! Any table may say that numbers in it are assumed: `assumed = "reason"` for the whole table, or
//! `assumed = { key = "reason" }` for single keys; see [`Document::assumptions`].

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use toml::de::{DeTable, DeValue};

mod edit;
mod leaf;
mod rewrite;
mod spread;
mod tree;
mod value;

pub use edit::edited;
pub use leaf::Leaf;
pub use rewrite::name_of;
pub use spread::{StatedSpread, Uncertain};
pub use tree::quoted;
pub use value::Value;

use crate::error::{Error, Result, did_you_mean};
use crate::input;
use crate::units::Dimension;
use tree::{ASSUMED, Item, Node, Origin, Step, abbreviate, item, join, kind, split_key};

/// A number, or several, that the file marks as assumed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assumed {
    /// Dotted key.
    pub key: String,
    /// The value as written.
    pub value: String,
    /// Why it was chosen.
    pub reason: String,
}

/// A parsed file, possibly changed by `--set`.
#[derive(Debug, Clone)]
pub struct Document {
    file: PathBuf,
    root: Item,
    hasher: Sha256,
}

impl Document {
    /// Reads and parses a file.
    ///
    /// # Errors
    /// The file cannot be read, is not UTF-8, or is not TOML.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = input::text(path).map_err(|e| e.help("check the path"))?;
        Self::parse(&text, path)
    }

    /// Parses `text`; `file` is the name used in errors.
    ///
    /// # Errors
    /// The text is not TOML (duplicate keys included).
    pub fn parse(text: &str, file: impl AsRef<Path>) -> Result<Self> {
        let file = file.as_ref().to_path_buf();
        let starts: Vec<usize> = std::iter::once(0).chain(text.match_indices('\n').map(|(i, _)| i + 1)).collect();
        let line_of = |at: usize| starts.partition_point(|start| *start <= at).max(1);
        let fault = |e: &toml::de::Error| {
            let error = Error::input(format!("this is not valid TOML: {}", e.message())).in_file(&file);
            let help = match e.message() {
                m if m.contains("duplicate key") => "a key or table may appear once only; remove or rename one of the two",
                _ => "strings need quotes, e.g. flow = \"9 L/min\"; tables start with [name]",
            };
            match e.span() {
                Some(span) => {
                    let line = line_of(span.start);
                    let shown = text.lines().nth(line - 1).unwrap_or_default().trim();
                    error.at_line(line).read(abbreviate(shown)).help(help)
                }
                None => error.help(help),
            }
        };
        let (table, faults) = DeTable::parse_recoverable(text);
        let mut faults = faults.iter().map(fault);
        if let Some(first) = faults.next() {
            return Err(first.and(faults));
        }
        let root = item(&DeValue::Table(table.into_inner()), Origin::Line(1), &|at| Origin::Line(line_of(at)));
        Ok(Self { file, root, hasher: Sha256::new_with_prefix(text.as_bytes()) })
    }

    /// The document with `sets` (key, value) applied to it; see [`Document::apply_set`].
    ///
    /// # Errors
    /// Errors of [`Document::apply_set`].
    pub fn with_sets(mut self, sets: &[(String, String)]) -> Result<Self> {
        for (key, value) in sets {
            self.apply_set(key, value).map_err(|error| error.in_file(&self.file))?;
        }
        Ok(self)
    }

    /// The name of the file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Applies one `--set KEY=VALUE`. `value` is TOML; a string may come without quotes. Elements of lists
    /// are reached by their number from 1: `part.bed.blocks[2].at`. A key that is absent is added to its
    /// table, so an optional key can be set; one that nobody knows then fails in [`Section::finish`].
    ///
    /// # Errors
    /// The key is malformed or its table does not exist.
    pub fn apply_set(&mut self, key: &str, value: &str) -> Result<()> {
        let flag = format!("--set {key}");
        let fail = |what: String, help: String| Error::input(what).at_key(flag.clone()).read(abbreviate(value)).help(help);
        let steps = split_key(key).ok_or_else(|| {
            fail(format!("'{key}' is not a key"), "write a dotted key, e.g. contact.motor.conductance or part.bed.blocks[2].at".into())
        })?;
        let mut node = &mut self.root;
        let mut path = String::new();
        for (depth, step) in steps.iter().enumerate() {
            let last = depth + 1 == steps.len();
            let here = if path.is_empty() { "this file".to_string() } else { format!("[{path}]") };
            match (step, &mut node.node) {
                (Step::Name(name), Node::Table(entries)) => {
                    let at = if let Some(at) = entries.iter().position(|(k, _)| k == name) {
                        at
                    } else if last || (depth == 0 && steps.len() == 2) || depth > 1 {
                        let node = if last { Node::Flag(false) } else { Node::Table(Vec::new()) };
                        entries.push((name.clone(), Item { node, origin: Origin::Set, raw: None, spread: None }));
                        entries.len() - 1
                    } else {
                        let known: Vec<&str> = entries.iter().map(|(k, _)| k.as_str()).collect();
                        return Err(fail(format!("there is no '{name}' in {here}"), suggestion(name, &known)));
                    };
                    path = join(&path, name);
                    node = &mut entries[at].1;
                }
                (Step::Index(n), Node::List(items)) => {
                    let count = items.len();
                    node = items.get_mut(n.wrapping_sub(1)).ok_or_else(|| {
                        fail(format!("{here} has no entry number {n}"), format!("it has {count}; they are counted from 1"))
                    })?;
                    path = format!("{path}[{n}]");
                }
                (step, other) => {
                    let what = match step {
                        Step::Name(name) => format!("{here} is {} and has no key '{name}'", kind(other)),
                        Step::Index(n) => format!("{here} is {} and has no entry number {n}", kind(other)),
                    };
                    return Err(fail(what, "set the key itself, or a table or list in it".into()));
                }
            }
        }
        *node = match DeValue::parse(value) {
            Ok(parsed) => item(parsed.get_ref(), Origin::Set, &|_| Origin::Set),
            Err(_) => Item::text(value.trim().to_string(), Origin::Set),
        };
        node.raw = Some(value.trim().to_string());
        for part in ["\n--set ", key, " = ", value] {
            self.hasher.update(part.as_bytes());
        }
        Ok(())
    }

    /// SHA-256 of the text and of every `--set`, in hexadecimal.
    pub fn hash(&self) -> String {
        self.hasher.clone().finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The outermost table.
    pub fn root(&self) -> Section<'_> {
        self.section(&self.root, String::new())
    }

    fn section<'a>(&'a self, item: &'a Item, key: String) -> Section<'a> {
        let entries: &[(String, Item)] = if let Node::Table(entries) = &item.node { entries } else { &[] };
        Section { document: self, entries, origin: item.origin, key, asked: RefCell::default() }
    }

    /// Everything marked as assumed, in the order of the file.
    ///
    /// # Errors
    /// An `assumed` that is neither text nor a table of texts, or that names a key that is not there.
    pub fn assumptions(&self) -> Result<Vec<Assumed>> {
        let mut found = Vec::new();
        self.collect_assumed(&self.root, "", &mut found)?;
        Ok(found)
    }

    fn collect_assumed(&self, item: &Item, key: &str, found: &mut Vec<Assumed>) -> Result<()> {
        match &item.node {
            Node::List(items) => {
                for (i, item) in items.iter().enumerate() {
                    self.collect_assumed(item, &format!("{key}[{}]", i + 1), found)?;
                }
            }
            Node::Table(entries) => {
                for (name, entry) in entries {
                    if name == ASSUMED {
                        self.marked(entry, item, &join(key, ASSUMED), key, found)?;
                    } else {
                        self.collect_assumed(entry, &join(key, name), found)?;
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads one `assumed` entry (`mark`) against the item it speaks about.
    fn marked(&self, mark: &Item, about: &Item, at: &str, key: &str, found: &mut Vec<Assumed>) -> Result<()> {
        let help = "write assumed = \"reason\" or assumed = { key = \"reason\" }";
        match &mark.node {
            Node::Text(reason) if !reason.trim().is_empty() => {
                found.push(Assumed { key: key.to_string(), value: about.to_string(), reason: reason.clone() });
                Ok(())
            }
            Node::Table(marks) => marks.iter().try_for_each(|(name, mark)| {
                let (mut node, mut path) = (about, key.to_string());
                for step in name.split('.') {
                    let entries: &[(String, Item)] = if let Node::Table(entries) = &node.node { entries } else { &[] };
                    let Some((_, next)) = entries.iter().find(|(k, _)| k == step) else {
                        let known: Vec<&str> = entries.iter().map(|(k, _)| k.as_str()).filter(|k| *k != ASSUMED).collect();
                        return Err(self.error(mark, &join(at, name), "nothing of this name is given here").help(suggestion(step, &known)));
                    };
                    (node, path) = (next, join(&path, step));
                }
                self.marked(mark, node, &join(at, name), &path, found)
            }),
            _ => Err(self.error(mark, at, "the reason for an assumption must be text").help(help)),
        }
    }

    fn error(&self, item: &Item, key: &str, what: impl Into<String>) -> Error {
        self.place(item.origin, Error::input(what).read(abbreviate(&item.to_string())), key)
    }

    fn place(&self, origin: Origin, error: Error, key: &str) -> Error {
        match origin {
            Origin::Line(line) => error.in_file(&self.file).at_line(line).at_key(key),
            Origin::Set => error.in_file(&self.file).at_key(format!("--set {key}")),
        }
    }
}

/// One table of the file.
#[derive(Debug)]
pub struct Section<'a> {
    document: &'a Document,
    entries: &'a [(String, Item)],
    origin: Origin,
    key: String,
    asked: RefCell<Vec<String>>,
}

impl<'a> Section<'a> {
    /// Dotted key of this table; empty for the outermost.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Line of the table, from 1; 0 for a table made by a `--set`.
    pub fn line(&self) -> usize {
        if let Origin::Line(line) = self.origin { line } else { 0 }
    }

    /// The value under `key`, if there is one.
    pub fn opt(&self, key: &str) -> Option<Value<'a>> {
        self.ask(key);
        let (_, item) = self.entries.iter().find(|(name, _)| name == key)?;
        Some(Value { document: self.document, item, key: join(&self.key, key) })
    }

    /// The value under `key`.
    ///
    /// # Errors
    /// The key is missing.
    pub fn value(&self, key: &str) -> Result<Value<'a>> {
        self.opt(key).ok_or_else(|| self.missing(key))
    }

    /// Whether `key` is given.
    pub fn has(&self, key: &str) -> bool {
        self.opt(key).is_some()
    }

    /// The keys given, in the order of the file, without `assumed`.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.entries.iter().map(|(name, _)| name.as_str()).filter(|name| *name != ASSUMED)
    }

    /// The one of `keys` that is given, `None` if none is.
    ///
    /// # Errors
    /// More than one is given.
    pub fn one_of<'k>(&self, keys: &[&'k str]) -> Result<Option<&'k str>> {
        let mut given = keys.iter().copied().filter(|key| self.has(key));
        let first = given.next();
        match (first, given.next()) {
            (Some(a), Some(b)) => Err(self.error_at(b, format!("'{a}' and '{b}' exclude each other")).help("keep one of them")),
            _ => Ok(first),
        }
    }

    /// An error placed at `key`, with the value of the key if there is one.
    pub fn error_at(&self, key: &str, what: impl Into<String>) -> Error {
        match self.opt(key) {
            Some(value) => value.error(what),
            None => self.document.place(self.origin, Error::input(what), &join(&self.key, key)),
        }
    }

    /// An error placed at this table.
    pub fn error(&self, what: impl Into<String>) -> Error {
        let key = if self.key.is_empty() { "the file as a whole" } else { &self.key };
        self.document.place(self.origin, Error::input(what), key)
    }

    fn missing(&self, key: &str) -> Error {
        let unknown: Vec<&str> = self.keys().filter(|name| !self.asked.borrow().iter().any(|a| a == name)).collect();
        let help = match did_you_mean(key, unknown) {
            Some(meant) => format!("'{meant}' is given here; is '{key}' meant?"),
            None => format!("add '{key}'"),
        };
        self.error_at(key, format!("'{key}' is missing")).help(help)
    }

    fn ask(&self, key: &str) {
        let mut asked = self.asked.borrow_mut();
        if !asked.iter().any(|k| k == key) {
            asked.push(key.to_string());
        }
    }

    /// Ends the reading of this table.
    ///
    /// # Errors
    /// Keys that nobody asked for.
    pub fn finish(self) -> Result<()> {
        let asked = self.asked.borrow();
        let known: Vec<&str> = asked.iter().map(String::as_str).collect();
        let mut unknown = (self.entries.iter().filter(|(name, _)| name != ASSUMED && !asked.contains(name))).map(|(name, item)| {
            self.document.error(item, &join(&self.key, name), format!("unknown key '{name}'")).help(suggestion(name, &known))
        });
        unknown.next().map_or(Ok(()), |first| Err(first.and(unknown)))
    }
}

/// Accessors of one kind of value: required under its own name, optional with `opt_` before it.
macro_rules! accessors {
    ($($(#[$doc:meta])* $name:ident $opt:ident ($($arg:ident: $ty:ty),*) -> $out:ty;)*) => {
        impl<'a> Section<'a> {$(
            $(#[$doc])*
            ///
            /// # Errors
            /// Missing, or not of this kind; see [`Value`].
            pub fn $name(&self, key: &str, $($arg: $ty),*) -> Result<$out> {
                self.value(key)?.$name($($arg),*)
            }

            $(#[$doc])*
            /// `None` if the key is not given.
            ///
            /// # Errors
            /// Not of this kind; see [`Value`].
            pub fn $opt(&self, key: &str, $($arg: $ty),*) -> Result<Option<$out>> {
                self.opt(key).map(|value| value.$name($($arg),*)).transpose()
            }
        )*}
    };
}

accessors! {
    /// Text.
    text opt_text() -> String;
    /// One of `options`; an index into them.
    choice opt_choice(options: &[&str]) -> usize;
    /// A quantity with its unit, in SI.
    quantity opt_quantity(dimension: Dimension) -> f64;
    /// A quantity above zero, in SI.
    positive opt_positive(dimension: Dimension) -> f64;
    /// A number without unit, or in percent.
    number opt_number() -> f64;
    /// A whole number of at least `least`.
    integer opt_integer(least: usize) -> usize;
    /// `true` or `false`.
    flag opt_flag() -> bool;
    /// A list of quantities in SI, `count` of them if `count` is given.
    quantities opt_quantities(dimension: Dimension, count: Option<usize>) -> Vec<f64>;
    /// Three quantities in SI.
    triple opt_triple(dimension: Dimension) -> [f64; 3];
    /// A range `[low, high]`, low < high, in SI.
    range opt_range(dimension: Dimension) -> (f64, f64);
    /// A table `[[x, y], ...]` with strictly ascending x, in SI.
    curve opt_curve(x: Dimension, y: Dimension) -> Vec<(f64, f64)>;
    /// A list of texts.
    texts opt_texts() -> Vec<String>;
    /// A list of anything.
    list opt_list() -> Vec<Value<'a>>;
    /// A table.
    section opt_section() -> Section<'a>;
}

impl<'a> Section<'a> {
    /// The named tables under `key` (`[part.bed]`, `[part.beam]`, ...) in the order of the file; empty if there is
    /// none.
    ///
    /// # Errors
    /// `key` or one of its entries is not a table.
    pub fn sections(&self, key: &str) -> Result<Vec<(String, Section<'a>)>> {
        let Some(all) = self.opt_section(key)? else { return Ok(Vec::new()) };
        all.keys().map(|name| Ok((name.to_string(), all.section(name)?))).collect()
    }

    /// The table under `key`, or an empty one in its place.
    ///
    /// # Errors
    /// `key` is not a table.
    pub fn section_or_empty(&self, key: &str) -> Result<Section<'a>> {
        let empty =
            || Section { document: self.document, entries: &[], origin: self.origin, key: join(&self.key, key), asked: RefCell::default() };
        Ok(self.opt_section(key)?.unwrap_or_else(empty))
    }

    /// The tables in a list (`[[blocks]]` or `blocks = [{...}, ...]`); empty if there is none.
    ///
    /// # Errors
    /// `key` is not a list of tables.
    pub fn tables(&self, key: &str) -> Result<Vec<Section<'a>>> {
        self.opt_list(key)?.unwrap_or_default().iter().map(Value::section).collect()
    }
}

/// Help text for a name that is not among `known`.
pub fn suggestion(name: &str, known: &[&str]) -> String {
    let list = if known.is_empty() { "none".to_string() } else { known.join(", ") };
    match did_you_mean(name, known.iter().copied()) {
        Some(meant) => format!("did you mean '{meant}'? Known here: {list}"),
        None => format!("known here: {list}"),
    }
}
