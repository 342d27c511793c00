//! A machine at one condition as an input deck for CalculiX, on our own mesh.
//!
//! Cells become hexahedra (C3D8; wedges at the axis of a solid cylinder) with nodes at their corners. Connections between the nodes of
//! our network are written as elements that any finite-element program knows:
//!
//! - Between touching cells of two blocks a thin wedge (C3D6) conducts from face to face. Each of its ends has the temperature of one
//!   face at the middle of the shared area, by linear equations over the face's nodes, so that the meshes of parts need not match. Its
//!   conductance is that of contact and area; for bonded blocks it is a hundred times that of the two half cells beside the face.
//! - Water is a network of fluid elements (D). Each station of a channel takes heat through the film on one face of a small
//!   tetrahedron (C3D4) that has the mean temperature of the channel's wall there. CalculiX finds the water's temperatures.
//!   Film coefficients and mass flows come from our own solution, since no correlation for them is in CalculiX.
//! - A lumped node is one node; contacts of places that do not touch are wedges too, between faces of cells and such nodes.
//! - A sensor is the corner of such a tetrahedron, at the temperature of the place it reads.
//!
//! Radiation, films and fluxes act on the faces of cells; sources are heat per volume.

mod bodies;
mod crossings;
mod deck;
mod loads;
mod lumped;
mod points;
mod refused;
mod text;
mod water;

pub use points::DeckPoint;

use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// A deck, and the nodes of the sensors in its results.
#[derive(Debug, Clone, PartialEq)]
pub struct InputDeck {
    /// The deck.
    pub text: String,
    /// Nodes in it.
    pub nodes: usize,
    /// Elements in it.
    pub elements: usize,
    /// The node of each sensor, in the machine's order.
    pub points: Vec<DeckPoint>,
}

impl InputDeck {
    /// The deck of a model whose `state` at `condition` is known. Film coefficients, mass flows and other laws of temperature that
    /// CalculiX cannot express have their values in this state.
    ///
    /// # Errors
    /// The machine has something that the deck cannot express; the error names it, its place and a remedy.
    pub fn new(model: &MeshedMachine, condition: &Condition, state: &SteadyState) -> Result<Self> {
        refused::check(model, state).map_err(|error| error.in_file(&model.machine.file))?;
        let mut deck = deck::Deck::default();
        let bodies = bodies::DeckBodies::new(model, &mut deck).map_err(|error| error.in_file(&model.machine.file))?;
        crossings::add(model, state, &bodies, &mut deck);
        let outlets = water::add(model, state, &bodies, &mut deck);
        let mut lumped = lumped::DeckNodes::new(model, &mut deck);
        lumped.contacts(model, state, &bodies, &mut deck);
        let points = points::add(model, &bodies, &outlets, &lumped, &mut deck).map_err(|error| error.in_file(&model.machine.file))?;
        loads::add(model, state, &bodies, &lumped, &mut deck).map_err(|error| error.in_file(&model.machine.file))?;
        let text = text::text(model, condition, state, &deck, &points);
        Ok(Self { text, nodes: deck.nodes.len(), elements: deck.elements.len(), points })
    }
}
