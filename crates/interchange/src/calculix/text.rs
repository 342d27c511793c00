//! The deck as text.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::crossings::{BOND_CONDUCTIVITY, CONTACT_CONDUCTIVITY};
use super::deck::{Deck, Element, ElementKind, ElementSet, Sink};
use super::points::DeckPoint;
use super::water::SPECIFIC_HEAT;
use coldplate_base::units::{ZERO_CELSIUS, celsius};
use coldplate_describe::machine::{Condition, Machine, Property};
use coldplate_network::mesh::grid::LocalFrame;
use coldplate_physics::radiation::SIGMA;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// Terms of an equation in one line, a count: four at most in CalculiX.
const TERMS: usize = 4;
/// Conductivity of elements that have the temperature of a place, W/(m K). Chosen: they conduct nothing, for all their nodes agree.
const PLACE_CONDUCTIVITY: f64 = 1.0;
/// Viscosity in the fluid network, Pa s. Chosen: CalculiX uses none where the flows are given.
const VISCOSITY: f64 = 1e-3;
/// Density in the fluid network, kg/m³. Chosen: CalculiX uses none where the flows are given.
const DENSITY: f64 = 1000.0;
/// Tolerances of CalculiX's iteration, as shares of typical values. Chosen; left to itself it stops earlier.
const CONVERGED: &str = "1.E-8, 1.E-8, 1.E-8";

/// Writes the deck. Comments begin with two stars.
pub(super) fn text(model: &MeshedMachine, condition: &Condition, state: &SteadyState, deck: &Deck, points: &[DeckPoint]) -> String {
    let mut out = header(model, condition, state, points);
    cards(&mut out, "NODE, NSET=ALL", deck.nodes.iter().enumerate().map(|(n, p)| format!("{}, {}", n + 1, p.map(number).join(", "))));
    elements(&mut out, &deck.elements);
    cards(&mut out, "NSET, NSET=POINTS", points.iter().map(|point| point.node.to_string()));
    for (node, weights) in &deck.equations {
        let terms = [(*node, 1.0)].into_iter().chain(weights.iter().map(|(n, w)| (*n, -w)));
        let terms: Vec<String> = terms.map(|(n, w)| format!("{n}, 11, {}", number(w))).collect();
        let _ = writeln!(out, "*EQUATION\n{}", terms.len());
        terms.chunks(TERMS).for_each(|line| out += &format!("{}\n", line.join(", ")));
    }
    materials(&mut out, &model.machine);
    sections(&mut out, model, deck);
    let _ = writeln!(out, "*PHYSICAL CONSTANTS, ABSOLUTE ZERO={}, STEFAN BOLTZMANN={}", number(-ZERO_CELSIUS), number(SIGMA));
    let start = state.load.inlets.first().copied().unwrap_or(state.load.chamber);
    let _ = writeln!(out, "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, {}", number(celsius(start)));
    let _ = writeln!(out, "*STEP, INC=100\n*HEAT TRANSFER, STEADY STATE\n*CONTROLS, PARAMETERS=FIELD\n{CONVERGED}");
    let held = deck.held.iter().map(|(n, t)| format!("{n}, 11, 11, {}", number(celsius(*t))));
    cards(&mut out, "BOUNDARY", held.chain(deck.flows.iter().map(|(n, m)| format!("{n}, 1, 1, {}", number(*m)))));
    cards(&mut out, "CFLUX", deck.heats.iter().map(|(n, q)| format!("{n}, 11, {}", number(*q))));
    let sources = deck.sources.iter().map(|(e, q)| format!("{e}, BF, {}", number(*q)));
    cards(&mut out, "DFLUX", sources.chain(deck.fluxes.iter().map(|(e, face, q)| format!("{e}, S{face}, {}", number(*q)))));
    let film = |card: &super::deck::FilmCard| match card.sink {
        Sink::Temperature(t) => format!("{}, F{}, {}, {}", card.element, card.face, number(celsius(t)), number(card.film)),
        Sink::Water(node) => format!("{}, F{}FC, {node}, {}", card.element, card.face, number(card.film)),
    };
    cards(&mut out, "FILM", deck.films.iter().map(film));
    let radiation =
        deck.radiation.iter().map(|(e, face, emissivity, t)| format!("{e}, R{face}, {}, {}", number(celsius(*t)), number(*emissivity)));
    cards(&mut out, "RADIATE", radiation);
    out += "*NODE PRINT, NSET=POINTS\nNT\n*NODE FILE\nNT\n*END STEP\n";
    out
}

/// A card with its lines, if there are any.
fn cards(out: &mut String, name: &str, lines: impl Iterator<Item = String>) {
    let mut lines = lines.peekable();
    if lines.peek().is_some() {
        let _ = writeln!(out, "*{name}");
        lines.for_each(|line| {
            let _ = writeln!(out, "{line}");
        });
    }
}

/// A number of at most 20 characters, as many as CalculiX reads.
fn number(value: f64) -> String {
    format!("{value:.12e}")
}

fn header(model: &MeshedMachine, condition: &Condition, state: &SteadyState, points: &[DeckPoint]) -> String {
    let machine = &model.machine;
    let mut out =
        format!("** {}, steady temperatures. Written by coldplate {}.\n", machine.name.replace('\n', " "), env!("CARGO_PKG_VERSION"));
    out += &format!("** Condition: {}\n** SHA-256 of the machine file: {}\n", condition.words(machine), machine.hash);
    out += "** SI units, temperatures in degC. The elements are the cells of coldplate's own mesh.\n";
    for (g, grid) in model.mesh.grids.iter().enumerate() {
        let part = machine.parts[grid.part].name.replace('\n', " ");
        out += &format!("** {}: block {} of '{part}', {} cells\n", ElementSet::Grid(g).name(), grid.block + 1, grid.len());
    }
    out += "** CONTACT: wedges that conduct across contacts; one of h W/(m2 K) is 1/h m thick. BOND: the same between blocks that are\n\
            ** one piece. Both ends have the temperatures of the faces, by equations. PLACE: temperatures of channel walls and sensors.\n\
            ** WATER: the coolant, as a fluid network. CalculiX finds its temperatures. Its mass flows, films, and the laws of\n\
            ** temperature of contacts, free convection and sources have their values in coldplate's own solution at this condition.\n\
            ** Measurement points, with the temperatures of coldplate's own solution:\n";
    let own = model.readings(state).into_iter().zip(&machine.sensors).filter(|(_, sensor)| !sensor.reads.is_displacement());
    for (point, (own, _)) in points.iter().zip(own) {
        out += &format!("** node {}: {} ({own:.4} degC)\n", point.node, point.sensor.replace('\n', " "));
    }
    out
}

fn elements(out: &mut String, elements: &[Element]) {
    let mut by_set: BTreeMap<(ElementSet, &str), Vec<String>> = BTreeMap::new();
    for (e, element) in elements.iter().enumerate() {
        let nodes: Vec<String> = element.nodes.iter().map(u32::to_string).collect();
        by_set.entry((element.set, element.kind.name())).or_default().push(format!("{}, {}", e + 1, nodes.join(", ")));
    }
    for ((set, kind), lines) in by_set {
        cards(out, &format!("ELEMENT, TYPE={kind}, ELSET={}", set.name()), lines.into_iter());
    }
}

fn materials(out: &mut String, machine: &Machine) {
    for (m, material) in machine.materials.iter().enumerate() {
        let _ = writeln!(out, "** {}\n*MATERIAL, NAME=MATERIAL{}", material.name.replace('\n', " "), m + 1);
        let [x, y, z] = &material.conductivity;
        let mut at: Vec<f64> = material.conductivity.iter().flat_map(temperatures).collect();
        at.sort_by(f64::total_cmp);
        at.dedup();
        let at = if at.is_empty() { vec![ZERO_CELSIUS] } else { at };
        if x == y && y == z {
            cards(out, "CONDUCTIVITY", at.iter().map(|t| format!("{}, {}", number(x.at(*t)), number(celsius(*t)))));
        } else {
            let line = |t: &f64| format!("{}, {}", [x, y, z].map(|k| number(k.at(*t))).join(", "), number(celsius(*t)));
            cards(out, "CONDUCTIVITY, TYPE=ORTHO", at.iter().map(line));
        }
    }
    for (name, k) in [("CONTACT", CONTACT_CONDUCTIVITY), ("BOND", BOND_CONDUCTIVITY), ("PLACE", PLACE_CONDUCTIVITY)] {
        let _ = writeln!(out, "*MATERIAL, NAME={name}\n*CONDUCTIVITY\n{}", number(k));
    }
    let _ = writeln!(
        out,
        "*MATERIAL, NAME=WATER\n*FLUID CONSTANTS\n{}, {}\n*DENSITY\n{}",
        number(SPECIFIC_HEAT),
        number(VISCOSITY),
        number(DENSITY)
    );
}

/// Temperatures at the corners of a property's table, K.
fn temperatures(property: &Property) -> Vec<f64> {
    match property {
        Property::Constant(_) => Vec::new(),
        Property::Table(table) => table.iter().map(|(t, _)| *t).collect(),
    }
}

fn sections(out: &mut String, model: &MeshedMachine, deck: &Deck) {
    let mut sets: Vec<(ElementSet, ElementKind)> = deck.elements.iter().map(|e| (e.set, e.kind)).collect();
    sets.sort_by_key(|(set, _)| *set);
    sets.dedup_by_key(|(set, _)| *set);
    for (set, _) in sets {
        let name = set.name();
        let ElementSet::Grid(g) = set else {
            let kind = if set == ElementSet::Water { "FLUID" } else { "SOLID" };
            let _ = writeln!(out, "*{kind} SECTION, ELSET={name}, MATERIAL={name}");
            continue;
        };
        let grid = &model.mesh.grids[g];
        let material = model.machine.parts[grid.part].material;
        let [x, y, z] = &model.machine.materials[material].conductivity;
        let mut orientation = String::new();
        if let (LocalFrame::Cylindrical { .. }, false) = (grid.frame, x == y && y == z) {
            // Two points on the axis; the local axes are then radius, angle and axis.
            let on_axis = |s: f64| grid.to_machine([0.0, 0.0, s]).map(number).join(", ");
            let ends = [grid.edges[2][0], grid.edges[2][grid.n(2)]].map(on_axis);
            let _ = writeln!(out, "*ORIENTATION, NAME=AXES{}, SYSTEM=CYLINDRICAL\n{}", g + 1, ends.join(", "));
            orientation = format!(", ORIENTATION=AXES{}", g + 1);
        }
        let _ = writeln!(out, "*SOLID SECTION, ELSET={name}, MATERIAL=MATERIAL{}{orientation}", material + 1);
    }
}
