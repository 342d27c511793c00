//! Writing a file whole or not at all.

use std::ffi::OsString;
use std::fs::{self, File};
use std::path::Path;

use crate::error::{Error, Result};

/// Writes `bytes` as the whole content of `path`; see [`replace`].
///
/// # Errors
/// As [`replace`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, |temporary| fs::write(temporary, bytes).map_err(|e| Error::file("write", path, e)))
}

/// Gives `write` a temporary name in the folder of `path`, with the same extension, and renames what it wrote
/// there once that is on the disk. A reader, and whoever comes after a crash, sees the old file or the new one.
/// A missing folder is made.
///
/// # Errors
/// What `write` reports, or the file cannot be put in its place; the old one is then still there and nothing
/// else is left behind.
pub fn replace(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let failed =
        |action: &str, e: std::io::Error| Error::file(action, path, e).help("check that the folder may be written to and has space left");
    let Some(name) = path.file_name() else {
        return Err(Error::input("this is no file name").in_file(path).help("name a file to write"));
    };
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(|e| failed("make the folder of", e))?;
    // Hidden, and of this process alone: two runs that write the same file do not meet.
    let mut hidden = OsString::from(format!(".{}.", std::process::id()));
    hidden.push(name);
    let temporary = folder.join(hidden);
    let outcome = write(&temporary).and_then(|()| {
        File::open(&temporary).and_then(|f| f.sync_all()).and_then(|()| fs::rename(&temporary, path)).map_err(|e| failed("write", e))
    });
    if outcome.is_err() {
        // The reason is in `outcome`; a temporary file that cannot be removed adds nothing to it.
        let _ = fs::remove_file(&temporary);
    }
    outcome
}

/// Whether a file can be written at `path`, found out before the work that would be lost: nothing is left behind.
///
/// # Errors
/// The nearest folder that exists is none, or refuses a new file; or `path` is a folder.
pub fn check(path: &Path) -> Result<()> {
    let failed = |e: std::io::Error| Error::file("write", path, e).help("check that the folder may be written to");
    if path.file_name().is_none() || path.is_dir() {
        return Err(Error::input("this is no file name").in_file(path).help("name a file to write"));
    }
    let above = path.ancestors().skip(1).map(|a| if a.as_os_str().is_empty() { Path::new(".") } else { a });
    let Some(folder) = above.into_iter().find(|a| a.exists()) else { return Ok(()) };
    if !folder.is_dir() {
        return Err(Error::input("this lies below something that is no folder")
            .in_file(path)
            .read(folder.display())
            .help("name another folder"));
    }
    let probe = folder.join(format!(".{}.probe", std::process::id()));
    File::create(&probe).map_err(failed)?;
    fs::remove_file(&probe).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = std::env::temp_dir().join(format!("coldplate-files-{}", std::process::id()));
        let path = folder.join("made").join("a.csv");
        write(&path, b"old").unwrap();
        let error = replace(&path, |temporary| {
            assert_eq!(temporary.extension(), path.extension());
            fs::write(temporary, b"half").map_err(|e| Error::file("write", temporary, e))?;
            Err(Error::numerics("stopped"))
        });
        assert_eq!(error.unwrap_err().what(), "stopped");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        write(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(write(&folder, b"a folder is there").is_err());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        assert!(write(Path::new(".."), b"").is_err());
        check(&folder.join("not").join("yet").join("there.csv")).unwrap();
        assert!(check(&path.join("below a file.csv")).is_err() && check(&folder).is_err());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        let _ = fs::remove_dir_all(&folder);
    }
}
