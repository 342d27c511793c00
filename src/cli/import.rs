//! `coldplate import`: results of another program as a table of ours.

use std::path::PathBuf;

use serde::Serialize;

use super::condition::pair_of;
use super::output::Output;
use crate::error::{Error, Result};
use crate::foundation::input;
use crate::foundation::table::Table;

/// Results of a study in COMSOL, Ansys Workbench, optiSLang or Dakota, or any CSV, as a table with units
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Table of the other program
    #[arg(value_name = "FILE")]
    table: PathBuf,
    /// Table to write, CSV or Parquet
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Columns that are condition variables, beside the four that always are
    #[arg(long = "input", value_name = "NAME")]
    inputs: Vec<String>,
    /// Unit of a column that the file states none of, or another to be converted to: motor=degC
    #[arg(long = "unit", value_name = "NAME=UNIT")]
    units: Vec<String>,
}

/// What was written: each field is a key of `coldplate import --json`.
#[derive(Debug, Serialize)]
struct ImportRecord {
    file: String,
    rows: usize,
    /// With their units.
    conditions: Vec<String>,
    outputs: Vec<String>,
    /// Columns without unit, which are no numbers.
    texts: Vec<String>,
}

/// Runs the command.
///
/// # Errors
/// A table that cannot be read, a column that is not there, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let ending = args.out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    Table::check_name(&args.out)?;
    let units = args.units.iter().map(|unit| pair_of(unit, "--unit")).collect::<Result<Vec<_>>>()?;
    if args.table.extension().is_some_and(|e| e.eq_ignore_ascii_case("omdb")) {
        return Err(Error::input("this is optiSLang's own database, whose form is not published")
            .in_file(&args.table)
            .help("export its designs as CSV in optiSLang (the node 'Design Export'), and import that"));
    }
    let text = input::text(&args.table).map_err(|e| e.help("check the path"))?;
    let table = Table::from_foreign(&text, &args.table, &units, &args.inputs)?;
    if table.columns.is_empty() {
        return Err(Error::input("no column has a unit, so none is numbers")
            .in_file(&args.table)
            .help("state the units: --unit NAME=UNIT, with 1 for pure numbers"));
    }
    if ending == "parquet" {
        table.write_parquet(&args.out)?
    } else {
        table.write_csv(&args.out)?
    }
    let headers = |columns: &[crate::foundation::table::Column]| columns.iter().map(|c| c.header()).collect::<Vec<_>>();
    let record = ImportRecord {
        file: args.out.display().to_string(),
        rows: table.rows(),
        conditions: headers(table.conditions()),
        outputs: headers(table.outputs()),
        texts: table.texts.iter().map(|t| t.name.clone()).collect(),
    };
    let list = |names: &[String]| if names.is_empty() { "none".to_string() } else { names.join(", ") };
    let text = format!(
        "{} rows\nconditions: {}\noutputs: {}\nneither, as they have no unit: {}\nwrote {}\n",
        record.rows,
        list(&record.conditions),
        list(&record.outputs),
        list(&record.texts),
        record.file
    );
    out.report(&text, &record);
    Ok(0)
}
