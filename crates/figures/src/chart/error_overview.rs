//! Errors of each point's surrogate: leave-one-out, k-fold and held-out errors beside the claimed band, on a
//! logarithmic axis.

use super::Figure;
use super::axis::PlotAxis;
use super::canvas::{Canvas, Stroke};
use super::legend::{Legend, Swatch};
use super::rows::NamedRows;
use super::style::{BLUE, DASHED, GREEN, GRID, INK, Marker, Rgb, VERMILLION, size, unit_symbol};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// Errors of one point's surrogate, in the unit of the figure; `None` if not known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointErrors {
    /// Name of the measurement point.
    pub name: String,
    /// Root mean square leave-one-out error.
    pub leave_one_out: Option<f64>,
    /// Root mean square k-fold error.
    pub k_fold: Option<f64>,
    /// Largest error on held-out conditions.
    pub held_out_max: Option<f64>,
    /// Half width of the fit's 95 % band.
    pub half_width: Option<f64>,
}

impl PointErrors {
    fn values(&self) -> [Option<f64>; 4] {
        [self.leave_one_out, self.k_fold, self.half_width, self.held_out_max]
    }
}

/// Errors of all points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ErrorOverview {
    /// Title.
    pub title: String,
    /// Unit of all errors, for example `K`.
    pub unit: String,
    /// One row per measurement point.
    pub points: Vec<PointErrors>,
    /// The error aimed at, drawn as a line.
    pub target: Option<f64>,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 960.0;
/// Marker, colour and name of each kind of error. Chosen by eye.
const KINDS: [(Marker, Rgb, &str); 4] = [
    (Marker::Ring, BLUE, "leave-one-out, rms"),
    (Marker::Square, GREEN, "k-fold, rms"),
    (Marker::Cross, INK, "half width of the fit's 95 % band"),
    (Marker::Triangle, VERMILLION, "held out, largest"),
];

fn drawable(value: f64) -> bool {
    value > 1e-290 && value < 1e290
}

impl ErrorOverview {
    fn rows(&self) -> NamedRows {
        NamedRows::new(self.points.iter().map(|p| p.name.as_str()), 280.0, 30.0)
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (kind, (marker, colour, name)) in KINDS.into_iter().enumerate() {
            if self.points.iter().any(|p| p.values()[kind].is_some_and(drawable)) {
                legend.add(Swatch::Marker(marker, colour), name);
            }
        }
        if self.target.is_some_and(drawable) {
            legend.add(Swatch::Line(INK, 1.6, DASHED), "aimed at");
        }
        legend
    }

    fn axis(&self) -> Result<PlotAxis> {
        let shown = self.points.iter().flat_map(|p| p.values()).flatten().chain(self.target).filter(|v| drawable(*v));
        let Some(range) = Range::of(shown.map(f64::log10)) else {
            return Err(Error::input("no point has a positive error to draw").at_key(self.title.clone()));
        };
        let room = (0.06 * range.length()).max(0.15);
        let range = Range { low: 10f64.powf(range.low - room), high: 10f64.powf(range.high + room) };
        let unit = if self.unit.is_empty() { String::new() } else { format!(" [{}]", unit_symbol(&self.unit)) };
        Ok(PlotAxis::logarithmic(format!("error{unit}"), range))
    }

    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }
}

impl Figure for ErrorOverview {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.axis()?;
        let page = self.page();
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 8.0 + self.rows().height() + 56.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, rows) = (self.page(), self.rows());
        let legend = self.legend();
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let frame = rows.frame(MARGIN, page.top() + legend.running_height(page.room()) + 8.0, WIDTH - MARGIN, self.axis()?);
        rows.paint(canvas, &frame)?;
        frame.paint_across(canvas, true)?;
        let x = |value: f64| frame.at(value, 0.0).0;
        if let Some(target) = self.target.filter(|t| drawable(*t)) {
            canvas.line(&[(x(target), frame.top), (x(target), frame.bottom())], Stroke { colour: INK, width: 1.6, dash: DASHED })?;
        }
        for (index, point) in self.points.iter().enumerate() {
            let y = rows.middle(&frame, index);
            let values: Vec<f64> = point.values().into_iter().flatten().filter(|v| drawable(*v)).collect();
            if let Some(range) = Range::of(values.iter().copied()).filter(|_| values.len() > 1) {
                let reach = [range.low, range.high].map(|v| (x(v).clamp(frame.left, frame.right()), y));
                canvas.line(&reach, Stroke::solid(GRID, 3.0))?;
            }
            for (kind, value) in point.values().into_iter().enumerate() {
                if let Some(value) = value.filter(|v| drawable(*v)) {
                    canvas.marker((x(value), y), KINDS[kind].0, 4.8, KINDS[kind].1)?;
                }
            }
        }
        page.paint(canvas, self.size()?.1)
    }
}
