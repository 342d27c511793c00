//! The surface that writes SVG, through plotters' SVG backend.

use std::fmt::Write as _;

use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBAColor, RGBColor, ShapeStyle, TextStyle};

use super::Figure;
use super::canvas::PixelSize;
use super::fonts::{self, FAMILY, FontWeight};
use super::style::Rgb;
use super::surface::{Anchor, DrawingSurface, Lettering, Pixel};
use coldplate_base::error::{Error, Result};

/// Units of the view box per CSS pixel. Chosen: plotters' coordinates are whole numbers, and a curve needs finer
/// ones.
const SCALE: f64 = 10.0;
/// Ratio of the font size given to plotters to the one it writes, dimensionless; from its SVG backend.
const PLOTTERS_EM: f64 = 1.24;
/// Distance of the baseline below the top of a text anchored at its top, in em; from plotters' SVG backend.
const TOP_TO_BASELINE: f64 = 0.76;

/// An SVG being drawn.
pub(crate) struct Vector<'a> {
    backend: SVGBackend<'a>,
    marks: Marks,
}

/// Attributes that plotters' markup lacks, in the order drawn.
#[derive(Debug, Default)]
pub(crate) struct Marks {
    /// Length of every text, units of the view box.
    lengths: Vec<f64>,
    /// Whether each polygon is a tile.
    tiles: Vec<bool>,
}

fn failed(error: impl std::fmt::Display) -> Error {
    Error::numerics(format!("the SVG cannot be drawn: {error}"))
}

fn paint(colour: Rgb, alpha: f64) -> RGBAColor {
    RGBColor(colour.0, colour.1, colour.2).mix(alpha)
}

impl<'a> Vector<'a> {
    /// Starts a drawing of this size in CSS pixels; the markup goes into `markup`.
    ///
    /// # Errors
    /// If the embedded font cannot be read.
    pub fn new(markup: &'a mut String, (width, height): PixelSize) -> Result<Self> {
        fonts::register()?;
        let units = |length: f64| (length * SCALE).round() as u32;
        Ok(Self { backend: SVGBackend::with_string(markup, (units(width), units(height))), marks: Marks::default() })
    }

    /// Ends the drawing; returns the attributes for [`finish`].
    ///
    /// # Errors
    /// If plotters refuses.
    pub fn close(mut self) -> Result<Marks> {
        self.backend.present().map_err(failed)?;
        Ok(std::mem::take(&mut self.marks))
    }
}

impl Vector<'_> {
    fn fill(&mut self, points: &[Pixel], color: RGBAColor, is_tile: bool) -> Result<()> {
        self.marks.tiles.push(is_tile);
        let style = ShapeStyle { color, filled: true, stroke_width: 0 };
        self.backend.fill_polygon(points.iter().copied(), &style).map_err(failed)
    }
}

impl DrawingSurface for Vector<'_> {
    fn scale(&self) -> f64 {
        SCALE
    }

    fn polygon(&mut self, points: &[Pixel], colour: Rgb, alpha: f64) -> Result<()> {
        self.fill(points, paint(colour, alpha), false)
    }

    fn tile(&mut self, points: &[Pixel], colour: Rgb) -> Result<()> {
        self.fill(points, paint(colour, 1.0), true)
    }

    fn line(&mut self, points: &[Pixel], colour: Rgb, width: u32) -> Result<()> {
        let style = ShapeStyle { color: paint(colour, 1.0), filled: false, stroke_width: width };
        self.backend.draw_path(points.iter().copied(), &style).map_err(failed)
    }

    fn disc(&mut self, centre: Pixel, radius: u32, colour: Rgb) -> Result<()> {
        let style = ShapeStyle { color: paint(colour, 1.0), filled: true, stroke_width: 0 };
        self.backend.draw_circle(centre, radius, &style, true).map_err(failed)
    }

    fn text(&mut self, at: Pixel, lettering: &Lettering) -> Result<()> {
        let weight = if lettering.weight == FontWeight::Bold { FontStyle::Bold } else { FontStyle::Normal };
        let turn = if lettering.upwards { FontTransform::Rotate270 } else { FontTransform::None };
        let font = FontDesc::new(FontFamily::Name(FAMILY), lettering.size * PLOTTERS_EM, weight).transform(turn);
        let across = match lettering.anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let style = TextStyle { font, color: paint(lettering.colour, 1.0).to_backend_color(), pos: Pos::new(across, VPos::Top) };
        let back = (lettering.size * TOP_TO_BASELINE).round() as i32;
        let at = if lettering.upwards { (at.0 - back, at.1) } else { (at.0, at.1 - back) };
        self.marks.lengths.push(fonts::width(lettering.text, lettering.size, lettering.weight));
        self.backend.draw_text(lettering.text, &style, at).map_err(failed)
    }
}

/// plotters' markup made ready for readers: its size in CSS pixels over the finer view box, a title, and on every text its
/// length, so that no substitute font can make it overlap or be clipped. Tiles have hard edges: two smooth edges side by
/// side would let the ground shine through.
pub(crate) fn finish(markup: &str, figure: &dyn Figure, (width, height): PixelSize, marks: &Marks) -> String {
    let mut out = String::with_capacity(markup.len() + 64 * marks.lengths.len());
    let body = markup.split_once('>').map_or("", |(_, body)| body);
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" role=\"img\"{} \
         stroke-linejoin=\"round\">\n<title>{}</title>",
        (width * SCALE).round(),
        (height * SCALE).round(),
        if figure.is_on_white() { " class=\"on-white\"" } else { "" },
        escape(&fonts::one_line(figure.title()))
    );
    let (mut lengths, mut tiles) = (marks.lengths.iter(), marks.tiles.iter());
    // These attributes state the default; in texts the quotation marks are escaped.
    let body =
        [" opacity=\"1\"", " stroke=\"none\"", " stroke-width=\"0\""].iter().fold(body.to_string(), |b, default| b.replace(default, ""));
    for line in body.replace("\n</text>", "</text>").split_inclusive('\n') {
        if let Some(rest) = line.strip_prefix("<polygon ").filter(|_| tiles.next() == Some(&true)) {
            let _ = write!(out, "<polygon shape-rendering=\"crispEdges\" {rest}");
            continue;
        }
        match (line.strip_prefix("<text "), lengths.clone().next()) {
            (Some(rest), Some(length)) => {
                lengths.next();
                let _ = write!(out, "<text textLength=\"{length:.0}\" lengthAdjust=\"spacingAndGlyphs\" {rest}");
            }
            _ => out.push_str(line),
        }
    }
    // The content of a <text> begins on the line after its tag.
    out.replace("\">\n", "\">")
}

/// Escapes a text for XML and HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;").replace('\'', "&#39;")
}
