//! Contour lines of several levels on one plot, and their labels where these cover nothing else.

use super::axis::PlotFrame;
use super::canvas::{Canvas, CanvasText, PixelPoint, Stroke};
use super::contour::{Line, Taken, around, label_place};
use super::fonts::{self, FontWeight};
use super::style::INK;
use coldplate_base::error::Result;

/// The lines of one level.
pub(super) struct ContourLevel {
    /// Course of the lines, CSS pixels.
    lines: Vec<Vec<PixelPoint>>,
    /// Label of the lines, drawn if there is room.
    label: Option<String>,
    /// Width, CSS pixels.
    width: f64,
}

impl ContourLevel {
    pub(super) fn new(frame: &PlotFrame, lines: &[Line], label: Option<String>, width: f64) -> Self {
        let placed = |line: &Line| line.points.iter().map(|p| frame.at(p.0, p.1)).collect();
        Self { lines: lines.iter().map(placed).collect(), label, width }
    }

    /// Rectangles that the lines cover, piece by piece.
    fn covers(&self) -> Vec<Taken> {
        let piece = |p: &[PixelPoint]| (p[0].0.min(p[1].0), p[0].1.min(p[1].1), p[0].0.max(p[1].0), p[0].1.max(p[1].1));
        self.lines.iter().flat_map(|line| line.windows(2).map(piece)).collect()
    }
}

/// Draws the lines, and their labels over all lines. A label is drawn only at a place that is not `taken` and covers no
/// other level's line: among lines close together nobody could tell whose label it is.
pub(super) fn paint(canvas: &mut Canvas, frame: &PlotFrame, levels: &[ContourLevel], font: f64, mut taken: Vec<Taken>) -> Result<()> {
    for level in levels {
        level.lines.iter().try_for_each(|line| canvas.line(line, Stroke::solid(INK, level.width)))?;
    }
    let bounds = (frame.left, frame.top, frame.right(), frame.bottom());
    let covers: Vec<Vec<Taken>> = levels.iter().map(ContourLevel::covers).collect();
    for (own, level) in levels.iter().enumerate() {
        let Some(label) = &level.label else { continue };
        let size = (fonts::width(label, font, FontWeight::Regular) + 6.0, font * 1.15);
        let others: Vec<Taken> =
            covers.iter().enumerate().filter(|(other, _)| *other != own).flat_map(|(_, covered)| covered.iter().copied()).collect();
        for line in &level.lines {
            let blocked: Vec<Taken> = taken.iter().chain(&others).copied().collect();
            if let Some(at) = label_place(line, size, bounds, &blocked) {
                taken.push(around(at, size));
                canvas.plate(at, &CanvasText::new(label.trim()).size(font))?;
            }
        }
    }
    Ok(())
}
