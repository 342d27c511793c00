//! Measured data: readings by condition, from a table or from the machine file, with their uncertainty.
//!
//! A table has one row per reading time: `test`, the conditions and the sensors, units in the header; with a column
//! `time [s]` each test is a log. An empty cell is a missing reading. Beside `DATA.csv` may stand `DATA.toml`, which says
//! how uncertain readings and conditions are ([`Uncertainty`]).

mod beyond;
pub mod faults;
pub mod filter;
mod thin;
mod uncertainty;
pub mod wander;
pub mod whiten;

use std::collections::HashMap;
use std::path::Path;

use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{self, Celsius, Dimension, Kelvin, Measurand, celsius};
use coldplate_describe::machine::{Condition, Machine, Variable};
use coldplate_tables::{Column, Table};

pub use thin::{MOST_READINGS, thinned, thinned_evenly};
pub use uncertainty::{Uncertainty, VariableUncertainty};
pub use whiten::Whitener;

/// Largest displacement that a machine can have, um. Chosen: larger numbers point to a wrong unit.
const FARTHEST: f64 = 1e5;
/// Name of the column with the test of each row.
pub const TEST: &str = "test";
/// Name of the column of times.
pub const TIME: &str = "time";
/// Bounds of plausible temperatures of a machine, K. Chosen: numbers outside point to a wrong unit.
const PLAUSIBLE: (f64, f64) = (150.0, 1500.0);
/// Values outside the plausible bounds that scanners write if a sensor does not answer, degC: a missing reading. Chosen: any
/// other such value is refused.
const NO_ANSWER: [f64; 4] = [-127.0, -999.0, -9999.0, 9999.0];
/// Numbers that are usual temperatures of such machines in kelvin, and hardly ever in degC. Chosen: a wider range refuses hot
/// machines.
const LIKE_KELVIN: std::ops::Range<f64> = 250.0..420.0;

/// One row of readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name of the test of the row.
    pub test: String,
    /// Time, s, in a log.
    pub time: Option<f64>,
    /// Condition of the readings.
    pub condition: Condition,
    /// Readings of [`Data::sensors`], K; `None` where missing.
    pub readings: Vec<Option<f64>>,
    /// Line of the file, if known.
    pub line: Option<usize>,
}

/// Measured data.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// Source of the data: a path or a description.
    pub source: String,
    /// Sensors of the machine that were read, as indices into [`Machine::sensors`].
    pub sensors: Vec<usize>,
    /// Names of these sensors.
    pub names: Vec<String>,
    /// The rows.
    pub rows: Vec<Row>,
    /// Remarks, such as on readings that were left out.
    pub notes: Vec<String>,
}

impl Data {
    /// Reads a table for `machine`.
    ///
    /// # Errors
    /// The file is no table; a column that is neither condition, sensor, `test` nor `time`; a unit of another kind; a condition
    /// that is missing; a reading that is no temperature; two rows of a test at the same time with the same conditions and
    /// other readings; no reading at all. Each names its line and column.
    pub fn read(path: &Path, machine: &Machine) -> Result<Self> {
        let (table, lines) = Table::read_with_lines(path)?;
        Self::from_table(&table, &lines, machine, &path.display().to_string()).map_err(|e| e.in_file(path))
    }

    /// Data from a table; `lines` are those of its header and rows, as far as they are known.
    ///
    /// # Errors
    /// Errors of [`Data::read`].
    pub fn from_table(table: &Table, lines: &[usize], machine: &Machine, source: &str) -> Result<Self> {
        let line = |row: usize| lines.get(row + 1).copied();
        let place = |e: Error, row: usize| match line(row) {
            Some(line) => e.at_line(line),
            None => e,
        };
        let mut notes = Vec::new();
        let is_variable = |name: &str| machine.variables.iter().any(|v| v.name == name);
        let sensor_of = |name: &str| machine.sensors.iter().position(|s| s.name == name);
        for text in &table.texts {
            if is_variable(&text.name) || sensor_of(&text.name).is_some() {
                table.column(&text.name)?; // says that the unit is missing
            }
            if text.name != TEST && text.name != "note" {
                return Err(unknown(&text.name, machine));
            }
        }
        let mut variables: Vec<(usize, &Column)> = Vec::new();
        let mut sensors: Vec<(usize, Vec<f64>)> = Vec::new();
        for column in table.columns.iter().filter(|c| c.name != TIME) {
            if let Some(variable) = machine.variables.iter().position(|v| v.name == column.name) {
                units::convert(300.0, &column.unit, machine.variables[variable].dimension).map_err(|e| e.at_key(column.header()))?;
                variables.push((variable, column));
            } else if let Some(sensor) = sensor_of(&column.name) {
                let own = machine.sensors[sensor].measurand();
                let values = table.column_si(&column.name, own.dimension())?;
                sensors.push((sensor, values.into_iter().map(|si| own.of_si(si)).collect()));
            } else {
                return Err(unknown(&column.name, machine));
            }
        }
        let times = if table.columns.iter().any(|c| c.name == TIME) { Some(table.column_si(TIME, Dimension::TIME)?) } else { None };
        let tests = table.text(TEST);
        let mut rows: Vec<Row> = Vec::with_capacity(table.rows());
        let mut latest: HashMap<String, (f64, usize)> = HashMap::new();
        for r in 0..table.rows() {
            let test = match (tests.map(|t| t.values[r].trim()), &times) {
                (Some(""), _) => return Err(place(Error::input("this row has no name of its test").at_key(TEST), r)),
                (Some(name), _) => name.to_string(),
                (None, Some(_)) => "log".to_string(),
                (None, None) => format!("row {}", r + 1),
            };
            let time = times.as_ref().map(|t| t[r]);
            if time.is_some_and(f64::is_nan) {
                return Err(place(Error::input("this row has no time").at_key(TIME).help("give every row its time, or remove it"), r));
            }
            let mut given: Vec<(&str, String)> = Vec::with_capacity(variables.len() + 1);
            if let Some(time) = time.filter(|_| is_variable(TIME)) {
                given.push((TIME, format!("{time:?} s")));
            }
            for (_, column) in &variables {
                if column.values[r].is_nan() {
                    let error = Error::input("a condition is missing").at_key(column.header());
                    return Err(place(error.help("readings mean nothing without their condition: fill it in, or remove the row"), r));
                }
                given.push((&column.name, format!("{:?} {}", column.values[r], column.unit)));
            }
            for (v, column) in &variables {
                possible(&machine.variables[*v], column, column.values[r]).map_err(|e| place(e, r))?;
            }
            let pairs: Vec<(&str, &str)> = given.iter().map(|(n, v)| (*n, v.as_str())).collect();
            let condition = machine.condition(&pairs).map_err(|e| place(e, r))?;
            let mut readings = Vec::with_capacity(sensors.len());
            for (sensor, values) in &sensors {
                let value = values[r];
                let is_length = machine.sensors[*sensor].measurand() == Measurand::Displacement;
                if value.is_nan() {
                    readings.push(None);
                } else if is_length && value.abs() < FARTHEST {
                    readings.push(Some(value));
                } else if is_length {
                    let error = Error::input("this reading is no displacement of a machine").at_key(&machine.sensors[*sensor].name);
                    return Err(place(error.read(format!("{value:.1} um")).help("check the unit in the header"), r));
                } else if (PLAUSIBLE.0..PLAUSIBLE.1).contains(&value) {
                    readings.push(Some(value));
                } else if NO_ANSWER.iter().any(|sign| (celsius(value) - sign).abs() < 1e-3) {
                    let at = line(r).map_or(String::new(), |line| format!(" (line {line})"));
                    let (name, shown) = (&machine.sensors[*sensor].name, celsius(value));
                    notes.push(format!(
                        "row {}{at}, '{name}': {shown:.0} degC is the sign of a sensor that does not answer: left out",
                        r + 1
                    ));
                    readings.push(None);
                } else {
                    let error = Error::input("this reading is no temperature of a machine").at_key(&machine.sensors[*sensor].name);
                    let error = error.read(format!("{:.1} degC", Celsius::from(Kelvin(value)).0));
                    return Err(place(error.help("check the unit in the header; leave the cell empty where the sensor failed"), r));
                }
            }
            if let Some(time) = time
                && let Some((before, other)) = latest.insert(test.clone(), (time, rows.len()))
                && time <= before
            {
                let earlier = &rows[other];
                let there = earlier.line.map_or(String::new(), |l| format!(" in line {l}"));
                if time < before {
                    let error = Error::input("the times are not in order").read(format!("{time} s after {before} s{there}"));
                    return Err(place(error.at_key(TIME).help("sort the rows of each test by time"), r));
                }
                let differs = |(a, b): (&Option<f64>, &Option<f64>)| a.is_some() && b.is_some() && a != b;
                if earlier.condition == condition && earlier.readings.iter().zip(&readings).any(differs) {
                    let error = Error::input(format!("two rows of '{test}' stand at {time} s")).read(format!("{time} s, as{there}"));
                    let help = "keep one row for each time; a step is two rows with conditions that differ";
                    return Err(place(error.at_key(TIME).help(help), r));
                }
                // At an equal time, other conditions are a step and equal ones a copy. Readings of one time count once.
                let both = rows[other].readings.iter_mut().zip(&mut readings);
                both.for_each(|(earlier, later)| *earlier = earlier.or(later.take()));
                readings.fill(None);
            }
            rows.push(Row { test, time, condition, readings, line: line(r) });
        }
        for (k, (sensor, _)) in sensors.iter().enumerate() {
            let name = &machine.sensors[*sensor].name;
            if let Some(column) = table.columns.iter().find(|c| c.name == *name && c.unit.trim() == "degC")
                && let Some(first) = like_kelvin(&rows, k, machine)
            {
                let error = Error::input("the readings of this sensor look like kelvin, not degC").at_key(column.header());
                let error = error.read(format!("{:.1} degC", column.values[first]));
                return Err(place(
                    error.help(format!("write '{name} [K]' in the header; if they really are that hot, give them in kelvin as well")),
                    first,
                ));
            }
            if rows.iter().all(|row| row.readings[k].is_none()) {
                notes.push(format!("'{}' has a column but no reading", machine.sensors[*sensor].name));
            }
        }
        let missing: Vec<&str> = machine
            .variables
            .iter()
            .enumerate()
            .filter(|(v, _)| variables.iter().all(|(c, _)| c != v))
            .map(|(_, v)| v.name.as_str())
            .collect();
        if !missing.is_empty() {
            notes.push(format!("no column for {}: taken at the machine's default", missing.join(", ")));
        }
        notes.extend(beyond::remarks(&rows, machine));
        let sensors: Vec<usize> = sensors.into_iter().map(|(s, _)| s).collect();
        let names = sensors.iter().map(|s| machine.sensors[*s].name.clone()).collect();
        Self { source: source.to_string(), sensors, names, rows, notes }.checked()
    }

    /// Measurements of the machine file itself.
    ///
    /// # Errors
    /// A measurement without a value of a variable that has no default; no reading at all.
    pub fn of_machine(machine: &Machine) -> Result<Self> {
        let mut sensors: Vec<usize> = machine.measurements.iter().flat_map(|m| m.readings.iter().map(|(s, _)| *s)).collect();
        sensors.sort_unstable();
        sensors.dedup();
        let row = |m: &coldplate_describe::machine::Measurement| -> Result<Row> {
            let value = |(v, variable): (usize, &coldplate_describe::machine::Variable)| {
                m.condition.iter().find(|(own, _)| *own == v).map(|(_, si)| *si).or(variable.default).ok_or_else(|| {
                    Error::input(format!("the measurement '{}' says nothing of '{}', which has no default", m.name, variable.name))
                })
            };
            let condition = machine.variables.iter().enumerate().map(value).collect::<Result<_>>()?;
            Ok(Row {
                test: m.name.clone(),
                time: None,
                condition: Condition::from_si(condition),
                readings: sensors.iter().map(|s| m.readings.iter().find(|(own, _)| own == s).map(|(_, t)| *t)).collect(),
                line: None,
            })
        };
        let rows = machine.measurements.iter().map(row).collect::<Result<_>>()?;
        let names = sensors.iter().map(|s| machine.sensors[*s].name.clone()).collect();
        Self { source: "the machine file".into(), sensors, names, rows, notes: Vec::new() }.checked()
    }

    /// A reading of a column (K or um) in the unit of display, degC or um.
    pub fn shown(&self, machine: &Machine, column: usize, reading: f64) -> f64 {
        machine.sensors[self.sensors[column]].measurand().shown(reading)
    }

    /// Measurand of each column.
    pub fn measurands(&self, machine: &Machine) -> Vec<Measurand> {
        self.sensors.iter().map(|s| machine.sensors[*s].measurand()).collect()
    }

    fn checked(mut self) -> Result<Self> {
        // Rows without any reading are of no use, except in a log, where they state the conditions.
        let before = self.rows.len();
        if self.is_transient() {
            self.logs_last()?;
        } else {
            self.rows.retain(|row| row.readings.iter().any(Option::is_some));
        }
        match before - self.rows.len() {
            0 => {}
            1 => self.notes.push("1 row without a reading was left out".into()),
            n => self.notes.push(format!("{n} rows without a reading were left out")),
        }
        if self.count() == 0 {
            return Err(Error::input("there is not one reading of a sensor of this machine")
                .help("name the columns after the machine's sensors: 'NAME [degC]'"));
        }
        Ok(self)
    }

    /// Checks that every test of a log has a beginning and an end.
    fn logs_last(&self) -> Result<()> {
        let mut rows: HashMap<&str, usize> = HashMap::new();
        for row in &self.rows {
            *rows.entry(&row.test).or_insert(0) += 1;
        }
        let alone = self.rows.iter().find(|row| rows.get(row.test.as_str()).is_some_and(|count| *count == 1));
        let Some(row) = alone else { return Ok(()) };
        let error = Error::input(format!("the log '{}' has one row only", row.test)).at_key(TIME);
        let error = error.help("a log needs at least two times; without a time column each row is a steady reading");
        Err(match row.line {
            Some(line) => error.at_line(line),
            None => error,
        })
    }

    /// Whether the rows are logs over time.
    pub fn is_transient(&self) -> bool {
        self.rows.iter().any(|row| row.time.is_some())
    }

    /// Number of readings.
    pub fn count(&self) -> usize {
        self.rows.iter().map(|row| row.readings.iter().flatten().count()).sum()
    }

    /// Names of the tests, in their order in the data.
    pub fn tests(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for row in &self.rows {
            if !names.contains(&row.test) {
                names.push(row.test.clone());
            }
        }
        names
    }

    /// The rows of some tests, and all others.
    ///
    /// # Errors
    /// A test that is not there; nothing left.
    pub fn split(&self, chosen: &[String]) -> Result<(Data, Data)> {
        let tests = self.tests();
        if let Some(name) = chosen.iter().find(|name| !tests.contains(name)) {
            let error = Error::input(format!("there is no test '{name}'")).at_key(TEST).read(name);
            return Err(match did_you_mean(name, tests.iter().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean '{near}'?")),
                None => error.help(format!("tests here: {}", tests.join(", "))),
            });
        }
        let part =
            |keep: bool| Data { rows: self.rows.iter().filter(|r| chosen.contains(&r.test) == keep).cloned().collect(), ..self.clone() };
        Ok((part(true), part(false)))
    }
}

/// Checks that a condition can be meant as it is written.
fn possible(variable: &Variable, column: &Column, value: f64) -> Result<()> {
    if variable.dimension == Dimension::VOLUME_FLOW && value < 0.0 {
        let error = Error::input("a flow is negative").at_key(column.header()).read(value);
        return Err(error.help("give its amount: the machine file says which way the water runs"));
    }
    let is_in_range = |si: f64| variable.range.is_some_and(|(low, high)| (low..=high).contains(&si));
    let si = units::convert(value, &column.unit, variable.dimension)?;
    if variable.dimension == Dimension::TEMPERATURE && column.unit.trim() == "degC" && LIKE_KELVIN.contains(&value) && !is_in_range(si) {
        let error = Error::input("this temperature looks like kelvin, not degC").at_key(column.header()).read(value);
        return Err(error.help(format!("write '{} [K]' in the header", column.name)));
    }
    Ok(())
}

/// First row of a column in degC that seems to hold kelvin: all its readings would be near its conditions in kelvin, and are
/// far hotter as they stand. `None` otherwise.
fn like_kelvin(rows: &[Row], column: usize, machine: &Machine) -> Option<usize> {
    let mut first = None;
    for (r, row) in rows.iter().enumerate() {
        let Some(kelvin) = row.readings[column] else { continue };
        let around = machine.variables.iter().zip(row.condition.si()).filter(|(v, _)| v.dimension == Dimension::TEMPERATURE);
        let hottest = around.map(|(_, t)| *t).fold(f64::NEG_INFINITY, f64::max);
        if !LIKE_KELVIN.contains(&Celsius::from(Kelvin(kelvin)).0) || kelvin - hottest < 150.0 {
            return None;
        }
        first.get_or_insert(r);
    }
    first
}

fn unknown(name: &str, machine: &Machine) -> Error {
    let known: Vec<&str> = machine
        .variables
        .iter()
        .map(|v| v.name.as_str())
        .chain(machine.sensors.iter().map(|s| s.name.as_str()))
        .chain([TEST, TIME])
        .collect();
    let error = Error::input(format!("'{name}' is neither a condition nor a sensor of this machine")).at_key(name);
    match did_you_mean(name, known.iter().copied()) {
        Some(near) => error.help(format!("did you mean '{near}'?")),
        None => error.help(format!("known: {}", known.join(", "))),
    }
}
