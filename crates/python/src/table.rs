//! Tables as columns: name, unit, numbers.

use std::path::PathBuf;

use coldplate_tables::{Column, Table, TextColumn};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::errors::told;

/// A table for Python: text columns, number columns with their units, number of condition columns, provenance.
pub type Given<'py> = (Vec<(String, Vec<String>)>, Vec<(String, String, Bound<'py, PyArray1<f64>>)>, usize, Vec<(String, String)>);

/// A table of the library for Python.
pub fn given(py: Python<'_>, table: Table) -> Given<'_> {
    let texts = table.texts.into_iter().map(|column| (column.name, column.values)).collect();
    let numbers = table.columns.into_iter().map(|c| (c.name, c.unit, c.values.into_pyarray(py))).collect();
    (texts, numbers, table.inputs, table.provenance)
}

/// Columns of Python as a table of the library.
pub type Columns<'py> = (Vec<(String, Vec<String>)>, Vec<(String, String, PyReadonlyArray1<'py, f64>)>, usize, Vec<(String, String)>);

/// The table made from Python's columns.
pub fn taken(py: Python<'_>, (texts, numbers, inputs, provenance): Columns<'_>) -> PyResult<Table> {
    let columns = numbers.into_iter().map(|(name, unit, values)| Column { name, unit, values: values.as_array().to_vec() }).collect();
    let texts = texts.into_iter().map(|(name, values)| TextColumn { name, values }).collect();
    let table = Table { texts, columns, inputs, provenance };
    told(py, table.check())?;
    Ok(table)
}

/// Reads a table of conditions and outputs from CSV or Parquet.
#[pyfunction]
pub fn read_table(py: Python<'_>, path: PathBuf) -> PyResult<Given<'_>> {
    let table = told(py, py.detach(|| Table::read(&path)))?;
    Ok(given(py, table))
}
