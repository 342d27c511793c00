//! Drawing in CSS pixels on any surface: lines with dashes, markers, areas, texts.

use super::fonts::{self, FontWeight};
use super::style::{Dash, INK, Marker, Rgb, WHITE, size};
use super::surface::{Anchor, DrawingSurface, Lettering, Pixel};
use coldplate_base::error::Result;

/// A point in CSS pixels, y downwards.
pub(crate) type PixelPoint = (f64, f64);
/// Width and height in CSS pixels.
pub(crate) type PixelSize = (f64, f64);

/// Colour, width and dash of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour.
    pub colour: Rgb,
    /// Width in CSS pixels.
    pub width: f64,
    /// Dash.
    pub dash: Dash,
}

impl Stroke {
    /// An unbroken line.
    pub fn solid(colour: Rgb, width: f64) -> Self {
        Self { colour, width, dash: &[] }
    }
}

/// A text and how it is set.
#[derive(Debug, Clone, PartialEq)]
pub struct CanvasText<'a> {
    text: &'a str,
    size: f64,
    weight: FontWeight,
    colour: Rgb,
    anchor: Anchor,
    upwards: bool,
}

impl<'a> CanvasText<'a> {
    /// Regular, body size, ink, anchored at its left end.
    pub fn new(text: &'a str) -> Self {
        Self { text, size: size::BODY, weight: FontWeight::Regular, colour: INK, anchor: Anchor::Start, upwards: false }
    }
    /// Font size in CSS pixels.
    #[must_use]
    pub fn size(mut self, size: f64) -> Self {
        self.size = size;
        self
    }
    /// Bold.
    #[must_use]
    pub fn bold(mut self) -> Self {
        self.weight = FontWeight::Bold;
        self
    }
    /// Colour.
    #[must_use]
    pub fn colour(mut self, colour: Rgb) -> Self {
        self.colour = colour;
        self
    }
    /// Anchored at the middle of its baseline.
    #[must_use]
    pub fn middle(mut self) -> Self {
        self.anchor = Anchor::Middle;
        self
    }
    /// Anchored at the right end of its baseline.
    #[must_use]
    pub fn end(mut self) -> Self {
        self.anchor = Anchor::End;
        self
    }
    /// Reads upwards.
    #[must_use]
    pub fn upwards(mut self) -> Self {
        self.upwards = true;
        self
    }
    /// Width of the text in CSS pixels.
    pub fn width(&self) -> f64 {
        fonts::width(self.text, self.size, self.weight)
    }
}

/// A surface addressed in CSS pixels. Points that are not finite are left out; lines far outside are cut.
pub struct Canvas<'a> {
    surface: &'a mut dyn DrawingSurface,
    scale: f64,
}

/// Largest coordinate, in CSS pixels. Chosen: beyond any figure, and below the overflow of a surface.
const FAR: f64 = 20_000.0;

impl<'a> Canvas<'a> {
    /// Draws on this surface.
    pub fn new(surface: &'a mut dyn DrawingSurface) -> Self {
        let scale = surface.scale();
        Self { surface, scale }
    }

    /// Draws with everything `factor` times as large.
    ///
    /// # Errors
    /// Errors of `paint`.
    pub(crate) fn magnified(&mut self, factor: f64, paint: impl FnOnce(&mut Self) -> Result<()>) -> Result<()> {
        let usual = self.scale;
        self.scale *= factor;
        let painted = paint(self);
        self.scale = usual;
        painted
    }

    fn pixel(&self, place: PixelPoint) -> Pixel {
        let to = |v: f64| (v.clamp(-FAR, FAR) * self.scale).round() as i32;
        (to(place.0), to(place.1))
    }

    fn stroke_width(&self, width: f64) -> u32 {
        (width * self.scale).round().clamp(1.0, 1000.0) as u32
    }

    /// A filled rectangle.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn rectangle(&mut self, x: f64, y: f64, width: f64, height: f64, colour: Rgb, alpha: f64) -> Result<()> {
        self.polygon(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height)], colour, alpha)
    }

    /// The outline of a rectangle.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn frame(&mut self, x: f64, y: f64, width: f64, height: f64, stroke: Stroke) -> Result<()> {
        // Half the stroke beyond the first corner closes the last corner.
        let more = stroke.width / 2.0;
        self.line(&[(x - more, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y)], stroke)
    }

    /// A filled polygon.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn polygon(&mut self, places: &[PixelPoint], colour: Rgb, alpha: f64) -> Result<()> {
        match self.corners(places) {
            Some(pixels) => self.surface.polygon(&pixels, colour, alpha),
            None => Ok(()),
        }
    }

    /// A filled polygon that others of its area adjoin, with no seam between them.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn tile(&mut self, places: &[PixelPoint], colour: Rgb) -> Result<()> {
        match self.corners(places) {
            Some(pixels) => self.surface.tile(&pixels, colour),
            None => Ok(()),
        }
    }

    /// Corners of a polygon; `None` if it has no area or a place is not finite.
    fn corners(&self, places: &[PixelPoint]) -> Option<Vec<Pixel>> {
        if places.iter().any(|p| !(p.0.is_finite() && p.1.is_finite())) {
            return None;
        }
        let mut pixels: Vec<Pixel> = places.iter().map(|p| self.pixel(*p)).collect();
        pixels.dedup();
        (pixels.len() >= 3).then_some(pixels)
    }

    /// An open line, dashed by its stroke; broken where a place is not finite.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn line(&mut self, places: &[PixelPoint], stroke: Stroke) -> Result<()> {
        for part in places.split(|p| !(p.0.is_finite() && p.1.is_finite())) {
            if stroke.dash.is_empty() {
                self.unbroken(part, stroke)?;
                continue;
            }
            for piece in dashes(part, stroke.dash) {
                self.unbroken(&piece, stroke)?;
            }
        }
        Ok(())
    }

    fn unbroken(&mut self, places: &[PixelPoint], stroke: Stroke) -> Result<()> {
        let mut pixels: Vec<Pixel> = places.iter().map(|p| self.pixel(*p)).collect();
        pixels.dedup();
        if pixels.len() < 2 {
            return Ok(());
        }
        let width = self.stroke_width(stroke.width);
        self.surface.line(&pixels, stroke.colour, width)
    }

    /// A filled disc.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn disc(&mut self, (x, y): PixelPoint, radius: f64, colour: Rgb) -> Result<()> {
        if !(x.is_finite() && y.is_finite() && radius > 0.0) {
            return Ok(());
        }
        let centre = self.pixel((x, y));
        let radius = self.stroke_width(radius);
        self.surface.disc(centre, radius, colour)
    }

    /// A marker; `radius` is the radius of a disc of the same weight.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn marker(&mut self, (x, y): PixelPoint, marker: Marker, radius: f64, colour: Rgb) -> Result<()> {
        let r = radius;
        match marker {
            Marker::Disc => self.disc((x, y), r, colour),
            Marker::Ring => {
                self.disc((x, y), r * 1.1, colour)?;
                self.disc((x, y), r * 0.62, WHITE)
            }
            Marker::Triangle => self.polygon(&[(x, y - 1.3 * r), (x + 1.2 * r, y + 0.8 * r), (x - 1.2 * r, y + 0.8 * r)], colour, 1.0),
            Marker::TriangleDown => self.polygon(&[(x, y + 1.3 * r), (x + 1.2 * r, y - 0.8 * r), (x - 1.2 * r, y - 0.8 * r)], colour, 1.0),
            Marker::Square => self.rectangle(x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r, colour, 1.0),
            Marker::Frame => {
                self.rectangle(x - r, y - r, 2.0 * r, 2.0 * r, colour, 1.0)?;
                self.rectangle(x - 0.55 * r, y - 0.55 * r, 1.1 * r, 1.1 * r, WHITE, 1.0)
            }
            Marker::Diamond => self.polygon(&[(x, y - 1.35 * r), (x + 1.35 * r, y), (x, y + 1.35 * r), (x - 1.35 * r, y)], colour, 1.0),
            Marker::Cross => {
                let stroke = Stroke::solid(colour, (0.5 * r).max(1.2));
                self.line(&[(x - r, y - r), (x + r, y + r)], stroke)?;
                self.line(&[(x - r, y + r), (x + r, y - r)], stroke)
            }
        }
    }

    /// A text; the place is the point of its baseline the anchor names.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn text(&mut self, place: PixelPoint, text: &CanvasText) -> Result<()> {
        let line = fonts::one_line(text.text);
        if line.is_empty() || !(place.0.is_finite() && place.1.is_finite()) {
            return Ok(());
        }
        let at = self.pixel(place);
        let size = text.size * self.scale;
        let CanvasText { weight, colour, anchor, upwards, .. } = *text;
        self.surface.text(at, &Lettering { text: &line, size, weight, colour, anchor, upwards })
    }

    /// A text centred on a place, on a plate of the background's colour so that lines under it do not disturb.
    ///
    /// # Errors
    /// If the surface refuses.
    pub fn plate(&mut self, (x, y): PixelPoint, text: &CanvasText) -> Result<()> {
        let (width, height) = (text.width() + 6.0, text.size * 1.15);
        self.rectangle(x - width / 2.0, y - height / 2.0, width, height, WHITE, 0.86)?;
        self.text((x, y + 0.36 * text.size), &text.clone().middle())
    }
}

/// The pieces of a line that a dash leaves.
fn dashes(places: &[PixelPoint], dash: Dash) -> Vec<Vec<PixelPoint>> {
    let mut pieces = Vec::new();
    let Some(first) = places.first() else { return pieces };
    if dash.iter().any(|length| length.is_nan() || *length <= 0.0) {
        return vec![places.to_vec()];
    }
    let (mut step, mut left) = (0, dash[0]);
    let mut piece = vec![*first];
    for pair in places.windows(2) {
        let (mut a, b) = (pair[0], pair[1]);
        let clamped = |p: PixelPoint| (p.0.clamp(-FAR, FAR), p.1.clamp(-FAR, FAR));
        a = clamped(a);
        let b = clamped(b);
        let mut length = (b.0 - a.0).hypot(b.1 - a.1);
        while length > left {
            let t = left / length;
            a = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            length -= left;
            if step % 2 == 0 {
                piece.push(a);
                pieces.push(std::mem::take(&mut piece));
            } else {
                piece = vec![a];
            }
            step = (step + 1) % dash.len();
            left = dash[step];
        }
        left -= length;
        if step % 2 == 0 {
            piece.push(b);
        }
    }
    if piece.len() > 1 {
        pieces.push(piece);
    }
    pieces
}
