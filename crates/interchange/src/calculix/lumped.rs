//! Lumped nodes, and the nodes between the two halves of a contact: each is one node, with a small tetrahedron that has its
//! temperature. Contacts of places that do not touch end at these, or at faces of cells.

use std::collections::BTreeMap;

use super::bodies::DeckBodies;
use super::crossings::{BOND_CONDUCTIVITY, CONTACT_CONDUCTIVITY, is_crossed};
use super::deck::{Deck, ElementSet, NodeWeights};
use coldplate_describe::machine::Side;
use coldplate_network::NONE;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// Area of the face through which a lumped node radiates, m². Chosen: loads on it are scaled to the area that is stated.
const AREA: f64 = 1e-4;
/// Conductance of a bond between places without half cells, W/(m² K). Chosen: drop across the bond against conditioning.
const BOND: f64 = 1e6;

/// The nodes of the network that are no cells, as far as the deck has them.
pub(super) struct DeckNodes {
    /// Node and element of the deck for each node of the network.
    nodes: BTreeMap<u32, (u32, usize)>,
    /// Nodes of the network that are faces of cells.
    faces: BTreeMap<u32, (usize, Side)>,
}

impl DeckNodes {
    /// Adds the lumped nodes of the machine.
    pub(super) fn new(model: &MeshedMachine, deck: &mut Deck) -> Self {
        let faces = model.network.faces.iter().map(|f| (f.node, (f.cell as usize, Side::ALL[f.side as usize]))).collect();
        let mut lumped = Self { nodes: BTreeMap::new(), faces };
        for n in 0..model.machine.nodes.len() {
            lumped.node((model.mesh.cells + n) as u32, deck);
        }
        lumped
    }

    /// Node of the deck for a node of the network, made where it is new; all corners of its element follow it.
    fn node(&mut self, of: u32, deck: &mut Deck) -> u32 {
        if let Some((node, _)) = self.nodes.get(&of) {
            return *node;
        }
        let leg = (2.0 * AREA).sqrt();
        let own = deck.node([0.0, 0.0, leg]);
        let element = deck.place_of(own, AREA);
        self.nodes.insert(of, (own, element));
        own
    }

    /// The node of a lumped node, with the element on whose first face, of [`Lumped::area`], loads may act.
    pub(super) fn get(&self, of: u32) -> Option<(u32, usize)> {
        self.nodes.get(&of).copied()
    }

    /// Area of the first face of the elements, m².
    pub(super) fn area() -> f64 {
        AREA
    }

    /// Adds the contacts between places that do not touch.
    pub(super) fn contacts(&mut self, model: &MeshedMachine, state: &SteadyState, bodies: &DeckBodies<'_>, deck: &mut Deck) {
        let network = &model.network;
        for group in &network.contacts {
            for index in group.joints.clone().filter(|joint| !is_crossed(model, *joint)) {
                let joint = &network.joints[index];
                let h = network.contact_conductance(joint, &state.solution.temperatures, &state.load.contacts);
                let ends = [(joint.a, joint.property_a), (joint.b, joint.property_b)]
                    .map(|(node, property)| self.end(node, property, bodies, deck));
                let ends = [&ends[0], &ends[1]];
                if h.is_infinite() {
                    deck.wedge(ElementSet::Bond, [0.0; 3], joint.area, BOND_CONDUCTIVITY / BOND, ends);
                } else if h > 0.0 {
                    deck.wedge(ElementSet::Contact, [0.0; 3], joint.area, CONTACT_CONDUCTIVITY / h, ends);
                }
            }
        }
    }

    /// The temperature at one end of a joint: of a node, or of the face of a cell at which its half cell ends.
    fn end(&mut self, node: u32, property: u32, bodies: &DeckBodies<'_>, deck: &mut Deck) -> NodeWeights {
        if let Some((cell, side)) = self.faces.get(&node) {
            let (g, c) = bodies.of_cell(*cell);
            return bodies.face_mean(g, c, *side);
        }
        if property == NONE {
            return vec![(self.node(node, deck), 1.0)];
        }
        let (g, c) = bodies.of_cell(node as usize);
        // Three conductivities belong to a material, one along each axis.
        let axis = property as usize % 3;
        let (low, high) = (Side::ALL[2 * axis], Side::ALL[2 * axis + 1]);
        let grid = bodies.grid(g);
        match (grid.on_side(c, low), grid.on_side(c, high)) {
            (true, false) => bodies.face_mean(g, c, low),
            (false, true) => bodies.face_mean(g, c, high),
            // One cell across: its two faces cannot be told apart.
            _ => bodies.mean(g, c),
        }
    }
}
