//! Parts of a sweep: one run, all named, all brought together.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::{Args, notes, told};
use crate::cli::output::Output;
use crate::error::Result;
use crate::explore::cluster::{self, ClusterOptions, ClusterRecord};
use crate::explore::sweep::bridge::Sweep;
use crate::explore::sweep::merge::{Merged, ranges};
use crate::explore::sweep::record::SweepRecord;
use crate::explore::sweep::shards::{self, Shard};
use crate::explore::sweep::{Definition, SweepOptions};

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
pub(super) fn list(args: &Args, sets: &[(String, String)], count: usize, out: Output) -> Result<u8> {
    // Without the mesh, which takes its time.
    let mut definition = Definition::read(&args.sweep)?;
    if args.full {
        definition.accuracy = None;
    }
    shards::check(&definition.plan(&definition.scope(sets)?.variables)?)?;
    let command = |shard: Shard| {
        let again = args.retry_failed.then(|| "--retry-failed".to_string());
        shell(&[arguments(args, args.out.as_deref()), again.into_iter().chain(["--shard".into(), shard.to_string()]).collect()].concat())
    };
    let commands: Vec<String> = Shard::all(count).map(command).collect();
    let text: String = commands.iter().map(|line| format!("{line}\n")).collect();
    out.report(&text, &Commands { commands });
    Ok(0)
}

#[derive(Serialize)]
struct Commands {
    commands: Vec<String>,
}

/// The command of a part but for its number, with this program as it was called, and a folder for the results.
fn arguments(args: &Args, out: Option<&Path>) -> Vec<String> {
    let path = |path: &Path| path.display().to_string();
    let program = std::env::args().next().unwrap_or_else(|| "coldplate".into());
    let mut words = vec![program, "sweep".into(), path(&args.sweep)];
    words.extend(out.iter().flat_map(|out| ["--out".into(), path(out)]));
    words.extend(args.cells.iter().flat_map(|cells| ["--cells".into(), cells.to_string()]));
    words.extend(args.full.then(|| "--full".to_string()));
    words.extend(args.set.iter().flat_map(|set| ["--set".into(), set.clone()]));
    words
}

/// Words as one line of a shell.
fn shell(words: &[String]) -> String {
    let is_plain = |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || "-_./=:,+".contains(c));
    let quoted = |word: &String| if is_plain(word) { word.clone() } else { format!("'{}'", word.replace('\'', "'\\''")) };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

/// Between two looks at the queue and the journals, and longer for each part: a thousand are looked at every twelve seconds.
const POLL: Duration = Duration::from_secs(2);
const POLL_PER_PART: Duration = Duration::from_millis(10);

/// Runs the parts on a cluster and writes the tables.
pub(super) fn on_slurm(sweep: &Sweep, args: &Args, parts: usize, folder: &Path, out: Output) -> Result<u8> {
    let start = Instant::now();
    let options = ClusterOptions {
        parts,
        sbatch: args.sbatch.clone(),
        command: shell(&arguments(args, Some(folder))),
        retry_failed: args.retry_failed,
        poll: POLL + POLL_PER_PART * u32::try_from(parts).unwrap_or(u32::MAX),
    };
    let slurm = cluster::run(sweep, folder, &options, &out.progress())?;
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

/// What was run, and by which jobs.
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

/// What was run, and what it was brought together from.
#[derive(Serialize)]
struct WithMerged {
    #[serde(flatten)]
    record: SweepRecord,
    merged: Merged,
}
