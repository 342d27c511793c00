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
use crate::solve::sensitivity::Study;

/// Cells of the finest mesh, over those of the model: as few as leave no more open than is asked for.
const FINEST: [f64; 2] = [3.0, 9.0];
/// Meshes between that one and the model's, over the finest.
const BETWEEN: [f64; 2] = [0.5, 2.0 / 3.0];
/// A finest mesh whose cells' squared length is more than this share of the model's is none.
const LEAST_FINER: f64 = 0.9;

/// The share of the mesh in predictions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshShare {
    /// What an endlessly fine mesh changes in every prediction, K.
    pub correction: Vec<f64>,
    /// How far that may be off: columns of unit variance, one entry per reading, K.
    pub scatter: Vec<Vec<f64>>,
    /// Where those of a machine much like it begin.
    pub begun: Begun,
}

/// Meshes that are known to leave little enough open, and temperatures on them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Begun {
    /// Cells of the finest, over those of the model; 0 where nothing is known.
    finest: f64,
    /// Temperatures of all nodes at each distinct condition of a table on each of these meshes, K.
    fields: Vec<Vec<Vec<f64>>>,
}

impl MeshShare {
    /// Nothing, in so many readings.
    pub fn none(readings: usize) -> Self {
        Self { correction: vec![0.0; readings], scatter: Vec::new(), begun: Begun::default() }
    }

    /// Of a machine that predicts `own` (K, one per reading of `data`), from what `predict` says of it on finer meshes: predictions and the
    /// temperatures of all nodes, beginning with those that are known of a machine much like it. As many cells are taken as leave no more
    /// open than `enough` (K, root mean square), nine times those of the model at most. Nothing where there are no cells, but lumped nodes
    /// alone.
    ///
    /// # Errors
    /// The machine cannot be meshed so, or `predict` fails.
    pub fn of(study: &Study, data: &Data, own: &[f64], enough: f64, known: &Begun, predict: impl Finer) -> Result<Self> {
        if study.model.mesh.cells == 0 {
            return Ok(Self::none(own.len()));
        }
        let [few, many] = FINEST;
        if known.finest < many {
            let found = Self::up_to(few, study, data, own, known, &predict)?;
            if found.open() <= enough {
                return Ok(found);
            }
        }
        Self::up_to(many, study, data, own, known, &predict)
    }

    /// With so many times the model's cells in the finest mesh.
    fn up_to(finest: f64, study: &Study, data: &Data, own: &[f64], known: &Begun, predict: &impl Finer) -> Result<Self> {
        let cells = study.model.mesh.cells as f64;
        let near = if known.finest == finest { known.fields.as_slice() } else { &[] };
        let of = |(k, share): (usize, f64)| -> Result<Meshed> {
            let meshed = study.finer(share * finest)?;
            let square = (meshed.model.mesh.cells as f64 / cells).powf(-2.0 / 3.0);
            let (values, fields) = predict(&meshed, near.get(k).map_or(&[], Vec::as_slice))?;
            Ok(Meshed { values, fields, square })
        };
        let [second, third] = BETWEEN;
        let mut meshes: Vec<Meshed> = [1.0, second, third].into_par_iter().enumerate().map(of).collect::<Result<_>>()?;
        let fields = meshes.iter_mut().map(|mesh| std::mem::take(&mut mesh.fields)).collect();
        let finest_mesh = meshes.remove(0);
        // What an imported mesh, which stays as it is, says of its limit is nothing.
        let is_finer = finest_mesh.square < LEAST_FINER;
        let slope = |i: usize| if is_finer { (own[i] - finest_mesh.values[i]) / (1.0 - finest_mesh.square) } else { 0.0 };
        let beyond: Vec<f64> = (0..own.len()).map(|i| -slope(i) * finest_mesh.square).collect();
        let places = whiten::places(data);
        let of_sensor = |apart: &[f64], sensor: usize| -> Vec<f64> {
            places.iter().zip(apart).map(|((_, k), a)| if *k == sensor { *a } else { 0.0 }).collect()
        };
        let from_line = |mesh: &Meshed| -> Vec<f64> {
            (0..own.len()).map(|i| mesh.values[i] - finest_mesh.values[i] - slope(i) * (mesh.square - finest_mesh.square)).collect()
        };
        let open: Vec<Vec<f64>> = std::iter::once(beyond.clone()).chain(meshes.iter().map(from_line)).collect();
        let scatter = open.iter().flat_map(|apart| (0..data.names.len()).map(|k| of_sensor(apart, k))).collect();
        let correction = finest_mesh.values.iter().zip(own).zip(&beyond).map(|((f, c), b)| f + b - c).collect();
        Ok(Self { correction, scatter, begun: Begun { finest, fields } })
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
        Self::of(study, data, &own.values, f64::INFINITY, &Begun::default(), on_finer)
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
    let share = MeshShare::of(study, data, &own, f64::INFINITY, &Begun::default(), on_finer)?;
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
