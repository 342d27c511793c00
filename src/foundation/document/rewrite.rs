//! A file written anew with some values changed: comments stay, and a head says where the values come from.

use std::path::Path;

use super::{Document, Leaf, edited};
use crate::error::{Error, Result};
use crate::foundation::input;

/// Keys of a file with their values, TOML.
type Sets = Vec<(String, String)>;

impl Document {
    /// The file's text with `sets` (key, TOML value) applied and with `remarks`, a line each, as comments at its head. What
    /// `--set` changed beforehand is carried over and said there too.
    ///
    /// # Errors
    /// The file cannot be read again, or the changed text does not hold the very values meant.
    pub fn rewritten(&self, sets: &[(String, String)], remarks: &[String]) -> Result<String> {
        let path = self.file();
        let text = input::text(path)?;
        let (beforehand, words) = self.changed_beforehand(&text, path)?;
        let sets: Sets =
            beforehand.into_iter().filter(|(key, _)| sets.iter().all(|(other, _)| other != key)).chain(sets.iter().cloned()).collect();
        let head = [format!("of the file {}, SHA-256 {}", name_of(path), &self.hash()[..16])];
        let comment: String = remarks.iter().chain(&head).chain(&words).flat_map(|r| r.lines()).map(|line| format!("# {line}\n")).collect();
        let text = format!("{comment}\n{}", edited(&text, path, &sets)?);
        // What is written must be what was meant.
        let written = Self::parse(&text, path)?;
        let mut meant = self.clone();
        for (key, value) in &sets {
            meant.apply_set(key, value)?;
        }
        for key in meant.keys().into_iter().chain(written.keys()) {
            if written.leaf(&key)? != meant.leaf(&key)? {
                return Err(Error::numerics("the file could not be rewritten with the values found").in_file(path).at_key(key));
            }
        }
        Ok(text)
    }

    /// What this document holds that the file's text does not, as keys with their values, and in words.
    fn changed_beforehand(&self, text: &str, path: &Path) -> Result<(Sets, Vec<String>)> {
        let own = Self::parse(text, path)?;
        let mut sets = Vec::new();
        for key in self.keys() {
            let now: Option<Leaf> = self.leaf(&key)?;
            if let Some(leaf) = &now
                && own.leaf(&key)? != now
            {
                sets.push((key, leaf.to_toml()));
            }
        }
        let words = sets.iter().map(|(key, value)| format!("changed beforehand: {key} = {value}")).collect();
        Ok((sets, words))
    }
}

/// The last step of a path, for a reader.
pub fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
