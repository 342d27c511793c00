//! Plots with one row per name: names at the left, broken into two lines where long, values to the right.

use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, CanvasText, PixelPoint};
use super::fonts::{self, FontWeight};
use super::style::{STRIPE, size};
use super::ticks::Range;
use coldplate_base::error::Result;

/// Rows with their names broken into lines.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NamedRows {
    names: Vec<Vec<String>>,
    /// Width of the column of names.
    pub names_width: f64,
    /// Height of one row.
    pub row: f64,
}

/// Height of a line of text, CSS pixels. Chosen by eye.
const LINE: f64 = 16.0;

impl NamedRows {
    /// Breaks the names into at most two lines of at most `limit` CSS pixels; rows are at least `least` high.
    pub fn new<'a>(names: impl IntoIterator<Item = &'a str>, limit: f64, least: f64) -> Self {
        let names: Vec<Vec<String>> = names.into_iter().map(|n| fonts::wrap(n, size::TICK, FontWeight::Regular, limit, 2)).collect();
        let widest = names.iter().flatten().map(|l| fonts::width(l, size::TICK, FontWeight::Regular)).fold(0.0, f64::max);
        let most = names.iter().map(Vec::len).max().unwrap_or(1).max(1);
        Self { names, names_width: widest, row: least.max(LINE * most as f64 + 6.0) }
    }

    /// Height of all rows.
    pub fn height(&self) -> f64 {
        self.row * self.names.len() as f64
    }

    /// The plot of the rows' values: its data rectangle begins at `top` and ends at `right`, `left` is
    /// where the names begin.
    pub fn frame(&self, left: f64, top: f64, right: f64, x: PlotAxis) -> PlotFrame {
        let y = PlotAxis::linear("", Range { low: 0.0, high: self.names.len().max(1) as f64 });
        let start = left + self.names_width + 12.0;
        let mut frame = PlotFrame::inside((start, top), (right - start, self.height() + 60.0), x, y);
        // The frame's own vertical labels are not used, so their room goes to the data.
        frame.set_rectangle((start, top), (right - start - 14.0, self.height()));
        frame
    }

    /// The height in CSS pixels of the middle of a row.
    pub fn middle(&self, frame: &PlotFrame, index: usize) -> f64 {
        frame.top + self.row * (index as f64 + 0.5)
    }

    /// Stripes and names, drawn before the data.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn paint(&self, canvas: &mut Canvas, frame: &PlotFrame) -> Result<()> {
        for (index, lines) in self.names.iter().enumerate() {
            let middle = self.middle(frame, index);
            if index % 2 == 1 {
                let left = frame.left - self.names_width - 12.0;
                canvas.rectangle(left, middle - 0.5 * self.row, frame.right() - left, self.row, STRIPE, 1.0)?;
            }
            let first = middle + 0.36 * size::TICK - 0.5 * LINE * (lines.len().max(1) - 1) as f64;
            for (k, line) in lines.iter().enumerate() {
                let at: PixelPoint = (frame.left - 10.0, first + LINE * k as f64);
                canvas.text(at, &CanvasText::new(line).size(size::TICK).end())?;
            }
        }
        Ok(())
    }
}
