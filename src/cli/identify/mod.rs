//! `coldplate identify`: parameters of a machine file from measured data.

mod scan;
mod show;

use std::path::PathBuf;
use std::time::Instant;

use super::interrupt;
use super::measured::{self, DataArgs};
use super::mesh_options::MeshArgs;
use super::output::Output;
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_evidence::command_input;
use coldplate_evidence::identify::{self, Advice, Estimate, Free, IdentifyOptions, IdentifyProblem, ParameterProfile};
use coldplate_evidence::measurement::DividedData;
use coldplate_evidence::record::HeldOut;
use coldplate_explore::stop;
use coldplate_solve::study::{StateTables, Study};
use show::IdentifyResults;

/// Parameters of a machine file from measured data
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file
    machine: PathBuf,
    /// Measured data: CSV with test, conditions and sensors (default: the measurements in the machine file)
    data: Option<PathBuf>,
    /// A number to find, by its dotted key; bounds and prior may follow: KEY=LOW..HIGH, VALUE +- DEVIATION; KEY@TEST holds in one
    /// test, KEY@* has a value in each; may be repeated
    #[arg(long = "free", value_name = "KEY")]
    free: Vec<String>,
    /// Find them from this test only and predict the others untouched; may be repeated (default: all tests)
    #[arg(long = "use", value_name = "TEST", conflicts_with = "hold_out")]
    use_tests: Vec<String>,
    #[command(flatten)]
    readings: DataArgs,
    /// Leave out a sensor; may be repeated
    #[arg(long = "without", value_name = "SENSOR")]
    without: Vec<String>,
    /// Instead of a search, try every pair over a grid: KEY=LOW..HIGH/STEP, twice
    #[arg(long = "scan", value_name = "KEY=LOW..HIGH/STEP")]
    scan: Vec<String>,
    /// Draw the scan: .svg or .png
    #[arg(long, value_name = "FILE")]
    chart: Option<PathBuf>,
    /// Starting points of the search
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    starts: u16,
    /// Leave out profile likelihoods and advice on further tests
    #[arg(long)]
    brief: bool,
    /// The state logs begin with: "steady", "readings" (each test at the mean of its first readings), "parts" (each part and node
    /// at the mean of those of its own sensors), or a temperature
    #[arg(long, value_name = "STATE", default_value = "steady")]
    from: String,
    /// Write the identified machine here; never over a file (default: it is not written)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Use every reading, faulty ones too (default: faulty readings are named and left out)
    #[arg(long)]
    keep_all: bool,
    /// Use every reading of long logs (default: a selection that determines the result as well)
    #[arg(long)]
    every_row: bool,
    #[command(flatten)]
    mesh: MeshArgs,
    /// Solve every steady state by itself (default: tables on a reduced model, and the end result once in full)
    #[arg(long)]
    full: bool,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or numerics that failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let clock = Instant::now();
    let sets = args.mesh.sets()?;
    let tables = if args.full { StateTables::InFull } else { StateTables::Reduced };
    let study = Study::read(&args.machine, &sets, args.mesh.cells)?.with_tables(tables);
    let machine = &study.model.machine;
    let mut all = command_input::data(args.data.as_deref(), &args.readings.between(), machine)?;
    command_input::drop_sensors(&mut all, &args.without)?;
    let uncertainty = measured::uncertainty(args.data.as_deref(), &args.machine, &all, machine, out)?;
    let start = command_input::start(&args.from)?;
    let faults = {
        let progress = out.progress();
        progress.at("faulty readings");
        command_input::clear(&mut all, &study, &uncertainty, start, args.keep_all)?
    };
    let divided = match args.use_tests.is_empty() {
        true => args.readings.divided(&all, out)?,
        false => Some(DividedData::using(&all, &args.use_tests)?).filter(|divided| divided.data().count() > 0),
    };
    let data = divided.as_ref().map_or(all, |divided| divided.fitted.clone());
    if args.free.is_empty() && args.scan.is_empty() {
        let usual: Vec<String> = study.usual_parameters().iter().filter(|p| p.variable().is_none()).map(|p| p.name.clone()).collect();
        return Err(Error::input("no number to find is named").at_key("--free").help(format!(
            "name numbers of the machine file, for example --free \"{}\"; often: {}",
            usual.first().map_or("contact.NAME.conductance", String::as_str),
            usual.join(", ")
        )));
    }
    let free = args.free.iter().map(|text| Free::each(text, &study, &data)).collect::<Result<Vec<_>>>()?.concat();
    let path = args.out.as_deref().map(|path| command_input::goal(Some(path), &args.machine, machine, "identified")).transpose()?;
    let mut problem = IdentifyProblem { study, data, uncertainty, free, start };
    if !args.every_row {
        let before = problem.data.count();
        problem = problem.thinned();
        if problem.data.count() < before {
            out.note(&format!("note: thinned to {} of {before} readings; --every-row takes all", problem.data.count()));
        }
    }
    if !args.scan.is_empty() {
        return scan::run(args, &problem, out);
    }
    // From here on a signal ends the search, and the answer says how far it came.
    interrupt::leave();
    stop::listen();
    let progress = out.progress();
    let options = IdentifyOptions { starts: args.starts.into(), ..IdentifyOptions::default() };
    let estimate = identify::identify_and_learn(&problem, &options, &progress)?;
    let (profiles, advice) = if args.brief { (Vec::new(), Vec::new()) } else { further(&problem, &estimate, out, &progress)? };
    let held_out = divided.map(|divided| HeldOut::identified(&divided, &problem, &estimate)).transpose()?;
    if let Some(path) = &path {
        let text = identify::write_machine(&problem, &estimate, &problem.data.tests())?;
        atomic_file::write(path, text.as_bytes())?;
    }
    drop(progress);
    let found = IdentifyResults {
        problem: &problem,
        estimate: &estimate,
        profiles: &profiles,
        advice: &advice,
        held_out,
        faults: &faults,
        path: path.as_deref(),
        seconds: clock.elapsed().as_secs_f64(),
    };
    out.report(&found.text(), &found.record());
    Ok(0)
}

/// Profiles of the parameters found, and advice on further tests. Both are left out, with a word, once the process is told to
/// stop: the estimate stands.
fn further(
    problem: &IdentifyProblem,
    estimate: &Estimate,
    out: Output,
    progress: &dyn Progress,
) -> Result<(Vec<ParameterProfile>, Vec<Advice>)> {
    progress.say("profile likelihoods, further tests");
    let mut profiles = Vec::new();
    for k in (0..problem.free.len()).filter(|k| !estimate.kept[*k]) {
        let profile = identify::profile_heard(problem, estimate, k, progress);
        if stop::is_asked() {
            break;
        }
        profiles.push(profile?);
    }
    if stop::is_asked() {
        out.note("stopped by a signal: the values found are kept, further profiles and the advice on tests are left out");
        return Ok((profiles, Vec::new()));
    }
    progress.at("further tests");
    let sensors: Vec<usize> = (0..problem.study.model.machine.sensors.len()).collect();
    Ok((profiles, identify::next_tests(problem, estimate, &sensors)?))
}
