//! The ladder of a diagnosis: the gain of every cause on data kept out, one after another.

use super::Figure;
use super::axis::PlotAxis;
use super::canvas::{Canvas, CanvasText, Stroke};
use super::fonts::{self, FontWeight};
use super::legend::{Legend, Swatch};
use super::regions::{Hatch, hatch_rectangle};
use super::rows::NamedRows;
use super::style::{AXIS, BLUE, ORANGE, SKY, fixed, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// One step of the ladder.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LadderStep {
    /// The change of the machine, in words.
    pub name: String,
    /// Root mean square error on data kept out, K; not a number where nothing could be kept out.
    pub kept_out: f64,
    /// Root mean square residual of all data, K.
    pub all: f64,
    /// Text beside the bars: the share of the misfit that is explained.
    pub remark: String,
}

/// Errors step by step, from the machine as it is to the machine with the last cause.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GainsFigure {
    /// Title.
    pub title: String,
    /// The machine as it is, then every cause.
    pub steps: Vec<LadderStep>,
    /// Error that the stated uncertainty accounts for, K.
    pub noise_floor: f64,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Room for names, CSS pixels. Chosen by eye.
const NAMES: f64 = 470.0;
/// Thickness of a bar as a share of the height of its row. Chosen by eye.
const BAR: f64 = 0.3;

impl GainsFigure {
    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }

    fn rows(&self) -> NamedRows {
        NamedRows::new(self.steps.iter().map(|s| s.name.as_str()), NAMES, 46.0)
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        legend.add(Swatch::Area(BLUE, 1.0, Hatch::Plain), "error on data kept out");
        legend.add(Swatch::Area(SKY, 1.0, Hatch::Rising), "residual of all data");
        legend.add(Swatch::Line(ORANGE, 1.6, &[]), "what the stated uncertainty comes to");
        legend
    }

    fn largest(&self) -> f64 {
        let values = self.steps.iter().flat_map(|s| [s.kept_out, s.all]).chain([self.noise_floor]);
        values.filter(|v| v.is_finite()).fold(1e-3, f64::max)
    }
}

impl Figure for GainsFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        if self.steps.is_empty() {
            return Err(Error::input("there is no step to draw").at_key(self.title.clone()));
        }
        let page = self.page();
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 8.0 + self.rows().height() + 56.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend, rows) = (self.page(), self.legend(), self.rows());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        // Numbers and remarks stand beyond the ends of the bars.
        let axis = PlotAxis::linear("root mean square error [K]", Range { low: 0.0, high: 1.5 * self.largest() });
        let frame = rows.frame(MARGIN, page.top() + legend.running_height(page.room()) + 8.0, WIDTH - MARGIN, axis);
        rows.paint(canvas, &frame)?;
        frame.paint_across(canvas, true)?;
        let left = frame.at(0.0, 0.0).0;
        let height = BAR * rows.row.min(60.0);
        for (k, step) in self.steps.iter().enumerate() {
            let middle = rows.middle(&frame, k);
            let bars = [(step.kept_out, middle - height, BLUE, Hatch::Plain), (step.all, middle, SKY, Hatch::Rising)];
            for (value, top, colour, hatch) in bars.into_iter().filter(|(value, ..)| value.is_finite()) {
                let width = (frame.at(value, 0.0).0 - left).max(1.5);
                canvas.rectangle(left, top, width, height, colour, 1.0)?;
                hatch_rectangle(canvas, (left, top), (width, height), hatch, colour)?;
                let remark = if colour == SKY && !step.remark.is_empty() { format!(", {}", step.remark) } else { String::new() };
                let label =
                    fonts::fit(&format!("{}{remark}", fixed(value, 2)), size::TICK, FontWeight::Regular, WIDTH - MARGIN - left - width);
                canvas.text((left + width + 6.0, top + 0.5 * height + 0.36 * size::TICK), &CanvasText::new(&label).size(size::TICK))?;
            }
        }
        if self.noise_floor.is_finite() {
            let x = frame.at(self.noise_floor, 0.0).0;
            canvas.line(&[(x, frame.top), (x, frame.bottom())], Stroke::solid(ORANGE, 1.6))?;
        }
        canvas.line(&[(left, frame.top), (left, frame.bottom())], Stroke::solid(AXIS, 1.4))?;
        page.paint(canvas, self.size()?.1)
    }
}
