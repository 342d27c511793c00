//! `coldplate fit`: a surrogate from any table, simulated or measured.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use super::output::Output;

use super::text::table;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_evidence::faulty_readings::{self, Fault, FaultRecord};
use coldplate_evidence::measured_table::{clear, notes};
use coldplate_explore::sweep::{MACHINE_HASH, SOLVER_HASH, scope_of};
use coldplate_jobs::dynamics_fit::with_dynamics;
use coldplate_jobs::fitting::{self, FitRecord, model_text, unit_of_errors};
use coldplate_jobs::one_machine::{is_machine_of, of_one_machine, same_machine};
use coldplate_jobs::{FileKind, open};
use coldplate_reduce::ReducedModel;
use coldplate_surrogate::fit::{FitOptions, file};
use coldplate_tables::Table;

/// A surrogate from any table of conditions and outputs
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Table, CSV or Parquet, with units in the header: coolant_flow [L/min], ..., SENSOR [degC], ...
    table: PathBuf,
    /// Surrogate file to write (default: beside the table, ending in .cps)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Machine file whose limits go into the surrogate, or a sweep file that states its own
    #[arg(long, value_name = "FILE")]
    machine: Option<PathBuf>,
    /// Columns that are condition variables, beside the four that always are
    #[arg(long = "input", value_name = "NAME")]
    inputs: Vec<String>,
    /// Columns that are neither conditions nor to be fitted
    #[arg(long = "ignore", value_name = "NAME")]
    ignored: Vec<String>,
    /// Table of the slopes along uncertain parameters (default: slopes.csv or slopes.parquet beside a table called sweep);
    /// none leaves the answers with the band of the fit alone
    #[arg(long, value_name = "FILE|none")]
    slopes: Option<PathBuf>,
    /// Table of conditions with held variables at other values (default: followed.csv or followed.parquet beside a table called
    /// sweep); none leaves them where they are held
    #[arg(long, value_name = "FILE|none")]
    followed: Option<PathBuf>,
    /// Reduced model that was made with histories, of the same machine: the surrogate then moves over time too
    #[arg(long, value_name = "MODEL.cpr")]
    dynamics: Option<PathBuf>,
    /// Fit even if machine file or reduced model are of another machine than the table by their hash, as after a change of
    /// limits
    #[arg(long)]
    anyway: bool,
    /// Use every reading, faulty ones too (default: faulty readings of measured tables are named and left out)
    #[arg(long)]
    keep_all: bool,
    /// Largest total degree of a polynomial
    #[arg(long, value_name = "N", default_value_t = FitOptions::default().max_degree)]
    max_degree: usize,
    /// Seed of the folds of the cross-validation
    #[arg(long, value_name = "N", default_value_t = FitOptions::default().seed)]
    seed: u64,
}

/// A fit with the faulty readings that it left out.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    fit: &'a FitRecord,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    faults: Vec<FaultRecord>,
}

/// Runs the command.
///
/// # Errors
/// A table that cannot be read or fitted, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let start = Instant::now();
    if let Some(path) = &args.out {
        check_ending(path)?;
    }
    let model = args.dynamics.as_deref().map(reduced_model).transpose()?;
    let (mut samples, ledger) = Table::read_with_ledger(&args.table)?;
    ledger.sentences().iter().for_each(|sentence| out.note(&format!("note: {sentence}")));
    of_one_machine(&samples).map_err(|e| e.in_file(&args.table))?;
    if let Some((path, model)) = args.dynamics.as_ref().zip(model.as_ref()).filter(|_| !args.anyway) {
        is_machine_of(&samples, &model.machine.hash).map_err(|e| e.in_file(path))?;
    }
    let remarks = notes(&samples, &args.ignored).map_err(|e| e.in_file(&args.table))?;
    remarks.iter().for_each(|note| out.note(&format!("note: {note}")));
    for name in args.ignored.iter().filter(|name| samples.text(name).is_none()) {
        samples.column(name)?;
    }
    let inputs: usize = samples.conditions().iter().filter(|c| args.ignored.contains(&c.name)).count();
    samples.columns.retain(|c| !args.ignored.contains(&c.name));
    samples.inputs -= inputs;
    if !args.inputs.is_empty() {
        let known: Vec<String> = samples.conditions().iter().map(|c| c.name.clone()).collect();
        let all: Vec<&str> = known.iter().chain(&args.inputs).map(String::as_str).collect();
        samples.make_inputs(&all)?;
    }
    // Results of sweeps are no readings.
    let is_swept = samples.provenance.iter().any(|(key, _)| [MACHINE_HASH, SOLVER_HASH].contains(&key.as_str()));
    let faults =
        if args.keep_all || is_swept { Vec::new() } else { clear(&mut samples, &ledger.rows).map_err(|e| e.in_file(&args.table))? };
    let scope = args.machine.as_ref().map(|path| scope_of(path)).transpose()?;
    if let Some((path, scope)) = args.machine.as_ref().zip(scope.as_ref()).filter(|_| !args.anyway) {
        is_machine_of(&samples, &scope.hash).map_err(|e| e.in_file(path))?;
    }
    let options = FitOptions { max_degree: args.max_degree, seed: args.seed, ..FitOptions::default() };
    let (slopes, followed) = (beside(args, &args.slopes, "slopes"), beside(args, &args.followed, "followed"));
    let mut fit = fitting::fit_table_heard(&samples, scope.as_ref(), &options, &out.progress()).map_err(|e| e.in_file(&args.table))?;
    if let Some(path) = &slopes {
        let slopes = Table::read(path)?;
        same_machine(&samples, &slopes).and_then(|()| fitting::with_uncertainty(&mut fit, Some(&slopes))).map_err(|e| e.in_file(path))?;
    }
    if let Some(path) = &followed {
        let table = Table::read(path)?;
        let followed = same_machine(&samples, &table).and_then(|()| fitting::with_followed(&mut fit, scope.as_ref(), Some(&table)));
        followed.map_err(|e| e.in_file(path))?;
    }
    if let Some((path, model)) = args.dynamics.as_ref().zip(model) {
        with_dynamics(&mut fit.surrogate, &model, &out.progress()).map_err(|e| e.in_file(path))?;
    }
    let path = args.out.clone().unwrap_or_else(|| args.table.with_extension("cps"));
    file::write(&fit.surrogate, &path)?;
    let bytes = std::fs::metadata(&path).map_or(0, |m| m.len());
    for note in &fit.notes {
        out.note(note);
    }
    // If all points are temperatures, errors are in K.
    let has_others = fit.points.iter().any(|p| unit_of_errors(&p.unit) != "K");
    let rows: Vec<Vec<String>> = (fit.points.iter().enumerate())
        .map(|(i, p)| {
            vec![
                p.name.clone(),
                model_text(&fit.surrogate, i),
                p.rows.to_string(),
                significant(p.chosen.leave_one_out.rms, 2),
                p.chosen.k_fold.map(|k| significant(k.rms, 2)).unwrap_or_default(),
                p.chosen.k_fold.map(|k| significant(k.max, 2)).unwrap_or_default(),
                significant(p.half_width, 2),
            ]
            .into_iter()
            .chain(has_others.then(|| unit_of_errors(&p.unit).to_string()))
            .collect()
        })
        .collect();
    let heading = ["point", "model", "rows", "leave-one-out rms", "k-fold rms", "k-fold max", "band +-", "unit"];
    let heading = &heading[..heading.len() - usize::from(!has_others)];
    let moves = fit.surrogate.in_time.as_ref().map(|own| {
        let (least, most) = own.errors.iter().fold((f64::INFINITY, 0.0_f64), |(l, m), e| (l.min(*e), m.max(*e)));
        let unit = if has_others { "of their units" } else { "K" };
        format!("over time: {} states, points within {} to {} {unit}\n", own.states, significant(least, 2), significant(most, 2))
    });
    let found = faulty_readings::listed(&faults);
    let text = format!("{found}{}\n{}wrote {} ({bytes} bytes)\n", table(heading, &rows), moves.unwrap_or_default(), path.display());
    let mut record = FitRecord::of(&fit, &path, bytes, start.elapsed().as_secs_f64());
    record.account = Some(ledger);
    let record = Told { fit: &record, faults: faults.iter().map(Fault::record).collect() };
    out.report(&text, &record);
    Ok(0)
}

/// The reduced model in a file.
fn reduced_model(path: &Path) -> Result<ReducedModel> {
    let file = open(path)?;
    if file.kind != FileKind::ReducedModel {
        return Err(Error::input("this is no reduced model").in_file(path).help("make one with `coldplate reduce MACHINE --histories`"));
    }
    file.reduced_model()
}

/// A table that belongs to the one to be fitted: the stated one, or the one called `name` beside the results of a
/// sweep.
fn beside(args: &Args, stated: &Option<PathBuf>, name: &str) -> Option<PathBuf> {
    match stated {
        Some(path) if path.as_os_str() == "none" => None,
        Some(path) => Some(path.clone()),
        None => {
            let is_sweep = args.table.file_stem().is_some_and(|stem| stem == "sweep");
            let beside = args.table.extension().map(|e| args.table.with_file_name(name).with_extension(e));
            beside.filter(|path| is_sweep && path.is_file())
        }
    }
}

/// Refuses endings of tables and sheets, under which a surrogate would be taken for one; devices and pipes have the
/// names they have.
pub(super) fn check_ending(path: &Path) -> Result<()> {
    let is_other = path.extension().is_some_and(|e| !e.eq_ignore_ascii_case("cps"));
    if is_other && !std::fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        return Err(Error::input("a surrogate file ends in .cps")
            .at_key("--out")
            .read(path.display())
            .help(format!("write --out {}", path.with_extension("cps").display())));
    }
    Ok(())
}
