//! Uncertainty of readings, with a note where no file states it.

use std::path::Path;

use super::output::Output;
use coldplate_base::error::Result;
use coldplate_describe::machine::Machine;
use coldplate_evidence::command_input::stated;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty};

/// Uncertainty of the readings: from `DATA.toml` beside the table, or default values, with a note.
///
/// # Errors
/// Errors of [`MeasurementUncertainty::beside`].
pub fn uncertainty(
    table: Option<&Path>,
    machine_file: &Path,
    data: &Data,
    machine: &Machine,
    out: Output,
) -> Result<MeasurementUncertainty> {
    let found = stated(table, machine_file, data, machine)?;
    if found.file.is_none() {
        out.note("note: no file says how uncertain the readings are; taking limits of 0.1 K for readings, sensors and water, 0.05 L/min");
    }
    data.notes.iter().for_each(|note| out.note(&format!("note: {note}")));
    Ok(found)
}
