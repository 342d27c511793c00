//! Input and output of a command with readings: the table or the measurements of the machine file, their uncertainty, the initial
//! state of logs, and the path of a changed machine file.

use std::path::{Path, PathBuf};

use crate::faulty_readings::Fault;
use crate::faulty_readings::cleared;
use crate::measurement::{BetweenRows, Data, MeasurementUncertainty};
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{Dimension, parse};
use coldplate_describe::machine::Machine;
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

/// The data of a table, or the measurements of the machine file.
///
/// # Errors
/// Errors of [`Data::read_as`] and [`Data::of_machine`]; there is neither a table nor a measurement.
pub fn data(table: Option<&Path>, given: &BetweenRows, machine: &Machine) -> Result<Data> {
    match table {
        Some(path) => Data::read_as(path, given, machine),
        None if machine.measurements.is_empty() => Err(Error::input("no readings are given, and the machine file states none")
            .help("name a table of readings behind the machine file: MACHINE.toml DATA.csv")),
        None => Data::of_machine(machine),
    }
}

/// Leaves out the sensors that `--without` names.
///
/// # Errors
/// No column is of such a sensor, or no reading is left.
pub fn drop_sensors(data: &mut Data, names: &[String]) -> Result<()> {
    for name in names {
        let Some(k) = data.names.iter().position(|n| n == name) else {
            let error = Error::input(format!("no column is of a sensor '{name}'")).at_key("--without");
            return Err(match did_you_mean(name, data.names.iter().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean '{near}'?")),
                None => error.help(format!("sensors here: {}", data.names.join(", "))),
            });
        };
        data.names.remove(k);
        data.sensors.remove(k);
        data.rows.iter_mut().for_each(|row| {
            row.readings.remove(k);
        });
    }
    // Rows of a log are kept: they state the conditions.
    if !data.is_transient() {
        data.rows.retain(|row| row.readings.iter().any(Option::is_some));
    }
    if data.count() == 0 { Err(Error::input("no reading is left").at_key("--without")) } else { Ok(()) }
}

/// Uncertainty of the readings: from `DATA.toml` beside the table, or usual values.
///
/// # Errors
/// Errors of [`MeasurementUncertainty::beside`].
pub fn stated(table: Option<&Path>, machine_file: &Path, data: &Data, machine: &Machine) -> Result<MeasurementUncertainty> {
    // A table beside the machine file and with its name has no file of its own for its uncertainty.
    let is_machine = |path: &Path| matches!((path.canonicalize(), machine_file.canonicalize()), (Ok(a), Ok(b)) if a == b);
    match table {
        Some(path) if !is_machine(&path.with_extension("toml")) => MeasurementUncertainty::beside(path, data, machine),
        _ => Ok(MeasurementUncertainty::usual(data, machine)),
    }
}

/// Leaves faulty readings out, unless all are to be kept; returns the faults that were found.
///
/// # Errors
/// Errors of [`cleared`].
pub fn clear(data: &mut Data, study: &Study, uncertainty: &MeasurementUncertainty, start: Start, keep_all: bool) -> Result<Vec<Fault>> {
    if keep_all {
        return Ok(Vec::new());
    }
    let found = cleared(study, data, uncertainty, start)?;
    *data = found.data;
    Ok(found.faults)
}

/// Initial state of logs, from the text of `--from`.
///
/// # Errors
/// The text is neither `steady`, `readings`, `parts` nor a temperature.
pub fn start(text: &str) -> Result<Start> {
    Ok(match text.trim() {
        "steady" => Start::Steady,
        "readings" => Start::Readings,
        "parts" => Start::Parts,
        text => Start::Uniform(parse(text, Dimension::TEMPERATURE).map_err(|e| {
            e.at_key("--from").help(
                "write --from steady, --from readings (each test at the mean of its own first readings), --from parts (each part and \
                 node at those of its own sensors) or --from \"20 degC\"",
            )
        })?),
    })
}

/// Path of a changed machine file: as `--out` states, or beside the machine file as `NAME.WORD.toml`. Checked before the work,
/// not after it.
///
/// # Errors
/// A file is there already, cannot be written, or the machine's meshes would not be found from there.
pub fn goal(given: Option<&Path>, machine_file: &Path, machine: &Machine, word: &str) -> Result<PathBuf> {
    let Some(path) = given else {
        let path = unused(machine_file, word);
        atomic_file::check(&path).map_err(|e| e.at_key("--out").help("name a file in another folder with --out"))?;
        return Ok(path);
    };
    must_be_new(path, "--out")?;
    let folder = |p: &Path| p.parent().map(|f| if f.as_os_str().is_empty() { Path::new(".") } else { f }.canonicalize().ok());
    if machine.parts.iter().any(|p| p.import.is_some()) && folder(path) != folder(machine_file) {
        return Err(Error::input("this machine imports meshes that lie beside its file")
            .in_file(path)
            .at_key("--out")
            .help(format!("write the {word} machine into the same folder")));
    }
    Ok(path.to_path_buf())
}

/// Checks that no file is there, and that one can be written there.
///
/// # Errors
/// A file is there already, or cannot be written.
pub fn must_be_new(path: &Path, option: &str) -> Result<()> {
    if path.exists() {
        return Err(Error::input("this file is there already")
            .in_file(path)
            .at_key(option)
            .help("give another name: nothing is written over"));
    }
    atomic_file::check(path).map_err(|e| e.at_key(option))
}

/// A name beside the machine file that no file has.
fn unused(machine: &Path, word: &str) -> PathBuf {
    let stem = machine.file_stem().map_or_else(|| "machine".into(), |s| s.to_string_lossy().into_owned());
    let named = |n: usize| machine.with_file_name(if n == 1 { format!("{stem}.{word}.toml") } else { format!("{stem}.{word}-{n}.toml") });
    (1..).map(named).find(|p| !p.exists()).unwrap_or_else(|| named(1))
}
