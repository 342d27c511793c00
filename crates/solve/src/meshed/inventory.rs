//! Inventory of a machine, counted on its mesh.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{BoundaryEntry, MeshedMachine};
use crate::balance::{ContactFlow, contact_flows};
use crate::reachability::ConnectedPieces;
use coldplate_base::error::Result;
use coldplate_base::units::{Celsius, Kelvin};
use coldplate_describe::machine::{BoundaryLaw, Condition, LumpedNode, Machine, Part, Place, Source};
use coldplate_network::{ContactGroup, Load};

/// Parts, contacts, channels and sources of a model, and warnings about them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inventory {
    /// Parts, then lumped nodes.
    pub parts: Vec<PartEntry>,
    /// Imported meshes.
    pub imports: Vec<ImportEntry>,
    /// Contacts with their true areas.
    pub contacts: Vec<ContactEntry>,
    /// Coolant channels.
    pub channels: Vec<ChannelEntry>,
    /// Boundaries on faces and on lumped nodes.
    pub boundaries: Vec<BoundaryEntry>,
    /// Heat sources.
    pub sources: Vec<SourceEntry>,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
}

/// A heat source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SourceEntry {
    /// Name.
    pub name: String,
    /// Power, W, where a condition was given.
    #[serde(rename = "power_W")]
    pub power: Option<f64>,
}

/// A part or lumped node.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartEntry {
    /// Name.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// Volume, m³.
    #[serde(rename = "volume_m3")]
    pub volume: f64,
    /// Mass, kg.
    #[serde(rename = "mass_kg")]
    pub mass: f64,
    /// Heat capacity at 300 K, J/K.
    #[serde(rename = "capacity_J_K")]
    pub capacity: f64,
    /// Area that sees the chamber, m².
    #[serde(rename = "radiating_area_m2")]
    pub radiating_area: f64,
    /// Cells; vertices of an imported mesh.
    pub cells: usize,
}

/// A part from a mesh file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImportEntry {
    /// Name of the part.
    pub name: String,
    /// The file, as the machine file names it.
    pub file: String,
    /// Tetrahedra.
    pub tetrahedra: usize,
    /// Named surfaces with their areas, m².
    #[serde(rename = "surfaces_m2")]
    pub surfaces: BTreeMap<String, f64>,
    /// Mean ratio of the worst tetrahedron: 1 for a regular one, 0 for a flat one.
    pub worst_quality: f64,
    /// Share of the edges that conduct negatively, because the angles opposite are obtuse: there a temperature may
    /// over- or undershoot slightly.
    #[serde(rename = "obtuse_edges")]
    pub obtuse: f64,
}

/// A contact.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactEntry {
    /// Name.
    pub name: String,
    /// The two sides.
    pub between: [String; 2],
    /// True overlap area, m² (the stated one where parts do not touch).
    #[serde(rename = "area_m2")]
    pub area: f64,
    /// Conductance hA, W/K; infinite where bonded.
    #[serde(rename = "hA_W_K")]
    pub conductance: f64,
    /// Whether the machine file names it.
    pub named: bool,
}

/// A coolant channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelEntry {
    /// Name.
    pub name: String,
    /// Circuit of the channel.
    pub circuit: String,
    /// Wetted length, m.
    #[serde(rename = "length_m")]
    pub length: f64,
    /// Diameter, m.
    #[serde(rename = "diameter_m")]
    pub diameter: f64,
    /// Stations on this mesh.
    pub stations: usize,
    /// Reynolds number at the condition, water at its inlet temperature.
    pub reynolds: Option<f64>,
    /// Film coefficient, W/(m² K).
    #[serde(rename = "h_W_m2K")]
    pub film: Option<f64>,
    /// Pressure drop, Pa.
    #[serde(rename = "pressure_drop_Pa")]
    pub pressure_drop: Option<f64>,
}

/// Power of every source at a condition, W.
///
/// # Errors
/// A formula fails there.
pub fn source_powers(machine: &Machine, condition: &Condition) -> Result<Vec<f64>> {
    Ok(Load::at(machine, condition)?.powers)
}

/// Counts the parts, contacts, channels and sources of `model`; films and heats at `condition` where one is given.
///
/// # Errors
/// A formula fails at the condition, or water leaves its property range.
pub fn inventory(model: &MeshedMachine, condition: Option<&Condition>) -> Result<Inventory> {
    let machine = &model.machine;
    let load = condition.map(|c| Load::at(machine, c)).transpose()?;
    let mut found = Inventory {
        parts: parts(model),
        contacts: contacts(model, load.as_ref()),
        boundaries: super::boundaries::boundaries(model, load.as_ref()),
        sources: sources(machine, load.as_ref()),
        ..Inventory::default()
    };
    found.warnings.extend(model.loose_pieces());
    found.warnings.extend(model.held_heats());
    list_imports(model, &mut found);
    list_channels(model, load.as_ref(), &mut found)?;
    found.warnings.extend(super::boundaries::doubled(machine));
    warn_about_gas(machine, &mut found);
    warn_about_areas(model, &mut found);
    warn_about_contacts(model, &mut found);
    warn_about_sources(machine, &mut found);
    warn_about_islands(model, &mut found);
    warn_about_coolant(load.as_ref(), model, &mut found);
    Ok(found)
}

/// Parts, then lumped nodes.
fn parts(model: &MeshedMachine) -> Vec<PartEntry> {
    let (machine, network) = (&model.machine, &model.network);
    let mut radiating = vec![0.0; network.groups.len()];
    for surface in network.surfaces.iter().filter(|surface| surface.emissive > 0.0) {
        radiating[network.group[surface.node as usize] as usize] += surface.gas_area;
    }
    let of_part = |(p, part): (usize, &Part)| {
        let material = &machine.materials[part.material];
        let volume = model.mesh.volume(p);
        let mass = volume * material.density;
        PartEntry {
            name: part.name.clone(),
            material: material.name.clone(),
            volume,
            mass,
            capacity: mass * material.specific_heat.at(300.0),
            radiating_area: radiating[p],
            cells: model.mesh.grids_of(p).map(|(_, g)| g.len()).sum::<usize>() + model.mesh.tetra_of(p).map_or(0, |t| t.points.len()),
        }
    };
    let of_node = |(n, node): (usize, &LumpedNode)| PartEntry {
        name: node.name.clone(),
        material: "lumped node".into(),
        volume: 0.0,
        mass: 0.0,
        capacity: node.capacity,
        radiating_area: radiating[machine.parts.len() + n],
        cells: 1,
    };
    machine.parts.iter().enumerate().map(of_part).chain(machine.nodes.iter().enumerate().map(of_node)).collect()
}

/// Contacts at 300 K; without a condition each as its law has it.
fn contacts(model: &MeshedMachine, load: Option<&Load>) -> Vec<ContactEntry> {
    let network = &model.network;
    let factors = load.map(|load| load.contacts.clone()).unwrap_or_default();
    let flows = contact_flows(network, &factors, &vec![300.0; network.nodes]);
    let of = |(group, flow): (&ContactGroup, ContactFlow)| ContactEntry {
        name: group.name.clone(),
        between: group.between.clone(),
        area: group.area,
        conductance: flow.conductance,
        named: group.of.is_some(),
    };
    network.contacts.iter().zip(flows).map(of).collect()
}

/// Heat sources, with their powers where a condition was given.
fn sources(machine: &Machine, load: Option<&Load>) -> Vec<SourceEntry> {
    let of = |(i, source): (usize, &Source)| SourceEntry { name: source.name.clone(), power: load.map(|load| load.powers[i]) };
    machine.sources.iter().enumerate().map(of).collect()
}

/// Lists the coolant channels, with warnings about their films.
fn list_channels(model: &MeshedMachine, load: Option<&Load>, found: &mut Inventory) -> Result<()> {
    let network = &model.network;
    let states = load.map(|load| network.stream_states(load, &network.at_inlets(load, load.chamber))).transpose()?;
    for (s, stream) in network.streams.iter().enumerate() {
        let state = states.as_ref().map(|all| &all[s]);
        found.channels.push(ChannelEntry {
            name: stream.name.clone(),
            circuit: network.circuits[stream.circuit].circuit.name.clone(),
            length: stream.length,
            diameter: stream.diameter,
            stations: stream.stations.len(),
            reynolds: state.map(|s| s.reynolds),
            film: state.map(|s| s.film),
            pressure_drop: state.map(|s| s.pressure_drop),
        });
        if let Some(note) = state.and_then(|s| s.note) {
            found.warnings.push(format!("channel '{}': {note}", stream.name));
        }
    }
    Ok(())
}

/// Lists imported meshes, with warnings about their elements.
fn list_imports(model: &MeshedMachine, found: &mut Inventory) {
    for part in &model.machine.parts {
        let Some(import) = &part.import else { continue };
        let Some(tetra) = model.mesh.tetra.iter().find(|t| model.machine.parts[t.part].name == part.name) else { continue };
        let body = &import.body;
        let edges = tetra.edges();
        let negative = edges.iter().filter(|e| e.factor.iter().sum::<f64>() < 0.0).count();
        let area = |faces: &[u32]| faces.iter().map(|f| tetra.face_area(*f as usize)).sum();
        found.imports.push(ImportEntry {
            name: part.name.clone(),
            file: import.file.clone(),
            tetrahedra: body.tetrahedra.len(),
            surfaces: body.surfaces.iter().map(|s| (s.name.clone(), area(&s.faces))).collect(),
            worst_quality: body.worst_quality,
            obtuse: negative as f64 / edges.len().max(1) as f64,
        });
        if body.worst_quality < 0.05 {
            found.warnings.push(format!(
                "'{}' has nearly flat tetrahedra (worst mean ratio {:.3}): temperatures near them may overshoot; mesh again with Mesh.Optimize = 1",
                part.name, body.worst_quality
            ));
        }
        if body.curved > 0 {
            found.warnings.push(format!(
                "'{}' has {} elements of second or higher order, of which the corners alone are used: linear elements with straight edges",
                part.name, body.curved
            ));
        }
    }
}

impl MeshedMachine {
    /// Remarks on sources that heat a node held at a temperature, one for each.
    pub(super) fn held_heats(&self) -> impl Iterator<Item = String> + '_ {
        let nodes = &self.machine.nodes;
        self.machine.sources.iter().filter_map(|source| {
            let held = source.places.iter().find_map(|heated| match heated.place {
                Place::Node(n) => nodes.get(n).filter(|node| node.fixed.is_some()),
                _ => None,
            })?;
            let (source, node) = (&source.name, &held.name);
            Some(format!("source '{source}' heats '{node}', which is held at its temperature: this heat changes no temperature"))
        })
    }

    /// Remarks on imported parts whose pieces share no node, one for each part.
    pub(super) fn loose_pieces(&self) -> impl Iterator<Item = String> + '_ {
        let pieces = self.machine.parts.iter().filter_map(|part| Some((&part.name, part.import.as_ref()?.body.pieces)));
        pieces
            .filter(|(_, pieces)| *pieces > 1)
            .map(|(name, pieces)| format!("'{name}' consists of {pieces} pieces that share no node: no heat passes between them"))
    }
}

/// Largest pressure of a chamber whose gas only conducts, Pa. Chosen: over 0.1 m between walls 20 K apart, air of a tenth of an
/// atmosphere has a Rayleigh number of about 2e4, and its motion carries twice what it conducts.
const STILL_GAS: f64 = 1e4;

fn warn_about_gas(machine: &Machine, found: &mut Inventory) {
    let moves = machine.boundaries.iter().any(|b| matches!(b.law, BoundaryLaw::FreeConvection(..) | BoundaryLaw::Film(..)));
    if machine.chamber.pressure > STILL_GAS && !moves {
        found.warnings.push(format!(
            "the chamber holds gas of {:.3} bar, which is taken to conduct alone: give the outer faces a [boundary] with free_convection, \
             or a film",
            machine.chamber.pressure / 1e5
        ));
    }
}

/// A flux over one area and a contact over another: the classic way to misread a conductance.
fn warn_about_areas(model: &MeshedMachine, found: &mut Inventory) {
    for part in &model.machine.parts {
        let Some(stated) = part.stated_flux_area else { continue };
        let touching: f64 = found.contacts.iter().filter(|c| c.named && c.between.contains(&part.name)).map(|c| c.area).sum();
        if (touching - stated).abs() > 0.02 * stated {
            found.warnings.push(format!(
                "'{}' states a flux area of {stated:.5} m2 but touches over {touching:.5} m2 ({:.0} %): a conductance identified with \
                 one area must not be used with the other, only hA is determined",
                part.name,
                100.0 * touching / stated
            ));
        }
    }
}

fn warn_about_contacts(model: &MeshedMachine, found: &mut Inventory) {
    let unnamed: Vec<String> = found.contacts.iter().filter(|c| !c.named).map(|c| format!("{} ({:.4} m2)", c.name, c.area)).collect();
    if !unnamed.is_empty() && model.machine.default_contact.is_none() {
        found.warnings.push(format!(
            "these parts touch and no contact names them, so they are bonded: {}; name them, or set [contacts] default",
            unnamed.join(", ")
        ));
    }
    for group in &model.network.contacts {
        if let Some(note) = group.law.note() {
            found.warnings.push(format!("contact '{}': {note}", group.name));
        }
    }
}

fn warn_about_sources(machine: &Machine, found: &mut Inventory) {
    for source in &machine.sources {
        if let Some(note) = source.law.note() {
            found.warnings.push(format!("source '{}': {note}", source.name));
        }
    }
}

/// Parts with no path to coolant, chamber or any given temperature.
fn warn_about_islands(model: &MeshedMachine, found: &mut Inventory) {
    let shut = ConnectedPieces::new(&model.network).shut(&model.network);
    if !shut.is_empty() {
        found.warnings.push(format!(
            "no path for heat from {} to coolant, chamber or any given temperature: there is no steady state",
            shut.join(", ")
        ));
    }
}

fn warn_about_coolant(load: Option<&Load>, model: &MeshedMachine, found: &mut Inventory) {
    let Some(load) = load else { return };
    for (c, tree) in model.network.circuits.iter().enumerate() {
        if load.flows[c] == 0.0 {
            found.warnings.push(format!("no water flows in the circuit '{}' at this condition", tree.circuit.name));
        }
        if let Some(note) = tree.circuit.liquid.note(load.inlets[c]) {
            found.warnings.push(format!("circuit '{}' at {:.1}: {note}", tree.circuit.name, Celsius::from(Kelvin(load.inlets[c])).0));
        }
    }
}
