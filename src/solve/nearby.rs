//! Steady states near known ones, to an error that is asked for: of machines that are solved again and again with small changes.

use super::krylov::Scratch;
use super::steady::{Solver, hold};
use crate::discretise::network::{Load, Network};
use crate::error::Result;
use crate::foundation::progress::Silent;

/// Reduction of the residual asked of each linear solve, and the factor by which a weakly connected part may lag behind it.
const LINEAR_TOLERANCE: f64 = 1e-4;
const LAG: f64 = 20.0;
/// Share by which a step of one kelvin bends the heat flows, 1/K.
const BEND: f64 = 0.01;
/// Newton steps, and the largest of them, K: beyond, the state is not near.
const MOST_STEPS: usize = 6;
const LARGEST_STEP: f64 = 50.0;

/// A network whose states resemble known ones.
#[derive(Debug, Clone)]
pub struct Nearby<'a> {
    solver: Solver<'a>,
}

impl<'a> Nearby<'a> {
    /// Sets up pattern and multigrid hierarchy at a condition and the temperatures of all nodes (K) that resemble its state.
    ///
    /// # Errors
    /// Heat has no way out of some part, or water leaves its property range.
    pub fn new(network: &'a Network, load: &Load, start: Vec<f64>) -> Result<Self> {
        Ok(Self { solver: Solver::unsolved(network, load, start, &Silent)? })
    }

    /// Temperatures of all nodes, K, to about `within` kelvin, by Newton's method from `start`. A step of s leaves no more than what
    /// its linear solve and the bend of radiation, films and properties leave: 2e-3 s and 0.01 s²/K. No heat balance is struck.
    ///
    /// # Errors
    /// As [`Solver::steady`].
    pub fn temperatures(&self, load: &Load, start: &[f64], within: f64) -> Result<Vec<f64>> {
        let Solver { network, system, multigrid, .. } = &self.solver;
        let mut temperatures = start.to_vec();
        hold(network, load, &mut temperatures);
        let mut work = (multigrid.workspace(), Scratch::default());
        let mut step = vec![0.0; network.nodes];
        for _ in 0..MOST_STEPS {
            let streams = network.stream_states(load, &temperatures)?;
            let right: Vec<f64> = system.residual(network, load, &streams, &temperatures).iter().map(|r| -r).collect();
            let matrix = system.jacobian(network, load, &streams, &temperatures);
            let outcome = self.solver.linear(&matrix, &streams, &right, &mut step, LINEAR_TOLERANCE, &mut work);
            let moved = step.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
            if outcome.is_useless() || !moved.is_finite() || moved > LARGEST_STEP {
                break;
            }
            temperatures.iter_mut().zip(&step).for_each(|(t, s)| *t += s);
            if moved * (LAG * LINEAR_TOLERANCE + BEND * moved) <= within {
                network.check_coolant(load, &temperatures)?;
                return Ok(temperatures);
            }
        }
        // It is not near, or hard to find: by the full method.
        Ok(self.solver.steady_from(load, start)?.temperatures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::machine::Machine;
    use crate::foundation::document::Document;
    use crate::solve::meshed::MeshedMachine;

    /// From the state at another ambient temperature, to the error asked for.
    #[test]
    fn a_state_nearby_is_as_exact_as_asked() -> Result<()> {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/machines/rig.toml");
        let model = MeshedMachine::new(Machine::from_document(&Document::read(file)?)?, Some(800))?;
        let condition = model.machine.condition(&[])?;
        let load = Load::at(&model.machine, &condition)?;
        let solver = Solver::new(&model.network, &load)?;
        let start = solver.steady(&load)?.temperatures;
        for warmer in [0.02, 0.5, 5.0] {
            let mut other = load.clone();
            other.inlets.iter_mut().for_each(|t| *t += warmer);
            let exact = solver.steady(&other)?.temperatures;
            let nearby = Nearby::new(&model.network, &other, start.clone())?;
            for within in [1e-3, 1e-5] {
                let found = nearby.temperatures(&other, &start, within)?;
                let error = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < within, "{warmer} K warmer, within {within} K: {error}");
            }
        }
        Ok(())
    }
}
