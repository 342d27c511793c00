//! `coldplate update`: new readings into the parameters of a surrogate file.

use std::path::PathBuf;

use serde::Serialize;

use super::output::Output;
use super::text::table;
use coldplate_base::atomic_file;
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_base::units::{Dimension, convert, parse};
use coldplate_describe::machine::Condition;
use coldplate_evidence::faulty_readings::{self, Fault, FaultRecord};
use coldplate_evidence::measured_table::impossible;
use coldplate_evidence::measurement::{Data, ReadingRow};
use coldplate_jobs::open;
use coldplate_surrogate::verdict::instruments::Instruments;
use coldplate_surrogate::verdict::update::{self, UpdateRecord};
use coldplate_surrogate::verdict::{Surrogate, condition};
use coldplate_tables::{Ledger, Table};

/// Standard deviation of a reading, unless it is stated. Chosen: a usual temperature sensor.
const USUAL_NOISE: &str = "0.1 K";

/// New readings into the parameters of a surrogate file
///
/// The answers then follow the machine.
#[derive(Debug, clap::Args)]
#[command(after_help = "Exit status: 0 done; 1 the readings leave the model, and nothing was written; 2 bad input.")]
pub struct Args {
    /// Surrogate file
    #[arg(value_name = "SURROGATE")]
    surrogate: PathBuf,
    /// Steady readings: CSV or Parquet with the surrogate's variables and points, units in the header
    data: PathBuf,
    /// Standard deviation of a reading (default: noise, bias and condition as DATA.toml beside the data states them, else 0.1
    /// K)
    #[arg(long, value_name = "K")]
    noise: Option<String>,
    /// Surrogate file to write (default: the one that was read)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write it even if the readings leave the model
    #[arg(long)]
    anyway: bool,
    /// Use every reading, faulty ones too (default: faulty readings are named and left out)
    #[arg(long)]
    keep_all: bool,
}

/// An update with the faulty readings that it left out.
#[derive(Debug, Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    update: &'a UpdateRecord,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    faults: Vec<FaultRecord>,
    /// Account of the data: lines and readings that count, and those that do not.
    account: &'a Ledger,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or a file that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let file = open(&args.surrogate)?;
    let surrogate = file.surrogate()?;
    let instruments = instruments(args, &surrogate)?;
    let (mut data, ledger) = Table::read_with_ledger(&args.data)?;
    ledger.sentences().iter().for_each(|sentence| out.note(&format!("note: {sentence}")));
    let lines = &ledger.rows;
    let faults =
        if args.keep_all { Vec::new() } else { clear(&mut data, lines, &surrogate, &instruments).map_err(|e| e.in_file(&args.data))? };
    let found = update::update(&file.bytes, &data, lines, &instruments).map_err(|e| e.in_file(&args.data))?;
    let path = args.out.as_ref().unwrap_or(&args.surrogate);
    let is_written = !found.record.alarm || args.anyway;
    if is_written {
        match &args.out {
            Some(path) => atomic_file::write(path, &found.bytes)?,
            None => atomic_file::renew(&args.surrogate, &found.bytes)?,
        }
    }
    let last =
        if is_written { format!("wrote {}\n", path.display()) } else { "nothing was written; --anyway writes it all the same\n".into() };
    let told = Told { update: &found.record, faults: faults.iter().map(Fault::record).collect(), account: &ledger };
    out.report(&(faulty_readings::listed(&faults) + &text(&found.record) + &last), &told);
    Ok(u8::from(!is_written))
}

/// Empties the cells of a table with readings that no working sensor shows, by the tests of `predict`, beside the surrogate's answers;
/// returns the faults found. A missing column finds nothing here; taking the table in names it.
fn clear(table: &mut Table, lines: &[usize], surrogate: &Surrogate<'_>, instruments: &Instruments) -> Result<Vec<Fault>> {
    let is_log = table.columns.iter().any(|c| c.name == "time");
    let points: Vec<(usize, usize)> = (surrogate.points().enumerate())
        .filter(|(_, p)| ["degC", "K"].contains(&p.unit))
        .filter_map(|(point, p)| table.columns.iter().position(|c| c.name == p.name).map(|column| (point, column)))
        .collect();
    if is_log || points.is_empty() || surrogate.variables().any(|v| table.columns.iter().all(|c| c.name != v.name)) {
        return Ok(Vec::new());
    }
    let mut variables: Vec<Vec<f64>> = Vec::new();
    for variable in surrogate.variables() {
        let column = table.column(variable.name)?;
        let value = |v: &f64| if v.is_finite() { condition::number_in(&variable, *v, &column.unit) } else { Ok(f64::NAN) };
        variables.push(column.values.iter().map(value).collect::<Result<_>>().map_err(|e| e.at_key(variable.name))?);
    }
    let kelvin = |(_, column): &(usize, usize)| -> Result<Vec<f64>> {
        let own = &table.columns[*column];
        convert(300.0, &own.unit, Dimension::TEMPERATURE).map_err(|e| e.at_key(own.header()))?;
        // Values below absolute zero count as impossible.
        let one = |value: &f64| if value.is_nan() { f64::NAN } else { convert(*value, &own.unit, Dimension::TEMPERATURE).unwrap_or(0.0) };
        Ok(own.values.iter().map(one).collect())
    };
    let read: Vec<Vec<f64>> = points.iter().map(kelvin).collect::<Result<_>>()?;
    let xs: Vec<Vec<f64>> = (0..table.rows()).map(|r| variables.iter().map(|v| v[r]).collect()).collect();
    let Some(inside) = xs.iter().find(|x| surrogate.in_domain(x)) else { return Ok(Vec::new()) };
    let row = |(r, x): (usize, &Vec<f64>)| ReadingRow {
        test: table.text("test").and_then(|t| t.values.get(r)).map_or_else(|| format!("row {}", r + 1), |t| t.trim().to_string()),
        time: None,
        // Conditions are compared with each other alone: their units do not matter.
        condition: Condition::from_si(x.clone()),
        // Outside the fitted range nothing is learnt, and nothing is known to judge by.
        readings: read.iter().map(|values| Some(values[r]).filter(|v| v.is_finite() && surrogate.in_domain(x))).collect(),
        line: lines.get(r).copied(),
    };
    let mut data = Data {
        source: String::new(),
        sensors: points.iter().map(|(point, _)| *point).collect(),
        names: points.iter().map(|(_, column)| table.columns[*column].name.clone()).collect(),
        rows: xs.iter().enumerate().map(row).collect(),
        ..Data::default()
    };
    let shown = |r: usize, k: usize| {
        let column = &table.columns[points[k].1];
        format!("{} {}", column.values[r], column.unit)
    };
    let mut found = impossible(&data, &shown);
    data = faulty_readings::blanked(&data, &found);
    let mut predicted = Vec::new();
    let mut values = vec![0.0; surrogate.point_count()];
    for (row, x) in data.rows.iter().zip(&xs) {
        if surrogate.evaluate(x, &mut values).is_err() {
            return Ok(found);
        }
        for ((point, _), _) in points.iter().zip(&row.readings).filter(|(_, reading)| reading.is_some()) {
            let unit = surrogate.point(*point).map_or("K", |p| p.unit);
            predicted.push(convert(values[*point], unit, Dimension::TEMPERATURE)?);
        }
    }
    let noise: Vec<f64> = points.iter().map(|(point, _)| instruments.deviation(surrogate, inside, *point)).collect();
    let mut judged = faulty_readings::find(&data, &predicted, &noise);
    faulty_readings::without(&data, &mut judged);
    found.extend(judged);
    found.sort_by_key(|fault| *fault.rows.start());
    for (r, k) in found.iter().filter(|fault| fault.is_left_out).flat_map(Fault::readings) {
        table.columns[points[*k].1].values[*r] = f64::NAN;
    }
    Ok(found)
}

/// Standard deviations of the instruments.
fn instruments(args: &Args, surrogate: &Surrogate<'_>) -> Result<Instruments> {
    let beside = args.data.with_extension("toml");
    let noise = match &args.noise {
        None if beside.exists() => return Instruments::read(&beside, surrogate),
        None => USUAL_NOISE,
        Some(text) => text,
    };
    let kelvin = parse(noise, Dimension::DIFFERENCE).map_err(|e| e.at_key("--noise"))?;
    if kelvin.is_nan() || kelvin <= 0.0 {
        let error = coldplate_base::error::Error::input("a standard deviation is above zero").at_key("--noise").read(noise);
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
    if record.known > 0 {
        text += &format!("{} further readings were learnt before, and teach nothing again\n", record.known);
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_surrogate::fit::file;
    use coldplate_tables::Column;

    const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/runtime/fixtures/uncertain.cps");

    /// Conditions, and the surrogate's answers there, a few hundredths off like readings.
    fn readings(surrogate: &Surrogate<'_>) -> Table {
        let rows = [[8.0, 20.0, 21.0], [5.0, 20.0, 21.0], [4.0, 18.0, 22.0], [10.0, 22.0, 24.0], [3.0, 16.0, 20.0], [6.0, 24.0, 25.0]];
        let mut values = [0.0; 2];
        let told: Vec<[f64; 5]> = (rows.iter().enumerate())
            .map(|(r, x)| {
                surrogate.evaluate(x, &mut values).unwrap();
                let off = 0.02 * (r as f64 - 2.5);
                [x[0], x[1], x[2], values[0] + off, values[1] - off]
            })
            .collect();
        let column = |k: usize, name: &str, unit: &str| Column {
            name: name.into(),
            unit: unit.into(),
            values: told.iter().map(|row| row[k]).collect(),
        };
        let columns = vec![
            column(0, "coolant_flow", "L/min"),
            column(1, "coolant_temperature", "degC"),
            column(2, "ambient_temperature", "degC"),
            column(3, "motor", "degC"),
            column(4, "screw nut", "degC"),
        ];
        Table { texts: vec![], columns, inputs: 3, provenance: vec![] }
    }

    /// A sensor that shows nothing in every row, and one that scanners write for no answer, teach nothing; good readings all stay.
    #[test]
    fn dead_sensors_and_impossible_values_are_left_out() {
        let bytes = std::fs::read(FILE).unwrap();
        let surrogate = file::open(&bytes).unwrap();
        let instruments = Instruments::with_noise(&surrogate, 0.1);
        let lines = [2, 3, 4, 5, 6, 7];
        let good = readings(&surrogate);
        let mut kept = good.clone();
        assert!(clear(&mut kept, &lines, &surrogate, &instruments).unwrap().is_empty());
        assert_eq!(kept, good);

        let mut dead = good.clone();
        dead.columns[4].values.fill(0.0);
        let found = clear(&mut dead, &lines, &surrogate, &instruments).unwrap();
        let told: Vec<String> = found.iter().map(Fault::text).collect();
        assert_eq!(told, ["rows 1 to 6 (line 2), 'screw nut': dead, 0.0 degC in all 6 readings: left out"]);
        assert!(dead.columns[4].values.iter().all(|v| v.is_nan()));
        assert_eq!(dead.columns[3], good.columns[3]);
        let after = update::update(&bytes, &dead, &lines, &instruments).unwrap().record;
        assert!(after.readings == 6 && !after.alarm, "{after:?}");

        let mut silent = good.clone();
        silent.columns[3].values[1] = -999.0;
        let found = clear(&mut silent, &lines, &surrogate, &instruments).unwrap();
        assert_eq!(found[0].text(), "row 2 (line 3), 'motor': -999 degC is no temperature of a machine: left out");
        assert!(found.len() == 1 && silent.columns[3].values[1].is_nan());
    }
}
