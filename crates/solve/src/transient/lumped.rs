//! Stages of a network of few nodes, without blocks and water, with one dense solve for each Newton step.

use nalgebra::{DMatrix, DVector};

use super::super::newton::{self, HeatBalances};
use super::TransientState;
use super::stage::{ImplicitStage, MOST_NEWTON, unsolved};
use coldplate_base::error::{Error, Result, Stop};
use coldplate_network::{ContactFactors, JointState, Load, Network};
use coldplate_physics::radiation::SIGMA;

/// Share of the heat passing through that a stage may leave open, dimensionless: Newton's method converges far below it. Chosen.
const BALANCE: f64 = 1e-10;
/// Nodes up to which a dense matrix is faster than a hierarchy, a count. Chosen.
const MOST_NODES: usize = 40;

/// Work space for the stages of such a network.
#[derive(Debug)]
pub(super) struct LumpedSolver {
    /// Heat leaving each node, W, and its derivatives, W/K.
    heat: DVector<f64>,
    slopes: DMatrix<f64>,
    /// Enthalpy of each storing node without the flow at the end, J.
    target: Vec<f64>,
    /// States of the joints if no conductance follows temperature, with the contact factors that they hold for.
    joints: Option<(ContactFactors, Vec<JointState>)>,
}

/// Heat that passes through a network, and the rounding error of its balance, W.
#[derive(Clone, Copy, Default)]
struct Passing {
    through: f64,
    rounding: f64,
}

impl LumpedSolver {
    /// Work space for a network; `None` if it is not of this kind.
    pub fn of(network: &Network) -> Option<Self> {
        let n = network.nodes;
        let is_small = n <= MOST_NODES && network.blocks.is_empty() && network.streams.is_empty() && network.reaches.is_empty();
        is_small.then(|| Self { heat: DVector::zeros(n), slopes: DMatrix::zeros(n, n), target: vec![0.0; n], joints: None })
    }

    /// Solves a stage of a step from `state`, from a first guess (K) with held nodes at their temperatures.
    pub fn solve(&mut self, network: &Network, stage: &ImplicitStage<'_>, state: &TransientState, mut guess: Vec<f64>) -> Result<Vec<f64>> {
        let begin = &state.temperatures;
        for (node, target) in self.target.iter_mut().enumerate() {
            *target = network.enthalpy(node, begin[node]) + stage.earlier.iter().map(|(weight, flow)| weight * flow[node]).sum::<f64>();
        }
        let (rate, passing) = (1.0 / stage.own, Passing::default());
        let mut balances = LumpedBalances { lumped: self, network, load: stage.load, time: state.time, rate, passing, last: f64::INFINITY };
        newton::solve(&mut balances, &mut guess, MOST_NEWTON)?;
        Ok(guess)
    }

    /// Heat into each node at these temperatures (K), W.
    pub fn flow(&mut self, network: &Network, load: &Load, temperatures: &[f64]) -> Vec<f64> {
        self.assemble(network, load, temperatures);
        network.fixed.iter().for_each(|(node, _)| self.heat[*node as usize] = 0.0);
        self.heat.iter().map(|heat| -heat).collect()
    }

    /// Heat that leaves each node, held ones too, with its derivatives.
    fn assemble(&mut self, network: &Network, load: &Load, t: &[f64]) -> Passing {
        self.heat.fill(0.0);
        self.slopes.fill(0.0);
        if network.is_linear_conduction() && self.joints.as_ref().is_none_or(|(of, _)| *of != load.contacts) {
            let state = |joint| network.joint_state(joint, t[0], t[0], &load.contacts);
            self.joints = Some((load.contacts.clone(), network.joints.iter().map(state).collect()));
        }
        let Self { heat: heats, slopes, joints, .. } = self;
        let mut pair = |a: u32, b: u32, heat: f64, along_a: f64, along_b: f64| {
            let (a, b) = (a as usize, b as usize);
            heats[a] += heat;
            heats[b] -= heat;
            slopes[(a, a)] += along_a;
            slopes[(b, a)] -= along_a;
            slopes[(a, b)] -= along_b;
            slopes[(b, b)] += along_b;
        };
        let hottest = t.iter().fold(0.0, |m: f64, t| m.max(*t));
        let mut conductances = 0.0;
        for (j, joint) in network.joints.iter().enumerate() {
            let (ta, tb) = (t[joint.a as usize], t[joint.b as usize]);
            let known = joints.as_ref().map(|(_, states)| states[j]);
            let state = known.unwrap_or_else(|| network.joint_state(joint, ta, tb, &load.contacts));
            let drop = ta - tb;
            conductances += state.conductance.abs();
            pair(joint.a, joint.b, state.conductance * drop, state.along_a, state.along_b);
        }
        for (a, b, area) in &network.radiative {
            let (ta, tb) = (t[*a as usize], t[*b as usize]);
            let slope = |t: f64| 4.0 * SIGMA * area * t.powi(3);
            conductances += slope(hottest);
            pair(*a, *b, SIGMA * area * (ta.powi(4) - tb.powi(4)), slope(ta), slope(tb));
        }
        let (mut entered, mut left) = (0.0, 0.0);
        let mut passes = |heat: f64| if heat >= 0.0 { entered += heat } else { left -= heat };
        for surface in &network.surfaces {
            let node = surface.node as usize;
            let state = surface.state(t[node], &network.properties, load);
            heats[node] += state.heat;
            slopes[(node, node)] += state.slope;
            conductances += state.slope;
            passes(-state.heat);
        }
        for (source, power) in network.sources.iter().zip(&load.powers) {
            for ((node, heat), (_, slope)) in source.heats(*power, t).zip(source.slopes(*power, t)) {
                heats[node as usize] -= heat;
                slopes[(node as usize, node as usize)] -= slope;
                passes(heat);
            }
        }
        network.fixed.iter().for_each(|(node, _)| passes(heats[*node as usize]));
        // Each conductance stands in the balances of two nodes.
        Passing { through: entered.max(left), rounding: 2.0 * f64::EPSILON * hottest * conductances }
    }
}

/// Heat balances of a stage on the way to its end.
struct LumpedBalances<'b> {
    lumped: &'b mut LumpedSolver,
    network: &'b Network,
    load: &'b Load,
    /// Time at the beginning of the step, s.
    time: f64,
    /// Heat per kelvin of warming at the end over the capacity, 1/s.
    rate: f64,
    /// Heat that passes at the temperatures assessed last.
    passing: Passing,
    /// Imbalance before the last step, W.
    last: f64,
}

impl HeatBalances for LumpedBalances<'_> {
    fn assess(&mut self, temperatures: &[f64]) -> Result<f64> {
        let Self { lumped, network, rate, .. } = self;
        self.passing = lumped.assemble(network, self.load, temperatures);
        let mut magnitude = 0.0;
        for (i, t) in temperatures.iter().enumerate().filter(|(i, _)| network.capacity[*i] > 0.0) {
            lumped.heat[i] += *rate * (network.enthalpy(i, *t) - lumped.target[i]);
            lumped.slopes[(i, i)] += *rate * network.capacity_at(i, *t);
            // A temperature is known to its last place, and so is the heat stored at it.
            magnitude += network.capacity[i] * t;
        }
        self.passing.rounding += 4.0 * f64::EPSILON * *rate * magnitude;
        for (node, _) in &network.fixed {
            let node = *node as usize;
            lumped.heat[node] = 0.0;
            lumped.slopes.row_mut(node).fill(0.0);
            lumped.slopes.column_mut(node).fill(0.0);
            lumped.slopes[(node, node)] = 1.0;
        }
        Ok(lumped.heat.iter().map(|r| r.abs()).sum())
    }

    fn are_closed(&mut self, _: &[f64], imbalance: f64) -> Result<bool> {
        let Passing { through, rounding } = self.passing;
        // Rounding is a bound that is seldom reached: as long as a step still helps, another is taken.
        let is_spent = imbalance <= rounding && imbalance > 0.3 * self.last;
        self.last = imbalance;
        Ok(imbalance <= BALANCE * through || is_spent)
    }

    fn find_step(&mut self, _: &[f64], _: f64, step: &mut [f64]) -> Result<()> {
        let LumpedSolver { slopes, heat, .. } = self.lumped;
        if !eliminate(slopes, heat) {
            return Err(Error::stopped(Stop::LinearSolver, format!("the linear solver stopped {}: a singular matrix", self.when())));
        }
        step.iter_mut().zip(heat.iter()).for_each(|(step, heat)| *step = -heat);
        Ok(())
    }

    fn when(&self) -> String {
        format!("at {:.6} s", self.time)
    }

    fn unsolved(&self, imbalance: f64) -> Error {
        unsolved(self.time, imbalance, self.passing.through)
    }
}

/// Solves a dense system in place, by elimination with the largest pivot of each column; the matrix is spent. `false` where it is
/// singular.
fn eliminate(matrix: &mut DMatrix<f64>, right: &mut DVector<f64>) -> bool {
    let n = right.len();
    // Column by column, as the matrix lies in memory.
    let m = matrix.as_mut_slice();
    for k in 0..n {
        let pivot = (k..n).fold(k, |best, i| if m[i + k * n].abs() > m[best + k * n].abs() { i } else { best });
        let value = m[pivot + k * n];
        if value == 0.0 || !value.is_finite() {
            return false;
        }
        if pivot != k {
            (k..n).for_each(|j| m.swap(k + j * n, pivot + j * n));
            right.swap_rows(k, pivot);
        }
        let (done, rest) = m.split_at_mut((k + 1) * n);
        let factors = &mut done[k * n + k + 1..];
        factors.iter_mut().for_each(|f| *f /= value);
        for column in rest.chunks_exact_mut(n) {
            let above = column[k];
            if above != 0.0 {
                column[k + 1..].iter_mut().zip(&*factors).for_each(|(c, f)| *c -= f * above);
            }
        }
        let above = right[k];
        right.as_mut_slice()[k + 1..].iter_mut().zip(&*factors).for_each(|(r, f)| *r -= f * above);
    }
    for k in (0..n).rev() {
        let x = right[k] / m[k + k * n];
        right[k] = x;
        right.as_mut_slice()[..k].iter_mut().zip(&m[k * n..k * n + k]).for_each(|(r, c)| *r -= c * x);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::{DMatrix, DVector, eliminate};

    /// Agrees with the library's own factorisation, with rows that must change places; a singular matrix is reported.
    #[test]
    fn elimination() {
        let matrix = DMatrix::from_fn(7, 7, |i, j| if i == j { 0.0 } else { ((3 * i + 5 * j * j) % 11) as f64 - 4.5 });
        let right = DVector::from_fn(7, |i, _| i as f64 - 2.0);
        let expected = matrix.clone().lu().solve(&right).unwrap();
        let (mut spent, mut found) = (matrix.clone(), right.clone());
        assert!(eliminate(&mut spent, &mut found));
        assert!((&found - &expected).norm() < 1e-12 * expected.norm(), "{found} {expected}");
        assert!(!eliminate(&mut DMatrix::zeros(3, 3), &mut DVector::zeros(3)));
    }
}
