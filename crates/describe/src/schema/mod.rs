//! The vocabulary of a schema: form, default and reach of a key of a TOML file, and a line about it.
//!
//! A [`KeyTable`] is plain data. Reading ([`Key::read`] and its siblings), the check for unknown keys
//! ([`KeyTable::check`]), the list of all mistakes ([`KeyTable::mistakes`]), the search by a dotted key ([`KeyTable::find`]), the tables of the documentation
//! ([`KeyTable::to_markdown`]) and the JSON Schema for editors ([`KeyTable::to_json_schema`]) all come from it.
//! The schema of machine files is [`crate::machine::SCHEMA`].
//!
//! ```
//! use coldplate_describe::machine::SCHEMA;
//! let found = SCHEMA.find(&["chamber", "pressure"]).unwrap();
//! assert_eq!(found.key.default_toml().as_deref(), Some("\"0.0 Pa\""));
//! assert!(SCHEMA.find(&["contact", "motor", "conductence"]).is_none());
//! ```

mod check;
mod json;
mod markdown;
mod mistakes;
mod read;

use coldplate_base::units::{self, Dimension};

/// One table of a file: its possible keys.
#[derive(Debug, Clone, Copy)]
pub struct KeyTable {
    /// One line about the table.
    pub doc: &'static str,
    /// Keys of the table, in groups that several tables may share.
    pub keys: &'static [&'static [Key]],
    /// Keys of which exactly one must be given; empty if the table has no choice of this kind.
    pub one_of: &'static [&'static str],
}

/// One key of a table.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Name of the key.
    pub name: &'static str,
    /// Form of the value.
    pub form: ValueForm,
    /// Default of the key.
    pub default: Unstated,
    /// Whether the key must be given.
    pub is_required: bool,
    /// Whether the number must be larger than zero.
    pub is_positive: bool,
    /// Reach of a change of the value.
    pub reach: ChangeReach,
    /// Whether the key is among the parameters that users ask about first.
    pub is_usual: bool,
    /// Other names that people use for the key, for "did you mean".
    pub also: &'static [&'static str],
    /// One line about the key, Markdown.
    pub doc: &'static str,
}

/// Form of a value.
#[derive(Debug, Clone, Copy)]
pub enum ValueForm {
    /// Text.
    Text,
    /// The name of something in the file: of a part, a face, a sensor.
    Name(&'static str),
    /// `true` or `false`.
    Flag,
    /// `true`; the key is left out otherwise.
    True,
    /// A whole number of at least this.
    Whole(usize),
    /// A number without unit, or in percent.
    Number,
    /// A number with a unit.
    Quantity(Unit),
    /// A number with a unit of any dimension, stated in the file.
    AnyQuantity,
    /// A quantity, or an expression of the condition.
    Formula(Unit),
    /// One of these words.
    Word(&'static [&'static str]),
    /// A list of entries of one form, with a fixed number of entries if one is stated.
    List(&'static ValueForm, Option<usize>),
    /// Pairs `[[x, y], ...]` with ascending x.
    Curve(Unit, Unit),
    /// A name, or a list of names, nested to any depth.
    Nested(&'static str),
    /// Any of these forms.
    Either(&'static [ValueForm]),
    /// A table.
    Table(&'static KeyTable),
    /// Tables under names of the user's choice: `[part.bed]`, `[part.beam]`.
    Named(&'static KeyTable),
    /// A list of tables.
    Tables(&'static KeyTable),
    /// A table whose entries have names of the user's choice and this form.
    Free(&'static ValueForm),
}

/// A dimension with the unit its values are shown in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit {
    /// Dimension.
    pub dimension: Dimension,
    /// Unit, as in the files.
    pub name: &'static str,
}

/// Default of a key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unstated {
    /// No default: the key must be given, or its absence means that the feature is absent.
    Nothing,
    /// A number, SI.
    Si(f64),
    /// A whole number.
    Whole(usize),
    /// A word or a formula.
    Text(&'static str),
    /// `true` or `false`.
    Flag(bool),
    /// A default that follows from other keys, in words.
    Follows(&'static str),
}

/// Reach of a change of a key. Stages of the computation before it stay unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChangeReach {
    /// The geometry, and with it the cells.
    Mesh,
    /// Conductors, capacities, surfaces.
    Network,
    /// The law of one contact.
    Contact,
    /// The factor on a channel's film, or its loss coefficient.
    Channel,
    /// Heats, flows and given temperatures.
    Load,
    /// The load; but a change from zero reaches the network, which omits elements that zero makes idle.
    LoadUnlessZero,
    /// Nothing that is solved: names, limits, remarks.
    Report,
}

/// A key found by its dotted name, and the form expected there.
#[derive(Debug, Clone, Copy)]
pub struct FoundKey {
    /// The key; for an entry with a name of the user's choice, the key of the table around it.
    pub key: &'static Key,
    /// Form of the value.
    pub form: ValueForm,
}

impl Unit {
    /// A dimension shown in a unit.
    pub const fn of(dimension: Dimension, name: &'static str) -> Self {
        Self { dimension, name }
    }
}

impl Key {
    /// An optional key without default, whose changes reach the network.
    pub const fn new(name: &'static str, form: ValueForm, doc: &'static str) -> Self {
        Self {
            name,
            form,
            default: Unstated::Nothing,
            is_required: false,
            is_positive: false,
            reach: ChangeReach::Network,
            is_usual: false,
            also: &[],
            doc,
        }
    }

    /// Makes the key required.
    pub const fn required(mut self) -> Self {
        self.is_required = true;
        self
    }

    /// Requires a number larger than zero.
    pub const fn positive(mut self) -> Self {
        self.is_positive = true;
        self
    }

    /// Sets the default.
    pub const fn or(mut self, default: Unstated) -> Self {
        self.default = default;
        self
    }

    /// Sets the reach.
    pub(crate) const fn reaching(mut self, reach: ChangeReach) -> Self {
        self.reach = reach;
        self
    }

    /// Puts the key among the parameters that users ask about first.
    pub const fn usual(mut self) -> Self {
        self.is_usual = true;
        self
    }

    /// Sets other names that people use for the key.
    pub const fn also(mut self, names: &'static [&'static str]) -> Self {
        self.also = names;
        self
    }

    /// The default in TOML, as in the file; `None` if there is none or it follows from other keys.
    pub fn default_toml(&self) -> Option<String> {
        match self.default {
            Unstated::Nothing | Unstated::Follows(_) => None,
            Unstated::Whole(number) => Some(number.to_string()),
            Unstated::Flag(flag) => Some(flag.to_string()),
            Unstated::Text(text) => Some(format!("\"{text}\"")),
            Unstated::Si(si) => Some(match self.form.unit().filter(|unit| unit.dimension != Dimension::NUMBER) {
                Some(unit) => format!("\"{:?} {}\"", units::express(si, unit.name, unit.dimension).unwrap_or(si), unit.name),
                None => format!("{si:?}"),
            }),
        }
    }
}

impl ValueForm {
    /// The unit of a quantity or a formula, if one of the forms is one.
    pub fn unit(&self) -> Option<Unit> {
        match self {
            Self::Quantity(unit) | Self::Formula(unit) => Some(*unit),
            Self::Either(forms) => forms.iter().find_map(ValueForm::unit),
            _ => None,
        }
    }

    /// The unit of a formula, if a formula is allowed.
    pub fn formula(&self) -> Option<Unit> {
        match self {
            Self::Formula(unit) => Some(*unit),
            Self::Either(forms) => forms.iter().find_map(ValueForm::formula),
            _ => None,
        }
    }

    /// Whether a table of pairs is allowed.
    pub fn has_curve(&self) -> bool {
        match self {
            Self::Curve(..) => true,
            Self::Either(forms) => forms.iter().any(ValueForm::has_curve),
            _ => false,
        }
    }

    /// Whether a word is allowed.
    pub fn has_word(&self, word: &str) -> bool {
        match self {
            Self::Word(words) => words.contains(&word),
            Self::Either(forms) => forms.iter().any(|form| form.has_word(word)),
            _ => false,
        }
    }

    /// Whether the key counts something, and therefore cannot vary continuously.
    pub fn counts(&self) -> bool {
        match self {
            Self::Whole(_) => true,
            Self::List(inner, _) => inner.counts(),
            _ => false,
        }
    }
}

impl KeyTable {
    /// All keys in order.
    pub fn keys(&self) -> impl Iterator<Item = &'static Key> + use<> {
        self.keys.iter().flat_map(|group| group.iter())
    }

    /// The key of this name.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys().find(|key| key.name == name)
    }

    /// The key that a dotted key leads to; numbers of list entries are left out of `names`.
    pub fn find(&self, names: &[&str]) -> Option<FoundKey> {
        let (name, rest) = names.split_first()?;
        let key = self.key(name)?;
        inside(key, key.form, rest)
    }

    /// Every key that is no table itself, with its pattern: `*` stands for names of the user's choice,
    /// `contact.*.conductance`.
    pub fn patterns(&self) -> Vec<(String, &'static Key)> {
        let mut found = Vec::new();
        collect(self, "", &mut found);
        found
    }
}

fn inside(key: &'static Key, form: ValueForm, names: &[&str]) -> Option<FoundKey> {
    let Some((_, rest)) = names.split_first() else { return Some(FoundKey { key, form }) };
    match form {
        ValueForm::Table(table) | ValueForm::Tables(table) => table.find(names),
        ValueForm::Named(table) if rest.is_empty() => Some(FoundKey { key, form: ValueForm::Table(table) }),
        ValueForm::Named(table) => table.find(rest),
        ValueForm::Free(inner) => inside(key, *inner, rest),
        ValueForm::Either(forms) => forms.iter().find_map(|form| inside(key, *form, names)),
        _ => None,
    }
}

fn collect(table: &KeyTable, path: &str, found: &mut Vec<(String, &'static Key)>) {
    for key in table.keys() {
        let here = if path.is_empty() { key.name.to_string() } else { format!("{path}.{}", key.name) };
        collect_form(key, &key.form, here, found);
    }
}

fn collect_form(key: &'static Key, form: &ValueForm, path: String, found: &mut Vec<(String, &'static Key)>) {
    match form {
        ValueForm::Table(table) | ValueForm::Tables(table) => collect(table, &path, found),
        ValueForm::Named(table) => collect(table, &format!("{path}.*"), found),
        ValueForm::Free(inner) => collect_form(key, inner, format!("{path}.*"), found),
        ValueForm::Either(forms) => {
            found.push((path.clone(), key));
            for form in forms.iter().filter(|f| matches!(f, ValueForm::Table(_) | ValueForm::Tables(_) | ValueForm::Named(_))) {
                collect_form(key, form, path.clone(), found);
            }
        }
        _ => found.push((path, key)),
    }
}
