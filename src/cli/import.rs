//! `coldplate import`: results of another program as a table of ours.

use std::path::PathBuf;

use serde::Serialize;

use super::condition::pair_of;
use super::output::Output;
use coldplate_base::error::{Error, Result};
use coldplate_base::input;
use coldplate_base::numbers::significant;
use coldplate_interchange::foreign::{self, UnitOf};
use coldplate_interchange::vtu_series::{self, Conditions, NamePattern, PointOf, ReadAt};
use coldplate_tables::Table;

/// Results of a study in another program, as a table with units
///
/// The study is one in COMSOL, Ansys Workbench, optiSLang or Dakota, any CSV, or a series of VTU files.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Table of the other program; or VTU files, one for each condition, or their folder
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Table to write, CSV or Parquet
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Columns that are condition variables, beside the four that always are
    #[arg(long = "input", value_name = "NAME")]
    inputs: Vec<String>,
    /// Unit of a column without one in the file, or another unit to be converted to: motor=degC
    #[arg(long = "unit", value_name = "NAME=UNIT")]
    units: Vec<String>,
    /// For VTU files: a measurement point, NAME=FIELD @ PLACE; the place is "100 mm, 20 mm, 5 mm", "point 17" or "cell
    /// 3"
    #[arg(long = "point", value_name = "POINT")]
    points: Vec<String>,
    /// For VTU files: their conditions, as a table with the file's name in a column `file`
    #[arg(long, value_name = "FILE", conflicts_with = "names")]
    conditions: Option<PathBuf>,
    /// For VTU files: how their names state the conditions, for example "rig_{{coolant_flow:L/min}}.vtu"
    #[arg(long, value_name = "NAMES")]
    names: Option<String>,
    /// For VTU files: the length unit of their coordinates
    #[arg(long, value_name = "UNIT", default_value = "m")]
    length: String,
}

/// Record of the table written: each field is a key of `coldplate import --json`.
#[derive(Debug, Serialize)]
struct ImportRecord {
    file: String,
    rows: usize,
    /// Names of the conditions with their units.
    conditions: Vec<String>,
    outputs: Vec<String>,
    /// Columns without unit, which are no numbers.
    texts: Vec<String>,
    /// How measurement points were read in VTU files; left out for tables.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    points: Vec<ReadAt>,
}

/// Runs the command.
///
/// # Errors
/// A table that cannot be read, a column that is not there, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let ending = args.out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    Table::check_name(&args.out)?;
    let units = args.units.iter().map(|unit| pair_of(unit, "--unit")).collect::<Result<Vec<_>>>()?;
    let (table, points) = if args.files.iter().any(|path| path.is_dir() || vtu_series::is_vtu(path)) {
        of_vtu(args, &units)?
    } else {
        (of_table(args, &units)?, Vec::new())
    };
    if ending == "parquet" {
        table.write_parquet(&args.out)?
    } else {
        table.write_csv(&args.out)?
    }
    let headers = |columns: &[coldplate_tables::Column]| columns.iter().map(|c| c.header()).collect::<Vec<_>>();
    let record = ImportRecord {
        file: args.out.display().to_string(),
        rows: table.rows(),
        conditions: headers(table.conditions()),
        outputs: headers(table.outputs()),
        texts: table.texts.iter().map(|t| t.name.clone()).collect(),
        points,
    };
    let list = |names: &[String]| if names.is_empty() { "none".to_string() } else { names.join(", ") };
    let read_at: String = record.points.iter().map(|at| read_at(at) + "\n").collect();
    let text = format!(
        "{} rows\nconditions: {}\noutputs: {}\n{read_at}neither, as they have no unit: {}\nwrote {}\n",
        record.rows,
        list(&record.conditions),
        list(&record.outputs),
        list(&record.texts),
        record.file
    );
    out.report(&text, &record);
    Ok(0)
}

/// A table of another program.
fn of_table(args: &Args, units: &[UnitOf]) -> Result<Table> {
    let [path] = &args.files[..] else {
        return Err(Error::input("several tables at once are not read").help("import one after the other"));
    };
    let of_series = [("--point", !args.points.is_empty()), ("--conditions", args.conditions.is_some()), ("--names", args.names.is_some())];
    if let Some((option, _)) = of_series.iter().find(|(_, is_there)| *is_there) {
        return Err(Error::input("this is asked of VTU files alone").at_key(*option).in_file(path).help("leave it out for a table"));
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("omdb")) {
        return Err(Error::input("this is optiSLang's own database, whose form is not published")
            .in_file(path)
            .help("export its designs as CSV in optiSLang (the node 'Design Export'), and import that"));
    }
    let text = input::text(path).map_err(|e| e.help("check the path"))?;
    let table = foreign::read(&text, path, units, &args.inputs)?;
    if table.columns.is_empty() {
        return Err(Error::input("no column has a unit, so none is numbers")
            .in_file(path)
            .help("state the units: --unit NAME=UNIT, with 1 for pure numbers"));
    }
    Ok(table)
}

/// A series of VTU files.
fn of_vtu(args: &Args, units: &[UnitOf]) -> Result<(Table, Vec<ReadAt>)> {
    if let Some(input) = args.inputs.first() {
        let error = Error::input("every column of the conditions of VTU files is a condition variable").at_key("--input").read(input);
        return Err(error.help("leave it out"));
    }
    let points = args.points.iter().map(|text| PointOf::parse(text)).collect::<Result<Vec<_>>>()?;
    let conditions = match (&args.conditions, &args.names) {
        (Some(path), _) => Conditions::Table(Box::new(Table::read(path)?), path.clone()),
        (_, Some(names)) => Conditions::Names(NamePattern::parse(names)?),
        _ => {
            let help = "--conditions FILE.csv with a column `file`, or --names \"rig_{{coolant_flow:L/min}}.vtu\"";
            return Err(Error::input("where the conditions of the files stand is not said").help(help));
        }
    };
    vtu_series::table(&vtu_series::files(&args.files)?, &conditions, &points, units, &args.length)
}

/// How a measurement point was read, for a reader.
fn read_at(at: &ReadAt) -> String {
    match at.nearest_m {
        None => format!("{}: {}", at.point, at.field),
        Some(off) => format!("{}: {}, at the nearest point of the mesh, up to {} mm off", at.point, at.field, significant(1e3 * off, 3)),
    }
}
