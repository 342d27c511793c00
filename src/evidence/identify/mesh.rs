//! What an endlessly fine mesh changes in predictions, and how far that may be off.
//!
//! Finite volumes are of second order: errors fall as the square of the cells' length, by which the model's own mesh and a finer one are
//! continued to their limit (Richardson). Cells end at the faces of parts, so that a sensor's temperature scatters about that line from mesh
//! to mesh, by its own few parts in a hundred of its rise, at every condition alike. What the continuation adds to the finest mesh, and how
//! far the meshes between lie from the line, is what may be off, sensor by sensor: the sum of their squares, not the mean, as a scale known
//! from so few samples asks for.

use rayon::prelude::*;

use super::predict::{Pace, run_logs, values};
use crate::error::Result;
use crate::evidence::measurement::{Data, whiten};
use crate::explore::simulate::Start;
use crate::foundation::numbers::root_mean_square;
use crate::solve::sensitivity::Study;

/// Cells of the finest mesh, over those of the model: as few as leave no more open than is asked for.
const FINEST: [f64; 2] = [3.0, 9.0];
/// Meshes between that one and the model's, over the finest.
const BETWEEN: [f64; 2] = [0.5, 2.0 / 3.0];
/// A finest mesh whose cells' squared length is more than this share of the model's is none.
const LEAST_FINER: f64 = 0.9;
/// Share of what meshes may leave open by which their correction may change from one machine to another much like it without that all
/// are solved.
const MOST_CHANGED: f64 = 0.2;

/// The share of the mesh in predictions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshShare {
    /// What an endlessly fine mesh changes in every prediction, K.
    pub correction: Vec<f64>,
    /// How far that may be off: columns of unit variance, one entry per reading, K.
    pub scatter: Vec<Vec<f64>>,
    /// Cells of the finest mesh, over those of the model, and temperatures on all finer ones.
    finest: f64,
    fields: Vec<Fields>,
    /// What the coarsest set of finer meshes says by its finest alone.
    rough: Rough,
}

/// Temperatures of all nodes at each distinct condition of a table, K.
type Fields = Vec<Vec<f64>>;

/// What one finer mesh says of the limit.
#[derive(Debug, Clone, Default, PartialEq)]
struct Rough {
    /// What an endlessly fine mesh changes in every prediction, continued from this one, K.
    correction: Vec<f64>,
    /// Temperatures on it.
    fields: Fields,
}

impl MeshShare {
    /// Nothing, in so many readings.
    pub fn none(readings: usize) -> Self {
        Self { correction: vec![0.0; readings], ..Self::default() }
    }

    /// Of a machine that predicts `own` (K, one per reading of `data`), from what `predict` says of it on finer meshes: predictions and the
    /// temperatures of all nodes. As many cells are taken as leave no more open than `enough` (K, root mean square), nine times those of
    /// the model at most. Nothing where there are no cells, but lumped nodes alone.
    ///
    /// # Errors
    /// The machine cannot be meshed so, or `predict` fails.
    pub fn of(study: &Study, data: &Data, own: &[f64], enough: f64, predict: impl Finer) -> Result<Self> {
        if study.model.mesh.cells == 0 {
            return Ok(Self::none(own.len()));
        }
        let [few, many] = FINEST;
        let found = Self::up_to(few, study, data, own, &[], &predict)?;
        if found.open() <= enough {
            return Ok(found);
        }
        Ok(Self { rough: found.rough, ..Self::up_to(many, study, data, own, &[], &predict)? })
    }

    /// Of a machine much like the one that this is of, whose meshes left little enough open. The coarsest of the finer meshes says by how
    /// much the correction changes; where that is more than a share of `enough` (K, root mean square), all meshes are solved.
    ///
    /// # Errors
    /// As [`MeshShare::of`].
    pub fn beside(&self, study: &Study, data: &Data, own: &[f64], enough: f64, predict: impl Finer) -> Result<Self> {
        if study.model.mesh.cells == 0 {
            return Ok(self.clone());
        }
        let rough = Meshed::of(study, FINEST[0], &self.rough.fields, &predict)?.continued(own);
        let changed: Vec<f64> = rough.correction.iter().zip(&self.rough.correction).map(|(now, before)| now - before).collect();
        if root_mean_square(&changed) > MOST_CHANGED * enough {
            return Ok(Self { rough, ..Self::up_to(self.finest, study, data, own, &self.fields, &predict)? });
        }
        let correction = self.correction.iter().zip(&changed).map(|(c, changed)| c + changed).collect();
        Ok(Self { correction, rough, ..self.clone() })
    }

    /// With so many times the model's cells in the finest mesh, from temperatures that resemble those on the meshes.
    fn up_to(finest: f64, study: &Study, data: &Data, own: &[f64], near: &[Fields], predict: &impl Finer) -> Result<Self> {
        let [second, third] = BETWEEN;
        let of = |(k, share): (usize, f64)| Meshed::of(study, share * finest, near.get(k).map_or(&[], Vec::as_slice), predict);
        let mut meshes: Vec<Meshed> = [1.0, second, third].into_par_iter().enumerate().map(of).collect::<Result<_>>()?;
        let fields = meshes.iter().map(|mesh| mesh.fields.clone()).collect();
        let (cells, finest) = (finest, meshes.remove(0));
        let slope = finest.slope(own);
        let beyond: Vec<f64> = slope.iter().map(|slope| -slope * finest.square).collect();
        let places = whiten::places(data);
        let of_sensor = |apart: &[f64], sensor: usize| -> Vec<f64> {
            places.iter().zip(apart).map(|((_, k), a)| if *k == sensor { *a } else { 0.0 }).collect()
        };
        let from_line = |mesh: &Meshed| -> Vec<f64> {
            (0..own.len()).map(|i| mesh.values[i] - finest.values[i] - slope[i] * (mesh.square - finest.square)).collect()
        };
        let open: Vec<Vec<f64>> = std::iter::once(beyond).chain(meshes.iter().map(from_line)).collect();
        let scatter = open.iter().flat_map(|apart| (0..data.names.len()).map(|k| of_sensor(apart, k))).collect();
        let rough = finest.continued(own);
        Ok(Self { correction: rough.correction.clone(), scatter, finest: cells, fields, rough })
    }

    /// What is open in the readings, root mean square, K.
    fn open(&self) -> f64 {
        (self.scatter.iter().flatten().map(|c| c * c).sum::<f64>() / self.correction.len().max(1) as f64).sqrt()
    }

    /// The same of logs. Mesh by mesh they are run in the same time steps, which leave an error up to `tolerance` (K) in each on the
    /// model's own mesh: of that a difference between meshes has next to nothing.
    ///
    /// # Errors
    /// As [`MeshShare::of`].
    pub fn of_logs(study: &Study, data: &Data, start: Start, tolerance: f64) -> Result<Self> {
        if study.model.mesh.cells == 0 {
            return Ok(Self::none(whiten::places(data).len()));
        }
        let own = run_logs(study, data, start, None, Pace::own(tolerance))?;
        let pace = Pace { tolerance, steps: Some(&own.steps) };
        let on_finer = |finer: &Study, _: &[Vec<f64>]| Ok((run_logs(finer, data, start, None, pace)?.values, Vec::new()));
        Self::of(study, data, &own.values, f64::INFINITY, on_finer)
    }

    /// Whether there is none: of lumped nodes alone, or where it is not known.
    pub fn is_none(&self) -> bool {
        self.scatter.is_empty()
    }

    /// Largest correction, K.
    pub fn largest(&self) -> f64 {
        self.correction.iter().fold(0.0, |m, c| m.max(c.abs()))
    }
}

/// Predictions of all readings, continued to an endlessly fine mesh, K.
///
/// # Errors
/// As [`MeshShare::of`].
pub fn continued(study: &Study, data: &Data, start: Start) -> Result<Vec<f64>> {
    let own = values(study, data, start)?;
    let on_finer = |finer: &Study, _: &[Vec<f64>]| Ok((values(finer, data, start)?, Vec::new()));
    let share = MeshShare::of(study, data, &own, f64::INFINITY, on_finer)?;
    Ok(own.iter().zip(&share.correction).map(|(v, m)| v + m).collect())
}

/// Predictions of all readings on a finer mesh and the temperatures of its nodes, from temperatures that resemble these: all in K.
pub trait Finer: Fn(&Study, &[Vec<f64>]) -> Result<(Vec<f64>, Vec<Vec<f64>>)> + Sync {}

impl<F: Fn(&Study, &[Vec<f64>]) -> Result<(Vec<f64>, Vec<Vec<f64>>)> + Sync> Finer for F {}

/// Predictions on a mesh.
struct Meshed {
    /// K
    values: Vec<f64>,
    /// Of every node at each distinct condition of a table, K.
    fields: Vec<Vec<f64>>,
    /// Square of its cells' length over that of the model's.
    square: f64,
}

impl Meshed {
    /// With so many times the cells of the model, from temperatures of its nodes that resemble those of the machine.
    fn of(study: &Study, finer: f64, near: &[Vec<f64>], predict: &impl Finer) -> Result<Self> {
        let meshed = study.finer(finer)?;
        let square = (meshed.model.mesh.cells as f64 / study.model.mesh.cells as f64).powf(-2.0 / 3.0);
        let (values, fields) = predict(&meshed, near)?;
        Ok(Self { values, fields, square })
    }

    /// What a cell as long as the model's would change in every prediction, K.
    fn slope(&self, own: &[f64]) -> Vec<f64> {
        // What an imported mesh, which stays as it is, says of its limit is nothing.
        let is_finer = self.square < LEAST_FINER;
        own.iter().zip(&self.values).map(|(own, v)| if is_finer { (own - v) / (1.0 - self.square) } else { 0.0 }).collect()
    }

    /// What it says of the limit.
    fn continued(&self, own: &[f64]) -> Rough {
        let slope = self.slope(own);
        let correction = self.values.iter().zip(own).zip(&slope).map(|((v, own), slope)| v - slope * self.square - own).collect();
        Rough { correction, fields: self.fields.clone() }
    }
}
