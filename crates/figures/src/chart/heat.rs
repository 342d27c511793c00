//! Heat balance: where the heat comes from and where it goes, as two groups of bars in watts.

use super::Figure;
use super::axis::PlotAxis;
use super::canvas::{Canvas, CanvasText, Stroke};
use super::fonts::{self, FontWeight};
use super::regions::{Hatch, hatch_rectangle};
use super::rows::NamedRows;
use super::style::{AXIS, INK, ORANGE, Quantity, Rgb, SKY, fixed, number, size};
use super::ticks::Range;
use super::title_and_footer::{MARGIN, Page, fixed_conditions};
use coldplate_base::error::{Error, Result};

/// Heat in per source and heat out per sink, W.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatFigure {
    /// Title.
    pub title: String,
    /// Sources with their heat into the machine, W; negative where they take heat out.
    pub sources: Vec<(String, f64)>,
    /// Sinks with their heat out of the machine, W; negative where heat flows in.
    pub sinks: Vec<(String, f64)>,
    /// The condition.
    pub fixed: Vec<(Quantity, f64)>,
    /// More lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 960.0;
/// Least height of a row, CSS pixels. Chosen by eye.
const ROW: f64 = 26.0;
/// Height of a heading, CSS pixels. Chosen by eye.
const HEADING: f64 = 30.0;
/// Most bars shown per group, a count; the smaller ones beyond are added up. Chosen by eye.
const MOST: usize = 14;

/// A bar and, for the numbers, its share of all heat that flows this way.
struct Bar {
    name: String,
    watts: f64,
    share: f64,
}

impl Bar {
    fn label(&self) -> String {
        let share = if self.share.is_finite() { format!(" ({} %)", fixed(100.0 * self.share, 1)) } else { String::new() };
        format!("{}{share}", watts(self.watts))
    }
}

/// Bars of what flows one way. A wall warmer than the machine gives heat, so that it stands among the heat in: both groups
/// then have one sum, and all shares are of it.
fn bars<'a>(flows: impl Iterator<Item = (&'a String, f64)>) -> Vec<Bar> {
    let mut known: Vec<(String, f64)> = flows.filter(|(_, w)| *w >= 0.0 && *w < 1e290).map(|(name, w)| (name.clone(), w)).collect();
    known.sort_by(|a, b| b.1.total_cmp(&a.1));
    if known.len() > MOST {
        let rest = known.split_off(MOST - 1);
        known.push((format!("{} others together", rest.len()), rest.iter().map(|r| r.1).sum()));
    }
    let total: f64 = known.iter().map(|b| b.1).sum();
    known.into_iter().map(|(name, watts)| Bar { name, watts, share: watts / total }).collect()
}

/// Watts to three or four figures, as one reads them.
pub fn watts(value: f64) -> String {
    let size = value.abs();
    match size {
        s if s >= 1e5 || (s > 0.0 && s < 1e-3) => format!("{} W", number(format!("{value:.2e}").parse().unwrap_or(value))),
        s if s >= 100.0 => format!("{} W", fixed(value, 0)),
        s if s >= 10.0 => format!("{} W", fixed(value, 1)),
        s if s >= 0.1 || s == 0.0 => format!("{} W", fixed(value, 2)),
        _ => format!("{} W", fixed(value, 4)),
    }
}

impl HeatFigure {
    fn page(&self) -> Page {
        let [into, out] = self.groups().map(|(_, bars, ..)| bars.iter().map(|b| b.watts).sum::<f64>());
        let balance = format!("In {}, out {}, difference {}", watts(into), watts(out), watts(into - out));
        let mut footer = vec![balance, fixed_conditions(&self.fixed)];
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }

    fn groups(&self) -> [(&'static str, Vec<Bar>, Rgb, Hatch); 2] {
        let flows = |own: &[(String, f64)], other: &[(String, f64)]| {
            bars(own.iter().map(|(name, w)| (name, *w)).chain(other.iter().filter(|(_, w)| *w < 0.0).map(|(name, w)| (name, -w))))
        };
        [
            ("Heat in", flows(&self.sources, &self.sinks), ORANGE, Hatch::Plain),
            ("Heat out", flows(&self.sinks, &self.sources), SKY, Hatch::Falling),
        ]
    }

    fn axis(&self) -> Result<PlotAxis> {
        let all: Vec<f64> = self.groups().iter().flat_map(|g| g.1.iter().map(|b| b.watts)).collect();
        if all.is_empty() {
            return Err(Error::input("there is no heat flow to draw").at_key(self.title.clone()));
        }
        let Some(range) = Range::of(all.into_iter().chain([0.0])) else {
            return Err(Error::input("no heat flow is a finite number").at_key(self.title.clone()));
        };
        // The numbers stand beyond the ends of the bars, and need room there.
        let room = WIDTH - 2.0 * MARGIN - self.rows().names_width - 26.0;
        let labels = self.groups().into_iter().flat_map(|g| g.1).map(|b| fonts::width(&b.label(), size::TICK, FontWeight::Regular));
        let behind = ((labels.fold(0.0, f64::max) + 14.0) / room).min(0.4);
        Ok(PlotAxis::linear("heat flow [W]", Range { low: 0.0, high: range.high / (1.0 - behind) }))
    }

    fn rows(&self) -> NamedRows {
        let groups = self.groups();
        let names: Vec<&str> = groups.iter().flat_map(|g| g.1.iter().map(|b| b.name.as_str())).collect();
        NamedRows::new(names, 270.0, ROW)
    }

    fn bars_height(&self) -> f64 {
        self.groups().iter().filter(|g| !g.1.is_empty()).count() as f64 * HEADING + self.rows().height()
    }
}

impl Figure for HeatFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.axis()?;
        let page = self.page();
        Ok((WIDTH, page.top() + self.bars_height() + 54.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let page = self.page();
        let names_width = self.rows().names_width;
        let mut top = page.top();
        let groups = self.groups();
        let last = groups.iter().rposition(|g| !g.1.is_empty());
        for (index, (heading, bars, colour, pattern)) in groups.iter().enumerate() {
            if bars.is_empty() {
                continue;
            }
            let mut rows = NamedRows::new(bars.iter().map(|b| b.name.as_str()), 270.0, ROW);
            // Both groups share the columns of names and the height of rows.
            (rows.names_width, rows.row) = (names_width, self.rows().row);
            let frame = rows.frame(MARGIN, top + HEADING - 4.0, WIDTH - MARGIN, self.axis()?);
            canvas.text((MARGIN, top + 17.0), &CanvasText::new(heading).bold())?;
            rows.paint(canvas, &frame)?;
            let zero = frame.at(0.0, 0.0).0;
            for (k, bar) in bars.iter().enumerate() {
                let (end, y) = (frame.at(bar.watts, 0.0).0, rows.middle(&frame, k));
                let (width, height) = (end - zero, 0.6 * rows.row.min(34.0));
                canvas.rectangle(zero, y - height / 2.0, width, height, *colour, 1.0)?;
                hatch_rectangle(canvas, (zero, y - height / 2.0), (width, height), *pattern, *colour)?;
                canvas.text((end + 6.0, y + 0.36 * size::TICK), &CanvasText::new(&bar.label()).size(size::TICK))?;
            }
            if Some(index) == last {
                frame.paint_across(canvas, false)?;
            } else {
                canvas.frame(frame.left, frame.top, frame.width, frame.height, Stroke::solid(AXIS, 1.2))?;
            }
            canvas.line(&[(zero, frame.top), (zero, frame.bottom())], Stroke::solid(INK, 1.4))?;
            top += HEADING + rows.height();
        }
        page.paint(canvas, self.size()?.1)
    }
}
