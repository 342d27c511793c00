//! Gain of a change of the model on conditions it was not made from: predicted over measured, and the error of every
//! condition, before and after.

use super::Figure;
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, CanvasText, Stroke};
use super::legend::{Legend, Swatch};
use super::style::{AXIS, BLUE, DASHED, GRID, INK, MUTED, Marker, Quantity, Rgb, VERMILLION, size, unit_symbol};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// Errors before and after.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BeforeAfter {
    /// Title.
    pub title: String,
    /// Quantity that is measured.
    pub quantity: Quantity,
    /// Measured, predicted before, predicted after.
    pub readings: Vec<[f64; 3]>,
    /// Root mean square error of each condition, before and after, in the order of the conditions.
    pub conditions: Vec<(f64, f64)>,
    /// Error that the readings' own uncertainty accounts for; not finite draws no line.
    pub noise_floor: f64,
    /// Names of before and after.
    pub names: [String; 2],
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Height of the plot, CSS pixels. Chosen by eye.
const PLOT: f64 = 380.0;
/// Markers and colours of before and after. Chosen by eye.
const LOOKS: [(Marker, Rgb); 2] = [(Marker::Frame, VERMILLION), (Marker::Disc, BLUE)];

impl BeforeAfter {
    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (name, (marker, colour)) in self.names.iter().zip(LOOKS) {
            legend.add(Swatch::Marker(marker, colour), name.clone());
        }
        legend.add(Swatch::Line(MUTED, 1.4, &[]), "perfect agreement");
        if self.noise_floor.is_finite() {
            legend.add(Swatch::Line(INK, 1.4, DASHED), "noise floor");
        }
        legend
    }

    fn frames(&self, top: f64) -> Result<(PlotFrame, PlotFrame)> {
        let values = Range::of(self.readings.iter().flatten().copied());
        let errors = Range::of(self.conditions.iter().flat_map(|c| [c.0, c.1]).chain([0.0, self.noise_floor]));
        let (Some(values), Some(errors)) = (values.filter(|_| !self.conditions.is_empty()), errors) else {
            return Err(Error::input("no condition has a prediction before and after").at_key(self.title.clone()));
        };
        let values = values.padded(0.05);
        let unit = if self.quantity.unit.is_empty() { String::new() } else { format!(" [{}]", unit_symbol(&self.quantity.unit)) };
        let difference = unit.replace("°C", "K");
        let left = PlotFrame::inside(
            (MARGIN, top),
            (440.0, PLOT),
            PlotAxis::linear(format!("measured{unit}"), values),
            PlotAxis::linear(format!("predicted{unit}"), values),
        );
        let count = Range { low: 0.3, high: self.conditions.len() as f64 + 0.7 };
        let high = Range { low: 0.0, high: errors.high.max(1e-9) * 1.08 };
        let right = PlotFrame::inside(
            (MARGIN + 456.0, top),
            (WIDTH - 2.0 * MARGIN - 456.0, PLOT),
            PlotAxis::counting("condition kept out, in the order of the data", count),
            PlotAxis::linear(format!("root mean square error{difference}"), high),
        );
        Ok((left, right))
    }
}

impl Figure for BeforeAfter {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        let page = self.page();
        self.frames(page.top())?;
        Ok((WIDTH, page.top() + 20.0 + PLOT + 6.0 + self.legend().running_height(page.room()) + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let page = self.page();
        let top = page.top() + 20.0;
        let (left, right) = self.frames(top)?;
        for (frame, name) in [(&left, "Every reading"), (&right, "Error of each condition")] {
            canvas.text((frame.left, top - 2.0), &CanvasText::new(name).size(size::TICK).bold().colour(AXIS))?;
            frame.paint_grid(canvas)?;
        }
        let ends = [left.x.range.low, left.x.range.high].map(|v| left.at(v, v));
        canvas.line(&ends, Stroke::solid(MUTED, 1.4))?;
        for (which, (marker, colour)) in LOOKS.into_iter().enumerate() {
            for reading in &self.readings {
                canvas.marker(left.at(reading[0], reading[1 + which]), marker, 3.4, colour)?;
            }
        }
        if self.noise_floor.is_finite() {
            let y = right.at(1.0, self.noise_floor).1;
            canvas.line(&[(right.left, y), (right.right(), y)], Stroke { colour: INK, width: 1.4, dash: DASHED })?;
        }
        for (k, (before, after)) in self.conditions.iter().enumerate() {
            let (a, b) = (right.at(k as f64 + 1.0, *before), right.at(k as f64 + 1.0, *after));
            canvas.line(&[a, b], Stroke::solid(GRID.darker(), 1.6))?;
            canvas.marker(a, LOOKS[0].0, 4.2, LOOKS[0].1)?;
            canvas.marker(b, LOOKS[1].0, 4.2, LOOKS[1].1)?;
        }
        left.paint_axes(canvas)?;
        right.paint_axes(canvas)?;
        self.legend().paint_running(canvas, (MARGIN, top + PLOT + 6.0), page.room())?;
        page.paint(canvas, self.size()?.1)
    }
}
