//! Conditions and outputs, row by row, with names, units and provenance.
//!
//! The common form of all results: a sweep writes a table, a fit reads one, measured data are one. Values keep the unit
//! of their column, as in the file.
//!
//! ```
//! use coldplate_tables::Table;
//! use coldplate_base::units::Dimension;
//! let text = "test, coolant_flow [L/min], motor [degC]\nfirst, 9.42, 21.5\nsecond, 4.71,\n";
//! let table = Table::from_csv(text, "data.csv").unwrap();
//! assert_eq!(table.column("motor").unwrap().values[0], 21.5);
//! assert!(table.column("motor").unwrap().values[1].is_nan()); // a missing reading
//! assert_eq!(table.text("test").unwrap().values, ["first", "second"]);
//! assert_eq!(table.column_si("motor", Dimension::TEMPERATURE).unwrap()[0], 294.65);
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

mod aligned;
mod cell;
mod csv;
mod decoded;
mod frame;
mod header;
mod layout;
mod ledger;
mod parquet;
mod reader;
mod records;
mod spreadsheet;
mod stamps;
mod statistic;

use std::path::Path;

pub use csv::{cells, quoted};
pub use ledger::Ledger;
pub use stamps::{TIME, is_stamp};

use decoded::decoded;

use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{self, Dimension};
use coldplate_base::{atomic_file, condition, input};

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");

/// A column of numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Column {
    /// Name, for example `coolant_flow`.
    pub name: String,
    /// Unit of the values, for example `L/min`; `1` for a pure number.
    pub unit: String,
    /// Values, one per row; NaN for a missing one.
    pub values: Vec<f64>,
}

impl Column {
    /// `name [unit]`, as in the header of a file.
    pub fn header(&self) -> String {
        format!("{} [{}]", self.name, self.unit)
    }
}

/// A column of text, such as the name of a test.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TextColumn {
    /// Name; text columns have no unit in a file.
    pub name: String,
    /// Texts, one per row.
    pub values: Vec<String>,
}

/// Conditions × outputs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Text columns.
    pub texts: Vec<TextColumn>,
    /// Number columns; the first [`Table::inputs`] are the condition variables.
    pub columns: Vec<Column>,
    /// Number of condition variables among the columns.
    pub inputs: usize,
    /// Origin of the numbers: key and value, one line each.
    pub provenance: Vec<(String, String)>,
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map(|c| c.values.len()).or_else(|| self.texts.first().map(|t| t.values.len())).unwrap_or(0)
    }

    /// The condition variables.
    pub fn conditions(&self) -> &[Column] {
        &self.columns[..self.inputs.min(self.columns.len())]
    }

    /// The number columns that are not condition variables.
    pub fn outputs(&self) -> &[Column] {
        &self.columns[self.inputs.min(self.columns.len())..]
    }

    /// The number column called `name`.
    ///
    /// # Errors
    /// There is none, or it is text; a similar name is suggested.
    pub fn column(&self, name: &str) -> Result<&Column> {
        if let Some(column) = self.columns.iter().find(|c| c.name == name) {
            return Ok(column);
        }
        if self.text(name).is_some() {
            return Err(Error::input(format!("the column '{name}' is text, because its header has no unit"))
                .at_key(name)
                .help(format!("write the header as '{name} [unit]', with [1] for a pure number")));
        }
        let names: Vec<&str> = self.columns.iter().map(|c| c.name.as_str()).collect();
        let help = match did_you_mean(name, names.iter().copied()) {
            Some(meant) => format!("did you mean '{meant}'?"),
            None => format!("columns here: {}", names.join(", ")),
        };
        Err(Error::input(format!("there is no column '{name}'")).at_key(name).help(help))
    }

    /// The text column called `name`, if there is one.
    pub fn text(&self, name: &str) -> Option<&TextColumn> {
        self.texts.iter().find(|t| t.name == name)
    }

    /// The values of a column in SI; NaN for a missing one.
    ///
    /// # Errors
    /// There is no column of this name, or its unit is not one of `dimension`.
    pub fn column_si(&self, name: &str, dimension: Dimension) -> Result<Vec<f64>> {
        let column = self.column(name)?;
        let place = |e: Error| e.at_key(column.header());
        let si = |v: &f64| if v.is_nan() { Ok(f64::NAN) } else { units::convert(*v, &column.unit, dimension).map_err(place) };
        column.values.iter().map(si).collect()
    }

    /// The rows for which `keep` holds.
    #[must_use]
    pub fn select(&self, keep: impl Fn(usize) -> bool) -> Table {
        let rows: Vec<usize> = (0..self.rows()).filter(|row| keep(*row)).collect();
        let mut table = self.clone();
        for column in &mut table.columns {
            column.values = rows.iter().map(|row| column.values[*row]).collect();
        }
        for column in &mut table.texts {
            column.values = rows.iter().map(|row| column.values[*row].clone()).collect();
        }
        table
    }

    /// Makes the columns `names`, in this order, the condition variables; the others follow in their order.
    ///
    /// # Errors
    /// Errors of [`Table::column`].
    pub fn make_inputs(&mut self, names: &[&str]) -> Result<()> {
        for name in names {
            self.column(name)?;
        }
        let place = |c: &Column| names.iter().position(|n| *n == c.name).unwrap_or(names.len());
        self.columns.sort_by_key(place);
        self.inputs = self.columns.iter().filter(|c| place(c) < names.len()).count();
        Ok(())
    }

    /// Makes the columns of the variables that every machine has the condition variables.
    fn usual_inputs(&mut self) {
        let is_other = |c: &Column| !condition::NAMES.contains(&c.name.as_str());
        self.columns.sort_by_key(is_other);
        self.inputs = self.columns.iter().position(is_other).unwrap_or(self.columns.len());
    }

    /// Checks that all columns have equal lengths and different names.
    ///
    /// # Errors
    /// The error names the column that does not fit.
    pub fn check(&self) -> Result<()> {
        let rows = self.rows();
        let lengths = self.texts.iter().map(|t| (&t.name, t.values.len())).chain(self.columns.iter().map(|c| (&c.name, c.values.len())));
        let mut names = std::collections::HashSet::new();
        for (name, length) in lengths {
            if length != rows {
                return Err(Error::input(format!("the column has {length} rows where the others have {rows}")).at_key(name.as_str()));
            }
            if !names.insert(name.as_str()) {
                return Err(Error::input(format!("two columns are called '{name}'")).at_key(name.as_str()).help("rename one of them"));
            }
        }
        Ok(())
    }

    /// Reads a plain table: Parquet if the name ends in `.parquet`, the first or the named sheet of a workbook, CSV otherwise.
    ///
    /// # Errors
    /// The file cannot be read, or its content is not a table; something had to be assumed ([`Table::read_with_ledger`] takes
    /// such files).
    pub fn read(path: impl AsRef<Path>) -> Result<Table> {
        let path = path.as_ref();
        let (table, ledger) = Self::read_with_ledger(path)?;
        table.plain(&ledger, path)
    }

    /// Reads a table as loggers and spreadsheets write it, with the account of its lines.
    ///
    /// # Errors
    /// The file cannot be read, or its content is not a table.
    pub fn read_with_ledger(path: impl AsRef<Path>) -> Result<(Table, Ledger)> {
        let path = path.as_ref();
        if let Some((book, sheet)) = spreadsheet::named_sheet(path) {
            return spreadsheet::read(input::read(&book).map_err(|e| e.help("check the path"))?, Some(&sheet), path);
        }
        Self::from_bytes(input::read(path).map_err(|e| e.help("check the path"))?, path)
    }

    /// Reads the content of a file like [`Table::read_with_ledger`].
    ///
    /// # Errors
    /// The content is not a table.
    pub fn from_bytes(bytes: Vec<u8>, path: &Path) -> Result<(Table, Ledger)> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("parquet") => Table::from_parquet_with_ledger(bytes, path),
            Some(own) if spreadsheet::ENDINGS.contains(&own) => spreadsheet::read(bytes, None, path),
            _ => {
                let mut ledger = Ledger::default();
                let text = decoded(&bytes, path, &mut ledger)?;
                Table::from_text(&text, path, ledger)
            }
        }
    }

    /// The table, if nothing was assumed to read it.
    fn plain(self, ledger: &Ledger, path: &Path) -> Result<Table> {
        match ledger.doubt() {
            None => Ok(self),
            Some(doubt) => Err(Error::input(format!("this table is not plain: {doubt}"))
                .in_file(path)
                .help("write it as UTF-8 CSV: commas between cells, decimal points, a header name [unit], name [unit], ...")),
        }
    }

    /// Checks that a table can be written under this name.
    ///
    /// # Errors
    /// The name ends neither in `.csv` nor in `.parquet`.
    pub fn check_name(path: &Path) -> Result<()> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        // A device or a pipe has no ending; it receives text.
        match ending.as_deref() {
            None | Some("csv" | "parquet") => Ok(()),
            Some(other) => {
                Err(Error::input(format!("tables are not written as .{other}")).in_file(path).help("end the name in .csv or .parquet"))
            }
        }
    }

    /// Writes the table as `path` with the extension `.csv` and again with `.parquet`.
    ///
    /// # Errors
    /// The table is malformed or a file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        self.write_csv(&path.with_extension("csv"))?;
        self.write_parquet(&path.with_extension("parquet"))
    }

    /// Writes a CSV file.
    ///
    /// # Errors
    /// The table is malformed or the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        let text = self.to_csv()?;
        atomic_file::write(path, text.as_bytes())
    }

    /// Writes a Parquet file.
    ///
    /// # Errors
    /// The table is malformed or the file cannot be written.
    pub fn write_parquet(&self, path: &Path) -> Result<()> {
        let bytes = self.to_parquet()?;
        atomic_file::write(path, &bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Table {
        let column = |name: &str, unit: &str, values: &[f64]| Column { name: name.into(), unit: unit.into(), values: values.into() };
        Table {
            texts: vec![TextColumn { name: "test".into(), values: vec!["a".into(), "b, \"c\"".into(), "#d".into()] }],
            columns: vec![
                column("coolant_flow", "L/min", &[0.1 + 0.2, 1e-7, 9.42]),
                column("motor, front", "degC", &[21.5, f64::NAN, -1.0 / 3.0]),
                column("re", "1", &[5e300, f64::MIN_POSITIVE, -0.0]),
            ],
            inputs: 1,
            provenance: vec![("machine".into(), "rig: small".into())],
        }
    }

    fn bits(table: &Table) -> Vec<Vec<u64>> {
        table.columns.iter().map(|c| c.values.iter().map(|v| v.to_bits()).collect()).collect()
    }

    #[test]
    fn csv_gives_back_every_bit() {
        let table = sample();
        let back = Table::from_csv(&table.to_csv().unwrap(), "x.csv").unwrap();
        assert_eq!(bits(&back), bits(&table));
        assert_eq!((&back.texts, back.inputs, &back.provenance), (&table.texts, 1, &table.provenance));
        assert_eq!(back.columns[1].header(), "motor, front [degC]");
    }

    #[test]
    fn rows_and_inputs_can_be_chosen() {
        let mut table = sample().select(|row| row != 1);
        assert_eq!(table.rows(), 2);
        assert_eq!(table.text("test").unwrap().values, ["a", "#d"]);
        table.make_inputs(&["re", "coolant_flow"]).unwrap();
        assert_eq!(table.conditions().iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["re", "coolant_flow"]);
        assert_eq!(table.outputs()[0].name, "motor, front");
    }

    #[test]
    fn a_missing_column_suggests_its_name() {
        let message = sample().column("cooland_flow").unwrap_err().to_string();
        assert!(message.contains("did you mean 'coolant_flow'"), "{message}");
        let message = sample().column("test").unwrap_err().to_string();
        assert!(message.contains("test [unit]"), "{message}");
    }
}
