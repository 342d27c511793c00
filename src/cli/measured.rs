//! Options of commands with readings, the uncertainty of readings with a note where no file states it, and tables of readings
//! before and after a change.

use std::collections::HashMap;
use std::path::Path;

use super::output::Output;
use super::text::table;
use coldplate_base::error::Result;
use coldplate_describe::machine::Machine;
use coldplate_evidence::command_input::stated;
use coldplate_evidence::measurement::{BetweenRows, Data, DividedData, MeasurementUncertainty, whiten};
use coldplate_evidence::record::{HeldOut, RmseRecord};

/// How the readings are taken, as command-line options.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct DataArgs {
    /// Hold readings out of the fit and predict them untouched: a test by its name, 20% (the last share of each log; of a steady table
    /// tests evenly chosen), or every:5 (every fifth of the blocks of each log, or every fifth test); may be repeated
    #[arg(long = "hold-out", value_name = "TEST|20%|every:5")]
    pub hold_out: Vec<String>,
    /// A condition that stays until the next row of a log, whatever header and DATA.toml say; may be repeated
    #[arg(long, value_name = "COLUMN")]
    held: Vec<String>,
    /// A condition that runs straight to the next row of a log, whatever header and DATA.toml say; may be repeated
    #[arg(long, value_name = "COLUMN")]
    joined: Vec<String>,
}

impl DataArgs {
    /// Statements on conditions between two rows.
    pub fn between(&self) -> BetweenRows {
        BetweenRows { held: self.held.clone(), joined: self.joined.clone() }
    }

    /// Data divided as the options ask, with a note; `None` if no reading is held out.
    ///
    /// # Errors
    /// Errors of [`DividedData::held_out`].
    pub fn divided(&self, data: &Data, out: Output) -> Result<Option<DividedData>> {
        if self.hold_out.is_empty() {
            return Ok(None);
        }
        let divided = DividedData::held_out(data, &self.hold_out)?;
        out.note(&format!("note: {}", divided.words));
        Ok(Some(divided))
    }
}

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

/// Readings that took no part beside their predictions: of logs each sensor and test, and the last reading of each test.
pub fn not_used(held_out: &HeldOut, machine: &Machine) -> String {
    let HeldOut { data, before, after, .. } = held_out;
    let spread = |rmse: &RmseRecord| -> Vec<String> {
        let kelvins = rmse.rmse_before_K.zip(rmse.rmse_after_K).map(|pair| (pair, "K"));
        let micrometres = rmse.rmse_before_um.zip(rmse.rmse_after_um).map(|pair| (pair, "um"));
        let words = |((before, after), unit)| format!("{after:.3} {unit}, {before:.3} {unit} before");
        kelvins.into_iter().chain(micrometres).map(words).collect()
    };
    let all = spread(&held_out.rmse(machine)).join("; ");
    let mut text = format!("\nnot used, predicted untouched (root mean square difference {all})\n\n");
    if data.is_transient() {
        for (what, spreads) in [("test", held_out.by_test(machine)), ("sensor", held_out.by_sensor(machine))] {
            let rows: Vec<Vec<String>> = spreads.iter().map(|(name, rmse)| vec![name.clone(), spread(rmse).join("; ")]).collect();
            text += &format!("{}\n", table(&[what, "root mean square difference"], &rows));
        }
    }
    let heading = ["test", "sensor", "measured degC", "before", "after", "difference K"];
    text + &table(&heading, &reading_rows(machine, data, before, after))
}

/// Rows for a reader: of logs only the last with a reading of each test.
pub fn reading_rows(machine: &Machine, data: &Data, before: &[f64], after: &[f64]) -> Vec<Vec<String>> {
    let readings = whiten::readings(data);
    let places = whiten::places(data);
    let last: HashMap<&str, usize> = places.iter().map(|(r, _)| (data.rows[*r].test.as_str(), *r)).collect();
    let is_last = |r: usize| !data.is_transient() || last.get(data.rows[r].test.as_str()) == Some(&r);
    let of = |(i, (r, k)): (usize, &(usize, usize))| {
        let shown = |reading: f64| data.shown(machine, *k, reading);
        is_last(*r).then(|| {
            vec![
                data.rows[*r].test.clone(),
                data.names[*k].clone(),
                format!("{:.2}", shown(readings[i])),
                format!("{:.2}", shown(before[i])),
                format!("{:.2}", shown(after[i])),
                format!("{:+.2}", after[i] - readings[i]),
            ]
        })
    };
    places.iter().enumerate().filter_map(of).collect()
}
