//! Parameters of a machine file from measured data, and how well the data determine them.
//!
//! The whitened misfit (y - f)ᵀ Σ⁻¹ (y - f), plus the priors that are given, is minimised by Levenberg and Marquardt's method
//! with the solver's own derivatives. Σ holds reading noise, each sensor's own error and the errors of every condition
//! ([`crate::measurement::Whitener`]). Positive parameters vary by their logarithm. Intervals come from the curvature at the
//! optimum, and from the profile likelihood if the model is refitted along each parameter. Directions that the data leave open
//! are named. If the stated errors do not explain the residual, the model has an error of its own ([`crate::discrepancy`]): the
//! size of it is learnt from the residual beside the parameters, and the intervals widen with it.

mod advice;
mod descent;
mod ended;
mod estimate;
mod free;
mod identified;
mod interval;
mod learnt;
mod mesh;
mod predict;
mod prediction;
mod profile;
mod runs;
mod scan;
mod search;
mod search_end;
mod settle;
mod steady;
mod step;
mod wider;
mod write;

use predict::{Pace, Steps};
use rayon::prelude::*;

use crate::measurement::{Data, MOST_READINGS, MeasurementUncertainty, thinned_evenly};
use coldplate_base::error::Result;
use coldplate_explore::simulate::Start;
use coldplate_solve::study::{MachineParameter, ParameterKind, Study};

pub use advice::{Advice, next_tests};
pub use ended::chi_square_tail;
pub use estimate::{Estimate, FittedModelError, Undetermined};
pub use free::Free;
pub use identified::{IdentifyOptions, identify, identify_and_learn};
pub use interval::{ParameterRange, axis};
pub use learnt::SensorError;
pub use mesh::{MeshShare, continued};
pub use predict::{TIME_TOLERANCE, histories, predict, predict_within, values, values_within};
pub use prediction::{Prediction, own_key, surroundings_slope};
pub use profile::{ParameterProfile, profile, profile_heard};
pub use runs::Runs;
pub use scan::{MisfitScan, scan};
pub use search_end::SearchEnd;
pub use steady::{conditions, states, steady_near, steady_within};
pub use wider::WiderSearch;
pub use write::{model_error_line, write_machine};

/// Error allowed in each time step of a log, over that of runs that are only compared with readings. Dimensionless; chosen:
/// derivatives are differences of runs and need smaller errors.
const BESIDE_RUNS: f64 = 0.1;

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
