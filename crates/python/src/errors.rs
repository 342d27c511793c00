//! Errors of the library as Python exceptions, with the text of the command line.

use coldplate::Error;
use coldplate_base::error::Kind;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// The Python exception for an error of the library.
pub fn raised(py: Python<'_>, error: &Error) -> PyErr {
    let name = if error.kind() == Kind::Input { "InputError" } else { "NumericsError" };
    let class = py.import("coldplate._errors").and_then(|module| module.getattr(name));
    match class.and_then(|class| class.cast_into::<PyType>().map_err(PyErr::from)) {
        Ok(class) => PyErr::from_type(class, error.to_string()),
        Err(missing) => missing,
    }
}

/// A result of the library for Python.
pub fn told<T>(py: Python<'_>, result: coldplate::Result<T>) -> PyResult<T> {
    result.map_err(|error| raised(py, &error))
}

/// Bad input of the Python layer.
pub fn wrong(py: Python<'_>, what: impl Into<String>) -> PyErr {
    raised(py, &Error::input(what))
}

/// A record as JSON, as on the command line.
pub fn json(py: Python<'_>, record: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(record).map_err(|e| wrong(py, format!("this result cannot be written as JSON: {e}")))
}
