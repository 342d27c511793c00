//! From a figure to its files: SVG and PNG, each written under a temporary name and then renamed.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use plotters::backend::{BitMapBackend, DrawingBackend};

use super::Figure;
use super::canvas::Canvas;
use super::raster::{self, Raster};
use super::style::WHITE;
use super::vector::{self, Vector};
use crate::error::{Error, Result};

/// The two files of a figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The vector graphic.
    pub svg: PathBuf,
    /// The same as pixels, twice as many as CSS pixels in each direction.
    pub png: PathBuf,
}

/// The figure as an SVG document.
///
/// # Errors
/// As [`Figure::paint`].
pub fn to_svg_string<F: Figure>(figure: &F) -> Result<String> {
    let size = whole(figure.size()?);
    let mut markup = String::new();
    let mut surface = Vector::new(&mut markup, size)?;
    let mut canvas = Canvas::new(&mut surface);
    canvas.rectangle(0.0, 0.0, size.0, size.1, WHITE, 1.0)?;
    figure.paint(&mut canvas)?;
    let lengths = surface.close()?;
    Ok(vector::finish(&markup, figure.title(), size, &lengths))
}

/// The figure as RGB pixels, row by row from the top, with width and height.
///
/// # Errors
/// As [`Figure::paint`].
pub fn to_pixels<F: Figure>(figure: &F) -> Result<(Vec<u8>, (u32, u32))> {
    let size = whole(figure.size()?);
    let painted = raster::painted_size(size);
    let mut buffer = vec![255u8; 3 * painted.0 as usize * painted.1 as usize];
    {
        let mut surface = Raster::new(&mut buffer, painted);
        figure.paint(&mut Canvas::new(&mut surface))?;
    }
    Ok(raster::averaged(&buffer, painted))
}

/// Writes `STEM.svg` and `STEM.png`, making the folder where it is missing.
///
/// # Errors
/// As [`Figure::paint`], and where a file cannot be written.
pub fn draw<F: Figure>(stem: impl AsRef<Path>, figure: &F) -> Result<Written> {
    let stem = stem.as_ref();
    let with = |extension: &str| {
        let mut name = OsString::from(stem.as_os_str());
        name.push(extension);
        PathBuf::from(name)
    };
    let written = Written { svg: with(".svg"), png: with(".png") };
    let svg = to_svg_string(figure)?;
    let (pixels, size) = to_pixels(figure)?;
    write_atomically(&written.svg, svg.as_bytes())?;
    atomically(&written.png, ".png", |temporary| {
        let mut backend = BitMapBackend::new(temporary, size);
        let refused = |e: &dyn std::fmt::Display| Error::input(format!("cannot write this picture: {e}")).in_file(&written.png);
        backend.blit_bitmap((0, 0), size, &pixels).map_err(|e| refused(&e))?;
        backend.present().map_err(|e| refused(&e))
    })?;
    Ok(written)
}

/// Writes a whole file under a temporary name beside it and then renames it.
///
/// # Errors
/// Where it cannot be written.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    atomically(path, "", |temporary| fs::write(temporary, bytes).map_err(|e| Error::file("write", path, &e)))
}

fn atomically(path: &Path, extension: &str, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let Some(name) = path.file_name() else {
        return Err(Error::input("this is no file name").in_file(path).help("name a file to write"));
    };
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(|e| Error::file("make the folder of", path, &e))?;
    let mut hidden = OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.tmp{extension}", std::process::id()));
    let temporary = folder.join(hidden);
    let outcome = write(&temporary).and_then(|()| fs::rename(&temporary, path).map_err(|e| Error::file("rename", path, &e)));
    if outcome.is_err() {
        // The reason is in `outcome`; a temporary file that cannot be removed adds nothing to it.
        let _ = fs::remove_file(&temporary);
    }
    outcome
}

fn whole((width, height): (f64, f64)) -> (f64, f64) {
    let limited = |length: f64| if length.is_finite() { length.ceil().clamp(16.0, 8000.0) } else { 600.0 };
    (limited(width), limited(height))
}
