//! The heat balance of a network: where heat comes from and where it goes.

use super::surfaces::surface_states;
use super::system::entering_temperature;
use coldplate_network::surface::SurfaceState;
use coldplate_network::{BoundaryState, ContactFactors, EnclosureViews, Load, NONE, Network, StreamState};
use coldplate_physics::radiation::SIGMA;

/// The heat balance of a network. Powers in W; positive is heat into the machine.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Balance {
    /// Everything that enters.
    pub in_watts: f64,
    /// Everything that leaves.
    pub out_watts: f64,
    /// |in - out| / max(in, out); 0 where so little heat flows that rounding of the temperatures is all that is left.
    pub relative: f64,
    /// Heat of each source.
    pub sources: Vec<f64>,
    /// Net radiation from the chamber.
    pub radiation: f64,
    /// Net conduction through residual gas.
    pub gas: f64,
    /// Heat through each boundary of the machine.
    pub boundaries: Vec<f64>,
    /// Heat that the water of each circuit brings, dissipation left out (negative where it cools).
    pub circuits: Vec<f64>,
    /// Viscous dissipation in the water.
    pub dissipation: f64,
    /// Heat from each held lumped node, in the order of the network's held nodes. Heat from faces and vertices held at a boundary's
    /// temperature counts to the boundary.
    pub held: Vec<f64>,
}

/// The balance at given temperatures.
pub fn balance(network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Balance {
    balance_with(network, load, streams, temperatures, &surface_states(network, load, temperatures))
}

/// The balance at given temperatures, with known states of the surfaces.
pub(crate) fn balance_with(
    network: &Network,
    load: &Load,
    streams: &[StreamState],
    temperatures: &[f64],
    surfaces: &[SurfaceState],
) -> Balance {
    let mut found = Balance {
        sources: network.sources.iter().zip(&load.powers).map(|(s, p)| s.total(*p, temperatures)).collect(),
        boundaries: vec![0.0; load.boundaries.len()],
        circuits: vec![0.0; network.circuits.len()],
        ..Balance::default()
    };
    for (surface, state) in network.surfaces.iter().zip(surfaces) {
        found.radiation -= state.radiated;
        found.gas -= state.gas;
        for l in surface.boundaries() {
            found.boundaries[l] -= surface.through(l, state, load);
        }
    }
    for (s, (stream, state)) in network.streams.iter().zip(streams).enumerate() {
        let entering = entering_temperature(network, load, streams, s, temperatures);
        let rise = temperatures[stream.outlet() as usize] - entering;
        let dissipated = state.dissipation * stream.stations.iter().map(|s| s.length).sum::<f64>();
        found.circuits[stream.circuit] -= state.capacity_rate * rise - dissipated;
        // The work of the pump enters and leaves with the water; it is listed on both sides.
        found.dissipation += dissipated;
    }
    for ((node, index), heat) in network.fixed.iter().zip(held_heats(network, load, streams, temperatures)) {
        match load.boundary_of(*index) {
            Some(boundary) => found.boundaries[boundary] += heat,
            // Radiation through an enclosure arrives at the chamber's node.
            None if network.chamber == Some(*node) => found.radiation += heat,
            None => found.held.push(heat),
        }
    }
    let flux = |(b, q): (usize, &f64)| (matches!(load.boundaries[b], BoundaryState::Flux(_)), *q);
    let terms = found.sources.iter().copied().chain([found.radiation, found.gas]);
    let terms = terms
        .chain(found.boundaries.iter().enumerate().map(|t| flux(t).1))
        .chain(found.circuits.iter().copied())
        .chain(found.held.iter().copied());
    for q in terms {
        if q >= 0.0 { found.in_watts += q } else { found.out_watts -= q }
    }
    let larger = found.in_watts.max(found.out_watts);
    found.relative = if larger > 1e-12 { (found.in_watts - found.out_watts).abs() / larger } else { 0.0 };
    found
}

/// Heat that each held node puts into the machine, W: heat given to neighbours, water and surroundings, minus the heat of sources in
/// the node.
pub(super) fn held_heats(network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Vec<f64> {
    let mut heats = vec![0.0; network.fixed.len()];
    if heats.is_empty() {
        return heats;
    }
    let mut place = vec![NONE; network.nodes];
    for (k, (node, _)) in network.fixed.iter().enumerate() {
        place[*node as usize] = k as u32;
    }
    let t = |n: u32| temperatures[n as usize];
    let is_held = |n: u32| place[n as usize] != NONE;
    let mut leaves = |n: u32, heat: f64| {
        if place[n as usize] != NONE {
            heats[place[n as usize] as usize] += heat;
        }
    };
    // Cells of blocks are never held, so the conduction inside blocks does not come in.
    for j in network.joints.iter().filter(|j| is_held(j.a) || is_held(j.b)) {
        let heat = network.joint_heat(j, temperatures, &load.contacts);
        leaves(j.a, heat);
        leaves(j.b, -heat);
    }
    for (a, b, area) in network.radiative.iter().filter(|(a, b, _)| is_held(*a) || is_held(*b)) {
        let heat = SIGMA * area * (t(*a).powi(4) - t(*b).powi(4));
        leaves(*a, heat);
        leaves(*b, -heat);
    }
    for surface in network.surfaces.iter().filter(|s| is_held(s.node)) {
        leaves(surface.node, surface.state(t(surface.node), &network.properties, load).heat);
    }
    for (source, power) in network.sources.iter().zip(&load.powers) {
        source.heats(*power, temperatures).for_each(|(node, heat)| leaves(node, -heat));
    }
    for (s, (stream, state)) in network.streams.iter().zip(streams).enumerate() {
        let mut entering = entering_temperature(network, load, streams, s, temperatures);
        for (k, station) in stream.stations.iter().enumerate() {
            for (cell, share) in &station.cells {
                leaves(*cell as u32, state.exchange[k] * share * (temperatures[*cell] - entering));
            }
            entering = temperatures[stream.first_node as usize + k];
        }
    }
    heats
}

/// Heat through a contact, W, from its first side to its second, and its conductance hA, W/K
/// (infinite where bonded).
#[derive(Debug, Clone, PartialEq)]
pub struct ContactFlow {
    /// Name of the contact.
    pub name: String,
    /// Area, m².
    pub area: f64,
    /// Conductance of the interface alone, W/K.
    pub conductance: f64,
    /// Heat from the first side to the second, W.
    pub heat: f64,
    /// Mean temperature drop over the interface, K.
    pub drop: f64,
}

/// Flow through every contact, in the network's order, with factors on their conductances.
pub fn contact_flows(network: &Network, factors: &ContactFactors, temperatures: &[f64]) -> Vec<ContactFlow> {
    let flow = |group: &coldplate_network::ContactGroup| {
        let (mut heat, mut conductance) = (0.0, 0.0);
        for joint in &network.joints[group.joints.clone()] {
            let (ta, tb) = network.joint_ends(joint, temperatures);
            let crossing = network.crossing(joint, ta, tb, factors);
            heat += crossing.state.conductance * (ta - tb);
            conductance += joint.area * crossing.contact;
        }
        // Half of a link counts its own half only: two in series make the whole.
        let conductance = if group.is_half { conductance / 2.0 } else { conductance };
        let drop = if conductance > 0.0 && conductance.is_finite() { heat / conductance } else { 0.0 };
        ContactFlow { name: group.name.clone(), area: group.area, conductance, heat, drop }
    };
    network.contacts.iter().map(flow).collect()
}

/// Heat that each surface of each enclosure gives off into it, W, in the network's order; the chamber gets the sum.
pub fn enclosure_heats(network: &Network, temperatures: &[f64]) -> Vec<Vec<f64>> {
    let t4 = |n: u32| temperatures[n as usize].powi(4);
    let heats = |enclosure: &EnclosureViews| {
        let mut heats = vec![0.0; enclosure.surfaces.len()];
        for ((a, b, area), ends) in network.radiative[enclosure.conductors.clone()].iter().zip(&enclosure.ends) {
            let heat = SIGMA * area * (t4(*a) - t4(*b));
            for (end, heat) in ends.iter().zip([heat, -heat]) {
                if let Some(own) = heats.get_mut(*end as usize) {
                    *own += heat;
                }
            }
        }
        heats
    };
    network.enclosures.iter().map(heats).collect()
}
