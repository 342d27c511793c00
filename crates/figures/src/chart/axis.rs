//! Axes and the frame of a plot: ticks that never collide, titles with units, values to places.

use super::canvas::{Canvas, CanvasText, PixelPoint, PixelSize, Stroke};
use super::fonts::{self, FontWeight};
use super::style::{AXIS, GRID, size};
use super::ticks::{self, Range, Ticks};
use coldplate_base::error::Result;

/// Spacing of values along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spacing {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm; the range must be positive.
    Logarithmic,
    /// Evenly, with ticks at whole numbers only, for counts.
    Counting,
}

/// An axis: title, range and spacing.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotAxis {
    /// Title, with its unit.
    pub title: String,
    /// Values from end to end.
    pub range: Range,
    /// Spacing.
    pub spacing: Spacing,
}

impl PlotAxis {
    /// An evenly spaced axis.
    pub fn linear(title: impl Into<String>, range: Range) -> Self {
        Self { title: title.into(), range, spacing: Spacing::Linear }
    }

    /// An evenly spaced axis of counts.
    pub fn counting(title: impl Into<String>, range: Range) -> Self {
        Self { title: title.into(), range, spacing: Spacing::Counting }
    }

    /// A logarithmic axis.
    pub fn logarithmic(title: impl Into<String>, range: Range) -> Self {
        Self { title: title.into(), range, spacing: Spacing::Logarithmic }
    }

    /// Place of a value along the axis, 0 at the low end and 1 at the high end.
    pub fn fraction(&self, value: f64) -> f64 {
        let Range { low, high } = self.range;
        match self.spacing {
            Spacing::Linear | Spacing::Counting => (value - low) / (high - low),
            Spacing::Logarithmic => (value / low).ln() / (high / low).ln(),
        }
    }

    fn ticks(&self, most: usize) -> Ticks {
        match self.spacing {
            Spacing::Linear => ticks::linear(self.range, most),
            Spacing::Counting => ticks::linear(self.range, most.min(self.range.length().ceil().max(1.0) as usize)),
            Spacing::Logarithmic => ticks::logarithmic(self.range, most),
        }
    }

    /// The most ticks whose labels keep apart along a horizontal axis of this length.
    fn ticks_across(&self, length: f64, text: f64) -> Ticks {
        let apart = |ticks: &Ticks| {
            let ends: Vec<(f64, f64)> = ticks
                .values
                .iter()
                .zip(&ticks.labels)
                .map(|(v, label)| {
                    let half = fonts::width(label, text, FontWeight::Regular) / 2.0 + 5.0;
                    let at = self.fraction(*v) * length;
                    (at - half, at + half)
                })
                .collect();
            ends.windows(2).all(|pair| pair[0].1 <= pair[1].0)
        };
        (1..=10).rev().map(|most| self.ticks(most)).find(apart).unwrap_or_else(|| self.ticks(1))
    }

    fn full_title(&self, ticks: &Ticks) -> String {
        match &ticks.remark {
            Some(remark) => format!("{} ({remark})", self.title),
            None => self.title.clone(),
        }
    }
}

/// A plot: the rectangle its data are drawn in, and its two axes with their ticks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlotFrame {
    /// Left edge of the data rectangle, in CSS pixels.
    pub left: f64,
    /// Top edge.
    pub top: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
    /// Horizontal axis.
    pub x: PlotAxis,
    /// Vertical axis.
    pub y: PlotAxis,
    text: f64,
    x_ticks: Ticks,
    y_ticks: Ticks,
}

impl PlotFrame {
    /// A plot that with its tick labels and titles fills this rectangle.
    pub fn inside((left, top): PixelPoint, (width, height): PixelSize, x: PlotAxis, y: PlotAxis) -> Self {
        Self::with_text((left, top), (width, height), x, y, size::TICK)
    }

    /// A plot like [`PlotFrame::inside`], with tick labels of this size; titles are one pixel larger.
    pub(crate) fn with_text((left, top): PixelPoint, (width, height): PixelSize, x: PlotAxis, y: PlotAxis, text: f64) -> Self {
        let below = 2.0 * text + 22.0;
        let above = 0.5 * text;
        let inner_height = (height - below - above).max(20.0);
        let most = (inner_height / (2.6 * text)).clamp(1.0, 10.0) as usize;
        let y_ticks = y.ticks(most);
        let widest = y_ticks.labels.iter().map(|l| fonts::width(l, text, FontWeight::Regular)).fold(0.0, f64::max);
        let before = if y.title.is_empty() { widest + 10.0 } else { widest + text + 20.0 };
        // Half of the last label under the horizontal axis may stand out to the right.
        let last = x.ticks(3).labels.last().map_or(0.0, |l| fonts::width(l, text, FontWeight::Regular));
        let behind = (0.5 * last + 4.0).max(8.0);
        let inner_width = (width - before - behind).max(20.0);
        let x_ticks = x.ticks_across(inner_width, text);
        Self { left: left + before, top: top + above, width: inner_width, height: inner_height, x, y, text, x_ticks, y_ticks }
    }

    /// Gives the data another rectangle; the ticks of the horizontal axis are chosen anew.
    pub(crate) fn set_rectangle(&mut self, (left, top): PixelPoint, (width, height): PixelSize) {
        (self.left, self.top, self.width, self.height) = (left, top, width.max(20.0), height.max(1.0));
        self.x_ticks = self.x.ticks_across(self.width, self.text);
    }

    /// Right edge of the data rectangle.
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Lower edge of the data rectangle.
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Place at which a pair of values is drawn.
    pub fn at(&self, x: f64, y: f64) -> PixelPoint {
        (self.left + self.x.fraction(x) * self.width, self.bottom() - self.y.fraction(y) * self.height)
    }

    /// Grid lines, drawn before the data.
    ///
    /// # Errors
    /// If the surface refuses.
    pub(crate) fn paint_grid(&self, canvas: &mut Canvas) -> Result<()> {
        let stroke = Stroke::solid(GRID, 1.0);
        for v in &self.x_ticks.values {
            let x = self.left + self.x.fraction(*v) * self.width;
            canvas.line(&[(x, self.top), (x, self.bottom())], stroke)?;
        }
        for v in &self.y_ticks.values {
            let y = self.bottom() - self.y.fraction(*v) * self.height;
            canvas.line(&[(self.left, y), (self.right(), y)], stroke)?;
        }
        Ok(())
    }

    /// Vertical grid lines (where asked for), labels and title of the horizontal axis alone, for plots with names at the left.
    ///
    /// # Errors
    /// If the surface refuses.
    pub(crate) fn paint_across(&self, canvas: &mut Canvas, grid: bool) -> Result<()> {
        let text = self.text;
        for (v, label) in self.x_ticks.values.iter().zip(&self.x_ticks.labels) {
            let x = self.left + self.x.fraction(*v) * self.width;
            if grid {
                canvas.line(&[(x, self.top), (x, self.bottom())], Stroke::solid(GRID, 1.0))?;
            }
            canvas.line(&[(x, self.bottom()), (x, self.bottom() + 5.0)], Stroke::solid(AXIS, 1.2))?;
            canvas.text((x, self.bottom() + 7.0 + text), &CanvasText::new(label).size(text).middle())?;
        }
        canvas.frame(self.left, self.top, self.width, self.height, Stroke::solid(AXIS, 1.2))?;
        let title = fonts::fit(&self.x.full_title(&self.x_ticks), text + 1.0, FontWeight::Regular, self.width);
        canvas.text((self.left + self.width / 2.0, self.bottom() + 2.0 * text + 17.0), &CanvasText::new(&title).size(text + 1.0).middle())
    }

    /// Frame, ticks, labels and titles, drawn after the data.
    ///
    /// # Errors
    /// If the surface refuses.
    pub(crate) fn paint_axes(&self, canvas: &mut Canvas) -> Result<()> {
        let stroke = Stroke::solid(AXIS, 1.2);
        let text = self.text;
        canvas.frame(self.left, self.top, self.width, self.height, stroke)?;
        for (v, label) in self.x_ticks.values.iter().zip(&self.x_ticks.labels) {
            let x = self.left + self.x.fraction(*v) * self.width;
            canvas.line(&[(x, self.bottom()), (x, self.bottom() + 5.0)], stroke)?;
            canvas.text((x, self.bottom() + 7.0 + text), &CanvasText::new(label).size(text).middle())?;
        }
        for (v, label) in self.y_ticks.values.iter().zip(&self.y_ticks.labels) {
            let y = self.bottom() - self.y.fraction(*v) * self.height;
            canvas.line(&[(self.left - 5.0, y), (self.left, y)], stroke)?;
            canvas.text((self.left - 8.0, y + 0.36 * text), &CanvasText::new(label).size(text).end())?;
        }
        self.paint_titles(canvas)
    }

    fn paint_titles(&self, canvas: &mut Canvas) -> Result<()> {
        let text = self.text;
        let title = text + 1.0;
        let widest = self.y_ticks.labels.iter().map(|l| fonts::width(l, text, FontWeight::Regular)).fold(0.0, f64::max);
        let (across, small) = fitted(&self.x.full_title(&self.x_ticks), title, self.width + 0.5 * widest);
        canvas.text((self.left + self.width / 2.0, self.bottom() + 2.0 * text + 17.0), &CanvasText::new(&across).size(small).middle())?;
        let (up, small) = fitted(&self.y.full_title(&self.y_ticks), title, self.height + text);
        canvas.text((self.left - widest - 16.0, self.top + self.height / 2.0), &CanvasText::new(&up).size(small).middle().upwards())
    }
}

/// A title set a little smaller if it is too long, and shortened if that is not enough.
fn fitted(title: &str, size: f64, limit: f64) -> (String, f64) {
    let width = fonts::width(title, size, FontWeight::Regular).max(1.0);
    let size = (size * limit / width).clamp(size.min(12.0), size);
    (fonts::fit(title, size, FontWeight::Regular, limit), size)
}
