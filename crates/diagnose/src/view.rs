//! The data beside one machine: predictions, their change on a finer mesh, and the covariance of the residual.

use std::collections::HashSet;
use std::sync::Arc;

use rayon::prelude::*;

use super::effects::{CommonFactor, Hypothesis, Scales, hypotheses};
use super::signature::{self, Signatures};
use super::stated::Stated;
use super::{Discrepancy, Problem, UncertainNumber, signatures};
use coldplate_base::error::Result;
use coldplate_base::numbers::root_mean_square;
use coldplate_evidence::discrepancy::{DiscrepancySize, ErrorParts};
use coldplate_evidence::identify::{self, MeshShare, Prediction};
use coldplate_evidence::measurement::{Whitener, whiten};
use coldplate_solve::study::{MachineParameter, Study};

/// What the mesh may leave open in the readings of a table, over their noise: more would hide what they show.
const MESH_BESIDE_NOISE: f64 = 0.5;
/// Temperatures on finer meshes are found to this share of that, and to no better and no worse than these, K.
const ON_MESHES: f64 = 0.02;
const ON_MESHES_WITHIN: (f64, f64) = (2e-5, 1e-3);
/// Error allowed in each time step of logs that are run mesh by mesh in the same steps, K.
const MESH_TOLERANCE: f64 = 0.1;

/// Data and one machine.
#[derive(Debug, Clone)]
pub(crate) struct Comparison {
    /// Predictions, residual (less the mesh's share) and signatures of the catalogue it was made with.
    pub found: Signatures,
    /// What an endlessly fine mesh changes, K.
    pub mesh: Vec<f64>,
    /// Covariance in parts.
    pub errors: ErrorParts,
    /// What one standard deviation of each of [`CommonFactor::ALL`] changes in every reading, K.
    pub factors: Vec<Vec<f64>>,
    /// Causes that are a number of the file, with the amplitude of a change of it by a factor e, in the order of the covariance.
    pub numbers: Vec<(Hypothesis, f64)>,
    /// The whitening.
    pub whitener: Whitener,
    /// Readings less the mesh's share, K: they compare with predictions on the model's own mesh.
    pub readings: Vec<f64>,
    /// What finer meshes say, and what the common factors change beside their slopes, K: those of machines much like it are near.
    finer: Arc<MeshShare>,
    bends: Arc<Vec<Vec<f64>>>,
}

impl Comparison {
    /// Of a machine with the signatures of `catalogue`.
    ///
    /// # Errors
    /// The machine cannot be solved at the data's conditions.
    pub fn of(problem: &Problem, study: &Study, catalogue: &[Hypothesis], scales: &Scales) -> Result<Self> {
        Self::beside(problem, study, catalogue, scales, None)
    }

    /// The same of a machine much like one that is known.
    fn beside(problem: &Problem, study: &Study, catalogue: &[Hypothesis], scales: &Scales, known: Option<&Self>) -> Result<Self> {
        let uncertain = problem.uncertain.iter().map(|u| study.parameter(&u.parameter.name)).collect::<Result<Vec<MachineParameter>>>()?;
        let (data, is_log) = (&problem.data, problem.data.is_transient());
        let near = known.map(|known| known.found.fields.as_slice());
        let mut found = if is_log {
            signatures(study, data, problem.runs(), &uncertain, catalogue, scales, &problem.user)?
        } else {
            signature::steady(study, data, Some(&uncertain), catalogue, (scales, &problem.user), near)?
        };
        let enough = MESH_BESIDE_NOISE * root_mean_square(&whiten::deviations(data, &problem.uncertainty));
        let within = (ON_MESHES * enough).clamp(ON_MESHES_WITHIN.0, ON_MESHES_WITHIN.1);
        let on_finer = |finer: &Study, near: &[Vec<f64>]| identify::steady_within(finer, data, near, within);
        let finer = match (is_log, known) {
            (true, _) => MeshShare::of_logs(study, data, problem.start, MESH_TOLERANCE)?,
            (false, None) => MeshShare::of(study, data, &found.prediction.values, enough, on_finer)?,
            (false, Some(known)) => known.finer.beside(study, data, &found.prediction.values, enough, on_finer)?,
        };
        let mesh = finer.correction.clone();
        found.residual.iter_mut().zip(&mesh).for_each(|(r, m)| *r -= m);
        add_mesh_share(catalogue, &mut found.columns, &mesh, &whiten::places(&problem.data));
        let stated = Stated::of(problem, study);
        let factors = open_factors(&problem.discrepancy, &stated, catalogue, &found.columns, mesh.len());
        let numbers: Vec<Option<f64>> = catalogue.iter().map(|h| stated.number(h, problem, study, scales)).collect();
        let mut errors = error_parts(problem, study, &stated, &found.prediction, catalogue, (&found.columns, &numbers));
        errors.extend(factors.iter().cloned());
        errors.extend(finer.scatter.iter().cloned());
        let bends = match (is_log, known) {
            (true, _) => Arc::default(),
            (false, None) => Arc::new(bends(problem, study, &stated, catalogue, scales, &found)),
            (false, Some(known)) => known.bends.clone(),
        };
        errors.extend(bends.iter().cloned());
        let all: Vec<usize> = (0..mesh.len()).collect();
        let readings = whiten::readings(&problem.data).iter().zip(&mesh).map(|(r, m)| r - m).collect();
        let numbers = catalogue.iter().zip(numbers).filter_map(|(h, unit)| Some((h.clone(), unit?))).collect();
        let (whitener, finer) = (errors.whitener(&DiscrepancySize::NONE, &all), Arc::new(finer));
        Ok(Self { whitener, found, mesh, errors, factors, readings, numbers, finer, bends })
    }

    /// What predictions leave of the readings, K.
    pub fn left(&self, values: &[f64]) -> Vec<f64> {
        self.readings.iter().zip(values).map(|(r, v)| r - v).collect()
    }

    /// Of a machine in which a cause is in force, without signatures of others: with the cause, errors and the mesh's share act differently
    /// too. It is much like this one.
    ///
    /// # Errors
    /// As [`Comparison::of`].
    pub fn about(&self, problem: &Problem, study: &Study, catalogue: &[Hypothesis], scales: &Scales) -> Result<Self> {
        let own: HashSet<(&str, &str)> = catalogue.iter().map(|h| (h.kind(), h.place.as_str())).collect();
        let mut common = hypotheses(study, &problem.data, &problem.user);
        let network = &study.model.network;
        let counts = |h: &Hypothesis| {
            h.common_factor().is_some() || h.discrepancy(network, &problem.discrepancy).is_some() || h.of_a_number(network).is_some()
        };
        common.retain(|h| counts(h) && own.contains(&(h.kind(), h.place.as_str())));
        Self::beside(problem, study, &common, scales, Some(self))
    }
}

/// Exchanged readings take what a finer mesh changes at each other's place.
pub(crate) fn add_mesh_share(catalogue: &[Hypothesis], columns: &mut [Vec<f64>], mesh: &[f64], places: &[(usize, usize)]) {
    for (h, column) in catalogue.iter().zip(columns) {
        let Some(from) = h.relabelled(places) else { continue };
        column.iter_mut().zip(from).enumerate().for_each(|(i, (c, other))| *c += mesh[other] - mesh[i]);
    }
}

/// What the common factors of films, heats and emissivities change beside their slopes: far from the water a bearing that only radiates
/// bends with its emissivity by more than its reading's noise. Half the second derivative times the variance, as large as the square
/// of a normal number is in the mean square.
fn bends(
    problem: &Problem,
    study: &Study,
    stated: &Stated,
    catalogue: &[Hypothesis],
    scales: &Scales,
    found: &Signatures,
) -> Vec<Vec<f64>> {
    let moved = |factor: CommonFactor, sign: f64| -> Option<Vec<f64>> {
        let mut sets = Vec::new();
        for h in catalogue.iter().filter(|h| h.common_factor() == Some(factor) && !stated.is_measured(h)) {
            sets.extend(h.sets(study, scales, &problem.user, sign * factor.deviation(&problem.discrepancy)).ok().flatten()?);
        }
        if sets.is_empty() {
            return None;
        }
        let (values, _) = identify::steady_near(&study.edited(&sets).ok()?, &problem.data, &found.fields).ok()?;
        Some(values)
    };
    let bend = |factor: CommonFactor| -> Option<Vec<f64>> {
        let (more, less) = (moved(factor, 1.0)?, moved(factor, -1.0)?);
        let square = more.iter().zip(&less).zip(&found.prediction.values).map(|((m, l), v)| 0.5 * (m + l) - v);
        Some(square.map(|c| 3f64.sqrt() * c).collect())
    };
    CommonFactor::ALL.into_par_iter().filter_map(bend).collect()
}

/// What the common factors of films, heats and emissivities leave open in every reading, K. Heats that are columns of the table are as
/// certain as is stated of these.
pub(crate) fn open_factors(
    discrepancy: &Discrepancy,
    stated: &Stated,
    catalogue: &[Hypothesis],
    columns: &[Vec<f64>],
    readings: usize,
) -> Vec<Vec<f64>> {
    let of = |factor: &CommonFactor| {
        let mut sum = vec![0.0; readings];
        let is_member = |h: &Hypothesis| h.common_factor() == Some(*factor) && !stated.is_measured(h);
        for (_, column) in catalogue.iter().zip(columns).filter(|(h, _)| is_member(h)) {
            sum.iter_mut().zip(column).for_each(|(s, c)| *s += factor.deviation(discrepancy) * c);
        }
        sum
    };
    CommonFactor::ALL.iter().map(of).collect()
}

/// The covariance of a residual in parts, with what every model leaves open but for common factors, and what the numbers of the file
/// change: those among the catalogue with their amplitudes for a factor e.
fn error_parts(
    problem: &Problem,
    study: &Study,
    stated: &Stated,
    prediction: &Prediction,
    catalogue: &[Hypothesis],
    (columns, numbers): (&[Vec<f64>], &[Option<f64>]),
) -> ErrorParts {
    let (data, network) = (&problem.data, &study.model.network);
    let (values, (slopes, of_heats)) = (&prediction.values, stated.split(problem, &prediction.conditions, (catalogue, columns)));
    let mut parts = ErrorParts::new(&study.model.machine, data, &problem.uncertainty, problem.discrepancy.model, values, &slopes);
    let scaled = |column: &Vec<f64>, by: f64| column.iter().map(|c| by * c).collect::<Vec<f64>>();
    let uncertain = |(k, u): (usize, &UncertainNumber)| prediction.slopes.iter().map(|row| row[k] * u.deviation).collect();
    // Films follow one correlation; what parts store does not: each has its own shape and material.
    let own = |(h, column): (&Hypothesis, &Vec<f64>)| h.discrepancy(network, &problem.discrepancy).map(|spread| scaled(column, spread));
    parts.extend(catalogue.iter().zip(columns).filter_map(own));
    let number = |(unit, column): (&Option<f64>, &Vec<f64>)| unit.map(|unit| scaled(column, unit));
    parts.with_numbers(
        problem.uncertain.iter().enumerate().map(uncertain).chain(of_heats).collect(),
        numbers.iter().zip(columns).filter_map(number).collect(),
    );
    parts
}
