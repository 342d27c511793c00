//! One value of a file, and the types it can be read as.

use super::tree::{Item, Node, Origin, abbreviate, kind};
use super::{Document, Section, suggestion};
use crate::error::{Error, Result};
use crate::units::{self, Dimension};

/// One value of the file.
#[derive(Debug, Clone)]
pub struct Value<'a> {
    pub(super) document: &'a Document,
    pub(super) item: &'a Item,
    pub(super) key: String,
}

impl<'a> Value<'a> {
    /// Dotted key.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Line, from 1; 0 for a value given by a `--set`.
    pub fn line(&self) -> usize {
        if let Origin::Line(line) = self.item.origin { line } else { 0 }
    }

    /// An error placed at this value.
    pub fn error(&self, what: impl Into<String>) -> Error {
        self.document.error(self.item, &self.key, what)
    }

    /// Places an error that does not know its place yet.
    pub fn place(&self, error: Error) -> Error {
        self.document.place(self.item.origin, error.read(abbreviate(&self.item.to_string())), &self.key)
    }

    fn wrong(&self, wanted: &str, example: &str) -> Error {
        self.error(format!("{wanted} is wanted here, this is {}", kind(&self.item.node))).help(format!("write for example {example}"))
    }

    /// Whether the value is a list.
    pub fn is_list(&self) -> bool {
        matches!(self.item.node, Node::List(_))
    }

    /// Whether the value is a table.
    pub fn is_table(&self) -> bool {
        matches!(self.item.node, Node::Table(_))
    }

    /// Whether the value is a string.
    pub fn is_text(&self) -> bool {
        matches!(self.item.node, Node::Text(_))
    }

    /// Whether the value is a number.
    pub fn is_number(&self) -> bool {
        matches!(self.item.node, Node::Integer(..) | Node::Float(_))
    }

    /// Text.
    ///
    /// # Errors
    /// The value is not a string.
    pub fn text(&self) -> Result<String> {
        match (&self.item.node, &self.item.raw) {
            (Node::Text(text), _) | (_, Some(text)) => Ok(text.clone()),
            _ => Err(self.wrong("text", "\"...\" in quotes")),
        }
    }

    /// The text of a string together with its stated uncertainty.
    ///
    /// # Errors
    /// The value is not a string.
    pub fn text_with_spread(&self) -> Result<String> {
        let text = self.text()?;
        Ok(self.item.spread.as_ref().map_or(text.clone(), |spread| spread.written(&text)))
    }

    /// The index of the text in `options`.
    ///
    /// # Errors
    /// The text is none of `options`.
    pub fn choice(&self, options: &[&str]) -> Result<usize> {
        let text = self.text()?;
        options
            .iter()
            .position(|option| *option == text)
            .ok_or_else(|| self.error(format!("'{text}' is not known here")).help(suggestion(&text, options)))
    }

    /// A quantity in SI. A pure number may stand without quotes.
    ///
    /// # Errors
    /// No number, no unit, another unit, not finite.
    pub fn quantity(&self, dimension: Dimension) -> Result<f64> {
        let text = match &self.item.node {
            Node::Text(text) | Node::Integer(text, _) | Node::Float(text) => text,
            _ => return Err(self.wrong("a quantity", dimension.example())),
        };
        let value = units::parse(text, dimension).map_err(|error| self.place(error))?;
        if value.is_finite() { Ok(value) } else { Err(self.error("the number is too large")) }
    }

    /// A quantity above zero, in SI.
    ///
    /// # Errors
    /// Errors of [`Value::quantity`], or a quantity that is not positive.
    pub fn positive(&self, dimension: Dimension) -> Result<f64> {
        let value = self.quantity(dimension)?;
        if value > 0.0 {
            return Ok(value);
        }
        Err(self.error("this must be larger than zero").help(format!("write for example {}", dimension.example())))
    }

    /// A number without unit, or in percent.
    ///
    /// # Errors
    /// Errors of [`Value::quantity`].
    pub fn number(&self) -> Result<f64> {
        self.quantity(Dimension::NUMBER)
    }

    /// A whole number of at least `least`.
    ///
    /// # Errors
    /// The value is not a whole number, or is too small.
    pub fn integer(&self, least: usize) -> Result<usize> {
        if let Node::Integer(_, number) = &self.item.node {
            let whole = number.and_then(|n| usize::try_from(n).ok()).filter(|n| *n >= least);
            return whole.ok_or_else(|| {
                self.error(format!("a whole number of at least {least} is wanted here")).help(format!("for example {least}"))
            });
        }
        Err(self.wrong("a whole number", "12, without quotes"))
    }

    /// `true` or `false`.
    ///
    /// # Errors
    /// The value is neither `true` nor `false`.
    pub fn flag(&self) -> Result<bool> {
        if let Node::Flag(flag) = self.item.node { Ok(flag) } else { Err(self.wrong("true or false", "true, without quotes")) }
    }

    /// A list of anything.
    ///
    /// # Errors
    /// The value is not a list.
    pub fn list(&self) -> Result<Vec<Value<'a>>> {
        let Node::List(items) = &self.item.node else { return Err(self.wrong("a list", "[..., ...]")) };
        let document = self.document;
        Ok(items.iter().enumerate().map(|(i, item)| Value { document, item, key: format!("{}[{}]", self.key, i + 1) }).collect())
    }

    /// A list of texts.
    ///
    /// # Errors
    /// The value is not a list of texts.
    pub fn texts(&self) -> Result<Vec<String>> {
        self.list()?.iter().map(Value::text).collect()
    }

    /// A list of quantities in SI, `count` of them if `count` is given.
    ///
    /// # Errors
    /// The value is not a list, has another length, or an entry is not a quantity of this dimension.
    pub fn quantities(&self, dimension: Dimension, count: Option<usize>) -> Result<Vec<f64>> {
        let list = self.list()?;
        if let Some(count) = count.filter(|count| *count != list.len()) {
            let example = vec![dimension.example().split(" or ").next().unwrap_or_default(); count].join(", ");
            return Err(self
                .error(format!("{count} entries are wanted here, not {}", list.len()))
                .help(format!("for example [{example}]")));
        }
        list.iter().map(|value| value.quantity(dimension)).collect()
    }

    /// Three quantities in SI.
    ///
    /// # Errors
    /// Errors of [`Value::quantities`].
    pub fn triple(&self, dimension: Dimension) -> Result<[f64; 3]> {
        let values = self.quantities(dimension, Some(3))?;
        Ok([values[0], values[1], values[2]])
    }

    /// A range `[low, high]` in SI.
    ///
    /// # Errors
    /// Errors of [`Value::quantities`], or low is not below high.
    pub fn range(&self, dimension: Dimension) -> Result<(f64, f64)> {
        let values = self.quantities(dimension, Some(2))?;
        if values[0] < values[1] {
            return Ok((values[0], values[1]));
        }
        Err(self.error("the first end of a range must be below the second").help("write [lowest, highest]"))
    }

    /// A table `[[x, y], ...]` in SI with strictly ascending x.
    ///
    /// # Errors
    /// An entry is not a pair of quantities, x does not ascend, or the table is empty.
    pub fn curve(&self, x: Dimension, y: Dimension) -> Result<Vec<(f64, f64)>> {
        let mut curve: Vec<(f64, f64)> = Vec::new();
        for pair in self.list()? {
            let entries = pair.list()?;
            let [first, second] = entries.as_slice() else {
                return Err(pair.error("a pair is wanted here").help(format!("for example [{}, {}]", x.example(), y.example())));
            };
            let point = (first.quantity(x)?, second.quantity(y)?);
            if curve.last().is_some_and(|last| last.0 >= point.0) {
                return Err(first.error("the first column must ascend").help("sort the pairs and give each value once"));
            }
            curve.push(point);
        }
        if curve.is_empty() {
            return Err(self.error("the table is empty").help(format!("write [[{}, {}], ...]", x.example(), y.example())));
        }
        Ok(curve)
    }

    /// A table.
    ///
    /// # Errors
    /// The value is not a table.
    pub fn section(&self) -> Result<Section<'a>> {
        if !self.is_table() {
            return Err(self.wrong("a table", &format!("[{}] with keys below it, or {{ key = ... }}", self.key)));
        }
        Ok(self.document.section(self.item, self.key.clone()))
    }
}
