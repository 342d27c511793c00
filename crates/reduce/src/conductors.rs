//! Conductors that follow the temperature: heat and slopes of each, of a full network or of a sampled one.

use rayon::prelude::*;

use coldplate_network::{Load, NONE, Network};
use coldplate_physics::radiation::SIGMA;

/// A conductor at given temperatures.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Conductor {
    /// Heat from its first end to its second, or to the outside, W.
    pub heat: f64,
    /// Derivative of the heat with respect to the temperature at the first end, W/K.
    pub slope_a: f64,
    /// Derivative of the heat with respect to the temperature at the second end, sign turned, W/K.
    pub slope_b: f64,
    /// Temperatures of its ends, K; 0 outside.
    pub ends: [f64; 2],
}

impl Conductor {
    /// Deviation of the heat from the tangent that was taken at other temperatures, W.
    pub fn beyond(&self, tangent: &Self) -> f64 {
        let [a, b] = [0, 1].map(|side| self.ends[side] - tangent.ends[side]);
        self.heat - tangent.heat - tangent.slope_a * a + tangent.slope_b * b
    }
}

/// End of a conductor: node, and the reach that its temperature is taken at ([`NONE`]: the node itself).
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// Node, or [`NONE`] for the outside.
    pub node: u32,
    /// Index into the network's reaches, or [`NONE`].
    pub reach: u32,
}

/// End outside the network.
const OUT: End = End { node: NONE, reach: NONE };

/// The two ends of every conductor: open faces, joints, radiative conductors (with one end: the emission of a node), shares of
/// sources.
pub fn ends(network: &Network) -> Vec<[End; 2]> {
    let at = |node: u32| End { node, reach: NONE };
    let surfaces = network.surfaces.iter().map(|s| [at(s.node), OUT]);
    let joints = network.joints.iter().map(|j| [End { node: j.a, reach: j.reach[0] }, End { node: j.b, reach: j.reach[1] }]);
    let radiative = network.radiative.iter().map(|(a, b, _)| [at(*a), at(*b)]);
    let shares = network.sources.iter().flat_map(|s| s.shares.iter().map(|(node, _)| [at(*node), OUT]));
    surfaces.chain(joints).chain(radiative).chain(shares).collect()
}

/// All conductors at temperatures of the nodes (K), in the order of [`ends`].
pub fn conductors(network: &Network, load: &Load, t: &[f64]) -> Vec<Conductor> {
    let of_surface = |surface: &coldplate_network::Surface| {
        let own = t[surface.node as usize];
        let state = surface.state(own, &network.properties, load);
        Conductor { heat: state.heat, slope_a: state.slope, slope_b: 0.0, ends: [own, 0.0] }
    };
    let mut found: Vec<Conductor> = network.surfaces.par_iter().with_min_len(4096).map(of_surface).collect();
    found.extend(network.joints.iter().map(|joint| {
        let (ta, tb) = network.joint_ends(joint, t);
        let state = network.joint_state(joint, ta, tb, &load.contacts);
        Conductor { heat: state.conductance * (ta - tb), slope_a: state.along_a, slope_b: state.along_b, ends: [ta, tb] }
    }));
    found.extend(network.radiative.iter().map(|(a, b, area)| {
        let (ta, tb) = (t[*a as usize], if *b == NONE { 0.0 } else { t[*b as usize] });
        Conductor {
            heat: SIGMA * area * (ta.powi(4) - tb.powi(4)),
            slope_a: 4.0 * SIGMA * area * ta.powi(3),
            slope_b: 4.0 * SIGMA * area * tb.powi(3),
            ends: [ta, tb],
        }
    }));
    for (source, power) in network.sources.iter().zip(&load.powers) {
        let all = source.heats(*power, t).zip(source.slopes(*power, t));
        let of = |((node, heat), (_, slope)): ((u32, f64), (u32, f64))| Conductor {
            heat: -heat,
            slope_a: -slope,
            slope_b: 0.0,
            ends: [t[node as usize], 0.0],
        };
        found.extend(all.map(of));
    }
    found
}
