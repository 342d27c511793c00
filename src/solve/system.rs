//! The residual and the Jacobian of a network.

use super::csr::Csr;
use crate::network::{Load, NONE, Network, StreamState, surface::SurfaceState};
use crate::physics::radiation::SIGMA;

/// Sparsity pattern and constant entries of a network's Jacobian.
#[derive(Debug, Clone)]
pub struct System {
    /// Pattern; its values are the constant conductors' part.
    constant: Csr,
}

impl System {
    /// The pattern of `network`.
    pub fn new(network: &Network) -> Self {
        let pairs = network
            .conductors
            .iter()
            .map(|(a, b, _)| (*a, *b))
            .chain(network.joints.iter().map(|j| (j.a, j.b)))
            .chain(network.radiative.iter().map(|(a, b, _)| (*a, *b)));
        let symmetric = pairs.flat_map(|(a, b)| [(a, b), (b, a)]);
        let water = network.streams.iter().flat_map(move |stream| {
            stream.stations.iter().enumerate().flat_map(move |(k, station)| {
                let own = stream.first_node + k as u32;
                let above: Vec<u32> =
                    if k > 0 { vec![own - 1] } else { stream.upstream.iter().map(|u| network.streams[*u].outlet()).collect() };
                let to_cells = station.cells.iter().flat_map({
                    let above = above.clone();
                    move |(cell, _)| {
                        let cell = *cell as u32;
                        above.clone().into_iter().map(move |w| (cell, w)).chain([(own, cell)])
                    }
                });
                let to_above = above.into_iter().map(move |w| (own, w));
                to_cells.chain(to_above).collect::<Vec<_>>()
            })
        });
        let mut constant = Csr::pattern(network.nodes, symmetric.chain(water));
        for (a, b, g) in &network.conductors {
            add_conductance(&mut constant, *a, *b, *g);
        }
        Self { constant }
    }

    /// Sum of the rounding errors of all nodal residuals, W: a difference of two temperatures is known
    /// to one unit in the last place of either. No iteration brings the residual below it.
    pub fn rounding(&self, network: &Network, streams: &[StreamState], temperatures: &[f64]) -> f64 {
        let t = |n: u32| temperatures[n as usize];
        let linear: f64 = network.conductors.iter().map(|(_, _, g)| g).sum();
        let joints: f64 = network.joints.iter().map(|j| network.joint_state(j, t(j.a), t(j.b)).conductance).sum();
        let water: f64 = network.streams.iter().zip(streams).map(|(s, state)| state.capacity_rate * s.stations.len() as f64).sum();
        let hottest = temperatures.iter().fold(0.0, |m: f64, t| m.max(*t));
        // Each conductance stands in the balances of two nodes.
        2.0 * f64::EPSILON * hottest * (linear + joints + water)
    }

    /// Jacobian of the residual at `temperatures`. With `symmetric` the derivatives of conductances and
    /// the one-way terms of the streams are left out: the matrix the preconditioner is made from.
    pub fn jacobian(&self, network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64], symmetric: bool) -> Csr {
        let mut matrix = self.constant.clone();
        let t = |n: u32| temperatures[n as usize];
        for joint in &network.joints {
            let state = network.joint_state(joint, t(joint.a), t(joint.b));
            add_conductance(&mut matrix, joint.a, joint.b, state.conductance);
            if !symmetric && (state.slope_a != 0.0 || state.slope_b != 0.0) {
                let drop = t(joint.a) - t(joint.b);
                add_derivative(&mut matrix, joint.a, joint.b, state.slope_a * drop, state.slope_b * drop);
            }
        }
        for (a, b, area) in &network.radiative {
            // d/dT of sigma A (Ta^4 - Tb^4); for the preconditioner both at the mean temperature.
            let (mut ga, mut gb) = (4.0 * SIGMA * area * t(*a).powi(3), 4.0 * SIGMA * area * t(*b).powi(3));
            if symmetric {
                (ga, gb) = (f64::midpoint(ga, gb), f64::midpoint(ga, gb));
            }
            add_derivative(&mut matrix, *a, *b, ga, -gb);
        }
        for surface in &network.surfaces {
            let state = surface.state(t(surface.node), &network.properties, load);
            let at = matrix.position(surface.node, surface.node);
            matrix.values[at] += state.slope;
        }
        for (stream, state) in network.streams.iter().zip(streams) {
            for (k, station) in stream.stations.iter().enumerate() {
                let own = stream.first_node + k as u32;
                let exchange = state.exchange[k];
                let above: Vec<(u32, f64)> = if k > 0 {
                    vec![(own - 1, 1.0)]
                } else {
                    stream.upstream.iter().zip(&state.mixture).map(|(u, w)| (network.streams[*u].outlet(), *w)).collect()
                };
                let mut add = |i: u32, j: u32, v: f64| {
                    let at = matrix.position(i, j);
                    matrix.values[at] += v;
                };
                for (cell, share) in &station.cells {
                    add(*cell as u32, *cell as u32, exchange * share);
                    if !symmetric {
                        for (w, mix) in &above {
                            add(*cell as u32, *w, -exchange * share * mix);
                        }
                    }
                }
                if state.capacity_rate > 0.0 {
                    add(own, own, state.capacity_rate);
                    if !symmetric {
                        for (w, mix) in &above {
                            add(own, *w, -(state.capacity_rate - exchange) * mix);
                        }
                        for (cell, share) in &station.cells {
                            add(own, *cell as u32, -exchange * share);
                        }
                    }
                } else {
                    // Water at rest takes the temperature of its wall.
                    add(own, own, 1.0);
                    if !symmetric {
                        for (cell, share) in &station.cells {
                            add(own, *cell as u32, -share);
                        }
                    }
                }
            }
        }
        for (node, _) in &network.fixed {
            hold(&mut matrix, *node);
        }
        matrix
    }

    /// Heat leaving each node minus heat entering it, W: zero in the steady state.
    pub fn residual(&self, network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Vec<f64> {
        let mut r = vec![0.0; network.nodes];
        let t = |n: u32| temperatures[n as usize];
        let mut flow = |a: u32, b: u32, heat: f64| {
            r[a as usize] += heat;
            r[b as usize] -= heat;
        };
        for (a, b, g) in &network.conductors {
            flow(*a, *b, g * (t(*a) - t(*b)));
        }
        for joint in &network.joints {
            let g = network.joint_state(joint, t(joint.a), t(joint.b)).conductance;
            flow(joint.a, joint.b, g * (t(joint.a) - t(joint.b)));
        }
        for (a, b, area) in &network.radiative {
            flow(*a, *b, SIGMA * area * (t(*a).powi(4) - t(*b).powi(4)));
        }
        for surface in &network.surfaces {
            r[surface.node as usize] += surface.state(t(surface.node), &network.properties, load).heat;
        }
        for (source, power) in network.sources.iter().zip(&load.powers) {
            for (node, share) in source {
                r[*node as usize] -= power * share;
            }
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
        r
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

/// State of every surface at given temperatures, in the network's order.
pub fn surface_states<'a>(network: &'a Network, load: &'a Load, temperatures: &'a [f64]) -> impl Iterator<Item = SurfaceState> + 'a {
    network.surfaces.iter().map(move |s| s.state(temperatures[s.node as usize], &network.properties, load))
}

fn add_conductance(matrix: &mut Csr, a: u32, b: u32, g: f64) {
    add_derivative(matrix, a, b, g, -g);
}

/// Adds the derivatives of a heat flow from a to b with respect to both temperatures.
fn add_derivative(matrix: &mut Csr, a: u32, b: u32, da: f64, db: f64) {
    debug_assert!(a != NONE && b != NONE);
    for (i, j, v) in [(a, a, da), (a, b, db), (b, a, -da), (b, b, -db)] {
        let at = matrix.position(i, j);
        matrix.values[at] += v;
    }
}

/// Turns a node's row and column into those of the identity, keeping symmetry.
fn hold(matrix: &mut Csr, node: u32) {
    let range = matrix.starts[node as usize]..matrix.starts[node as usize + 1];
    for at in range {
        let j = matrix.cols[at];
        if j == node {
            matrix.values[at] = 1.0;
        } else {
            matrix.values[at] = 0.0;
            let back = matrix.position(j, node);
            matrix.values[back] = 0.0;
        }
    }
}
