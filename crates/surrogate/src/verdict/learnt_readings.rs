//! Readings that a surrogate file has learnt, so that none counts twice.

use std::collections::{BTreeMap, BTreeSet};

use coldplate_runtime::{Reading, Surrogate};
use sha2::{Digest, Sha256};

use crate::fit::file;
use coldplate_base::error::Result;

/// Marks of the readings that a file has learnt, and of those that are being learnt.
///
/// A mark is the beginning of the hash of a reading with its condition, so the order of rows, further columns and the
/// names of tests make no difference. Equal readings of one table are told apart by their number: a machine may show the
/// same value twice.
pub(super) struct LearntReadings {
    before: BTreeSet<[u8; 8]>,
    fresh: Vec<[u8; 8]>,
    seen: BTreeMap<String, usize>,
    /// Readings that were learnt before.
    pub(super) known: usize,
}

impl LearntReadings {
    pub(super) fn of(surrogate: &Surrogate<'_>) -> Self {
        Self { before: surrogate.readings().iter().copied().collect(), fresh: Vec::new(), seen: BTreeMap::new(), known: 0 }
    }

    /// Whether a reading has not been learnt yet; it is marked then.
    pub(super) fn is_new(&mut self, surrogate: &Surrogate<'_>, x: &[f64], reading: &Reading) -> bool {
        // Nine digits: more than instruments have, fewer than conversions of units keep.
        let number = |value: f64| format!("{:.8e}", value + 0.0);
        let variables = surrogate.variables().zip(x).map(|(v, x)| format!("{} {} {}", v.name, number(*x), v.unit));
        let point = surrogate.point(reading.point).map(|p| format!("{} {} {}", p.name, number(reading.value), p.unit));
        let text = variables.chain(point).collect::<Vec<_>>().join("\n");
        let times = self.seen.entry(text.clone()).or_default();
        *times += 1;
        let hash = Sha256::digest(format!("{text}\n{times}"));
        let mut mark = [0; 8];
        mark.copy_from_slice(&hash[..8]);
        if self.before.contains(&mark) {
            self.known += 1;
            return false;
        }
        self.fresh.push(mark);
        true
    }

    /// The file with all marks.
    ///
    /// # Errors
    /// Errors of [`file::decode`] and [`file::encode`].
    pub(super) fn written_into(&self, bytes: &[u8]) -> Result<Vec<u8>> {
        let mut surrogate = file::decode(bytes)?;
        surrogate.readings.extend(&self.fresh);
        file::encode(&surrogate)
    }
}
