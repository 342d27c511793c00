//! From modes and solved states to a reduced network.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::conductors::{Conductor, End, conductors, ends};
use super::cubature::{Cubature, sample};
use super::interpolation::{EXACT, OperatorFamily};
use super::network_parts::NetworkParts;
use super::reduced_network::{ReducedContact, ReducedNetwork};
use super::shapes::Shapes;
use super::stations::Groups;
use coldplate_base::random::Random;
use coldplate_network::{ContactFactors, EndInterpolation, HeatSource, Joint, Load, NONE, Network, SensorTerm, StreamState};
use coldplate_solve::csr::dot;
use coldplate_solve::entering_temperature;

/// Limit on the size of the training matrix, equations times candidate conductors, a count (256 MB in double precision). Above it
/// only a random part of the conductors is considered, at least [`FEWEST_CANDIDATES`]. Chosen: memory and time against the choice of
/// conductors.
const NUMBERS: usize = 32_000_000;
/// Fewest candidate conductors, a count. Chosen: fewer no longer represent all conductors of a fine mesh.
const FEWEST_CANDIDATES: usize = 12_000;
/// Most chosen conductors per mode, a count. Chosen: more sample better, but each is evaluated in every step of an
/// answer.
const MOST_PER_MODE: usize = 12;
/// Tolerance for the heats of emitting nodes, as a factor on the tolerance for other conductors, dimensionless.
/// Chosen: smaller evaluates more nodes of an enclosure in every answer.
const EMITTED: f64 = 0.01;
/// Cutoff for directions of the states' heats, as a share of the largest: smaller ones are left out of the training
/// equations. Chosen near rounding of the eigenvalues, which are the squares.
const CUTOFF: f64 = 1e-7;

/// A solved state with the numbers that training needs of it.
#[derive(Debug, Clone)]
pub(crate) struct Snapshot {
    /// Temperatures of the solids less those of the middle, K; zero at held nodes.
    pub rise: Vec<f64>,
    /// The conductors of [`NetworkParts::rest`] at the temperatures of the middle.
    pub tangents: Vec<Conductor>,
    /// Deviation of each conductor's heat from its tangent, W.
    pub beyond: Vec<f64>,
    /// State of each stream.
    pub streams: Vec<StreamState>,
    /// Temperature of the water that enters each stream, K.
    pub entering: Vec<f64>,
    /// Readings of all sensors, K.
    pub readings: Vec<f64>,
}

impl Snapshot {
    /// Snapshot of a state of `network`, whose own parts have the conductors `rest`; `center` are the temperatures of
    /// the middle.
    pub fn of(network: &Network, rest: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64], center: &[f64]) -> Self {
        let mut rise: Vec<f64> = temperatures[..network.solids].iter().zip(center).map(|(t, c)| t - c).collect();
        let mut middle = center.to_vec();
        for (node, index) in &network.fixed {
            rise[*node as usize] = 0.0;
            middle[*node as usize] = load.fixed[*index as usize];
        }
        let readings = network.sensors.iter().map(|s| s.read(temperatures, load)).collect();
        let tangents = conductors(rest, load, &middle);
        let now = conductors(rest, load, temperatures);
        let beyond = now.iter().zip(&tangents).map(|(now, tangent)| now.beyond(tangent));
        Self {
            beyond: beyond.collect(),
            rise,
            tangents,
            entering: (0..streams.len()).map(|s| entering_temperature(network, load, streams, s, temperatures)).collect(),
            streams: streams.to_vec(),
            readings,
        }
    }
}

/// Parts that reduced networks are assembled from.
#[derive(Debug)]
pub(crate) struct Assembly<'a> {
    /// The full network and its parts.
    pub network: &'a Network,
    /// See `network`.
    pub parts: &'a NetworkParts,
    /// The load in the middle of the ranges.
    pub load: &'a Load,
    /// Temperatures of all nodes in the middle of the ranges, K.
    pub center: &'a [f64],
    /// Accuracy wanted of the readings, K.
    pub accuracy: f64,
}

/// Accuracy with which a reduced network samples conductors and stations, which modes alone do not reduce.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sampling {
    /// Residual that the sampled conductors may leave, as a share of the deviations of all conductors from their
    /// tangents.
    pub tolerance: f64,
    /// Share of the accuracy that may be lost by putting stations of channels together.
    pub together: f64,
}

impl Assembly<'_> {
    /// Nodes of the solids whose temperature is not held.
    pub fn free(&self) -> Vec<usize> {
        let held: std::collections::HashSet<u32> = self.network.fixed.iter().map(|(node, _)| *node).collect();
        (0..self.network.solids).filter(|node| !held.contains(&(*node as u32))).collect()
    }

    /// Whether so many modes represent every state. Nothing is left then that fewer could show, and nothing is sampled.
    pub fn is_whole(&self, modes: usize) -> bool {
        modes >= self.free().len()
    }

    /// The reduced network on these modes, trained on these states. The first `steady` states are steady: stations are put together
    /// by their losses alone, because over time less accuracy is wanted.
    pub fn level(&self, modes: &[Vec<f64>], snapshots: &[Snapshot], steady: usize, sampling: Sampling) -> ReducedNetwork {
        let (network, rest, n) = (self.network, &self.parts.rest, modes.len());
        let ends = ends(rest);
        let shapes = Shapes::of(self.parts, modes, &ends);
        let chosen = self.sample(&shapes, snapshots, sampling.tolerance);
        let cutoff = Some(EMITTED * sampling.tolerance).filter(|_| !self.is_whole(n));
        let emitting = emitting(&shapes, snapshots, cutoff);
        let mut tangents = self.tangents(&shapes, snapshots);
        // The sampled network keeps the order of the conductors.
        let mut all: Vec<usize> = (chosen.chosen.iter().copied())
            .chain(emitting.points.iter().copied())
            .chain(tangents.iter().flat_map(|f| f.points.clone()))
            .collect();
        all.sort_unstable();
        all.dedup();
        let place = |c: &usize| all.binary_search(c).unwrap_or(0);
        tangents.iter_mut().for_each(|f| f.points = f.points.iter().map(place).collect());
        let mut weights = vec![0.0; all.len()];
        chosen.chosen.iter().zip(&chosen.weights).for_each(|(c, w)| weights[place(c)] = *w);
        let (readings, base) = self.readings(modes);
        let along = self.along(modes, &snapshots[..steady], &readings, sampling.together * self.accuracy);
        let (sampled, rows, center) = self.sampled(modes, &all, &along);
        let column = |wide: &[f64]| -> Vec<f64> {
            let image = self.parts.conduction(wide, self.load);
            modes.iter().map(|other| dot(other, &image[..network.solids])).collect()
        };
        let of_mode = |mode: &Vec<f64>| {
            let mut wide = vec![0.0; network.nodes];
            wide[..network.solids].copy_from_slice(mode);
            column(&wide)
        };
        let mut columns: Vec<Vec<f64>> = modes.par_iter().map(of_mode).collect();
        columns.push(column(self.center));
        let mut patterns = DMatrix::from_fn(n, all.len(), |i, e| weights[e] * shapes.at(i, all[e]));
        for (k, c) in emitting.points.iter().enumerate() {
            let mut pattern = DMatrix::zeros(n, 1);
            emitting.add((0..=k).map(|other| if other == k { 1.0 } else { 0.0 }), &mut pattern);
            patterns.set_column(place(c), &pattern.column(0));
        }
        let at_ends: [DMatrix<f64>; 2] = [0, 1].map(|side| {
            let columns: Vec<DVector<f64>> = all.iter().map(|c| self.end(modes, ends[*c][side])).collect();
            DMatrix::from_fn(n, all.len(), |i, e| columns[e][i])
        });
        let mut conduction = DMatrix::from_fn(n, n + 1, |i, j| columns[j][i]);
        let mut contacts = self.contacts(modes);
        for contact in &mut contacts {
            contact.usual = contact.conductances(network, self.load).collect();
            contact.family.add(contact.usual.iter().copied(), &mut conduction);
        }
        let walls: Vec<usize> = sampled.streams.iter().flat_map(|s| s.stations.iter().map(|k| k.cells[0].0)).collect();
        ReducedNetwork {
            center_held: self.load.fixed.clone(),
            conduction,
            capacity: self.capacity(modes),
            stored: self.stored(modes),
            held: self.held(modes),
            sources: self.sources(modes),
            contacts,
            rings: self.rings(modes, snapshots, &along),
            tangents,
            patterns,
            ends: at_ends,
            walls: DMatrix::from_fn(n, walls.len(), |i, k| rows[(walls[k], i)]),
            tilts: self.tilts(modes, &along),
            drifts: self.drifts(modes, snapshots, &along),
            network: sampled,
            center,
            rows,
            readings,
            base,
        }
    }

    /// Heats and slopes of the conductors at the temperatures of the middle, as families.
    fn tangents(&self, shapes: &Shapes<'_>, snapshots: &[Snapshot]) -> [OperatorFamily; 3] {
        let (modes, ends) = (shapes.modes, shapes.ends);
        let count = ends.len();
        let left = |e: usize| DVector::from_fn(modes.len(), |i, _| shapes.at(i, e));
        let samples = |of: fn(&Conductor) -> f64| DMatrix::from_fn(count, snapshots.len(), |e, k| of(&snapshots[k].tangents[e]));
        let slopes = |side: usize| {
            move |weights: &[f64]| {
                let mut sum = DMatrix::zeros(modes.len(), modes.len());
                for (e, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                    sum.ger(*weight, &left(e), &self.end(modes, ends[e][side]), 1.0);
                }
                sum
            }
        };
        let heats = |weights: &[f64]| {
            let mut sum = DMatrix::zeros(modes.len(), 1);
            for (e, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                sum.column_mut(0).axpy(*weight, &left(e), 1.0);
            }
            sum
        };
        [
            OperatorFamily::new(&samples(|c| c.heat), EXACT, heats),
            OperatorFamily::new(&samples(|c| c.slope_a), EXACT, slopes(0)),
            OperatorFamily::new(&samples(|c| c.slope_b), EXACT, slopes(1)),
        ]
    }

    pub(super) fn at(&self, modes: &[Vec<f64>], node: u32) -> DVector<f64> {
        DVector::from_iterator(modes.len(), modes.iter().map(|m| m[node as usize]))
    }

    /// Derivatives of the temperature at an end of a conductor with respect to the amplitudes.
    fn end(&self, modes: &[Vec<f64>], end: End) -> DVector<f64> {
        if end.node == NONE {
            return DVector::zeros(modes.len());
        }
        let own = self.at(modes, end.node);
        let Some(reach) = self.network.reaches.get(end.reach as usize) else { return own };
        reach.nodes.iter().zip(reach.shares).fold(own.clone(), |sum, (other, share)| sum + (self.at(modes, *other) - &own) * share)
    }

    fn capacity(&self, modes: &[Vec<f64>]) -> DMatrix<f64> {
        let weighted =
            |mode: &Vec<f64>| -> Vec<f64> { (0..mode.len()).map(|i| mode[i] * self.network.capacity_at(i, self.center[i])).collect() };
        let images: Vec<Vec<f64>> = modes.par_iter().map(weighted).collect();
        DMatrix::from_fn(modes.len(), modes.len(), |i, j| dot(&modes[i], &images[j]))
    }

    /// Heat stored in the modes: if everything is a kelvin warmer (J/K), and at the temperatures of the middle (J).
    fn stored(&self, modes: &[Vec<f64>]) -> DMatrix<f64> {
        let of = |mode: &Vec<f64>, column: usize| -> f64 {
            let capacity = |i: usize| self.network.capacity_at(i, self.center[i]);
            (0..mode.len()).map(|i| mode[i] * capacity(i) * if column == 0 { 1.0 } else { self.center[i] }).sum()
        };
        DMatrix::from_fn(modes.len(), 2, |i, column| of(&modes[i], column))
    }

    fn held(&self, modes: &[Vec<f64>]) -> DMatrix<f64> {
        let column = |index: u32| {
            let mut wide = vec![0.0; self.network.nodes];
            let own = self.network.fixed.iter().filter(|(_, i)| *i == index);
            own.for_each(|(node, _)| wide[*node as usize] = 1.0);
            if wide.iter().all(|v| *v == 0.0) {
                return DVector::zeros(modes.len());
            }
            let image = self.parts.conduction(&wide, self.load);
            DVector::from_iterator(modes.len(), modes.iter().map(|m| dot(m, &image[..m.len()])))
        };
        let columns: Vec<DVector<f64>> = (0..self.load.fixed.len() as u32).map(column).collect();
        DMatrix::from_fn(modes.len(), columns.len(), |i, j| columns[j][i])
    }

    fn sources(&self, modes: &[Vec<f64>]) -> DMatrix<f64> {
        let sources = &self.parts.sources;
        let share = |i: usize, s: usize| sources[s].shares.iter().map(|(node, share)| share * modes[i][*node as usize]).sum();
        DMatrix::from_fn(modes.len(), sources.len(), share)
    }

    fn contacts(&self, modes: &[Vec<f64>]) -> Vec<ReducedContact> {
        let n = modes.len();
        let one = |(contact, joints): &(usize, Vec<Joint>)| {
            let operator = |weights: &[f64]| {
                let mut sum = DMatrix::zeros(n, n + 1);
                for (joint, weight) in joints.iter().zip(weights) {
                    let left = self.at(modes, joint.a) - self.at(modes, joint.b);
                    let [a, b] =
                        [(joint.a, joint.reach[0]), (joint.b, joint.reach[1])].map(|(node, reach)| self.end(modes, End { node, reach }));
                    sum.columns_mut(0, n).ger(*weight, &left, &(a - b), 1.0);
                    let (ta, tb) = self.network.joint_ends(joint, self.center);
                    sum.column_mut(n).axpy(weight * (ta - tb), &left, 1.0);
                }
                sum
            };
            let family = OperatorFamily::new(&conductances(self.network, *contact, joints), EXACT, operator);
            let joints = family.points.iter().map(|p| Joint { reach: [NONE; 2], ..joints[*p] }).collect();
            ReducedContact { joints, usual: Vec::new(), family }
        };
        self.parts.contacts.par_iter().map(one).collect()
    }

    /// Modes in the readings, and the readings' part from the solids' temperatures of the middle, K.
    fn readings(&self, modes: &[Vec<f64>]) -> (DMatrix<f64>, Vec<f64>) {
        let is_held: std::collections::HashSet<u32> = self.network.fixed.iter().map(|(node, _)| *node).collect();
        let own = |sensor: &SensorTerm| -> Vec<(u32, f64)> {
            let is_solid = |n: u32| (n as usize) < self.network.solids && !is_held.contains(&n);
            sensor.weights.iter().copied().filter(|(n, _)| is_solid(*n)).collect()
        };
        let weights: Vec<Vec<(u32, f64)>> = self.network.sensors.iter().map(own).collect();
        let row = |s: usize, i: usize| weights[s].iter().map(|(n, w)| w * modes[i][*n as usize]).sum();
        let matrix = DMatrix::from_fn(weights.len(), modes.len(), row);
        (matrix, weights.iter().map(|own| own.iter().map(|(n, w)| w * self.center[*n as usize]).sum()).collect())
    }

    /// Sample of the conductors; emitting nodes are not among them.
    fn sample(&self, shapes: &Shapes<'_>, snapshots: &[Snapshot], tolerance: f64) -> Cubature {
        let (modes, ends) = (shapes.modes, shapes.ends);
        if ends.is_empty() || modes.is_empty() {
            return Cubature::default();
        }
        if self.is_whole(modes.len()) {
            let chosen: Vec<usize> = (0..ends.len()).filter(|e| !shapes.emitting.contains(e)).collect();
            return Cubature { weights: vec![1.0; chosen.len()], chosen };
        }
        // Heats of all states as combinations of few directions.
        let (count, states) = (ends.len(), snapshots.len());
        let heats = DMatrix::from_fn(count, states, |e, k| if shapes.emitting.contains(&e) { 0.0 } else { snapshots[k].beyond[e] });
        let decomposed = heats.tr_mul(&heats).symmetric_eigen();
        let largest = decomposed.eigenvalues.max();
        let kept: Vec<usize> = (0..states).filter(|i| decomposed.eigenvalues[*i] > CUTOFF * CUTOFF * largest).collect();
        let directions = &heats * decomposed.eigenvectors.select_columns(kept.iter());
        let column = |e: usize, to: &mut [f64]| {
            for i in 0..modes.len() {
                let shape = shapes.at(i, e);
                for (p, to) in to[i * kept.len()..(i + 1) * kept.len()].iter_mut().enumerate() {
                    *to = shape * directions[(e, p)];
                }
            }
        };
        let equations = modes.len() * kept.len();
        // If only enclosures are nonlinear, nothing is left to sample.
        if equations == 0 {
            return Cubature::default();
        }
        // If there are very many conductors, a random part of them are candidates; the goal still counts all.
        let mut candidates: Vec<usize> = (0..count).filter(|e| !shapes.emitting.contains(e)).collect();
        let (sampled, most) = (candidates.len(), (NUMBERS / equations).max(FEWEST_CANDIDATES));
        if sampled > most {
            candidates = Random::new(1).permutation(sampled).into_iter().map(|k| candidates[k]).collect();
            candidates.truncate(most);
            candidates.sort_unstable();
        }
        let mut forces = DMatrix::zeros(equations, candidates.len());
        forces.as_mut_slice().par_chunks_mut(equations).zip(&candidates).for_each(|(to, e)| column(*e, to));
        let goal = if candidates.len() == sampled {
            forces.column_sum()
        } else {
            let mut goal = vec![0.0; equations];
            let mut one = vec![0.0; equations];
            for e in 0..count {
                column(e, &mut one);
                goal.iter_mut().zip(&one).for_each(|(g, o)| *g += o);
            }
            DVector::from_vec(goal)
        };
        let mut found = sample(&forces, &goal, tolerance, equations.min(candidates.len()).min(MOST_PER_MODE * modes.len()));
        found.chosen.iter_mut().for_each(|c| *c = candidates[*c]);
        found
    }

    /// The network of the chosen conductors, the channels' walls and the water, and the modes at its solid nodes.
    fn sampled(&self, modes: &[Vec<f64>], chosen: &[usize], along: &[Groups]) -> (Network, DMatrix<f64>, DVector<f64>) {
        let rest = &self.parts.rest;
        let mut nodes = Nodes { from: Vec::new(), to: HashMap::new() };
        let mut own = Network {
            properties: rest.properties.clone(),
            contacts: rest.contacts.clone(),
            circuits: rest.circuits.clone(),
            groups: rest.groups.clone(),
            sources: rest.sources.iter().map(|s| HeatSource { shares: Vec::new(), law: s.law.clone() }).collect(),
            sensor_names: rest.sensor_names.clone(),
            measurands: rest.measurands.clone(),
            ..Network::default()
        };
        own.contacts.iter_mut().for_each(|group| group.joints = 0..0);
        keep(&mut own, rest, &mut nodes, chosen);
        // Held nodes that sensors read are kept too.
        let held: HashMap<u32, u32> = rest.fixed.iter().copied().collect();
        for (node, _) in rest.sensors.iter().flat_map(|s| &s.weights) {
            if held.contains_key(node) {
                nodes.of(*node);
            }
        }
        own.fixed = nodes.from.iter().enumerate().filter_map(|(i, n)| Some((i as u32, *held.get(n)?))).collect();
        own.group = nodes.from.iter().map(|n| rest.group[*n as usize]).collect();
        own.capacity = vec![0.0; nodes.from.len()];
        let mut rows: Vec<DVector<f64>> = nodes.from.iter().map(|n| self.at(modes, *n)).collect();
        let mut center: Vec<f64> = nodes.from.iter().map(|n| self.center[*n as usize]).collect();
        // One node per group of stations of channel wall, then the water.
        let mut streams = rest.streams.clone();
        for (stream, groups) in streams.iter_mut().zip(along) {
            (stream.stations, stream.water_weights) = (groups.stations.clone(), groups.water_weights.clone());
            for station in &mut stream.stations {
                rows.push(self.wall(modes, station));
                center.push(self.middle(station));
                own.group.push(station.cells.first().map_or(NONE, |(cell, _)| rest.group[*cell]));
                own.capacity.push(0.0);
                station.cells = vec![(rows.len() - 1, 1.0)];
            }
        }
        own.solids = rows.len();
        own.nodes = own.solids;
        for (stream, groups) in streams.iter_mut().zip(along) {
            for g in 0..groups.len() {
                nodes.to.insert(stream.first_node + groups.last(g) as u32, (own.nodes + g) as u32);
            }
            stream.first_node = own.nodes as u32;
            own.nodes += stream.stations.len();
        }
        own.streams = streams;
        let is_kept = |n: u32| (n as usize) >= rest.solids || held.contains_key(&n);
        for sensor in &rest.sensors {
            let weights = sensor.weights.iter().filter(|(n, _)| is_kept(*n)).map(|(n, w)| (nodes.to[n], *w)).collect();
            own.sensors.push(sensor.over(weights));
        }
        let matrix = DMatrix::from_fn(rows.len(), modes.len(), |r, c| rows[r][c]);
        (own, matrix, DVector::from_vec(center))
    }
}

/// Adds the chosen conductors of a network to its sampled one.
fn keep(own: &mut Network, rest: &Network, nodes: &mut Nodes, chosen: &[usize]) {
    let (joints, radiative) = (rest.surfaces.len(), rest.surfaces.len() + rest.joints.len());
    let shares = radiative + rest.radiative.len();
    for c in chosen.iter().copied() {
        if c < joints {
            let surface = rest.surfaces[c];
            own.surfaces.push(coldplate_network::Surface { node: nodes.of(surface.node), ..surface });
        } else if c < radiative {
            let joint = rest.joints[c - joints];
            let reach = joint.reach.map(|r| match rest.reaches.get(r as usize) {
                Some(reach) => {
                    own.reaches.push(EndInterpolation { nodes: reach.nodes.map(|n| nodes.of(n)), shares: reach.shares });
                    own.reaches.len() as u32 - 1
                }
                None => NONE,
            });
            own.joints.push(Joint { a: nodes.of(joint.a), b: nodes.of(joint.b), reach, ..joint });
        } else if c < shares {
            let (a, b, area) = rest.radiative[c - radiative];
            own.radiative.push((nodes.of(a), if b == NONE { NONE } else { nodes.of(b) }, area));
        } else {
            let mut left = c - shares;
            for (s, source) in rest.sources.iter().enumerate() {
                if left < source.shares.len() {
                    let (node, share) = source.shares[left];
                    own.sources[s].shares.push((nodes.of(node), share));
                    break;
                }
                left -= source.shares.len();
            }
        }
    }
}

/// Heat that nodes emit beyond its tangent, as a family of conductors. A sample with non-negative weights would not do: one node's
/// heat reaches many others, and only all nodes together show that nothing is exchanged between equally warm ones.
/// Without a `cutoff` every node is evaluated.
fn emitting(shapes: &Shapes<'_>, snapshots: &[Snapshot], cutoff: Option<f64>) -> OperatorFamily {
    let Shapes { emitted, emitting, .. } = shapes;
    let beyond = DMatrix::from_fn(emitting.len(), snapshots.len(), |e, k| snapshots[k].beyond[emitting.start + e]);
    let pattern =
        |weights: &[f64]| DMatrix::from_column_slice(emitted.ncols(), 1, emitted.tr_mul(&DVector::from_column_slice(weights)).as_slice());
    let mut family = match cutoff {
        Some(cutoff) => OperatorFamily::new(&beyond, cutoff, pattern),
        None => OperatorFamily::every(emitting.len(), pattern),
    };
    family.points.iter_mut().for_each(|p| *p += emitting.start);
    family
}

/// Nodes of the full network that are in the sampled one.
struct Nodes {
    from: Vec<u32>,
    to: HashMap<u32, u32>,
}

impl Nodes {
    fn of(&mut self, node: u32) -> u32 {
        *self.to.entry(node).or_insert_with(|| {
            self.from.push(node);
            self.from.len() as u32 - 1
        })
    }
}

/// Conductances of a contact's joints at some factors on its own: a row per joint.
fn conductances(network: &Network, contact: usize, joints: &[Joint]) -> DMatrix<f64> {
    let factors: Vec<f64> = (0..13).map(|i| 0.01 * 10f64.powf(f64::from(i) / 3.0)).collect();
    let mut probe = Network { properties: network.properties.clone(), contacts: network.contacts.clone(), ..Network::default() };
    let mut samples = DMatrix::zeros(joints.len(), factors.len());
    for (column, factor) in factors.iter().enumerate() {
        probe.contacts[contact].scale = network.contacts[contact].scale * factor;
        for (row, joint) in joints.iter().enumerate() {
            let free = Joint { reach: [NONE; 2], ..*joint };
            samples[(row, column)] = probe.joint_state(&free, 300.0, 300.0, &ContactFactors::default()).conductance;
        }
    }
    samples
}
