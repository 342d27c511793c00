//! What an endlessly fine mesh changes in predictions, and how far that may be off.
//!
//! Finite volumes are of second order: errors fall as the square of the cells' length, by which the model's own mesh and a finer one are
//! continued to their limit (Richardson). Cells end at the faces of parts, so that a sensor's temperature scatters about that line from mesh
//! to mesh, by its own few parts in a hundred of its rise, at every condition alike. What the continuation adds to the finest mesh, and how
//! far the meshes between lie from the line, is what may be off, sensor by sensor: the sum of their squares, not the mean, as a scale known
//! from so few samples asks for.

use rayon::prelude::*;

use super::predict::values;
use crate::error::Result;
use crate::evidence::measurement::{Data, whiten};
use crate::explore::simulate::Start;
use crate::solve::sensitivity::Study;

/// Cells of the finest mesh, over those of the model.
const FINER: f64 = 3.0;
/// Meshes between that one and the model's, likewise.
const BETWEEN: [f64; 2] = [1.5, 2.0];
/// A finest mesh whose cells' squared length is more than this share of the model's is none.
const LEAST_FINER: f64 = 0.9;

/// The share of the mesh in predictions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshShare {
    /// What an endlessly fine mesh changes in every prediction, K.
    pub correction: Vec<f64>,
    /// How far that may be off: columns of unit variance, one entry per reading, K.
    pub scatter: Vec<Vec<f64>>,
}

impl MeshShare {
    /// Nothing, in so many readings.
    pub fn none(readings: usize) -> Self {
        Self { correction: vec![0.0; readings], scatter: Vec::new() }
    }

    /// Of a machine that predicts `own` (K, one per reading of `data`), from what `predict` says of it on finer meshes. Nothing where there
    /// are no cells, but lumped nodes alone.
    ///
    /// # Errors
    /// The machine cannot be meshed so, or `predict` fails.
    pub fn of(study: &Study, data: &Data, own: &[f64], predict: impl Fn(&Study) -> Result<Vec<f64>> + Sync) -> Result<Self> {
        let cells = study.model.mesh.cells as f64;
        if cells == 0.0 {
            return Ok(Self::none(own.len()));
        }
        let of = |factor: f64| -> Result<Meshed> {
            let meshed = study.finer(factor)?;
            let square = (meshed.model.mesh.cells as f64 / cells).powf(-2.0 / 3.0);
            Ok(Meshed { values: predict(&meshed)?, square })
        };
        let mut meshes: Vec<Meshed> = [FINER].par_iter().chain(&BETWEEN).map(|factor| of(*factor)).collect::<Result<_>>()?;
        let finest = meshes.remove(0);
        // What an imported mesh, which stays as it is, says of its limit is nothing.
        let slope = |i: usize| if finest.square < LEAST_FINER { (own[i] - finest.values[i]) / (1.0 - finest.square) } else { 0.0 };
        let beyond: Vec<f64> = (0..own.len()).map(|i| -slope(i) * finest.square).collect();
        let places = whiten::places(data);
        let of_sensor = |apart: &[f64], sensor: usize| -> Vec<f64> {
            places.iter().zip(apart).map(|((_, k), a)| if *k == sensor { *a } else { 0.0 }).collect()
        };
        let from_line = |mesh: &Meshed| -> Vec<f64> {
            (0..own.len()).map(|i| mesh.values[i] - finest.values[i] - slope(i) * (mesh.square - finest.square)).collect()
        };
        let open: Vec<Vec<f64>> = std::iter::once(beyond.clone()).chain(meshes.iter().map(from_line)).collect();
        let scatter = open.iter().flat_map(|apart| (0..data.names.len()).map(|k| of_sensor(apart, k))).collect();
        Ok(Self { correction: finest.values.iter().zip(own).zip(&beyond).map(|((f, c), b)| f + b - c).collect(), scatter })
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
    let share = MeshShare::of(study, data, &own, |finer| values(finer, data, start))?;
    Ok(own.iter().zip(&share.correction).map(|(v, m)| v + m).collect())
}

/// Predictions on a mesh.
struct Meshed {
    /// K
    values: Vec<f64>,
    /// Square of its cells' length over that of the model's.
    square: f64,
}
