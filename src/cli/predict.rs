//! `coldplate predict`: a machine beside measured data, and nothing else.

use std::path::PathBuf;

use super::measured::DataArgs;
use super::mesh_options::MeshArgs;
use super::output::Output;
use super::text::table;
use coldplate_base::atomic_file;
use coldplate_base::error::Result;
use coldplate_base::units::Measurand;
use coldplate_evidence::command_input;
use coldplate_evidence::faulty_readings::{self, Fault};
use coldplate_evidence::residuals::{PredictRecord, PredictedReadings, ResidualSpread};
use coldplate_solve::study::Study;

/// A machine beside measured data: residual and RMSE
///
/// Prediction, residual and RMSE of each test and sensor; nothing is fitted or judged.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file
    machine: PathBuf,
    /// Measured data: CSV with test, conditions and sensors (default: the measurements in the machine file)
    data: Option<PathBuf>,
    /// Use this test only; may be repeated (default: all tests)
    #[arg(long = "use", value_name = "TEST", conflicts_with = "hold_out")]
    use_tests: Vec<String>,
    #[command(flatten)]
    readings: DataArgs,
    /// Leave out a sensor; may be repeated
    #[arg(long, value_name = "SENSOR")]
    without: Vec<String>,
    /// The state logs begin with: "steady", "readings" (each test at the mean of its first readings), "parts" (each part and node
    /// at the mean of those of its own sensors), or a temperature
    #[arg(long, value_name = "STATE", default_value = "steady")]
    from: String,
    /// Print the whole table as CSV instead: the data with prediction and residual beside every sensor
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Write the whole table: CSV, or Parquet by the name's ending
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Use every reading, faulty ones too (default: faulty readings are named and left out)
    #[arg(long)]
    keep_all: bool,
    #[command(flatten)]
    mesh: MeshArgs,
}

/// Most readings that are shown one by one, a count. Chosen: longer tables say little to a reader.
const MOST_SHOWN: usize = 60;

/// Runs the command.
///
/// # Errors
/// Bad input, or numerics that failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let sets = args.mesh.sets()?;
    let study = Study::read(&args.machine, &sets, args.mesh.cells)?;
    let start = command_input::start(&args.from)?;
    if let Some(path) = &args.out {
        atomic_file::check(path).map_err(|e| e.at_key("--out"))?;
    }
    let mut data = command_input::data(args.data.as_deref(), &args.readings.between(), &study.model.machine)?;
    command_input::drop_sensors(&mut data, &args.without)?;
    if !args.use_tests.is_empty() {
        data = data.split(&args.use_tests)?.0;
    }
    data.notes.iter().for_each(|note| out.note(&format!("note: {note}")));
    let uncertainty = command_input::stated(args.data.as_deref(), &args.machine, &data, &study.model.machine)?;
    let faults = command_input::clear(&mut data, &study, &uncertainty, start, args.keep_all)?;
    out.note_on_mesh("residuals", study.model.mesh.cells);
    let found = match args.readings.divided(&data, out)? {
        Some(divided) => PredictedReadings::held_out(&study, &divided, start)?,
        None => PredictedReadings::of(&study, data, start)?,
    };
    if let Some(path) = &args.out {
        let series = found.table(&study)?;
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) {
            series.write_parquet(path)?;
        } else {
            series.write_csv(path)?;
        }
        out.note(&format!("wrote {}", path.display()));
    }
    if args.csv {
        faults.iter().for_each(|fault| out.note(&format!("note: {}", fault.text())));
    }
    let text = if args.csv { found.table(&study)?.to_csv()? } else { faulty_readings::listed(&faults) + &text(&found, &study) };
    let record = PredictRecord { faults: faults.iter().map(Fault::record).collect(), ..found.record(&study) };
    out.report(&text, &record);
    Ok(0)
}

fn text(found: &PredictedReadings, study: &Study) -> String {
    let mut text = format!("{}\n", study.model.machine.name);
    let is_mixed = found.measurands.contains(&Measurand::Displacement);
    // In a table with temperatures, displacements carry their unit.
    let unit = |k: usize| if is_mixed { format!(" {}", found.measurands[k].unit_of_differences()) } else { String::new() };
    let shown = |k: usize, reading: f64| {
        let own = found.measurands[k];
        format!("{:.2}{}", own.shown(reading), if is_mixed { format!(" {}", own.unit()) } else { String::new() })
    };
    if !found.data.is_transient() && found.places.len() <= MOST_SHOWN {
        let row = |(i, (r, k)): (usize, &(usize, usize))| {
            vec![
                found.data.rows[*r].test.clone(),
                found.data.names[*k].clone(),
                shown(*k, found.measured[i]),
                shown(*k, found.predicted[i]),
                format!("{:+.2}{}", found.residual(i), unit(*k)),
            ]
        };
        text += "\n";
        let rows: Vec<Vec<String>> = found.places.iter().enumerate().map(row).collect();
        let heading: &[&str] = match is_mixed {
            false => &["test", "sensor", "measured degC", "predicted degC", "residual K"],
            true => &["test", "sensor", "measured", "predicted", "residual"],
        };
        text += &table(heading, &rows);
    }
    let of = |(name, s): &(String, ResidualSpread)| {
        let kelvins = s.temperatures.as_ref().map(|t| [t.rmse_K, t.mean_K, t.largest_K]);
        let micrometres = s.displacements.as_ref().map(|d| [d.rmse_um, d.mean_um, d.largest_um]);
        let cells = |of: Option<[f64; 3]>| {
            of.map_or(Default::default(), |[rmse, mean, largest]| [format!("{rmse:.3}"), format!("{mean:+.3}"), format!("{largest:+.3}")])
        };
        let mut row = vec![name.clone(), s.readings.to_string()];
        row.extend(cells(kelvins));
        row.extend(if is_mixed { cells(micrometres).to_vec() } else { Vec::new() });
        row
    };
    let heading = |what| {
        let kelvins = [what, "readings", "RMSE K", "mean K", "largest K"];
        if is_mixed { [&kelvins[..], &["RMSE um", "mean um", "largest um"]].concat() } else { kelvins.to_vec() }
    };
    for (what, spreads) in [("test", found.by_test()), ("sensor", found.by_sensor())] {
        text += "\n";
        text += &table(&heading(what), &spreads.iter().map(of).collect::<Vec<_>>());
    }
    let all = found.overall();
    let kelvins = all.temperatures.map(|t| format!("RMSE {:.3} K, mean {:+.3} K", t.rmse_K, t.mean_K));
    let micrometres = all.displacements.map(|d| format!("RMSE {:.3} um, mean {:+.3} um", d.rmse_um, d.mean_um));
    let said: Vec<String> = kelvins.into_iter().chain(micrometres).collect();
    text + &format!("\n{} readings: {} (measured less predicted)\n", all.readings, said.join("; "))
}
