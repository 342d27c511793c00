//! Loads on the faces of cells, and heat in their volume.

use std::collections::BTreeMap;

use super::bodies::DeckBodies;
use super::deck::{Deck, FilmCard, Sink};
use super::lumped::DeckNodes;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Side;
use coldplate_network::{BoundaryState, Load, Surface};
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// Share of a cell's face from which a held area counts as the whole face, dimensionless. Chosen: true parts against rounding.
const WHOLE: f64 = 0.999;

/// Loads on one face of a cell. CalculiX takes one film and one radiation for each face: those of several laws are summed, so that the
/// heat agrees at every temperature of the face.
#[derive(Debug, Clone, Copy, Default)]
struct Acting {
    /// Sum of film times area, W/K.
    film: f64,
    /// Sum of film times area times temperature of the fluid, W.
    film_sink: f64,
    /// Sum of emissivity times area, m².
    emissive: f64,
    /// Sum of emissivity times area times the fourth power of the temperature that is seen, m² K⁴.
    emissive_sink: f64,
    /// Heat of fluxes, W.
    flux: f64,
}

impl Acting {
    fn add_film(&mut self, conductance: f64, sink: f64) {
        self.film += conductance;
        self.film_sink += conductance * sink;
    }

    fn add_radiation(&mut self, emissive: f64, seen: f64) {
        self.emissive += emissive;
        self.emissive_sink += emissive * seen.powi(4);
    }

    /// Puts the loads on a face of an area (m²).
    fn put(&self, element: usize, face: u8, area: f64, deck: &mut Deck) {
        if self.film > 0.0 {
            let sink = Sink::Temperature(self.film_sink / self.film);
            deck.films.push(FilmCard { element, face, film: self.film / area, sink });
        }
        if self.emissive > 0.0 {
            deck.radiation.push((element, face, self.emissive / area, (self.emissive_sink / self.emissive).powf(0.25)));
        }
        if self.flux != 0.0 {
            deck.fluxes.push((element, face, self.flux / area));
        }
    }

    /// Adds the laws of a surface; `at` is the temperature behind it in the state, K.
    fn add(&mut self, model: &MeshedMachine, surface: &Surface, load: &Load, at: f64) {
        self.add_radiation(surface.emissive, load.chamber);
        self.add_film(surface.gas_area * load.gas, load.chamber);
        for l in surface.boundaries() {
            match load.boundaries[l] {
                BoundaryState::Film(h, t) => self.add_film(h * surface.area, t),
                BoundaryState::Flux(q) => self.flux += q * surface.area,
                BoundaryState::Radiation(e, t) => self.add_radiation(e * surface.area, t),
                BoundaryState::FreeConvection(convection, t) => {
                    let ts = surface.state(at, &model.network.properties, load).temperature;
                    if ts != t {
                        self.add_film(convection.flux(ts, t).value / (ts - t) * surface.area, t);
                    }
                }
                BoundaryState::Temperature(_) => {}
            }
        }
    }
}

/// Adds the loads.
///
/// # Errors
/// A boundary holds the temperature of a part of a cell's face.
pub(super) fn add(model: &MeshedMachine, state: &SteadyState, bodies: &DeckBodies<'_>, lumped: &DeckNodes, deck: &mut Deck) -> Result<()> {
    let (network, load, temperatures) = (&model.network, &state.load, &state.solution.temperatures);
    let mut acting: BTreeMap<(usize, usize), Acting> = BTreeMap::new();
    let mut held: BTreeMap<u32, f64> = BTreeMap::new();
    for open in &network.open {
        let surface = &network.surfaces[open.surface];
        let (g, c) = bodies.of_cell(open.cell);
        let holding = surface.boundaries().find_map(|l| match load.boundaries[l] {
            BoundaryState::Temperature(t) => Some((l, t)),
            _ => None,
        });
        let Some((l, t)) = holding else {
            acting.entry((open.cell, open.side as usize)).or_default().add(model, surface, load, temperatures[surface.node as usize]);
            continue;
        };
        if surface.area < WHOLE * bodies.grid(g).face_area(c, open.side) {
            let boundary = &model.machine.boundaries[l];
            return Err(Error::input(format!("the boundary '{}' holds the temperature of a part of a cell's face", boundary.name))
                .at_line(boundary.line)
                .at_key(format!("boundary.{}", boundary.name))
                .help("cut the part into blocks where it ends, and name the face of one block"));
        }
        held.extend(bodies.face(g, c, open.side).1.into_iter().map(|n| (n, t)));
    }
    // Faces that a sensor reads have nodes of their own in the network, which are held in place of a surface.
    for face in &network.faces {
        if let Some((_, fixed)) = network.fixed.iter().find(|(node, _)| *node == face.node) {
            let (g, c) = bodies.of_cell(face.cell as usize);
            let nodes = bodies.face(g, c, Side::ALL[face.side as usize]).1;
            held.extend(nodes.into_iter().map(|n| (n, load.fixed[*fixed as usize])));
        }
    }
    deck.held.extend(held);
    for ((cell, side), acting) in acting {
        let (g, c) = bodies.of_cell(cell);
        let (face, nodes) = bodies.face(g, c, Side::ALL[side]);
        acting.put(cell + 1, face, bodies.face_area(&nodes), deck);
    }
    nodes(model, state, lumped, deck);
    sources(model, state, bodies, lumped, deck);
    Ok(())
}

/// Loads on lumped nodes, and their held temperatures.
fn nodes(model: &MeshedMachine, state: &SteadyState, lumped: &DeckNodes, deck: &mut Deck) {
    let (network, load) = (&model.network, &state.load);
    for surface in &network.surfaces {
        let Some((node, element)) = lumped.get(surface.node) else { continue };
        let held = surface.boundaries().find_map(|l| match load.boundaries[l] {
            BoundaryState::Temperature(t) => Some(t),
            _ => None,
        });
        if let Some(t) = held {
            deck.held.push((node, t));
            continue;
        }
        let mut acting = Acting::default();
        acting.add(model, surface, load, state.solution.temperatures[surface.node as usize]);
        acting.put(element, 1, DeckNodes::area(), deck);
    }
    for (node, fixed) in &network.fixed {
        if let Some((own, _)) = lumped.get(*node) {
            deck.held.push((own, load.fixed[*fixed as usize]));
        }
    }
}

/// The power of every source, in the cells that it heats.
fn sources(model: &MeshedMachine, state: &SteadyState, bodies: &DeckBodies<'_>, lumped: &DeckNodes, deck: &mut Deck) {
    let mut heats: BTreeMap<u32, f64> = BTreeMap::new();
    for (source, power) in model.network.sources.iter().zip(&state.load.powers) {
        for (cell, heat) in source.heats(*power, &state.solution.temperatures) {
            *heats.entry(cell).or_default() += heat;
        }
    }
    for (cell, heat) in heats.into_iter().filter(|(_, heat)| *heat != 0.0) {
        if let Some((node, _)) = lumped.get(cell) {
            deck.heats.push((node, heat));
            continue;
        }
        let (g, c) = bodies.of_cell(cell as usize);
        deck.sources.push((cell as usize + 1, heat / bodies.volume(g, c)));
    }
}
