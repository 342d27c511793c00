//! The ways heat takes through a machine: from sources through parts into water, walls and boundaries.

use std::collections::BTreeMap;

use super::balance::held_heats;
use super::heat_flow::{Holder, exchanged};
use super::surfaces::surface_states;
use super::system::entering_temperature;
use coldplate_network::{Load, NONE, Network, StreamState};

/// Beginning or end of a route of heat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RouteEnd {
    /// A source, by its index.
    Source(usize),
    /// A part or lumped node, by its group.
    Group(usize),
    /// The water of a circuit, by its index.
    Circuit(usize),
    /// The chamber's wall, by radiation.
    Wall,
    /// Residual gas.
    Gas,
    /// A boundary of the machine, by its index.
    Boundary(usize),
}

/// Heat from one stop to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Route {
    /// End that the heat comes from.
    pub from: RouteEnd,
    /// End that the heat goes to.
    pub to: RouteEnd,
    /// Heat, W; positive.
    pub watts: f64,
}

/// Net heat between any two stops, in the order of the stops. A route begins at water, wall or boundary if heat comes out of it. Nodes
/// that belong to no part (faces between parts) pass on the heat they get and are no stops.
pub(crate) fn heat_routes(network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Vec<Route> {
    let mut net: BTreeMap<(RouteEnd, RouteEnd), f64> = BTreeMap::new();
    let mut add = |a: RouteEnd, b: RouteEnd, watts: f64| {
        if a < b {
            *net.entry((a, b)).or_default() += watts;
        } else if a > b {
            *net.entry((b, a)).or_default() -= watts;
        }
    };
    let group = |node: usize| {
        let group = network.group[node];
        (group != NONE).then_some(RouteEnd::Group(group as usize))
    };
    for (s, (source, power)) in network.sources.iter().zip(&load.powers).enumerate() {
        for (node, heat) in source.heats(*power, temperatures) {
            if let Some(to) = group(node as usize) {
                add(RouteEnd::Source(s), to, heat);
            }
        }
    }
    let holder = |holder: Holder| match holder {
        Holder::Group(group) => RouteEnd::Group(group),
        Holder::Wall => RouteEnd::Wall,
    };
    for (a, b, heat) in exchanged(network, load, temperatures) {
        add(holder(a), holder(b), heat);
    }
    // Heat that holds faces and vertices at the temperature of a boundary.
    for ((node, index), heat) in network.fixed.iter().zip(held_heats(network, load, streams, temperatures)) {
        if let (Some(boundary), Some(to)) = (load.boundary_of(*index), group(*node as usize)) {
            add(RouteEnd::Boundary(boundary), to, heat);
        }
    }
    for (surface, state) in network.surfaces.iter().zip(surface_states(network, load, temperatures)) {
        let Some(from) = group(surface.node as usize) else { continue };
        add(from, RouteEnd::Wall, state.radiated);
        add(from, RouteEnd::Gas, state.gas);
        for l in surface.boundaries() {
            add(from, RouteEnd::Boundary(l), surface.through(l, &state, load));
        }
    }
    for (s, (stream, state)) in network.streams.iter().zip(streams).enumerate() {
        let mut entering = entering_temperature(network, load, streams, s, temperatures);
        for (k, station) in stream.stations.iter().enumerate() {
            for (cell, share) in &station.cells {
                if let Some(from) = group(*cell) {
                    add(from, RouteEnd::Circuit(stream.circuit), state.exchange[k] * share * (temperatures[*cell] - entering));
                }
            }
            entering = temperatures[stream.first_node as usize + k];
        }
    }
    let route = |((a, b), watts): ((RouteEnd, RouteEnd), f64)| {
        let (from, to) = if watts < 0.0 { (b, a) } else { (a, b) };
        Route { from, to, watts: watts.abs() }
    };
    net.into_iter().filter(|(_, watts)| watts.is_finite() && *watts != 0.0).map(route).collect()
}
