//! Share of the mesh in predictions: their change on an endlessly fine mesh, and the error of that change.
//!
//! Finite volumes are of second order: errors fall as the square of the cells' length. The model's own mesh and a finer one are
//! continued to their limit by that law (Richardson). Cells end at the faces of parts, so a sensor's temperature scatters about
//! that line from mesh to mesh, by some per cent of its rise, alike at every condition. Two deviations measure the error of the
//! limit, sensor by sensor: the step of the continuation beyond the finest mesh, and the distances of the meshes between from
//! the line. Their sum of squares is taken, not the mean, since a scale is known poorly from so few samples.

use rayon::prelude::*;

use super::predict::{Pace, run_logs, values};
use crate::measurement::{Data, whiten};
use coldplate_base::error::Result;
use coldplate_base::numbers::root_mean_square;
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

/// Cells of the meshes between the model's and the finest, as shares of the finest. Chosen: both lie between for either finest
/// mesh.
const BETWEEN: [f64; 2] = [0.5, 2.0 / 3.0];
/// Largest ratio of the squared length of the finest mesh's cells to the model's for which it counts as finer. Dimensionless;
/// chosen: imported meshes keep their cells.
const LEAST_FINER: f64 = 0.9;
/// Largest change of the mesh correction, as a share of the allowed mesh error, from one machine to another much like it
/// without a new solution of all meshes. Chosen: with half of the noise allowed it is a tenth of the noise (docs/method/diagnosis.md).
const MOST_CHANGED: f64 = 0.2;

/// The share of the mesh in predictions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshShare {
    /// Change of every prediction from the model's mesh to an endlessly fine one, K.
    pub correction: Vec<f64>,
    /// Error of the correction: columns of unit variance, one entry per reading, K.
    pub scatter: Vec<Vec<f64>>,
    /// Cells of the finest mesh over those of the model.
    finest: f64,
    /// Temperatures on all finer meshes.
    fields: Vec<Fields>,
    /// Correction by the finest mesh of the coarsest set alone.
    rough: Rough,
}

/// Temperatures of all nodes at each distinct condition of a table, K.
type Fields = Vec<Vec<f64>>;

/// Correction by a single finer mesh.
#[derive(Debug, Clone, Default, PartialEq)]
struct Rough {
    /// Change of every prediction from the model's mesh to an endlessly fine one, continued from this mesh, K.
    correction: Vec<f64>,
    /// Temperatures on this mesh.
    fields: Fields,
}

impl MeshShare {
    /// Cells of the finest mesh over those of the model, the first tried and the most; dimensionless. The first is kept if it
    /// leaves no more open than is asked for. Chosen: 1.4 and 2.1 times as many cells along each edge; more cost time.
    pub const FINEST: [f64; 2] = [3.0, 9.0];

    /// A share of zero in so many readings.
    pub fn none(readings: usize) -> Self {
        Self { correction: vec![0.0; readings], ..Self::default() }
    }

    /// Share of the mesh in a machine's predictions `own` (K, one per reading of `data`). On finer meshes `predict` gives the
    /// predictions and the temperatures of all nodes. The number of cells is raised until no more than `enough` (K, root mean
    /// square) stays open, to nine times those of the model at most. Zero for a machine of lumped nodes alone.
    ///
    /// # Errors
    /// The machine cannot be meshed so, or `predict` fails.
    pub fn of(study: &Study, data: &Data, own: &[f64], enough: f64, predict: impl Finer) -> Result<Self> {
        if study.model.mesh.cells == 0 {
            return Ok(Self::none(own.len()));
        }
        let [few, many] = Self::FINEST;
        let found = Self::up_to(few, study, data, own, &[], &predict)?;
        if found.open() <= enough {
            return Ok(found);
        }
        Ok(Self { rough: found.rough, ..Self::up_to(many, study, data, own, &[], &predict)? })
    }

    /// Share of the mesh for a machine much like the one of this share, whose meshes left little enough open. The coarsest of
    /// the finer meshes gives the change of the correction. If it is more than a share of `enough` (K, root mean square), all
    /// meshes are solved.
    ///
    /// # Errors
    /// Errors of [`MeshShare::of`].
    pub fn beside(&self, study: &Study, data: &Data, own: &[f64], enough: f64, predict: impl Finer) -> Result<Self> {
        if study.model.mesh.cells == 0 {
            return Ok(self.clone());
        }
        let rough = Meshed::of(study, Self::FINEST[0], &self.rough.fields, &predict)?.continued(own);
        let changed: Vec<f64> = rough.correction.iter().zip(&self.rough.correction).map(|(now, before)| now - before).collect();
        if root_mean_square(&changed) > MOST_CHANGED * enough {
            return Ok(Self { rough, ..Self::up_to(self.finest, study, data, own, &self.fields, &predict)? });
        }
        let correction = self.correction.iter().zip(&changed).map(|(c, changed)| c + changed).collect();
        Ok(Self { correction, rough, ..self.clone() })
    }

    /// Share of the mesh with `finest` times the model's cells in the finest mesh. The solutions start from temperatures `near`
    /// those on the meshes.
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

    /// Root mean square of the error of the correction over the readings, K.
    fn open(&self) -> f64 {
        (self.scatter.iter().flatten().map(|c| c * c).sum::<f64>() / self.correction.len().max(1) as f64).sqrt()
    }

    /// Share of the mesh in logs. All meshes are run in the time steps of the model's own mesh, whose error in each is up to
    /// `tolerance` (K): it nearly cancels in the difference between meshes.
    ///
    /// # Errors
    /// Errors of [`MeshShare::of`].
    pub fn of_logs(study: &Study, data: &Data, start: Start, tolerance: f64) -> Result<Self> {
        if study.model.mesh.cells == 0 {
            return Ok(Self::none(whiten::places(data).len()));
        }
        let own = run_logs(study, data, start, None, Pace::own(tolerance))?;
        let pace = Pace { tolerance, steps: Some(&own.steps) };
        let on_finer = |finer: &Study, _: &[Vec<f64>]| Ok((run_logs(finer, data, start, None, pace)?.values, Vec::new()));
        Self::of(study, data, &own.values, f64::INFINITY, on_finer)
    }

    /// Whether there is no share of the mesh: for lumped nodes alone, or if it is not known.
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
/// Errors of [`MeshShare::of`].
pub fn continued(study: &Study, data: &Data, start: Start) -> Result<Vec<f64>> {
    let own = values(study, data, start)?;
    let on_finer = |finer: &Study, _: &[Vec<f64>]| Ok((values(finer, data, start)?, Vec::new()));
    let share = MeshShare::of(study, data, &own, f64::INFINITY, on_finer)?;
    Ok(own.iter().zip(&share.correction).map(|(v, m)| v + m).collect())
}

/// Predictions of all readings on a finer mesh and the temperatures of its nodes, from temperatures that resemble these: all in
/// K.
pub trait Finer: Fn(&Study, &[Vec<f64>]) -> Result<(Vec<f64>, Vec<Vec<f64>>)> + Sync {}

impl<F: Fn(&Study, &[Vec<f64>]) -> Result<(Vec<f64>, Vec<Vec<f64>>)> + Sync> Finer for F {}

/// Predictions on a mesh.
struct Meshed {
    /// Prediction of each reading, K.
    values: Vec<f64>,
    /// Temperature of every node at each distinct condition of a table, K.
    fields: Vec<Vec<f64>>,
    /// Square of this mesh's cell length over that of the model's.
    square: f64,
}

impl Meshed {
    /// Predictions on a mesh of `finer` times the cells of the model. The solutions start from temperatures `near` those of its
    /// nodes.
    fn of(study: &Study, finer: f64, near: &[Vec<f64>], predict: &impl Finer) -> Result<Self> {
        let meshed = study.finer(finer)?;
        let square = (meshed.model.mesh.cells as f64 / study.model.mesh.cells as f64).powf(-2.0 / 3.0);
        let (values, fields) = predict(&meshed, near)?;
        Ok(Self { values, fields, square })
    }

    /// Mesh error of every prediction with cells as long as the model's, K, by the law that it grows as the square of their
    /// length.
    fn slope(&self, own: &[f64]) -> Vec<f64> {
        // An imported mesh stays as it is and gives no correction.
        let is_finer = self.square < LEAST_FINER;
        own.iter().zip(&self.values).map(|(own, v)| if is_finer { (own - v) / (1.0 - self.square) } else { 0.0 }).collect()
    }

    /// Correction to an endlessly fine mesh by this mesh alone.
    fn continued(&self, own: &[f64]) -> Rough {
        let slope = self.slope(own);
        let correction = self.values.iter().zip(own).zip(&slope).map(|((v, own), slope)| v - slope * self.square - own).collect();
        Rough { correction, fields: self.fields.clone() }
    }
}
