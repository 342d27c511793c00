//! Figures of samples, fits and conclusions, as SVG and PNG.
//!
//! Every figure is plain data (names, units, numbers) and knows nothing of solvers, fits or surrogate files, so a
//! measured table can be drawn as well as a simulated one. A figure is drawn once, by its [`Figure::paint`], onto
//! whichever [`surface::DrawingSurface`] is asked for:
//!
//! ```
//! use coldplate_figures::chart::{heat::HeatFigure, to_svg_string};
//! let figure = HeatFigure {
//!     title: "Where the heat goes".into(),
//!     sources: vec![("motor".into(), 113.7), ("reducer".into(), 51.2)],
//!     sinks: vec![("coolant".into(), 150.1), ("chamber wall".into(), 14.8)],
//!     ..HeatFigure::default()
//! };
//! let svg = to_svg_string(&figure)?;
//! assert!(svg.contains("chamber wall"));
//! # Ok::<(), coldplate_base::error::Error>(())
//! ```
//!
//! The page `docs/how-to/charts.md` says which figure answers which question.

pub mod acceptability;
pub mod axis;
pub mod balance;
pub mod before_after;
pub mod borders;
pub mod canvas;
pub mod contour;
pub mod depth;
pub mod error_overview;
pub mod fonts;
pub mod gains;
pub mod heat;
pub mod history;
pub mod legend;
mod levels;
pub mod machine;
pub mod measured;
pub mod missing_heat;
pub mod one_factor;
pub mod operator_sheet;
pub mod output;
pub mod panels;
pub mod parity;
pub mod ranking;
pub mod raster;
pub mod regions;
pub mod residual_panels;
pub mod residual_sheet;
pub mod residuals;
pub mod resized;
pub mod rows;
pub mod sankey;
pub mod style;
pub mod surface;
pub mod ticks;
pub mod title_and_footer;
pub mod valley;
pub mod vector;

pub use output::{Written, draw, draw_as, to_pixels, to_svg_string};
pub use vector::escape;

use coldplate_base::error::Result;

/// Something that can be drawn: a size and one drawing function for every kind of output.
pub trait Figure {
    /// Subject of the figure, in a few words; also the title of the SVG document.
    fn title(&self) -> &str;

    /// Width and height in CSS pixels (96 per inch).
    ///
    /// # Errors
    /// An input error: there is nothing to draw, or the data contradict each other.
    fn size(&self) -> Result<canvas::PixelSize>;

    /// Whether it keeps its white ground on a dark page: a sheet for paper, or colours that shade into white.
    fn is_on_white(&self) -> bool {
        false
    }

    /// Draws the figure, the top left corner being (0, 0).
    ///
    /// # Errors
    /// Errors of [`Figure::size`] and of the surface.
    fn paint(&self, canvas: &mut canvas::Canvas) -> Result<()>;
}
