//! The temperatures of all nodes from a reduced state: the modes of the finer network at every node.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::model::{Answer, ReducedModel};
use crate::describe::machine::Condition;
use crate::discretise::network::{Load, Network};
use crate::error::{Error, Result};

/// What holds the field of a machine; nodes are the solid ones of the full network.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Field {
    /// Element size of the mesh, m, that makes it anew.
    pub element_size: f64,
    /// Temperatures that the modes are added to, K.
    pub center: Vec<f64>,
    /// Modes of the finer network at every node; single precision leaves less than a microkelvin open.
    pub modes: Vec<Vec<f32>>,
    /// Largest error of any node at the conditions that the bound was calibrated on, K.
    pub largest_error: f64,
}

impl Field {
    /// Of modes around the temperatures of the middle (K).
    pub(super) fn of(modes: &[Vec<f64>], center: &[f64], element_size: f64) -> Self {
        let narrow = |mode: &Vec<f64>| mode.iter().map(|x| *x as f32).collect();
        Self { element_size, center: center.to_vec(), modes: modes.par_iter().map(narrow).collect(), largest_error: 0.0 }
    }

    /// What some amplitudes add to the temperatures of the middle, K.
    pub(super) fn rise(&self, amplitudes: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut rise = vec![0.0; self.center.len()];
        for (mode, amplitude) in self.modes.iter().zip(amplitudes) {
            rise.par_iter_mut().zip(mode).with_min_len(4096).for_each(|(r, m)| *r += amplitude * f64::from(*m));
        }
        rise
    }

    /// Whether it is one of so many modes.
    pub(super) fn is_sound(&self, modes: usize) -> bool {
        self.modes.len() == modes && self.element_size > 0.0 && self.modes.iter().all(|mode| mode.len() == self.center.len())
    }
}

impl ReducedModel {
    /// Temperatures of all nodes of the full network (K) in an answer at a condition.
    ///
    /// # Errors
    /// The model was made without its field, the condition cannot be evaluated, or the network is another one.
    pub fn temperatures(&self, answer: &Answer, condition: &Condition, network: &Network) -> Result<Vec<f64>> {
        let Some(field) = &self.field else {
            return Err(Error::input("this reduced model knows its sensors, not its field").help("make it with `coldplate reduce --field`"));
        };
        let sampled = &self.fine.network;
        let is_same = network.solids == field.center.len() && network.streams.len() == sampled.streams.len();
        if !is_same || network.streams.iter().zip(&sampled.streams).any(|(a, b)| a.stations.len() != b.stations.len()) {
            let error = Error::input("the mesh of this machine is not the one that the model was made on");
            return Err(error.read(format!("{} nodes then, {} now", field.center.len(), network.solids)).help("make the model anew"));
        }
        let load = Load::at(&self.machine, condition)?;
        let rise = field.rise(answer.state.amplitudes.iter().copied());
        let mut temperatures: Vec<f64> = field.center.iter().zip(rise).map(|(center, rise)| center + rise).collect();
        temperatures.resize(network.nodes, 0.0);
        for (node, held) in &network.fixed {
            temperatures[*node as usize] = load.fixed[*held as usize];
        }
        for (full, own) in network.streams.iter().zip(&sampled.streams) {
            let (to, from, count) = (full.first_node as usize, own.first_node as usize, full.stations.len());
            temperatures[to..to + count].copy_from_slice(&answer.state.temperatures[from..from + count]);
        }
        Ok(temperatures)
    }
}
