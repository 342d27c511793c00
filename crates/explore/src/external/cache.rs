//! Cache of results by content: an equal run of the same program is answered from the cache.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use coldplate_base::atomic_file;
use coldplate_base::error::Result;

/// The key of a run: everything its result depends on, in hexadecimal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Key(pub(super) String);

impl Key {
    /// Key of some texts in their order.
    pub(super) fn of<'a>(texts: impl IntoIterator<Item = &'a str>) -> Self {
        let mut hasher = Sha256::new();
        for text in texts {
            hasher.update((text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        }
        Self(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// First part of the key, long enough to tell folders apart.
    pub(super) fn short(&self) -> &str {
        &self.0[..16]
    }
}

/// Content of a file of the cache.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    program: String,
    points: Vec<String>,
    /// Values as text, which comes back bit for bit.
    values: Vec<String>,
}

/// A folder of results.
#[derive(Debug, Clone)]
pub(super) struct Cache {
    pub(super) folder: PathBuf,
}

impl Cache {
    fn file(&self, key: &Key) -> PathBuf {
        self.folder.join(&key.0[..2]).join(&key.0[2..]).with_extension("json")
    }

    /// Values of a run, if they are known; a file that cannot be read counts as unknown.
    pub(super) fn get(&self, key: &Key, count: usize) -> Option<Vec<f64>> {
        let bytes = std::fs::read(self.file(key)).ok()?;
        let kept: Kept = serde_json::from_slice(&bytes).ok()?;
        let values: Option<Vec<f64>> = kept.values.iter().map(|value| value.parse().ok()).collect();
        values.filter(|values| values.len() == count)
    }

    /// Keeps the values of a run.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub(super) fn put(&self, key: &Key, program: &str, points: Vec<String>, values: &[f64]) -> Result<()> {
        let kept = Kept { program: program.into(), points, values: values.iter().map(|v| format!("{v:e}")).collect() };
        let text = serde_json::to_string(&kept).unwrap_or_default();
        atomic_file::write(&self.file(key), text.as_bytes())
    }
}

/// SHA-256 of bytes, in hexadecimal.
pub(super) fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Folder of the cache unless the sweep file states one: beside the folder of the sweep's own results, so that sweeps share it.
pub(super) fn default_folder(out: &Path) -> PathBuf {
    out.parent().unwrap_or(Path::new("")).join("solver-cache")
}
