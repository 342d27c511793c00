//! Parts of a sweep that run by themselves, on this machine or another, each with a journal of its own.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Serialize;

use super::journal::{self, ConditionOutcome, Journal};
use super::runner::{Pieces, run_rows};
use super::{JOURNAL, Plan, SweepOptions, SweepSubject, header};
use coldplate_base::error::{Error, Result};

/// Folder of the parts' journals, in that of the results.
pub(crate) const SHARDS: &str = "shards";
/// Most parts of a sweep, count. Chosen: more than any machine has processors.
const MOST: usize = 100_000;

/// One of N parts of a sweep: every N-th condition, so that all parts take about the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 1.
    pub number: usize,
    /// Number of all parts.
    pub of: usize,
}

impl Shard {
    /// All `of` parts.
    pub fn all(of: usize) -> impl Iterator<Item = Self> {
        (1..=of).map(move |number| Self { number, of })
    }

    /// Conditions of the part, of so many, by their indices in the design.
    pub fn rows(self, conditions: usize) -> impl Iterator<Item = usize> {
        (self.number - 1..conditions).step_by(self.of)
    }

    /// Path of the part's journal, for results in `folder`.
    pub fn journal(self, folder: &Path) -> PathBuf {
        folder.join(SHARDS).join(format!("{}-of-{}.journal", self.number, self.of))
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let parts = text.split_once('/').and_then(|(number, of)| Some(Self { number: number.parse().ok()?, of: of.parse().ok()? }));
        let is_one = |shard: &Self| (1..=shard.of).contains(&shard.number) && shard.of <= MOST;
        parts.filter(is_one).ok_or_else(|| Error::input("a part of a sweep is K/N, the K-th of N").read(text).help("for example 1/8"))
    }
}

/// Result of a part: each field is a key of `coldplate sweep --shard --json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[allow(missing_docs)]
pub struct ShardRecord {
    /// Name of the part, `K/N`.
    pub shard: String,
    /// Conditions of the part.
    pub conditions: usize,
    /// Conditions of the part that its journal or that of the whole sweep held already.
    pub resumed: usize,
    /// Conditions without result.
    pub failed: usize,
    pub journal: String,
    /// Lines of the journal that were damaged.
    pub damaged_lines: Vec<usize>,
}

/// Refuses a design that grows or that a reduced model answers: both depend on all conditions.
///
/// # Errors
/// The design grows, or a reduced model answers it.
pub fn check(plan: &Plan) -> Result<()> {
    if plan.accuracy.is_some() {
        return Err(Error::input("a sweep that a reduced model answers cannot be shared out: the model is made of all its conditions")
            .at_key("accuracy")
            .help("run it on one machine, or solve every condition in full: --full"));
    }
    if plan.growth.is_none() {
        return Ok(());
    }
    Err(Error::input("an adaptive design cannot be shared out: what is added depends on everything solved before")
        .at_key("design.kind")
        .help("run it on one machine, or take a design of a given number of runs"))
}

/// Runs the missing conditions of a part: those that neither its journal nor that of the whole sweep holds.
///
/// # Errors
/// The design grows; a journal cannot be written, is in use, or is that of another sweep; errors of [`super::run`].
pub fn run(
    plan: &Plan,
    subject: &SweepSubject,
    folder: &Path,
    shard: Shard,
    options: SweepOptions<'_>,
    solve: impl Fn(&Plan, usize) -> Result<Vec<f64>> + Sync,
) -> Result<ShardRecord> {
    check(plan)?;
    let header = header(plan, subject);
    let (path, width) = (shard.journal(folder), header.outputs.len());
    std::fs::create_dir_all(folder.join(SHARDS)).map_err(|e| Error::file("make", &folder.join(SHARDS), e).at_key("--out"))?;
    let (whole, _) = journal::held(&folder.join(JOURNAL), &header)?;
    let is_done = |row: &usize| match &whole[*row] {
        Some(ConditionOutcome::Values(_)) => true,
        Some(ConditionOutcome::Failed(_)) => !options.retry_failed,
        None => false,
    };
    let rows: Vec<usize> = shard.rows(plan.conditions.len()).collect();
    let open: Vec<usize> = rows.iter().copied().filter(|row| !is_done(row)).collect();
    let mut journal = Journal::open(&path, &header)?;
    let held = open.iter().filter(|row| journal.outcomes()[**row].is_some()).count();
    run_rows(&open, Pieces { total: rows.len(), name: &format!("conditions of part {shard}") }, width, &mut journal, options, |row| {
        solve(plan, row)
    })?;
    let is_failed =
        |row: &&usize| matches!(journal.outcomes()[**row].as_ref().or(whole[**row].as_ref()), Some(ConditionOutcome::Failed(_)));
    Ok(ShardRecord {
        shard: shard.to_string(),
        conditions: rows.len(),
        resumed: rows.len() - open.len() + held,
        failed: rows.iter().filter(is_failed).count(),
        journal: path.display().to_string(),
        damaged_lines: journal.damaged_lines().to_vec(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_out_every_condition_once() {
        for of in [1, 2, 3, 7, 12] {
            let mut rows: Vec<usize> = Shard::all(of).flat_map(|shard| shard.rows(10)).collect();
            rows.sort_unstable();
            assert_eq!(rows, (0..10).collect::<Vec<_>>(), "{of}");
        }
        assert_eq!("3/8".parse::<Shard>().unwrap(), Shard { number: 3, of: 8 });
        for wrong in ["0/8", "9/8", "3", "3/", "a/b", "1/0", "-1/2", "1/99999999"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
