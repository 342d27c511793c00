//! `coldplate update`: new readings into the parameters of a surrogate file.

use std::path::PathBuf;

use super::output::Output;
use super::text::table;
use crate::error::Result;
use crate::foundation::atomic_file;
use crate::foundation::input;
use crate::foundation::numbers::significant;
use crate::foundation::table::Table;
use crate::surrogate::fit::file;
use crate::surrogate::verdict::Surrogate;
use crate::surrogate::verdict::instruments::Instruments;
use crate::surrogate::verdict::update::{self, UpdateRecord};
use crate::units::{Dimension, parse};

/// Standard deviation of a reading where nothing is said of it.
const USUAL_NOISE: &str = "0.1 K";

/// New readings into the parameters of a surrogate file, so that its answers follow the machine
#[derive(Debug, clap::Args)]
#[command(after_help = "Exit status: 0 done; 1 the readings leave the model, and nothing was written; 2 bad input.")]
pub struct Args {
    /// Surrogate file
    #[arg(value_name = "SURROGATE")]
    surrogate: PathBuf,
    /// Steady readings: CSV or Parquet with the surrogate's variables and points, units in the header
    data: PathBuf,
    /// Standard deviation of a reading (default: what DATA.toml beside the data says of noise, bias and condition, else 0.1 K)
    #[arg(long, value_name = "K")]
    noise: Option<String>,
    /// Surrogate file to write (default: the one that was read)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write it even if the readings leave the model
    #[arg(long)]
    anyway: bool,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let bytes = input::read(&args.surrogate)?;
    let instruments = instruments(args, &file::open(&bytes).map_err(|e| e.in_file(&args.surrogate))?)?;
    let (data, lines) = Table::read_with_lines(&args.data)?;
    let found = update::update(&bytes, &data, &lines, &instruments).map_err(|e| e.in_file(&args.data))?;
    let path = args.out.as_ref().unwrap_or(&args.surrogate);
    let is_written = !found.record.alarm || args.anyway;
    if is_written {
        atomic_file::write(path, &found.bytes)?;
    }
    let last =
        if is_written { format!("wrote {}\n", path.display()) } else { "nothing was written; --anyway writes it all the same\n".into() };
    out.report(&(text(&found.record) + &last), &found.record);
    Ok(u8::from(!is_written))
}

/// What is known of the instruments.
fn instruments(args: &Args, surrogate: &Surrogate<'_>) -> Result<Instruments> {
    let beside = args.data.with_extension("toml");
    let noise = match &args.noise {
        None if beside.exists() => return Instruments::read(&beside, surrogate),
        None => USUAL_NOISE,
        Some(text) => text,
    };
    let kelvin = parse(noise, Dimension::DIFFERENCE).map_err(|e| e.at_key("--noise"))?;
    if kelvin.is_nan() || kelvin <= 0.0 {
        let error = crate::error::Error::input("a standard deviation is above zero").at_key("--noise").read(noise);
        return Err(error.help("write for example --noise \"0.1 K\""));
    }
    Ok(Instruments::with_noise(surrogate, kelvin))
}

fn text(record: &UpdateRecord) -> String {
    let of = |value: f64, deviation: f64| {
        let digits = (1.0 - deviation.abs().max(1e-12).log10().floor()).clamp(0.0, 9.0) as usize;
        format!("{value:.digits$} +- {deviation:.digits$}")
    };
    let rows: Vec<Vec<String>> = (record.parameters.iter())
        .map(|p| vec![p.name.clone(), of(p.before, p.deviation_before), of(p.value, p.deviation), p.unit.clone()])
        .collect();
    let mut text = String::new();
    if !rows.is_empty() {
        text += &table(&["parameter", "before", "after", "unit"], &rows);
        text.push('\n');
    }
    let rows: Vec<Vec<String>> = record.points.iter().map(|p| vec![p.name.clone(), of(p.value, p.deviation)]).collect();
    text += &table(&["point", "above the model by"], &rows);
    text += &format!(
        "\n{} readings of {} rows: chi-square {}, probability {}\n",
        record.readings,
        record.rows - record.outside,
        significant(record.chi_square, 4),
        significant(record.probability, 2)
    );
    if record.outside > 0 {
        text += &format!("{} rows are outside the fitted range and teach nothing\n", record.outside);
    }
    for row in record.worst.iter().take(5) {
        let test = row.test.as_ref().map_or(String::new(), |test| format!(" ('{test}')"));
        text += &format!("line {}{test}: not expected, probability {}\n", row.line, significant(row.probability, 2));
    }
    if record.alarm {
        text += "The readings leave the model: no value of its parameters explains them. Ask `coldplate diagnose MACHINE DATA` for the cause.\n";
    }
    text
}
