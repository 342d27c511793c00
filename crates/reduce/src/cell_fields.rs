//! Temperatures of all cells in an answer: as a result, and as a start for the full solver.

use super::model::{Answer, ReducedModel};
use super::reduced_network::follow;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_network::mesh::path::Station;
use coldplate_network::{Load, Network};
use coldplate_solve::csr::for_chunks;

/// Assumed error of the field, as a share of the largest bound. Chosen: the bound of a reading is mostly much larger
/// than the error.
const FIELD: f64 = 0.1;

/// Temperatures that the full solver starts from.
pub struct Guess {
    /// Temperatures of all nodes, K.
    pub temperatures: Vec<f64>,
    /// Estimated distance from the solution, K.
    pub error: f64,
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
        if network.solids != field.center.len() || network.streams.len() != self.fine.network.streams.len() {
            let error = Error::input("the mesh of this machine is not the one that the model was made on");
            return Err(error.read(format!("{} nodes then, {} now", field.center.len(), network.solids)).help("make the model anew"));
        }
        let load = Load::at(&self.machine, condition)?;
        let rise = field.rise(answer.state.amplitudes.iter().copied());
        self.with_water(answer, (network, &load), field.center.iter().zip(rise).map(|(center, rise)| center + rise).collect())
    }

    /// Guess of the full solution of an answer; `center` and `modes` are those of the finer network at all nodes.
    pub(super) fn guess(&self, answer: &Answer, on: (&Network, &Load), center: &[f64], modes: &[Vec<f64>]) -> Result<Guess> {
        let mut temperatures = center[..on.0.solids].to_vec();
        for (mode, amplitude) in modes.iter().zip(answer.state.amplitudes.iter()) {
            for_chunks(&mut temperatures, |first, part| part.iter_mut().zip(&mode[first..]).for_each(|(t, m)| *t += amplitude * m));
        }
        let error = FIELD * answer.bounds.iter().fold(0.0, |most: f64, bound| most.max(*bound));
        Ok(Guess { temperatures: self.with_water(answer, on, temperatures)?, error })
    }

    /// Temperatures of all nodes, if those of the solids (K) are known.
    fn with_water(&self, answer: &Answer, (network, load): (&Network, &Load), solids: Vec<f64>) -> Result<Vec<f64>> {
        let mut temperatures = solids;
        temperatures.resize(network.nodes, 0.0);
        for (node, held) in &network.fixed {
            temperatures[*node as usize] = load.fixed[*held as usize];
        }
        // Films follow the mean temperatures of a channel, which are known; the water then follows its wall.
        for (full, own) in network.streams.iter().zip(&self.fine.network.streams) {
            let (_, water) = own.mean_temperatures(&answer.state.temperatures);
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
