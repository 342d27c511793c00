//! coldplate for Python: the part in Rust, behind the Python package `coldplate`.
//!
//! Conditions go in and values come out as arrays; other results come out as the JSON of the command line, which the
//! package reads. Long work runs on a thread of its own, so that Ctrl-C stops it.

mod errors;
mod pipeline;
mod readings;
mod reduced;
mod surrogate;
mod table;
mod work;

use pyo3::prelude::*;

/// The native part of the package `coldplate`.
#[pymodule]
fn _coldplate(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<surrogate::Surrogate>()?;
    module.add_class::<pipeline::Machine>()?;
    module.add_class::<reduced::Reduced>()?;
    module.add_function(wrap_pyfunction!(pipeline::sweep, module)?)?;
    module.add_function(wrap_pyfunction!(pipeline::fit, module)?)?;
    module.add_function(wrap_pyfunction!(pipeline::identify, module)?)?;
    module.add_function(wrap_pyfunction!(pipeline::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(table::read_table, module)?)?;
    module.add_function(wrap_pyfunction!(rescaling, module)?)?;
    module.add_function(wrap_pyfunction!(pipeline::write_file, module)?)?;
    Ok(())
}

/// Factor and offset from values in one unit to values in another.
#[pyfunction]
fn rescaling(py: Python<'_>, from: &str, to: &str) -> PyResult<(f64, f64)> {
    errors::told(py, coldplate_base::units::rescaling(from, to))
}
