//! Residual over the prediction and over every variable, side by side: is there a pattern left in the errors of the
//! fit?

use super::Figure;
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::Canvas;
use super::legend::{Legend, Swatch};
use super::parity::{error_range, look, paint_band};
use super::style::{DASHED, INK, Quantity, size, unit_symbol};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// Residuals of one measurement point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ResidualFigure {
    /// Title.
    pub title: String,
    /// Quantity that is predicted.
    pub quantity: Quantity,
    /// The variables.
    pub variables: Vec<Quantity>,
    /// One row per condition: one value per variable.
    pub conditions: Vec<Vec<f64>>,
    /// Prediction per condition.
    pub predicted: Vec<f64>,
    /// Simulated minus predicted (or leave-one-out residual) per condition.
    pub residuals: Vec<f64>,
    /// Whether the fit has not seen the condition; may be empty, none is then held out.
    pub held_out: Vec<bool>,
    /// Half width of the 95 % band of the fit; 0 or not finite draws none.
    pub half_width: f64,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 980.0;
/// Height of a row of panels, CSS pixels. Chosen by eye.
const PANEL: f64 = 270.0;
/// Panels side by side, a count. Chosen by eye.
const COLUMNS: usize = 3;

impl ResidualFigure {
    fn check(&self) -> Result<()> {
        let n = self.residuals.len();
        let wrong = |what: &str, read: usize| {
            Err(Error::input(format!("residuals and {what} differ in number")).at_key(self.title.clone()).read(format!("{n} and {read}")))
        };
        if self.predicted.len() != n {
            return wrong("predictions", self.predicted.len());
        }
        if self.conditions.len() != n {
            return wrong("conditions", self.conditions.len());
        }
        if !(self.held_out.is_empty() || self.held_out.len() == n) {
            return wrong("held-out marks", self.held_out.len());
        }
        if let Some(row) = self.conditions.iter().find(|row| row.len() != self.variables.len()) {
            return Err(Error::input("a condition has another number of values than there are variables")
                .at_key(self.title.clone())
                .read(format!("{} values, {} variables", row.len(), self.variables.len())));
        }
        Ok(())
    }

    /// Title and horizontal values of each panel; panels without a finite value are left out.
    fn panels(&self) -> Result<Vec<(String, Vec<f64>)>> {
        self.check()?;
        let predicted = Quantity::new(format!("predicted {}", self.quantity.name), self.quantity.unit.clone());
        let mut panels = vec![(predicted.label(), self.predicted.clone())];
        for (v, variable) in self.variables.iter().enumerate() {
            panels.push((variable.label(), self.conditions.iter().map(|row| row[v]).collect()));
        }
        panels.retain(|(_, x)| x.iter().zip(&self.residuals).any(|(x, r)| x.is_finite() && r.is_finite()));
        if panels.is_empty() {
            return Err(Error::input("no condition has a residual to draw").at_key(self.title.clone()));
        }
        Ok(panels)
    }

    fn held(&self, k: usize) -> bool {
        self.held_out.get(k).copied().unwrap_or(false)
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (held_out, name) in [(false, "training condition"), (true, "held-out condition")] {
            if (0..self.residuals.len()).any(|k| self.held(k) == held_out) {
                let (marker, colour) = look(held_out);
                legend.add(Swatch::Marker(marker, colour), name);
            }
        }
        if self.half_width.is_finite() && self.half_width > 0.0 {
            legend.add(Swatch::Line(INK, 1.4, DASHED), "95 % band of the fit");
        }
        legend
    }
}

impl Figure for ResidualFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        let page = Page::new(WIDTH, &self.title, "", &self.notes);
        let rows = self.panels()?.len().div_ceil(COLUMNS) as f64;
        Ok((WIDTH, page.top() + rows * PANEL + 6.0 + self.legend().running_height(page.room()) + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let page = Page::new(WIDTH, &self.title, "", &self.notes);
        let panels = self.panels()?;
        let Some(errors) = error_range(self.residuals.iter().copied(), self.half_width) else {
            return Err(Error::input("no condition has a residual to draw").at_key(self.title.clone()));
        };
        let unit = unit_symbol(&self.quantity.unit).replace("°C", "K");
        let y_title = if unit.is_empty() { "residual".to_string() } else { format!("residual [{unit}]") };
        let width = page.room() / COLUMNS as f64;
        for (p, (title, xs)) in panels.iter().enumerate() {
            let at = (MARGIN + width * (p % COLUMNS) as f64, page.top() + PANEL * (p / COLUMNS) as f64);
            let used = xs.iter().zip(&self.residuals).filter(|(_, r)| r.is_finite()).map(|(x, _)| *x);
            let Some(range) = Range::of(used) else { continue };
            // Only the first panel of a row names the vertical axis, which all share.
            let y = PlotAxis::linear(if p % COLUMNS == 0 { y_title.as_str() } else { "" }, errors);
            let frame = PlotFrame::inside(at, (width - 6.0, PANEL - 8.0), PlotAxis::linear(title, range.padded(0.05)), y);
            frame.paint_grid(canvas)?;
            paint_band(canvas, &frame, self.half_width)?;
            for held_out in [false, true] {
                let (marker, colour) = look(held_out);
                for (k, (x, r)) in xs.iter().zip(&self.residuals).enumerate() {
                    if self.held(k) == held_out {
                        canvas.marker(frame.at(*x, *r), marker, 3.2, colour)?;
                    }
                }
            }
            frame.paint_axes(canvas)?;
        }
        let rows = panels.len().div_ceil(COLUMNS) as f64;
        self.legend().paint_running(canvas, (MARGIN, page.top() + rows * PANEL + 2.0), page.room())?;
        page.paint(canvas, self.size()?.1)
    }
}
