//! Tables of readings that no machine file describes: numbers that no machine has, and doubts about columns.

use crate::faulty_readings::Fault;
use crate::measurement::{Data, ReadingRow};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Dimension, convert};
use coldplate_describe::machine::Condition;
use coldplate_tables::{Column, Table};

/// Plausible temperatures of a machine, K. Chosen wide: outside lie the numbers that scanners write if a sensor does not answer.
const PLAUSIBLE: std::ops::Range<f64> = 150.0..1500.0;
/// Difference of readings at one condition that is said, as a share of the range of the column. Chosen: no instrument's noise.
const CONTRADICTION: f64 = 0.1;
/// Least difference that is said, K. Chosen: ten standard deviations of a usual sensor.
const LEAST_CONTRADICTION: f64 = 1.0;
/// Readings in degC that a column of kelvin shows, for a machine between 0 and 130 degC. Chosen: no cooled machine is there.
const LIKE_KELVIN: std::ops::Range<f64> = 270.0..404.0;

/// Readings that are no temperatures of a machine, by row and column as `shown` in the file.
pub fn impossible(data: &Data, shown: &dyn Fn(usize, usize) -> String) -> Vec<Fault> {
    let mut found = Vec::new();
    for (r, row) in data.rows.iter().enumerate() {
        for (k, reading) in row.readings.iter().enumerate() {
            if reading.is_some_and(|value| !PLAUSIBLE.contains(&value)) {
                let mut fault = Fault::wrong_reading(data, r, k, format!("{} is no temperature of a machine", shown(r, k)));
                fault.is_left_out = true;
                found.push(fault);
            }
        }
    }
    found
}

/// Empties the cells of a table that hold no temperature of a machine, and returns them.
///
/// # Errors
/// A temperature whose unit cannot be read.
pub fn clear(table: &mut Table, lines: &[usize]) -> Result<Vec<Fault>> {
    let is_temperature = |c: &Column| ["degC", "K", "degF"].contains(&c.unit.as_str());
    let columns: Vec<usize> = (table.inputs..table.columns.len()).filter(|c| is_temperature(&table.columns[*c])).collect();
    let kelvin = |column: &usize| -> Result<Vec<f64>> {
        let own = &table.columns[*column];
        convert(300.0, &own.unit, Dimension::TEMPERATURE).map_err(|e| e.at_key(own.header()))?;
        // Values below absolute zero count as impossible.
        let one = |value: &f64| if value.is_nan() { f64::NAN } else { convert(*value, &own.unit, Dimension::TEMPERATURE).unwrap_or(0.0) };
        Ok(own.values.iter().map(one).collect())
    };
    let read: Vec<Vec<f64>> = columns.iter().map(kelvin).collect::<Result<_>>()?;
    let row = |r: usize| ReadingRow {
        test: table.text("test").and_then(|t| t.values.get(r)).map_or_else(|| format!("row {}", r + 1), |t| t.trim().to_string()),
        time: None,
        // Conditions are compared with each other alone: their units do not matter.
        condition: Condition::from_si(table.conditions().iter().map(|c| c.values[r]).collect()),
        readings: read.iter().map(|values| Some(values[r]).filter(|v| v.is_finite())).collect(),
        line: lines.get(r).copied(),
    };
    let data = Data {
        source: String::new(),
        sensors: (0..columns.len()).collect(),
        names: columns.iter().map(|c| table.columns[*c].name.clone()).collect(),
        rows: (0..table.rows()).map(row).collect(),
        ..Data::default()
    };
    let found = impossible(&data, &|r, k| format!("{} {}", table.columns[columns[k]].values[r], table.columns[columns[k]].unit));
    for (r, k) in found.iter().filter(|fault| fault.is_left_out).flat_map(Fault::readings) {
        table.columns[columns[*k]].values[*r] = f64::NAN;
    }
    Ok(found)
}

/// Sentences on columns that are left aside, that read like another unit than their header says, or that contradict themselves.
///
/// # Errors
/// A column of times: the table is a log.
pub fn notes(table: &Table, ignored: &[String]) -> Result<Vec<String>> {
    if table.columns.iter().any(|c| c.name == "time") && !ignored.iter().any(|name| name == "time") {
        return Err(Error::input("this table is a log, and a surrogate is fitted to steady states alone")
            .at_key("time")
            .help("keep the rows that are steady and add --ignore time; logs are for `coldplate identify`"));
    }
    let is_number = |text: &&String| text.trim().parse::<f64>().is_ok();
    let numbers = table.texts.iter().filter(|t| t.values.iter().any(|v| !v.trim().is_empty()) && !ignored.contains(&t.name));
    let numbers = numbers.filter(|t| t.values.iter().filter(|v| !v.trim().is_empty()).all(|v| is_number(&v)));
    let unitless: Vec<String> = numbers.map(|t| format!("'{}'", t.name)).collect();
    let mut notes = Vec::new();
    if !unitless.is_empty() {
        let names = unitless.join(", ");
        notes.push(format!("columns of numbers without a unit were left out: {names}; write 'NAME [unit]' to fit them"));
    }
    for column in table.outputs().iter().filter(|c| c.unit == "degC") {
        let mut present = column.values.iter().filter(|v| v.is_finite()).peekable();
        if present.peek().is_some() && present.all(|v| LIKE_KELVIN.contains(v)) {
            notes.push(format!("'{}' is from 270 to 404 degC throughout, as if it were in kelvin: look at its unit", column.name));
        }
    }
    notes.extend(contradictions(table));
    Ok(notes)
}

/// Columns of which rows at one condition differ by more than their noise can: the largest difference of each.
fn contradictions(table: &Table) -> Vec<String> {
    let mut rows: Vec<usize> = (0..table.rows()).collect();
    let at = |r: &usize| {
        let r = *r;
        table.conditions().iter().map(move |c| c.values[r])
    };
    rows.sort_by(|a, b| at(a).zip(at(b)).map(|(a, b)| a.total_cmp(&b)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal));
    let mut found = Vec::new();
    for column in table.outputs().iter().filter(|c| ["degC", "K"].contains(&c.unit.as_str())) {
        let of = |rows: &[usize]| {
            let present = rows.iter().map(|r| column.values[*r]).filter(|v| v.is_finite());
            present.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let (low, high) = of(&rows);
        let alike = rows.chunk_by(|a, b| at(a).eq(at(b)));
        let widest = alike.map(of).filter(|(l, h)| h > l).max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)));
        if let Some((l, h)) = widest.filter(|(l, h)| h - l > (CONTRADICTION * (high - low)).max(LEAST_CONTRADICTION)) {
            found.push(format!("'{}' is {l} and {h} {} at one and the same condition", column.name, column.unit));
        }
    }
    found
}
