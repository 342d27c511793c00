//! Any figure in another size: everything in it grows or shrinks alike.

use super::Figure;
use super::canvas::Canvas;
use super::surface::Surface;
use coldplate_base::error::Result;

/// A figure scaled to this width.
#[derive(Debug, Clone, Copy)]
pub struct Resized<'a, F> {
    /// The figure.
    pub figure: &'a F,
    /// New width, CSS pixels.
    pub width: f64,
}

impl<F: Figure> Resized<'_, F> {
    fn factor(&self) -> Result<f64> {
        Ok(self.width / self.figure.size()?.0)
    }
}

impl<F: Figure> Figure for Resized<'_, F> {
    fn title(&self) -> &str {
        self.figure.title()
    }

    fn size(&self) -> Result<(f64, f64)> {
        Ok((self.width, self.figure.size()?.1 * self.factor()?))
    }

    fn paint<S: Surface>(&self, canvas: &mut Canvas<S>) -> Result<()> {
        canvas.magnified(self.factor()?, |canvas| self.figure.paint(canvas))
    }
}
