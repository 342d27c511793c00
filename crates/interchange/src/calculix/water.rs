//! Channels: stations that take heat from the solid, and the fluid network that carries it away.

use std::f64::consts::{PI, TAU};

use super::bodies::{DeckBodies, add as add_weight};
use super::deck::{Deck, ElementKind, ElementSet, FilmCard, NodeWeights, OUTSIDE, Sink};
use coldplate_describe::machine::{Channel, Side};
use coldplate_network::mesh::path::{self, ChannelPiece, Station};
use coldplate_network::{Stream, StreamState};
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// Specific heat in the fluid network, J/(kg K). Chosen, about that of water; mass flows are such that the capacity rates are those of
/// our solution.
pub(super) const SPECIFIC_HEAT: f64 = 4180.0;
/// Distance from a line source on a node of a mesh of square bilinear elements at which the exact solution has the node's temperature,
/// over the root of the summed squares of the cell's two widths; dimensionless. Peaceman's 0.14 is the like of it for a mesh of cells.
/// From the discrete Green's function of the nine-point operator: 0.1146 cell widths.
const OWN_DISTANCE: f64 = 0.0810;
/// Least share of the film's resistance that counts, dimensionless, where the mesh is finer than the channel: as in our own solver.
const LEAST_FILM: f64 = 0.2;
/// Share of a flow below which it is rounding, dimensionless. Chosen.
const LEAST_FLOW: f64 = 1e-9;

/// The nodes of the fluid network at which water enters and leaves each channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ends {
    pub(super) inlet: u32,
    pub(super) outlet: u32,
}

/// Adds every channel; returns the nodes at which water enters and leaves each.
pub(super) fn add(model: &MeshedMachine, state: &SteadyState, bodies: &DeckBodies<'_>, deck: &mut Deck) -> Vec<Ends> {
    let streams = &model.network.streams;
    let mut ends: Vec<Ends> = Vec::with_capacity(streams.len());
    for (s, (stream, flow)) in streams.iter().zip(&state.solution.streams).enumerate() {
        let channel = &model.machine.channels[s];
        let pieces = path::pieces(&model.mesh, channel);
        let places = walls(model, bodies, channel, stream, &pieces);
        let start = pieces.first().map_or(places.first().map_or([0.0; 3], |p| p.at), |p| p.at(0.0));
        let inlet = deck.node(start);
        let mut last = inlet;
        for (k, (station, place)) in stream.stations.iter().zip(&places).enumerate() {
            let next = deck.node(pieces.get(k).map_or(place.at, |p| p.at(1.0)));
            carry(deck, last, next, place.at, flow.capacity_rate);
            let conductance = conductance(model, state, stream, flow, station, place);
            // The water of a station has one temperature here, the one at its end. With an exchange of C (exp(UA/C) - 1) the plug flow
            // of our network comes out.
            let exchange = flow.capacity_rate * (conductance / flow.capacity_rate).exp_m1();
            let area = PI * stream.diameter * station.length;
            let (element, _) = deck.place(place.at, area, &place.weights);
            deck.films.push(FilmCard { element, face: 1, film: exchange / area, sink: Sink::Water(next) });
            if flow.dissipation > 0.0 {
                deck.heats.push((next, flow.dissipation * station.length));
            }
            last = next;
        }
        if stream.upstream.is_empty() {
            deck.held.push((inlet, state.load.inlets[stream.circuit]));
            carry(deck, OUTSIDE, inlet, start, flow.capacity_rate);
        }
        for (above, share) in stream.upstream.iter().zip(&flow.mixture) {
            if *share > LEAST_FLOW {
                carry(deck, ends[*above].outlet, inlet, start, share * flow.capacity_rate);
            }
        }
        ends.push(Ends { inlet, outlet: last });
    }
    leave(model, state, &ends, deck);
    ends
}

/// A fluid element from a node to a node; `rate` is its capacity rate, W/K.
fn carry(deck: &mut Deck, from: u32, to: u32, at: [f64; 3], rate: f64) {
    let middle = deck.node(at);
    deck.flows.push((middle, rate / SPECIFIC_HEAT));
    deck.element(ElementKind::D, ElementSet::Water, vec![from, middle, to]);
}

/// Lets out the flow that no other channel takes.
fn leave(model: &MeshedMachine, state: &SteadyState, ends: &[Ends], deck: &mut Deck) {
    let (streams, flows) = (&model.network.streams, &state.solution.streams);
    for (u, end) in ends.iter().enumerate() {
        let takes = |(below, flow): (&Stream, &StreamState)| {
            let offered: f64 = below.upstream.iter().map(|above| flows[*above].mass_flow).sum();
            below.upstream.contains(&u).then(|| flow.mass_flow * flows[u].mass_flow / offered)
        };
        let taken: f64 = streams.iter().zip(flows).filter_map(takes).sum();
        let left = 1.0 - taken / flows[u].mass_flow;
        if left > LEAST_FLOW {
            carry(deck, end.outlet, OUTSIDE, deck.nodes[end.outlet as usize - 1], left * flows[u].capacity_rate);
        }
    }
}

/// The wall of a channel at one station.
struct Wall {
    at: [f64; 3],
    /// Temperature of the wall, as weights over nodes.
    weights: NodeWeights,
    /// Conduction length factor between the nodes and the wall, as of a [`Station`] but for shape functions.
    shape: f64,
}

fn walls(model: &MeshedMachine, bodies: &DeckBodies<'_>, channel: &Channel, stream: &Stream, pieces: &[ChannelPiece]) -> Vec<Wall> {
    if channel.is_bore {
        return stream.stations.iter().map(|station| bore(bodies, station)).collect();
    }
    pieces.iter().map(|piece| around(model, bodies, channel, piece)).collect()
}

/// The wall of a bore is a face of cells, and nothing lies between.
fn bore(bodies: &DeckBodies<'_>, station: &Station) -> Wall {
    let mut weights = NodeWeights::new();
    let mut at = [0.0; 3];
    for (cell, share) in &station.cells {
        let (g, c) = bodies.of_cell(*cell);
        let grid = bodies.grid(g);
        at = grid.to_machine([grid.edges[0][c[0]], grid.centre(1, c[1]), grid.centre(2, c[2])]);
        for (node, weight) in bodies.face_mean(g, c, Side::Low0) {
            add_weight(&mut weights, node, weight * share);
        }
    }
    Wall { at, weights, shape: 0.0 }
}

/// A wall through the cells of a block: points around the axis have the temperatures that the shape functions give them. They
/// stand for a distance from the axis, the mean of the logarithms of the distances between the nodes that have a weight.
fn around(model: &MeshedMachine, bodies: &DeckBodies<'_>, channel: &Channel, piece: &ChannelPiece) -> Wall {
    let rings = piece.wall(channel.diameter);
    let samples: usize = rings.iter().map(|(_, points)| points.len()).sum();
    let mut weights = NodeWeights::new();
    let mut places: Vec<([f64; 2], f64)> = Vec::new();
    let axes = piece.normals();
    let across = |v: [f64; 3]| axes.map(|e| (0..3).map(|d| v[d] * e[d]).sum::<f64>());
    for (centre, points) in &rings {
        let home = model.mesh.grid_at(channel.part, *centre, 1e-6);
        for point in points {
            let Some(g) = model.mesh.grid_at(channel.part, *point, 1e-6).or(home) else { continue };
            let grid = bodies.grid(g);
            let c = grid.locate(*point);
            let corner = |high: usize| grid.to_machine([0, 1, 2].map(|d| grid.edges[d][c[d] + high]));
            let (low, high) = (corner(0), corner(1));
            let widths = axes.map(|e| (0..3).map(|d| (high[d] - low[d]).abs() * e[d].abs()).sum::<f64>());
            for (node, weight) in bodies.at(g, c, *point) {
                if !weights.iter().any(|(known, _)| *known == node) {
                    places.push(([0.0; 2], OWN_DISTANCE * widths[0].hypot(widths[1])));
                }
                add_weight(&mut weights, node, weight / samples as f64);
            }
        }
    }
    for ((node, _), place) in weights.iter().zip(&mut places) {
        place.0 = across(bodies.place(*node));
    }
    let mut mean = 0.0;
    for ((_, wi), (a, own)) in weights.iter().zip(&places) {
        for ((_, wj), (b, _)) in weights.iter().zip(&places) {
            mean += wi * wj * (a[0] - b[0]).hypot(a[1] - b[1]).max(*own).ln();
        }
    }
    Wall { at: piece.at(0.5), weights, shape: (mean - (channel.diameter / 2.0).ln()) / TAU }
}

/// Conductance between the water of a station and the nodes of its wall, W/K: as in our network, with the shape of this mesh.
fn conductance(model: &MeshedMachine, state: &SteadyState, stream: &Stream, flow: &StreamState, station: &Station, wall: &Wall) -> f64 {
    let perimeter = PI * stream.diameter;
    let film = 1.0 / (flow.film * perimeter * station.length);
    let at: f64 = station.cells.iter().map(|(n, w)| w * state.solution.temperatures[*n]).sum();
    let k = |axis: usize| model.network.properties[stream.property as usize + axis].at(at);
    let across: f64 = (0..3).map(|axis| station.across[axis] * k(axis).ln()).sum();
    let spread = wall.shape / (across.exp() * station.length);
    1.0 / ((film + spread).max(LEAST_FILM * film) + stream.fouling_resistance / (perimeter * station.length))
}
