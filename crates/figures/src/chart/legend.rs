//! Legends: samples of the drawing with their meaning, running along lines or stacked.

use super::canvas::{Canvas, CanvasText, PixelPoint, Stroke};
use super::fonts::{self, FontWeight};
use super::regions::{Hatch, hatch_rectangle};
use super::style::{AXIS, Dash, INK, Marker, Rgb, SeriesStyle, WHITE, size};
use coldplate_base::error::Result;

/// A sample of the drawing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Swatch {
    /// A curve with its samples.
    Curve(SeriesStyle),
    /// A line alone, with its width.
    Line(Rgb, f64, Dash),
    /// A marker alone.
    Marker(Marker, Rgb),
    /// An area with its pattern.
    Area(Rgb, f64, Hatch),
    /// A letter in a circle.
    Badge(String),
    /// The marker of one condition.
    Here,
    /// Nothing: the text is a heading.
    Heading,
}

/// Samples and their meaning.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Legend {
    /// Entries in the order shown.
    pub entries: Vec<(Swatch, String)>,
    /// Font size; zero means the body size.
    pub text: f64,
}

/// Width of a sample, CSS pixels. Chosen by eye.
const SWATCH: f64 = 34.0;
/// Width of a sample that is one marker, in legends along lines, CSS pixels. Chosen by eye.
const NARROW: f64 = 16.0;
/// Space between a sample and its text, CSS pixels. Chosen by eye.
const GAP: f64 = 8.0;

/// One entry with its place, relative to the legend's top left corner.
struct Placed<'a> {
    swatch: &'a Swatch,
    lines: Vec<String>,
    x: f64,
    y: f64,
    /// Width of the sample and the gap behind it.
    before: f64,
}

impl Legend {
    /// Adds an entry.
    pub fn add(&mut self, swatch: Swatch, text: impl Into<String>) {
        self.entries.push((swatch, text.into()));
    }

    fn text_size(&self) -> f64 {
        if self.text > 0.0 { self.text } else { size::BODY }
    }

    fn line_height(&self) -> f64 {
        (self.text_size() * 1.32).round()
    }

    fn running(&self, width: f64) -> (Vec<Placed<'_>>, f64) {
        let (text, line) = (self.text_size(), self.line_height() + 3.0);
        let (mut x, mut y) = (0.0, 0.0);
        let mut placed = Vec::new();
        for (swatch, meaning) in &self.entries {
            let before = match swatch {
                Swatch::Heading => 0.0,
                Swatch::Marker(..) | Swatch::Badge(_) | Swatch::Here => NARROW + GAP,
                _ => SWATCH + GAP,
            };
            let shown = fonts::fit(meaning, text, FontWeight::Regular, (width - before).max(20.0));
            let needed = before + fonts::width(&shown, text, FontWeight::Regular);
            if x > 0.0 && x + needed > width {
                x = 0.0;
                y += line;
            }
            placed.push(Placed { swatch, lines: vec![shown], x, y, before });
            x += needed + 22.0;
        }
        let height = if placed.is_empty() { 0.0 } else { y + line };
        (placed, height)
    }

    fn stacked(&self, width: f64) -> (Vec<Placed<'_>>, f64) {
        let (text, line) = (self.text_size(), self.line_height());
        let mut y = 0.0;
        let mut placed = Vec::new();
        for (swatch, meaning) in &self.entries {
            let heading = *swatch == Swatch::Heading;
            if heading && y > 0.0 {
                y += 8.0;
            }
            let (before, weight) = if heading { (0.0, FontWeight::Bold) } else { (SWATCH + GAP, FontWeight::Regular) };
            let lines = fonts::wrap(meaning, text, weight, (width - before).max(20.0), 4);
            let rows = lines.len().max(1) as f64;
            placed.push(Placed { swatch, lines, x: 0.0, y, before });
            y += rows * line + 6.0;
        }
        (placed, y)
    }

    /// Height of the legend running along lines of this width.
    pub(crate) fn running_height(&self, width: f64) -> f64 {
        self.running(width).1
    }

    /// Height of the legend stacked in a column of this width.
    pub(crate) fn stacked_height(&self, width: f64) -> f64 {
        self.stacked(width).1
    }

    /// Paints the legend running along lines; `at` is its top left corner.
    ///
    /// # Errors
    /// If the surface refuses.
    pub(crate) fn paint_running(&self, canvas: &mut Canvas, at: PixelPoint, width: f64) -> Result<()> {
        self.paint(canvas, at, &self.running(width).0)
    }

    /// Paints the legend stacked in a column; `at` is its top left corner.
    ///
    /// # Errors
    /// If the surface refuses.
    pub(crate) fn paint_stacked(&self, canvas: &mut Canvas, at: PixelPoint, width: f64) -> Result<()> {
        self.paint(canvas, at, &self.stacked(width).0)
    }

    fn paint(&self, canvas: &mut Canvas, at: PixelPoint, placed: &[Placed]) -> Result<()> {
        let (text, line) = (self.text_size(), self.line_height());
        for Placed { swatch, lines, x, y, before } in placed {
            let (x, y) = (at.0 + x, at.1 + y);
            let heading = **swatch == Swatch::Heading;
            paint_swatch(canvas, swatch, (x, y + 0.5 * line), (before - GAP).max(0.0), text)?;
            for (i, meaning) in lines.iter().enumerate() {
                let setting = CanvasText::new(meaning).size(text);
                let setting = if heading { setting.bold() } else { setting };
                canvas.text((x + before, y + 0.5 * line + 0.36 * text + i as f64 * line), &setting)?;
            }
        }
        Ok(())
    }
}

/// Paints one sample of this width; `at` is the middle of its left edge.
///
/// # Errors
/// If the surface refuses.
pub(crate) fn paint_swatch(canvas: &mut Canvas, swatch: &Swatch, at: PixelPoint, width: f64, text: f64) -> Result<()> {
    let (x, y) = at;
    match swatch {
        Swatch::Heading => Ok(()),
        Swatch::Curve(style) => {
            canvas.line(&[(x, y), (x + width, y)], Stroke { colour: style.colour, width: 2.2, dash: style.dash })?;
            canvas.disc((x + width / 2.0, y), 6.5, WHITE)?;
            canvas.marker((x + width / 2.0, y), style.marker, 4.5, style.colour)
        }
        Swatch::Line(colour, thick, dash) => canvas.line(&[(x, y), (x + width, y)], Stroke { colour: *colour, width: *thick, dash }),
        Swatch::Marker(marker, colour) => canvas.marker((x + width / 2.0, y), *marker, 5.0, *colour),
        Swatch::Area(colour, alpha, hatch) => {
            let height = (1.1 * text).min(26.0);
            canvas.rectangle(x, y - height / 2.0, width, height, *colour, *alpha)?;
            hatch_rectangle(canvas, (x, y - height / 2.0), (width, height), *hatch, *colour)?;
            canvas.frame(x, y - height / 2.0, width, height, Stroke::solid(AXIS, 1.0))
        }
        Swatch::Badge(letter) => paint_badge(canvas, (x + width / 2.0, y), letter, text * 0.66),
        Swatch::Here => paint_here(canvas, (x + width / 2.0, y), 6.0),
    }
}

/// A letter in a circle, centred.
///
/// # Errors
/// If the surface refuses.
pub(crate) fn paint_badge(canvas: &mut Canvas, at: PixelPoint, letter: &str, radius: f64) -> Result<()> {
    canvas.disc(at, radius + 1.4, INK)?;
    canvas.disc(at, radius, WHITE)?;
    let text = if letter.chars().count() > 1 { radius * 1.05 } else { radius * 1.4 };
    canvas.text((at.0, at.1 + 0.36 * text), &CanvasText::new(letter).size(text).bold().middle())
}

/// The marker of one condition: a ringed diamond that shows on any ground.
///
/// # Errors
/// If the surface refuses.
pub(crate) fn paint_here(canvas: &mut Canvas, at: PixelPoint, radius: f64) -> Result<()> {
    canvas.marker(at, Marker::Diamond, radius * 1.5, WHITE)?;
    canvas.marker(at, Marker::Diamond, radius * 1.15, INK)?;
    canvas.disc(at, radius * 0.42, WHITE)
}
