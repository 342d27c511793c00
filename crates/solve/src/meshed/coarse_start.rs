//! Start of a large model: its own solution on a mesh of far fewer cells, which costs a fraction of a step on the fine one and spares
//! more than one (nested iteration: Brandt, Math. Comp. 31 (1977) 333).

use rayon::prelude::*;

use super::{MeshedMachine, SteadyState};
use coldplate_describe::machine::Condition;
use coldplate_network::mesh::Mesh;
use coldplate_network::mesh::grid::Grid;
use coldplate_network::{Network, Stream};

/// Fewest cells for which a coarser mesh is solved first, a count. Chosen: smaller models are solved as soon without.
const WORTH: usize = 500_000;
/// Ratio of cell sizes of the coarser mesh along each axis, dimensionless. Chosen: cost of the coarse solution against steps on the
/// fine mesh (docs/record/speed.md).
const COARSER: f64 = 4.0;
/// Least ratio of the numbers of cells, fine over coarse, for a coarse mesh that is used; dimensionless. Chosen: a larger coarse mesh
/// would cost more than it spares.
const FEWER: usize = 16;

impl MeshedMachine {
    /// Temperatures of all nodes (K) from the solution at a condition on a coarser mesh; `None` if no coarser mesh pays or can be
    /// solved.
    pub(super) fn start(&self, condition: &Condition) -> Option<Vec<f64>> {
        if self.mesh.cells < WORTH || !self.mesh.tetra.is_empty() {
            return None;
        }
        let mesh = self.coarser(COARSER).ok().filter(|mesh| mesh.cells * FEWER <= self.mesh.cells)?;
        let coarse = Self::on(self.machine.clone(), mesh).ok()?;
        let state = coarse.steady(condition).ok()?;
        Some(brought_over(&coarse, &state, &self.mesh, &self.network))
    }
}

/// The temperatures of a state on another mesh of the same machine, K.
fn brought_over(coarse: &MeshedMachine, state: &SteadyState, mesh: &Mesh, network: &Network) -> Vec<f64> {
    let known = &state.solution.temperatures;
    let mut found = vec![0.0; network.nodes];
    for (fine, coarse) in mesh.grids.iter().zip(&coarse.mesh.grids) {
        interpolate(coarse, known, fine, &mut found[fine.first..][..fine.len()]);
    }
    // Lumped nodes are equal on both meshes.
    let nodes = coarse.machine.nodes.len();
    found[mesh.cells..][..nodes].copy_from_slice(&known[coarse.mesh.cells..][..nodes]);
    // Nodes without capacity take the temperature of a node they are joined to, or the mean of all.
    let first = mesh.cells + nodes;
    let solids = &known[..coarse.network.solids];
    found[first..network.solids].fill(solids.iter().sum::<f64>() / solids.len() as f64);
    for joint in &network.joints {
        for (own, other) in [(joint.a as usize, joint.b as usize), (joint.b as usize, joint.a as usize)] {
            if own >= first && other < first {
                found[own] = found[other];
            }
        }
    }
    for (fine, coarse) in network.streams.iter().zip(&coarse.network.streams) {
        water(coarse, known, fine, &mut found);
    }
    found
}

/// Interpolates the cells of a block, linearly along each axis.
fn interpolate(coarse: &Grid, known: &[f64], fine: &Grid, found: &mut [f64]) {
    let axis = |d: usize| -> Vec<[(usize, f64); 2]> { (0..fine.n(d)).map(|i| coarse.between(d, fine.centre(d, i))).collect() };
    let [x, y, z] = [0, 1, 2].map(axis);
    found.par_chunks_mut(x.len()).enumerate().for_each(|(row, found)| {
        let (y, z) = (y[row % y.len()], z[row / y.len()]);
        for (found, x) in found.iter_mut().zip(&x) {
            let along = |j: usize, k: usize| x.iter().map(|(i, w)| w * known[coarse.cell([*i, j, k])]).sum::<f64>();
            *found = z.iter().map(|(k, wz)| y.iter().map(|(j, wy)| wz * wy * along(*j, *k)).sum::<f64>()).sum();
        }
    });
}

/// Water temperatures at equal shares of the channel's length.
fn water(coarse: &Stream, known: &[f64], fine: &Stream, found: &mut [f64]) {
    let (mut end, mut passed, mut at) = (0.0, 0.0, 0);
    for (k, station) in fine.stations.iter().enumerate() {
        end += station.length / fine.length;
        while at + 1 < coarse.stations.len() && passed + coarse.stations[at].length / coarse.length < end {
            passed += coarse.stations[at].length / coarse.length;
            at += 1;
        }
        found[fine.first_node as usize + k] = known[coarse.first_node as usize + at];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::error::Result;
    use coldplate_describe::machine::Machine;

    /// Machines with links, films, radiation and water: the start is near the solution everywhere, and leads to the solution found from
    /// a guess.
    #[test]
    fn a_coarse_solution_is_near_the_fine_one() -> Result<()> {
        for name in ["five_axis", "spindle", "rig"] {
            let file = format!("{}/../../machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
            let model = MeshedMachine::new(Machine::read(std::path::Path::new(&file), &[])?, Some(WORTH + WORTH / 5))?;
            let given = [
                ("coolant_flow", "6 L/min"),
                ("coolant_temperature", "20 degC"),
                ("motor_speed", "1000 rpm"),
                ("ambient_temperature", "22 degC"),
            ];
            let condition = model.machine.condition(&given)?;
            let start = model.start(&condition).expect("the coarse mesh is solved");
            let exact = model.steady(&condition)?.solution.temperatures;
            let apart = start.iter().zip(&exact).map(|(a, b)| (a - b).abs());
            let (sum, worst) = apart.fold((0.0, 0.0), |(sum, worst): (f64, f64), d| (sum + d, worst.max(d)));
            let (low, high) = exact.iter().fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), t| (l.min(*t), h.max(*t)));
            println!(
                "{name}: {} nodes, {:.3} K off on average, {worst:.1} K at most, of {:.1} K",
                exact.len(),
                sum / exact.len() as f64,
                high - low
            );
            assert!(
                sum / (exact.len() as f64) < 0.05 * (high - low) && worst < 0.7 * (high - low),
                "{name}: {sum} {worst} of {}",
                high - low
            );
            let load = coldplate_network::Load::at(&model.machine, &condition)?;
            let guessed = crate::Solver::new(&model.network, &load)?.steady(&load)?.temperatures;
            let off = guessed.iter().zip(&exact).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(off < 1e-6, "{name}: {off} K");
        }
        Ok(())
    }
}
