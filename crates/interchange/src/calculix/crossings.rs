//! Thin wedges between the faces of touching blocks.

use super::bodies::DeckBodies;
use super::deck::{Deck, ElementSet};
use coldplate_describe::machine::Side;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// Conductivity of wedges across contacts, W/(m K). Chosen so that a contact of h W/(m² K) is a wedge 1/h m thick.
pub(super) const CONTACT_CONDUCTIVITY: f64 = 1.0;
/// Conductivity of wedges across bonds, W/(m K). Chosen: a wedge is this over its conductance per area thick.
pub(super) const BOND_CONDUCTIVITY: f64 = 1000.0;
/// Conductance of a bond over that of the two half cells beside it, dimensionless. Chosen: drop across the bond (1 %) against
/// conditioning.
const BOND: f64 = 100.0;

/// Adds the wedges.
pub(super) fn add(model: &MeshedMachine, state: &SteadyState, bodies: &DeckBodies<'_>, deck: &mut Deck) {
    let (network, temperatures) = (&model.network, &state.solution.temperatures);
    for crossed in &network.crossed {
        let interface = &model.mesh.interfaces[crossed.interface];
        for (overlap, joint) in interface.overlaps.iter().zip(&network.joints[crossed.joints.clone()]) {
            let end = |(g, side): (usize, _), cell| bodies.on_face(g, bodies.grid(g).indices(cell), side, overlap.point);
            let ends = [end(interface.a, overlap.a), end(interface.b, overlap.b)];
            let ends = [&ends[0], &ends[1]];
            let h = network.contact_conductance(joint, temperatures, &state.load.contacts);
            if h.is_infinite() {
                let h = BOND * half_cells(model, [(interface.a, overlap.a), (interface.b, overlap.b)], temperatures);
                deck.wedge(ElementSet::Bond, overlap.point, overlap.area, BOND_CONDUCTIVITY / h, ends);
            } else if h > 0.0 {
                deck.wedge(ElementSet::Contact, overlap.point, overlap.area, CONTACT_CONDUCTIVITY / h, ends);
            }
        }
    }
}

/// Conductance of the half cells on both sides of a face, W/(m² K); `sides` has grid, side and cell of each.
fn half_cells(model: &MeshedMachine, sides: [((usize, Side), usize); 2], temperatures: &[f64]) -> f64 {
    let resistance = |((g, side), cell): ((usize, Side), usize)| {
        let grid = &model.mesh.grids[g];
        let conductivity = &model.machine.materials[model.machine.parts[grid.part].material].conductivity[side.axis()];
        grid.half_length(grid.indices(cell), side) / conductivity.at(temperatures[cell])
    };
    1.0 / sides.map(resistance).iter().sum::<f64>()
}

/// Whether some crossing of the mesh has a joint.
pub(super) fn is_crossed(model: &MeshedMachine, joint: usize) -> bool {
    model.network.crossed.iter().any(|crossed| crossed.joints.contains(&joint))
}
