//! Probability of each explanation, and whether the data can refute it.

use super::Figure;
use super::axis::PlotAxis;
use super::canvas::{Canvas, CanvasText, Stroke};
use super::fonts::{self, FontWeight};
use super::legend::{Legend, Swatch};
use super::regions::{Hatch, hatch_rectangle};
use super::rows::NamedRows;
use super::style::{AXIS, BLUE, ORANGE, Rgb, SKY, fixed, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// Standing of an explanation before the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Standing {
    /// The data cannot refute it.
    #[default]
    Open,
    /// Refuted: the misfit is too large beside the best one.
    Refuted,
    /// Not an explanation by a cause: nothing is wrong, or something else is.
    Other,
}

/// An explanation with its probability.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ranked {
    /// Explanation in words.
    pub name: String,
    /// Probability of the explanation, 0 to 1.
    pub probability: f64,
    /// Standing before the data.
    pub standing: Standing,
}

/// Explanations as bars.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RankingFigure {
    /// Title.
    pub title: String,
    /// The explanations in the order shown.
    pub ranked: Vec<Ranked>,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Room for names, CSS pixels. Chosen by eye.
const NAMES: f64 = 520.0;
/// Colour, hatching and name of each standing. Chosen by eye.
const STANDINGS: [(Standing, Rgb, Hatch, &str); 3] = [
    (Standing::Open, BLUE, Hatch::Plain, "the data cannot refute it"),
    (Standing::Refuted, SKY, Hatch::Rising, "refuted, or far less probable"),
    (Standing::Other, ORANGE, Hatch::Falling, "no cause of the catalogue"),
];

impl RankingFigure {
    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }

    fn rows(&self) -> NamedRows {
        NamedRows::new(self.ranked.iter().map(|r| r.name.as_str()), NAMES, 30.0)
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (standing, colour, hatch, meaning) in STANDINGS {
            if self.ranked.iter().any(|r| r.standing == standing) {
                legend.add(Swatch::Area(colour, 1.0, hatch), meaning);
            }
        }
        legend
    }
}

impl Figure for RankingFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        if self.ranked.is_empty() {
            return Err(Error::input("there is no explanation to draw").at_key(self.title.clone()));
        }
        let page = self.page();
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 8.0 + self.rows().height() + 56.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend, rows) = (self.page(), self.legend(), self.rows());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        // The numbers stand beyond the ends of the bars.
        let axis = PlotAxis::linear("probability", Range { low: 0.0, high: 1.14 });
        let frame = rows.frame(MARGIN, page.top() + legend.running_height(page.room()) + 8.0, WIDTH - MARGIN, axis);
        rows.paint(canvas, &frame)?;
        frame.paint_across(canvas, true)?;
        for (k, r) in self.ranked.iter().enumerate() {
            let share = if r.probability.is_finite() { r.probability.clamp(0.0, 1.0) } else { 0.0 };
            let (left, y, height) = (frame.at(0.0, 0.0).0, rows.middle(&frame, k), 0.56 * rows.row.min(32.0));
            let width = (frame.at(share, 0.0).0 - left).max(1.5);
            let (_, colour, hatch, _) = STANDINGS.into_iter().find(|s| s.0 == r.standing).unwrap_or(STANDINGS[0]);
            canvas.rectangle(left, y - height / 2.0, width, height, colour, 1.0)?;
            hatch_rectangle(canvas, (left, y - height / 2.0), (width, height), hatch, colour)?;
            let label = if r.probability > 0.0 && r.probability < 5e-4 { "below 0.001".to_string() } else { fixed(r.probability, 3) };
            let label = fonts::fit(&label, size::TICK, FontWeight::Regular, 120.0);
            canvas.text((left + width + 6.0, y + 0.36 * size::TICK), &CanvasText::new(&label).size(size::TICK))?;
        }
        let zero = frame.at(0.0, 0.0).0;
        canvas.line(&[(zero, frame.top), (zero, frame.bottom())], Stroke::solid(AXIS, 1.4))?;
        page.paint(canvas, self.size()?.1)
    }
}
