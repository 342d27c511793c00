//! Tables of a report.

use super::Tone;
use crate::chart::style::fixed;

/// Alignment of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Align {
    /// Texts.
    #[default]
    Left,
    /// Numbers: digits of equal width, so that they stand under each other.
    Right,
    /// Short words.
    Centre,
}

/// One cell.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableCell {
    /// Text of the cell.
    pub text: String,
    /// Colour of the cell.
    pub tone: Tone,
}

impl TableCell {
    /// A number with this many decimals; a dash where it is not finite.
    pub fn number(value: f64, decimals: usize) -> Self {
        fixed(value, decimals).into()
    }

    /// A number where it is known, a dash where not.
    pub fn optional(value: Option<f64>, decimals: usize) -> Self {
        Self::number(value.unwrap_or(f64::NAN), decimals)
    }

    /// With this colour.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }
}

impl<T: Into<String>> From<T> for TableCell {
    fn from(text: T) -> Self {
        Self { text: text.into(), tone: Tone::Plain }
    }
}

/// A table: columns with their alignment, and rows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ReportTable {
    pub(super) columns: Vec<(String, Align)>,
    pub(super) rows: Vec<Vec<TableCell>>,
    pub(super) total: Option<Vec<TableCell>>,
    pub(super) caption: String,
    pub(super) folded: Option<String>,
}

impl ReportTable {
    /// An empty table with these columns.
    pub fn new<T: Into<String>>(columns: impl IntoIterator<Item = (T, Align)>) -> Self {
        Self { columns: columns.into_iter().map(|(title, align)| (title.into(), align)).collect(), ..Self::default() }
    }

    /// Adds a row; missing cells are left empty, cells beyond the last column are left out.
    pub fn row(&mut self, cells: impl IntoIterator<Item = TableCell>) -> &mut Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    /// The last row, set apart: sums.
    pub fn total(&mut self, cells: impl IntoIterator<Item = TableCell>) -> &mut Self {
        self.total = Some(cells.into_iter().collect());
        self
    }

    /// Sets the caption.
    pub fn caption(&mut self, text: impl Into<String>) -> &mut Self {
        self.caption = text.into();
        self
    }

    /// Hides the table behind this line until the reader opens it; it is printed if it is open.
    pub fn folded(&mut self, summary: impl Into<String>) -> &mut Self {
        self.folded = Some(summary.into());
        self
    }

    /// Rows, the total not counted.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether it has no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}
