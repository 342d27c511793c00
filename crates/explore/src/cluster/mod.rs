//! A sweep on a cluster: its parts as an array of jobs, watched from the place that submitted it.
//!
//! No knowledge of the results is held here: the journals state the conditions that are solved. Whatever ends a task (its node,
//! its time, somebody), the parts that lack conditions are submitted again. The watching process may be killed at any time and
//! started anew.

mod slurm;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::sweep::merge::Merged;
use crate::sweep::shards::{self, Shard};
use crate::sweep::sweep_file::Sweep;
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_base::{atomic_file, input};
use slurm::{Seen, Task};

/// Folder of the script, the logs and the record of the running job, in that of the results.
const FOLDER: &str = "slurm";
/// Rounds in a row without a solved condition after which the sweep is given up, count. Chosen.
const MOST_IDLE: usize = 3;

/// Options of a sweep on a cluster.
#[derive(Debug, Clone)]
pub struct ClusterOptions {
    /// Number of parts, and of tasks of the array.
    pub parts: usize,
    /// Options of `sbatch`.
    pub sbatch: Vec<String>,
    /// A line of the shell that runs the part `$SLURM_ARRAY_TASK_ID`.
    pub command: String,
    /// Whether conditions that failed before are run again.
    pub retry_failed: bool,
    /// Pause between two looks at the queue.
    pub poll: Duration,
}

/// Result of the run: each field is a key of `coldplate sweep --slurm --json`.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct ClusterRecord {
    pub parts: usize,
    pub rounds: Vec<JobArray>,
    pub merged: Merged,
}

/// One array of jobs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[allow(missing_docs)]
pub struct JobArray {
    pub job: String,
    /// Parts that were submitted.
    pub tasks: usize,
    /// Tasks that ended while their parts still lacked conditions: count by way of ending.
    pub incomplete: BTreeMap<String, usize>,
    /// Conditions that the round solved.
    pub brought: usize,
    /// Nodes that were excluded because tasks had failed there; left out if there is none.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    pub avoided: BTreeSet<String>,
}

/// Record of the running job, on the disk.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct UnderWay {
    job: String,
    parts: usize,
}

/// The parts whose failed conditions are run again.
enum Retry {
    All,
    Of(BTreeSet<usize>),
}

impl Retry {
    fn none() -> Self {
        Self::Of(BTreeSet::new())
    }

    fn holds(&self, part: usize) -> bool {
        match self {
            Self::All => true,
            Self::Of(parts) => parts.contains(&part),
        }
    }
}

/// Runs every condition on a cluster and merges the journals; the tables are then [`Sweep::tables`]. A job that runs already is
/// watched, not submitted again.
///
/// # Errors
/// The design grows; Slurm refuses the job; three times in a row nothing was solved; a folder cannot be written.
pub fn run(sweep: &Sweep, folder: &Path, options: &ClusterOptions, progress: &dyn Progress) -> Result<ClusterRecord> {
    shards::check(&sweep.plan)?;
    let campaign = Campaign::begin(sweep, folder, options, progress)?;
    campaign.run()
}

struct Campaign<'a> {
    sweep: &'a Sweep,
    folder: &'a Path,
    options: &'a ClusterOptions,
    progress: &'a dyn Progress,
    own: PathBuf,
    /// File that is locked while this process watches.
    _watch: File,
}

impl<'a> Campaign<'a> {
    fn begin(sweep: &'a Sweep, folder: &'a Path, options: &'a ClusterOptions, progress: &'a dyn Progress) -> Result<Self> {
        let own = folder.join(FOLDER);
        std::fs::create_dir_all(&own).map_err(|e| Error::file("make", &own, e).at_key("--out"))?;
        let path = own.join("watch");
        let watch = OpenOptions::new().write(true).create(true).truncate(false).open(&path).map_err(|e| Error::file("open", &path, e))?;
        if matches!(watch.try_lock(), Err(std::fs::TryLockError::WouldBlock)) {
            return Err(Error::input("another process watches over this sweep")
                .in_file(&path)
                .help("wait for it, or choose another --out"));
        }
        Ok(Self { sweep, folder, options, progress, own, _watch: watch })
    }

    fn run(&self) -> Result<ClusterRecord> {
        let (mut rounds, mut idle) = (Vec::new(), 0);
        let mut merged = self.merged()?;
        let mut retry = if self.options.retry_failed { Retry::All } else { Retry::none() };
        let mut avoided = BTreeSet::new();
        loop {
            let under_way = self.under_way()?;
            let parts = under_way.as_ref().map_or(self.options.parts, |found| found.parts);
            let tasks = self.open_parts(&merged, parts, &retry);
            let UnderWay { job, .. } = match under_way {
                Some(found) => found,
                None if tasks.is_empty() => break,
                None => self.submit(&tasks, parts, &retry, &avoided)?,
            };
            let before = self.known(&merged);
            let ended = self.watch(&job, before, parts)?;
            merged = self.merged()?;
            self.forget()?;
            let brought = self.known(&merged).saturating_sub(before);
            let lacking = self.open_parts(&merged, parts, &Retry::none());
            let mut incomplete = BTreeMap::new();
            for task in ended.iter().filter(|task| lacking.contains(&task.number)) {
                *incomplete.entry(task.words()).or_default() += 1;
            }
            for (how, count) in &incomplete {
                self.progress.say(&format!("job {job}: {count} of {} tasks ended before their parts were done: {how}", ended.len()));
            }
            rounds.push(JobArray { job, tasks: tasks.len(), incomplete, brought, avoided: avoided.clone() });
            let more = failed_nodes(&ended, &lacking);
            if let Some(first) = more.iter().find(|node| !avoided.contains(*node)) {
                self.progress.say(&format!("tasks failed on {first}: their open conditions are run on other nodes"));
            }
            retry = Retry::Of(doubtful(&ended, &more));
            avoided.extend(more);
            idle = if brought > 0 || lacking.is_empty() { 0 } else { idle + 1 };
            if idle == MOST_IDLE {
                return Err(self.stuck(&lacking, rounds.last()));
            }
        }
        Ok(ClusterRecord { parts: self.options.parts, rounds, merged })
    }

    /// Conditions of all journals, merged into the sweep's own.
    fn merged(&self) -> Result<Merged> {
        let journals = [self.folder.join(shards::SHARDS)];
        std::fs::create_dir_all(&journals[0]).map_err(|e| Error::file("make", &journals[0], e).at_key("--out"))?;
        self.sweep.merge_any(self.folder, &journals)
    }

    fn known(&self, merged: &Merged) -> usize {
        self.sweep.plan.conditions.len() - merged.missing.len()
    }

    /// Parts with missing conditions and, when failed ones are retried, parts with failed ones.
    fn open_parts(&self, merged: &Merged, parts: usize, retry: &Retry) -> Vec<usize> {
        let part_of = |row: &usize| (row - 1) % parts + 1;
        let failed = merged.failed.iter().map(part_of).filter(|part| retry.holds(*part));
        let mut open: Vec<usize> = merged.missing.iter().map(part_of).chain(failed).collect();
        open.sort_unstable();
        open.dedup();
        open
    }

    fn submit(&self, tasks: &[usize], parts: usize, retry: &Retry, avoided: &BTreeSet<String>) -> Result<UnderWay> {
        let script = self.own.join("part.sh");
        let again = if tasks.iter().any(|part| retry.holds(*part)) { " --retry-failed" } else { "" };
        let shard = format!("--shard \"$SLURM_ARRAY_TASK_ID/{parts}\"");
        let text = format!("#!/bin/sh\nexec {} {shard} --threads \"${{SLURM_CPUS_PER_TASK:-1}}\" --quiet{again}\n", self.options.command);
        atomic_file::write(&script, text.as_bytes())?;
        let away = (!avoided.is_empty()).then(|| format!("--exclude={}", avoided.iter().cloned().collect::<Vec<_>>().join(",")));
        let options: Vec<String> = away.into_iter().chain(self.options.sbatch.iter().cloned()).collect();
        let job = slurm::submit(&script, &self.own.join("%a.log"), tasks, &options)?;
        self.progress.say(&format!("job {job}: {} of {parts} parts", tasks.len()));
        let found = UnderWay { job, parts };
        let json = serde_json::to_string(&found).unwrap_or_default();
        atomic_file::write(&self.own.join("job.json"), json.as_bytes())?;
        Ok(found)
    }

    fn under_way(&self) -> Result<Option<UnderWay>> {
        let path = self.own.join("job.json");
        if !path.exists() {
            return Ok(None);
        }
        let found = serde_json::from_slice(&input::read_back(&path)?).map_err(|e| {
            Error::input(format!("the record of the job cannot be read: {e}")).in_file(&path).help("delete the file once no job of it runs")
        })?;
        Ok(Some(found))
    }

    fn forget(&self) -> Result<()> {
        let path = self.own.join("job.json");
        std::fs::remove_file(&path).map_err(|e| Error::file("remove", &path, e))
    }

    /// Watches until no task is left, and returns how all ended.
    fn watch(&self, job: &str, before: usize, parts: usize) -> Result<Vec<Task>> {
        let total = self.sweep.plan.conditions.len();
        let mut journals = Lines::of(Shard::all(parts).map(|shard| shard.journal(self.folder)));
        let begun = journals.count();
        let mut told = String::new();
        let mut tell = |what: String| {
            if what != told {
                self.progress.at(&what);
                told = what;
            }
        };
        loop {
            self.progress.count((before + journals.count().saturating_sub(begun)).min(total), total, "conditions");
            match slurm::look(job) {
                Seen::Silent(why) => tell(format!("Slurm does not answer: {why}")),
                Seen::Forgotten => return Ok(Vec::new()),
                Seen::Tasks(tasks) if tasks.iter().all(Task::is_over) => {
                    let held: Vec<usize> = tasks.iter().filter(|task| task.is_held()).map(|task| task.number).collect();
                    if !held.is_empty() {
                        slurm::cancel(job, &held);
                    }
                    return Ok(tasks);
                }
                Seen::Tasks(tasks) => {
                    let running = tasks.iter().filter(|task| task.is_running()).count();
                    let over = tasks.iter().filter(|task| task.is_over()).count();
                    let waiting = tasks.len() - running - over;
                    tell(format!("job {job}: {running} tasks run, {waiting} wait, {over} are over"));
                }
            }
            std::thread::sleep(self.options.poll);
        }
    }

    fn stuck(&self, lacking: &[usize], last: Option<&JobArray>) -> Error {
        let how: Vec<&str> = last.iter().flat_map(|round| round.incomplete.keys().map(String::as_str)).collect();
        let log = lacking.first().map(|part| self.own.join(format!("{part}.log")));
        let said = log.as_ref().and_then(|log| {
            let bytes = std::fs::read(log).ok()?;
            let text = String::from_utf8_lossy(&bytes).into_owned();
            text.lines().rev().find(|line| line.contains("error")).map(str::to_string)
        });
        let said = said.map_or_else(String::new, |line| format!("; the log of the first says: {line}"));
        let error = Error::input(format!(
            "{MOST_IDLE} times in a row no task solved anything; {} parts are not done, their tasks ended: {}{said}",
            lacking.len(),
            if how.is_empty() { "their states are unknown".into() } else { how.join(", ") }
        ));
        log.into_iter()
            .fold(error, |error, log| error.in_file(log))
            .help("remove the cause that the log names and start it again: solved conditions are kept")
    }
}

/// Nodes on which tasks failed whose parts lack conditions, such as by a full disk. None if no other node did better.
fn failed_nodes(ended: &[Task], lacking: &[usize]) -> BTreeSet<String> {
    let (bad, good): (Vec<&Task>, Vec<&Task>) =
        ended.iter().filter(|task| !task.node.is_empty()).partition(|task| task.has_failed() && lacking.contains(&task.number));
    let bad: BTreeSet<String> = bad.into_iter().map(|task| task.node.clone()).collect();
    if good.iter().any(|task| !bad.contains(&task.node)) { bad } else { BTreeSet::new() }
}

/// Parts that ran on a node where another task ended with an error: a condition that failed there may have failed of the same
/// cause. A node that is lost does not count, because its results are not recorded.
fn doubtful(ended: &[Task], nodes: &BTreeSet<String>) -> BTreeSet<usize> {
    let with_error: BTreeSet<&String> =
        ended.iter().filter(|task| task.has_exited_with_an_error()).map(|task| &task.node).filter(|node| nodes.contains(*node)).collect();
    ended.iter().filter(|task| with_error.contains(&task.node)).map(|task| task.number).collect()
}

/// Number of conditions that journals hold; a journal is read again only if it has grown.
struct Lines {
    files: Vec<(PathBuf, u64, usize)>,
}

impl Lines {
    fn of(paths: impl Iterator<Item = PathBuf>) -> Self {
        Self { files: paths.map(|path| (path, 0, 0)).collect() }
    }

    fn count(&mut self) -> usize {
        for (path, length, lines) in &mut self.files {
            let now = std::fs::metadata(&*path).map_or(0, |about| about.len());
            if now != *length {
                *length = now;
                let bytes = std::fs::read(&*path).unwrap_or_default();
                *lines = bytes.iter().filter(|b| **b == b'\n').count().saturating_sub(1);
            }
        }
        self.files.iter().map(|(_, _, lines)| lines).sum()
    }
}
