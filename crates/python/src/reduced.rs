//! A reduced model and its answers to batches.

use std::time::Instant;

use coldplate::{Condition, Error};
use coldplate_base::units::{convert, express};
use coldplate_explore::simulate::{self, SimulatedMachine};
use coldplate_jobs::reduced::ReducedSolution;
use coldplate_reduce::ReducedModel;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::errors::{json, told, wrong};
use crate::pipeline::{Pairs, simulated, told_of};
use crate::readings::{Named, Source};
use crate::table::{Given, given};
use crate::work;

/// A reduced model, read and checked.
#[pyclass(frozen, module = "coldplate._coldplate")]
pub struct Reduced {
    content: Vec<u8>,
    model: ReducedModel,
}

/// Values and bounds (n, sensors), and whether each condition lies within the ranges of the training.
type Predicted<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<bool>>);

impl Reduced {
    /// Indices of the variables that vary.
    fn varied(&self) -> impl Iterator<Item = usize> {
        self.model.ranges.iter().enumerate().filter(|(_, (low, high))| high > low).map(|(place, _)| place)
    }

    /// The condition of one row.
    fn condition(&self, row: &[f64]) -> coldplate::Result<Condition> {
        let mut si: Vec<f64> = self.model.ranges.iter().map(|(low, _)| *low).collect();
        for (place, value) in self.varied().zip(row) {
            let variable = &self.model.machine.variables[place];
            let fail = |what: &str| Err(Error::input(what).at_key(&variable.name).read(value));
            if !value.is_finite() {
                return fail("a condition is made of finite numbers");
            }
            si[place] = convert(*value, &variable.unit, variable.dimension)?;
        }
        Ok(Condition::from_si(si))
    }
}

#[pymethods]
impl Reduced {
    #[new]
    fn new(py: Python<'_>, content: Vec<u8>) -> PyResult<Self> {
        let model = told(py, ReducedModel::from_bytes(&content))?;
        Ok(Self { content, model })
    }

    /// The bytes of the file.
    #[getter]
    fn content(&self) -> &[u8] {
        &self.content
    }

    /// Name of the machine.
    #[getter]
    fn name(&self) -> &str {
        &self.model.machine.name
    }

    /// Variables that vary: name, unit, range.
    fn variables(&self, py: Python<'_>) -> PyResult<Vec<(String, String, f64, f64)>> {
        let own = |place: usize| {
            let (variable, (low, high)) = (&self.model.machine.variables[place], self.model.ranges[place]);
            let shown = |si: f64| express(si, &variable.unit, variable.dimension);
            Ok((variable.name.clone(), variable.unit.clone(), shown(low)?, shown(high)?))
        };
        told(py, self.varied().map(own).collect())
    }

    /// Sensors: name and unit.
    fn sensors(&self) -> Vec<(String, String)> {
        let network = &self.model.fine.network;
        network.sensor_names.iter().cloned().zip(network.measurands.iter().map(|own| own.unit().to_string())).collect()
    }

    /// The steady state at a condition, as JSON.
    fn solve(&self, py: Python<'_>, condition: Pairs) -> PyResult<String> {
        let record = py.detach(|| ReducedSolution::at(&self.model, condition).map(|solution| solution.record()));
        json(py, &told(py, record)?)
    }

    /// Readings at conditions (n, variables that vary), bounds of their error against the full model, and whether each
    /// condition lies within the ranges of the training.
    #[pyo3(signature = (x, progress))]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray2<'py, f64>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Predicted<'py>> {
        let (array, variables) = (x.as_array(), self.varied().count());
        let (n, columns) = array.dim();
        if columns != variables {
            return Err(wrong(py, format!("conditions of this model have shape (n, {variables}), these (n, {columns})")));
        }
        let rows: Vec<Vec<f64>> = array.rows().into_iter().map(|row| row.to_vec()).collect();
        let measurands = &self.model.fine.network.measurands;
        let found = work::run(py, progress, |heard| {
            let one = |row: &Vec<f64>| {
                heard.stop();
                self.model.steady(&self.condition(row)?, &[])
            };
            let at = |(row, found): (usize, coldplate::Result<_>)| found.map_err(|e: Error| e.at_key(format!("condition {row}")));
            rows.par_iter().map(one).collect::<Vec<_>>().into_iter().enumerate().map(at).collect::<coldplate::Result<Vec<_>>>()
        })?;
        let table = |values: Vec<f64>| Array2::from_shape_vec((n, measurands.len()), values).map_err(|e| wrong(py, e.to_string()));
        let shown = found.iter().flat_map(|own| own.readings.iter().zip(measurands).map(|(value, own)| own.shown(*value))).collect();
        let bounds = found.iter().flat_map(|own| own.bounds.iter().copied()).collect();
        let inside: Vec<bool> = found.iter().map(|own| own.in_range).collect();
        Ok((table(shown)?.into_pyarray(py), table(bounds)?.into_pyarray(py), inside.into_pyarray(py)))
    }

    /// A simulation through a schedule: its record as JSON, the readings over time, and a figure.
    #[pyo3(signature = (schedule, condition, start, within, every, progress))]
    #[allow(clippy::too_many_arguments)]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        schedule: Named<'py>,
        condition: Pairs,
        start: &str,
        within: &str,
        every: Option<&str>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(String, Given<'py>, String)> {
        let schedule = Source::of(py, schedule, None)?;
        let (record, table, figure) = work::run(py, progress, |_| {
            let began = Instant::now();
            let options = simulated(start, within, every)?;
            let read = schedule.schedule(&self.model.machine, &condition)?;
            let history = simulate::run_reduced(&self.model, &read, &options)?;
            told_of(&SimulatedMachine::from(&self.model), &history, &schedule.words(), began)
        })?;
        Ok((json(py, &record)?, given(py, table), figure))
    }
}
