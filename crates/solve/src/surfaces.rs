//! States outside the blocks at given temperatures: of open faces, and of joints between two nodes.

use rayon::prelude::*;

use super::csr::CHUNK;
use coldplate_network::{Joint, JointState, Load, Network, Surface, surface::SurfaceState};

/// States outside the blocks at given temperatures, in the network's order.
#[derive(Debug, Clone, Default)]
pub struct SurfaceStates {
    /// State of every surface.
    pub surfaces: Vec<SurfaceState>,
    /// State of every joint, with the difference of the temperatures at its ends, K.
    pub joints: Vec<(JointState, f64)>,
}

impl SurfaceStates {
    /// States at temperatures of all nodes, K.
    pub fn new(network: &Network, load: &Load, temperatures: &[f64]) -> Self {
        let mut found = Self::default();
        found.renew(network, load, temperatures);
        found
    }

    /// States at other temperatures, in the memory of these.
    pub(crate) fn renew(&mut self, network: &Network, load: &Load, temperatures: &[f64]) {
        let of_joint = |joint: &Joint| {
            let (ta, tb) = network.joint_ends(joint, temperatures);
            (network.joint_state(joint, ta, tb, &load.contacts), ta - tb)
        };
        let of_surface = |s: &Surface| s.state(temperatures[s.node as usize], &network.properties, load);
        network.surfaces.par_iter().with_min_len(CHUNK).map(of_surface).collect_into_vec(&mut self.surfaces);
        network.joints.par_iter().with_min_len(CHUNK).map(of_joint).collect_into_vec(&mut self.joints);
    }
}

/// State of every surface at given temperatures, in the network's order.
pub(crate) fn surface_states(network: &Network, load: &Load, temperatures: &[f64]) -> Vec<SurfaceState> {
    let state = |s: &Surface| s.state(temperatures[s.node as usize], &network.properties, load);
    network.surfaces.par_iter().with_min_len(CHUNK).map(state).collect()
}
