//! Readings and schedules: files, or columns of Python.

use std::path::{Path, PathBuf};

use coldplate::Machine;
use coldplate_evidence::command_input;
use coldplate_evidence::measurement::{BetweenRows, Data, MeasurementUncertainty, ReadingSettings};
use coldplate_explore::schedule::{Quantities, Schedule, ScheduleOptions};
use coldplate_tables::{Ledger, Table};
use pyo3::prelude::*;

use crate::table::{Columns, taken};

/// Name of columns of Python in results and errors.
const FRAME: &str = "data frame";

/// A table of readings or a schedule, as Python gives it: the path of a file, or columns.
pub type Named<'py> = (Option<PathBuf>, Option<Columns<'py>>);

/// A table of readings or a schedule.
pub enum Source {
    /// The readings of the machine file.
    Machine,
    /// A file, with the file of instruments beside it.
    File(PathBuf),
    /// Columns, and the file that says how uncertain their readings are.
    Frame { table: Table, instruments: Option<PathBuf> },
}

impl Source {
    /// The source that Python names; `instruments` belongs to columns alone.
    pub fn of(py: Python<'_>, (path, columns): Named<'_>, instruments: Option<PathBuf>) -> PyResult<Self> {
        Ok(match (path, columns) {
            (Some(path), _) => Self::File(path),
            (None, Some(columns)) => Self::Frame { table: taken(py, columns)?, instruments },
            (None, None) => Self::Machine,
        })
    }

    /// Path of the file, or what columns are called.
    pub fn words(&self) -> String {
        self.path().map_or_else(|| FRAME.into(), |path| path.display().to_string())
    }

    fn path(&self) -> Option<&Path> {
        if let Self::File(path) = self { Some(path) } else { None }
    }

    /// The readings with their uncertainty.
    pub fn readings(&self, machine_file: &Path, machine: &Machine) -> coldplate::Result<(Data, MeasurementUncertainty)> {
        let Self::Frame { table, instruments } = self else {
            let data = command_input::data(self.path(), &BetweenRows::default(), machine)?;
            let uncertainty = command_input::stated(self.path(), machine_file, &data, machine)?;
            return Ok((data, uncertainty));
        };
        let settings = instruments.as_deref().map(ReadingSettings::beside).transpose()?.unwrap_or_default();
        let data = Data::from_table(table.clone(), Ledger::default(), &settings, machine, FRAME)?;
        let uncertainty = match instruments {
            Some(path) => MeasurementUncertainty::read(path, &data, machine)?,
            None => MeasurementUncertainty::usual(&data, machine),
        };
        Ok((data, uncertainty))
    }

    /// The schedule; `given` are values of variables without a column.
    pub fn schedule<'a>(&self, of: impl Into<Quantities<'a>>, given: &[(String, String)]) -> coldplate::Result<Schedule> {
        let options = ScheduleOptions { hold: false, repeat: 1, until: None };
        match self {
            Self::File(path) => Schedule::read(path, of, given, options),
            Self::Frame { table, .. } => {
                let (mut table, mut ledger) = (table.clone(), Ledger::default());
                table.read_stamps(&mut ledger, None)?;
                Schedule::from_table(&table, &ledger, of, given, options)
            }
            Self::Machine => Err(coldplate::Error::input("no schedule is given").help("name a file, or give columns with a column time")),
        }
    }
}
