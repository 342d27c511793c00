//! Surfaces that figures are drawn onto: four primitives, in the surface's own integer coordinates.

use super::fonts::FontWeight;
use super::style::Rgb;
use coldplate_base::error::Result;

/// A point in the surface's coordinates.
pub(crate) type Pixel = (i32, i32);

/// Anchor of a text: the point that its position names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Anchor {
    /// Left end of the baseline.
    #[default]
    Start,
    /// Middle of the baseline.
    Middle,
    /// Right end of the baseline.
    End,
}

/// A text in the surface's coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Lettering<'a> {
    /// One line.
    pub text: &'a str,
    /// Font size (em).
    pub size: f64,
    /// Weight of the font.
    pub weight: FontWeight,
    /// Colour.
    pub colour: Rgb,
    /// Point of the text that the position names.
    pub anchor: Anchor,
    /// Reads upwards instead of to the right.
    pub upwards: bool,
}

/// An output of plotters, with the primitives the figures are made of.
pub trait DrawingSurface {
    /// Units of the surface per CSS pixel.
    fn scale(&self) -> f64;

    /// Fills a polygon (even-odd).
    ///
    /// # Errors
    /// If the output refuses.
    fn polygon(&mut self, points: &[Pixel], colour: Rgb, alpha: f64) -> Result<()>;

    /// Fills a polygon that others of its area adjoin, with no seam between them.
    ///
    /// # Errors
    /// If the output refuses.
    fn tile(&mut self, points: &[Pixel], colour: Rgb) -> Result<()> {
        self.polygon(points, colour, 1.0)
    }

    /// Strokes an open line.
    ///
    /// # Errors
    /// If the output refuses.
    fn line(&mut self, points: &[Pixel], colour: Rgb, width: u32) -> Result<()>;

    /// Fills a disc.
    ///
    /// # Errors
    /// If the output refuses.
    fn disc(&mut self, centre: Pixel, radius: u32, colour: Rgb) -> Result<()>;

    /// Sets a text, `at` being the point of its baseline that [`Lettering::anchor`] names.
    ///
    /// # Errors
    /// If the output refuses.
    fn text(&mut self, at: Pixel, lettering: &Lettering) -> Result<()>;
}
