//! Writes a file anew with some values changed: comments stay, and a comment at the top says where the new values come
//! from.

use std::path::Path;

use super::{Document, Leaf, edited};
use crate::error::{Error, Result};
use crate::input;

/// Keys of a file with their values, TOML.
type Sets = Vec<(String, String)>;

impl Document {
    /// The text of the file with `sets` (key, TOML value) applied and `remarks` as comments at the top, one line each.
    /// Changes made by `--set` before are included and listed among the comments.
    ///
    /// # Errors
    /// The file cannot be read again, or the changed text does not contain exactly the values of this document and of
    /// `sets`.
    pub fn rewritten(&self, sets: &[(String, String)], remarks: &[String]) -> Result<String> {
        let path = self.file();
        let text = input::text(path)?;
        let (beforehand, words) = self.changed_beforehand(&text, path)?;
        let sets: Sets =
            beforehand.into_iter().filter(|(key, _)| sets.iter().all(|(other, _)| other != key)).chain(sets.iter().cloned()).collect();
        let head = [format!("of the file {}, SHA-256 {}", name_of(path), &self.hash()[..16])];
        let comment: String = remarks.iter().chain(&head).chain(&words).flat_map(|r| r.lines()).map(|line| format!("# {line}\n")).collect();
        let text = format!("{comment}\n{}", edited(&text, path, &sets)?);
        // Check: the written text must contain the values of this document and of `sets`.
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

    /// Values of this document that differ from the text of the file: keys with values, and one sentence for each.
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

/// Last component of a path, as text for a reader.
pub fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
