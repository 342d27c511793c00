//! Paths of heat as bands as wide as the heat they carry: from sources through parts to sinks.

use super::Figure;
use super::canvas::{Canvas, CanvasText, PixelPoint, Stroke};
use super::fonts::{self, FontWeight};
use super::heat::watts;
use super::style::{INK, ORANGE, Quantity, Rgb, SKY, VERMILLION, fixed};
use super::title_and_footer::{MARGIN, Page, fixed_conditions};
use coldplate_base::error::{Error, Result};

/// Kind of a station on the way of the heat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Heat is made here.
    Source,
    /// Heat passes through.
    Part,
    /// Heat leaves here.
    Sink,
}

/// A station on the way of the heat.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatStation {
    /// Name.
    pub name: String,
    /// Kind of the station.
    pub stage: Stage,
}

/// Heat from one station to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatBand {
    /// Index of the station it leaves.
    pub from: usize,
    /// Index of the station it enters.
    pub to: usize,
    /// Heat, W; positive.
    pub watts: f64,
}

/// All heat, W.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeatTotal {
    /// Heat from sources.
    pub made: f64,
    /// Heat that enters from warmer surroundings: water, walls, boundaries.
    pub entering: f64,
    /// Heat that leaves.
    pub leaving: f64,
}

/// Heat flow as bands.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SankeyFigure {
    /// Title.
    pub title: String,
    /// The stations.
    pub stations: Vec<HeatStation>,
    /// The bands between them.
    pub bands: Vec<HeatBand>,
    /// All heat, including bands too thin to be drawn.
    pub total: HeatTotal,
    /// The condition.
    pub fixed: Vec<(Quantity, f64)>,
    /// More lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1100.0;
/// Height of all heat together, CSS pixels. Chosen by eye, like the other sizes here.
const HEAT: f64 = 300.0;
/// Width of a station, CSS pixels.
const POST: f64 = 14.0;
/// Least distance of two stations in a column, CSS pixels: two lines of text.
const GAP: f64 = 36.0;
/// Room for names beside the last column, CSS pixels.
const NAMES: f64 = 190.0;
/// Number of straight pieces of a band's edge. Chosen: enough to look smooth.
const PIECES: usize = 28;

/// Layout of the figure.
struct Layout {
    /// Column of each station.
    column: Vec<usize>,
    columns: usize,
    /// Top edge of each station, from the top of the plot, CSS pixels.
    top: Vec<f64>,
    /// Pixels per watt.
    scale: f64,
    height: f64,
}

impl SankeyFigure {
    fn page(&self) -> Page {
        let HeatTotal { made, entering, leaving } = self.total;
        // The heat of sources alone does not show where the rest comes from, for example if the chamber is warmer than the
        // water. The three numbers have the decimals of the largest, and what enters is the difference of the other two as
        // they are shown, so that they add up for a reader.
        let decimals = (3.0 - (made + entering).log10().floor()).clamp(0.0, 6.0) as usize;
        let shown = |watts: f64| fixed(watts, decimals).parse::<f64>().unwrap_or(watts);
        let rest = shown(leaving) - shown(made);
        let besides = if shown(rest) > 0.0 { format!(", entering besides {} W", fixed(rest, decimals)) } else { String::new() };
        let all = format!("Made {} W{besides}, leaving {} W.", fixed(made, decimals), fixed(leaving, decimals));
        let mut footer = vec![format!("{all} Bands are as wide as the heat they carry.")];
        footer.push(fixed_conditions(&self.fixed));
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }

    /// Heat through a station: the larger of entering and leaving heat.
    fn through(&self, station: usize) -> f64 {
        let sum = |of: fn(&HeatBand) -> usize| self.bands.iter().filter(|b| of(b) == station).map(|b| b.watts).sum::<f64>();
        sum(|b| b.from).max(sum(|b| b.to))
    }

    fn check(&self) -> Result<()> {
        let place = |e: Error| e.at_key(self.title.clone());
        let known = |b: &HeatBand| b.from < self.stations.len() && b.to < self.stations.len() && b.from != b.to;
        if let Some(band) = self.bands.iter().find(|b| !(b.watts.is_finite() && b.watts > 0.0 && known(b))) {
            return Err(place(Error::input("a band needs two stations and a positive heat").read(band.watts)));
        }
        if self.bands.is_empty() { Err(place(Error::input("there is no heat flow to draw"))) } else { Ok(()) }
    }

    /// Sources stand in the first column, sinks in the last, parts as many columns on as heat passes parts before them.
    fn columns(&self) -> (Vec<usize>, usize) {
        let mut column: Vec<usize> = self.stations.iter().map(|s| usize::from(s.stage != Stage::Source)).collect();
        // A circle of heat (which a coarse picture of parts can have) must not push its stations on for ever.
        for _ in 0..self.stations.len().min(6) {
            let before = column.clone();
            for band in self.bands.iter().filter(|b| self.stations[b.to].stage == Stage::Part) {
                column[band.to] = column[band.to].max(before[band.from] + 1);
            }
        }
        let last = 1 + (self.stations.iter().zip(&column)).filter(|(s, _)| s.stage != Stage::Sink).map(|(_, c)| *c).max().unwrap_or(0);
        for (station, column) in self.stations.iter().zip(&mut column) {
            if station.stage == Stage::Sink {
                *column = last;
            }
        }
        // Columns that a circle left empty are closed up.
        let used: Vec<usize> = (0..=last).filter(|c| column.contains(c)).collect();
        let place = |c: &usize| used.iter().position(|u| u == c).unwrap_or(0);
        (column.iter().map(place).collect(), used.len())
    }

    fn layout(&self) -> Layout {
        let (column, columns) = self.columns();
        let total: f64 = (0..columns)
            .map(|c| (0..self.stations.len()).filter(|s| column[*s] == c).map(|s| self.through(s)).sum::<f64>())
            .fold(0.0, f64::max);
        let scale = HEAT / total.max(1e-300);
        let mut order: Vec<Vec<usize>> = (0..columns).map(|c| (0..self.stations.len()).filter(|s| column[*s] == c).collect()).collect();
        let stack = |order: &[Vec<usize>]| {
            let heights: Vec<f64> = order
                .iter()
                .map(|stations| {
                    let heat: f64 = stations.iter().map(|s| scale * self.through(*s)).sum();
                    heat + GAP * stations.len() as f64
                })
                .collect();
            let height = heights.iter().copied().fold(0.0, f64::max);
            let mut top = vec![0.0; self.stations.len()];
            for (stations, own) in order.iter().zip(&heights) {
                let spare = (height - own) / (stations.len() + 1) as f64;
                let mut y = spare + GAP / 2.0;
                for s in stations {
                    top[*s] = y;
                    y += scale * self.through(*s) + GAP + spare;
                }
            }
            (top, height)
        };
        let (mut top, mut height) = stack(&order);
        // Each column is sorted by where its bands come from and go to; a few rounds untangle it.
        for round in 0..12 {
            for stations in &mut order {
                let level = |s: usize| {
                    let ends = self.bands.iter().filter_map(|b| match (b.from == s, b.to == s) {
                        (true, _) if round % 2 == 1 => Some((b.to, b.watts)),
                        (_, true) if round % 2 == 0 => Some((b.from, b.watts)),
                        _ => None,
                    });
                    let (sum, weight) = ends.fold((0.0, 0.0), |(sum, weight), (other, w)| {
                        (sum + w * (top[other] + 0.5 * scale * self.through(other)), weight + w)
                    });
                    if weight > 0.0 { sum / weight } else { top[s] + 0.5 * scale * self.through(s) }
                };
                stations.sort_by(|a, b| level(*a).total_cmp(&level(*b)));
            }
            (top, height) = stack(&order);
        }
        Layout { column, columns, top, scale, height }
    }

    fn left(&self, layout: &Layout, station: usize) -> f64 {
        let room = WIDTH - 2.0 * MARGIN - NAMES - POST;
        MARGIN + room * layout.column[station] as f64 / (layout.columns.max(2) - 1) as f64
    }

    fn paint_bands(&self, canvas: &mut Canvas, layout: &Layout, plot: f64) -> Result<()> {
        let middle = |s: usize| layout.top[s] + 0.5 * layout.scale * self.through(s);
        let mut leaving = vec![0.0; self.stations.len()];
        let mut entering = vec![0.0; self.stations.len()];
        // Bands leave and enter a station in the order of their other ends, so that they cross as little as can be.
        let mut starts = vec![0.0; self.bands.len()];
        let mut ends = vec![0.0; self.bands.len()];
        let mut by_end: Vec<usize> = (0..self.bands.len()).collect();
        by_end.sort_by(|a, b| middle(self.bands[*a].to).total_cmp(&middle(self.bands[*b].to)));
        for k in &by_end {
            let band = self.bands[*k];
            starts[*k] = layout.top[band.from] + leaving[band.from];
            leaving[band.from] += layout.scale * band.watts;
        }
        by_end.sort_by(|a, b| middle(self.bands[*a].from).total_cmp(&middle(self.bands[*b].from)));
        for k in &by_end {
            let band = self.bands[*k];
            ends[*k] = layout.top[band.to] + entering[band.to];
            entering[band.to] += layout.scale * band.watts;
        }
        for (k, band) in self.bands.iter().enumerate() {
            let (x0, x1) = (self.left(layout, band.from) + POST, self.left(layout, band.to));
            let width = (layout.scale * band.watts).max(1.0);
            let along = |i: usize, shift: f64| {
                let t = i as f64 / PIECES as f64;
                let smooth = t * t * (3.0 - 2.0 * t);
                (x0 + (x1 - x0) * t, plot + starts[k] + (ends[k] - starts[k]) * smooth + shift)
            };
            let upper = (0..=PIECES).map(|i| along(i, 0.0));
            let lower = (0..=PIECES).rev().map(|i| along(i, width));
            let colour = if self.stations[band.to].stage == Stage::Sink { SKY } else { ORANGE };
            let outline: Vec<PixelPoint> = upper.chain(lower).collect();
            canvas.polygon(&outline, colour, 0.5)?;
        }
        Ok(())
    }
}

/// Colour of a station's post.
fn colour(stage: Stage) -> Rgb {
    match stage {
        Stage::Source => VERMILLION,
        Stage::Part => INK,
        Stage::Sink => Rgb(0, 114, 178),
    }
}

impl Figure for SankeyFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.check()?;
        let page = self.page();
        Ok((WIDTH, page.top() + self.layout().height + 8.0 + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        self.check()?;
        let (page, layout) = (self.page(), self.layout());
        let plot = page.top();
        self.paint_bands(canvas, &layout, plot)?;
        let room = (WIDTH - 2.0 * MARGIN - NAMES - POST) / (layout.columns.max(2) - 1) as f64;
        for (s, station) in self.stations.iter().enumerate() {
            let heat = self.through(s);
            let (x, y, height) = (self.left(&layout, s), plot + layout.top[s], (layout.scale * heat).max(1.5));
            canvas.rectangle(x, y, POST, height, colour(station.stage), 1.0)?;
            canvas.line(&[(x, y), (x + POST, y)], Stroke::solid(INK, 0.6))?;
            let limit = if layout.column[s] + 1 == layout.columns { NAMES - 10.0 } else { room - POST - 8.0 };
            let name = fonts::fit(&station.name, 12.0, FontWeight::Bold, limit);
            let (left, base) = (x + POST + 6.0, y + 0.5 * height);
            canvas.text((left, base - 2.0), &CanvasText::new(&name).size(12.0).bold())?;
            canvas.text((left, base + 13.0), &CanvasText::new(&watts(heat)).size(12.0))?;
        }
        page.paint(canvas, self.size()?.1)
    }
}
