//! Faulty readings: found by their contrast to everything else that was read and predicted, named by row and column, and left
//! out before anything is concluded from the rest.
//!
//! A fault is isolated. An effect that shows in several readings is physics, however large, and stays. A single wrong reading
//! is therefore one that neither its neighbours in time, nor the other sensors of its row, nor the sensor's other rows share.
//!
//! [`find`] judges readings beside given predictions; [`cleared`] also asks the model for rows of wrong conditions.

mod by_model;
mod error_values;
mod grid;
mod log;
mod repeats;
mod signs;
mod table;

use serde::Serialize;

use crate::measurement::Data;
use grid::Grid;

pub use by_model::{Cleared, cleared};
pub use table::{OddRow, is_at_edge, odd_row, suspects};

/// Largest share of the readings that may be left out one by one, by stretches and by rows. Chosen: beyond it the machine is
/// more likely to be wrong than the data (docs/how-to/diagnose.md).
const MOST: f64 = 0.1;
/// Kind of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FaultKind {
    /// One reading, off all others.
    WrongReading,
    /// A sensor whose readings are constant while everything else moves.
    StuckSensor,
    /// A sensor that shows the sign of no reading throughout.
    DeadSensor,
    /// Readings that show a value of the instrument's own in place of a temperature.
    ErrorValue,
    /// A copy of an earlier row.
    DuplicateRow,
    /// A row whose stated conditions are not those of its readings.
    WrongCondition,
}

/// A fault of the data.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// First and last row of the data that the fault concerns, counted from 0.
    pub rows: std::ops::RangeInclusive<usize>,
    /// Line of the file at which the fault begins, if known.
    pub line: Option<usize>,
    /// Name of the test in which the fault begins.
    pub test: String,
    /// The sensor; none for a whole row.
    pub sensor: Option<String>,
    /// The variable whose value is wrong.
    pub variable: Option<String>,
    /// Description of the fault, without the place.
    pub words: String,
    /// Whether the readings of the fault were left out.
    pub is_left_out: bool,
    /// Row and sensor of each reading of the fault.
    readings: Vec<(usize, usize)>,
}

impl Fault {
    fn new(data: &Data, kind: FaultKind, readings: Vec<(usize, usize)>, sensor: Option<usize>, words: String) -> Self {
        let rows = readings.iter().map(|(r, _)| *r);
        let (first, last) = (rows.clone().min().unwrap_or(0), rows.max().unwrap_or(0));
        Self {
            kind,
            rows: first..=last,
            line: data.rows[first].line,
            test: data.rows[first].test.clone(),
            sensor: sensor.map(|k| data.names[k].clone()),
            variable: None,
            words,
            is_left_out: false,
            readings,
        }
    }

    /// Fault of a row whose `variable` is not that of its readings.
    pub(crate) fn wrong_condition(data: &Data, row: usize, variable: &str, words: String) -> Self {
        let readings = (0..data.names.len()).filter(|k| data.rows[row].readings[*k].is_some()).map(|k| (row, k)).collect();
        Self { variable: Some(variable.into()), ..Self::new(data, FaultKind::WrongCondition, readings, None, words) }
    }

    /// Fault of one reading, by row and sensor.
    pub fn wrong_reading(data: &Data, row: usize, sensor: usize, words: String) -> Self {
        Self::new(data, FaultKind::WrongReading, vec![(row, sensor)], Some(sensor), words)
    }

    /// Fault of a row of readings that no other value of one condition explains.
    pub fn wrong_row(data: &Data, row: usize, words: String) -> Self {
        Self { variable: None, ..Self::wrong_condition(data, row, "", words) }
    }

    /// The fault in a table in which each row stands at another place.
    pub fn moved(&self, places: &[usize]) -> Self {
        let to = |r: usize| places.get(r).copied().unwrap_or(r);
        Self {
            rows: to(*self.rows.start())..=to(*self.rows.end()),
            readings: self.readings.iter().map(|(r, k)| (to(*r), *k)).collect(),
            ..self.clone()
        }
    }

    /// Row and sensor of each reading of the fault.
    pub fn readings(&self) -> &[(usize, usize)] {
        &self.readings
    }

    /// Number of readings that the fault concerns.
    pub fn count(&self) -> usize {
        self.readings.len()
    }

    /// Place of the fault: rows, line and sensor.
    pub fn place(&self) -> String {
        let (first, last) = (self.rows.start() + 1, self.rows.end() + 1);
        let line = self.line.map_or(String::new(), |line| format!(" (line {line})"));
        let rows = if first == last { format!("row {first}{line}") } else { format!("rows {first} to {last}{line}") };
        let sensor = self.sensor.as_ref().map_or(String::new(), |name| format!(", '{name}'"));
        format!("{rows}{sensor}")
    }

    /// The fault in one line: place, description, and whether it was left out.
    pub fn text(&self) -> String {
        format!("{}: {}: {}", self.place(), self.words, if self.is_left_out { "left out" } else { "kept" })
    }

    /// The fault for other programs.
    pub fn record(&self) -> FaultRecord {
        FaultRecord {
            kind: self.kind,
            row: self.rows.start() + 1,
            last_row: self.rows.end() + 1,
            line: self.line,
            test: self.test.clone(),
            sensor: self.sensor.clone(),
            variable: self.variable.clone(),
            readings: self.count(),
            left_out: self.is_left_out,
            text: self.text(),
        }
    }
}

/// A fault as outside programs read it, under the key `faults`. Rows count from 1, without the header.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs)]
pub struct FaultRecord {
    pub kind: FaultKind,
    pub row: usize,
    pub last_row: usize,
    pub line: Option<usize>,
    pub test: String,
    pub sensor: Option<String>,
    pub variable: Option<String>,
    pub readings: usize,
    pub left_out: bool,
    pub text: String,
}

/// Faults of single readings, sensors and copied rows, in the order of the rows. `predicted` has one value (K) for every
/// reading (rows, then sensors, missing ones left out). `noise` is the standard deviation of each sensor's noise, K.
pub fn find(data: &Data, predicted: &[f64], noise: &[f64]) -> Vec<Fault> {
    let mut grid = Grid::new(data, predicted, noise);
    let mut found = Vec::new();
    let singles = if data.is_transient() { log::wrong_readings } else { table::wrong_readings };
    for look in [repeats::duplicates, signs::dead, error_values::error_values, repeats::stuck, singles] {
        let new = look(&grid);
        new.iter().for_each(|fault| grid.take_out(fault));
        found.extend(new);
    }
    found.sort_by_key(|fault| *fault.rows.start());
    found
}

/// Data without the readings of some faults, each of which is then marked. Single readings, stretches and rows are left out
/// only if they are no more than a tenth of all readings, or one row of six. Otherwise none of them is left out, because the
/// machine is then more likely to be wrong than the data. Dead sensors, values in place of readings, sensors stuck in half of
/// their readings, and copies are left out in any case.
pub fn without(data: &Data, faults: &mut [Fault]) -> Data {
    let of_sensor = |name: &str| {
        let k = data.names.iter().position(|n| n == name).unwrap_or(0);
        data.rows.iter().filter(|row| row.readings[k].is_some()).count()
    };
    let stuck = |name: &str| -> usize {
        let own = faults.iter().filter(|fault| fault.kind == FaultKind::StuckSensor && fault.sensor.as_deref() == Some(name));
        own.map(Fault::count).sum()
    };
    let whole: Vec<bool> = faults
        .iter()
        .map(|fault| match (fault.kind, &fault.sensor) {
            (FaultKind::DuplicateRow | FaultKind::DeadSensor | FaultKind::ErrorValue, _) => true,
            (FaultKind::StuckSensor, Some(name)) => 2 * stuck(name) >= of_sensor(name),
            (_, Some(name)) => fault.count() > 1 && fault.count() == of_sensor(name),
            _ => false,
        })
        .collect();
    let counted: usize = faults.iter().zip(&whole).filter(|(_, is_whole)| !**is_whole).map(|(fault, _)| fault.count()).sum();
    let one_row = if data.rows.len() >= 6 { data.names.len() } else { 1 };
    let is_few = counted as f64 <= (MOST * data.count() as f64).max(one_row as f64);
    faults.iter_mut().zip(whole).for_each(|(fault, is_whole)| fault.is_left_out = is_few || is_whole);
    let rest = rest(data, faults);
    if rest.count() == 0 {
        faults.iter_mut().for_each(|fault| fault.is_left_out = false);
        return data.clone();
    }
    rest
}

/// Data without the faults that are marked as left out, and without rows of tables that have no reading left.
pub fn rest(data: &Data, faults: &[Fault]) -> Data {
    let mut rest = blanked(data, faults.iter().filter(|fault| fault.is_left_out));
    rest.rows = kept(data, faults).into_iter().map(|r| rest.rows[r].clone()).collect();
    rest
}

/// Indices of the rows that [`rest`] keeps. Rows of a log are all kept, because they state the conditions.
pub fn kept(data: &Data, faults: &[Fault]) -> Vec<usize> {
    let left = blanked(data, faults.iter().filter(|fault| fault.is_left_out));
    let is_kept = |r: &usize| data.is_transient() || left.rows[*r].readings.iter().any(Option::is_some);
    (0..data.rows.len()).filter(is_kept).collect()
}

/// Faults as a list for readers; empty if there is none.
pub fn listed(faults: &[Fault]) -> String {
    if faults.is_empty() {
        return String::new();
    }
    let mut text = String::from("faulty readings:\n");
    faults.iter().for_each(|fault| text += &format!("  {}\n", fault.text()));
    if faults.iter().any(|fault| !fault.is_left_out) {
        text += "  more than a tenth of the readings would be left out: they are kept, since the machine may be wrong about them\n";
    }
    text + "\n"
}

/// Data with empty cells in place of the readings of some faults; every row stays.
pub fn blanked<'f>(data: &Data, faults: impl IntoIterator<Item = &'f Fault>) -> Data {
    let mut rest = data.clone();
    for (r, k) in faults.into_iter().flat_map(|fault| &fault.readings) {
        rest.rows[*r].readings[*k] = None;
    }
    rest
}

/// A difference of temperatures as text, K: without decimals from 10 K on.
pub fn kelvin(k: f64) -> String {
    if k.abs() >= 10.0 { format!("{:.0} K", k.abs()) } else { format!("{:.1} K", k.abs()) }
}
