//! Reading whole files.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::str::Utf8Error;

use crate::error::{Error, Result};
use crate::roles;

/// Most bytes read from a file that is not regular (256 MiB). Pipes and devices do not state their length. Chosen:
/// bounds the memory taken.
const MOST_OF_A_STREAM: u64 = 256 << 20;

/// The bytes of a file.
///
/// # Errors
/// The file cannot be read, is to be written in the same run of the program, or is a pipe or device that gives more than
/// 256 MiB.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    roles::reads(path)?;
    read_back(path)
}

/// The bytes of a file that the program keeps for itself, and may write anew in the same run: a checkpoint, a record.
///
/// # Errors
/// The file cannot be read, or is a pipe or device that gives more than 256 MiB.
pub fn read_back(path: &Path) -> Result<Vec<u8>> {
    let failed = |e| Error::file("read", path, e);
    let mut file = File::open(path).map_err(failed)?;
    let about = file.metadata().map_err(failed)?;
    let mut bytes = Vec::new();
    if about.is_file() || about.is_dir() {
        bytes.reserve_exact(usize::try_from(about.len()).unwrap_or(0));
        file.read_to_end(&mut bytes).map_err(failed)?;
        return Ok(bytes);
    }
    file.take(MOST_OF_A_STREAM + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MOST_OF_A_STREAM {
        return Err(Error::input("this pipe or device gives more than 256 MiB").in_file(path).help("name a file"));
    }
    Ok(bytes)
}

/// The text of a file.
///
/// # Errors
/// Errors of [`read`], or the file is not UTF-8; the error names the line.
pub fn text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?).map_err(|e| no_text(e.as_bytes(), e.utf8_error(), path))
}

/// The text of a file that has been read; `path` is the name used in errors.
///
/// # Errors
/// The file is not UTF-8; the error names the line.
pub fn utf8<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a str> {
    std::str::from_utf8(bytes).map_err(|e| no_text(bytes, e, path))
}

fn no_text(bytes: &[u8], error: Utf8Error, path: &Path) -> Error {
    let line = 1 + bytes[..error.valid_up_to()].iter().filter(|b| **b == b'\n').count();
    Error::input("the file is not UTF-8 text").in_file(path).at_line(line).help("save it as UTF-8")
}
