//! A picture of the machine: its parts in parallel projection, coloured by temperature, with channels and sensors.

use std::collections::BTreeMap;

use super::Figure;
use super::canvas::{Canvas, CanvasText, PixelPoint, Stroke};
use super::depth::{Around, order};
use super::fonts::{self, FontWeight};
use super::style::{AXIS, BLUE, INK, MUTED, Marker, Quantity, Rgb, VERMILLION, WHITE, fixed, sequential, size, unit_symbol};
use super::ticks::{Range, linear};
use super::title_and_footer::{MARGIN, Page, fixed_conditions};
use coldplate_base::error::{Error, Result};

/// A flat piece of a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfacePiece {
    /// Index of the body it belongs to; bodies are painted as wholes.
    pub body: usize,
    /// Corners one after the other, m.
    pub corners: Vec<[f64; 3]>,
    /// For each side, from its corner to the next, whether an edge is drawn there.
    pub edges: Vec<bool>,
    /// Direction outward.
    pub outward: [f64; 3],
    /// Temperature of the piece.
    pub temperature: f64,
}

/// A sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Name.
    pub name: String,
    /// Place of the sensor, m.
    pub at: [f64; 3],
    /// Reading; `None` for a place where a sensor could sit, which has another marker.
    pub reading: Option<f64>,
}

impl Probe {
    fn marker(&self) -> (Marker, Rgb) {
        if self.reading.is_some() { (Marker::Disc, INK) } else { (Marker::Diamond, VERMILLION) }
    }
}

/// A coolant channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Pipe {
    /// Name.
    pub name: String,
    /// Axis of the channel from inlet to outlet, m.
    pub path: Vec<[f64; 3]>,
    /// Bodies of the part it runs in, as [`SurfacePiece::body`] numbers them: it shows through these and no others.
    pub bodies: Vec<usize>,
}

/// Direction from which the machine is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum View {
    /// From the front, right and above.
    #[default]
    Corner,
    /// Along +y: x to the right, z up.
    Front,
    /// Along -x: y to the right, z up.
    Side,
    /// Along -z: x to the right, y up.
    Top,
}

impl View {
    /// Names as a definition gives them, in the order of [`View::ALL`].
    pub const NAMES: [&'static str; 4] = ["corner", "front", "side", "top"];
    /// All views.
    pub const ALL: [Self; 4] = [Self::Corner, Self::Front, Self::Side, Self::Top];

    /// Unit vectors to the right, upward, and towards the eye.
    fn axes(self) -> [[f64; 3]; 3] {
        match self {
            Self::Corner => {
                let ((sin_a, cos_a), (sin_e, cos_e)) = ((-55f64).to_radians().sin_cos(), 30f64.to_radians().sin_cos());
                [[-sin_a, cos_a, 0.0], [-sin_e * cos_a, -sin_e * sin_a, cos_e], [cos_e * cos_a, cos_e * sin_a, sin_e]]
            }
            Self::Front => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
            Self::Side => [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
            Self::Top => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        }
    }
}

/// The machine at one condition.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MachineFigure {
    /// Title.
    pub title: String,
    /// Direction from which it is seen.
    pub view: View,
    /// Quantity shown as colour: name and unit.
    pub quantity: Quantity,
    /// Surfaces.
    pub pieces: Vec<SurfacePiece>,
    /// Channels; each shows through its own part, and is hidden by others.
    pub pipes: Vec<Pipe>,
    /// Sensors; they are drawn even where a part hides them.
    pub probes: Vec<Probe>,
    /// Name of places without a reading, for the legend.
    pub place_name: String,
    /// The condition.
    pub fixed: Vec<(Quantity, f64)>,
    /// More lines for the footer.
    pub notes: Vec<String>,
}

/// Width of the figure, CSS pixels. Chosen by eye.
const WIDTH: f64 = 1060.0;
/// Room for names at each side of the picture, CSS pixels. Chosen by eye.
const NAMES: f64 = 170.0;
/// Largest height of the picture, CSS pixels. Chosen by eye.
const TALLEST: f64 = 640.0;
/// Height of a name with its reading, CSS pixels: two lines of text.
const LABEL: f64 = 34.0;
/// Height of the scale of colours with its key, CSS pixels. Chosen by eye.
const BAR: f64 = 58.0;
/// Colour of channels: Okabe-Ito sky blue. Chosen: it shows on any ground.
const PIPE: Rgb = Rgb(86, 180, 233);

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// From coordinates of the machine to places on the page.
struct Projection {
    axes: [[f64; 3]; 3],
    scale: f64,
    left: f64,
    top: f64,
    low: f64,
    high: f64,
    height: f64,
}

impl Projection {
    fn at(&self, point: [f64; 3]) -> PixelPoint {
        (self.left + self.scale * (dot(point, self.axes[0]) - self.low), self.top + self.scale * (self.high - dot(point, self.axes[1])))
    }
}

impl MachineFigure {
    fn page(&self) -> Page {
        let mut footer = vec![fixed_conditions(&self.fixed)];
        footer.extend(self.notes.iter().cloned());
        Page::new(WIDTH, &self.title, "", &footer)
    }

    fn range(&self) -> Result<Range> {
        let shown = self.pieces.iter().map(|p| p.temperature).filter(|t| t.is_finite());
        Range::of(shown).ok_or_else(|| Error::input("no part of the machine has a temperature to draw").at_key(self.title.clone()))
    }

    fn projection(&self, top: f64) -> Result<Projection> {
        let axes = self.view.axes();
        let points = || self.pieces.iter().flat_map(|p| p.corners.iter()).filter(|c| c.iter().all(|x| x.is_finite()));
        let along = |axis: [f64; 3]| Range::of(points().map(|c| dot(*c, axis)));
        let (Some(x), Some(y)) = (along(axes[0]), along(axes[1])) else {
            return Err(Error::input("there is no part to draw").at_key(self.title.clone()));
        };
        let room = WIDTH - 2.0 * (MARGIN + NAMES);
        let scale = (room / x.length()).min(TALLEST / y.length());
        // Names on both sides may ask for more height than the machine itself.
        let labels = LABEL * (self.probes.len().div_ceil(2) as f64 + 1.0);
        let height = (scale * y.length()).max(labels);
        Ok(Projection {
            axes,
            scale,
            left: MARGIN + NAMES + 0.5 * (room - scale * x.length()),
            top: top + 0.5 * (height - scale * y.length()),
            low: x.low,
            high: y.high,
            height,
        })
    }

    /// Paints the visible pieces with the channels in them, the farthest first, so that nearer ones hide them.
    fn paint_pieces(&self, canvas: &mut Canvas, projection: &Projection, range: Range) -> Result<()> {
        let eye = projection.axes[2];
        let depth = |p: &SurfacePiece| p.corners.iter().map(|c| dot(*c, eye)).sum::<f64>() / p.corners.len().max(1) as f64;
        let mut bodies: BTreeMap<usize, Vec<&SurfacePiece>> = BTreeMap::new();
        for piece in self.pieces.iter().filter(|p| p.temperature.is_finite()) {
            bodies.entry(piece.body).or_default().push(piece);
        }
        let around = |pieces: &Vec<&SurfacePiece>| Around::of(pieces.iter().flat_map(|p| p.corners.iter().copied()));
        let (boxes, bodies): (Vec<Around>, Vec<(usize, Vec<&SurfacePiece>)>) =
            bodies.into_iter().filter_map(|(body, pieces)| Some((around(&pieces)?, (body, pieces)))).unzip();
        let order: Vec<&(usize, Vec<&SurfacePiece>)> = order(&boxes, eye).into_iter().map(|at| &bodies[at]).collect();
        for (at, (body, pieces)) in order.iter().enumerate() {
            let mut seen: Vec<(f64, &SurfacePiece)> =
                pieces.iter().filter(|p| dot(p.outward, eye) > 1e-12).map(|p| (depth(p), *p)).collect();
            seen.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (_, piece) in seen {
                Self::paint_piece(canvas, projection, range, piece)?;
            }
            // After the last body of its part, so that bodies in front of the part hide the channel.
            let is_last =
                |pipe: &&Pipe| pipe.bodies.contains(body) && !order[at + 1..].iter().any(|(later, _)| pipe.bodies.contains(later));
            for pipe in self.pipes.iter().filter(is_last) {
                paint_pipe(canvas, projection, pipe)?;
            }
        }
        Ok(())
    }

    fn paint_piece(canvas: &mut Canvas, projection: &Projection, range: Range, piece: &SurfacePiece) -> Result<()> {
        let colour = sequential((piece.temperature - range.low) / range.length());
        let places: Vec<PixelPoint> = piece.corners.iter().map(|c| projection.at(*c)).collect();
        canvas.tile(&widened(&places), colour)?;
        let ink = if colour.luminance() < 0.16 { Rgb(190, 190, 190) } else { Rgb(50, 50, 50) };
        for i in (0..places.len()).filter(|i| piece.edges.get(*i).copied().unwrap_or(false)) {
            canvas.line(&[places[i], places[(i + 1) % places.len()]], Stroke::solid(ink, 0.8))?;
        }
        Ok(())
    }

    /// Paints sensors and their names, which stand left and right of the picture, level with their sensors as far as
    /// they keep apart.
    fn paint_probes(&self, canvas: &mut Canvas, projection: &Projection, top: f64) -> Result<()> {
        let mut probes: Vec<(&Probe, PixelPoint)> = self.probes.iter().map(|p| (p, projection.at(p.at))).collect();
        probes.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
        // Names go to the nearer side, as far as there is room.
        let middle = WIDTH / 2.0;
        let most = ((projection.height / LABEL) as usize).max(probes.len().div_ceil(2));
        let nearer = probes.partition_point(|p| p.1.0 < middle).clamp(probes.len().saturating_sub(most), most).min(probes.len());
        let (left, right) = probes.split_at_mut(nearer);
        for (column, is_left) in [(left, true), (right, false)] {
            column.sort_by(|a, b| a.1.1.total_cmp(&b.1.1));
            for ((probe, at), y) in column.iter().zip(apart(column.iter().map(|c| c.1.1), top, projection.height)) {
                let edge = if is_left { MARGIN + NAMES - 12.0 } else { WIDTH - MARGIN - NAMES + 12.0 };
                let stub = if is_left { edge + 8.0 } else { edge - 8.0 };
                canvas.line(&[(edge, y), (stub, y), *at], Stroke::solid(WHITE, 2.4))?;
                canvas.line(&[(edge, y), (stub, y), *at], Stroke::solid(INK, 0.9))?;
                let (marker, colour) = probe.marker();
                canvas.marker(*at, marker, 5.4, WHITE)?;
                canvas.marker(*at, marker, 4.0, colour)?;
                let name = fonts::fit(&probe.name, size::TICK, FontWeight::Regular, NAMES - 20.0);
                let reading = probe.reading.map_or(String::new(), |r| format!("{} {}", fixed(r, 2), unit_symbol(&self.quantity.unit)));
                for (line, dy, bold) in [(&name, -3.0, false), (&reading, 12.5, true)] {
                    let text = CanvasText::new(line).size(size::TICK);
                    let text = if bold { text.bold() } else { text };
                    let (x, text) = if is_left { (edge - 4.0, text.end()) } else { (edge + 4.0, text) };
                    canvas.text((x, y + dy), &text)?;
                }
            }
        }
        Ok(())
    }

    /// Paints the scale of colours and the key to the signs.
    fn paint_bar(&self, canvas: &mut Canvas, top: f64, range: Range) -> Result<()> {
        /// Number of colours in the scale. Chosen: enough to look smooth.
        const STEPS: usize = 80;
        let (left, length) = (MARGIN + NAMES, 420.0);
        for k in 0..STEPS {
            let t = (k as f64 + 0.5) / STEPS as f64;
            let step = length / STEPS as f64;
            let (x0, x1) = (left + step * k as f64, left + step * (k + 1) as f64);
            canvas.tile(&[(x0, top), (x1, top), (x1, top + 16.0), (x0, top + 16.0)], sequential(t))?;
        }
        canvas.frame(left, top, length, 16.0, Stroke::solid(AXIS, 1.0))?;
        let ticks = linear(range, 6);
        for (value, label) in ticks.values.iter().zip(&ticks.labels) {
            let x = left + length * (value - range.low) / range.length();
            canvas.line(&[(x, top + 16.0), (x, top + 21.0)], Stroke::solid(AXIS, 1.0))?;
            canvas.text((x, top + 35.0), &CanvasText::new(label).size(size::TICK).middle())?;
        }
        let remark = ticks.remark.map(|r| format!(" ({r})")).unwrap_or_default();
        let title = fonts::fit(&format!("{}{remark}", self.quantity.label()), size::BODY, FontWeight::Regular, NAMES - 16.0);
        canvas.text((left - 12.0, top + 13.0), &CanvasText::new(&title).end())?;
        let mut x = left + length + 40.0;
        let mut sign = |canvas: &mut Canvas, marker: Marker, colour: Rgb, words: &str| -> Result<()> {
            canvas.marker((x, top + 8.0), marker, 4.0, colour)?;
            let text = CanvasText::new(words).size(size::FOOTER).colour(MUTED);
            canvas.text((x + 10.0, top + 12.5), &text)?;
            x += 30.0 + text.width();
            Ok(())
        };
        for is_sensor in [true, false] {
            if let Some(probe) = self.probes.iter().find(|p| p.reading.is_some() == is_sensor) {
                let usual = if is_sensor || self.place_name.is_empty() { "sensor" } else { &self.place_name };
                let (marker, colour) = probe.marker();
                sign(canvas, marker, colour, usual)?;
            }
        }
        if !self.pipes.is_empty() {
            sign(canvas, Marker::Disc, BLUE, "water in")?;
            sign(canvas, Marker::Disc, PIPE, "water out")?;
        }
        Ok(())
    }
}

fn paint_pipe(canvas: &mut Canvas, projection: &Projection, pipe: &Pipe) -> Result<()> {
    let places: Vec<PixelPoint> = pipe.path.iter().map(|p| projection.at(*p)).collect();
    // A channel that is small on the page would otherwise fill its plate.
    let extent = |of: fn(&PixelPoint) -> f64| Range::of(places.iter().map(of)).map_or(0.0, |r| r.length());
    let size = (extent(|p| p.0).hypot(extent(|p| p.1)) / 160.0).clamp(0.35, 1.0);
    canvas.line(&places, Stroke::solid(WHITE, 3.6 * size))?;
    canvas.line(&places, Stroke::solid(PIPE, 2.0 * size))?;
    if let [first, .., last] = places.as_slice() {
        for (place, colour) in [(first, BLUE), (last, PIPE)] {
            canvas.disc(*place, 5.0 * size, WHITE)?;
            canvas.disc(*place, 3.6 * size, colour)?;
        }
    }
    Ok(())
}

/// The piece a little larger, so that no seam shows between it and its neighbours.
fn widened(places: &[PixelPoint]) -> Vec<PixelPoint> {
    let count = places.len().max(1) as f64;
    let middle = places.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
    let away = |p: &PixelPoint| {
        let (dx, dy) = (p.0 - middle.0, p.1 - middle.1);
        let more = 0.45 / dx.hypot(dy).max(0.45);
        (p.0 + more * dx, p.1 + more * dy)
    };
    places.iter().map(away).collect()
}

/// Rising places, moved as little as it takes to keep a label's height between them, inside the plot where they fit.
fn apart(wanted: impl Iterator<Item = f64>, top: f64, height: f64) -> Vec<f64> {
    let mut places: Vec<f64> = wanted.collect();
    let mut least = top + 0.5 * LABEL;
    for y in &mut places {
        *y = y.max(least);
        least = *y + LABEL;
    }
    let mut most = top + height - 0.5 * LABEL;
    for y in places.iter_mut().rev() {
        *y = y.min(most);
        most = *y - LABEL;
    }
    places
}

impl Figure for MachineFigure {
    fn title(&self) -> &str {
        &self.title
    }

    fn size(&self) -> Result<(f64, f64)> {
        self.range()?;
        let page = self.page();
        Ok((WIDTH, page.top() + self.projection(page.top())?.height + 22.0 + BAR + page.bottom()))
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        let (page, range) = (self.page(), self.range()?);
        let projection = self.projection(page.top())?;
        self.paint_pieces(canvas, &projection, range)?;
        self.paint_probes(canvas, &projection, page.top())?;
        self.paint_bar(canvas, page.top() + projection.height + 22.0, range)?;
        page.paint(canvas, self.size()?.1)
    }
}
