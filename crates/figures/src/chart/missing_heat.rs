//! Heat that is missing or in excess: the heat that each part would have to give, as rows with intervals.

use super::Figure;
use super::axis::PlotAxis;
use super::canvas::{Canvas, CanvasText, Stroke};
use super::fonts::{self, FontWeight};
use super::legend::{Legend, Swatch};
use super::rows::NamedRows;
use super::style::{AXIS, Marker, Quantity, Rgb, VERMILLION, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// One place.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlaceInterval {
    /// Name of the place.
    pub name: String,
    /// Best value.
    pub value: f64,
    /// Ends of the interval.
    pub ends: (f64, f64),
    /// Text beside the interval.
    pub remark: String,
    /// Whether the value stands out.
    pub is_strong: bool,
}

/// Values with intervals about zero.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IntervalFigure {
    /// Title.
    pub title: String,
    /// Quantity that is shown.
    pub quantity: Quantity,
    /// The rows in the order shown.
    pub rows: Vec<PlaceInterval>,
    /// Heading of the remarks.
    pub remarks: String,
    /// Meaning of standing out, and of not standing out.
    pub meaning: [String; 2],
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Room for the remarks, CSS pixels. Chosen by eye.
const REMARKS: f64 = 190.0;
/// Marker and colour of values that stand out. Chosen by eye.
const STRONG: (Marker, Rgb) = (Marker::Disc, VERMILLION);
/// Marker and colour of the other values. Chosen by eye.
const WEAK: (Marker, Rgb) = (Marker::Ring, AXIS);

impl IntervalFigure {
    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }

    fn rows(&self) -> NamedRows {
        NamedRows::new(self.rows.iter().map(|r| r.name.as_str()), 250.0, 26.0)
    }

    fn axis(&self) -> Result<PlotAxis> {
        let values = self.rows.iter().flat_map(|r| [r.value, r.ends.0, r.ends.1]).chain([0.0]).filter(|v| v.abs() < 1e290);
        if self.rows.iter().all(|r| !r.value.is_finite()) {
            return Err(Error::input("there is no value to draw").at_key(self.title.clone()));
        }
        let range = Range::of(values).unwrap_or(Range { low: -1.0, high: 1.0 });
        Ok(PlotAxis::linear(self.quantity.label(), range.padded(0.06)))
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (is_strong, (marker, colour)) in [(true, STRONG), (false, WEAK)] {
            if self.rows.iter().any(|r| r.is_strong == is_strong) {
                legend.add(Swatch::Marker(marker, colour), self.meaning[usize::from(!is_strong)].clone());
            }
        }
        legend
    }
}

impl Figure for IntervalFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.axis()?;
        let page = self.page();
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 26.0 + self.rows().height() + 56.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend, rows) = (self.page(), self.legend(), self.rows());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let top = page.top() + legend.running_height(page.room()) + 26.0;
        let frame = rows.frame(MARGIN, top, WIDTH - MARGIN - REMARKS, self.axis()?);
        rows.paint(canvas, &frame)?;
        frame.paint_across(canvas, true)?;
        let zero = frame.at(0.0, 0.0).0;
        canvas.line(&[(zero, frame.top), (zero, frame.bottom())], Stroke::solid(AXIS, 1.4))?;
        let beside = frame.right() + 14.0;
        let heading = fonts::fit(&self.remarks, size::TICK, FontWeight::Bold, WIDTH - MARGIN - beside);
        canvas.text((beside, frame.top - 8.0), &CanvasText::new(&heading).size(size::TICK).bold())?;
        for (k, row) in self.rows.iter().enumerate() {
            let y = rows.middle(&frame, k);
            let (marker, colour) = if row.is_strong { STRONG } else { WEAK };
            let x = |v: f64| frame.at(v, 0.0).0;
            if row.ends.0.abs() < 1e290 && row.ends.1.abs() < 1e290 {
                let stroke = Stroke::solid(colour, 1.6);
                let (a, b) = (x(row.ends.0), x(row.ends.1));
                canvas.line(&[(a, y), (b, y)], stroke)?;
                canvas.line(&[(a, y - 4.0), (a, y + 4.0)], stroke)?;
                canvas.line(&[(b, y - 4.0), (b, y + 4.0)], stroke)?;
            }
            if row.value.abs() < 1e290 {
                canvas.marker((x(row.value), y), marker, 4.6, colour)?;
            }
            let remark = fonts::fit(&row.remark, size::TICK, FontWeight::Regular, WIDTH - MARGIN - beside);
            canvas.text((beside, y + 0.36 * size::TICK), &CanvasText::new(&remark).size(size::TICK))?;
        }
        page.paint(canvas, self.size()?.1)
    }
}
