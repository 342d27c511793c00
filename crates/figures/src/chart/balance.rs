//! Heat balance before and after a change of the model: two bars per source and sink.

use super::Figure;
use super::axis::PlotAxis;
use super::canvas::{Canvas, CanvasText, Stroke};
use super::fonts::{self, FontWeight};
use super::heat::watts;
use super::legend::{Legend, Swatch};
use super::regions::{Hatch, hatch_rectangle};
use super::rows::NamedRows;
use super::style::{AXIS, BLUE, Quantity, Rgb, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page, fixed_conditions};
use coldplate_base::error::{Error, Result};

/// One source or sink, W; `None` if it is not part of the model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatPair {
    /// Name of the source or sink.
    pub name: String,
    /// Heat in the model as it was, W.
    pub before: Option<f64>,
    /// Heat in the model with the change, W.
    pub after: Option<f64>,
}

/// A heat balance twice.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BalanceFigure {
    /// Title.
    pub title: String,
    /// Heat into the machine.
    pub sources: Vec<HeatPair>,
    /// Heat out of the machine.
    pub sinks: Vec<HeatPair>,
    /// Names of the two bars.
    pub names: [String; 2],
    /// The condition.
    pub fixed: Vec<(Quantity, f64)>,
    /// More lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Least height of a row, CSS pixels. Chosen by eye.
const ROW: f64 = 36.0;
/// Height of a heading, CSS pixels. Chosen by eye.
const HEADING: f64 = 28.0;
/// Colour and hatching of the bar before the change. Chosen by eye.
const BEFORE: (Rgb, Hatch) = (Rgb(190, 190, 190), Hatch::Plain);
/// Colour and hatching of the bar after the change. Chosen by eye.
const AFTER: (Rgb, Hatch) = (BLUE, Hatch::Plain);

impl BalanceFigure {
    fn page(&self) -> Page {
        let mut footer = vec![fixed_conditions(&self.fixed)];
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }

    fn groups(&self) -> impl Iterator<Item = (&'static str, &[HeatPair])> {
        [("Heat into the machine", self.sources.as_slice()), ("Heat out of the machine", self.sinks.as_slice())]
            .into_iter()
            .filter(|(_, pairs)| !pairs.is_empty())
    }

    fn values(&self) -> impl Iterator<Item = f64> {
        self.sources.iter().chain(&self.sinks).flat_map(|p| [p.before, p.after]).flatten().filter(|w| w.abs() < 1e290)
    }

    fn has_after(&self) -> bool {
        self.sources.iter().chain(&self.sinks).any(|p| p.after.is_some())
    }

    fn rows(&self) -> NamedRows {
        NamedRows::new(self.groups().flat_map(|(_, pairs)| pairs.iter().map(|p| p.name.as_str())), 270.0, ROW)
    }

    fn axis(&self) -> Result<PlotAxis> {
        let Some(range) = Range::of(self.values().chain([0.0])).filter(|_| self.values().next().is_some()) else {
            return Err(Error::input("there is no heat flow to draw").at_key(self.title.clone()));
        };
        // Numbers stand beyond the ends of the bars.
        let below = if range.low < 0.0 { 0.16 } else { 0.0 };
        let length = range.length() / (1.0 - 0.16 - below);
        Ok(PlotAxis::linear("heat flow [W]", Range { low: range.low - below * length, high: range.high + 0.16 * length }))
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        legend.add(Swatch::Area(BEFORE.0, 1.0, BEFORE.1), self.names[0].clone());
        if self.has_after() {
            legend.add(Swatch::Area(AFTER.0, 1.0, AFTER.1), self.names[1].clone());
        }
        legend
    }
}

impl Figure for BalanceFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.axis()?;
        let page = self.page();
        let bars = self.groups().count() as f64 * HEADING + self.rows().height();
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 4.0 + bars + 54.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend, all) = (self.page(), self.legend(), self.rows());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let mut top = page.top() + legend.running_height(page.room()) + 4.0;
        let count = self.groups().count();
        for (index, (heading, pairs)) in self.groups().enumerate() {
            let mut rows = NamedRows::new(pairs.iter().map(|p| p.name.as_str()), 270.0, ROW);
            // Both groups share the column of names and the height of rows.
            (rows.names_width, rows.row) = (all.names_width, all.row);
            let frame = rows.frame(MARGIN, top + HEADING - 4.0, WIDTH - MARGIN, self.axis()?);
            canvas.text((MARGIN, top + 15.0), &CanvasText::new(heading).size(size::TICK).bold())?;
            rows.paint(canvas, &frame)?;
            let zero = frame.at(0.0, 0.0).0;
            for (k, pair) in pairs.iter().enumerate() {
                let middle = rows.middle(&frame, k);
                let bars: Vec<(f64, (Rgb, Hatch))> = [(pair.before, BEFORE), (pair.after, AFTER)]
                    .into_iter()
                    .filter_map(|(value, look)| value.filter(|w| w.abs() < 1e290).map(|w| (w, look)))
                    .collect();
                let height = 13.0;
                for (b, (value, (colour, hatch))) in bars.iter().enumerate() {
                    let y = middle + (b as f64 - 0.5 * bars.len() as f64) * (height + 2.0) + 1.0;
                    let end = frame.at(*value, 0.0).0;
                    let (left, width) = (zero.min(end), (end - zero).abs().max(1.0));
                    canvas.rectangle(left, y, width, height, *colour, 1.0)?;
                    hatch_rectangle(canvas, (left, y), (width, height), *hatch, *colour)?;
                    let label = fonts::fit(&watts(*value), 11.5, FontWeight::Regular, 0.14 * frame.width);
                    let text = CanvasText::new(&label).size(11.5);
                    let baseline = y + height / 2.0 + 0.36 * 11.5;
                    if *value < 0.0 {
                        canvas.text((left - 6.0, baseline), &text.end())?;
                    } else {
                        canvas.text((left + width + 6.0, baseline), &text)?;
                    }
                }
            }
            canvas.line(&[(zero, frame.top), (zero, frame.bottom())], Stroke::solid(AXIS, 1.4))?;
            if index + 1 == count {
                frame.paint_across(canvas, false)?;
            } else {
                canvas.frame(frame.left, frame.top, frame.width, frame.height, Stroke::solid(AXIS, 1.2))?;
            }
            top += HEADING + rows.height();
        }
        page.paint(canvas, self.size()?.1)
    }
}
