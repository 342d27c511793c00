//! The residual of a network, its Jacobian, and the symmetric part a preconditioner is made from.

use rayon::prelude::*;

use super::csr::{CHUNK, for_chunks};
use super::jacobian::{Conduction, Jacobian, SparseRows};
use super::surfaces::{SurfaceStates, surface_states};
use coldplate_describe::machine::Slope;
use coldplate_network::block::{Block, FaceCoefficients, Gap, RowSegment};
use coldplate_network::{JointState, Load, NONE, Network, StreamState};
use coldplate_physics::radiation::SIGMA;

/// The sparsity pattern of a network's Jacobian outside the blocks, with the coefficients that never change.
#[derive(Debug, Clone)]
pub struct System {
    pattern: SparseRows<f64>,
    /// Places in the pattern of the entries that [`each_entry`] visits, in the order of the visit.
    slots: Vec<u32>,
    conduction: BlockConduction,
    is_held: Vec<u32>,
}

/// Conductances inside the blocks of a network, as far as they stay the same.
#[derive(Debug, Clone)]
struct BlockConduction {
    /// Conductances of each block at 300 K, W/K.
    profiles: Vec<FaceCoefficients<f64>>,
    /// Whether those of each block are equal at all temperatures; others are evaluated anew each time.
    is_constant: Vec<bool>,
}

impl BlockConduction {
    fn new(network: &Network) -> Self {
        Self {
            profiles: network.blocks.iter().map(|b| b.profile(&network.properties, 300.0)).collect(),
            is_constant: network.blocks.iter().map(|b| b.is_constant(&network.properties)).collect(),
        }
    }

    /// Every block with its conductances, W/K, and whether they are constant.
    fn of_blocks<'s>(&'s self, network: &'s Network) -> impl Iterator<Item = (&'s Block, &'s FaceCoefficients<f64>, bool)> {
        network.blocks.iter().zip(&self.profiles).zip(&self.is_constant).map(|((block, profile), constant)| (block, profile, *constant))
    }
}

/// The symmetric positive definite part of a linearised network of solids, for multigrid.
#[derive(Debug, Clone)]
pub struct Symmetric<'a> {
    /// The structured blocks.
    pub blocks: &'a [Block],
    /// Conductances inside each block, W/K, with one conductivity for all its cells.
    pub profiles: Vec<FaceCoefficients<f64>>,
    /// All other conductances between two nodes, W/K.
    pub couplings: Vec<(u32, u32, f64)>,
    /// Conductance from each solid node to given temperatures, W/K.
    pub to_given: Vec<f64>,
}

impl Symmetric<'_> {
    /// y = K x
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        y.iter_mut().zip(&self.to_given).zip(x).for_each(|((y, g), x)| *y = g * x);
        for (block, profile) in self.blocks.iter().zip(&self.profiles) {
            for_chunks(&mut y[block.nodes()], |first, part| {
                block.add_conduction(profile, block.first + first, x, part);
            });
        }
        for (a, b, g) in &self.couplings {
            let heat = g * (x[*a as usize] - x[*b as usize]);
            y[*a as usize] += heat;
            y[*b as usize] -= heat;
        }
    }
}

impl System {
    /// The pattern of `network`.
    pub fn new(network: &Network) -> Self {
        let mut entries = Vec::with_capacity(2 * (network.joints.len() + network.radiative.len()));
        each_entry(network, &Derivatives::none(network), |row, column, _| {
            if row != column {
                entries.push((row, column));
            }
        });
        let pattern = SparseRows::pattern(entries.clone());
        let slots =
            entries.par_iter().with_min_len(CHUNK).map(|(row, column)| pattern.position(*row, *column).unwrap_or(0) as u32).collect();
        let conduction = BlockConduction::new(network);
        let mut is_held: Vec<u32> = network.fixed.iter().map(|(node, _)| *node).collect();
        is_held.sort_unstable();
        Self { pattern, slots, conduction, is_held }
    }

    /// Sum of the rounding errors of all nodal residuals, W: a difference of two temperatures is known
    /// to one unit in the last place of either. No iteration brings the residual below it.
    pub fn rounding(&self, network: &Network, streams: &[StreamState], temperatures: &[f64], outside: &SurfaceStates) -> f64 {
        let of_block = |(block, profile): (&Block, &FaceCoefficients<f64>)| {
            let [_, n1, n2] = block.cells.map(|n| n as f64);
            let sums = [0, 1, 2].map(|d| profile[d].iter().sum::<f64>());
            sums[0] * n1 * n2 + sums[1] * (if block.wraps { n1 } else { n1 - 1.0 }) * n2 + sums[2] * n1 * (n2 - 1.0)
        };
        let linear: f64 = network.blocks.iter().zip(&self.conduction.profiles).map(of_block).sum();
        let joints: f64 = outside.joints.iter().map(|(state, _)| state.conductance.abs()).sum();
        let water: f64 = network.streams.iter().zip(streams).map(|(s, state)| state.capacity_rate * s.stations.len() as f64).sum();
        let hottest = temperatures.iter().fold(0.0, |m: f64, t| m.max(*t));
        let radiation: f64 = network.radiative.iter().map(|(_, _, area)| 4.0 * SIGMA * area * hottest.powi(3)).sum();
        // Half a cell before a held face conducts more than whole cells do.
        let surfaces: f64 = outside.surfaces.iter().map(|state| state.slope).sum();
        // Each conductance stands in the balances of two nodes.
        2.0 * f64::EPSILON * hottest * (linear + joints + water + radiation + surfaces)
    }

    /// Conductances of each block, W/K, with the conductivity at the mean temperature of its cells.
    fn mean_profiles(&self, network: &Network, temperatures: &[f64]) -> Vec<FaceCoefficients<f64>> {
        let blocks = self.conduction.of_blocks(network);
        let mean = |block: &Block| temperatures[block.nodes()].iter().sum::<f64>() / block.len() as f64;
        blocks.map(|(b, fixed, is_constant)| if is_constant { fixed.clone() } else { b.profile(&network.properties, mean(b)) }).collect()
    }

    /// Jacobian of the residual at `temperatures`, the streams' coefficients held as they are.
    pub fn jacobian<'a>(&self, network: &'a Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Jacobian<'a> {
        self.jacobian_with(network, load, streams, temperatures, &SurfaceStates::new(network, load, temperatures))
    }

    /// Jacobian of the residual with known states of surfaces and joints.
    pub(crate) fn jacobian_with<'a>(
        &self,
        network: &'a Network,
        load: &Load,
        streams: &[StreamState],
        temperatures: &[f64],
        outside: &SurfaceStates,
    ) -> Jacobian<'a> {
        let mut found = Jacobian::new(network, Vec::new(), Vec::new(), SparseRows::default());
        self.renew(&mut found, network, load, streams, temperatures, outside);
        found
    }

    /// Jacobian of the residual, written into the memory of another one.
    pub(crate) fn renew<'a>(
        &self,
        matrix: &mut Jacobian<'a>,
        network: &'a Network,
        load: &Load,
        streams: &[StreamState],
        temperatures: &[f64],
        outside: &SurfaceStates,
    ) {
        let Jacobian { blocks, diagonal, rest, .. } = matrix;
        if diagonal.len() != network.nodes {
            (*diagonal, *rest) = (vec![0.0; network.nodes], self.pattern.clone());
        } else {
            for_chunks(diagonal, |_, part| part.fill(0.0));
            rest.values.fill(0.0);
        }
        let mut slots = self.slots.iter();
        each_entry(network, &Derivatives::at(network, streams, temperatures, outside), |row, column, value| {
            if row == column {
                diagonal[row as usize] += value;
            } else if let Some(slot) = slots.next() {
                rest.values[*slot as usize] += value;
            }
        });
        for (surface, state) in network.surfaces.iter().zip(&outside.surfaces) {
            diagonal[surface.node as usize] += state.slope;
        }
        for (source, power) in network.sources.iter().zip(&load.powers).filter(|(s, _)| s.law.follows_temperature()) {
            source.slopes(*power, temperatures).for_each(|(node, slope)| diagonal[node as usize] -= slope);
        }
        self.hold(diagonal, rest);
        let of_block = |(block, profile, is_constant): (&Block, &FaceCoefficients<f64>, bool)| {
            if is_constant { Conduction::Constant(profile.clone()) } else { varying(network, block, temperatures) }
        };
        *blocks = self.conduction.of_blocks(network).map(of_block).collect();
    }

    /// The symmetric part for the solids: without the slopes of conductances and the one-way terms of the streams.
    pub fn symmetric<'a>(&self, network: &'a Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Symmetric<'a> {
        let t = |n: u32| temperatures[n as usize];
        let is_held = |n: u32| self.is_held.binary_search(&n).is_ok();
        let mut couplings = Vec::with_capacity(network.joints.len() + network.radiative.len());
        let mut to_given = vec![0.0; network.solids];
        let joints = network.joints.iter().map(|j| {
            let (ta, tb) = network.joint_ends(j, temperatures);
            (j.a, j.b, network.joint_state(j, ta, tb, &load.contacts).conductance)
        });
        let radiative = network.radiative.iter().map(|(a, b, area)| (*a, *b, 2.0 * SIGMA * area * (t(*a).powi(3) + t(*b).powi(3))));
        for (a, b, g) in joints.chain(radiative) {
            match (is_held(a), is_held(b)) {
                (false, false) => couplings.push((a, b, g)),
                (true, false) => to_given[b as usize] += g,
                (false, true) => to_given[a as usize] += g,
                (true, true) => {}
            }
        }
        for (surface, state) in network.surfaces.iter().zip(surface_states(network, load, temperatures)) {
            to_given[surface.node as usize] += state.slope;
        }
        for (stream, state) in network.streams.iter().zip(streams) {
            for (station, exchange) in stream.stations.iter().zip(&state.exchange) {
                for (cell, share) in &station.cells {
                    to_given[*cell] += exchange * share;
                }
            }
        }
        for node in &self.is_held {
            to_given[*node as usize] = 1.0;
        }
        Symmetric { blocks: &network.blocks, profiles: self.mean_profiles(network, temperatures), couplings, to_given }
    }

    /// Turns the rows and columns of held nodes into those of the identity.
    fn hold(&self, diagonal: &mut [f64], rest: &mut SparseRows<f64>) {
        if self.is_held.is_empty() {
            return;
        }
        let is_held = |n: u32| self.is_held.binary_search(&n).is_ok();
        let cleared: Vec<bool> = rest.iter().flat_map(|(row, cols, _)| cols.iter().map(move |c| is_held(row) || is_held(*c))).collect();
        rest.values.iter_mut().zip(cleared).filter(|(_, cleared)| *cleared).for_each(|(v, _)| *v = 0.0);
        for node in &self.is_held {
            diagonal[*node as usize] = 1.0;
        }
    }

    /// Heat leaving each node minus heat entering it, W: zero in the steady state.
    pub fn residual(&self, network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Vec<f64> {
        self.residual_with(network, load, streams, temperatures, &SurfaceStates::new(network, load, temperatures))
    }

    /// Residual with known states of surfaces and joints, W.
    pub(crate) fn residual_with(
        &self,
        network: &Network,
        load: &Load,
        streams: &[StreamState],
        temperatures: &[f64],
        outside: &SurfaceStates,
    ) -> Vec<f64> {
        let mut residual = Vec::new();
        self.residual_in(&mut residual, network, load, streams, temperatures, outside);
        residual
    }

    /// Residual with known states of surfaces and joints, W, in the memory of a given vector.
    pub(crate) fn residual_in(
        &self,
        residual: &mut Vec<f64>,
        network: &Network,
        load: &Load,
        streams: &[StreamState],
        temperatures: &[f64],
        outside: &SurfaceStates,
    ) {
        heats(residual, network, &self.conduction, load, streams, temperatures, outside);
    }
}

/// Residual of a network, W, for a single use: no pattern is needed for it.
pub fn residual(network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Vec<f64> {
    let mut residual = Vec::new();
    let outside = SurfaceStates::new(network, load, temperatures);
    heats(&mut residual, network, &BlockConduction::new(network), load, streams, temperatures, &outside);
    residual
}

/// Writes the residual into `r`, W.
fn heats(
    r: &mut Vec<f64>,
    network: &Network,
    conduction: &BlockConduction,
    load: &Load,
    streams: &[StreamState],
    temperatures: &[f64],
    outside: &SurfaceStates,
) {
    let t = |n: u32| temperatures[n as usize];
    if r.len() == network.nodes {
        for_chunks(r, |_, part| part.fill(0.0));
    } else {
        *r = vec![0.0; network.nodes];
    }
    for (block, profile, is_constant) in conduction.of_blocks(network) {
        let varying = if is_constant { None } else { Some(potentials(network, block, temperatures)) };
        for_chunks(&mut r[block.nodes()], |first, part| {
            let start = block.first + first;
            let Some(potentials) = &varying else { return block.add_conduction(profile, start, temperatures, part) };
            for segment in block.segments(start..start + part.len()) {
                add_varying(&segment, block, potentials, &mut part[segment.node - start..][..segment.along.len()]);
            }
        });
    }
    let mut flow = |a: u32, b: u32, heat: f64| {
        r[a as usize] += heat;
        r[b as usize] -= heat;
    };
    for (joint, (state, difference)) in network.joints.iter().zip(&outside.joints) {
        flow(joint.a, joint.b, state.conductance * difference);
    }
    for (a, b, area) in &network.radiative {
        flow(*a, *b, SIGMA * area * (t(*a).powi(4) - t(*b).powi(4)));
    }
    for (surface, state) in network.surfaces.iter().zip(&outside.surfaces) {
        r[surface.node as usize] += state.heat;
    }
    for (source, power) in network.sources.iter().zip(&load.powers) {
        source.heats(*power, temperatures).for_each(|(node, heat)| r[node as usize] -= heat);
    }
    for (s, state) in streams.iter().enumerate() {
        let stream = &network.streams[s];
        let mut entering = entering_temperature(network, load, streams, s, temperatures);
        for (k, station) in stream.stations.iter().enumerate() {
            let own = stream.first_node as usize + k;
            let (mut gained, mut wall) = (0.0, 0.0);
            for (cell, share) in &station.cells {
                let heat = state.exchange[k] * share * (temperatures[*cell] - entering);
                r[*cell] += heat;
                gained += heat;
                wall += share * temperatures[*cell];
            }
            r[own] = if state.capacity_rate > 0.0 {
                state.capacity_rate * (temperatures[own] - entering) - gained - state.dissipation * station.length
            } else {
                temperatures[own] - wall
            };
            entering = temperatures[own];
        }
    }
    for (node, _) in &network.fixed {
        r[*node as usize] = 0.0;
    }
}

/// Temperature (K) of the water entering a stream.
pub fn entering_temperature(network: &Network, load: &Load, streams: &[StreamState], s: usize, temperatures: &[f64]) -> f64 {
    let stream = &network.streams[s];
    if stream.upstream.is_empty() {
        return load.inlets[stream.circuit];
    }
    let mix = stream.upstream.iter().zip(&streams[s].mixture);
    mix.map(|(u, w)| w * temperatures[network.streams[*u].outlet() as usize]).sum()
}

/// Derivatives of the heat flows outside the blocks.
struct Derivatives<'a> {
    /// Derivatives of each joint's heat with respect to the temperatures at its two ends, the second with the sign turned, W/K.
    joints: Vec<(f64, f64)>,
    /// Derivatives of each radiative conductor's heat, likewise.
    radiative: Vec<(f64, f64)>,
    /// Coefficients of the streams, if they are known.
    streams: Option<&'a [StreamState]>,
}

impl<'a> Derivatives<'a> {
    /// All zero, for a visit that asks only for the places of entries.
    fn none(network: &Network) -> Self {
        Self { joints: vec![(0.0, 0.0); network.joints.len()], radiative: vec![(0.0, 0.0); network.radiative.len()], streams: None }
    }

    fn at(network: &Network, streams: &'a [StreamState], temperatures: &[f64], outside: &SurfaceStates) -> Self {
        let of_joint = |(state, _): &(JointState, f64)| (state.along_a, state.along_b);
        let of_link = |(a, b, area): &(u32, u32, f64)| {
            let slope = |n: u32| 4.0 * SIGMA * area * temperatures[n as usize].powi(3);
            (slope(*a), slope(*b))
        };
        Self {
            joints: outside.joints.par_iter().with_min_len(CHUNK).map(of_joint).collect(),
            radiative: network.radiative.iter().map(of_link).collect(),
            streams: Some(streams),
        }
    }
}

/// Visits every entry (row, column, value) of the Jacobian outside blocks and surfaces, entries that add up one after the other, always
/// in one order for any values.
fn each_entry(network: &Network, derivatives: &Derivatives<'_>, mut visit: impl FnMut(u32, u32, f64)) {
    let mut pair = |a: u32, b: u32, da: f64, db: f64| {
        debug_assert!(a != NONE && b != NONE);
        visit(a, a, da);
        visit(b, b, db);
        visit(a, b, -db);
        visit(b, a, -da);
    };
    for (joint, (da, db)) in network.joints.iter().zip(&derivatives.joints) {
        pair(joint.a, joint.b, *da, *db);
    }
    for ((a, b, _), (da, db)) in network.radiative.iter().zip(&derivatives.radiative) {
        pair(*a, *b, *da, *db);
    }
    for (joint, (da, db)) in network.joints.iter().zip(&derivatives.joints) {
        for (reach, own, slope) in [(joint.reach[0], joint.a, *da), (joint.reach[1], joint.b, -db)] {
            let Some(reach) = network.reaches.get(reach as usize) else { continue };
            for (node, share) in reach.nodes.into_iter().zip(reach.shares).filter(|(_, share)| *share != 0.0) {
                for (row, sign) in [(joint.a, 1.0), (joint.b, -1.0)] {
                    visit(row, node, sign * slope * share);
                    visit(row, own, -sign * slope * share);
                }
            }
        }
    }
    for (s, stream) in network.streams.iter().enumerate() {
        for (k, station) in stream.stations.iter().enumerate() {
            let own = stream.first_node + k as u32;
            // Without flow the water takes the temperature of its wall.
            let (rate, exchange) = match derivatives.streams {
                Some(streams) if streams[s].capacity_rate > 0.0 => (streams[s].capacity_rate, streams[s].exchange[k]),
                _ => (0.0, 0.0),
            };
            let is_moving = rate > 0.0;
            visit(own, own, if is_moving { rate } else { 1.0 });
            for (cell, share) in &station.cells {
                visit(*cell as u32, *cell as u32, exchange * share);
                visit(own, *cell as u32, if is_moving { -exchange * share } else { -share });
            }
            let mut from_above = |water: u32, mix: f64| {
                visit(own, water, -(rate - exchange) * mix);
                for (cell, share) in &station.cells {
                    visit(*cell as u32, water, -exchange * share * mix);
                }
            };
            if k > 0 {
                from_above(own - 1, 1.0);
            } else {
                for (i, upstream) in stream.upstream.iter().enumerate() {
                    let mix = derivatives.streams.map_or(0.0, |streams| streams[s].mixture[i]);
                    from_above(network.streams[*upstream].outlet(), mix);
                }
            }
        }
    }
}

/// Integral of the conductivity of every cell of a block from 300 K to its temperature, W/m, with its slope, the conductivity, along
/// each axis. In differences of the integral Fourier's law is exact between two cells of one material (Kirchhoff's transformation).
fn potentials(network: &Network, block: &Block, temperatures: &[f64]) -> [Vec<Slope>; 3] {
    let along = |d: usize| {
        let property = &network.properties[block.property[d] as usize];
        let at = |t: &f64| Slope { value: property.integral(*t), slope: property.at(*t) };
        temperatures[block.nodes()].par_iter().with_min_len(CHUNK).map(at).collect::<Vec<_>>()
    };
    let first = along(0);
    // Isotropic materials state one property three times.
    let same = |d: usize| network.properties[block.property[d] as usize] == network.properties[block.property[0] as usize];
    let [second, third] = [1, 2].map(|d| if same(d) { first.clone() } else { along(d) });
    [first, second, third]
}

/// Heat between two neighbouring cells per difference of the integrals of their conductivity, m.
fn shape(gap: Gap) -> f64 {
    gap.area / (gap.length_a + gap.length_b)
}

/// Adds to `y` the heat (W) that leaves each cell by conduction, for a segment of a block with k(T).
fn add_varying(segment: &RowSegment, block: &Block, potentials: &[Vec<Slope>; 3], y: &mut [f64]) {
    segment.each_face(block.cells[0], |at, d, other, _, owner| {
        let (own, next) = (segment.node + at - block.first, other - block.first);
        y[at] += shape(block.faces[d][owner]) * (potentials[d][own].value - potentials[d][next].value);
    });
}

/// Linearised conduction in a block with k(T).
fn varying(network: &Network, block: &Block, temperatures: &[f64]) -> Conduction {
    let potentials = potentials(network, block, temperatures);
    let (mut out, mut into) = ([0, 1, 2].map(|_| vec![0.0; block.len()]), [0, 1, 2].map(|_| vec![0.0; block.len()]));
    for segment in block.segments(block.nodes()) {
        segment.each_face(block.cells[0], |at, d, other, is_next, owner| {
            if is_next {
                let (a, b) = (segment.node + at - block.first, other - block.first);
                let shape = shape(block.faces[d][owner]);
                (out[d][a], into[d][a]) = (shape * potentials[d][a].slope, shape * potentials[d][b].slope);
            }
        });
    }
    Conduction::Varying { out, into }
}
