//! The temperatures of all cells in an answer.

use super::model::{Answer, ReducedModel};
use crate::describe::machine::Condition;
use crate::discretise::network::{Load, Network};
use crate::error::{Error, Result};

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
