//! Residual of every sensor over each variable, side by side: do the errors of the model follow a condition?

use super::Figure;
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::Canvas;
use super::legend::{Legend, Swatch};
use super::parity::{error_range, paint_band};
use super::style::{Marker, Quantity, Rgb, series, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// Residuals of several sensors over the variables of the conditions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ResidualPanels {
    /// Title.
    pub title: String,
    /// Name of the residuals, with their unit.
    pub quantity: Quantity,
    /// One panel each.
    pub variables: Vec<Quantity>,
    /// One row per condition: one value per variable.
    pub conditions: Vec<Vec<f64>>,
    /// Name of each sensor and its residual at every condition, not finite where nothing was read. The first sensors,
    /// which should be those that stand out, are told apart; the others share one look.
    pub sensors: Vec<(String, Vec<f64>)>,
    /// Half width of the band of noise alone; 0 or not finite draws none.
    pub half_width: f64,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Height of a row of panels, CSS pixels. Chosen by eye.
const PANEL: f64 = 250.0;
/// Number of sensors told apart. Chosen: more colours in small plots confuse.
const APART: usize = 5;
/// Marker and colour of the sensors that are not told apart. Chosen by eye.
const OTHERS: (Marker, Rgb) = (Marker::Disc, Rgb(190, 190, 190));

impl ResidualPanels {
    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }

    fn columns(&self) -> usize {
        match self.variables.len() {
            0 | 1 => 1,
            2 | 4 => 2,
            _ => 3,
        }
    }

    fn range(&self) -> Result<Range> {
        if self.conditions.iter().any(|row| row.len() != self.variables.len())
            || self.sensors.iter().any(|(_, values)| values.len() != self.conditions.len())
        {
            return Err(Error::input("conditions, variables and residuals differ in number").at_key(self.title.clone()));
        }
        let nothing = || Error::input("no condition has a residual to draw").at_key(self.title.clone());
        if self.variables.is_empty() {
            return Err(nothing());
        }
        error_range(self.sensors.iter().flat_map(|(_, values)| values.iter().copied()), self.half_width).ok_or_else(nothing)
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (i, (name, _)) in self.sensors.iter().take(APART).enumerate() {
            legend.add(Swatch::Marker(series(i).marker, series(i).colour), name.clone());
        }
        match self.sensors.len().saturating_sub(APART) {
            0 => {}
            1 => legend.add(Swatch::Marker(OTHERS.0, OTHERS.1), self.sensors[APART].0.clone()),
            n => legend.add(Swatch::Marker(OTHERS.0, OTHERS.1), format!("{n} other sensors")),
        }
        if self.half_width.is_finite() && self.half_width > 0.0 {
            legend.add(Swatch::Line(super::style::INK, 1.4, super::style::DASHED), "95 % of noise alone");
        }
        legend
    }
}

impl Figure for ResidualPanels {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.range()?;
        let page = self.page();
        let rows = self.variables.len().div_ceil(self.columns()) as f64;
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 8.0 + rows * PANEL + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend, range) = (self.page(), self.legend(), self.range()?);
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let top = page.top() + legend.running_height(page.room()) + 8.0;
        let columns = self.columns();
        let width = page.room() / columns as f64;
        for (v, variable) in self.variables.iter().enumerate() {
            let at = (MARGIN + width * (v % columns) as f64, top + PANEL * (v / columns) as f64);
            let Some(across) = Range::of(self.conditions.iter().map(|row| row[v])) else { continue };
            // Only the first panel of a row names the vertical axis, which all share.
            let y = PlotAxis::linear(if v % columns == 0 { self.quantity.label() } else { String::new() }, range);
            let frame = PlotFrame::inside(at, (width - 8.0, PANEL - 10.0), PlotAxis::linear(variable.label(), across.padded(0.06)), y);
            frame.paint_grid(canvas)?;
            paint_band(canvas, &frame, self.half_width)?;
            // Sensors that stand out are drawn last.
            for (i, (_, values)) in self.sensors.iter().enumerate().rev() {
                let (marker, colour) = if i < APART { (series(i).marker, series(i).colour) } else { OTHERS };
                for (row, value) in self.conditions.iter().zip(values).filter(|(_, value)| value.is_finite()) {
                    canvas.marker(frame.at(row[v], *value), marker, if i < APART { 3.6 } else { 2.6 }, colour)?;
                }
            }
            frame.paint_axes(canvas)?;
        }
        page.paint(canvas, self.size()?.1)
    }
}
