//! Nodes that store no heat, brought into balance at an instant while all nodes that store heat stand still.

use super::super::csr::norm;
use super::stage::{Preconditioner, still};
use super::{Transient, TransientState};
use coldplate_base::error::{Error, Result, Stop};
use coldplate_network::Load;

/// Rate, 1/s, that is multiplied by the capacity (J/K) on the diagonal: it keeps nodes that store heat in place while the others are
/// solved for. Chosen: firmness against rounding.
const STIFFNESS: f64 = 1e6;
/// Relative residual that a linear solve is taken to, dimensionless. Chosen: iterations against Newton steps.
const LINEAR_TOLERANCE: f64 = 1e-6;
/// A step that leaves more than this share of the residual has met rounding, if it was small; dimensionless. Chosen.
const SPENT: f64 = 0.3;
/// Largest share of an absolute temperature that a small step moves, dimensionless. Chosen: far above rounding, and far below a step
/// that Newton's method takes from elsewhere (T⁴ from above leaves (3/4)⁴ of the residual at every step).
const SMALL: f64 = 1e-6;
/// Most Newton steps, a count. Chosen: time against instants that are refused; each takes a node to twice its temperature at most, or
/// to half.
const MOST_NEWTON: usize = 50;

impl Transient<'_> {
    /// Brings held nodes to their temperatures at the beginning of the load, and arithmetic nodes into balance.
    ///
    /// # Errors
    /// They find no balance.
    pub fn settle(&mut self, state: &mut TransientState, load: &Load) -> Result<()> {
        let network = self.network;
        network.hold(load, &mut state.temperatures);
        let is_held = |i: u32| network.fixed.iter().any(|(node, _)| *node == i);
        let free: Vec<usize> = (0..network.solids).filter(|i| network.capacity[*i] == 0.0 && !is_held(*i as u32)).collect();
        if free.is_empty() {
            return Ok(());
        }
        let streams = network.stream_states(load, &state.temperatures)?;
        let still = still(&streams);
        let mut preconditioner = match self.preconditioner.take() {
            Some(known) => known,
            None => Preconditioner::new(network, &self.system, load, &state.temperatures)?,
        };
        preconditioner.set(STIFFNESS)?;
        let (mut right, mut step) = (vec![0.0; network.nodes], vec![0.0; network.nodes]);
        let mut best = (f64::INFINITY, Vec::new());
        // Largest share of a temperature that the last step moved.
        let mut moved = f64::INFINITY;
        for _ in 0..MOST_NEWTON {
            let residual = self.system.residual(network, load, &[], &state.temperatures);
            free.iter().for_each(|i| right[*i] = -residual[*i]);
            let left = norm(&right);
            if !left.is_finite() {
                return Err(Error::stopped(Stop::NotFinite, format!("surfaces that store no heat find no balance at {:.6} s", state.time)));
            }
            let is_spent = moved <= SMALL && left > SPENT * best.0;
            if left < best.0 {
                best = (left, free.iter().map(|i| state.temperatures[*i]).collect());
            }
            if is_spent || left == 0.0 {
                free.iter().zip(&best.1).for_each(|(i, t)| state.temperatures[*i] = *t);
                self.preconditioner = Some(preconditioner);
                return Ok(());
            }
            let mut jacobian = self.system.jacobian(network, load, &still, &state.temperatures);
            jacobian.add_diagonal(network.capacity.iter().map(|c| STIFFNESS * c));
            preconditioner.solve(&jacobian, &right, &mut step, LINEAR_TOLERANCE);
            moved = 0.0;
            for i in &free {
                let taken = step[*i].clamp(-0.5 * state.temperatures[*i], state.temperatures[*i]);
                moved = moved.max(taken.abs() / state.temperatures[*i]);
                state.temperatures[*i] += taken;
            }
        }
        Err(Error::stopped(Stop::MostNewtonSteps, format!("surfaces that store no heat find no balance at {:.6} s", state.time)))
    }
}
