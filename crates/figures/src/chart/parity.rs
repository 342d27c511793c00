//! Predicted over simulated, and the difference beneath a magnifying glass, training and held-out conditions told
//! apart: does the surrogate repeat the simulation?

use super::Figure;
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, CanvasText, Stroke};
use super::legend::{Legend, Swatch};
use super::style::{AXIS, BLUE, DASHED, INK, MUTED, Marker, Quantity, Rgb, VERMILLION, number, size, unit_symbol};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// One condition.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ParityPoint {
    /// Simulated (or measured) value.
    pub reference: f64,
    /// Value of the fit.
    pub predicted: f64,
    /// Whether the condition was held out of the fit.
    pub held_out: bool,
}

impl ParityPoint {
    /// Predicted minus reference.
    pub fn error(self) -> f64 {
        self.predicted - self.reference
    }

    fn usable(self) -> bool {
        self.error().is_finite()
    }
}

/// Error statistics of a set of predictions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorStatistics {
    /// Conditions counted.
    pub count: usize,
    /// Root of the mean square error.
    pub rmse: f64,
    /// Largest absolute error.
    pub max: f64,
    /// Mean error.
    pub bias: f64,
}

/// Statistics of the samples that have both values; `None` if there are none.
pub fn statistics(samples: impl IntoIterator<Item = ParityPoint>) -> Option<ErrorStatistics> {
    let errors: Vec<f64> = samples.into_iter().filter(|s| s.usable()).map(ParityPoint::error).collect();
    let count = errors.len();
    (count > 0).then(|| {
        let n = count as f64;
        let largest = errors.iter().fold(0.0f64, |m, e| m.max(e.abs()));
        // Scaled by the largest, so that squares neither overflow nor vanish.
        let scale = if largest > 0.0 { largest } else { 1.0 };
        let rmse = (errors.iter().map(|e| (e / scale).powi(2)).sum::<f64>() / n).sqrt() * scale;
        ErrorStatistics { count, rmse, max: largest, bias: errors.iter().map(|e| e / n).sum() }
    })
}

/// Predicted over simulated for one measurement point, or for several taken together.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ParityFigure {
    /// Title.
    pub title: String,
    /// Quantity that is predicted.
    pub quantity: Quantity,
    /// Reference that the fit is compared with, `simulated` or `measured`; empty means `simulated`.
    pub reference: String,
    /// The conditions.
    pub samples: Vec<ParityPoint>,
    /// Half width of the 95 % band of the fit, drawn about zero error; 0 or not finite draws none.
    pub half_width: f64,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 960.0;
/// Height of the plot, CSS pixels. Chosen by eye.
const PLOT: f64 = 400.0;
/// Share of the rms error below which a mean error is shown as zero. Fewer than a million conditions cannot tell it from zero, and
/// the mean error of least squares is rounding.
const ROUNDING: f64 = 1e-3;

/// Marker and colour of a condition, by whether it was held out.
pub fn look(held_out: bool) -> (Marker, Rgb) {
    if held_out { (Marker::Triangle, VERMILLION) } else { (Marker::Ring, BLUE) }
}

impl ParityFigure {
    fn reference(&self) -> &str {
        if self.reference.is_empty() { "simulated" } else { &self.reference }
    }

    fn difference_unit(&self) -> String {
        unit_symbol(&self.quantity.unit).replace("°C", "K")
    }

    fn summary(&self, held_out: bool) -> Option<String> {
        let chosen = self.samples.iter().copied().filter(|s| s.held_out == held_out);
        let unit = self.difference_unit();
        statistics(chosen).map(|s| {
            let three = |v: f64| number(rounded(v));
            let mean = if s.bias.abs() < ROUNDING * s.rmse { 0.0 } else { s.bias };
            format!(
                "{}: {} conditions, rms error {} {unit}, largest {} {unit}, mean {} {unit}",
                if held_out { "Held out" } else { "Training" },
                s.count,
                three(s.rmse),
                three(s.max),
                three(mean)
            )
        })
    }

    fn page(&self) -> Page {
        let mut footer: Vec<String> = [false, true].into_iter().filter_map(|h| self.summary(h)).collect();
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (held_out, name) in [(false, "training condition"), (true, "held-out condition")] {
            if self.samples.iter().any(|s| s.held_out == held_out && s.usable()) {
                let (marker, colour) = look(held_out);
                legend.add(Swatch::Marker(marker, colour), name);
            }
        }
        legend.add(Swatch::Line(MUTED, 1.4, &[]), "perfect agreement");
        if self.half_width.is_finite() && self.half_width > 0.0 {
            legend.add(Swatch::Line(INK, 1.4, DASHED), "95 % band of the fit");
        }
        legend
    }

    fn frames(&self, top: f64) -> Result<(PlotFrame, PlotFrame)> {
        let used: Vec<ParityPoint> = self.samples.iter().copied().filter(|s| s.usable()).collect();
        let values = used.iter().flat_map(|s| [s.reference, s.predicted]);
        let (Some(values), Some(errors)) = (Range::of(values), error_range(used.iter().map(|s| s.error()), self.half_width)) else {
            return Err(Error::input("no condition has both a predicted and a reference value").at_key(self.title.clone()));
        };
        let values = values.padded(0.04);
        let unit = if self.quantity.unit.trim().is_empty() { String::new() } else { format!(" [{}]", unit_symbol(&self.quantity.unit)) };
        let difference = if unit.is_empty() { String::new() } else { format!(" [{}]", self.difference_unit()) };
        let x = PlotAxis::linear(format!("{}{unit}", self.reference()), values);
        let left = PlotFrame::inside((MARGIN, top), (452.0, PLOT), x.clone(), PlotAxis::linear(format!("predicted{unit}"), values));
        let y = PlotAxis::linear(format!("predicted − {}{difference}", self.reference()), errors);
        let right = PlotFrame::inside((MARGIN + 470.0, top), (WIDTH - 2.0 * MARGIN - 470.0, PLOT), x, y);
        Ok((left, right))
    }
}

/// Three significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// A range about zero for errors and their band.
pub(crate) fn error_range(errors: impl IntoIterator<Item = f64>, half_width: f64) -> Option<Range> {
    let largest = errors.into_iter().filter(|e| e.is_finite()).map(f64::abs).reduce(f64::max)?;
    let band = if half_width.is_finite() { half_width.abs() } else { 0.0 };
    let reach = largest.max(band).min(1e290);
    let reach = if reach > 0.0 { 1.15 * reach } else { 1.0 };
    Some(Range { low: -reach, high: reach })
}

/// Zero line and band limits of a plot of errors.
///
/// # Errors
/// If the surface refuses.
pub(crate) fn paint_band(canvas: &mut Canvas, frame: &PlotFrame, half_width: f64) -> Result<()> {
    let across = |y: f64| [(frame.left, frame.at(frame.x.range.low, y).1), (frame.right(), frame.at(frame.x.range.low, y).1)];
    canvas.line(&across(0.0), Stroke::solid(MUTED, 1.4))?;
    if half_width.is_finite() && half_width > 0.0 {
        for y in [-half_width, half_width] {
            canvas.line(&across(y), Stroke { colour: INK, width: 1.4, dash: DASHED })?;
        }
    }
    Ok(())
}

impl Figure for ParityFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        let page = self.page();
        self.frames(page.top())?;
        Ok((WIDTH, page.top() + PLOT + 26.0 + self.legend().running_height(page.room()) + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let page = self.page();
        let top = page.top() + 20.0;
        let (left, right) = self.frames(top)?;
        for (frame, name) in [(&left, "Predicted over the reference"), (&right, "Their difference, magnified")] {
            canvas.text((frame.left, top - 2.0), &CanvasText::new(name).size(size::TICK).bold().colour(AXIS))?;
            frame.paint_grid(canvas)?;
        }
        let ends = [left.x.range.low, left.x.range.high].map(|v| left.at(v, v));
        canvas.line(&ends, Stroke::solid(MUTED, 1.4))?;
        paint_band(canvas, &right, self.half_width)?;
        // Held-out conditions are drawn on top, because they count most.
        for held_out in [false, true] {
            let (marker, colour) = look(held_out);
            for s in self.samples.iter().filter(|s| s.held_out == held_out && s.usable()) {
                canvas.marker(left.at(s.reference, s.predicted), marker, 3.8, colour)?;
                canvas.marker(right.at(s.reference, s.error()), marker, 3.8, colour)?;
            }
        }
        left.paint_axes(canvas)?;
        right.paint_axes(canvas)?;
        self.legend().paint_running(canvas, (MARGIN, top + PLOT + 4.0), page.room())?;
        page.paint(canvas, self.size()?.1)
    }
}
