//! The parsed file as a tree that remembers lines and the order of the file, and how keys are written.

use std::fmt;

use toml::de::DeValue;

use super::spread::StatedSpread;

/// The key under which a table marks its numbers as assumed.
pub(super) const ASSUMED: &str = "assumed";

/// Place at which an item was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Origin {
    Line(usize),
    Set,
}

#[derive(Debug, Clone)]
pub(super) enum Node {
    Text(String),
    Integer(String, Option<i64>),
    Float(String),
    Flag(bool),
    Date(String),
    List(Vec<Item>),
    /// Entries in the order of the file.
    Table(Vec<(String, Item)>),
}

#[derive(Debug, Clone)]
pub(super) struct Item {
    pub(super) node: Node,
    pub(super) origin: Origin,
    /// The text given by a `--set`; it is also used where a string is expected.
    pub(super) raw: Option<String>,
    /// Uncertainty of the number at this item.
    pub(super) spread: Option<StatedSpread>,
}

impl Item {
    /// A text item. A number stated as uncertain is stored as the plain number, with its uncertainty in `spread`.
    pub(super) fn text(text: String, origin: Origin) -> Self {
        match StatedSpread::split(&text) {
            Some((plain, spread)) => Self { node: Node::Text(plain), origin, raw: None, spread: Some(spread) },
            None => Self { node: Node::Text(text), origin, raw: None, spread: None },
        }
    }
}

/// `key.name`, with quotes where TOML needs them.
pub(super) fn join(key: &str, name: &str) -> String {
    let name = quoted(name);
    if key.is_empty() { name } else { format!("{key}.{name}") }
}

/// A name as a step of a dotted key: unchanged if TOML allows it bare, otherwise in quotes.
pub fn quoted(name: &str) -> String {
    if !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
        return name.to_string();
    }
    // Single quotes need no escapes: code that splits the key finds the name unchanged.
    if name.contains(['"', '\\']) && !name.chars().any(|c| c == '\'' || c.is_control()) {
        return format!("'{name}'");
    }
    let escaped = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04X}", c as u32),
        c => c.to_string(),
    };
    format!("\"{}\"", name.chars().map(escaped).collect::<String>())
}

pub(super) fn abbreviate(text: &str) -> String {
    /// Longest value that is shown whole, in characters. Chosen: about one line of a terminal.
    const MOST: usize = 120;
    if text.chars().count() <= MOST { text.to_string() } else { text.chars().take(MOST).chain("...".chars()).collect() }
}

pub(super) fn kind(node: &Node) -> &'static str {
    match node {
        Node::Text(_) => "text",
        Node::Integer(..) | Node::Float(_) => "a number",
        Node::Flag(_) => "true or false",
        Node::Date(_) => "a date",
        Node::List(_) => "a list",
        Node::Table(_) => "a table",
    }
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.node {
            Node::Text(text) => write!(f, "\"{text}\""),
            Node::Integer(text, _) | Node::Float(text) | Node::Date(text) => write!(f, "{text}"),
            Node::Flag(flag) => write!(f, "{flag}"),
            Node::List(items) => {
                let items: Vec<String> = items.iter().map(ToString::to_string).collect();
                write!(f, "[{}]", items.join(", "))
            }
            Node::Table(entries) => {
                let shown = entries.iter().filter(|(name, _)| name != ASSUMED);
                let entries: Vec<String> = shown.map(|(name, item)| format!("{} = {item}", join("", name))).collect();
                write!(f, "{{ {} }}", entries.join(", "))
            }
        }
    }
}

/// Copies a parsed value; tables are sorted into the order of the file.
pub(super) fn item(value: &DeValue<'_>, origin: Origin, origin_of: &dyn Fn(usize) -> Origin) -> Item {
    let node = match value {
        DeValue::String(text) => return Item::text(text.to_string(), origin),
        DeValue::Integer(number) => Node::Integer(number.to_string(), i64::from_str_radix(number.as_str(), number.radix()).ok()),
        DeValue::Float(number) => Node::Float(number.to_string()),
        DeValue::Boolean(flag) => Node::Flag(*flag),
        DeValue::Datetime(date) => Node::Date(date.to_string()),
        DeValue::Array(items) => {
            Node::List(items.iter().map(|entry| item(entry.get_ref(), origin_of(entry.span().start), origin_of)).collect())
        }
        DeValue::Table(table) => {
            let mut entries: Vec<_> = table.iter().collect();
            entries.sort_by_key(|(name, _)| name.span().start);
            let copy = |name: &toml::Spanned<_>, entry: &toml::Spanned<_>| item(entry.get_ref(), origin_of(name.span().start), origin_of);
            Node::Table(entries.into_iter().map(|(name, entry)| (name.get_ref().to_string(), copy(name, entry))).collect())
        }
    };
    Item { node, origin, raw: None, spread: None }
}

#[derive(Debug, PartialEq)]
pub(super) enum Step {
    Name(String),
    Index(usize),
}

/// Splits `a."b c".d[2]` into its steps.
pub(super) fn split_key(key: &str) -> Option<Vec<Step>> {
    let mut steps = Vec::new();
    let mut rest = key.trim();
    loop {
        let name;
        if let Some(quote) = rest.chars().next().filter(|c| matches!(c, '"' | '\'')) {
            let end = rest[1..].find(quote)? + 1;
            (name, rest) = (&rest[1..end], &rest[end + 1..]);
        } else {
            (name, rest) = rest.split_at(rest.find(['.', '[']).unwrap_or(rest.len()));
            if name.trim().is_empty() {
                return None;
            }
        }
        steps.push(Step::Name(name.trim().to_string()));
        while let Some(index) = rest.strip_prefix('[') {
            let end = index.find(']')?;
            steps.push(Step::Index(index[..end].trim().parse().ok()?));
            rest = &index[end + 1..];
        }
        match rest.strip_prefix('.') {
            Some(more) => rest = more,
            None => return rest.is_empty().then_some(steps),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_names_are_found_again() {
        for name in ["motor", "b c", "a.b", "a[1]", "x\"y", "it's", "a\\b", "m²", ""] {
            let steps = split_key(&format!("part.{}.box", quoted(name))).unwrap_or_else(|| panic!("{name}"));
            let names: Vec<&str> = steps.iter().map(|s| if let Step::Name(n) = s { n.as_str() } else { "" }).collect();
            assert_eq!(names, ["part", name, "box"]);
            let text = format!("{} = 1", quoted(name));
            assert!(toml::de::DeTable::parse(&text).unwrap().get_ref().iter().all(|(key, _)| key.get_ref() == name), "{text}");
        }
    }
}
