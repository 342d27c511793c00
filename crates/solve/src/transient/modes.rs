//! Linear networks of few nodes, exactly over any time.
//!
//! If conductances, capacities and sources do not follow temperature, nothing radiates and no water flows, C dT/dt = -K T + q(t) with a
//! symmetric K. In the eigenvectors of C^-½ K C^-½ every mode decays by itself. With heats and given temperatures that run straight in
//! time its course is elementary (the phi functions of exponential integrators: Hochbruck & Ostermann, Acta Numerica 19 (2010) 209). A
//! stretch of a log with such loads is one step without error, whatever its length.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::TransientState;
use coldplate_network::{ContactFactors, Load, Network};

/// Largest distance of a load from a straight line in the middle of a stretch, as a share of the load. Chosen above rounding.
const STRAIGHT: f64 = 1e-9;
/// Argument below which the phi functions are taken from their series, dimensionless. Chosen: cancellation against terms of the series.
const SERIES: f64 = 1e-2;

/// The modes of a linear network, with the contact factors that they hold for.
#[derive(Debug)]
pub(super) struct Modes {
    contacts: ContactFactors,
    /// Nodes that store heat, and the root of the capacity of each, (J/K)^½.
    nodes: Vec<usize>,
    roots: DVector<f64>,
    /// Conductances to nodes of given temperature.
    links: Vec<Link>,
    /// Rates of the modes, 1/s, and their vectors.
    rates: DVector<f64>,
    vectors: DMatrix<f64>,
    /// Length of the last step, s, and the weights of each mode for it.
    known: (f64, Vec<Weights>),
}

/// A conductance (W/K) between a storing node, by its place among these, and an entry of [`Load::fixed`].
#[derive(Debug, Clone, Copy)]
struct Link {
    storing: usize,
    fixed: usize,
    conductance: f64,
}

/// Share of a mode that is left after a step, and the phi functions of its rate times the step's length.
#[derive(Debug, Clone, Copy)]
struct Weights {
    left: f64,
    phi: [f64; 3],
}

impl Weights {
    fn of(z: f64) -> Self {
        let left = (-z).exp();
        let phi = if z < SERIES {
            // Sums of (-z)^k / (k + m)!.
            let series = |m: i32| (0..8).rev().fold(0.0, |sum, k| 1.0 - z / f64::from(k + m + 1) * sum);
            [series(1), series(2) / 2.0, series(3) / 6.0]
        } else {
            let first = -(-z).exp_m1() / z;
            let second = (1.0 - first) / z;
            [first, second, (0.5 - second) / z]
        };
        Self { left, phi }
    }
}

impl Modes {
    /// Modes of a network at a load; `None` if the network is not linear.
    pub fn of(network: &Network, load: &Load) -> Option<Self> {
        let is_constant = |node: &usize| network.relative_capacity.get(network.group[*node] as usize).is_none_or(|c| c.is_constant());
        let mut fixed = vec![None; network.nodes];
        network.fixed.iter().for_each(|(node, index)| fixed[*node as usize] = Some(*index as usize));
        let nodes: Vec<usize> = (0..network.nodes).filter(|n| fixed[*n].is_none()).collect();
        let is_linear = network.is_linear_conduction()
            && network.radiative.is_empty()
            && network.surfaces.is_empty()
            && network.sources.iter().all(|s| !s.law.follows_temperature())
            && nodes.iter().all(|n| network.capacity[*n] > 0.0 && is_constant(n));
        if !is_linear {
            return None;
        }
        let mut place = vec![None; network.nodes];
        nodes.iter().enumerate().for_each(|(i, node)| place[*node] = Some(i));
        let roots = DVector::from_iterator(nodes.len(), nodes.iter().map(|n| network.capacity[*n].sqrt()));
        let mut matrix = DMatrix::<f64>::zeros(nodes.len(), nodes.len());
        let mut links = Vec::new();
        for joint in &network.joints {
            let (a, b) = (joint.a as usize, joint.b as usize);
            let conductance = network.joint_state(joint, 300.0, 300.0, &load.contacts).conductance;
            for (own, other) in [(a, b), (b, a)] {
                let Some(i) = place[own] else { continue };
                matrix[(i, i)] += conductance / (roots[i] * roots[i]);
                match (place[other], fixed[other]) {
                    (Some(j), _) => matrix[(i, j)] -= conductance / (roots[i] * roots[j]),
                    (None, Some(fixed)) => links.push(Link { storing: i, fixed, conductance }),
                    (None, None) => {}
                }
            }
        }
        let SymmetricEigen { eigenvectors: vectors, eigenvalues: rates } = SymmetricEigen::new(matrix);
        let is_sound = rates.iter().all(|r| r.is_finite());
        is_sound.then(|| Self { contacts: load.contacts.clone(), nodes, roots, links, rates, vectors, known: (0.0, Vec::new()) })
    }

    /// Whether the modes hold under a load.
    pub fn hold(&self, load: &Load) -> bool {
        self.contacts == load.contacts
    }

    /// Whether heats and given temperatures run straight between two loads, from the load half way.
    pub(crate) fn is_straight(begin: &Load, middle: &Load, end: &Load) -> bool {
        let straight = |a: &[f64], m: &[f64], b: &[f64]| {
            a.iter().zip(m).zip(b).all(|((a, m), b)| (0.5 * (a + b) - m).abs() <= STRAIGHT * (a.abs() + b.abs()))
        };
        begin.contacts == middle.contacts
            && middle.contacts == end.contacts
            && straight(&begin.powers, &middle.powers, &end.powers)
            && straight(&begin.fixed, &middle.fixed, &end.fixed)
    }

    /// Takes a state on by `h` (s) while the load runs straight between two.
    pub fn step(&mut self, network: &Network, state: &mut TransientState, h: f64, begin: &Load, end: &Load) {
        if self.known.0 != h {
            self.known = (h, self.rates.iter().map(|rate| Weights::of((rate * h).max(0.0))).collect());
        }
        let before = DVector::from_iterator(self.nodes.len(), self.nodes.iter().map(|n| state.temperatures[*n]));
        let (first, last) = (self.drive(network, begin), self.drive(network, end));
        let mode = self.vectors.tr_mul(&before.component_mul(&self.roots));
        let (mut after, mut integral) = (mode.clone(), mode.clone());
        for (m, Weights { left, phi }) in self.known.1.iter().enumerate() {
            let (drive, change) = (first[m], last[m] - first[m]);
            after[m] = left * mode[m] + h * (phi[0] * drive + phi[1] * change);
            integral[m] = h * (phi[0] * mode[m] + h * (phi[1] * drive + phi[2] * change));
        }
        let after = (&self.vectors * after).component_div(&self.roots);
        let integral = (&self.vectors * integral).component_div(&self.roots);
        let mut pass = |heat: f64| state.energy.add(heat.max(0.0), (-heat).max(0.0));
        begin.powers.iter().zip(&end.powers).for_each(|(a, b)| pass(0.5 * h * (a + b)));
        for Link { storing, fixed, conductance } in &self.links {
            pass(conductance * (0.5 * h * (begin.fixed[*fixed] + end.fixed[*fixed]) - integral[*storing]));
        }
        for (i, node) in self.nodes.iter().enumerate() {
            state.energy.store(network.capacity[*node] * (after[i] - before[i]), network.capacity[*node] * after[i]);
            state.temperatures[*node] = after[i];
        }
        network.hold(end, &mut state.temperatures);
    }

    /// Drive of each mode, K (J/K)^½ per second.
    fn drive(&self, network: &Network, load: &Load) -> DVector<f64> {
        let mut heats = vec![0.0; network.nodes];
        for (source, power) in network.sources.iter().zip(&load.powers) {
            source.shares.iter().for_each(|(node, share)| heats[*node as usize] += power * share);
        }
        let mut of_node = DVector::from_iterator(self.nodes.len(), self.nodes.iter().map(|n| heats[*n]));
        self.links.iter().for_each(|link| of_node[link.storing] += link.conductance * load.fixed[link.fixed]);
        self.vectors.tr_mul(&of_node.component_div(&self.roots))
    }
}

#[cfg(test)]
mod tests {
    use super::{SERIES, Weights};

    /// The series and the closed forms meet.
    #[test]
    fn phi_functions() {
        let (below, above) = (Weights::of(SERIES * (1.0 - 1e-9)), Weights::of(SERIES * (1.0 + 1e-9)));
        for (a, b) in below.phi.iter().zip(&above.phi) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        assert_eq!(Weights::of(0.0).phi, [1.0, 0.5, 1.0 / 6.0]);
    }
}
