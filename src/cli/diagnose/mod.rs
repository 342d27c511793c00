//! `coldplate diagnose`: errors of the simulation, their causes, and how much better the machine gets without them.

mod plan;
mod text;

use std::path::PathBuf;

use super::condition::pair_of;
use super::measured::{self, DataArgs};
use super::output::{self, Output};
use super::text::table;
use coldplate_base::atomic_file;
use coldplate_base::error::Result;
use coldplate_diagnose::{Problem, planned_conditions};
use coldplate_evidence::command_input;
use coldplate_explore::simulate::Start;
use coldplate_figures::chart::draw_as;
use coldplate_figures::chart::output::check_name;
use coldplate_findings::input::{costs, kind_named, uncertain, user_kinds};
use coldplate_findings::places;
use coldplate_jobs::refit;
use coldplate_solve::study::{StateTables, Study};

/// Errors against measured data, their causes, a better machine
///
/// Errors of the simulation against measured data, their causes, and how much better the machine gets without them.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file
    machine: PathBuf,
    /// Measured data: CSV with test, conditions and sensors (default: the measurements in the machine file)
    data: Option<PathBuf>,
    /// Before there are readings: say which causes these sensors would see, which they could never tell apart, and which sensor more would
    /// help most; in the conditions of DATA, or with each variable at both ends of its range
    #[arg(long, conflicts_with_all = ["out", "report", "chart", "surrogate", "amplitudes"])]
    plan: bool,
    /// A number of the machine file that is itself uncertain, with its standard deviation: KEY=10% or KEY=+-0.1 UNIT; may be repeated
    #[arg(long = "uncertain", value_name = "KEY=DEVIATION")]
    uncertain: Vec<String>,
    /// Causes of your own: a file of [kind.NAME] tables
    #[arg(long, value_name = "FILE")]
    kinds: Option<PathBuf>,
    /// Costs of further tests and sensors, in any unit: a file with [test] and [sensor] tables
    #[arg(long, value_name = "FILE")]
    costs: Option<PathBuf>,
    /// Do not try a kind of cause, for example "radiative link"; may be repeated
    #[arg(long, value_name = "KIND")]
    without: Vec<String>,
    #[command(flatten)]
    readings: DataArgs,
    /// The state logs begin with: "steady", "readings" (each test at the mean of its first readings), "parts" (each part and node
    /// at the mean of those of its own sensors), or a temperature (default: steady or parts, whichever the readings ask for)
    #[arg(long, value_name = "STATE")]
    from: Option<String>,
    /// Write the extended machine here (default: beside the machine file, as NAME.extended.toml); never over a file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a report for readers who were not there: one HTML file
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Draw the gain of every cause, step by step: SVG or PNG by its name
    #[arg(long, value_name = "FILE")]
    chart: Option<PathBuf>,
    /// Fit surrogates of the machine as it is and of the extended one over the ranges of the machine file; write the latter here
    #[arg(long, value_name = "FILE")]
    surrogate: Option<PathBuf>,
    /// Print the amplitude of each cause in every row too, whatever law these follow
    #[arg(long)]
    amplitudes: bool,
    /// Use every reading, faulty ones too (default: faulty readings are named and left out)
    #[arg(long)]
    keep_all: bool,
    /// Use every row of long logs (default: a selection that determines the result as well)
    #[arg(long)]
    every_row: bool,
    /// Change a value of the machine file first
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// About how many cells (default: 3000 or the machine file's own, whichever is less)
    #[arg(long, value_name = "N")]
    cells: Option<usize>,
    /// Solve every steady state by itself (default: tables on a reduced model, and the end result once in full)
    #[arg(long)]
    full: bool,
}

/// Number of cells. Chosen: enough where only differences between machines matter, against time.
const USUAL_CELLS: usize = 3000;

/// Runs the command.
///
/// # Errors
/// Bad input, or numerics that failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let sets = args.set.iter().map(|s| pair_of(s, "--set")).collect::<Result<Vec<_>>>()?;
    let tables = if args.full { StateTables::InFull } else { StateTables::Reduced };
    let study = Study::read(&args.machine, &sets, Some(args.cells.unwrap_or(USUAL_CELLS)))?.with_tables(tables);
    let machine = &study.model.machine;
    let path = command_input::goal(args.out.as_deref(), &args.machine, machine, "extended")?;
    if let Some(report) = &args.report {
        output::check_page(report)?;
    }
    if let Some(chart) = &args.chart {
        check_name(chart).and_then(|()| atomic_file::check(chart)).map_err(|e| e.at_key("--chart"))?;
    }
    if let Some(surrogate) = &args.surrogate {
        command_input::must_be_new(surrogate, "--surrogate")?;
        refit::check(machine).map_err(|e| e.in_file(&args.machine))?;
    }
    let data = match &args.data {
        None if args.plan => planned_conditions(machine).map_err(|e| e.in_file(&args.machine))?,
        table => command_input::data(table.as_deref(), &args.readings.between(), machine)?,
    };
    let uncertainty = measured::uncertainty(args.data.as_deref(), &args.machine, &data, machine, out)?;
    let start = args.from.as_deref().map(command_input::start).transpose()?;
    let mut uncertain = args.uncertain.iter().map(|text| uncertain(text, &study)).collect::<Result<Vec<_>>>()?;
    // A deviation on the command line replaces the one in the file.
    let of_file = study.uncertain()?.into_iter().filter(|own| uncertain.iter().all(|said| said.parameter.name != own.parameter.name));
    uncertain.extend(of_file.collect::<Vec<_>>());
    let user = match &args.kinds {
        Some(path) => user_kinds(path, &study)?,
        None => Vec::new(),
    };
    let without = args.without.iter().map(|kind| kind_named(kind, &study, &data, &user)).collect::<Result<Vec<_>>>()?;
    let mut problem = Problem::new(study, data);
    (problem.uncertainty, problem.uncertain, problem.user) = (uncertainty, uncertain, user);
    problem.without = without;
    problem.start = start.unwrap_or(problem.start);
    if args.plan {
        return plan::run(&problem, out);
    }
    if let Some(path) = &args.costs {
        problem.costs = costs(path)?;
    }
    if start.is_none() {
        problem = problem.begun(&out.progress())?;
        if problem.start == Start::Parts {
            out.note(
                "note: the logs do not begin in the steady state: each part begins at its first readings; --from steady says otherwise",
            );
        }
    }
    if args.keep_all {
        problem.settings.most_wrong = 0.0;
    } else {
        problem = problem.cleared()?;
    }
    // Tests keep their numbers where some of them are held out.
    let mut divided = None;
    if !args.readings.hold_out.is_empty() {
        problem = problem.timed()?;
        let (rest, own) = problem.holding_out(&args.readings.hold_out)?;
        out.note(&format!("note: {}", own.words));
        (problem, divided) = (rest, Some(own));
    }
    if !args.every_row {
        let (rows, readings) = (problem.data.rows.len(), problem.data.count());
        problem = problem.thinned();
        let (looked, compared) = (problem.data.rows.len(), problem.data.count());
        if compared < readings {
            let compared = format!("{compared} of {readings} readings are compared");
            out.note(&format!("note: {looked} of {rows} rows are looked at, {compared}; --every-row takes all"));
        }
    }
    if divided.is_none() {
        problem = problem.timed()?;
    }
    let found = coldplate_findings::examine(&problem, &path, args.surrogate.as_deref(), &out.progress())?;
    // Everything is made before anything is written.
    let report = args.report.as_ref().map(|_| found.report()).transpose()?;
    found.write()?;
    if let (Some(report), Some(path)) = (report, &args.report) {
        report.write(path)?;
        out.note(&format!("wrote {}", path.display()));
    }
    match (&args.chart, found.gains()) {
        (Some(path), Some(figure)) => {
            draw_as(path, &figure)?;
            out.note(&format!("wrote {}", path.display()));
        }
        (Some(path), None) => out.note(&format!("note: {} is not drawn: no cause was added to the machine", path.display())),
        (None, _) => {}
    }
    let held_out = divided.map(|divided| found.held_out(&divided)).transpose()?;
    let machine = &found.problem.study.model.machine;
    let untouched = held_out.as_ref().map_or(String::new(), |own| measured::not_used(own, machine));
    let mut record = found.record();
    record.held_out = held_out.map(|own| own.record(machine));
    let curves = if args.amplitudes { places::text(&found, table) } else { String::new() };
    let failed: String = found.failed.iter().map(|sentence| format!("FAILED: {sentence}\n")).collect();
    out.report(&(text::text(&found) + &curves + &untouched + &failed), &record);
    // The answer stands; a step behind it that broke down is a failure of the numerics all the same.
    Ok(if found.failed.is_empty() { 0 } else { 4 })
}
