//! Temperatures of all nodes of the full network from a reduced state.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::reduced_network::{ReducedNetwork, ReducedState, follow};
use coldplate_base::error::{Error, Result};
use coldplate_network::mesh::path::Station;
use coldplate_network::{Load, Network};

/// Modes and reference temperatures of the field of a machine; nodes are the solid nodes of the full network.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ModeField {
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

impl ModeField {
    /// A field of modes around the temperatures of the middle (K).
    pub(super) fn of(modes: &[Vec<f64>], center: &[f64], element_size: f64) -> Self {
        let narrow = |mode: &Vec<f64>| mode.iter().map(|x| *x as f32).collect();
        Self { element_size, center: center.to_vec(), modes: modes.par_iter().map(narrow).collect(), largest_error: 0.0 }
    }

    /// Difference, K, of the field with these amplitudes from the temperatures of the middle.
    fn rise(&self, amplitudes: impl Iterator<Item = f64>) -> Vec<f64> {
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

    /// Temperatures of all nodes of the full network (K) in a state of the finer network.
    ///
    /// # Errors
    /// The full network is another one.
    pub(super) fn temperatures(&self, fine: &ReducedNetwork, state: &ReducedState, network: &Network, load: &Load) -> Result<Vec<f64>> {
        if network.solids != self.center.len() || network.streams.len() != fine.network.streams.len() {
            let error = Error::input("the mesh of this machine is not the one that the model was made on");
            return Err(error.read(format!("{} nodes then, {} now", self.center.len(), network.solids)).help("make the model anew"));
        }
        let rise = self.rise(state.amplitudes.iter().copied());
        fine.with_water(state, network, load, self.center.iter().zip(rise).map(|(center, rise)| center + rise).collect())
    }

    /// Whether the field has this number of modes and consistent sizes.
    pub(super) fn is_sound(&self, modes: usize) -> bool {
        self.modes.len() == modes && self.element_size > 0.0 && self.modes.iter().all(|mode| mode.len() == self.center.len())
    }
}

impl ReducedNetwork {
    /// Temperatures of all nodes of the full network (K) in a state, if those of the solids are known.
    pub(super) fn with_water(&self, state: &ReducedState, network: &Network, load: &Load, solids: Vec<f64>) -> Result<Vec<f64>> {
        let mut temperatures = solids;
        temperatures.resize(network.nodes, 0.0);
        network.hold(load, &mut temperatures);
        // Films follow the mean temperatures of a channel, which are known; the water then follows its wall.
        for (full, own) in network.streams.iter().zip(&self.network.streams) {
            let water = own.means(&state.temperatures).water;
            temperatures[full.first_node as usize..=full.outlet() as usize].fill(water);
        }
        let states = network.stream_states(load, &temperatures)?;
        let stations = network.streams.iter().flat_map(|stream| &stream.stations);
        let wall = |station: &Station| station.cells.iter().map(|(cell, share)| share * temperatures[*cell]).sum();
        let walls: Vec<f64> = stations.map(wall).collect();
        follow(network, load, &states, &walls, &mut temperatures);
        Ok(temperatures)
    }
}
