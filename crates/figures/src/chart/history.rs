//! How readings follow the time: one curve per sensor, in seconds, minutes, hours or days as suits.

use super::Figure;
use super::axis::{PlotAxis, PlotFrame};
use super::canvas::{Canvas, Stroke};
use super::legend::{Legend, Swatch};
use super::style::{DASHED, MUTED, Quantity, Rgb, SOLID, readable, series, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page};
use coldplate_base::error::{Error, Result};

/// One sensor or one condition.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HistoryLine {
    /// Name.
    pub name: String,
    /// One value per time; not finite where there is none.
    pub values: Vec<f64>,
}

/// Readings over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HistoryFigure {
    /// Title.
    pub title: String,
    /// Times, s, rising; equal ones are a step.
    pub times: Vec<f64>,
    /// Quantity that is read.
    pub quantity: Quantity,
    /// The sensors, in the order of the legend. If there are more than ten, the ten that move most are drawn in
    /// colour.
    pub courses: Vec<HistoryLine>,
    /// A moment worth marking, s, with its label.
    pub mark: Option<(f64, String)>,
    /// Lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 960.0;
/// Height of the plot, CSS pixels. Chosen by eye.
const PLOT: f64 = 470.0;
/// Most curves with a colour of their own, a count. Chosen: more colours cannot be told apart.
const MOST: usize = 10;
/// Colour of the other curves. Chosen by eye: lighter than any other line.
const OTHERS: Rgb = Rgb(190, 190, 190);

/// The unit that suits a span of time (s), and its seconds.
pub(crate) fn time_unit(span: f64) -> (&'static str, f64) {
    match span {
        s if s <= 300.0 => ("s", 1.0),
        s if s <= 3.0 * 3600.0 => ("min", 60.0),
        s if s <= 96.0 * 3600.0 => ("h", 3600.0),
        _ => ("d", 86400.0),
    }
}

impl HistoryFigure {
    /// Whether each course is drawn in colour: the ten that move most, the first of equals.
    fn coloured(&self) -> Vec<bool> {
        let length = |c: &HistoryLine| Range::of(c.values.iter().copied()).map_or(0.0, Range::length);
        let mut order: Vec<usize> = (0..self.courses.len()).collect();
        order.sort_by(|a, b| length(&self.courses[*b]).total_cmp(&length(&self.courses[*a])));
        let mut coloured = vec![false; self.courses.len()];
        order.into_iter().take(MOST).for_each(|i| coloured[i] = true);
        coloured
    }

    fn page(&self) -> Page {
        Page::new(WIDTH, &self.title, "", &self.notes)
    }

    fn unit(&self) -> (&'static str, f64) {
        time_unit(Range::of(self.times.iter().copied()).map_or(0.0, Range::length))
    }

    fn frame(&self, top: f64) -> Result<PlotFrame> {
        let (unit, seconds) = self.unit();
        let x = Range::of(self.times.iter().map(|t| t / seconds));
        let y = Range::of(self.courses.iter().flat_map(|c| c.values.iter().copied()));
        match (x, y) {
            (Some(x), Some(y)) => {
                let (x, y) = (PlotAxis::linear(format!("time [{unit}]"), x), PlotAxis::linear(self.quantity.label(), y.padded(0.05)));
                Ok(PlotFrame::inside((MARGIN, top), (WIDTH - 2.0 * MARGIN, PLOT), x, y))
            }
            _ => Err(Error::input("no sensor has a reading to draw over time").at_key(self.title.clone())),
        }
    }

    fn legend(&self) -> Legend {
        let mut legend = Legend { text: size::TICK, ..Legend::default() };
        let coloured = self.coloured();
        for (i, (course, _)) in self.courses.iter().zip(&coloured).filter(|(_, coloured)| **coloured).enumerate() {
            let style = series(i);
            legend.add(Swatch::Line(style.colour, 2.2, style.dash), readable(&course.name));
        }
        match self.courses.len().saturating_sub(MOST) {
            0 => {}
            1 => legend.add(Swatch::Line(OTHERS, 1.5, SOLID), "another sensor, which moves less"),
            more => legend.add(Swatch::Line(OTHERS, 1.5, SOLID), format!("{more} more sensors, which move less")),
        }
        if let Some((_, what)) = &self.mark {
            legend.add(Swatch::Line(MUTED, 1.5, DASHED), what.clone());
        }
        legend
    }

    fn paint_course(&self, canvas: &mut Canvas, frame: &PlotFrame, course: &HistoryLine, stroke: Stroke) -> Result<()> {
        let seconds = self.unit().1;
        let points: Vec<(f64, f64)> = self.times.iter().zip(&course.values).map(|(t, v)| (t / seconds, *v)).collect();
        for part in points.split(|p| !(p.0.is_finite() && p.1.is_finite())) {
            let places: Vec<_> = thinned(part, (WIDTH * 2.0) as usize).into_iter().map(|(x, y)| frame.at(x, y)).collect();
            canvas.line(&places, stroke)?;
        }
        Ok(())
    }
}

/// The points of a curve that can be told apart on `columns` columns: the first, the lowest, the highest and the last
/// point of each column.
fn thinned(points: &[(f64, f64)], columns: usize) -> Vec<(f64, f64)> {
    if points.len() <= 4 * columns {
        return points.to_vec();
    }
    let (first, last) = (points[0].0, points[points.len() - 1].0);
    let column = |p: &(f64, f64)| ((p.0 - first) / (last - first) * columns as f64) as usize;
    let mut kept = Vec::with_capacity(4 * columns);
    for group in points.chunk_by(|a, b| column(a) == column(b)) {
        let extreme = |sign: f64| group.iter().enumerate().min_by(|a, b| (sign * a.1.1).total_cmp(&(sign * b.1.1))).map_or(0, |(i, _)| i);
        let mut chosen = [0, extreme(1.0), extreme(-1.0), group.len() - 1];
        chosen.sort_unstable();
        kept.extend(chosen.into_iter().map(|i| group[i]));
    }
    kept
}

impl Figure for HistoryFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        if let Some(course) = self.courses.iter().find(|c| c.values.len() != self.times.len()) {
            let what = format!("'{}' has {} readings at {} times", course.name, course.values.len(), self.times.len());
            return Err(Error::input(what).at_key(self.title.clone()));
        }
        let page = self.page();
        self.frame(page.top())?;
        Ok((WIDTH, page.top() + self.legend().running_height(page.room()) + 8.0 + PLOT + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, legend) = (self.page(), self.legend());
        legend.paint_running(canvas, (MARGIN, page.top()), page.room())?;
        let frame = self.frame(page.top() + legend.running_height(page.room()) + 8.0)?;
        frame.paint_grid(canvas)?;
        let coloured = self.coloured();
        for (course, _) in self.courses.iter().zip(&coloured).filter(|(_, coloured)| !**coloured) {
            self.paint_course(canvas, &frame, course, Stroke::solid(OTHERS, 1.2))?;
        }
        for (i, (course, _)) in self.courses.iter().zip(&coloured).filter(|(_, coloured)| **coloured).enumerate() {
            let style = series(i);
            self.paint_course(canvas, &frame, course, Stroke { colour: style.colour, width: 2.0, dash: style.dash })?;
        }
        if let Some((time, _)) = &self.mark {
            let x = frame.at(time / self.unit().1, frame.y.range.low).0;
            if (frame.left..=frame.right()).contains(&x) {
                canvas.line(&[(x, frame.top), (x, frame.bottom())], Stroke { colour: MUTED, width: 1.5, dash: DASHED })?;
            }
        }
        frame.paint_axes(canvas)?;
        page.paint(canvas, self.size()?.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_ends_and_the_peaks() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), (f64::from(i) / 5000.0).sin())).collect();
        points[54_321].1 = 9.0;
        points[12_345].1 = -9.0;
        let kept = thinned(&points, 100);
        assert!(kept.len() <= 4 * 101);
        assert!(kept.windows(2).all(|w| w[0].0 <= w[1].0));
        for p in [points[0], points[12_345], points[54_321], points[99_999]] {
            assert!(kept.contains(&p), "{p:?}");
        }
    }
}
