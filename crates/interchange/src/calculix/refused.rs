//! Features of a machine that a deck cannot express.

use coldplate_base::error::{Error, Result};
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// Refuses a machine with features that the deck cannot express.
///
/// # Errors
/// The machine has such a feature; the error names it, its place and a remedy.
pub(super) fn check(model: &MeshedMachine, state: &SteadyState) -> Result<()> {
    let machine = &model.machine;
    for part in &machine.parts {
        if part.import.is_some() {
            return Err(said(format!("'{}' is an imported mesh", part.name))
                .at_key(format!("part.{}", part.name))
                .help("give CalculiX the mesh file itself, or describe the part by blocks"));
        }
    }
    if let Some(grid) = model.mesh.grids.iter().find(|grid| grid.is_spherical()) {
        let part = &machine.parts[grid.part].name;
        return Err(said(format!("'{part}' is a sphere, whose cells are shells"))
            .at_key(format!("part.{part}"))
            .help("describe it as a box or a cylinder of the same volume"));
    }
    if let Some(link) = machine.radiation_links.first() {
        return Err(said(format!("the radiation link '{}' joins two surfaces", link.name))
            .at_key(format!("radiation_link.{}", link.name))
            .help("leave it out in a copy of the file; both surfaces then see the chamber"));
    }
    if let Some(enclosure) = machine.enclosures.first() {
        return Err(said(format!("the surfaces of the enclosure '{}' see each other", enclosure.name))
            .at_key(format!("enclosure.{}", enclosure.name))
            .help("leave it out in a copy of the file; its surfaces then see the chamber"));
    }
    for (stream, flow) in model.network.streams.iter().zip(&state.solution.streams) {
        if flow.capacity_rate <= 0.0 {
            return Err(said(format!("nothing flows in the channel '{}'", stream.name))
                .at_key(format!("channel.{}", stream.name))
                .help("ask for a condition with flow, or leave the channel out in a copy of the file"));
        }
    }
    Ok(())
}

fn said(what: String) -> Error {
    Error::input(format!("{what}, which the input deck for CalculiX cannot say"))
}
