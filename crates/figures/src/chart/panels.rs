//! Many small plots of the same few curves side by side: ours beside published ones, point by point.

use super::Figure;
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, CanvasText, PixelPoint, Stroke};
use super::fonts::{self, FontWeight};
use super::legend::{Legend, Swatch};
use super::style::{Quantity, series, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// One small plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Panel {
    /// Title of the plot.
    pub title: String,
    /// Samples of the first curve, drawn as markers; may be empty.
    pub samples: Vec<(f64, f64)>,
    /// One curve per name of the figure; empty where there is none.
    pub curves: Vec<Vec<(f64, f64)>>,
}

/// Small plots with axes of their own and one legend.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PanelsFigure {
    /// Title.
    pub title: String,
    /// Quantity along the horizontal axis.
    pub x: Quantity,
    /// Quantity along the vertical axis.
    pub y: Quantity,
    /// Names of the curves, the same in every plot.
    pub names: Vec<String>,
    /// The plots, row by row.
    pub panels: Vec<Panel>,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Panels side by side, a count. Chosen by eye.
const COLUMNS: usize = 3;
/// Height of a row of panels, CSS pixels. Chosen by eye.
const PANEL: f64 = 230.0;
/// Height of a heading, CSS pixels. Chosen by eye.
const HEADING: f64 = 24.0;
/// Least range of a vertical axis, in the quantity's unit. Chosen: differences below a twentieth of it do not matter.
const LEAST: f64 = 0.2;

impl PanelsFigure {
    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (i, name) in self.names.iter().enumerate() {
            legend.add(Swatch::Line(series(i).colour, 2.2, series(i).dash), name.clone());
        }
        legend
    }

    fn frame(&self, panel: &Panel, (left, top): PixelPoint, width: f64) -> Result<PlotFrame> {
        let all = || panel.curves.iter().chain([&panel.samples]).flatten().filter(|p| p.0.is_finite() && p.1.is_finite());
        let (Some(x), Some(mut y)) = (Range::of(all().map(|p| p.0)), Range::of(all().map(|p| p.1))) else {
            return Err(Error::input("no curve has a value to draw").at_key(panel.title.clone()));
        };
        if y.length() < LEAST {
            let middle = 0.5 * (y.low + y.high);
            y = Range { low: middle - 0.5 * LEAST, high: middle + 0.5 * LEAST };
        }
        let axes = (PlotAxis::linear(self.x.label(), x), PlotAxis::linear(self.y.label(), y.padded(0.08)));
        Ok(PlotFrame::with_text((left, top + HEADING), (width, PANEL - HEADING - 6.0), axes.0, axes.1, 12.0))
    }

    fn paint_panel(&self, canvas: &mut Canvas, panel: &Panel, at: PixelPoint, width: f64) -> Result<()> {
        let frame = self.frame(panel, at, width)?;
        frame.paint_grid(canvas)?;
        for (i, curve) in panel.curves.iter().enumerate().filter(|(_, c)| !c.is_empty()) {
            let places: Vec<_> = curve.iter().filter(|p| p.1.is_finite()).map(|p| frame.at(p.0, p.1)).collect();
            canvas.line(&places, Stroke { colour: series(i).colour, width: 2.0, dash: series(i).dash })?;
        }
        for (x, y) in &panel.samples {
            canvas.marker(frame.at(*x, *y), series(0).marker, 2.8, series(0).colour)?;
        }
        frame.paint_axes(canvas)?;
        let title = fonts::fit(&panel.title, size::TICK, FontWeight::Bold, width - 8.0);
        canvas.text((at.0 + 8.0, at.1 + HEADING - 6.0), &CanvasText::new(&title).size(size::TICK).bold())
    }
}

impl Figure for PanelsFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        if self.panels.is_empty() {
            return Err(Error::input("there is no plot to draw").at_key(self.title.clone()));
        }
        if let Some(panel) = self.panels.iter().find(|p| p.curves.len() > self.names.len()) {
            return Err(Error::input("a plot has more curves than there are names").at_key(panel.title.clone()));
        }
        for panel in &self.panels {
            self.frame(panel, (0.0, 0.0), WIDTH / COLUMNS as f64)?;
        }
        let page = self.page();
        let rows = self.panels.len().div_ceil(COLUMNS) as f64;
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 8.0 + rows * PANEL + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend) = (self.page(), self.legend());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let top = page.top() + legend.running_height(page.room()) + 8.0;
        let width = (WIDTH - 2.0 * MARGIN) / COLUMNS as f64;
        for (i, panel) in self.panels.iter().enumerate() {
            let at = (MARGIN + (i % COLUMNS) as f64 * width, top + (i / COLUMNS) as f64 * PANEL);
            self.paint_panel(canvas, panel, at, width - 8.0)?;
        }
        page.paint(canvas, self.size()?.1)
    }
}
