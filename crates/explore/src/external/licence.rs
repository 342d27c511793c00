//! Tokens of a licence: files in a folder, one lock each, so that all processes that share the folder count together.

use std::fs::{File, OpenOptions, TryLockError};
use std::path::PathBuf;
use std::time::Duration;

use crate::stop;
use coldplate_base::error::{Error, Result};

/// Largest number of runs at once, over all processes and hosts that share the folder.
#[derive(Debug, Clone)]
pub(super) struct Licence {
    pub(super) folder: PathBuf,
    pub(super) tokens: usize,
}

/// Pause between two looks at the tokens. Chosen: shorter ones load the file system.
const PAUSE: Duration = Duration::from_millis(50);

impl Licence {
    /// Waits for a token. The token is held for as long as the file, or a copy of it that a process was given, is open.
    ///
    /// # Errors
    /// The folder cannot be written; the program is told to stop.
    pub(super) fn take(&self) -> Result<File> {
        std::fs::create_dir_all(&self.folder).map_err(|e| Error::file("make", &self.folder, e).at_key("solver.licence.folder"))?;
        // The search begins at a token that differs between processes, so that they do not all try the same token first.
        let first = std::process::id() as usize;
        loop {
            for token in 0..self.tokens {
                let path = self.folder.join(format!("token-{}", 1 + (first + token) % self.tokens));
                let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
                let file = file.map_err(|e| Error::file("open", &path, e))?;
                match file.try_lock() {
                    Ok(()) => return Ok(file),
                    Err(TryLockError::WouldBlock) => {}
                    Err(TryLockError::Error(e)) => {
                        return Err(Error::file("lock", &path, e).help("choose a folder on a file system with locks"));
                    }
                }
            }
            stop::check()?;
            std::thread::sleep(PAUSE);
        }
    }
}
