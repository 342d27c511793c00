//! From a figure to its files: SVG and PNG, each written under a temporary name and then renamed.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use plotters::backend::{BitMapBackend, DrawingBackend};

use super::Figure;
use super::canvas::{Canvas, PixelSize};
use super::raster::{self, Raster};
use super::style::WHITE;
use super::vector::{self, Vector};
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};

/// The two files of a figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The vector graphic.
    pub svg: PathBuf,
    /// The figure as pixels, twice as many as CSS pixels in each direction.
    pub png: PathBuf,
}

/// The figure as an SVG document.
///
/// # Errors
/// Errors of [`Figure::paint`].
pub fn to_svg_string(figure: &dyn Figure) -> Result<String> {
    let size = whole(figure.size()?);
    let mut markup = String::new();
    let mut surface = Vector::new(&mut markup, size)?;
    let mut canvas = Canvas::new(&mut surface);
    canvas.rectangle(0.0, 0.0, size.0, size.1, WHITE, 1.0)?;
    figure.paint(&mut canvas)?;
    let marks = surface.close()?;
    Ok(vector::finish(&markup, figure, size, &marks))
}

/// The figure as RGB pixels, row by row from the top, with width and height.
///
/// # Errors
/// Errors of [`Figure::paint`].
pub fn to_pixels(figure: &dyn Figure) -> Result<(Vec<u8>, (u32, u32))> {
    let size = whole(figure.size()?);
    let (width, height) = raster::painted_size(size);
    let mut buffer = vec![255u8; 3 * width as usize * height as usize];
    {
        let mut surface = Raster::new(&mut buffer, width, height);
        figure.paint(&mut Canvas::new(&mut surface))?;
    }
    Ok(raster::averaged(&buffer, width, height))
}

/// Writes `STEM.svg` and `STEM.png`, making the folder where it is missing.
///
/// # Errors
/// Errors of [`Figure::paint`]; a file that cannot be written.
pub fn draw(stem: impl AsRef<Path>, figure: &dyn Figure) -> Result<Written> {
    let stem = stem.as_ref();
    let with = |extension: &str| {
        let mut name = OsString::from(stem.as_os_str());
        name.push(extension);
        PathBuf::from(name)
    };
    let written = Written { svg: with(".svg"), png: with(".png") };
    draw_as(&written.svg, figure)?;
    draw_as(&written.png, figure)?;
    Ok(written)
}

/// Writes one file, SVG or PNG by the extension of its name, making the folder where it is missing.
///
/// # Errors
/// Errors of [`check_name`] and [`Figure::paint`]; a file that cannot be written.
pub fn draw_as(path: &Path, figure: &dyn Figure) -> Result<()> {
    check_name(path)?;
    if has_extension(path, "svg") {
        return atomic_file::write(path, to_svg_string(figure)?.as_bytes());
    }
    let (pixels, size) = to_pixels(figure)?;
    atomic_file::replace(path, |temporary| {
        let mut backend = BitMapBackend::new(temporary, size);
        let refused = |e: &dyn std::fmt::Display| Error::input(format!("cannot write this picture: {e}")).in_file(path);
        backend.blit_bitmap((0, 0), size, &pixels).map_err(|e| refused(&e))?;
        backend.present().map_err(|e| refused(&e))
    })
}

/// Checks that a picture can be written under this name, before any work is done for it.
///
/// # Errors
/// The extension is neither `svg` nor `png`.
pub fn check_name(path: &Path) -> Result<()> {
    if has_extension(path, "svg") || has_extension(path, "png") {
        return Ok(());
    }
    Err(Error::input("pictures are written as SVG or PNG").in_file(path).help("end the name in .svg or .png"))
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e == extension)
}

/// A size in whole CSS pixels, within limits.
fn whole((width, height): PixelSize) -> PixelSize {
    let limited = |length: f64| if length.is_finite() { length.ceil().clamp(16.0, 8000.0) } else { 600.0 };
    (limited(width), limited(height))
}
