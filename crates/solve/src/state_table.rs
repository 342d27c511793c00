//! Steady states near known ones, to an error that is asked for, of machines that are solved again and again with small changes.

use rayon::prelude::*;

use super::anchors::Anchors;
use super::multigrid::Workspace;
use super::newton::largest;
use super::steady::{Solver, SteadySettings};
use coldplate_base::error::Result;
use coldplate_base::progress::Silent;
use coldplate_network::{Load, Network, StreamState};

/// Relative residual that each linear solve is taken to, dimensionless. Chosen: iterations against Newton steps.
const LINEAR_TOLERANCE: f64 = 1e-4;
/// Most Newton steps, a count: after more the state is not near. Chosen.
const MOST_STEPS: usize = 6;
/// Largest Newton step, K: beyond it the state is not near. Chosen.
const LARGEST_STEP: f64 = 50.0;
/// Safety factor on the error that one cycle finds from a residual, dimensionless: a cycle made at other films finds a part of the
/// error. Chosen (docs/method/reduced.md).
const SURE: f64 = 5.0;
/// Relative residuals that a linear solve of a table is taken to, dimensionless: the tightest, which single precision gives, and the
/// loosest. Chosen: iterations against Newton steps.
const REDUCED: (f64, f64) = (1e-5, 1e-2);
/// States of a table that are found first, evenly over it, then as many more, beside which the others are found; a count. Chosen: full
/// solves against the size of the space.
const FIRST: usize = 4;
/// A difference smaller than this many times the error asked for is no direction: its start was good. Dimensionless, chosen.
const LEAST_APART: f64 = 20.0;

/// A network whose states resemble known ones.
#[derive(Debug, Clone)]
pub struct Nearby<'a> {
    solver: Solver<'a>,
    /// Empty set of states, with which every table begins.
    none: Anchors,
}

impl<'a> Nearby<'a> {
    /// Sets up pattern and multigrid hierarchy at a condition and the temperatures of all nodes (K) that resemble its state.
    ///
    /// # Errors
    /// Heat has no way out of some part, or water leaves its property range.
    pub fn new(network: &'a Network, load: &Load, start: Vec<f64>) -> Result<Self> {
        Ok(Self::of(Solver::unsolved(network, load, start, &Silent)?))
    }

    /// A network whose solver is set up.
    pub fn of(solver: Solver<'a>) -> Self {
        let Solver { network, system, reference: (load, at), .. } = &solver;
        let none = Anchors::new(&system.jacobian(network, load, &at.streams, &at.temperatures));
        Self { solver, none }
    }

    /// States at several conditions, each to about `within` kelvin at every node, beginning with temperatures that resemble them.
    ///
    /// A few conditions, spread over the table, are solved first. Their differences from their starts span a small space. Every other
    /// state begins with the combination in this space that leaves the smallest residual of the true network. One cycle of the
    /// preconditioner turns the remaining residual into an error; an iteration follows only if this error is larger than `within`. The
    /// results depend on the order of the conditions, not on the number of threads.
    ///
    /// # Errors
    /// Errors of [`Solver::steady`].
    pub fn table(&self, loads: &[Load], starts: &[&[f64]], within: f64) -> Result<Vec<Vec<f64>>> {
        let n = loads.len();
        let spread: Vec<usize> = (0..n).step_by(n.div_ceil(FIRST).max(1)).collect();
        let rest: Vec<usize> = (0..n).filter(|c| !spread.contains(c)).collect();
        let (second, rest) = rest.split_at(rest.len().min(FIRST));
        let mut known = self.none.empty();
        let mut found = vec![Vec::new(); n];
        for wave in [spread.as_slice(), second, rest] {
            let solved: Vec<Vec<f64>> =
                wave.par_iter().map(|c| self.beside(&known, &loads[*c], starts[*c], within)).collect::<Result<_>>()?;
            for (c, state) in wave.iter().zip(solved) {
                if known.len() < 2 * FIRST && farthest(&state, starts[*c]) > LEAST_APART * within {
                    known.add(starts[*c], &state);
                }
                found[*c] = state;
            }
        }
        Ok(found)
    }

    /// One state of a table.
    fn beside(&self, known: &Anchors, load: &Load, start: &[f64], within: f64) -> Result<Vec<f64>> {
        let Solver { network, system, settings: SteadySettings { bend, .. }, .. } = &self.solver;
        let mut work = self.solver.work_space();
        let mut state = start.to_vec();
        network.hold(load, &mut state);
        let mut here = self.open(load, &state)?;
        let mut matrix = system.jacobian(network, load, &here.streams, &state);
        // How far the state has moved since the matrix was made, K.
        let mut since = 0.0;
        if !known.is_empty() {
            let before = state.clone();
            known.seen_by(&matrix).improve(&here.residual, &mut state);
            network.hold(load, &mut state);
            since = farthest(&before, &state);
            here = self.open(load, &state)?;
        }
        let mut step = vec![0.0; network.nodes];
        for _ in 0..MOST_STEPS {
            let right: Vec<f64> = here.residual.iter().map(|r| -r).collect();
            let error = self.error(&here.streams, &right, &mut step, &mut work.cycle);
            if SURE * error <= within {
                network.check_coolant(load, &state)?;
                return Ok(state);
            }
            if !error.is_finite() || error > LARGEST_STEP || since > LARGEST_STEP {
                break;
            }
            if SURE * bend * since * error > within {
                (matrix, since) = (system.jacobian(network, load, &here.streams, &state), 0.0);
            }
            let aim = (0.5 * within / (SURE * error)).max(0.1 * bend * error).clamp(REDUCED.0, REDUCED.1);
            let outcome = self.solver.linear(&matrix, &here.streams, &right, &mut step, aim, &mut work);
            let moved = largest(&step);
            if outcome.is_useless() || !moved.is_finite() || moved > LARGEST_STEP {
                break;
            }
            state.iter_mut().zip(&step).for_each(|(t, s)| *t += s);
            since += moved;
            here = self.open(load, &state)?;
        }
        // Not near, or hard to find: solved by the full method.
        Ok(self.solver.steady_from(load, start, f64::INFINITY)?.temperatures)
    }

    /// Streams and residual (W) at temperatures (K).
    fn open(&self, load: &Load, temperatures: &[f64]) -> Result<Open> {
        let Solver { network, system, .. } = &self.solver;
        let streams = network.stream_states(load, temperatures)?;
        let residual = system.residual(network, load, &streams, temperatures);
        Ok(Open { streams, residual })
    }

    /// Estimate of the largest error of any temperature, K, by one cycle on the residual `open` (W).
    fn error(&self, streams: &[StreamState], open: &[f64], found: &mut [f64], work: &mut Workspace) -> f64 {
        self.solver.precondition(streams, open, found, work);
        found.iter().fold(0.0, |m: f64, e| if e.is_finite() { m.max(e.abs()) } else { f64::INFINITY })
    }

    /// Temperatures of all nodes, K, to about `within` kelvin, by Newton's method from `start`. A step of s kelvin leaves an error of
    /// at most s (2e-3 + 0.01 s), from its linear solve and from the bend of radiation, films and properties. No heat balance is
    /// struck.
    ///
    /// # Errors
    /// Errors of [`Solver::steady`].
    pub fn temperatures(&self, load: &Load, start: &[f64], within: f64) -> Result<Vec<f64>> {
        let Solver { network, system, settings, .. } = &self.solver;
        let mut temperatures = start.to_vec();
        network.hold(load, &mut temperatures);
        let mut work = self.solver.work_space();
        let mut step = vec![0.0; network.nodes];
        for _ in 0..MOST_STEPS {
            let streams = network.stream_states(load, &temperatures)?;
            let right: Vec<f64> = system.residual(network, load, &streams, &temperatures).iter().map(|r| -r).collect();
            let matrix = system.jacobian(network, load, &streams, &temperatures);
            let outcome = self.solver.linear(&matrix, &streams, &right, &mut step, LINEAR_TOLERANCE, &mut work);
            let moved = largest(&step);
            if outcome.is_useless() || !moved.is_finite() || moved > LARGEST_STEP {
                break;
            }
            temperatures.iter_mut().zip(&step).for_each(|(t, s)| *t += s);
            if settings.left_after(moved, LINEAR_TOLERANCE) <= within {
                network.check_coolant(load, &temperatures)?;
                return Ok(temperatures);
            }
        }
        // Not near, or hard to find: solved by the full method.
        Ok(self.solver.steady_from(load, start, f64::INFINITY)?.temperatures)
    }
}

/// Streams and residual (W) at some temperatures.
struct Open {
    streams: Vec<StreamState>,
    residual: Vec<f64>,
}

/// Largest difference of two states, K.
fn farthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meshed::MeshedMachine;
    use coldplate_base::document::Document;
    use coldplate_describe::machine::Machine;

    /// From the state at another ambient temperature, to the error asked for.
    #[test]
    fn a_state_nearby_is_as_exact_as_asked() -> Result<()> {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../machines/rig.toml");
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
