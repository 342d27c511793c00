//! Machines, readings and folders that tests and benches of several crates share. Text and folders need nothing; what is built
//! from the crates of the project stands behind features, so that the tests of a low crate do not compile those above it:
//! `fits` (functions to fit), `measured` (tables of measured runs), `twin` (data with a hidden effect), `validation` (the published study).

#[cfg(feature = "fits")]
pub mod fits;
pub mod machines;
#[cfg(feature = "measured")]
pub mod measured;
#[cfg(feature = "twin")]
pub mod twin;
#[cfg(feature = "twin")]
pub mod two_masses;
#[cfg(feature = "validation")]
pub mod validation;

use std::path::{Path, PathBuf};

/// The folder of the project, with machines, sweeps, data and pages.
pub fn root() -> &'static Path {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.ancestors().nth(2).unwrap_or(own)
}

/// An empty folder below `place`, which is `env!("CARGO_TARGET_TMPDIR")` of the test.
///
/// # Panics
/// The folder cannot be made.
pub fn scratch(place: &str, name: &str) -> PathBuf {
    let folder = Path::new(place).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Writes a file of a folder; its path as text.
///
/// # Panics
/// The file cannot be written, or its path is no text.
pub fn write(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_string()
}
