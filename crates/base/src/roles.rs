//! Files that a run of the program reads, and files that it is to write: no file is both.
//!
//! A file is known by device and inode where the system has them, so that links of both kinds are seen through. Only
//! regular files count: a pipe or device holds nothing that could be lost. A library does not know which of its calls
//! belong together; nothing is refused there until [`keep_apart`] is called, as the program does.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use crate::error::{Error, Result};

/// Roles of the files of this process; none until the program asks for them.
static ROLES: Mutex<Option<Roles>> = Mutex::new(None);

#[derive(Debug, Default)]
struct Roles {
    inputs: BTreeSet<Identity>,
    outputs: BTreeSet<Identity>,
}

/// Device and inode of a file.
#[cfg(unix)]
type Identity = (u64, u64);
/// Path of a file without links.
#[cfg(not(unix))]
type Identity = std::path::PathBuf;

#[cfg(unix)]
fn identity(_: &Path, about: &fs::Metadata) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    Some((about.dev(), about.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path, _: &fs::Metadata) -> Option<Identity> {
    path.canonicalize().ok()
}

/// Refuses, from here on and in the whole process, to write a file that was read, and to read one that is to be written.
pub fn keep_apart() {
    with(|roles| *roles = Some(Roles::default()));
}

/// Notes that a file is read.
///
/// # Errors
/// The file is to be written.
pub fn reads(path: &Path) -> Result<()> {
    note(path, |roles, file| {
        let is_free = !roles.outputs.contains(&file);
        roles.inputs.insert(file);
        is_free
    })
}

/// Notes that a file is to be written: known before the work, so that no result is lost for its name.
///
/// # Errors
/// The file was read.
pub fn will_write(path: &Path) -> Result<()> {
    note(path, |roles, file| {
        let is_free = !roles.inputs.contains(&file);
        roles.outputs.insert(file);
        is_free
    })
}

/// Asks whether a file may be written. The program may read back a file of its own later.
///
/// # Errors
/// The file was read.
pub fn may_write(path: &Path) -> Result<()> {
    note(path, |roles, file| !roles.inputs.contains(&file))
}

/// Forgets that a file was read: the command is asked to change it in place.
pub(crate) fn release(path: &Path) {
    // Nothing is asked, so nothing can be refused.
    let _ = note(path, |roles, file| {
        roles.inputs.remove(&file);
        true
    });
}

fn note(path: &Path, is_allowed: impl FnOnce(&mut Roles, Identity) -> bool) -> Result<()> {
    with(|roles| {
        let Some(roles) = roles else { return Ok(()) };
        // A file that does not exist holds nothing.
        let Some(file) = fs::metadata(path).ok().filter(fs::Metadata::is_file).and_then(|about| identity(path, &about)) else {
            return Ok(());
        };
        if is_allowed(roles, file) {
            return Ok(());
        }
        Err(Error::input("this file is an input of this run, and the output would replace it")
            .in_file(path)
            .help("give the output another name: inputs are kept"))
    })
}

fn with<T>(work: impl FnOnce(&mut Option<Roles>) -> T) -> T {
    work(&mut ROLES.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
}
