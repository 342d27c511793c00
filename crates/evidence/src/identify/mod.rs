//! Parameters of a machine file from measured data, and how well the data determine them.
//!
//! The whitened misfit (y - f)ᵀ Σ⁻¹ (y - f), plus the priors that are given, is minimised by Levenberg and Marquardt's method
//! with the solver's own derivatives. Σ holds reading noise, each sensor's own error and the errors of every condition
//! ([`crate::measurement::Whitener`]). Positive parameters vary by their logarithm. Intervals come from the curvature at the
//! optimum, and from the profile likelihood if the model is refitted along each parameter. Directions that the data leave open
//! are named. If the stated errors do not explain the residual, the model has an error of its own ([`crate::discrepancy`]): the
//! size of it is learnt from the residual beside the parameters, and the intervals widen with it.

mod advice;
mod ended;
mod estimate;
mod interval;
mod learnt;
mod mesh;
mod predict;
mod prediction;
mod profile;
mod runs;
mod scan;
mod search;
mod steady;
mod write;

use predict::{Pace, Steps};
use rayon::prelude::*;

use crate::measurement::{Data, MOST_READINGS, MeasurementUncertainty, thinned_evenly};
use coldplate_base::error::{Error, Result};
use coldplate_base::units;
use coldplate_describe::machine::Machine;
use coldplate_explore::simulate::Start;
use coldplate_solve::study::{MachineParameter, ParameterKind, Study};

pub use advice::{Advice, next_tests};
pub use ended::chi_square_tail;
pub use estimate::{Estimate, FittedModelError, IdentifyOptions, Undetermined, identify, identify_and_learn};
pub use interval::{ParameterRange, axis};
pub use learnt::SensorError;
pub use mesh::{MeshShare, continued};
pub use predict::{TIME_TOLERANCE, histories, predict, predict_within, values, values_within};
pub use prediction::{Prediction, own_key};
pub use profile::{ParameterProfile, profile, profile_heard};
pub use runs::Runs;
pub use scan::{MisfitScan, scan};
pub use steady::{conditions, states, steady_near, steady_within};
pub use write::{model_error_line, write_machine};

/// Range of a positive parameter without bounds: from its value over this factor to its value times this factor. Chosen, and
/// stated in docs/method/identification.md.
const FARTHEST: f64 = 100.0;
/// Error allowed in each time step of a log, over that of runs that are only compared with readings. Dimensionless; chosen:
/// derivatives are differences of runs and need smaller errors.
const BESIDE_RUNS: f64 = 0.1;
/// Size of a temperature for the test whether the data determine it, K. Chosen: half of it counts as open (docs/method/identification.md).
const OPEN_KELVIN: f64 = 10.0;

/// A parameter that is to be found.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// The parameter; the search begins at its value.
    pub parameter: MachineParameter,
    /// The one test in which it holds; the others keep the value common to all.
    pub test: Option<String>,
    /// Least and largest value, SI.
    pub bounds: (f64, f64),
    /// Prior: value and standard deviation, SI.
    pub prior: Option<(f64, f64)>,
    /// Whether the parameter varies by its logarithm, because it is positive by nature.
    pub is_logarithmic: bool,
}

impl Free {
    /// Reads `KEY`, `KEY=LOW..HIGH` (as in [`ParameterRange`]), `KEY=VALUE +- DEVIATION`, or both: `KEY=LOW..HIGH, VALUE +-
    /// DEVIATION`. With `KEY@TEST` in place of `KEY` the value holds in that test alone.
    ///
    /// # Errors
    /// No such key, a condition variable, or bounds that cannot be read or hold nothing.
    pub fn parse(text: &str, study: &Study) -> Result<Self> {
        let (key, test, rest) = pieces(text);
        let parameter = study.parameter(key)?;
        if parameter.kind == ParameterKind::Condition {
            return Err(Error::input(format!("'{}' is a condition, not a number of the machine", parameter.name))
                .at_key(&parameter.name)
                .help("say in DATA.toml how uncertain it is: its error is then taken into account"));
        }
        let is_logarithmic = parameter.value > 0.0 && !parameter.dimension.is_absolute() && parameter.kind != ParameterKind::Offset;
        let v = parameter.value;
        let reach =
            if parameter.dimension.is_absolute() || parameter.kind == ParameterKind::Offset { 100.0 } else { (10.0 * v.abs()).max(100.0) };
        let bounds = if is_logarithmic { (v / FARTHEST, v * FARTHEST) } else { (v - reach, v + reach) };
        let mut free = Self { parameter, test: test.map(String::from), bounds, prior: None, is_logarithmic };
        let mut is_bounded = false;
        for part in rest.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            if part.contains("..") {
                let ParameterRange { low, high, step } = ParameterRange::parse(part, &free.parameter)?;
                if step.is_some() {
                    return Err(free.wrong("a search has no steps", part).help("leave the step out, or try a grid with --scan"));
                }
                free.bounds = (low, high);
                is_bounded = true;
            } else if let Some((value, deviation)) = part.split_once("+-").or(part.split_once('±')) {
                let (value, deviation) = (free.read(value)?, free.read_difference(deviation)?);
                free.prior = Some((value, deviation));
            } else {
                return Err(free.malformed(part));
            }
        }
        if rest.trim().is_empty()
            && let Some(stated) = study.uncertain()?.into_iter().find(|own| own.parameter.name == free.parameter.name)
        {
            match stated.limits {
                Some(limits) => (free.bounds, is_bounded) = (limits, true),
                None => free.prior = Some((stated.parameter.value, stated.deviation)),
            }
        }
        if free.bounds.0.is_nan() || free.bounds.1.is_nan() || free.bounds.0 >= free.bounds.1 {
            return Err(free.wrong("the lower bound comes first", rest));
        }
        if free.bounds.0 <= 0.0 {
            free.is_logarithmic = false;
        }
        if is_bounded {
            // If the range ends at a value that is not part of it, such as a conductance of zero, the bound comes close to it.
            let (low, high) = (free.valid(study, free.bounds.0), free.valid(study, free.bounds.1));
            let close = 1e-6 * (free.bounds.1 - free.bounds.0);
            if (low - free.bounds.0).abs() > close || (high - free.bounds.1).abs() > close {
                return Err(free
                    .wrong("the machine does not allow these bounds", rest)
                    .help("choose bounds between which the machine file stays valid"));
            }
            free.bounds = (low, high);
        } else {
            free.bounds = (free.valid(study, free.bounds.0), free.valid(study, free.bounds.1));
        }
        if let Some((value, deviation)) = free.prior {
            if deviation.is_nan() || deviation <= 0.0 {
                return Err(free.wrong("a standard deviation is positive", rest));
            }
            if !(free.bounds.0..=free.bounds.1).contains(&value) {
                let shown = [free.bounds.0, free.bounds.1].map(|v| free.parameter.shown(v));
                return Err(Error::input("the value of the prior lies outside the bounds")
                    .at_key(&free.parameter.name)
                    .read(rest)
                    .help(format!("the bounds are {} to {} {}", shown[0], shown[1], free.parameter.unit)));
            }
        }
        Ok(free)
    }

    /// Reads a text as [`Free::parse`] does; `KEY@*` gives one parameter for each test of the data.
    ///
    /// # Errors
    /// Errors of [`Free::parse`].
    pub fn each(text: &str, study: &Study, data: &Data) -> Result<Vec<Self>> {
        let free = Self::parse(text, study)?;
        if free.test.as_deref() != Some(EVERY_TEST) {
            return Ok(vec![free]);
        }
        Ok(data.tests().into_iter().map(|test| Self { test: Some(test), ..free.clone() }).collect())
    }

    /// The key, followed by the test if the value holds in one alone: `KEY@TEST`.
    pub fn name(&self) -> String {
        self.test.as_ref().map_or(self.parameter.name.clone(), |test| format!("{}@{test}", self.parameter.name))
    }

    /// A bound moved towards the file's value until the machine is valid, as for an emissivity that ends at one.
    fn valid(&self, study: &Study, bound: f64) -> f64 {
        let holds = |value: f64| study.document_with(&[(&self.parameter, value)]).and_then(|d| Machine::from_document(&d)).is_ok();
        if holds(bound) {
            return bound;
        }
        // Shares and emissivities end at one.
        if self.parameter.value < 1.0 && bound > 1.0 && holds(1.0) {
            return 1.0;
        }
        let (mut inside, mut outside) = (self.parameter.value, bound);
        for _ in 0..50 {
            let middle = self.value(0.5 * (self.coordinate(inside) + self.coordinate(outside)));
            if holds(middle) { inside = middle } else { outside = middle }
        }
        inside
    }

    fn read(&self, text: &str) -> Result<f64> {
        let p = &self.parameter;
        let result = if p.unit == "1" || p.unit.is_empty() {
            text.trim().parse::<f64>().map_err(|_| self.malformed(text))
        } else {
            units::parse(text.trim(), p.dimension).map_err(|e| e.at_key(&p.name))
        };
        result.and_then(|v| if v.is_finite() { Ok(v) } else { Err(self.malformed(text)) })
    }

    fn read_difference(&self, text: &str) -> Result<f64> {
        let p = &self.parameter;
        if p.dimension.is_absolute() {
            return units::parse(text.trim(), units::Dimension::DIFFERENCE).map_err(|e| e.at_key(&p.name));
        }
        self.read(text)
    }

    fn wrong(&self, what: &str, text: &str) -> Error {
        Error::input(what).at_key(&self.parameter.name).read(text)
    }

    fn malformed(&self, text: &str) -> Error {
        let unit = if self.parameter.unit == "1" { String::new() } else { format!(" {}", self.parameter.unit) };
        Error::input("this says neither bounds nor prior of a parameter")
            .at_key(&self.parameter.name)
            .read(text)
            .help(format!("write {}=1{unit}..2{unit} or {}=1{unit} +- 0.1{unit}", self.parameter.name, self.parameter.name))
    }

    /// The coordinate the search moves in.
    pub fn coordinate(&self, value: f64) -> f64 {
        if self.is_logarithmic { value.ln() } else { value }
    }

    /// The bounds as coordinates.
    pub(crate) fn coordinate_bounds(&self) -> (f64, f64) {
        (self.coordinate(self.bounds.0), self.coordinate(self.bounds.1))
    }

    /// Size of the parameter at a value, as a step of its coordinate: a logarithm of one, ten kelvin, or the value.
    fn size(&self, value: f64) -> f64 {
        let p = &self.parameter;
        let size = value.abs().max(p.value.abs());
        if self.is_logarithmic {
            1.0
        } else if p.dimension.is_absolute() || p.kind == ParameterKind::Offset {
            OPEN_KELVIN
        } else if size > 0.0 {
            size
        } else {
            0.1 * (self.bounds.1 - self.bounds.0)
        }
    }

    /// Derivative of the value with respect to its coordinate.
    fn scale(&self, coordinate: f64) -> f64 {
        if self.is_logarithmic { self.value(coordinate) } else { 1.0 }
    }

    /// The value at a coordinate.
    pub fn value(&self, coordinate: f64) -> f64 {
        if self.is_logarithmic { coordinate.exp() } else { coordinate }
    }
}

/// Name that stands for every test, in `KEY@*`.
const EVERY_TEST: &str = "*";

/// Key, test and text of the values, of `KEY@TEST=VALUES`. An `@` within quotes belongs to a name.
fn pieces(text: &str) -> (&str, Option<&str>, &str) {
    let (name, rest) = text.split_once('=').unwrap_or((text, ""));
    match name.rfind('@').filter(|at| !name[*at..].contains('"')) {
        Some(at) => (name[..at].trim(), Some(name[at + 1..].trim()), rest),
        None => (name, None, rest),
    }
}

/// Derivatives that a prediction is to hold.
#[derive(Debug, Clone, Copy)]
struct Derivatives {
    /// With respect to the free parameters.
    parameters: bool,
    /// With respect to the conditions.
    conditions: bool,
}

/// A machine, data and the parameters to be found.
#[derive(Debug, Clone)]
pub struct IdentifyProblem {
    /// The machine as its file has it.
    pub study: Study,
    /// The measured data.
    pub data: Data,
    /// The uncertainty of readings and conditions.
    pub uncertainty: MeasurementUncertainty,
    /// The parameters to find.
    pub free: Vec<Free>,
    /// The state logs begin with.
    pub start: Start,
}

impl IdentifyProblem {
    /// Error allowed in each time step of a log, K.
    fn accuracy(&self) -> f64 {
        BESIDE_RUNS * Runs::beside(&self.study, &self.uncertainty.noise, self.start).tolerance
    }

    /// The problem with logs thinned to about [`MOST_READINGS`].
    pub fn thinned(self) -> Self {
        Self { data: thinned_evenly(&self.data, MOST_READINGS), ..self }
    }

    /// The machine with other values of the free parameters; those of one test alone are left out.
    ///
    /// # Errors
    /// Errors of [`Study::with`].
    pub fn machine_at(&self, values: &[f64]) -> Result<Study> {
        self.machine_of(&self.held_in(None), values)
    }

    /// The machine of one test.
    ///
    /// # Errors
    /// Errors of [`Study::with`].
    pub fn machine_in(&self, test: &str, values: &[f64]) -> Result<Study> {
        self.machine_of(&self.held_in(Some(test)), values)
    }

    /// The free parameters that act in a test; one of its own stands in place of the common one of the same key.
    fn held_in(&self, test: Option<&str>) -> Vec<usize> {
        let has_own =
            |f: &Free| self.free.iter().any(|o| o.test.is_some() && o.test.as_deref() == test && o.parameter.name == f.parameter.name);
        let acts = |f: &Free| if f.test.is_some() { f.test.as_deref() == test } else { !has_own(f) };
        (0..self.free.len()).filter(|k| acts(&self.free[*k])).collect()
    }

    fn machine_of(&self, held: &[usize], values: &[f64]) -> Result<Study> {
        let pairs: Vec<(&MachineParameter, f64)> = held.iter().map(|k| (&self.free[*k].parameter, values[*k])).collect();
        self.study.with(&pairs)
    }

    /// Predictions at values of the free parameters, with derivatives with respect to them and to the conditions.
    ///
    /// # Errors
    /// Errors of [`predict`].
    pub fn predict(&self, values: &[f64]) -> Result<Prediction> {
        Ok(self.predict_some(values, Derivatives { parameters: true, conditions: true }, Pace::own(self.accuracy()))?.0)
    }

    /// Predictions at values of the free parameters without derivatives with respect to the conditions; if `slopes` is false,
    /// without any derivatives.
    fn predict_free(&self, values: &[f64], slopes: bool, pace: Pace<'_>) -> Result<Prediction> {
        Ok(self.predict_some(values, Derivatives { parameters: slopes, conditions: false }, pace)?.0)
    }

    /// Change of the predictions `own` (K) from the model's mesh to an endlessly fine one, at values of the free parameters.
    /// Logs are run at the pace that gave `own`.
    ///
    /// # Errors
    /// Errors of [`MeshShare::of`].
    fn mesh_share(&self, values: &[f64], own: &[f64], pace: Pace<'_>) -> Result<MeshShare> {
        MeshShare::of(&self.study, &self.data, own, f64::INFINITY, |finer: &Study, _: &[Vec<f64>]| {
            let finer = Self { study: finer.clone(), ..self.clone() };
            Ok((finer.predict_free(values, false, pace)?.values, Vec::new()))
        })
    }

    /// Predictions, with the time steps in which logs were run.
    fn predict_some(&self, values: &[f64], wanted: Derivatives, pace: Pace<'_>) -> Result<(Prediction, Steps)> {
        if self.free.iter().all(|f| f.test.is_none()) {
            return self.predict_held(&self.data, &self.held_in(None), values, wanted, pace);
        }
        let own = |test: &String| {
            let rows = self.data.rows.iter().filter(|row| row.test == *test).cloned().collect();
            let data = Data { rows, ..self.data.clone() };
            self.predict_held(&data, &self.held_in(Some(test)), values, wanted, pace)
        };
        let tests = self.data.tests();
        let (found, steps): (Vec<_>, Vec<_>) = tests.par_iter().map(own).collect::<Result<Vec<_>>>()?.into_iter().unzip();
        Ok((predict::joined(&self.data, &tests, &found), steps.into_iter().flatten().collect()))
    }

    /// Predictions of data in which only the parameters `held` act; the slopes of the others are zero.
    fn predict_held(
        &self,
        data: &Data,
        held: &[usize],
        values: &[f64],
        wanted: Derivatives,
        pace: Pace<'_>,
    ) -> Result<(Prediction, Steps)> {
        let study = self.machine_of(held, values)?;
        let asked = if wanted.parameters { held } else { &[] };
        let parameters = asked.iter().map(|k| study.parameter(&self.free[*k].parameter.name)).collect::<Result<Vec<_>>>()?;
        let (mut found, steps) = predict::predict_some(&study, data, &parameters, wanted.conditions, self.start, pace)?;
        for row in found.slopes.iter_mut().filter(|_| wanted.parameters) {
            let mut whole = vec![0.0; self.free.len()];
            for (slope, k) in row.iter().zip(held) {
                // In the changed file a factor counts from the value found.
                whole[*k] = if self.free[*k].parameter.kind == ParameterKind::Factor { slope / values[*k] } else { *slope };
            }
            *row = whole;
        }
        Ok((found, steps))
    }
}
