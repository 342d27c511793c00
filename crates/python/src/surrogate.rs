//! A surrogate and its answers to batches.

use std::path::PathBuf;

use coldplate_base::progress::Silent;
use coldplate_base::units::{self, parse};
use coldplate_export::{Beside, page};
use coldplate_jobs::followed::followed;
use coldplate_jobs::info::Info;
use coldplate_jobs::scene::{SceneFiles, scene};
use coldplate_jobs::service;
use coldplate_runtime::format::MAX_STATES;
use coldplate_runtime::{Acceptability, Band, Room, ShapeError, State, StepError, Surrogate as Opened};
use coldplate_surrogate::fit::file;
use coldplate_surrogate::verdict::instruments::Instruments;
use coldplate_surrogate::verdict::question::Question;
use coldplate_surrogate::verdict::update::UpdateRecord;
use coldplate_surrogate::verdict::{stated, update};
use coldplate_tables::{Ledger, Table};
use numpy::ndarray::{Array2, Array3, Dimension};
use numpy::{Element, IntoPyArray, PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use serde::Serialize;

use crate::errors::{json, told, wrong};

/// Number of conditions that a thread takes at once (count). Chosen: the cost of handing over is small beside the work,
/// and work spreads evenly.
const PIECE: usize = 1024;

self_cell::self_cell!(
    struct File {
        owner: Vec<u8>,
        #[covariant]
        dependent: Opened,
    }
);

/// An opened surrogate file.
#[pyclass(frozen, module = "coldplate._coldplate")]
pub struct Surrogate {
    file: File,
}

/// Values, half widths, verdicts, probabilities, margins, whether inside.
type Assessed<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<i8>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<bool>>,
);

impl Surrogate {
    fn opened(&self) -> &Opened<'_> {
        self.file.borrow_dependent()
    }

    /// The conditions row by row, if each has one value per variable.
    fn rows<'x>(&self, py: Python<'_>, x: &'x PyReadonlyArray2<'_, f64>) -> PyResult<(std::borrow::Cow<'x, [f64]>, usize, usize)> {
        let (array, variables) = (x.as_array(), self.opened().variable_count());
        let (n, columns) = array.dim();
        if columns != variables {
            return Err(wrong(py, format!("conditions of this surrogate have shape (n, {variables}), these (n, {columns})")));
        }
        // Arrays in column order, as data frames have them, are copied to row order first.
        let flat = array.to_slice().map_or_else(|| array.iter().copied().collect::<Vec<_>>().into(), std::borrow::Cow::Borrowed);
        Ok((flat, n, variables))
    }
}

/// Record of an update with the account of its table, as the command line gives it.
#[derive(Serialize)]
struct Learnt<'a> {
    #[serde(flatten)]
    update: &'a UpdateRecord,
    account: &'a Ledger,
}

#[pymethods]
impl Surrogate {
    #[new]
    fn new(py: Python<'_>, content: Vec<u8>) -> PyResult<Self> {
        let file = File::try_new(content, |bytes| file::open(bytes));
        Ok(Self { file: told(py, file)? })
    }

    /// The bytes of the file.
    #[getter]
    fn content(&self) -> &[u8] {
        self.file.borrow_owner()
    }

    /// Content of the file, as JSON.
    fn info(&self, py: Python<'_>) -> PyResult<String> {
        json(py, &told(py, Info::of_surrogate(self.file.borrow_owner()))?)
    }

    /// A page with sliders; of a machine file, with the machine in three dimensions, its field by a reduced model if there is one.
    #[pyo3(signature = (name, machine, field))]
    fn page(&self, py: Python<'_>, name: &str, machine: Option<PathBuf>, field: Option<PathBuf>) -> PyResult<String> {
        let followed = told(py, followed(self.file.borrow_owner()))?;
        let files = machine.as_deref().map(|machine| SceneFiles { machine, sets: &[], reduced: field.as_deref(), cells: None });
        let scene = files.map(|files| told(py, py.detach(|| scene(&files, self.opened(), &Silent)))).transpose()?;
        let scene = scene.map(|scene| json(py, &scene)).transpose()?;
        let beside = Beside { scene: scene.as_deref(), followed: followed.as_deref() };
        let pages = page(self.opened(), &beside, name).map_err(|e| wrong(py, e.to_string()))?;
        Ok(pages.into_iter().next().map(|page| String::from_utf8_lossy(&page.content).into_owned()).unwrap_or_default())
    }

    /// The answer to a question, both as JSON.
    fn ask(&self, py: Python<'_>, question: &str) -> PyResult<String> {
        let question: Question = told(py, service::read(question.as_bytes()))?;
        let record = py.detach(|| {
            let (bytes, condition) = stated::with_known(self.file.borrow_owner(), &question.condition)?;
            let known = file::open(&bytes)?;
            Ok(Question { condition, ..question }.ask(&known)?.record(&known))
        });
        json(py, &told(py, record)?)
    }

    /// The surrogate after learning from the readings of a table: the bytes of its file, and the record as JSON.
    /// `noise` is the standard deviation of a reading. Without it the instruments stated in the file beside the data
    /// count, else 0.1 K.
    #[pyo3(signature = (data, noise))]
    fn update(&self, py: Python<'_>, data: PathBuf, noise: Option<&str>) -> PyResult<(Vec<u8>, String)> {
        let found = py.detach(|| {
            let (opened, beside) = (self.opened(), data.with_extension("toml"));
            let instruments = match noise {
                None if beside.exists() => Instruments::read(&beside, opened)?,
                _ => Instruments::with_noise(opened, deviation(noise.unwrap_or("0.1 K"))?),
            };
            let (table, ledger) = Table::read_with_ledger(&data)?;
            let found = update::update(self.file.borrow_owner(), &table, &ledger.rows, &instruments).map_err(|e| e.in_file(&data))?;
            Ok((found, ledger))
        });
        let (found, account) = told(py, found)?;
        Ok((found.bytes, json(py, &Learnt { update: &found.record, account: &account })?))
    }

    /// Largest error of each point over time; empty if the file holds steady states only.
    fn errors_in_time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let points = self.opened().point_count();
        let errors = self.opened().in_time().map(|own| (0..points).map(|point| own.error(point)).collect::<Vec<_>>());
        errors.unwrap_or_default().into_pyarray(py)
    }

    /// A state as its numbers: at rest at a condition, at one temperature everywhere, or estimated from readings.
    fn at_rest(&self, py: Python<'_>, x: Vec<f64>) -> PyResult<Vec<f64>> {
        numbers(py, self.opened().at_rest(&x))
    }

    fn at_temperature(&self, py: Python<'_>, temperature: f64) -> PyResult<Vec<f64>> {
        numbers(py, self.opened().at_temperature(temperature))
    }

    fn at_readings(&self, py: Python<'_>, x: Vec<f64>, readings: Vec<f64>, deviation: f64) -> PyResult<Vec<f64>> {
        numbers(py, self.opened().at_readings(&x, &readings, deviation))
    }

    /// Values (n, points) after each of n steps of equal duration (s) at conditions (n, variables), and the state at
    /// the end.
    fn follow<'py>(
        &self,
        py: Python<'py>,
        state: Vec<f64>,
        seconds: PyReadonlyArray1<'py, f64>,
        x: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Vec<f64>)> {
        let (x, n, variables) = self.rows(py, &x)?;
        let seconds: Vec<f64> = seconds.as_array().iter().copied().collect();
        if seconds.len() != n {
            return Err(wrong(py, format!("there are {} steps and {n} conditions", seconds.len())));
        }
        let state: [f64; MAX_STATES + 1] = state.try_into().map_err(|_| wrong(py, format!("a state has {} numbers", MAX_STATES + 1)))?;
        let (opened, points) = (self.opened(), self.opened().point_count());
        let mut values = Array2::zeros((n, points));
        let mut moved = State::from_numbers(&state);
        if let Some(values) = values.as_slice_mut() {
            py.detach(|| {
                let mut steps = values.chunks_exact_mut(points).zip(x.chunks_exact(variables)).zip(seconds);
                steps.try_for_each(|((values, x), seconds)| {
                    opened.step(&mut moved, seconds, x)?;
                    opened.read(&moved, x, values)
                })
            })
            .map_err(|e: StepError| wrong(py, e.to_string()))?;
        }
        Ok((values.into_pyarray(py), moved.numbers().to_vec()))
    }

    /// Values (n, points) at conditions (n, variables). numpy allocates the memory, because it asks the system for
    /// large pages.
    fn evaluate<'py>(&self, py: Python<'py>, x: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (x, n, variables) = self.rows(py, &x)?;
        let (opened, points) = (self.opened(), self.opened().point_count());
        let found = PyArray2::zeros(py, [n, points], false);
        let mut places = found.try_readwrite().map_err(|e| wrong(py, e.to_string()))?;
        if let Ok(values) = places.as_slice_mut() {
            py.detach(|| {
                let pieces = values.par_chunks_mut(PIECE * points).zip(x.par_chunks(PIECE * variables));
                pieces.try_for_each_init(Box::<Room>::default, |room, (values, x)| coldplate_batch::evaluate(opened, x, values, room))
            })
            .map_err(|e| wrong(py, e.to_string()))?;
        }
        drop(places);
        Ok(found)
    }

    /// Derivatives (n, points, variables) at conditions (n, variables).
    fn gradient<'py>(&self, py: Python<'py>, x: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (x, n, variables) = self.rows(py, &x)?;
        let (opened, points) = (self.opened(), self.opened().point_count());
        let mut slopes = Array3::zeros((n, points, variables));
        if let Some(slopes) = slopes.as_slice_mut() {
            py.detach(|| {
                let rows = slopes.par_chunks_mut(points * variables).zip(x.par_chunks(variables)).with_min_len(64);
                rows.try_for_each(|(slopes, x)| {
                    let mut each = slopes.chunks_exact_mut(variables).enumerate();
                    each.try_for_each(|(point, slopes)| opened.gradient(x, point, slopes))
                })
            })
            .map_err(|e| wrong(py, e.to_string()))?;
        }
        Ok(slopes.into_pyarray(py))
    }

    /// Values, half widths of 95 % bands, verdicts, probabilities that all limits are kept, margins, and whether each
    /// condition lies inside the fitted range. Verdicts are 0 acceptable, 1 not acceptable, 2 uncertain. These are not
    /// the numbers of [`Acceptability`], which ascend with severity: 1 is uncertain there, and 2 not acceptable.
    fn assess<'py>(&self, py: Python<'py>, x: PyReadonlyArray2<'py, f64>, confidence: f64) -> PyResult<Assessed<'py>> {
        if !(confidence > 0.5 && confidence < 1.0) {
            return Err(wrong(py, "a confidence above 0.5 and below 1 is wanted, for example 0.95"));
        }
        let (x, n, variables) = self.rows(py, &x)?;
        let opened = self.opened();
        let (points, limits) = (opened.point_count(), opened.limit_count());
        let found: Vec<Found> = py
            .detach(|| x.par_chunks(PIECE * variables).map(|x| Found::at(opened, x, confidence)).collect::<Result<_, _>>())
            .map_err(|e: ShapeError| wrong(py, e.to_string()))?;
        let table = |columns: usize, of: fn(&Found) -> &[f64]| {
            let table = PyArray2::zeros(py, [n, columns], false);
            joined(py, &table, columns, &found, of)?;
            Ok::<_, PyErr>(table)
        };
        let (values, half_widths) = (table(points, |own| &own.values)?, table(points, |own| &own.half_widths)?);
        let (verdicts, probabilities, inside) =
            (PyArray1::zeros(py, n, false), PyArray1::zeros(py, n, false), PyArray1::from_vec(py, vec![false; n]));
        joined(py, &verdicts, 1, &found, |own| &own.verdicts)?;
        joined(py, &probabilities, 1, &found, |own| &own.probabilities)?;
        joined(py, &inside, 1, &found, |own| &own.inside)?;
        Ok((values, half_widths, verdicts, probabilities, table(limits, |own| &own.margins)?, inside))
    }
}

/// Joins results found in pieces into one array with one row per condition.
fn joined<T: Element + Copy + Send + Sync, D: Dimension>(
    py: Python<'_>,
    array: &Bound<'_, PyArray<T, D>>,
    columns: usize,
    found: &[Found],
    of: fn(&Found) -> &[T],
) -> PyResult<()> {
    let mut places = array.try_readwrite().map_err(|e| wrong(py, e.to_string()))?;
    if let (Ok(places), true) = (places.as_slice_mut(), columns > 0) {
        py.detach(|| places.par_chunks_mut(PIECE * columns).zip(found).for_each(|(to, own)| to.copy_from_slice(of(own))));
    }
    Ok(())
}

/// A standard deviation of readings, K.
fn deviation(text: &str) -> coldplate::Result<f64> {
    let kelvin = parse(text, units::Dimension::DIFFERENCE).map_err(|e| e.at_key("noise"))?;
    if kelvin > 0.0 {
        return Ok(kelvin);
    }
    let error = coldplate::Error::input("a standard deviation is above zero").at_key("noise").read(text);
    Err(error.help("write for example noise=\"0.1 K\""))
}

/// A new state, as its numbers.
fn numbers(py: Python<'_>, made: Result<State, StepError>) -> PyResult<Vec<f64>> {
    made.map(|state| state.numbers().to_vec()).map_err(|e| wrong(py, e.to_string()))
}

/// Results at some conditions, one after the other.
#[derive(Default)]
struct Found {
    values: Vec<f64>,
    half_widths: Vec<f64>,
    verdicts: Vec<i8>,
    probabilities: Vec<f64>,
    margins: Vec<f64>,
    inside: Vec<bool>,
}

impl Found {
    fn at(opened: &Opened<'_>, x: &[f64], confidence: f64) -> Result<Self, ShapeError> {
        let mut found = Self::default();
        let (variables, points) = (opened.variable_count(), opened.point_count());
        found.values.resize(x.len() / variables * points, 0.0);
        coldplate_batch::evaluate(opened, x, &mut found.values, &mut Box::default())?;
        let mut bands = vec![Band::default(); points];
        let own: Vec<f64> = opened.points().map(|point| point.half_width).collect();
        for (x, values) in x.chunks_exact(variables).zip(found.values.chunks_exact(points)) {
            let (state, probability) = if opened.uncertainty().is_some() {
                let chance = opened.chance_at(x, confidence, values, Some(&mut bands[..]))?;
                found.half_widths.extend(bands.iter().map(|band| band.half_width()));
                (chance.state, chance.probability)
            } else {
                found.half_widths.extend(&own);
                (opened.verdict_at(x, values)?.state, f64::NAN)
            };
            found.verdicts.push(match state {
                Acceptability::Acceptable => 0,
                Acceptability::NotAcceptable => 1,
                Acceptability::Uncertain => 2,
            });
            found.probabilities.push(probability);
            let margin = |limit| opened.limit_value(limit, x, values).map_or(f64::NAN, |own| own.margin);
            found.margins.extend((0..opened.limit_count()).map(margin));
            found.inside.push(opened.in_domain(x));
        }
        Ok(found)
    }
}
