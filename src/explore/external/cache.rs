//! Results by content: whoever asks the same of the same program gets what it answered.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::foundation::atomic_file;

/// The key of a run: everything its result depends on, in hexadecimal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Key(pub(super) String);

impl Key {
    /// The key of texts in an order.
    pub(super) fn of<'a>(texts: impl IntoIterator<Item = &'a str>) -> Self {
        let mut hasher = Sha256::new();
        for text in texts {
            hasher.update((text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        }
        Self(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// Enough of it to tell folders apart.
    pub(super) fn short(&self) -> &str {
        &self.0[..16]
    }
}

/// What is kept of a run.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    program: String,
    points: Vec<String>,
    /// As text, which comes back bit for bit.
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

    /// The values of a run, where they are known; what cannot be read is not.
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

/// Where results are kept unless the sweep file says so: beside the folder of the sweep's own results, so that sweeps share them.
pub(super) fn default_folder(out: &Path) -> PathBuf {
    out.parent().unwrap_or(Path::new("")).join("solver-cache")
}
