//! The surface that paints pixels, through plotters' bitmap backend, for PNG.
//!
//! Figures are drawn at twice the resolution of the file and averaged down, so that edges are smooth.

use ab_glyph::{Font, Glyph, Point, PxScale};
use plotters::backend::{BitMapBackend, DrawingBackend};
use plotters::style::{Color, RGBAColor, RGBColor};

use super::canvas::PixelSize;
use super::fonts;
use super::style::Rgb;
use super::surface::{Anchor, DrawingSurface, Lettering, Pixel};
use coldplate_base::error::{Error, Result};

/// Pixels of the PNG per CSS pixel. Chosen: sharp on screens and in print.
pub const DENSITY: u32 = 2;
/// Painted pixels per pixel of the PNG, in each direction. Chosen: smooth edges against time and memory.
const OVERSAMPLING: u32 = 2;

/// A bitmap being painted.
pub(crate) struct Raster<'a> {
    backend: BitMapBackend<'a>,
    size: (i32, i32),
}

fn failed(error: impl std::fmt::Display) -> Error {
    Error::numerics(format!("the PNG cannot be painted: {error}"))
}

fn paint(colour: Rgb, alpha: f64) -> RGBAColor {
    RGBColor(colour.0, colour.1, colour.2).mix(alpha)
}

/// Painted pixels for a figure of this size in CSS pixels.
pub(crate) fn painted_size((width, height): PixelSize) -> (u32, u32) {
    let pixels = |length: f64| (length * f64::from(DENSITY)).round() as u32 * OVERSAMPLING;
    (pixels(width), pixels(height))
}

impl<'a> Raster<'a> {
    /// Starts painting into a buffer of `width * height` RGB pixels, see [`painted_size`].
    pub fn new(buffer: &'a mut [u8], width: u32, height: u32) -> Self {
        Self { backend: BitMapBackend::with_buffer(buffer, (width, height)), size: (width as i32, height as i32) }
    }

    /// One horizontal run of pixels, both ends included (plotters leaves the lower right corner out).
    fn run(&mut self, y: i32, from: i32, to: i32, colour: RGBAColor) -> Result<()> {
        let (from, to) = (from.max(0), to.min(self.size.0 - 1));
        if y < 0 || y >= self.size.1 || from > to {
            return Ok(());
        }
        self.backend.draw_rect((from, y), (to + 1, y + 1), &colour, true).map_err(failed)
    }
}

/// Place of a point at the distances `x` along and `y` above the place of a text.
fn turned(at: Pixel, upwards: bool, x: i32, y: i32) -> Pixel {
    if upwards { (at.0 + y, at.1 - x) } else { (at.0 + x, at.1 + y) }
}

impl Raster<'_> {
    /// One sign of the font, `along` pixels behind the beginning of its text.
    fn glyph(&mut self, at: Pixel, lettering: &Lettering, c: char, along: f64, scale: PxScale) -> Result<()> {
        let face = fonts::face(lettering.weight)?;
        let glyph = Glyph { id: face.glyph_id(c), scale, position: Point { x: along as f32, y: 0.0 } };
        let Some(outline) = face.outline_glyph(glyph) else { return Ok(()) };
        let corner = outline.px_bounds().min;
        let mut dots = Vec::new();
        outline.draw(|x, y, coverage| dots.push((x as i32 + corner.x as i32, y as i32 + corner.y as i32, coverage)));
        let (width, height) = self.size;
        for (x, y, coverage) in dots {
            let (x, y) = turned(at, lettering.upwards, x, y);
            if coverage > 0.0 && x >= 0 && y >= 0 && x < width && y < height {
                let dot = paint(lettering.colour, f64::from(coverage.min(1.0)));
                self.backend.draw_pixel((x, y), dot.to_backend_color()).map_err(failed)?;
            }
        }
        Ok(())
    }

    /// A sign that the font lacks: its code point in a box, so that it does not vanish.
    fn code_point(&mut self, at: Pixel, lettering: &Lettering, c: char, along: f64) -> Result<()> {
        let em = lettering.size;
        let place = |x: f64, y: f64| turned(at, lettering.upwards, (along + x * em).round() as i32, (-y * em).round() as i32);
        let frame = [place(0.08, -0.12), place(0.92, -0.12), place(0.92, 0.8), place(0.08, 0.8), place(0.08, -0.12)];
        self.line(&frame, lettering.colour, (em * 0.05).round().max(1.0) as u32)?;
        let code = format!("{:04X}", u32::from(c));
        let (above, below) = code.split_at(code.len() / 2);
        for (line, y) in [(above, 0.4), (below, -0.02)] {
            let small = Lettering { text: line, size: 0.36 * em, anchor: Anchor::Middle, ..*lettering };
            self.text(place(0.5, y), &small)?;
        }
        Ok(())
    }
}

impl DrawingSurface for Raster<'_> {
    fn scale(&self) -> f64 {
        f64::from(DENSITY * OVERSAMPLING)
    }

    fn polygon(&mut self, points: &[Pixel], colour: Rgb, alpha: f64) -> Result<()> {
        let colour = paint(colour, alpha);
        let (Some(top), Some(bottom)) = (points.iter().map(|p| p.1).min(), points.iter().map(|p| p.1).max()) else { return Ok(()) };
        let mut crossings = Vec::new();
        for y in top.max(0)..bottom.min(self.size.1) {
            // Pixel centres, so that polygons sharing an edge share no pixel and leave none out.
            let middle = f64::from(y) + 0.5;
            crossings.clear();
            for (i, a) in points.iter().enumerate() {
                let b = points[(i + 1) % points.len()];
                if (f64::from(a.1) <= middle) != (f64::from(b.1) <= middle) {
                    let along = (middle - f64::from(a.1)) / f64::from(b.1 - a.1);
                    crossings.push(f64::from(a.0) + along * f64::from(b.0 - a.0));
                }
            }
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                self.run(y, (pair[0] - 0.5).ceil() as i32, (pair[1] - 0.5).ceil() as i32 - 1, colour)?;
            }
        }
        Ok(())
    }

    fn line(&mut self, points: &[Pixel], colour: Rgb, width: u32) -> Result<()> {
        let half = f64::from(width) / 2.0;
        for (i, pair) in points.windows(2).enumerate() {
            let (a, b) = (pair[0], pair[1]);
            let (dx, dy) = (f64::from(b.0 - a.0), f64::from(b.1 - a.1));
            let length = dx.hypot(dy);
            if length == 0.0 {
                continue;
            }
            let (nx, ny) = (-dy / length * half, dx / length * half);
            let corner = |p: Pixel, side: f64| ((f64::from(p.0) + side * nx).round() as i32, (f64::from(p.1) + side * ny).round() as i32);
            self.polygon(&[corner(a, 1.0), corner(b, 1.0), corner(b, -1.0), corner(a, -1.0)], colour, 1.0)?;
            if i > 0 && width > 2 {
                self.disc(a, (width / 2).max(1), colour)?;
            }
        }
        Ok(())
    }

    fn disc(&mut self, centre: Pixel, radius: u32, colour: Rgb) -> Result<()> {
        let r = i64::from(radius);
        for dy in -r..=r {
            let half = ((r * r - dy * dy) as f64).sqrt().round() as i32;
            self.run(centre.1 + dy as i32, centre.0 - half, centre.0 + half, paint(colour, 1.0))?;
        }
        Ok(())
    }

    fn text(&mut self, at: Pixel, lettering: &Lettering) -> Result<()> {
        let face = fonts::face(lettering.weight)?;
        let per_em = face.units_per_em().unwrap_or(2048.0);
        let scale = PxScale::from(lettering.size as f32 * face.height_unscaled() / per_em);
        let length = fonts::width(lettering.text, lettering.size, lettering.weight);
        let mut along = match lettering.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -length / 2.0,
            Anchor::End => -length,
        };
        for c in lettering.text.chars() {
            if fonts::has(c) {
                self.glyph(at, lettering, c, along, scale)?;
            } else {
                self.code_point(at, lettering, c, along)?;
            }
            along += fonts::width(c.encode_utf8(&mut [0; 4]), lettering.size, lettering.weight);
        }
        Ok(())
    }
}

/// The painted pixels averaged down to the pixels of the PNG, with their width and height.
pub(crate) fn averaged(painted: &[u8], width: u32, height: u32) -> (Vec<u8>, (u32, u32)) {
    let n = OVERSAMPLING as usize;
    let (columns, rows) = (width as usize / n, height as usize / n);
    let mut out = vec![0u8; 3 * columns * rows];
    for row in 0..rows {
        for column in 0..columns {
            for channel in 0..3 {
                let mut sum = 0usize;
                for dy in 0..n {
                    for dx in 0..n {
                        let at = 3 * ((row * n + dy) * width as usize + column * n + dx) + channel;
                        sum += painted.get(at).copied().map_or(0, usize::from);
                    }
                }
                out[3 * (row * columns + column) + channel] = ((sum + n * n / 2) / (n * n)) as u8;
            }
        }
    }
    (out, (columns as u32, rows as u32))
}
