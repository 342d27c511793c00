//! The temperatures of all cells in an answer.

use super::level::follow;
use super::model::{Answer, ReducedModel};
use crate::describe::machine::Condition;
use crate::discretise::mesh::path::Station;
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
        if network.solids != field.center.len() || network.streams.len() != sampled.streams.len() {
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
        // Films follow the mean temperatures of a channel, which are known; the water then follows its wall.
        for (full, own) in network.streams.iter().zip(&sampled.streams) {
            let (_, water) = own.mean_temperatures(&answer.state.temperatures);
            temperatures[full.first_node as usize..=full.outlet() as usize].fill(water);
        }
        let states = network.stream_states(&load, &temperatures)?;
        let stations = network.streams.iter().flat_map(|stream| &stream.stations);
        let wall = |station: &Station| station.cells.iter().map(|(cell, share)| share * temperatures[*cell]).sum();
        let walls: Vec<f64> = stations.map(wall).collect();
        follow(network, &load, &states, &walls, &mut temperatures);
        Ok(temperatures)
    }
}
