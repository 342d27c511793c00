//! Journals of parts of a sweep, merged into one: the tables are then those of a sweep that ran on one machine, byte for byte.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::journal::{self, ConditionOutcome, Journal};
use super::shards::{SHARDS, check};
use super::{JOURNAL, Plan, SweepSubject, header};
use coldplate_base::error::{Error, Result};

/// Ending of the journals that are looked for in a folder.
const ENDING: &str = "journal";

/// Result of a merge: each field is a key of `coldplate sweep --merge --json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[allow(missing_docs)]
pub struct Merged {
    /// Journals that were read.
    pub journals: usize,
    /// Conditions that were taken from the journals.
    pub taken: usize,
    /// Conditions that several journals hold; they agree.
    pub doubles: usize,
    /// Conditions that no journal holds, from 1, in the order of the design.
    pub missing: Vec<usize>,
    /// Conditions that failed, from 1.
    pub failed: Vec<usize>,
    pub damaged: Vec<Damaged>,
}

/// A journal with damaged lines.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[allow(missing_docs)]
pub struct Damaged {
    pub journal: PathBuf,
    pub lines: Vec<usize>,
}

/// Merges the conditions of `journals` (files, or folders of them; the parts' own if none are named) into the journal in
/// `folder`. A result takes the place of a failure.
///
/// # Errors
/// There is no journal; one cannot be read, or is that of another sweep; two hold different results of one condition.
pub fn merge(plan: &Plan, subject: &SweepSubject, folder: &Path, journals: &[PathBuf]) -> Result<Merged> {
    let own = [folder.join(SHARDS)];
    let named = if journals.is_empty() { &own[..] } else { journals };
    if listed(named)?.is_empty() {
        let error = Error::input("there are no journals to merge").in_file(&named[0]);
        return Err(error.help("run the parts first: --shard K/N; or name their journals"));
    }
    merge_any(plan, subject, folder, named)
}

/// Merges journals as [`merge`] does; there may be none yet.
///
/// # Errors
/// Errors of [`merge`].
pub(crate) fn merge_any(plan: &Plan, subject: &SweepSubject, folder: &Path, journals: &[PathBuf]) -> Result<Merged> {
    check(plan)?;
    let header = header(plan, subject);
    let files = listed(journals)?;
    std::fs::create_dir_all(folder).map_err(|e| Error::file("make", folder, e).at_key("--out"))?;
    let path = folder.join(JOURNAL);
    let mut whole = Journal::open(&path, &header)?;
    let mut known: Vec<Option<(ConditionOutcome, &Path)>> =
        whole.outcomes().iter().map(|outcome| outcome.clone().map(|outcome| (outcome, path.as_path()))).collect();
    let mut merged = Merged { journals: files.len(), taken: 0, doubles: 0, missing: Vec::new(), failed: Vec::new(), damaged: Vec::new() };
    if !whole.damaged_lines().is_empty() {
        merged.damaged.push(Damaged { journal: path.clone(), lines: whole.damaged_lines().to_vec() });
    }
    let mut found: Vec<(usize, ConditionOutcome)> = Vec::new();
    for file in &files {
        let (outcomes, lines) = journal::held(file, &header)?;
        if !lines.is_empty() {
            merged.damaged.push(Damaged { journal: file.clone(), lines });
        }
        for (row, outcome) in outcomes.into_iter().enumerate().filter_map(|(row, outcome)| Some((row, outcome?))) {
            match &known[row] {
                Some((ConditionOutcome::Values(_), _)) if matches!(outcome, ConditionOutcome::Failed(_)) => continue,
                Some((ConditionOutcome::Failed(_), _)) if matches!(outcome, ConditionOutcome::Failed(_)) => continue,
                Some((before @ ConditionOutcome::Values(_), other)) => {
                    if !is_same(before, &outcome) {
                        return Err(differing(row, other, file));
                    }
                    merged.doubles += 1;
                    continue;
                }
                Some((ConditionOutcome::Failed(_), _)) | None => {}
            }
            known[row] = Some((outcome.clone(), file));
            found.push((row, outcome));
        }
    }
    merged.taken = found.len();
    merged.missing = known.iter().enumerate().filter(|(_, outcome)| outcome.is_none()).map(|(row, _)| row + 1).collect();
    let is_failed = |outcome: &Option<(ConditionOutcome, &Path)>| matches!(outcome, Some((ConditionOutcome::Failed(_), _)));
    merged.failed = known.iter().enumerate().filter(|(_, outcome)| is_failed(outcome)).map(|(row, _)| row + 1).collect();
    drop(known);
    if !found.is_empty() {
        whole.absorb(found)?;
    }
    Ok(merged)
}

/// The journals among files and folders, in the order of their names.
fn listed(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            if !path.exists() && path.extension().is_some_and(|e| e == ENDING) {
                return Err(Error::input("there is no such journal").in_file(path).help("check the path"));
            }
            files.extend(path.exists().then(|| path.clone()));
            continue;
        }
        let entries = std::fs::read_dir(path).map_err(|e| Error::file("read", path, e))?;
        let mut inside =
            entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>().map_err(|e| Error::file("read", path, e))?;
        inside.retain(|file| file.extension().is_some_and(|e| e == ENDING));
        inside.sort();
        files.extend(inside);
    }
    Ok(files)
}

/// Whether two outcomes agree bit for bit.
fn is_same(a: &ConditionOutcome, b: &ConditionOutcome) -> bool {
    match (a, b) {
        (ConditionOutcome::Values(a), ConditionOutcome::Values(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
        }
        _ => a == b,
    }
}

fn differing(row: usize, first: &Path, second: &Path) -> Error {
    Error::input(format!("condition {} has another result here than in {}", row + 1, first.display()))
        .in_file(second)
        .help("the same condition must give the same result: run it again where it is wrong, and delete that journal")
}

impl Merged {
    /// Checks that no condition is missing.
    ///
    /// # Errors
    /// Conditions are missing; they are named.
    pub fn check(&self, conditions: usize) -> Result<()> {
        if self.missing.is_empty() {
            return Ok(());
        }
        Err(Error::input(format!("{} of {conditions} conditions are in no journal: {}", self.missing.len(), ranges(&self.missing)))
            .help("run their parts again; or `coldplate sweep` without --merge: it solves the missing ones here"))
    }
}

/// Ascending numbers, in few words: `1-4, 7, 9 and 13 more`.
pub fn ranges(numbers: &[usize]) -> String {
    /// Most ranges that are shown, count. Chosen: fits on a line.
    const MOST_SHOWN: usize = 12;
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for number in numbers {
        match runs.last_mut().filter(|run| run.1 + 1 == *number) {
            Some(run) => run.1 = *number,
            None => runs.push((*number, *number)),
        }
    }
    let words: Vec<String> = runs.iter().take(MOST_SHOWN).map(|(a, b)| if a == b { a.to_string() } else { format!("{a}-{b}") }).collect();
    let beyond: usize = runs.iter().skip(MOST_SHOWN).map(|(a, b)| b - a + 1).sum();
    if beyond > 0 { format!("{} and {beyond} more", words.join(", ")) } else { words.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::ranges;

    #[test]
    fn numbers_are_named_in_few_words() {
        assert_eq!(ranges(&[1, 2, 3, 4, 7, 9, 10]), "1-4, 7, 9-10");
        assert_eq!(ranges(&(0..40).map(|i| 2 * i).collect::<Vec<_>>()), "0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22 and 28 more");
    }
}
