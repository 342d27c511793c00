//! Predicted beside measured, sensor by sensor, with the prediction of another program.

use super::Figure;
use super::axis::PlotAxis;
use super::canvas::{Canvas, Stroke};
use super::legend::{Legend, Swatch};
use super::rows::NamedRows;
use super::style::{BLUE, GRID, INK, Marker, Quantity, Rgb, VERMILLION, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page, fixed_conditions};
use coldplate_base::error::{Error, Result};

/// One sensor; `None` if not known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SensorRow {
    /// Name of the sensor.
    pub name: String,
    /// Measured value.
    pub measured: Option<f64>,
    /// Uncertainty of the reading (95 %), drawn to both sides.
    pub uncertainty: Option<f64>,
    /// Predicted value.
    pub predicted: Option<f64>,
    /// Half width of the prediction's 95 % band.
    pub band: Option<f64>,
    /// The other program's prediction.
    pub other: Option<f64>,
}

/// All sensors of one test.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MeasuredFigure {
    /// Title.
    pub title: String,
    /// Quantity that is measured.
    pub quantity: Quantity,
    /// One row per sensor.
    pub sensors: Vec<SensorRow>,
    /// Name of the other program, for the legend.
    pub other_name: String,
    /// The condition.
    pub fixed: Vec<(Quantity, f64)>,
    /// More lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 960.0;
/// Marker and colour of measured values. Chosen by eye.
const MEASURED: (Marker, Rgb) = (Marker::Disc, INK);
/// Marker and colour of predicted values. Chosen by eye.
const PREDICTED: (Marker, Rgb) = (Marker::Diamond, BLUE);
/// Marker and colour of the other program's values. Chosen by eye.
const OTHER: (Marker, Rgb) = (Marker::Frame, VERMILLION);

fn known(value: Option<f64>) -> Option<f64> {
    value.filter(|v| v.abs() < 1e290)
}

impl MeasuredFigure {
    fn rows(&self) -> NamedRows {
        NamedRows::new(self.sensors.iter().map(|s| s.name.as_str()), 280.0, 34.0)
    }

    fn axis(&self) -> Result<PlotAxis> {
        let mut values = Vec::new();
        for s in &self.sensors {
            let spread = |value: Option<f64>, half: Option<f64>| {
                let half = known(half).map_or(0.0, f64::abs);
                known(value).map_or_else(Vec::new, |v| vec![v - half, v + half])
            };
            values.extend(spread(s.measured, s.uncertainty));
            values.extend(spread(s.predicted, s.band));
            values.extend(spread(s.other, None));
        }
        match Range::of(values) {
            Some(range) => Ok(PlotAxis::linear(self.quantity.label(), range.padded(0.05))),
            None => Err(Error::input("no sensor has a value to draw").at_key(self.title.clone())),
        }
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        let has = |of: fn(&SensorRow) -> Option<f64>| self.sensors.iter().any(|s| known(of(s)).is_some());
        if has(|s| s.measured) {
            let bar = if has(|s| s.uncertainty) { "measured, with its 95 % uncertainty" } else { "measured" };
            legend.add(Swatch::Marker(MEASURED.0, MEASURED.1), bar);
        }
        if has(|s| s.predicted) {
            let bar = if has(|s| s.band) { "predicted, with its 95 % band" } else { "predicted" };
            legend.add(Swatch::Marker(PREDICTED.0, PREDICTED.1), bar);
        }
        if has(|s| s.other) {
            let name = if self.other_name.is_empty() { "another program" } else { &self.other_name };
            legend.add(Swatch::Marker(OTHER.0, OTHER.1), name);
        }
        legend
    }

    fn page(&self) -> Page {
        let mut footer = vec![fixed_conditions(&self.fixed)];
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }
}

impl Figure for MeasuredFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.axis()?;
        let page = self.page();
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 8.0 + self.rows().height() + 56.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, rows, legend) = (self.page(), self.rows(), self.legend());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let frame = rows.frame(MARGIN, page.top() + legend.running_height(page.room()) + 8.0, WIDTH - MARGIN, self.axis()?);
        rows.paint(canvas, &frame)?;
        frame.paint_across(canvas, true)?;
        let x = |value: f64| frame.at(value, 0.0).0;
        for (index, s) in self.sensors.iter().enumerate() {
            // Measured above, predicted below: equal values stay visible.
            let middle = rows.middle(&frame, index);
            let (above, below) = (middle - 6.0, middle + 6.0);
            if let (Some(m), Some(p)) = (known(s.measured), known(s.predicted)) {
                canvas.line(&[(x(m), above), (x(p), below)], Stroke::solid(GRID, 2.0))?;
            }
            for (value, half, y, colour) in [(s.measured, s.uncertainty, above, MEASURED.1), (s.predicted, s.band, below, PREDICTED.1)] {
                if let (Some(v), Some(half)) = (known(value), known(half)) {
                    let (a, b) = (x(v - half.abs()), x(v + half.abs()));
                    let stroke = Stroke::solid(colour, 1.5);
                    canvas.line(&[(a, y), (b, y)], stroke)?;
                    canvas.line(&[(a, y - 4.0), (a, y + 4.0)], stroke)?;
                    canvas.line(&[(b, y - 4.0), (b, y + 4.0)], stroke)?;
                }
            }
            for (value, y, (marker, colour)) in [(s.other, below, OTHER), (s.measured, above, MEASURED), (s.predicted, below, PREDICTED)] {
                if let Some(value) = known(value) {
                    canvas.marker((x(value), y), marker, 4.6, colour)?;
                }
            }
        }
        page.paint(canvas, self.size()?.1)
    }
}
