//! Whether heat finds a way out: the connected pieces of a network, and whether each of them can give off heat.

use coldplate_base::error::{Error, Result};
use coldplate_network::{BoundaryState, ContactFactors, Load, NONE, Network, Surface};

/// Net heat of a piece that counts as none, as a share of all heat that enters and leaves it. Chosen above rounding.
const NO_HEAT: f64 = 1e-9;
/// Temperature at which a joint is tested for conducting at all, K. Chosen: room temperature.
const ROOM: f64 = 300.0;

/// The connected pieces of a network's solids.
#[derive(Debug, Clone)]
pub(crate) struct ConnectedPieces {
    /// Piece of every solid node, by one of its nodes.
    of: Vec<u32>,
}

impl ConnectedPieces {
    /// Pieces of a network: nodes joined by anything that conducts or radiates belong together.
    pub fn new(network: &Network) -> Self {
        Self::with(network, &ContactFactors::default())
    }

    /// Pieces of a network with factors on the conductances of contacts.
    fn with(network: &Network, factors: &ContactFactors) -> Self {
        let mut root: Vec<u32> = (0..network.solids as u32).collect();
        // The cells of a block are one piece.
        for block in &network.blocks {
            root[block.nodes()].fill(block.first as u32);
        }
        let joints = network.joints.iter().filter(|j| network.joint_state(j, ROOM, ROOM, factors).conductance != 0.0).map(|j| (j.a, j.b));
        for (a, b) in joints.chain(network.radiative.iter().map(|(a, b, _)| (*a, *b))) {
            let (a, b) = (find(&mut root, a), find(&mut root, b));
            root[a as usize] = b;
        }
        for node in 0..root.len() as u32 {
            root[node as usize] = find(&mut root, node);
        }
        Self { of: root }
    }

    /// Whether each piece, by its node, can give off heat at a load; without a load, whether it can at any.
    fn outlets(&self, network: &Network, load: Option<&Load>) -> Vec<bool> {
        let mut open = vec![false; self.of.len()];
        let lets_out = |s: &&Surface| {
            let gas = s.gas_area > 0.0 && load.is_none_or(|load| load.gas > 0.0);
            let law = |l: usize| match load.map(|load| load.boundaries[l]) {
                Some(BoundaryState::Film(h, _)) => h > 0.0,
                Some(BoundaryState::Radiation(e, _)) => e > 0.0,
                Some(BoundaryState::Flux(_)) => false,
                Some(BoundaryState::Temperature(_) | BoundaryState::FreeConvection(..)) => true,
                // The second place among a surface's laws is a flux, whose heat is prescribed.
                None => s.laws[1] != l as u32,
            };
            s.emissive > 0.0 || gas || s.boundaries().any(law)
        };
        let faces = network.surfaces.iter().filter(lets_out).map(|s| s.node);
        let held = network.fixed.iter().map(|(node, _)| *node);
        let flowing = network.streams.iter().filter(|s| load.is_none_or(|load| load.flows[s.circuit] > 0.0));
        let wet = flowing.flat_map(|s| s.stations.iter().flat_map(|st| st.cells.iter().map(|(cell, _)| *cell as u32)));
        for node in faces.chain(held).chain(wet) {
            open[self.of[node as usize] as usize] = true;
        }
        open
    }

    /// Names of the parts and nodes that nothing leads heat away from, at any condition.
    pub(crate) fn shut(&self, network: &Network) -> Vec<String> {
        let open = self.outlets(network, None);
        self.names(network, |piece| !open[piece as usize])
    }

    fn names(&self, network: &Network, wanted: impl Fn(u32) -> bool) -> Vec<String> {
        let mut groups: Vec<u32> =
            self.of.iter().zip(&network.group).filter(|(p, g)| **g != NONE && wanted(**p)).map(|(_, g)| *g).collect();
        groups.sort_unstable();
        groups.dedup();
        groups.into_iter().map(|g| network.groups[g as usize].clone()).collect()
    }

    /// Refuses a load whose heat cannot leave: without a way out there is no steady state, or any will do.
    ///
    /// # Errors
    /// A piece can give no heat off; the error names its parts and the heat.
    pub fn check(&self, network: &Network, load: &Load) -> Result<()> {
        if load.contacts.has_open() {
            return Self::with(network, &load.contacts).stuck(network, load);
        }
        self.stuck(network, load)
    }

    fn stuck(&self, network: &Network, load: &Load) -> Result<()> {
        let open = self.outlets(network, Some(load));
        if self.of.iter().all(|piece| open[*piece as usize]) {
            return Ok(());
        }
        let (mut net, mut gross) = (vec![0.0; self.of.len()], vec![0.0; self.of.len()]);
        let room = vec![ROOM; network.nodes];
        for (source, power) in network.sources.iter().zip(&load.powers) {
            for (node, heat) in source.heats(*power, &room) {
                let piece = self.of[node as usize] as usize;
                net[piece] += heat;
                gross[piece] += f64::abs(heat);
            }
        }
        for surface in &network.surfaces {
            for l in surface.boundaries() {
                if let BoundaryState::Flux(q) = load.boundaries[l] {
                    let piece = self.of[surface.node as usize] as usize;
                    net[piece] += q * surface.area;
                    gross[piece] += f64::abs(q * surface.area);
                }
            }
        }
        let is_stuck = |piece: &u32| {
            let p = *piece as usize;
            !open[p] && f64::abs(net[p]) > NO_HEAT * gross[p]
        };
        let cut_off = || self.of.iter().copied().find(|piece| !open[*piece as usize]);
        let Some(piece) = self.of.iter().copied().find(is_stuck).or_else(cut_off) else { return Ok(()) };
        let names = self.names(network, |own| own == piece).join("', '");
        if !is_stuck(&piece) {
            return Err(Error::numerics(format!(
                "'{names}' is joined to nothing and takes no heat in: its steady temperature could be any"
            ))
            .help("join it by a contact, let it radiate or give it a boundary; `simulate` keeps the temperature it begins with"));
        }
        let watts = net[piece as usize];
        Err(Error::numerics(format!("{:.4} W have no way out of '{names}': there is no steady state", watts)).help(
            "give it a coolant that flows, a boundary with a film or a temperature, an emissivity, or a contact with a part that has one; \
             `simulate` follows how its temperature changes",
        ))
    }
}

fn find(root: &mut [u32], mut node: u32) -> u32 {
    while root[node as usize] != node {
        root[node as usize] = root[root[node as usize] as usize];
        node = root[node as usize];
    }
    node
}
