//! `coldplate sweep`: every condition of a sweep file.

pub(super) mod parts;

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::condition::pair_of;
use super::interrupt;
use super::output::Output;
use coldplate_base::error::{Error, Result};
use coldplate_explore::sweep::record::SweepRecord;
use coldplate_explore::sweep::shards::Shard;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{SweepOptions, Swept};
use coldplate_jobs::adaptive::{self, Adaptation, FinishedSweep};
use coldplate_jobs::designs;

/// Design of experiments: the conditions of a sweep file
///
/// Every condition of the file, or as many as its accuracy needs; goes on from the conditions that are solved already.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, disable_help_subcommand = true)]
#[command(subcommand_value_name = "merge", subcommand_help_heading = "Parts")]
pub struct Args {
    #[command(subcommand)]
    step: Option<Step>,
    /// Sweep file
    #[arg(required = true)]
    sweep: Option<PathBuf>,
    #[command(flatten)]
    asked: SweepArgs,
    /// Run conditions again that failed before
    #[arg(long)]
    retry_failed: bool,
    /// Run the K-th of N parts alone, into a journal of its own
    #[arg(long, value_name = "K/N", conflicts_with_all = ["shards", "merge", "slurm"])]
    shard: Option<Shard>,
    /// Print the commands of N parts, one a line, for whatever runs commands
    #[arg(long, value_name = "N", conflicts_with_all = ["merge", "slurm"], value_parser = clap::value_parser!(u32).range(1..=100_000))]
    shards: Option<u32>,
    /// Bring the journals of the parts together and write the tables; others than those in DIR/shards may be named
    #[arg(long, value_name = "JOURNAL|DIR", num_args = 0.., conflicts_with_all = ["retry_failed", "slurm"])]
    merge: Option<Vec<PathBuf>>,
    #[command(flatten)]
    cluster: Cluster,
}

/// Values and results of a sweep.
#[derive(Debug, clap::Args)]
pub(super) struct SweepArgs {
    /// Folder for the results (default: out/NAME, after the sweep file)
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    out: Option<PathBuf>,
    /// About how many cells (default: the sweep file's, or else the machine file's own)
    #[arg(long, value_name = "N", help_heading = "Machine")]
    cells: Option<usize>,
    /// Change a value of the machine file, for example contact.motor.conductance="560 W/(m2 K)"
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Machine")]
    set: Vec<String>,
    /// Every condition solved in full, whatever accuracy the sweep file asks for
    #[arg(long, help_heading = "Machine")]
    full: bool,
}

/// How a sweep is run on a cluster.
#[derive(Debug, clap::Args)]
pub(super) struct Cluster {
    /// Run as N tasks of an array of jobs on a cluster with Slurm, watch over them, and bring the results together (default: one for
    /// ten conditions, 1000 at most)
    #[arg(long, value_name = "N", num_args = 0..=1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    slurm: Option<Option<u32>>,
    /// Option of sbatch, for example --sbatch=--time=4:00:00
    #[arg(long, value_name = "OPTION", requires = "slurm", allow_hyphen_values = true)]
    sbatch: Vec<String>,
}

/// Subcommands in place of the sweep file.
#[derive(Debug, clap::Subcommand)]
enum Step {
    /// Bring the journals of the parts together and write the tables, as --merge does
    Merge(Merge),
}

/// Bring the journals of the parts together and write the tables, as --merge does
#[derive(Debug, clap::Args)]
struct Merge {
    /// Sweep file
    sweep: PathBuf,
    /// Journals or folders of them (default: those in DIR/shards)
    #[arg(value_name = "JOURNAL|DIR")]
    journals: Vec<PathBuf>,
    #[command(flatten)]
    asked: SweepArgs,
}

impl SweepArgs {
    /// The folder for the results of a sweep file: the named one, or `out/NAME`.
    pub(super) fn folder(&self, sweep: &Path) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(sweep.file_stem().unwrap_or("sweep".as_ref())))
    }

    /// Changed keys and their values.
    ///
    /// # Errors
    /// A pair without `=`.
    fn sets(&self) -> Result<Vec<(String, String)>> {
        self.set.iter().map(|s| pair_of(s, "--set")).collect()
    }

    /// The sweep of a file, with values changed and, where asked for, every condition to be solved in full.
    ///
    /// # Errors
    /// The file cannot be read or is wrong; a change is none.
    pub(super) fn open(&self, sweep: &Path, out: Output) -> Result<Sweep> {
        let mut sweep = Sweep::open_heard(sweep, self.cells, &self.sets()?, &out.progress())?;
        if self.full {
            sweep.solve_in_full();
        }
        Ok(sweep)
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, a folder that cannot be written, or every condition failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let start = Instant::now();
    if let Some(Step::Merge(merge)) = &args.step {
        let sweep = merge.asked.open(&merge.sweep, out)?;
        return parts::merge(&sweep, &merge.asked.folder(&merge.sweep), &merge.journals, out);
    }
    let file = args.sweep.as_deref().ok_or_else(|| Error::input("no sweep file is named").help("coldplate sweep SWEEP.toml"))?;
    let typed = parts::Typed { sweep: file, asked: &args.asked };
    if let Some(count) = args.shards {
        return parts::list(&typed, args.retry_failed, count as usize, out);
    }
    let sweep = args.asked.open(file, out)?;
    if let Err(error) = designs::rehearse(&sweep) {
        out.note(&format!("warning: no surrogate can be fitted to this sweep: {}", error.what()));
    }
    let folder = args.asked.folder(file);
    keeps(&sweep, &folder);
    let progress = out.progress();
    let options = SweepOptions { threads: None, progress: Some(&progress), retry_failed: args.retry_failed };
    if let Some(shard) = args.shard {
        return parts::run(&sweep, shard, &folder, options, out);
    }
    if let Some(record) = parts::on_slurm(&sweep, &typed, &args.cluster, &folder, args.retry_failed, out)? {
        return parts::told_of_slurm(&sweep, &folder, record, start, out);
    }
    if let Some(journals) = &args.merge {
        return parts::merge(&sweep, &folder, journals, out);
    }
    let FinishedSweep { swept, adaptation, .. } = adaptive::run(&sweep, &folder, options, &progress)?;
    notes(&swept, out);
    adaptation.iter().for_each(|found| warn_of(found, out));
    let (text, record) = told(&sweep, &swept, adaptation.as_ref(), start);
    out.report(&text, &WithRounds { record, adaptive: adaptation });
    Ok(0)
}

/// States what is kept of a sweep if it ends early. Other programs that solve it hear signals by themselves.
pub(super) fn keeps(sweep: &Sweep, folder: &Path) {
    match sweep.program() {
        Some(_) => interrupt::leave(),
        None => {
            let folder = folder.display();
            interrupt::keeps(format!("every finished condition is in the journal in {folder}; the same command goes on from there"));
        }
    }
}

/// Report of the sweep, as text and as a record.
fn told(sweep: &Sweep, swept: &Swept, adaptation: Option<&Adaptation>, start: Instant) -> (String, SweepRecord) {
    let total = swept.plan.conditions.len();
    let record = swept.record(sweep, start.elapsed().as_secs_f64());
    let mut text = format!("{}\n\n", sweep.plan.name);
    for group in &swept.plan.groups {
        text += &format!("{}: {}\n", group.name, group.description);
    }
    text += &format!(
        "\n{total} conditions {}: {} solved now, {} taken from the journal, {} failed, {:.1} s\n",
        sweep.solver_in_words(),
        total - swept.resumed.min(total),
        swept.resumed,
        swept.failures.len(),
        record.seconds
    );
    text += &swept.answered.as_ref().map_or_else(String::new, |answered| format!("{}\n", answered.sentence()));
    text += &adaptation.map_or_else(String::new, |found| format!("\n{}", rounds(found)));
    for file in &record.files {
        text += &format!("wrote {file}\n");
    }
    (text, record)
}

/// Record of the sweep, and of its rounds if it had an accuracy.
#[derive(serde::Serialize)]
struct WithRounds {
    #[serde(flatten)]
    record: SweepRecord,
    #[serde(skip_serializing_if = "Option::is_none")]
    adaptive: Option<Adaptation>,
}

/// The rounds of an adaptive sweep, a line each, and the result.
fn rounds(found: &Adaptation) -> String {
    let lines: String = found.rounds.iter().map(|round| format!("{}\n", round.line())).collect();
    format!("{lines}{}\n\n", found.sentence())
}

/// Says where the accuracy was not reached.
pub fn warn_of(found: &Adaptation, out: Output) {
    if !found.reached {
        out.note(&format!("warning: {}", found.sentence()));
    }
}

/// Notes for the user beside the result.
pub fn notes(swept: &Swept, out: Output) {
    for line in &swept.damaged_lines {
        out.note(&format!("note: line {line} of the journal was damaged; its condition was run again"));
    }
    swept.notes.iter().for_each(|note| out.note(&format!("warning: {note}")));
    for failure in swept.failures.iter().take(3) {
        out.note(&format!("warning: condition {} of '{}' failed: {}", failure.row + 1, failure.group, failure.reason));
    }
    if swept.failures.len() > 3 {
        out.note(&format!("warning: {} more conditions failed, see failures.csv", swept.failures.len() - 3));
    }
}
