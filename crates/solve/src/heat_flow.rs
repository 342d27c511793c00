//! Readings of heat-flow sensors in a steady state and at an instant, and the heat exchanged between parts.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::balance::balance;
use super::system::entering_temperature;
use super::transient::TransientState;
use super::transient::parcels::Parcels;
use coldplate_base::error::Result;
use coldplate_network::{Load, NONE, Network, Stream, StreamState, Through};
use coldplate_physics::radiation::SIGMA;

/// Heat (W) through every heat-flow sensor of the network in a steady state, in the network's order.
pub fn heat_flows(network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Vec<f64> {
    flows(network, load, temperatures, |s| {
        let (stream, state) = (&network.streams[s], &streams[s]);
        let mut entering = entering_temperature(network, load, streams, s, temperatures);
        let mut heat = 0.0;
        for (k, station) in stream.stations.iter().enumerate() {
            heat += station.cells.iter().map(|(cell, share)| state.exchange[k] * share * (temperatures[*cell] - entering)).sum::<f64>();
            entering = temperatures[stream.first_node as usize + k];
        }
        heat
    })
}

/// Heat (W) through every heat-flow sensor at an instant of a history. Heat into the water follows from the film and from the water's
/// own temperatures along the channel.
///
/// # Errors
/// Errors of [`Network::stream_states`].
pub fn heat_flows_at(network: &Network, load: &Load, state: &TransientState) -> Result<Vec<f64>> {
    if network.meters.is_empty() {
        return Ok(Vec::new());
    }
    let streams = network.stream_states(load, &state.temperatures)?;
    let into_water = |s: usize| wall_heat(&network.streams[s], &streams[s], &state.water[s], &state.temperatures);
    Ok(flows(network, load, &state.temperatures, into_water))
}

/// Heat (W) through every heat-flow sensor at temperatures within a step (K); NaN for sensors that measure heat into water.
pub fn heat_flows_within(network: &Network, load: &Load, temperatures: &[f64]) -> Vec<f64> {
    flows(network, load, temperatures, |_| f64::NAN)
}

fn flows(network: &Network, load: &Load, temperatures: &[f64], into_water: impl Fn(usize) -> f64) -> Vec<f64> {
    let has_boundary = network.meters.iter().any(|m| matches!(m.through, Through::Boundary(_)));
    // Heat from boundaries does not depend on the water.
    let boundaries = if has_boundary { balance(network, load, &[], temperatures).boundaries } else { Vec::new() };
    let heat = |(joint, sign): &(u32, f64)| sign * network.joint_heat(&network.joints[*joint as usize], temperatures, &load.contacts);
    let of = |through: &Through| match through {
        Through::Joints(joints) => joints.iter().map(heat).sum(),
        Through::Boundary(boundary) => -boundaries[*boundary],
        Through::Stream(s) => into_water(*s),
    };
    network.meters.iter().map(|meter| of(&meter.through)).collect()
}

/// Heat (W) from the wall of a stream into its parcels: the difference to the wall falls exponentially along each piece of a
/// parcel in a station, as it does in a steady flow.
fn wall_heat(stream: &Stream, state: &StreamState, parcels: &Parcels, temperatures: &[f64]) -> f64 {
    let held: f64 = parcels.iter().map(|p| p.volume).sum();
    let length: f64 = stream.stations.iter().map(|s| s.length).sum();
    let (mut heat, mut begin) = (0.0, 0.0);
    let (mut at, mut parcel) = (0.0, 0);
    for (station, ua) in stream.stations.iter().zip(&state.conductance) {
        let (volume, end) = (held * station.length / length, begin + held * station.length / length);
        let wall: f64 = station.cells.iter().map(|(cell, share)| share * temperatures[*cell]).sum();
        let mut from = begin;
        while let Some(p) = parcels.get(parcel) {
            let to = end.min(at + p.volume);
            let along =
                |x: f64| wall - p.upstream - (p.downstream - p.upstream) * ((x - at) / p.volume.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            heat += ua * (to - from).max(0.0) / volume * mean_difference(along(from), along(to));
            from = to;
            if at + p.volume > end {
                break;
            }
            at += p.volume;
            parcel += 1;
        }
        begin = end;
    }
    heat
}

/// Mean of a difference that falls exponentially from one end to the other; straight where it changes its sign.
fn mean_difference(first: f64, last: f64) -> f64 {
    let ratio = last / first;
    if ratio > 0.0 && (ratio - 1.0).abs() > 1e-6 && ratio.is_finite() { (last - first) / ratio.ln() } else { f64::midpoint(first, last) }
}

/// A body that gives or takes heat through contacts, links and enclosures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Holder {
    /// A part or lumped node, by its group.
    Group(usize),
    /// The chamber's wall, which enclosures open to.
    Wall,
}

/// Net heat (W) from the first to the second of every two holders, in their order, through contacts, links and enclosures.
///
/// Nodes of no part (radiosities, nodes between faces) pass on the heat they get. Several may hang together, and reach many parts and
/// the wall. They are eliminated, which leaves one conductance between every two parts, and the heat through it is their exchange. The
/// exchanges of a part sum to the heat that leaves its nodes.
pub fn exchanged(network: &Network, load: &Load, temperatures: &[f64]) -> Vec<(Holder, Holder, f64)> {
    let holder = |node: u32| match network.group[node as usize] {
        NONE => (network.chamber == Some(node)).then_some(Holder::Wall),
        group => Some(Holder::Group(group as usize)),
    };
    let mut net: BTreeMap<(Holder, Holder), f64> = BTreeMap::new();
    let mut add = |a: Holder, b: Holder, heat: f64| {
        if a < b {
            *net.entry((a, b)).or_default() += heat;
        } else if a > b {
            *net.entry((b, a)).or_default() -= heat;
        }
    };
    let mut inner: Vec<Edge> = Vec::new();
    for edge in edges(network, load, temperatures) {
        match edge.ends.map(holder) {
            [Some(a), Some(b)] => add(a, b, edge.heat()),
            _ => inner.push(edge),
        }
    }
    for web in webs(&inner, |node| holder(node).is_none()) {
        web_heats(&web, holder).into_iter().for_each(|(a, b, heat)| add(a, b, heat));
    }
    net.into_iter().map(|((a, b), heat)| (a, b, heat)).collect()
}

/// A conductor at the temperatures of a state.
#[derive(Debug, Clone, Copy)]
struct Edge {
    ends: [u32; 2],
    /// Temperatures at its ends, K.
    at: [f64; 2],
    /// Conductance, W/K; of radiation W/K⁴.
    conductance: f64,
    is_radiative: bool,
}

impl Edge {
    fn heat(&self) -> f64 {
        let [a, b] = if self.is_radiative { self.at.map(|t| t.powi(4)) } else { self.at };
        self.conductance * (a - b)
    }

    /// The linear conductor that carries the same heat at these temperatures.
    fn linear(self) -> Self {
        let [a, b] = self.at;
        let conductance = if self.is_radiative { self.conductance * (a * a + b * b) * (a + b) } else { self.conductance };
        Self { conductance, is_radiative: false, ..self }
    }
}

fn edges<'a>(network: &'a Network, load: &'a Load, temperatures: &'a [f64]) -> impl Iterator<Item = Edge> + 'a {
    let joints = network.joints.iter().map(|j| {
        let (ta, tb) = network.joint_ends(j, temperatures);
        let conductance = network.joint_state(j, ta, tb, &load.contacts).conductance;
        Edge { ends: [j.a, j.b], at: [ta, tb], conductance, is_radiative: false }
    });
    let radiative = network.radiative.iter().map(|(a, b, area)| {
        let at = [*a, *b].map(|n| temperatures[n as usize]);
        Edge { ends: [*a, *b], at, conductance: SIGMA * area, is_radiative: true }
    });
    joints.chain(radiative)
}

/// Conductors that end at a node of no part, grouped by connected nodes.
fn webs(inner: &[Edge], is_between: impl Fn(u32) -> bool) -> Vec<Vec<Edge>> {
    let mut first: BTreeMap<u32, u32> = BTreeMap::new();
    let root = |first: &BTreeMap<u32, u32>, node: u32| {
        let mut at = node;
        while let Some(next) = first.get(&at).filter(|next| **next != at) {
            at = *next;
        }
        at
    };
    for edge in inner {
        let [a, b] = edge.ends.map(|node| is_between(node).then(|| root(&first, node)));
        for own in [a, b].into_iter().flatten() {
            first.entry(own).or_insert(own);
        }
        if let (Some(a), Some(b)) = (a, b) {
            first.insert(a.max(b), a.min(b));
        }
    }
    let mut webs: BTreeMap<u32, Vec<Edge>> = BTreeMap::new();
    for edge in inner {
        if let Some(node) = edge.ends.into_iter().find(|node| is_between(*node)) {
            webs.entry(root(&first, node)).or_default().push(*edge);
        }
    }
    webs.into_values().collect()
}

/// Heat (W) between the holders around one web, its own nodes eliminated.
///
/// A web of radiation alone is linear in the fourth powers of the temperatures, so its exchange is that of grey surfaces; a web that
/// conducts too is taken as linear, with its conductances in this state.
fn web_heats(web: &[Edge], holder: impl Fn(u32) -> Option<Holder>) -> Vec<(Holder, Holder, f64)> {
    let is_radiative = web.iter().all(|e| e.is_radiative);
    let mut place: BTreeMap<u32, usize> = BTreeMap::new();
    for node in web.iter().flat_map(|e| e.ends).filter(|n| holder(*n).is_none()) {
        let next = place.len();
        place.entry(node).or_insert(next);
    }
    let size = place.len();
    let level = |t: f64| if is_radiative { t.powi(4) } else { t };
    // Levels count from the level of one end, so that rounding is relative to their differences.
    let zero = web.first().map_or(0.0, |e| level(e.at[0]));
    let mut matrix = DMatrix::<f64>::zeros(size, size);
    // For each holder: its conductance to every node, and this conductance times the level of its ends.
    let mut around: BTreeMap<Holder, [DVector<f64>; 2]> = BTreeMap::new();
    for edge in web {
        let edge = if is_radiative { *edge } else { edge.linear() };
        let own = edge.ends.map(|n| place.get(&n).copied());
        for (k, node) in own.into_iter().enumerate() {
            let Some(i) = node else { continue };
            matrix[(i, i)] += edge.conductance;
            match (own[1 - k], holder(edge.ends[1 - k])) {
                (Some(j), _) => matrix[(i, j)] -= edge.conductance,
                (None, Some(from)) => {
                    let [conductance, driven] = around.entry(from).or_insert_with(|| [DVector::zeros(size), DVector::zeros(size)]);
                    conductance[i] += edge.conductance;
                    driven[i] += edge.conductance * (level(edge.at[1 - k]) - zero);
                }
                (None, None) => {}
            }
        }
    }
    let factors = matrix.lu();
    let reached: Vec<(Holder, &DVector<f64>, DVector<f64>)> =
        around.iter().filter_map(|(from, [conductance, driven])| Some((*from, conductance, factors.solve(driven)?))).collect();
    let pairs = reached.iter().enumerate().flat_map(|(k, a)| reached[k + 1..].iter().map(move |b| (a, b)));
    pairs.map(|(a, b)| (a.0, b.0, b.1.dot(&a.2) - a.1.dot(&b.2))).collect()
}
