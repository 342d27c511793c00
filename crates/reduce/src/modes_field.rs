//! The temperatures of all nodes from a reduced state: the modes of the finer network at every node.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Modes and reference temperatures of the field of a machine; nodes are the solid nodes of the full network.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Field {
    /// Element size, m, that makes this mesh anew.
    pub element_size: f64,
    /// Temperatures that the modes are added to, K.
    pub center: Vec<f64>,
    /// Modes of the finer network at every node, single precision: rounding changes temperatures by less than a
    /// microkelvin.
    pub modes: Vec<Vec<f32>>,
    /// Largest error of any node at the conditions that the bound was calibrated on, K.
    pub largest_error: f64,
}

impl Field {
    /// A field of modes around the temperatures of the middle (K).
    pub(super) fn of(modes: &[Vec<f64>], center: &[f64], element_size: f64) -> Self {
        let narrow = |mode: &Vec<f64>| mode.iter().map(|x| *x as f32).collect();
        Self { element_size, center: center.to_vec(), modes: modes.par_iter().map(narrow).collect(), largest_error: 0.0 }
    }

    /// Difference, K, of the field with these amplitudes from the temperatures of the middle.
    pub(super) fn rise(&self, amplitudes: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut rise = vec![0.0; self.center.len()];
        for (mode, amplitude) in self.modes.iter().zip(amplitudes) {
            rise.par_iter_mut().zip(mode).with_min_len(4096).for_each(|(r, m)| *r += amplitude * f64::from(*m));
        }
        rise
    }

    /// Largest difference, K, between the rise with these amplitudes and a known rise. At held nodes the field is the
    /// condition's.
    pub(super) fn apart(&self, known: &[f64], amplitudes: impl Iterator<Item = f64>) -> f64 {
        known.iter().zip(self.rise(amplitudes)).map(|(k, r)| (k - r).abs()).fold(0.0, f64::max)
    }

    /// Whether the field has this number of modes and consistent sizes.
    pub(super) fn is_sound(&self, modes: usize) -> bool {
        self.modes.len() == modes && self.element_size > 0.0 && self.modes.iter().all(|mode| mode.len() == self.center.len())
    }
}
