//! Boundaries of a machine: the prescribed quantities, and the areas they act on.

use serde::Serialize;

use super::MeshedMachine;
use coldplate_base::units::celsius;
use coldplate_describe::machine::{Boundary, BoundaryLaw, Machine};
use coldplate_network::{BoundaryArea, BoundaryState, Load};

/// A boundary with its prescribed quantity and the area that it really acts on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoundaryEntry {
    /// Name.
    pub name: String,
    /// Faces of the boundary as the machine file writes them, or its lumped node.
    pub faces: Vec<String>,
    /// Prescribed quantity, with the numbers of the condition if one was given.
    pub prescribes: String,
    /// Open area that it acts on, m².
    #[serde(rename = "area_m2")]
    pub area: f64,
    /// Share of the boundary's faces (or of the named part of them) that other bodies cover.
    pub covered: f64,
}

/// Every boundary of a model, in the order of the file.
pub(super) fn boundaries(model: &MeshedMachine, load: Option<&Load>) -> Vec<BoundaryEntry> {
    let machine = &model.machine;
    let entry = |(l, (boundary, area)): (usize, (&Boundary, &BoundaryArea))| {
        let BoundaryArea { acting, whole } = *area;
        let share = 1.0 - acting / whole;
        BoundaryEntry {
            name: boundary.name.clone(),
            faces: match boundary.node {
                Some(exposed) => vec![machine.nodes[exposed.node].name.clone()],
                None => boundary.faces.iter().map(|face| machine.face_name(*face)).collect(),
            },
            prescribes: match load {
                Some(load) => at_condition(&load.boundaries[l]),
                None => as_written(&boundary.law),
            },
            area: acting,
            // A share within rounding is no cover.
            covered: if share > 1e-9 { share } else { 0.0 },
        }
    };
    machine.boundaries.iter().zip(&model.network.acting).enumerate().map(entry).collect()
}

/// Warnings about two boundaries of one kind on one lumped node. Each acts on an area of its own; on a face two such boundaries would
/// contradict each other.
pub(super) fn doubled(machine: &Machine) -> Vec<String> {
    let kind = |law: &BoundaryLaw| match law {
        BoundaryLaw::Temperature(_) => "temperatures",
        BoundaryLaw::Film(..) | BoundaryLaw::FreeConvection(..) => "films",
        BoundaryLaw::Flux(_) => "fluxes",
        BoundaryLaw::Radiation(..) => "surroundings to radiate to",
    };
    let on_node = |b: &Boundary| b.node.as_ref().map(|exposed| (exposed.node, kind(&b.law)));
    let mut found = Vec::new();
    for (i, b) in machine.boundaries.iter().enumerate() {
        let Some((node, kind)) = on_node(b) else { continue };
        if let Some(first) = machine.boundaries[..i].iter().find(|a| on_node(a) == Some((node, kind))) {
            let (a, b, node) = (&first.name, &b.name, &machine.nodes[node].name);
            found.push(format!("boundaries '{a}' and '{b}' give the node '{node}' two {kind}: both act, each on its own area"));
        }
    }
    found
}

fn at_condition(state: &BoundaryState) -> String {
    let degrees = |t: f64| format!("{} degC", rounded(celsius(t)));
    match *state {
        BoundaryState::Temperature(t) => format!("temperature {}", degrees(t)),
        BoundaryState::Film(h, t) => format!("film {} W/(m2 K) to {}", rounded(h), degrees(t)),
        BoundaryState::FreeConvection(_, t) => format!("free convection to {}", degrees(t)),
        BoundaryState::Flux(q) => format!("flux {} W/m2 into the machine", rounded(q)),
        BoundaryState::Radiation(e, t) => format!("radiation, emissivity {}, to {}", rounded(e), degrees(t)),
    }
}

/// A number without the digits that rounding leaves behind.
fn rounded(number: f64) -> f64 {
    (number * 1e6).round() / 1e6
}

fn as_written(law: &BoundaryLaw) -> String {
    match law {
        BoundaryLaw::Temperature(t) => format!("temperature {}", t.text()),
        BoundaryLaw::Film(h, t) => format!("film {} to {}", h.text(), t.text()),
        BoundaryLaw::FreeConvection(_, t) => format!("free convection to {}", t.text()),
        BoundaryLaw::Flux(q) => format!("flux {} into the machine", q.text()),
        BoundaryLaw::Radiation(e, t) => format!("radiation, emissivity {}, to {}", rounded(*e), t.text()),
    }
}
