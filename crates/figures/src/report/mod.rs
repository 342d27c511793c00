//! The report of a run: one HTML file that stands alone, with its figures inside.
//!
//! No requests to anywhere and no scripts, unless there is a page in a frame (a content security policy in the report forbids them),
//! one small style sheet that follows the reader's light or dark setting and prints what is not folded. Every text is escaped.
//!
//! ```
//! use coldplate_figures::report::{Align, KeyFigure, Report, ReportTable, TableCell, Tone};
//! let mut report = Report::new("Five-axis machine");
//! report.subtitle("200 runs at 120,000 cells");
//! report
//!     .section("Summary")
//!     .key_figures([KeyFigure::new("17.2 mK", "largest held-out error").tone(Tone::Good)])
//!     .paragraph("Heat in and out agree to 3e-11.");
//! let mut table = ReportTable::new([("sensor", Align::Left), ("measured [°C]", Align::Right), ("predicted [°C]", Align::Right)]);
//! table.row(["Y bearing seat".into(), TableCell::number(26.6, 1), TableCell::number(25.43, 2)]);
//! report.section("Predicted beside measured").table(table);
//! assert!(report.to_html().contains("<td class=\"right\">25.43</td>"));
//! ```

mod html;
mod table;

use std::path::Path;

pub use table::{Align, ReportTable, TableCell};

use crate::chart::{Figure, to_svg_string};
use coldplate_base::atomic_file;
use coldplate_base::error::Result;

/// Colour of a key figure, a cell or a note; the text must say it too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tone {
    /// No colour.
    #[default]
    Plain,
    /// Good: as it should be.
    Good,
    /// Uncertain: to be looked at.
    Uncertain,
    /// Bad: not as it should be.
    Bad,
}

/// A number set large enough to be seen first, and its meaning.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct KeyFigure {
    /// The value with its unit.
    pub value: String,
    /// Meaning of the value, in a few words.
    pub meaning: String,
    /// Colour of the value.
    pub tone: Tone,
}

impl KeyFigure {
    /// A key figure without colour.
    pub fn new(value: impl Into<String>, meaning: impl Into<String>) -> Self {
        Self { value: value.into(), meaning: meaning.into(), tone: Tone::Plain }
    }

    /// With this colour.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }
}

/// One piece of a section.
#[derive(Debug, Clone, PartialEq)]
enum Block {
    Heading(String),
    Lead(Tone, String),
    Paragraph(String),
    List(Vec<String>),
    Facts(Vec<(String, String)>),
    Table(ReportTable),
    Svg { markup: String, caption: String },
    KeyFigures(Vec<KeyFigure>),
    Note(Tone, String),
    Code(String),
    Page { html: String, title: String },
    Folded(String, Vec<Block>),
}

/// A section under its own heading. Every method adds one piece and returns the section again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReportSection {
    title: String,
    blocks: Vec<Block>,
}

impl ReportSection {
    fn add(&mut self, block: Block) -> &mut Self {
        self.blocks.push(block);
        self
    }

    /// A smaller heading inside the section.
    pub fn heading(&mut self, text: impl Into<String>) -> &mut Self {
        self.add(Block::Heading(text.into()))
    }

    /// The answer in a sentence, set large.
    pub fn lead(&mut self, tone: Tone, text: impl Into<String>) -> &mut Self {
        self.add(Block::Lead(tone, text.into()))
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: impl Into<String>) -> &mut Self {
        self.add(Block::Paragraph(text.into()))
    }

    /// A list of points; none adds nothing.
    pub fn list<T: Into<String>>(&mut self, points: impl IntoIterator<Item = T>) -> &mut Self {
        let points: Vec<String> = points.into_iter().map(Into::into).collect();
        if points.is_empty() { self } else { self.add(Block::List(points)) }
    }

    /// Names with their values: conditions, provenance, settings; none adds nothing.
    pub fn facts<K: Into<String>, V: Into<String>>(&mut self, facts: impl IntoIterator<Item = (K, V)>) -> &mut Self {
        let facts: Vec<(String, String)> = facts.into_iter().map(|(k, v)| (k.into(), v.into())).collect();
        if facts.is_empty() { self } else { self.add(Block::Facts(facts)) }
    }

    /// A page with scripts of its own in a frame, and a title for readers who do not see it.
    pub fn page(&mut self, html: impl Into<String>, title: impl Into<String>) -> &mut Self {
        self.add(Block::Page { html: html.into(), title: title.into() })
    }

    /// A table.
    pub fn table(&mut self, table: ReportTable) -> &mut Self {
        self.add(Block::Table(table))
    }

    /// Numbers to be seen first; none adds nothing.
    pub fn key_figures(&mut self, figures: impl IntoIterator<Item = KeyFigure>) -> &mut Self {
        let figures: Vec<KeyFigure> = figures.into_iter().collect();
        if figures.is_empty() { self } else { self.add(Block::KeyFigures(figures)) }
    }

    /// A remark set apart: [`Tone::Bad`] and [`Tone::Uncertain`] are marked as warnings.
    pub fn note(&mut self, tone: Tone, text: impl Into<String>) -> &mut Self {
        self.add(Block::Note(tone, text.into()))
    }

    /// Text kept as it is, in a fixed-width font: commands and their output.
    pub fn code(&mut self, text: impl Into<String>) -> &mut Self {
        self.add(Block::Code(text.into()))
    }

    /// Hides pieces behind this line until the reader opens it; they are printed if they are open. None adds nothing.
    pub fn folded(&mut self, summary: impl Into<String>, fill: impl FnOnce(&mut ReportSection)) -> &mut Self {
        let mut inside = ReportSection::default();
        fill(&mut inside);
        if inside.blocks.is_empty() { self } else { self.add(Block::Folded(summary.into(), inside.blocks)) }
    }

    /// A figure, drawn into the page.
    ///
    /// # Errors
    /// Errors of [`to_svg_string`].
    pub fn figure(&mut self, figure: &dyn Figure, caption: impl Into<String>) -> Result<&mut Self> {
        let markup = to_svg_string(figure)?;
        Ok(self.svg(markup, caption))
    }

    /// A figure that is drawn already, as [`to_svg_string`] returns it: it is put into the page unescaped.
    pub fn svg(&mut self, markup: impl Into<String>, caption: impl Into<String>) -> &mut Self {
        self.add(Block::Svg { markup: markup.into(), caption: caption.into() })
    }
}

/// The report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    title: String,
    subtitle: String,
    sections: Vec<ReportSection>,
    footer: String,
}

impl Report {
    /// An empty report.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// The line under the title.
    pub fn subtitle(&mut self, text: impl Into<String>) -> &mut Self {
        self.subtitle = text.into();
        self
    }

    /// The line at the end: program, version, date.
    pub fn footer(&mut self, text: impl Into<String>) -> &mut Self {
        self.footer = text.into();
        self
    }

    /// Begins a section; it is listed in the contents.
    pub fn section(&mut self, title: impl Into<String>) -> &mut ReportSection {
        let at = self.sections.len();
        self.sections.push(ReportSection { title: title.into(), blocks: Vec::new() });
        &mut self.sections[at]
    }

    /// The whole page.
    pub fn to_html(&self) -> String {
        html::page(self)
    }

    /// Writes the page, under a temporary name first.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        atomic_file::write(path.as_ref(), self.to_html().as_bytes())
    }
}
