//! Any figure in another size: everything in it grows or shrinks alike.

use super::Figure;
use super::canvas::Canvas;
use coldplate_base::error::Result;

/// A figure scaled to this width.
#[derive(Clone, Copy)]
pub struct Resized<'a> {
    /// The figure.
    pub figure: &'a dyn Figure,
    /// New width, CSS pixels.
    pub width: f64,
}

impl Resized<'_> {
    fn factor(&self) -> Result<f64> {
        Ok(self.width / self.figure.size()?.0)
    }
}

impl Figure for Resized<'_> {
    fn title(&self) -> &str {
        self.figure.title()
    }

    fn size(&self) -> Result<(f64, f64)> {
        Ok((self.width, self.figure.size()?.1 * self.factor()?))
    }

    fn is_on_white(&self) -> bool {
        self.figure.is_on_white()
    }

    fn paint(&self, canvas: &mut Canvas) -> Result<()> {
        canvas.magnified(self.factor()?, |canvas| self.figure.paint(canvas))
    }
}
