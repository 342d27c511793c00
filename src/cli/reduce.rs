//! `coldplate reduce`: a reduced model of a machine, with a bound on every reading.

use std::path::PathBuf;

use super::condition::pair_of;
use super::output::Output;
use coldplate_base::atomic_file;
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::progress::Progress;
use coldplate_base::units::Measurand;
use coldplate_base::units::{self, Dimension};
use coldplate_describe::machine::Machine;
use coldplate_jobs::reduced::{MadeRecord, ranges};
use coldplate_reduce::{Made, ReduceSettings, ReducedModel, reduce};
use coldplate_solve::study::Study;

/// A reduced model: any condition in milliseconds, with a bound
///
/// Any condition of the ranges is then solved in milliseconds, with a bound on every reading.
#[derive(Debug, clap::Args)]
#[command(after_help = "`coldplate solve MODEL.cpr` answers from it.")]
pub struct Args {
    /// Machine file
    machine: PathBuf,
    /// File to write (default: the machine file's name with .cpr)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Variables that vary, with commas, or all; the others keep their defaults (default: the four of every machine)
    #[arg(long, value_name = "NAMES")]
    vary: Option<String>,
    /// Range of a variable, for example coolant_flow="2 L/min .. 18 L/min" (default: the machine file's)
    #[arg(long = "range", value_name = "NAME=LOW .. HIGH")]
    range: Vec<String>,
    /// Let films, heats, emissivities and contacts vary too, as far as the machine file leaves them open
    #[arg(long)]
    uncertain: bool,
    /// Largest bound wanted on any reading
    #[arg(long, value_name = "KELVIN", default_value = "0.001 K", allow_hyphen_values = true)]
    accuracy: String,
    /// Most conditions to solve in full
    #[arg(long, value_name = "N", default_value_t = 400)]
    max_runs: usize,
    /// Follow the machine in time too (`coldplate simulate MODEL.cpr`): so many random histories are run in full for it, and
    /// two more to calibrate its bound
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "6", default_value_t = 0, value_parser = histories)]
    histories: usize,
    /// Keep the temperatures of all cells too, for `coldplate solve MODEL.cpr --vtu FILE` and the hottest place of every part
    #[arg(long)]
    field: bool,
    /// Seed of the conditions
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Change a value of the machine file, for example contact.motor.conductance="560 W/(m2 K)"
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// About how many cells (default: the machine file's own)
    #[arg(long, value_name = "N")]
    cells: Option<usize>,
}

/// Most histories of a reduced model, a count. Chosen: each is a run in full, and dozens change nothing any more.
const MOST_HISTORIES: usize = 1000;

fn histories(text: &str) -> std::result::Result<usize, String> {
    text.parse().ok().filter(|n| *n <= MOST_HISTORIES).ok_or_else(|| format!("a number up to {MOST_HISTORIES} is wanted"))
}

/// Runs the command.
///
/// # Errors
/// Bad input, numerics that failed, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let accuracy = units::parse(&args.accuracy, Dimension::DIFFERENCE).map_err(|e| e.at_key("--accuracy"))?;
    if accuracy.is_nan() || accuracy <= 0.0 {
        let error = Error::input("an accuracy is above zero").at_key("--accuracy").read(&args.accuracy);
        return Err(error.help("write for example --accuracy \"0.001 K\""));
    }
    let path = match &args.out {
        Some(path) => path.clone(),
        None => PathBuf::from(args.machine.file_stem().unwrap_or("machine".as_ref())).with_extension("cpr"),
    };
    atomic_file::check(&path)?;
    let mut document = Document::read(&args.machine)?;
    for text in &args.set {
        let (key, value) = pair_of(text, "--set")?;
        document.apply_set(&key, &value).map_err(|error| error.in_file(&args.machine))?;
    }
    let progress = out.progress();
    progress.at("meshing");
    let study = Study::for_conditions(document, args.cells, Machine::usual_conditions, &progress)?;
    if args.field && study.model.chosen.is_some() {
        let error = Error::input("the field is kept on cells of one size only, and these follow from an accuracy").in_file(&args.machine);
        return Err(error.at_key("--field").help("state --cells, or leave --field out"));
    }
    let stated = args.range.iter().map(|text| pair_of(text, "--range")).collect::<Result<Vec<_>>>()?;
    let ranges = ranges(&study.model.machine.variables, args.vary.as_deref(), &stated).map_err(|e| e.in_file(&args.machine))?;
    let settings = ReduceSettings {
        accuracy,
        ranges,
        with_parameters: args.uncertain,
        most: args.max_runs,
        histories: args.histories,
        with_field: args.field,
        seed: args.seed,
    };
    let model = reduce(&study, &settings, &progress)?;
    drop(progress);
    let bytes = model.to_bytes(study.document())?;
    atomic_file::write(&path, &bytes)?;
    let record = MadeRecord::of(&model, path.display().to_string(), bytes.len(), accuracy);
    out.report(&text(&model, &record), &record);
    Ok(0)
}

fn text(model: &ReducedModel, record: &MadeRecord) -> String {
    let made: &Made = &model.made;
    let mut text = format!("{}\n\n", model.machine.name);
    let mut varied = record.varied.clone();
    varied.extend(record.parameters.iter().cloned());
    text += &format!("varies    {}\n", varied.join(", "));
    text +=
        &format!("size      {} modes for {} nodes, {} of {} conductors\n", record.modes, made.nodes, record.conductors, made.conductors);
    text += &format!("made of   {} conditions solved in full, {:.1} s\n", made.solved, made.seconds);
    let has_displacements = model.fine.network.measurands.contains(&Measurand::Displacement);
    let of_readings = |x: f64| significant(x, 2) + if has_displacements { " K (um)" } else { " K" };
    let kelvin = |x: f64| significant(x, 2);
    text += &format!(
        "checked   at {} further conditions: largest error {}, largest bound {}\n",
        made.checks,
        of_readings(made.largest_error),
        of_readings(made.largest_bound)
    );
    if let Some(own) = &record.in_time {
        text += &format!(
            "in time   made of {} histories in full; at {} further ones: largest error {}, largest bound {}\n",
            own.histories,
            own.checks,
            of_readings(own.largest_error_K),
            of_readings(own.largest_bound_K)
        );
    }
    if let Some(own) = &record.field {
        text += &format!(
            "field     {:.1} MB; largest error of any cell at the {} conditions: {} K\n",
            own.bytes as f64 / 1e6,
            made.checks,
            kelvin(own.largest_error_K)
        );
    }
    if !record.reached {
        let asked = kelvin(record.accuracy_K);
        text += &format!("warning: the bound is larger than the {asked} K asked for; allow more --max-runs, or vary less\n");
    }
    if let Some(own) = record.in_time.as_ref().filter(|own| own.largest_bound_K > record.accuracy_K) {
        text += &format!(
            "warning: over time the bound is {}, larger than the {} K asked for; allow more --histories, vary less, or simulate the \
             machine file\n",
            of_readings(own.largest_bound_K),
            kelvin(record.accuracy_K)
        );
    }
    if let Some(reason) = &record.untimed {
        text += &format!(
            "warning: the file knows steady states only, because the histories could not be followed: {reason}; simulate the machine file\n"
        );
    }
    if made.failed > 0 {
        text += &format!("note: {} conditions have no steady state and were left out\n", made.failed);
    }
    if !record.parameters_left_out.is_empty() {
        text += &format!("note: kept as the machine file has them: {}\n", record.parameters_left_out.join(", "));
    }
    text + &format!("wrote {} ({:.1} kB)\n", record.file, record.bytes as f64 / 1e3)
}
