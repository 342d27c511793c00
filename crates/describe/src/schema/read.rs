//! Reading of values by the schema, with its defaults.

use super::{Key, Unstated, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

impl Key {
    /// The number under this key (SI), or its default.
    ///
    /// # Errors
    /// The value is no quantity of this dimension; it must be positive and is not; it is not given and has no default.
    pub fn read(&self, section: &Section<'_>) -> Result<f64> {
        match (section.has(self.name), self.default) {
            (false, Unstated::Si(default)) => Ok(default),
            _ if self.is_positive => section.positive(self.name, self.dimension()),
            _ => section.quantity(self.name, self.dimension()),
        }
    }

    /// The whole number under this key, or its default.
    ///
    /// # Errors
    /// The value is no whole number or too small; it is not given and has no default.
    pub(crate) fn read_whole(&self, section: &Section<'_>) -> Result<usize> {
        let least = if let ValueForm::Whole(least) = self.form { least } else { 0 };
        match (section.has(self.name), self.default) {
            (false, Unstated::Whole(default)) => Ok(default),
            _ => section.integer(self.name, least),
        }
    }

    /// The flag under this key, or its default.
    ///
    /// # Errors
    /// The value is neither `true` nor `false`; it is not given and has no default.
    pub(crate) fn read_flag(&self, section: &Section<'_>) -> Result<bool> {
        match (section.has(self.name), self.default) {
            (false, Unstated::Flag(default)) => Ok(default),
            _ => section.flag(self.name),
        }
    }

    /// The word under this key, or its default, as an index into the words of its form.
    ///
    /// # Errors
    /// The value is none of the words; it is not given and has no default.
    pub(crate) fn read_word(&self, section: &Section<'_>) -> Result<usize> {
        let words = if let ValueForm::Word(words) = self.form { words } else { &[] };
        match (section.has(self.name), self.default) {
            (false, Unstated::Text(default)) if words.contains(&default) => Ok(words.iter().position(|w| *w == default).unwrap_or(0)),
            _ => section.choice(self.name, words),
        }
    }

    /// Dimension of the quantity or formula under this key; otherwise the dimension of a pure number.
    pub fn dimension(&self) -> Dimension {
        self.form.unit().map_or(Dimension::NUMBER, |unit| unit.dimension)
    }
}
