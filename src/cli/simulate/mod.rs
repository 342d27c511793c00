//! `coldplate simulate`: temperatures over time, through a schedule of conditions.

mod text;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::condition::{ConditionArgs, pair_of};
use super::interrupt;
use super::mesh_options::MeshArgs;
use super::output::{self, Output};
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::numbers::{duration, significant};
use coldplate_base::units::{Dimension, Measurand, express, parse};
use coldplate_describe::machine::{Machine, Sensor};
use coldplate_explore::schedule::{self, Schedule};
use coldplate_explore::simulate::{self, History, SimulatedMachine, Start, Watch};
use coldplate_figures::chart::draw_as;
use coldplate_figures::chart::output::check_name;
use coldplate_jobs::charts::history;
use coldplate_jobs::surrogate_run::SurrogateRun;
use coldplate_jobs::{FileKind, OpenFile, drift_report, open};
use coldplate_solve::meshed::MeshedMachine;
use coldplate_tables::Table;

/// Temperatures over time, through a schedule of conditions
///
/// The schedule is a CSV file with a column `time [s]` (or `min`, `h`) and one for each condition that changes, for
/// example `coolant_flow [L/min]`. Values move in straight lines from row to row; a time in two rows is a step.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file, a reduced model of one that was made with histories, or a surrogate that was fitted with dynamics
    machine: PathBuf,
    /// Schedule: time and conditions, as CSV
    schedule: PathBuf,
    /// Conditions that have no column in the schedule
    #[command(flatten)]
    condition: ConditionArgs,
    /// Begin with the steady state of the first row ("steady"), or with everything at one temperature ("20 degC")
    #[arg(long, value_name = "STATE", default_value = "steady")]
    from: String,
    /// Outputs this far apart, beside those at the schedule's rows (default: about 200, if the schedule has fewer rows)
    #[arg(long, value_name = "TIME")]
    every: Option<String>,
    /// End at this time of the schedule's clock: the last condition is kept up to then, or the rest is cut off
    #[arg(long, value_name = "TIME")]
    until: Option<String>,
    /// Keep each value until the next row instead of moving towards it
    #[arg(long)]
    hold: bool,
    /// Go through the schedule N times
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeat: usize,
    /// Write conditions and readings over time: CSV, or Parquet by the name's ending
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw the readings over time: .svg or .png
    #[arg(long, value_name = "FILE")]
    chart: Option<PathBuf>,
    /// Write how far displacements drift, as tests of machine tools report it (ISO 230-3): one HTML file
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    mesh: MeshArgs,
    /// Error allowed in each time step
    #[arg(long, value_name = "DIFFERENCE", default_value = "0.01 K")]
    tolerance: String,
    /// Say when each sensor stays this near to the steady state of the last condition
    #[arg(long, value_name = "DIFFERENCE", default_value = "0.5 K")]
    within: String,
    /// Say when the place of a sensor first passes a temperature, rising and falling: SENSOR="40 degC"; may be repeated
    #[arg(long, value_name = "SENSOR=TEMPERATURE")]
    passes: Vec<String>,
    /// Keep the state in this file while running, to go on from with --resume
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Least time between checkpoints, in real time; they are written at output times only
    #[arg(long, value_name = "TIME", default_value = "5 s", requires = "checkpoint")]
    checkpoint_every: String,
    /// Go on from the checkpoint, if it is there
    #[arg(long, requires = "checkpoint")]
    resume: bool,
}

/// Most conditions of the schedule that cells are chosen for, a count, if an accuracy is asked for. Chosen: each
/// costs solves on several meshes.
const CHOSEN_AT: usize = 8;

/// Runs the command.
///
/// # Errors
/// Bad input, numerics that failed, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let start = Instant::now();
    if let Some(path) = &args.chart {
        check_name(path)?;
    }
    if let Some(path) = &args.report {
        output::check_page(path)?;
    }
    if let Some(path) = &args.out {
        Table::check_name(path).map_err(|e| e.at_key("--out"))?;
    }
    let mut options = options(args)?;
    let file = open(&args.machine).map_err(|e| e.help("check the path"))?;
    if matches!(file.kind, FileKind::Surrogate | FileKind::ReducedModel) {
        args.mesh.refuse(&file, &[])?;
    }
    if file.kind == FileKind::Surrogate {
        return of_surrogate(&file, args, options, start, out);
    }
    let reduced = if file.kind == FileKind::ReducedModel { Some(file.reduced_model()?) } else { None };
    let machine = match &reduced {
        Some(model) => model.machine.clone(),
        None => file.machine(&args.mesh.sets()?)?,
    };
    let names: Vec<&str> = machine.sensors.iter().map(|s| s.name.as_str()).collect();
    let measurands: Vec<Measurand> = machine.sensors.iter().map(Sensor::measurand).collect();
    if args.report.is_some() {
        drift_report::check(&measurands).map_err(|e| e.in_file(&args.machine))?;
    }
    options.watched = args.passes.iter().map(|text| watch(text, &names, &measurands)).collect::<Result<_>>()?;
    let schedule = Schedule::read(&args.schedule, &machine, &args.condition.values()?, rows(args)?)?;
    notes(&machine, &schedule, out);
    if let Some(model) = &reduced {
        let history = simulate::run_reduced(model, &schedule, &options)?;
        return tell(&SimulatedMachine::from(model), &history, args, start, out);
    }
    if args.resume && options.checkpoint.as_ref().is_some_and(|path| !path.exists()) {
        out.note("note: there is no checkpoint yet; beginning at the beginning");
    }
    if let Some(checkpoint) = &options.checkpoint {
        interrupt::keeps(format!("the last state is in {}; the same command with --resume goes on from there", checkpoint.display()));
    }
    let progress = out.progress();
    let model = MeshedMachine::for_conditions(machine, args.mesh.cells, |_| Ok(schedule.far_apart(CHOSEN_AT)), &progress)?;
    drop(progress);
    let bar = progress_bar(schedule.start(), schedule.end(), out);
    let history = simulate::run(&model, &schedule, &options, &mut |seen| {
        bar.set_position((1e3 * (seen.state.time - schedule.start()) / (schedule.end() - schedule.start())) as u64);
    });
    bar.finish_and_clear();
    let history = history?;
    if let Some(time) = history.resumed_at {
        out.note(&format!("went on from the checkpoint at {}", duration(time)));
    }
    tell(&SimulatedMachine::from(&model), &history, args, start, out)
}

/// A schedule run through a surrogate.
fn of_surrogate(file: &OpenFile, args: &Args, mut options: simulate::SimulateOptions, start: Instant, out: Output) -> Result<u8> {
    let surrogate = file.surrogate()?;
    let mut model = SurrogateRun::new(&surrogate).map_err(|e| e.in_file(&args.machine))?;
    let quantities = model.quantities();
    options.watched = args.passes.iter().map(|text| watch(text, &quantities.sensors, model.subject().measurands)).collect::<Result<_>>()?;
    let (mut table, mut ledger) = Table::read_with_ledger(&args.schedule)?;
    table.read_stamps(&mut ledger, None).map_err(|e| e.in_file(&args.schedule))?;
    let given = args.condition.values()?;
    let is_stated = |name: &str| table.columns.iter().any(|c| c.name == name) || given.iter().any(|(own, _)| own == name);
    let schedule = Schedule::from_table(&table, &ledger, quantities, &given, rows(args)?);
    let schedule = schedule.map_err(|e| model.without_defaults(e, is_stated).in_file(&args.schedule))?;
    let history = simulate::run_stepped(&mut model, &schedule, &options)?;
    tell(&model.subject(), &history, args, start, out)
}

/// Options for the schedule's rows.
fn rows(args: &Args) -> Result<schedule::ScheduleOptions> {
    let until = args.until.as_deref().map(|text| parse(text, Dimension::TIME).map_err(|e| e.at_key("--until"))).transpose()?;
    if args.repeat == 0 {
        return Err(Error::input("the schedule would not be run at all").at_key("--repeat").read(0).help("give 1 or more"));
    }
    Ok(schedule::ScheduleOptions { hold: args.hold, repeat: args.repeat, until })
}

/// Writes, draws and reports a history.
fn tell(model: &SimulatedMachine<'_>, history: &History, args: &Args, start: Instant, out: Output) -> Result<u8> {
    history.notes.iter().for_each(|note| out.note(&format!("warning: {note}")));
    let series = history.table(model)?;
    if let Some(path) = &args.out {
        write_table(path, &series, &args.schedule)?;
        out.note(&format!("wrote {}", path.display()));
    }
    if let Some(path) = &args.chart {
        draw_as(path, &history::figure(model, history, vec![format!("schedule: {}", args.schedule.display())]))?;
        out.note(&format!("wrote {}", path.display()));
    }
    if let Some(path) = &args.report {
        drift_report::report(model, history, &args.schedule.display().to_string())?.write(path)?;
        out.note(&format!("wrote {}", path.display()));
    }
    let seconds = start.elapsed().as_secs_f64();
    out.report(&text::text(model, history, seconds), &history.record(model, seconds));
    Ok(0)
}

fn options(args: &Args) -> Result<simulate::SimulateOptions> {
    let positive = |text: &str, dimension: Dimension, key: &str| {
        let value = parse(text, dimension).map_err(|e| e.at_key(key))?;
        if value > 0.0 { Ok(value) } else { Err(Error::input("this must be more than zero").at_key(key).read(text)) }
    };
    let from = match args.from.trim() {
        "steady" => Start::Steady,
        text => Start::Uniform(parse(text, Dimension::TEMPERATURE).map_err(|e| {
            Error::input(e.what()).at_key("--from").read(text).help("write \"steady\", or a temperature such as \"20 degC\"")
        })?),
    };
    let clock = parse(&args.checkpoint_every, Dimension::TIME).map_err(|e| e.at_key("--checkpoint-every"))?;
    Ok(simulate::SimulateOptions {
        start: from,
        every: args.every.as_deref().map(|text| positive(text, Dimension::TIME, "--every")).transpose()?,
        tolerance: positive(&args.tolerance, Dimension::DIFFERENCE, "--tolerance")?,
        within: positive(&args.within, Dimension::DIFFERENCE, "--within")?,
        checkpoint: args.checkpoint.clone(),
        checkpoint_every: Duration::try_from_secs_f64(clock)
            .map_err(|_| Error::input("this is no time to wait").at_key("--checkpoint-every").read(&args.checkpoint_every))?,
        resume: args.resume,
        ..simulate::SimulateOptions::default()
    })
}

/// `SENSOR=VALUE`
fn watch(text: &str, sensors: &[&str], measurands: &[Measurand]) -> Result<Watch> {
    let (name, value) = pair_of(text, "--passes")?;
    let Some(sensor) = sensors.iter().position(|s| *s == name) else {
        let help = did_you_mean(&name, sensors.iter().copied())
            .map_or_else(|| format!("sensors here: {}", sensors.join(", ")), |near| format!("did you mean '{near}'?"));
        return Err(Error::input(format!("there is no sensor '{name}'")).at_key("--passes").read(text).help(help));
    };
    let own = measurands[sensor];
    Ok(Watch { sensor, value: own.of_si(parse(&value, own.dimension()).map_err(|e| e.at_key("--passes"))?) })
}

/// Notes for the user on the schedule.
fn notes(machine: &Machine, schedule: &Schedule, out: Output) {
    schedule.read.iter().for_each(|sentence| out.note(&format!("note: {sentence}")));
    if !schedule.ignored.is_empty() {
        out.note(&format!("note: these columns are no conditions and are left aside: {}", schedule.ignored.join(", ")));
    }
    for (index, variable) in machine.variables.iter().enumerate() {
        let (low, high) = schedule.range(index);
        if let Some((from, to)) = variable.range.filter(|(from, to)| low < *from || high > *to) {
            let shown = |si: f64| significant(express(si, &variable.unit, variable.dimension).unwrap_or(si), 6);
            out.note(&format!(
                "note: {} = {} to {} {} leaves the range the machine file gives, {} to {}",
                variable.name,
                shown(low),
                shown(high),
                variable.unit,
                shown(from),
                shown(to)
            ));
        }
    }
}

fn progress_bar(start: f64, end: f64, out: Output) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(1000), out.target());
    let template = format!("{{bar:40}} {{percent}} % of {}, {{elapsed}} passed, {{eta}} left", duration(end - start));
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style);
    }
    bar
}

fn write_table(path: &Path, series: &Table, schedule: &Path) -> Result<()> {
    let mut series = series.clone();
    series.provenance.push(("schedule".into(), schedule.display().to_string()));
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) { series.write_parquet(path) } else { series.write_csv(path) }
}
