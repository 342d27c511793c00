//! Measured data: readings by condition, from a table or from the machine file, with their uncertainty.
//!
//! A table has one row per reading time: `test`, the conditions and the sensors, units in the header; with a column
//! `time [s]` each test is a log. An empty cell is a missing reading. Beside `DATA.csv` may stand `DATA.toml`, which says
//! how uncertain readings and conditions are ([`MeasurementUncertainty`]).

mod bare_times;
mod beyond;
pub mod filter;
mod from_table;
mod hold_out;
mod measured_heats;
mod reading;
mod repeated_times;
mod spelling;
mod thin;
mod uncertainty;
pub mod wander;
pub mod whiten;

use std::collections::HashMap;
use std::path::Path;

use serde::Serialize;

use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::Measurand;
use coldplate_describe::machine::{Condition, DescribedVariable, Machine, Measurement};
use coldplate_tables::{Ledger, Table};

pub use hold_out::{DividedData, HoldOut};
pub use measured_heats::MeasuredHeat;
pub use reading::{BetweenRows, ReadingSettings};
pub use thin::{MOST_READINGS, thinned, thinned_evenly};
pub use uncertainty::{MeasurementUncertainty, VariableUncertainty};
pub use whiten::Whitener;

/// Name of the column with the test of each row.
pub const TEST: &str = "test";
pub use coldplate_tables::TIME;

/// One row of readings.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadingRow {
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

impl ReadingRow {
    /// Whether any sensor was read.
    pub fn has_readings(&self) -> bool {
        self.readings.iter().any(Option::is_some)
    }
}

/// Measured data.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Data {
    /// Source of the data: a path or a description.
    pub source: String,
    /// Sensors of the machine that were read, as indices into [`Machine::sensors`].
    pub sensors: Vec<usize>,
    /// Names of these sensors.
    pub names: Vec<String>,
    /// The rows.
    pub rows: Vec<ReadingRow>,
    /// Whether each variable of the machine stays until the next row of a log instead of running straight to it; variables beyond
    /// the end run straight.
    pub held: Vec<bool>,
    /// Account of the lines of the file.
    pub ledger: Ledger,
    /// Remarks, such as on readings that were left out.
    pub notes: Vec<String>,
}

/// Account of the data as outside programs read it: lines and readings that count, and those that do not.
#[derive(Debug, Clone, Serialize)]
pub struct AccountRecord {
    /// Account of the lines of the file.
    #[serde(flatten)]
    pub file: Ledger,
    /// Readings that count.
    pub readings: usize,
    /// Every sentence that the command prints on the data.
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
        Self::read_as(path, &BetweenRows::default(), machine)
    }

    /// Reads a table of which more is known than it and the file beside it say.
    ///
    /// # Errors
    /// Errors of [`Data::read`]; a statement on a condition that the machine has not.
    pub fn read_as(path: &Path, given: &BetweenRows, machine: &Machine) -> Result<Self> {
        let settings = ReadingSettings { given: given.clone(), ..ReadingSettings::beside(path)? };
        let (table, ledger) = Table::read_with_ledger(path)?;
        Self::from_table(table, ledger, &settings, machine, &path.display().to_string()).map_err(|e| e.in_file(path))
    }

    /// Data from a table with the account of its lines.
    ///
    /// # Errors
    /// Errors of [`Data::read`].
    pub fn from_table(mut table: Table, mut ledger: Ledger, settings: &ReadingSettings, machine: &Machine, source: &str) -> Result<Self> {
        table.read_stamps(&mut ledger, settings.zone.as_deref())?;
        spelling::settle(&mut table, &mut ledger, machine);
        from_table::read(&table, ledger, settings, machine, source)
    }

    /// Measurements of the machine file itself.
    ///
    /// # Errors
    /// A measurement without a value of a variable that has no default; no reading at all.
    pub fn of_machine(machine: &Machine) -> Result<Self> {
        let mut sensors: Vec<usize> = machine.measurements.iter().flat_map(|m| m.readings.iter().map(|(s, _)| *s)).collect();
        sensors.sort_unstable();
        sensors.dedup();
        let row = |m: &Measurement| -> Result<ReadingRow> {
            let value = |(v, variable): (usize, &DescribedVariable)| {
                m.condition.iter().find(|(own, _)| *own == v).map(|(_, si)| *si).or(variable.default).ok_or_else(|| {
                    Error::input(format!("the measurement '{}' says nothing of '{}', which has no default", m.name, variable.name))
                })
            };
            let condition = machine.variables.iter().enumerate().map(value).collect::<Result<_>>()?;
            Ok(ReadingRow {
                test: m.name.clone(),
                time: None,
                condition: Condition::from_si(condition),
                readings: sensors.iter().map(|s| m.readings.iter().find(|(own, _)| own == s).map(|(_, t)| *t)).collect(),
                line: None,
            })
        };
        let rows = machine.measurements.iter().map(row).collect::<Result<_>>()?;
        let names = sensors.iter().map(|s| machine.sensors[*s].name.clone()).collect();
        Self { source: "the machine file".into(), sensors, names, rows, ..Self::default() }.checked()
    }

    /// The account of the reading of the data for other programs.
    pub fn account(&self) -> AccountRecord {
        AccountRecord { file: self.ledger.clone(), readings: self.count(), notes: self.notes.clone() }
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
        let stands = |row: &&ReadingRow| self.rows.iter().filter(|own| own.test == row.test).all(|own| own.time == row.time);
        let (row, what) = match alone {
            Some(row) => (row, format!("the log '{}' has one row only", row.test)),
            None => {
                let last = self.tests().into_iter().filter_map(|test| self.rows.iter().rfind(|row| row.test == test));
                let Some(row) = last.into_iter().find(stands) else { return Ok(()) };
                (row, format!("all rows of the log '{}' stand at {} s", row.test, row.time.unwrap_or(0.0)))
            }
        };
        let error = Error::input(what).at_key(TIME);
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
