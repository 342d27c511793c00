//! From machine file to diagnosis: each function corresponds to a command and returns the command's JSON.

use std::path::PathBuf;
use std::time::Instant;

use coldplate::{FitOptions, MeshedMachine, Progress, Study, Sweep, SweepOptions};
use coldplate_base::atomic_file;
use coldplate_base::units::{Dimension, parse};
use coldplate_diagnose::Problem as Diagnosed;
use coldplate_evidence::command_input;
use coldplate_evidence::identify::{Free, IdentifyOptions, IdentifyProblem as Identified, identify_and_learn, write_machine};
use coldplate_evidence::measurement::DividedData;
use coldplate_evidence::record::HeldOut;
use coldplate_explore::simulate::record::HistoryRecord;
use coldplate_explore::simulate::{self, History, SimulateOptions, SimulatedMachine, Start};
use coldplate_figures::chart::output::to_svg_string;
use coldplate_findings::examine;
use coldplate_jobs::adaptive;
use coldplate_jobs::charts::history;
use coldplate_jobs::fitting::{self, FitRecord};
use coldplate_jobs::info::Info;
use coldplate_jobs::reduced::{self, MadeRecord};
use coldplate_jobs::sensitivity::Sensitivities;
use coldplate_reduce::{ReduceSettings, reduce};
use coldplate_tables::Table;
use pyo3::prelude::*;

use crate::errors::{json, told};
use crate::readings::{Named, Source};
use crate::table::{Columns, Given, given, taken};
use crate::work;

/// Names and values with units.
pub type Pairs = Vec<(String, String)>;

/// Settings of a reduced model: whether open parameters vary, whether it keeps its field, most conditions solved in
/// full, number of training histories, seed.
type Reduction = (bool, bool, usize, usize, u64);

fn borrowed(pairs: &Pairs) -> Vec<(&str, &str)> {
    pairs.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect()
}

/// A machine file, read and checked.
#[pyclass(frozen, module = "coldplate._coldplate")]
pub struct Machine {
    path: PathBuf,
    sets: Pairs,
    machine: coldplate::Machine,
}

#[pymethods]
impl Machine {
    #[new]
    fn new(py: Python<'_>, path: PathBuf, sets: Pairs) -> PyResult<Self> {
        let machine = told(py, coldplate::Machine::read(&path, &sets))?;
        Ok(Self { path, sets, machine })
    }

    /// Name of the machine.
    #[getter]
    fn name(&self) -> &str {
        &self.machine.name
    }

    /// Path of the machine file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// Content of the file, as JSON.
    fn info(&self, py: Python<'_>) -> PyResult<String> {
        json(py, &told(py, Info::of(&self.path))?)
    }

    /// The steady state at a condition, as JSON.
    #[pyo3(signature = (condition, cells, progress))]
    fn solve(&self, py: Python<'_>, condition: Pairs, cells: Option<usize>, progress: Option<&Bound<'_, PyAny>>) -> PyResult<String> {
        let record = work::run(py, progress, |heard| {
            let began = Instant::now();
            let condition = self.machine.condition(&borrowed(&condition))?;
            heard.at("meshing");
            let model = MeshedMachine::new(self.machine.clone(), cells)?;
            let solver = model.solver_heard(&condition, heard)?;
            let state = model.solve(&solver, &condition)?;
            let mut record = model.record(&state);
            record.seconds.total = began.elapsed().as_secs_f64();
            Ok(record)
        })?;
        json(py, &record)
    }

    /// Sensitivities of readings to variables and numbers of the file at a condition, as JSON.
    #[pyo3(signature = (condition, by, readings, cells, progress))]
    fn sensitivity(
        &self,
        py: Python<'_>,
        condition: Pairs,
        by: Vec<String>,
        readings: Vec<String>,
        cells: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<String> {
        let record = work::run(py, progress, |heard| {
            let began = Instant::now();
            heard.at("meshing");
            let study = Study::read(&self.path, &self.sets, cells)?;
            let condition = study.model.machine.condition(&borrowed(&condition))?;
            heard.at("solving");
            Ok(Sensitivities::of(&study, &condition, &readings, &by)?.record(began.elapsed().as_secs_f64()))
        })?;
        json(py, &record)
    }

    /// A reduced model: the bytes of its file, and the record of its making as JSON.
    #[pyo3(signature = (accuracy, vary, ranges, settings, cells, progress))]
    #[allow(clippy::too_many_arguments)]
    fn reduce(
        &self,
        py: Python<'_>,
        accuracy: &str,
        vary: Option<&str>,
        ranges: Pairs,
        settings: Reduction,
        cells: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Vec<u8>, String)> {
        let (bytes, record) = work::run(py, progress, |heard| {
            let kelvin = parse(accuracy, Dimension::DIFFERENCE).map_err(|e| e.at_key("accuracy"))?;
            if kelvin.is_nan() || kelvin <= 0.0 {
                let error = coldplate::Error::input("an accuracy is above zero").at_key("accuracy").read(accuracy);
                return Err(error.help("write for example accuracy=\"0.001 K\""));
            }
            heard.at("meshing");
            let study = Study::read(&self.path, &self.sets, cells)?;
            let (with_parameters, with_field, most, histories, seed) = settings;
            let ranges = reduced::ranges(&study.model.machine.variables, vary, &ranges).map_err(|e| e.in_file(&self.path))?;
            let settings = ReduceSettings { accuracy: kelvin, ranges, with_parameters, most, histories, with_field, seed };
            let model = reduce(&study, &settings, heard)?;
            let bytes = model.to_bytes(study.document())?;
            let record = MadeRecord::of(&model, String::new(), bytes.len(), kelvin);
            Ok((bytes, record))
        })?;
        Ok((bytes, json(py, &record)?))
    }

    /// A simulation through a schedule: its record as JSON, the readings over time, and a figure.
    #[pyo3(signature = (schedule, condition, start, within, every, cells, progress))]
    #[allow(clippy::too_many_arguments)]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        schedule: Named<'py>,
        condition: Pairs,
        start: &str,
        within: &str,
        every: Option<&str>,
        cells: Option<usize>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(String, Given<'py>, String)> {
        let schedule = Source::of(py, schedule, None)?;
        let (record, table, figure) = work::run(py, progress, |heard| {
            let began = Instant::now();
            let options = simulated(start, within, every)?;
            let read = schedule.schedule(&self.machine, &condition)?;
            heard.at("meshing");
            let model = MeshedMachine::new(self.machine.clone(), cells)?;
            let whole = read.end() - read.start();
            let history = simulate::run(&model, &read, &options, &mut |seen| {
                heard.count((1e3 * (seen.state.time - read.start()) / whole) as usize, 1000, "thousandths of the time");
            })?;
            told_of(&SimulatedMachine::from(&model), &history, &schedule.words(), began)
        })?;
        Ok((json(py, &record)?, given(py, table), figure))
    }
}

/// Options of a simulation.
pub fn simulated(start: &str, within: &str, every: Option<&str>) -> coldplate::Result<SimulateOptions> {
    Ok(SimulateOptions {
        start: match start.trim() {
            "steady" => Start::Steady,
            text => Start::Uniform(parse(text, Dimension::TEMPERATURE).map_err(|e| e.at_key("start"))?),
        },
        within: parse(within, Dimension::DIFFERENCE).map_err(|e| e.at_key("within"))?,
        every: every.map(|text| parse(text, Dimension::TIME).map_err(|e| e.at_key("every"))).transpose()?,
        ..SimulateOptions::default()
    })
}

/// A history as its record, its table and its figure.
pub fn told_of(
    subject: &SimulatedMachine<'_>,
    history: &History,
    schedule: &str,
    began: Instant,
) -> coldplate::Result<(HistoryRecord, Table, String)> {
    let figure = history::figure(subject, history, vec![format!("schedule: {schedule}")]);
    let record = history.record(subject, began.elapsed().as_secs_f64());
    Ok((record, history.table(subject)?, to_svg_string(&figure)?))
}

/// The conditions of a sweep file, solved into a folder or taken from its journal: the record as JSON, and the table.
#[pyfunction]
#[pyo3(signature = (path, out, sets, cells, progress))]
pub fn sweep<'py>(
    py: Python<'py>,
    path: PathBuf,
    out: PathBuf,
    sets: Pairs,
    cells: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(String, Given<'py>)> {
    let (record, table) = work::run(py, progress, |heard| {
        let began = Instant::now();
        let sweep = Sweep::open_heard(&path, cells, &sets, heard)?;
        let options = SweepOptions { threads: None, progress: Some(heard), retry_failed: false };
        let swept = adaptive::run(&sweep, &out, options, heard)?.swept;
        let record = swept.record(&sweep, began.elapsed().as_secs_f64());
        Ok((record, swept.table))
    })?;
    Ok((json(py, &record)?, given(py, table)))
}

/// A surrogate fitted to a table: the bytes of its file, and the record of the fit as JSON. `beside` is the folder of a
/// sweep; its slopes and followed variables are included.
#[pyfunction]
#[pyo3(signature = (table, machine, beside, max_degree, seed, progress))]
pub fn fit<'py>(
    py: Python<'py>,
    table: Columns<'py>,
    machine: Option<PyRef<'py, Machine>>,
    beside: Option<PathBuf>,
    max_degree: usize,
    seed: u64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Vec<u8>, String)> {
    let table = taken(py, table)?;
    let scope = machine.as_ref().map(|own| own.machine.scope());
    let (bytes, record) = work::run(py, progress, |heard| {
        let began = Instant::now();
        let options = FitOptions { max_degree, seed, ..FitOptions::default() };
        let mut fit = fitting::fit_table_heard(&table, scope.as_ref(), &options, heard)?;
        let read = |name: &str| {
            let path = beside.as_ref().map(|folder| folder.join(name).with_extension("csv")).filter(|path| path.is_file());
            path.map(Table::read).transpose()
        };
        fitting::with_uncertainty(&mut fit, read("slopes")?.as_ref())?;
        fitting::with_followed(&mut fit, scope.as_ref(), read("followed")?.as_ref())?;
        let bytes = fit.to_bytes()?;
        let record = FitRecord::of(&fit, &PathBuf::new(), bytes.len() as u64, began.elapsed().as_secs_f64());
        Ok((bytes, record))
    })?;
    Ok((bytes, json(py, &record)?))
}

/// Calibration of a machine file's numbers from readings: the record as JSON, and the text of the machine file with
/// these numbers. `divisions` are names of tests to use, and readings to hold out.
#[pyfunction]
#[pyo3(signature = (machine, data, instruments, free, divisions, starts, cells, progress))]
#[allow(clippy::too_many_arguments)]
pub fn identify<'py>(
    py: Python<'py>,
    machine: PyRef<'py, Machine>,
    data: Named<'py>,
    instruments: Option<PathBuf>,
    free: Vec<String>,
    divisions: (Vec<String>, Vec<String>),
    starts: usize,
    cells: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(String, String)> {
    let (path, sets) = (machine.path.clone(), machine.sets.clone());
    let source = Source::of(py, data, instruments)?;
    let (tests, hold_out) = divisions;
    let (record, text) = work::run(py, progress, |heard| {
        let began = Instant::now();
        let study = Study::read(&path, &sets, cells)?;
        let (mut all, uncertainty) = source.readings(&path, &study.model.machine)?;
        let faults = command_input::clear(&mut all, &study, &uncertainty, Start::Steady, false)?;
        let divided = if hold_out.is_empty() { None } else { Some(DividedData::held_out(&all, &hold_out)?) };
        let chosen = match &divided {
            Some(divided) => divided.fitted.clone(),
            None if tests.is_empty() => all,
            None => all.split(&tests)?.0,
        };
        let free = free.iter().map(|text| Free::each(text, &study, &chosen)).collect::<coldplate::Result<Vec<_>>>()?.concat();
        let problem = Identified { study, data: chosen, uncertainty, free, start: Start::Steady }.thinned();
        let options = IdentifyOptions { starts, ..IdentifyOptions::default() };
        let estimate = identify_and_learn(&problem, &options, heard)?;
        let held_out = divided.map(|divided| HeldOut::identified(&divided, &problem, &estimate)).transpose()?;
        let mut record = estimate.record(&problem, &[], &[], held_out.as_ref());
        record.faults = faults.iter().map(|fault| fault.record()).collect();
        record.seconds = began.elapsed().as_secs_f64();
        Ok((record, write_machine(&problem, &estimate, &problem.data.tests())?))
    })?;
    Ok((json(py, &record)?, text))
}

/// Diagnosis of a machine file: the record as JSON, the answer in a sentence, the text of the extended machine file if
/// there is one, the report as HTML and the ladder of gains as SVG.
#[pyfunction]
#[pyo3(signature = (machine, data, instruments, cells, progress))]
#[allow(clippy::type_complexity)]
pub fn diagnose<'py>(
    py: Python<'py>,
    machine: PyRef<'py, Machine>,
    data: Named<'py>,
    instruments: Option<PathBuf>,
    cells: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(String, String, Option<String>, String, Option<String>)> {
    let (path, sets) = (machine.path.clone(), machine.sets.clone());
    let source = Source::of(py, data, instruments)?;
    let (record, headline, extended, report, gains) = work::run(py, progress, |heard| {
        let study = Study::read(&path, &sets, Some(cells.unwrap_or(USUAL_CELLS)))?;
        let (table, uncertainty) = source.readings(&path, &study.model.machine)?;
        let uncertain = study.uncertain()?;
        let mut problem = Diagnosed::new(study, table);
        (problem.uncertainty, problem.uncertain) = (uncertainty, uncertain);
        let problem = problem.cleared()?.thinned().timed()?;
        let goal = command_input::goal(None, &path, &problem.study.model.machine, "extended")?;
        let found = examine(&problem, &goal, None, heard)?;
        let gains = found.gains().map(|figure| to_svg_string(&figure)).transpose()?;
        let extended = found.extended.as_ref().map(|own| own.text.clone());
        let record = serde_json::to_value(found.record()).map_err(|e| coldplate::Error::input(e.to_string()))?;
        Ok((record, found.headline(), extended, found.report()?.to_html(), gains))
    })?;
    Ok((json(py, &record)?, headline, extended, report, gains))
}

/// Number of cells (count) if only differences of readings matter. Chosen: speed against the error of the mesh, which
/// cancels in differences.
const USUAL_CELLS: usize = 3000;

/// Writes a file under a temporary name and renames it.
#[pyfunction]
pub fn write_file(py: Python<'_>, path: PathBuf, content: &[u8]) -> PyResult<()> {
    told(py, atomic_file::write(&path, content))
}
