//! Borders of the acceptable conditions by several models of one machine: as it was described, as it was identified, as it was
//! diagnosed. Between its two borders each model has a zone in which it cannot tell.

use super::Figure;
use super::acceptability::{AcceptabilityMap, CellState};
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, CanvasText, PixelPoint, Stroke};
use super::contour::{ValueGrid, around, label_place};
use super::fonts::{self, FontWeight};
use super::legend::{Legend, Swatch};
use super::regions::{Hatch, hatch};
use super::style::{Quantity, series};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page, fixed_conditions};
use coldplate_base::error::{Error, Result};

/// One model of the machine over two variables; values per node lie at `[j * x_values.len() + i]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BorderedModel {
    /// Name of the model, for the legend.
    pub name: String,
    /// Signed distance of a node from the border of acceptable conditions: positive where acceptable.
    pub acceptable: Vec<f64>,
    /// Signed distance of a node from the border of conditions that are not acceptable: positive where not
    /// acceptable.
    pub not_acceptable: Vec<f64>,
}

/// Borders of several models in one picture.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BordersFigure {
    /// Title.
    pub title: String,
    /// Horizontal variable.
    pub x: Quantity,
    /// Vertical variable.
    pub y: Quantity,
    /// Rising values of the horizontal variable.
    pub x_values: Vec<f64>,
    /// Rising values of the vertical variable.
    pub y_values: Vec<f64>,
    /// The models, in the order of the legend.
    pub models: Vec<BorderedModel>,
    /// The variables held, with their values.
    pub fixed: Vec<(Quantity, f64)>,
    /// More lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 900.0;
/// Height of the plot, CSS pixels. Chosen by eye.
const PLOT: f64 = 500.0;
/// Opacity of the zone in which a model cannot tell, 0 to 1. Chosen by eye.
const OPACITY: f64 = 0.22;
/// Font size of the models' names, CSS pixels. Chosen by eye.
const LABEL: f64 = 13.0;

/// Zones of neighbours in the legend are hatched the other way.
fn pattern(index: usize) -> Hatch {
    if index.is_multiple_of(2) { Hatch::Rising } else { Hatch::Falling }
}

impl BordersFigure {
    /// Adds the borders of a map, which has the variables and the nodes of those before it.
    pub fn add(&mut self, name: &str, map: AcceptabilityMap) {
        let signed = |wanted: CellState| map.signed(wanted);
        let (acceptable, not_acceptable) = (signed(CellState::Acceptable), signed(CellState::NotAcceptable));
        self.models.push(BorderedModel { name: name.to_owned(), acceptable, not_acceptable });
        (self.x, self.y, self.x_values, self.y_values, self.fixed) = (map.x, map.y, map.x_values, map.y_values, map.fixed);
    }

    fn grid(&self, z: Vec<f64>) -> Result<ValueGrid> {
        ValueGrid::new(self.x_values.clone(), self.y_values.clone(), z).map_err(|e| e.at_key(self.title.clone()))
    }

    fn frame(&self, page: &Page, top: f64) -> Result<PlotFrame> {
        let ends = |values: &[f64]| values.first().zip(values.last()).map(|(low, high)| Range { low: *low, high: *high });
        let (Some(x), Some(y)) = (ends(&self.x_values), ends(&self.y_values)) else {
            return Err(Error::input("a map needs values of both variables").at_key(self.title.clone()));
        };
        Ok(PlotFrame::inside((MARGIN, top), (page.room(), PLOT), PlotAxis::linear(self.x.label(), x), PlotAxis::linear(self.y.label(), y)))
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend::default();
        for (index, model) in self.models.iter().enumerate() {
            let style = series(index);
            legend.add(Swatch::Line(style.colour, 2.4, style.dash), format!("{}: acceptable up to here", model.name));
            legend.add(Swatch::Area(style.colour, OPACITY, pattern(index)), format!("{}: cannot tell", model.name));
        }
        legend
    }

    fn page(&self) -> Page {
        let mut footer = vec![fixed_conditions(&self.fixed)];
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }

    fn head(&self, page: &Page) -> f64 {
        page.top() + self.legend().running_height(page.room()) + 10.0
    }

    fn paint_models(&self, canvas: &mut Canvas, frame: &PlotFrame) -> Result<()> {
        let bounds = (frame.left, frame.top, frame.right(), frame.bottom());
        let mut taken = Vec::new();
        for (index, model) in self.models.iter().enumerate() {
            // Neither the one nor the other.
            let open = model.acceptable.iter().zip(&model.not_acceptable).map(|(a, b)| (-a).min(-b)).collect();
            let open = self.grid(open)?;
            hatch(canvas, (frame.left, frame.top), (frame.width, frame.height), pattern(index), series(index).colour, |px, py| {
                let (s, t) = ((px - frame.left) / frame.width, (frame.bottom() - py) / frame.height);
                open.value(frame.x.range.low + s * frame.x.range.length(), frame.y.range.low + t * frame.y.range.length()) > 0.0
            })?;
        }
        for (index, model) in self.models.iter().enumerate() {
            let style = series(index);
            for (z, width) in [(&model.acceptable, 2.4), (&model.not_acceptable, 1.0)] {
                for line in self.grid(z.clone())?.contour(0.0) {
                    let places: Vec<PixelPoint> = line.points.iter().map(|p| frame.at(p.0, p.1)).collect();
                    canvas.line(&places, Stroke { colour: style.colour, width, dash: style.dash })?;
                    if width < 2.0 {
                        continue;
                    }
                    let size = (fonts::width(&model.name, LABEL, FontWeight::Regular) + 8.0, LABEL * 1.3);
                    if let Some(at) = label_place(&places, size, bounds, &taken) {
                        taken.push(around(at, size));
                        canvas.plate(at, &CanvasText::new(&model.name).size(LABEL).colour(style.colour))?;
                    }
                }
            }
        }
        Ok(())
    }
}

impl Figure for BordersFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        let page = self.page();
        self.frame(&page, self.head(&page))?;
        Ok((WIDTH, self.head(&page) + PLOT + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend) = (self.page(), self.legend());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let frame = self.frame(&page, self.head(&page))?;
        frame.paint_grid(canvas)?;
        self.paint_models(canvas, &frame)?;
        frame.paint_axes(canvas)?;
        page.paint(canvas, self.size()?.1)
    }
}
