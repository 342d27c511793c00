//! Derivatives with respect to candidates that are no number of the machine file, straight from the network.
//!
//! Each function says how the residual changes, as few (node, W) pairs; with the adjoint fields of all readings at hand a
//! candidate costs one short scalar product per reading, so thousands can be screened.

use std::collections::{BTreeMap, BTreeSet};

use crate::Solution;
use coldplate_base::error::Result;
use coldplate_network::slopes::STENCIL;
use coldplate_network::surface::{Surface, SurfaceState};
use coldplate_network::{BoundaryState, Crossing, Joint, Load, NONE, Network};
use coldplate_physics::radiation::SIGMA;

/// Relative step of a circuit's flow, dimensionless. Chosen: error of the difference against rounding.
const FLOW_STEP: f64 = 1e-3;
/// Step of a circuit's inlet temperature, K. Chosen: error of the difference against rounding.
const INLET_STEP: f64 = 0.05;

/// How the residual, and readings of inlets, change with a candidate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Disturbance {
    /// Residual of nodes, W per unit of the candidate; a node may stand there several times.
    pub rows: Vec<(u32, f64)>,
    /// Inlet temperatures of circuits, K per unit.
    pub inlets: Vec<(usize, f64)>,
    /// Temperature of the surroundings, K per unit: some sensors take part of it on.
    pub surroundings: f64,
}

impl Disturbance {
    /// Derivative of a reading, K per unit of the candidate: from its adjoint field (K/W) and its weights of inlets.
    pub fn on(&self, field: &[f64], inlet: Option<(usize, f64)>) -> f64 {
        let through: f64 = self.rows.iter().map(|(node, r)| field[*node as usize] * r).sum();
        self.direct(inlet) - through
    }

    /// Part of the derivative that goes through no node: the change of the inlet that a sensor reads.
    pub fn direct(&self, inlet: Option<(usize, f64)>) -> f64 {
        self.inlets.iter().map(|(c, d)| inlet.map_or(0.0, |(circuit, w)| if circuit == *c { w * d } else { 0.0 })).sum()
    }

    /// This disturbance per another unit: everything times a factor.
    pub fn times(mut self, factor: f64) -> Self {
        self.rows.iter_mut().for_each(|(_, r)| *r *= factor);
        self.inlets.iter_mut().for_each(|(_, d)| *d *= factor);
        self.surroundings *= factor;
        self
    }

    /// Right-hand side of the forward problem: dR/dp of every node.
    pub fn dense(&self, nodes: usize) -> Vec<f64> {
        let mut all = vec![0.0; nodes];
        self.rows.iter().for_each(|(node, r)| all[*node as usize] += r);
        all
    }
}

/// A solved network that candidates are held against.
#[derive(Debug, Clone)]
pub struct Screen<'a> {
    network: &'a Network,
    load: &'a Load,
    solution: &'a Solution,
    surfaces: Vec<SurfaceState>,
    held: Vec<u32>,
}

impl<'a> Screen<'a> {
    /// For a solution of `network` at `load`.
    pub fn new(network: &'a Network, load: &'a Load, solution: &'a Solution) -> Self {
        let t = &solution.temperatures;
        let surfaces = network.surfaces.iter().map(|s| s.state(t[s.node as usize], &network.properties, load)).collect();
        Self { network, load, solution, surfaces, held: network.fixed.iter().map(|(n, _)| *n).collect() }
    }

    fn t(&self, node: u32) -> f64 {
        self.solution.temperatures[node as usize]
    }

    /// Residual of some nodes, W per unit. Nodes that are held have no balance to disturb.
    pub fn disturbance(&self, rows: impl IntoIterator<Item = (u32, f64)>) -> Disturbance {
        let rows = rows.into_iter().filter(|(node, r)| *r != 0.0 && self.is_free(*node)).collect();
        Disturbance { rows, inlets: Vec::new(), surroundings: 0.0 }
    }

    /// Whether a node's temperature is not held.
    pub fn is_free(&self, node: u32) -> bool {
        !self.held.contains(&node)
    }

    /// Heat put into nodes with given shares; per W.
    pub fn source(&self, shares: &[(u32, f64)]) -> Disturbance {
        self.disturbance(shares.iter().map(|(node, share)| (*node, -share)))
    }

    /// A source of the network; per relative change of its power.
    pub fn power(&self, source: usize) -> Disturbance {
        let heats = self.network.sources[source].heats(self.load.powers[source], &self.solution.temperatures);
        self.disturbance(heats.map(|(node, heat)| (node, -heat)))
    }

    /// The temperature coefficient of a source; per 1/K. `None` where its law has none.
    pub fn temperature_coefficient(&self, source: usize) -> Option<Disturbance> {
        let (own, power) = (&self.network.sources[source], self.load.powers[source]);
        let law = own.law.linear()?;
        let rows = own.shares.iter().map(|(node, share)| (*node, law.per_coefficient(-power * share, self.t(*node))));
        Some(self.disturbance(rows))
    }

    /// A new conductance between two nodes; per W/K.
    pub fn conductor(&self, a: u32, b: u32) -> Disturbance {
        let drop = self.t(a) - self.t(b);
        self.disturbance([(a, drop), (b, -drop)])
    }

    /// A new conductance from a node to a given temperature (K); per W/K.
    pub fn leak(&self, node: u32, to: f64) -> Disturbance {
        self.disturbance([(node, self.t(node) - to)])
    }

    /// The contact conductance of some joints; per relative change (so also per unit of its logarithm).
    pub fn joints(&self, joints: impl IntoIterator<Item = usize>) -> Disturbance {
        self.joints_by(joints, |_| 1.0)
    }

    /// The contact conductance of some joints, with a relative change of `weight` at the mean temperature (K) of each joint's two faces.
    fn joints_by(&self, joints: impl IntoIterator<Item = usize>, weight: impl Fn(f64) -> f64) -> Disturbance {
        self.disturbance(joints.into_iter().flat_map(|i| {
            let joint = &self.network.joints[i];
            let crossing = self.crossing(joint);
            let change = self.heat(joint) * crossing.per_contact * weight(f64::midpoint(crossing.faces[0], crossing.faces[1]));
            [(joint.a, change), (joint.b, -change)]
        }))
    }

    /// The conductance of a contact, both halves of it included; per relative change.
    pub fn contact(&self, name: &str) -> Disturbance {
        self.contact_by(name, |_| 1.0)
    }

    /// The conductance of a contact, both halves of it included, with a relative change of `weight` at the mean temperature (K) of each
    /// joint's two faces.
    pub fn contact_by(&self, name: &str, weight: impl Fn(f64) -> f64) -> Disturbance {
        let contacts = &self.network.contacts;
        let of = contacts.iter().find(|g| g.name == name).and_then(|g| g.of);
        let is_own = |c: u32| contacts.get(c as usize).is_some_and(|g| if of.is_some() { g.of == of } else { g.name == name });
        // Joints along faces of imported meshes stand outside the group's own range.
        let joints = self.network.joints.iter().enumerate().filter(|(_, joint)| is_own(joint.contact));
        self.joints_by(joints.map(|(i, _)| i), weight)
    }

    /// A joint in this solution.
    fn crossing(&self, joint: &Joint) -> Crossing {
        let (ta, tb) = self.network.joint_ends(joint, &self.solution.temperatures);
        self.network.crossing(joint, ta, tb, &self.load.contacts)
    }

    /// Heat (W) of a joint.
    fn heat(&self, joint: &Joint) -> f64 {
        self.network.joint_heat(joint, &self.solution.temperatures, &self.load.contacts)
    }

    /// The conductivity of a group (part), film and contacts aside; per relative change.
    pub fn conductivity(&self, group: u32) -> Disturbance {
        let net = self.network;
        let within = |node: u32| net.group[node as usize] == group;
        let mut rows = Vec::new();
        // The heat in a block is in proportion to its conductivity: the residual of the blocks alone is the derivative.
        let blocks: Vec<_> = net.blocks.iter().filter(|b| within(b.first as u32)).cloned().collect();
        let alone = Network { blocks, properties: net.properties.clone(), nodes: net.nodes, solids: net.solids, ..Network::default() };
        let heats = crate::residual(&alone, self.load, &[], &self.solution.temperatures);
        rows.extend(heats.into_iter().enumerate().filter(|(_, heat)| *heat != 0.0).map(|(node, heat)| (node as u32, heat)));
        for joint in net.joints.iter().filter(|j| within(j.a) || within(j.b)) {
            let [own, other] = self.crossing(joint).per_half;
            let share = if within(joint.a) { own } else { 0.0 } + if within(joint.b) { other } else { 0.0 };
            let change = self.heat(joint) * share;
            rows.extend([(joint.a, change), (joint.b, -change)]);
        }
        for (surface, state) in net.surfaces.iter().zip(&self.surfaces).filter(|(s, _)| within(s.node) && s.property != NONE) {
            rows.push((surface.node, state.heat * (1.0 - state.share)));
        }
        for (s, stream) in net.streams.iter().enumerate() {
            if stream.stations.first().and_then(|st| st.cells.first()).is_some_and(|(cell, _)| within(*cell as u32)) {
                rows.extend(
                    self.exchange(s, |k| {
                        net.exchange_slopes(s, k, &self.solution.streams[s], &self.solution.temperatures).log_conductivity
                    }),
                );
            }
        }
        self.disturbance(rows)
    }

    /// Surfaces of a group (part or lumped node): indices into the network's.
    pub fn surfaces_of(&self, group: u32) -> Vec<usize> {
        let of = |i: &usize| self.network.group[self.network.surfaces[*i].node as usize] == group;
        (0..self.network.surfaces.len()).filter(of).collect()
    }

    /// The effective emissivity of some surfaces; per relative change.
    pub fn emissivity(&self, surfaces: impl IntoIterator<Item = usize>) -> Disturbance {
        self.disturbance(surfaces.into_iter().map(|i| {
            let state = &self.surfaces[i];
            (self.network.surfaces[i].node, state.radiated * state.share)
        }))
    }

    /// A new film between some surfaces and a temperature (K); per W/(m² K).
    pub fn film(&self, surfaces: impl IntoIterator<Item = usize>, to: f64) -> Disturbance {
        self.disturbance(surfaces.into_iter().map(|i| {
            let (surface, state) = (&self.network.surfaces[i], &self.surfaces[i]);
            (surface.node, surface.area * (state.temperature - to) * state.share)
        }))
    }

    /// New heat through some surfaces on the nodes of this network, whether they are surfaces of it or not: `heat` of a surface and its
    /// temperature (K), W per unit. Everything else that acts on them stays.
    pub fn opened(&self, surfaces: &[Surface], heat: impl Fn(&Surface, f64) -> f64) -> Disturbance {
        self.disturbance(surfaces.iter().map(|surface| {
            let state = surface.state(self.t(surface.node), &self.network.properties, self.load);
            (surface.node, heat(surface, state.temperature) * state.share)
        }))
    }

    /// The surfaces that a boundary acts on.
    fn acted_on(&self, boundary: u32) -> impl Iterator<Item = (&Surface, &SurfaceState)> {
        self.network.surfaces.iter().zip(&self.surfaces).filter(move |(s, _)| s.laws.contains(&boundary))
    }

    /// Film, flux or emissivity of a boundary of the machine; per relative change (nothing for a prescribed temperature).
    pub fn boundary(&self, index: u32) -> Disturbance {
        let through = |(s, state): (&Surface, &SurfaceState)| (s.node, s.through(index as usize, state, self.load) * state.share);
        self.disturbance(self.acted_on(index).map(through))
    }

    /// Temperature a boundary of the machine prescribes or refers to; per K.
    pub fn boundary_temperature(&self, index: u32) -> Disturbance {
        let rows = self.acted_on(index).map(|(surface, state)| {
            let rate = match self.load.boundaries[index as usize] {
                BoundaryState::Temperature(_) => state.inward,
                BoundaryState::Film(h, _) => h * surface.area * state.share,
                BoundaryState::Radiation(e, t) => 4.0 * SIGMA * e * surface.area * t.powi(3) * state.share,
                BoundaryState::FreeConvection(law, t) => -law.flux(state.temperature, t).per_gas * surface.area * state.share,
                BoundaryState::Flux(_) => 0.0,
            };
            (surface.node, -rate)
        });
        self.disturbance(rows.chain(self.held_by(index)))
    }

    /// Residual of the neighbours of nodes that a boundary holds (its faces in an enclosure); per K of the boundary.
    fn held_by(&self, index: u32) -> Vec<(u32, f64)> {
        let (net, temperatures) = (self.network, &self.solution.temperatures);
        let by_this = net.fixed.iter().filter(|(_, fixed)| self.load.boundary_of(*fixed) == Some(index as usize));
        let nodes: BTreeSet<u32> = by_this.map(|(node, _)| *node).collect();
        let mut rows = Vec::new();
        for joint in net.joints.iter().filter(|j| nodes.contains(&j.a) || nodes.contains(&j.b)) {
            let (ta, tb) = net.joint_ends(joint, temperatures);
            let state = net.joint_state(joint, ta, tb, &self.load.contacts);
            if nodes.contains(&joint.a) {
                rows.push((joint.b, -state.along_a));
            }
            if nodes.contains(&joint.b) {
                rows.push((joint.a, -state.along_b));
            }
        }
        for (a, b, area) in &net.radiative {
            for (held, other) in [(a, b), (b, a)] {
                if nodes.contains(held) {
                    rows.push((*other, -4.0 * SIGMA * area * self.t(*held).powi(3)));
                }
            }
        }
        rows
    }

    /// Radiative conductors between nodes (indices into the network's); per relative change.
    pub fn radiative(&self, indices: impl IntoIterator<Item = usize>) -> Disturbance {
        self.disturbance(indices.into_iter().flat_map(|i| {
            let (a, b, area) = self.network.radiative[i];
            let heat = SIGMA * area * (self.t(a).powi(4) - self.t(b).powi(4));
            [(a, heat), (b, -heat)]
        }))
    }

    /// The film of a stream; per relative change.
    pub fn stream_film(&self, s: usize) -> Disturbance {
        let state = &self.solution.streams[s];
        self.disturbance(self.exchange(s, |k| self.network.exchange_slopes(s, k, state, &self.solution.temperatures).log_film))
    }

    /// The scale on a stream's wall; per m² K/W.
    pub fn stream_scale(&self, s: usize) -> Disturbance {
        let state = &self.solution.streams[s];
        self.disturbance(self.exchange(s, |k| self.network.exchange_slopes(s, k, state, &self.solution.temperatures).fouling))
    }

    /// Rows that follow from a change of every station's exchange, W/K.
    fn exchange(&self, s: usize, slope: impl Fn(usize) -> f64) -> Vec<(u32, f64)> {
        let stream = &self.network.streams[s];
        let mut entering = self.network.entering(s, self.load, &self.solution.streams, &self.solution.temperatures);
        let mut rows = Vec::new();
        for (k, station) in stream.stations.iter().enumerate() {
            let (own, slope) = (stream.first_node + k as u32, slope(k));
            for (cell, share) in &station.cells {
                let heat = slope * share * (self.solution.temperatures[*cell] - entering);
                rows.extend([(*cell as u32, heat), (own, -heat)]);
            }
            entering = self.t(own);
        }
        rows
    }

    /// The flow of a circuit, films and split following it; per relative change.
    ///
    /// # Errors
    /// Errors of [`Network::stream_states`].
    pub fn flow(&self, circuit: usize) -> Result<Disturbance> {
        let flow = self.load.flows[circuit];
        self.circuit(circuit, FLOW_STEP, |load, step| load.flows[circuit] = flow * (1.0 + step))
    }

    /// The inlet temperature of a circuit; per K.
    ///
    /// # Errors
    /// Errors of [`Network::stream_states`].
    pub fn inlet(&self, circuit: usize) -> Result<Disturbance> {
        let inlet = self.load.inlets[circuit];
        let disturbance = self.circuit(circuit, INLET_STEP, |load, step| load.inlets[circuit] = inlet + step)?;
        Ok(Disturbance { inlets: vec![(circuit, 1.0)], ..disturbance })
    }

    /// Four-point difference of the residual of a circuit and of the circuits that it feeds.
    fn circuit(&self, c: usize, step: f64, change: impl Fn(&mut Load, f64)) -> Result<Disturbance> {
        let temperatures = &self.solution.temperatures;
        let means: Vec<_> = self.network.streams.iter().map(|s| s.means(temperatures)).collect();
        let circuits = self.network.downstream(c);
        let mut rows = BTreeMap::new();
        let mut states = self.solution.streams.clone();
        for (place, weight) in STENCIL {
            let mut load = self.load.clone();
            change(&mut load, place * step);
            self.network.pass_on(&mut load);
            for c in &circuits {
                self.network.circuit_states(*c, &load, temperatures, &means, &mut states)?;
                self.network
                    .circuit_rows(*c, &load, &states, temperatures, |node, heat| *rows.entry(node).or_insert(0.0) += weight / step * heat);
            }
        }
        Ok(self.disturbance(rows))
    }
}
