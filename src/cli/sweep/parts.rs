//! Parts of a sweep: one run, all named, all brought together.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::{Cluster, SweepArgs, notes, told};
use crate::cli::output::Output;
use coldplate_base::error::Result;
use coldplate_explore::cluster::{self, ClusterOptions, ClusterRecord};
use coldplate_explore::sweep::merge::{Merged, ranges};
use coldplate_explore::sweep::record::SweepRecord;
use coldplate_explore::sweep::shards::{self, Shard};
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{SweepDefinition, SweepOptions};

/// Arguments that the command of a part repeats from the one that was typed.
pub(crate) struct Typed<'a> {
    pub sweep: &'a Path,
    pub asked: &'a SweepArgs,
}

/// Runs one part.
pub(super) fn run(sweep: &Sweep, shard: Shard, folder: &Path, options: SweepOptions<'_>, out: Output) -> Result<u8> {
    let record = sweep.run_shard(folder, shard, options)?;
    for line in &record.damaged_lines {
        out.note(&format!("note: line {line} of the journal was damaged; its condition was run again"));
    }
    let text = format!(
        "part {}: {} conditions, {} of them held already, {} failed; wrote {}\n",
        record.shard, record.conditions, record.resumed, record.failed, record.journal
    );
    out.report(&text, &record);
    Ok(0)
}

/// Prints the command of every part.
pub(super) fn list(typed: &Typed<'_>, retry_failed: bool, count: usize, out: Output) -> Result<u8> {
    // Without the mesh, which takes its time.
    let mut definition = SweepDefinition::read(typed.sweep)?;
    if typed.asked.full {
        definition.accuracy = None;
    }
    shards::check(&definition.plan(&definition.scope(&typed.asked.sets()?)?.variables)?)?;
    let command = |shard: Shard| {
        let again = retry_failed.then(|| "--retry-failed".to_string());
        shell(
            &[arguments(typed, typed.asked.out.as_deref()), again.into_iter().chain(["--shard".into(), shard.to_string()]).collect()]
                .concat(),
        )
    };
    let commands: Vec<String> = Shard::all(count).map(command).collect();
    let text: String = commands.iter().map(|line| format!("{line}\n")).collect();
    out.verbatim(&text, &Commands { commands });
    Ok(0)
}

#[derive(Serialize)]
struct Commands {
    commands: Vec<String>,
}

/// The command of a part but for its number, with this program as it was called, and a folder for the results.
fn arguments(typed: &Typed<'_>, out: Option<&Path>) -> Vec<String> {
    let path = |path: &Path| path.display().to_string();
    let program = std::env::args().next().unwrap_or_else(|| "coldplate".into());
    let mut words = vec![program, "sweep".into(), path(typed.sweep)];
    words.extend(out.iter().flat_map(|out| ["--out".into(), path(out)]));
    words.extend(typed.asked.cells.iter().flat_map(|cells| ["--cells".into(), cells.to_string()]));
    words.extend(typed.asked.full.then(|| "--full".to_string()));
    words.extend(typed.asked.set.iter().flat_map(|set| ["--set".into(), set.clone()]));
    words
}

/// Words as one line of a shell.
fn shell(words: &[String]) -> String {
    let is_plain = |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || "-_./=:,+".contains(c));
    let quoted = |word: &String| if is_plain(word) { word.clone() } else { format!("'{}'", word.replace('\'', "'\\''")) };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

/// Time between two looks at the queue and the journals. Chosen: late results against load on the cluster.
const POLL: Duration = Duration::from_secs(2);
/// Further time for each part. Chosen: a thousand parts are looked at every twelve seconds.
const POLL_PER_PART: Duration = Duration::from_millis(10);

/// Number of conditions for each task, unless the user gives a number of tasks. Chosen: a task takes longer than its
/// start.
const CONDITIONS_PER_TASK: usize = 10;
/// Most tasks, unless the user gives a number: Slurm takes arrays up to 1001 by default.
const MOST_TASKS: usize = 1000;

/// Runs the parts on a cluster if that is asked for, and brings their journals together in the one of the sweep.
///
/// # Errors
/// Errors of [`cluster::run`].
pub(crate) fn on_slurm(
    sweep: &Sweep,
    typed: &Typed<'_>,
    cluster: &Cluster,
    folder: &Path,
    retry_failed: bool,
    out: Output,
) -> Result<Option<ClusterRecord>> {
    let Some(asked) = cluster.slurm else { return Ok(None) };
    let parts =
        asked.map_or_else(|| sweep.plan.conditions.len().div_ceil(CONDITIONS_PER_TASK).clamp(1, MOST_TASKS), |parts| parts as usize);
    let options = ClusterOptions {
        parts,
        sbatch: cluster.sbatch.clone(),
        command: shell(&arguments(typed, Some(folder))),
        retry_failed,
        poll: POLL + POLL_PER_PART * u32::try_from(parts).unwrap_or(u32::MAX),
    };
    cluster::run(sweep, folder, &options, &out.progress()).map(Some)
}

/// Writes the tables of a sweep that ran on a cluster, and reports it.
pub(super) fn told_of_slurm(sweep: &Sweep, folder: &Path, slurm: ClusterRecord, start: Instant, out: Output) -> Result<u8> {
    let swept = sweep.tables(folder)?;
    notes(&swept, out);
    let (told, record) = told(sweep, &swept, None, start);
    let rounds: String = (slurm.rounds.iter())
        .map(|round| {
            let ends: String = round.incomplete.iter().map(|(how, count)| format!(", {count} ended early: {how}")).collect();
            format!("job {}: {} parts, {} conditions{ends}\n", round.job, round.tasks, round.brought)
        })
        .collect();
    out.report(&format!("{rounds}{told}"), &WithCluster { record, slurm });
    Ok(0)
}

/// Record of a sweep that ran on a cluster, with the jobs.
#[derive(Serialize)]
struct WithCluster {
    #[serde(flatten)]
    record: SweepRecord,
    slurm: ClusterRecord,
}

/// Brings the journals of the parts together and writes the tables.
pub(super) fn merge(sweep: &Sweep, folder: &Path, journals: &[PathBuf], out: Output) -> Result<u8> {
    let start = Instant::now();
    let merged = sweep.merge(folder, journals)?;
    for damaged in &merged.damaged {
        let lines = ranges(&damaged.lines);
        out.note(&format!("note: damaged lines of {} do not count: {lines}", damaged.journal.display()));
    }
    merged.check(sweep.plan.conditions.len())?;
    let swept = sweep.tables(folder)?;
    notes(&swept, out);
    let (told, record) = told(sweep, &swept, None, start);
    let text = format!("{} journals: {} conditions taken, {} held twice\n{told}", merged.journals, merged.taken, merged.doubles);
    out.report(&text, &WithMerged { record, merged });
    Ok(0)
}

/// Record of a sweep brought together from journals.
#[derive(Serialize)]
struct WithMerged {
    #[serde(flatten)]
    record: SweepRecord,
    merged: Merged,
}
