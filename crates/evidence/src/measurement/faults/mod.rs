//! Faulty readings: found by their contrast to everything else that was read and predicted, named by row and column, and left
//! out before anything is concluded from the rest.
//!
//! A fault is isolated. An effect that shows in several readings is physics, however large, and stays. A single wrong reading
//! is therefore one that neither its neighbours in time, nor the other sensors of its row, nor the sensor's other rows share.

mod log;
mod table;

use serde::Serialize;

use super::{Data, Row, whiten};
use coldplate_base::units::celsius;

pub use table::{OddRow, is_at_edge, odd_row, suspects};

/// Values that digital sensors and scanners show if nothing is read, degC. Chosen: more values find more dead sensors and
/// mistake more readings.
const SIGNS: [f64; 3] = [0.0, 85.0, 999.0];
/// Largest distance of a reading from such a sign, K. Chosen: a larger one takes readings for signs.
const SAME: f64 = 5e-3;
/// Least distance of such a sign from the prediction, K. Chosen: some machines are at 0 or 85 degC.
const ABSURD: f64 = 10.0;
/// Largest share of the readings that may be left out one by one, by stretches and by rows. Chosen: beyond it the machine is
/// more likely to be wrong than the data (docs/how-to/diagnose.md).
const MOST: f64 = 0.1;
/// Least number of equal readings of a stuck sensor in a log, and in a steady table; count. Chosen: fewer may be equal by
/// chance.
const STUCK: [usize; 2] = [8, 4];
/// Least range of the prediction over a stuck stretch, in standard deviations of the noise; the other sensors move by half as
/// much. Chosen: a smaller one takes a machine at rest for a stuck sensor.
const MOVES: f64 = 20.0;
/// Least range of the prediction over a stuck stretch beyond that, in steps of the last digit. Chosen: a smaller one takes
/// rounding for a stuck sensor.
const DIGITS: f64 = 5.0;
/// Probability of a chance agreement below which equal readings of two rows without names count as copied. Chosen.
const COPIED: f64 = 1e-4;

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
    pub fn wrong_condition(data: &Data, row: usize, variable: &str, words: String) -> Self {
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

/// Data beside predictions, row by row; readings of faults that were found are taken out on the way.
struct Grid<'a> {
    data: &'a Data,
    /// Noise of each sensor, K.
    noise: &'a [f64],
    /// Readings, K, by row and sensor.
    read: Vec<Vec<Option<f64>>>,
    /// Predictions, K, likewise; none if nothing was read.
    predicted: Vec<Vec<Option<f64>>>,
}

impl<'a> Grid<'a> {
    /// Grid of data and predictions; `predicted` has one value (K) for every reading.
    fn new(data: &'a Data, predicted: &[f64], noise: &'a [f64]) -> Self {
        let read = data.rows.iter().map(|row| row.readings.clone()).collect();
        let mut grid = Self { data, noise, read, predicted: vec![vec![None; data.names.len()]; data.rows.len()] };
        for ((r, k), value) in whiten::places(data).into_iter().zip(predicted) {
            grid.predicted[r][k] = Some(*value);
        }
        grid
    }

    /// Measured less predicted, K.
    fn residual(&self, row: usize, sensor: usize) -> Option<f64> {
        Some(self.read[row][sensor]? - self.predicted[row][sensor]?)
    }

    /// Rows in which a sensor was read.
    fn rows_of(&self, sensor: usize) -> Vec<usize> {
        (0..self.read.len()).filter(|r| self.read[*r][sensor].is_some()).collect()
    }

    /// Smallest step between readings of a sensor, K; that of all sensors if it shows one value only.
    fn digit(&self, sensor: usize) -> f64 {
        let step = |sensors: &mut dyn Iterator<Item = usize>| -> Option<f64> {
            let mut smallest: Option<f64> = None;
            for k in sensors {
                let mut values: Vec<f64> = self.read.iter().filter_map(|row| row[k]).collect();
                values.sort_by(f64::total_cmp);
                let steps = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-9);
                smallest = steps.chain(smallest).min_by(f64::total_cmp);
            }
            smallest
        };
        step(&mut std::iter::once(sensor)).or_else(|| step(&mut (0..self.data.names.len()))).unwrap_or(0.0)
    }

    fn take_out(&mut self, fault: &Fault) {
        for (r, k) in &fault.readings {
            self.read[*r][*k] = None;
        }
    }
}

/// Faults of single readings, sensors and copied rows, in the order of the rows. `predicted` has one value (K) for every
/// reading (rows, then sensors, missing ones left out). `noise` is the standard deviation of each sensor's noise, K.
pub fn find(data: &Data, predicted: &[f64], noise: &[f64]) -> Vec<Fault> {
    let mut grid = Grid::new(data, predicted, noise);
    let mut found = Vec::new();
    let singles = if data.is_transient() { log::wrong_readings } else { table::wrong_readings };
    for look in [duplicates, dead, stuck, singles] {
        let new = look(&grid);
        new.iter().for_each(|fault| grid.take_out(fault));
        found.extend(new);
    }
    found.sort_by_key(|fault| *fault.rows.start());
    found
}

/// Data without the readings of some faults, each of which is then marked. Single readings, stretches and rows are left out
/// only if they are no more than a tenth of all readings, or one row of six. Otherwise none of them is left out, because the
/// machine is then more likely to be wrong than the data. Dead sensors, sensors stuck in half of their readings, and copies are
/// left out in any case.
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
            (FaultKind::DuplicateRow | FaultKind::DeadSensor, _) => true,
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

/// Rows that repeat an earlier reading: only one of them counts.
fn duplicates(grid: &Grid<'_>) -> Vec<Fault> {
    let rows = &grid.data.rows;
    let mut first: std::collections::HashMap<Vec<u64>, Vec<usize>> = std::collections::HashMap::new();
    let mut found = Vec::new();
    for (r, row) in rows.iter().enumerate() {
        if row.readings.iter().all(Option::is_none) {
            // In a log the reader has joined the readings of one time.
            let is_again = |before: &Row| before.time == row.time && before.test == row.test && before.condition == row.condition;
            if row.time.is_some() && r > 0 && is_again(&rows[r - 1]) {
                let words = format!("the same time, conditions and readings as row {r}");
                found.push(Fault {
                    rows: r..=r,
                    line: row.line,
                    test: row.test.clone(),
                    ..Fault::new(grid.data, FaultKind::DuplicateRow, Vec::new(), None, words)
                });
            }
            continue;
        }
        let numbers = row.time.iter().chain(row.condition.si()).copied();
        let readings = row.readings.iter().map(|reading| reading.unwrap_or(f64::NAN));
        let same = first.entry(numbers.chain(readings).map(f64::to_bits).collect()).or_default();
        if let Some(other) = same.iter().find(|other| is_copy(grid, &rows[**other], row)) {
            let readings = (0..row.readings.len()).filter(|k| row.readings[*k].is_some()).map(|k| (r, k)).collect();
            let words = format!("the same time, conditions and readings as row {}", other + 1);
            found.push(Fault::new(grid.data, FaultKind::DuplicateRow, readings, None, words));
        } else {
            same.push(r);
        }
    }
    found
}

/// Whether two equal rows are one reading. Rows without the name of a test could be two tests with equal results.
fn is_copy(grid: &Grid<'_>, one: &Row, other: &Row) -> bool {
    if one.test == other.test {
        return true;
    }
    let is_unnamed = |row: &Row| row.test.starts_with("row ");
    let alike = |k: usize| (grid.digit(k) / (2.0 * std::f64::consts::PI.sqrt() * grid.noise[k].max(1e-12))).min(1.0);
    let chance: f64 = (0..one.readings.len()).filter(|k| one.readings[*k].is_some()).map(alike).product();
    is_unnamed(one) && is_unnamed(other) && chance < COPIED
}

/// Whether a temperature (K) is the sign of no reading, while `predicted` (K) is far from it.
fn is_sign(kelvin: f64, predicted: f64) -> bool {
    SIGNS.iter().any(|sign| (celsius(kelvin) - sign).abs() < SAME) && (kelvin - predicted).abs() > ABSURD
}

/// Sensors that show nothing but the sign of no reading.
fn dead(grid: &Grid<'_>) -> Vec<Fault> {
    let of = |k: usize| -> Option<Fault> {
        let rows = grid.rows_of(k);
        let is_dead = |r: &usize| grid.read[*r][k].zip(grid.predicted[*r][k]).is_some_and(|(read, told)| is_sign(read, told));
        if rows.len() < 2 || !rows.iter().all(is_dead) {
            return None;
        }
        let words = format!("dead, {:.1} degC in all {} readings", celsius(grid.read[rows[0]][k]?), rows.len());
        Some(Fault::new(grid.data, FaultKind::DeadSensor, rows.iter().map(|r| (*r, k)).collect(), Some(k), words))
    };
    (0..grid.data.names.len()).filter_map(of).collect()
}

/// Stretches over which a sensor's readings are equal to the last digit, while its prediction and the other sensors move.
fn stuck(grid: &Grid<'_>) -> Vec<Fault> {
    let least = STUCK[usize::from(!grid.data.is_transient())];
    let mut found = Vec::new();
    for k in 0..grid.data.names.len() {
        let rows = grid.rows_of(k);
        let digit = grid.digit(k);
        let is_next = |a: &usize, b: &usize| {
            let is_one_test = !grid.data.is_transient() || grid.data.rows[*a].test == grid.data.rows[*b].test;
            is_one_test && grid.read[*a][k] == grid.read[*b][k]
        };
        for run in rows.chunk_by(is_next).filter(|run| run.len() >= least) {
            let moved = range(run.iter().filter_map(|r| grid.predicted[*r][k]));
            let (first, last) = (run[0], run[run.len() - 1]);
            let others = (0..grid.data.names.len()).filter(|j| *j != k);
            let ranges = others.map(|j| range((first..=last).filter_map(|r| grid.read[r][j])) / grid.noise[j]);
            let around = median(ranges.collect()).unwrap_or(f64::INFINITY);
            if moved > MOVES * grid.noise[k] + DIGITS * digit && around > 0.5 * MOVES {
                let words = format!(
                    "stuck at {:.2} degC in {} readings, while the machine moves it by {}",
                    grid.read[first][k].map_or(f64::NAN, celsius),
                    run.len(),
                    kelvin(moved)
                );
                found.push(Fault::new(grid.data, FaultKind::StuckSensor, run.iter().map(|r| (*r, k)).collect(), Some(k), words));
            }
        }
    }
    found
}

fn range(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    (high - low).max(0.0)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

/// Standard deviation of some deviations, from their median, so that a few wrong ones do not count.
fn robust(deviations: impl Iterator<Item = f64>) -> f64 {
    1.4826 * median(deviations.map(f64::abs).collect()).unwrap_or(0.0)
}

/// A difference of temperatures as text, K: without decimals from 10 K on.
pub fn kelvin(k: f64) -> String {
    if k.abs() >= 10.0 { format!("{:.0} K", k.abs()) } else { format!("{:.1} K", k.abs()) }
}
