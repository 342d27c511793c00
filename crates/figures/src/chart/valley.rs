//! A misfit over two parameters: the valley it forms, the best place, and the temperatures along each parameter.

use super::Figure;
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, CanvasText, PixelPoint, Stroke};
use super::contour::{ValueGrid, around, label_place};
use super::fonts::{self, FontWeight};
use super::legend::{Legend, Swatch};
use super::style::{BLUE, DASHED, INK, Marker, Quantity, Rgb, VERMILLION, number, series, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// Temperature of one sensor along a parameter, the other at its best value.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Name of the sensor.
    pub name: String,
    /// Predicted, one value per value of the parameter.
    pub predicted: Vec<f64>,
    /// Measured.
    pub measured: f64,
}

/// A misfit over two parameters, and temperatures along both.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ValleyFigure {
    /// Title.
    pub title: String,
    /// The two parameters.
    pub parameters: [Quantity; 2],
    /// Rising values of each.
    pub axes: [Vec<f64>; 2],
    /// Misfit over both parameters, `[first][second]`; not finite where there is none.
    pub misfit: Vec<Vec<f64>>,
    /// Meaning of the misfit, in words.
    pub meaning: String,
    /// Levels of the contour lines.
    pub levels: Vec<f64>,
    /// Marked places, with their names; the first is the best.
    pub marks: Vec<(String, [f64; 2])>,
    /// Temperatures along the first and along the second parameter.
    pub traces: [Vec<Trace>; 2],
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1000.0;
/// Font size of the levels, CSS pixels. Chosen by eye.
const LABEL: f64 = 11.0;
/// Height of the map, CSS pixels. Chosen by eye.
const MAP: f64 = 520.0;
/// Height of the curves below the map, CSS pixels. Chosen by eye.
const CURVES: f64 = 330.0;
/// Markers and colours of the marked places, the best first. Chosen by eye.
const MARKS: [(Marker, Rgb); 3] = [(Marker::Diamond, VERMILLION), (Marker::Disc, INK), (Marker::Square, BLUE)];

/// Shade of a band, from the valley's floor (light) up.
fn shade(level: usize, of: usize) -> Rgb {
    let s = level as f64 / of.max(1) as f64;
    let mix = |low: f64, high: f64| (low + s * (high - low)) as u8;
    Rgb(mix(247.0, 66.0), mix(251.0, 120.0), mix(255.0, 170.0))
}

impl ValleyFigure {
    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, &self.meaning, &self.notes)
    }

    fn grid(&self) -> Result<ValueGrid> {
        let z = (0..self.axes[1].len()).flat_map(|j| (0..self.axes[0].len()).map(move |i| (i, j)));
        let z = z.map(|(i, j)| self.misfit.get(i).and_then(|row| row.get(j)).copied().unwrap_or(f64::NAN)).collect();
        ValueGrid::new(self.axes[0].clone(), self.axes[1].clone(), z).map_err(|e| e.at_key(self.title.clone()))
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (i, (name, _)) in self.marks.iter().enumerate() {
            let (marker, colour) = MARKS[i % MARKS.len()];
            legend.add(Swatch::Marker(marker, colour), name.clone());
        }
        legend
    }

    fn frame(&self, top: f64) -> PlotFrame {
        let ends = |axis: &[f64]| Range { low: axis[0], high: axis[axis.len() - 1] };
        let axis = |k: usize| PlotAxis::linear(self.parameters[k].label(), ends(&self.axes[k]));
        PlotFrame::inside((MARGIN, top), (WIDTH - 2.0 * MARGIN, MAP), axis(0), axis(1))
    }

    fn paint_map(&self, canvas: &mut Canvas, frame: &PlotFrame) -> Result<()> {
        let grid = self.grid()?;
        for j in 0..grid.y.len() - 1 {
            for i in 0..grid.x.len() - 1 {
                let Some(four) = grid.corners(i, j) else { continue };
                let mean = four.iter().map(|c| c.1).sum::<f64>() / 4.0;
                let level = self.levels.iter().filter(|l| mean > **l).count();
                let (a, b) = (frame.at(grid.x[i], grid.y[j + 1]), frame.at(grid.x[i + 1], grid.y[j]));
                // A little wider than the cell, so that no seam shows.
                canvas.rectangle(a.0, a.1, b.0 - a.0 + 0.6, b.1 - a.1 + 0.6, shade(level, self.levels.len()), 1.0)?;
            }
        }
        let bounds = (frame.left, frame.top, frame.right(), frame.bottom());
        let mut labels: Vec<(PixelPoint, String)> = Vec::new();
        let mut taken = Vec::new();
        for level in &self.levels {
            for line in grid.contour(*level) {
                let places: Vec<PixelPoint> = line.points.iter().map(|p| frame.at(p.0, p.1)).collect();
                canvas.line(&places, Stroke::solid(INK, 0.9))?;
                let text = number(*level);
                let room = (fonts::width(&text, LABEL, FontWeight::Regular) + 6.0, LABEL * 1.15);
                if let Some(at) = label_place(&places, room, bounds, &taken) {
                    taken.push(around(at, room));
                    labels.push((at, text));
                }
            }
        }
        for (at, text) in &labels {
            canvas.plate(*at, &CanvasText::new(text).size(LABEL))?;
        }
        for (i, (_, [x, y])) in self.marks.iter().enumerate() {
            let (marker, colour) = MARKS[i % MARKS.len()];
            if frame.x.range.with(*x) == frame.x.range && frame.y.range.with(*y) == frame.y.range {
                canvas.marker(frame.at(*x, *y), marker, 6.0, colour)?;
            }
        }
        frame.paint_axes(canvas)
    }

    fn paint_traces(&self, canvas: &mut Canvas, top: f64, k: usize) -> Result<()> {
        let width = (WIDTH - 3.0 * MARGIN) / 2.0;
        let left = MARGIN + k as f64 * (width + MARGIN);
        let values = |t: &Trace| t.predicted.iter().copied().chain([t.measured]).filter(|v| v.is_finite()).collect::<Vec<_>>();
        // Temperatures that rise without bound, as towards no contact at all, would press the rest flat.
        let highest = self.traces[k].iter().map(|t| t.measured).fold(f64::NEG_INFINITY, f64::max);
        let all = self.traces[k].iter().flat_map(values).filter(|v| *v < highest + 40.0);
        let Some(y) = Range::of(all) else { return Ok(()) };
        let x = Range { low: self.axes[k][0], high: self.axes[k][self.axes[k].len() - 1] };
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        for (i, trace) in self.traces[k].iter().enumerate() {
            legend.add(Swatch::Line(series(i).colour, 2.0, series(i).dash), trace.name.clone());
        }
        legend.paint_running(canvas, (left, top), width)?;
        let below = legend.running_height(width) + 6.0;
        let frame = PlotFrame::inside(
            (left, top + below),
            (width, CURVES - below),
            PlotAxis::linear(self.parameters[k].label(), x),
            PlotAxis::linear("temperature [°C]", y.padded(0.05)),
        );
        frame.paint_grid(canvas)?;
        for (i, trace) in self.traces[k].iter().enumerate() {
            let style = series(i);
            let points = self.axes[k].iter().zip(&trace.predicted).filter(|(_, t)| t.is_finite() && **t <= frame.y.range.high);
            let places: Vec<PixelPoint> = points.map(|(x, t)| frame.at(*x, *t)).collect();
            canvas.line(&places, Stroke { colour: style.colour, width: 2.0, dash: style.dash })?;
            let level = [frame.at(x.low, trace.measured), frame.at(x.high, trace.measured)];
            canvas.line(&level, Stroke { colour: style.colour, width: 1.0, dash: DASHED })?;
        }
        frame.paint_axes(canvas)
    }
}

impl Figure for ValleyFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        if !self.grid()?.z.iter().any(|z| z.is_finite()) {
            return Err(Error::input("nothing of the grid could be computed").at_key(self.title.clone()));
        }
        let page = self.page();
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 8.0 + MAP + CURVES + 16.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend) = (self.page(), self.legend());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let top = page.top() + legend.running_height(page.room()) + 8.0;
        self.paint_map(canvas, &self.frame(top))?;
        for k in 0..2 {
            self.paint_traces(canvas, top + MAP + 16.0, k)?;
        }
        page.paint(canvas, self.size()?.1)
    }
}
