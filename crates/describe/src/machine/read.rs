//! Reading a machine file from beginning to end.

use std::path::Path;

use super::channels::channels;
use super::circuits::{branches, circuits};
use super::contacts::{boundaries, contacts, default_contact, radiation_links};
use super::controllers::controllers;
use super::elastic::{displacements, elasticity, turned};
use super::enclosures::enclosures;
use super::film::FilmSource;
use super::fluids::Fluids;
use super::geometry::{check_length, parts};
use super::heat_flows::heat_flows;
use super::keys::{ACCURACY, CELLS, SCHEMA, radiation as keys};
use super::library::Shelf;
use super::model::{Assumption, Chamber, Machine};
use super::names::Index;
use super::parts::Part;
use super::prior::priors;
use super::sensors::{limits, measurements, nodes, sensors};
use super::shape::{distance, overlap};
use super::sources::sources;
use super::symbols::Symbols;
use super::uncertain::{check_places, correlations, model_error, shared_factors};
use super::variables::{definitions, drives, formula_or, variables};
use coldplate_base::document::{Document, Section};
use coldplate_base::error::{Faults, Result};
use coldplate_base::units::Dimension;
use coldplate_physics::channel::{StraightChannel, nusselt, reynolds, serpentine_bend_factor};

impl Machine {
    /// Reads a machine file and applies `sets` (key, value) to it; see [`Document::apply_set`].
    ///
    /// # Errors
    /// The file cannot be read or is not a valid machine; the error names the file, the line, the key, the value and a
    /// remedy. `docs/reference/machine-file.md` describes the format.
    pub fn read(path: impl AsRef<Path>, sets: &[(String, String)]) -> Result<Self> {
        Self::from_document(&Document::read(path)?.with_sets(sets)?)
    }

    /// Reads a machine from the text of a file; `file` is the name used in errors.
    ///
    /// # Errors
    /// Errors of [`Machine::read`].
    pub fn from_text(text: &str, file: impl AsRef<Path>, sets: &[(String, String)]) -> Result<Self> {
        Self::from_document(&Document::parse(text, file)?.with_sets(sets)?)
    }

    /// Reads a machine from a parsed file.
    ///
    /// # Errors
    /// Errors of [`Machine::read`], with all further mistakes of the file that its schema alone can see.
    pub fn from_document(document: &Document) -> Result<Self> {
        machine(document).map_err(|error| error.in_file(document.file()).and(SCHEMA.mistakes(&document.root())))
    }
}

impl std::str::FromStr for Machine {
    type Err = coldplate_base::error::Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::from_text(text, "machine.toml", &[])
    }
}

fn machine(document: &Document) -> Result<Machine> {
    let root = document.root();
    // First, because a misspelt key would otherwise appear as a missing item elsewhere.
    SCHEMA.check(&root)?;
    check_places(document)?;
    let name = root.text("name")?;
    check_length(&name, &root).map_err(|e| root.error_at("name", e.what()).help("write at most 255 bytes, as they are seen"))?;
    let description = root.opt_text("description")?.unwrap_or_default();
    let mut symbols = Symbols::default();
    for table in ["part", "node", "sensor"] {
        symbols.places.extend(root.opt_section(table)?.iter().flat_map(|section| section.keys()).map(str::to_string));
    }
    let variables = variables(&root, &mut symbols)?;
    let drives = drives(&root, &mut symbols)?;
    let definitions = definitions(&root, &mut symbols)?;
    // Drives and definitions count as used if another formula names them, the chamber if a surface sees it.
    symbols.take_named();
    let chamber = chamber(&root, &symbols)?;
    let named_by_chamber = symbols.take_named();
    let (default_cells, accuracy) = cells(&root)?;

    let mut shelf = Shelf::read(&root)?;
    let folder = document.file().parent().unwrap_or(Path::new(""));
    let parts = parts(&root, &mut shelf, folder, &symbols)?;
    check_overlaps(&root, &parts)?;
    let nodes = nodes(&root, &symbols)?;
    let node_names: Vec<String> = nodes.iter().map(|node| node.name.clone()).collect();
    if let Some(node) = node_names.iter().find(|node| parts.iter().any(|part| part.name == **node)) {
        let table = root.section("node")?;
        return Err(table.section(node)?.error(format!("'{node}' is the name of a part and of a node")).help("rename one of them"));
    }
    if parts.is_empty() && nodes.is_empty() {
        return Err(root.error("the machine has neither parts nor nodes").help("add [part.NAME] with material and box"));
    }
    let (channels, automatic) = channels(&root, &parts, &symbols)?;
    let channel_names: Vec<String> = channels.iter().map(|channel| channel.name.clone()).collect();
    let index = Index { parts: &parts, nodes: &node_names, channels: &channel_names };
    let default_contact = default_contact(&root)?;
    // Tables that do not need each other: a mistake in one of them does not hide those in the others.
    let mut faults = Faults::default();
    let contacts = faults.take(contacts(&root, &index, &symbols)).unwrap_or_default();
    let circuits = faults.take(Fluids::read(&root).and_then(|fluids| circuits(&root, &channel_names, &symbols, &fluids)));
    let circuits = circuits.unwrap_or_default();
    let boundaries = faults.take(boundaries(&root, &index, &symbols)).unwrap_or_default();
    let radiation_links = faults.take(radiation_links(&root, &index)).unwrap_or_default();
    let enclosures = faults.take(enclosures(&root, &index, chamber.enclosure, document.file())).unwrap_or_default();
    let sources = faults.take(sources(&root, &index, &symbols)).unwrap_or_default();
    let mut sensors = faults.take(sensors(&root, &index)).unwrap_or_default();
    faults.end()?;
    super::clearance::check(&root, &parts, &channels, &circuits)?;
    let controllers = controllers(&root, &sensors, &sources, &symbols)?;
    sensors.extend(displacements(&root, &index, &sensors)?);
    sensors.extend(turned(&root, &sensors)?);
    let elasticity = elasticity(&root, &index)?;
    let heat_flows = heat_flows(&root, &index, &contacts, &boundaries)?;
    let limited: Vec<(String, Dimension)> = sensors.iter().map(|sensor| (sensor.name.clone(), sensor.measurand().dimension())).collect();
    let limits = limits(&root, &limited, &variables)?;
    let measurements = measurements(&root, &variables, &sensors)?;
    let (shared_factors, correlations) = (shared_factors(&root)?, correlations(&root)?);
    let model_error = model_error(&root, &sensors, &variables)?;
    let priors = priors(&root)?;
    let assumption = |a: coldplate_base::document::Assumed| Assumption { key: a.key, value: a.value, reason: a.reason };
    let assumptions = document.assumptions()?.into_iter().map(assumption).collect();
    let mut machine = Machine {
        name,
        file: document.file().to_path_buf(),
        description,
        hash: super::import::hash(document.hash(), &parts),
        variables,
        definitions,
        drives,
        chamber,
        materials: shelf.used,
        parts,
        nodes,
        default_contact,
        contacts,
        channels,
        circuits,
        boundaries,
        radiation_links,
        enclosures,
        sources,
        controllers,
        sensors,
        heat_flows,
        elasticity,
        limits,
        assumptions,
        measurements,
        shared_factors,
        correlations,
        model_error,
        priors,
        default_cells,
        accuracy,
        symbols,
        unused: Vec::new(),
    };
    let mut named = machine.symbols.take_named();
    if sees_chamber(&machine) {
        named.extend(named_by_chamber);
    }
    machine.find_unused(named);
    bend_factors(&mut machine, &automatic, &root)?;
    root.finish()?;
    Ok(machine)
}

/// Whether anything exchanges heat with the chamber wall.
fn sees_chamber(machine: &Machine) -> bool {
    let radiates = machine.parts.iter().any(|part| part.surface.emissivity > 0.0) || machine.nodes.iter().any(|n| n.radiation.is_some());
    radiates || !machine.enclosures.is_empty() || machine.chamber.pressure > 0.0
}

fn chamber(root: &Section<'_>, symbols: &Symbols) -> Result<Chamber> {
    let section = root.section_or_empty("chamber")?;
    let temperature = formula_or(&section, &keys::TEMPERATURE, symbols)?;
    let wall = section.opt("wall_emissivity").map(|value| super::geometry::emissivity(&value)).transpose()?;
    let area = section.opt_positive("wall_area", Dimension::AREA)?;
    let enclosure = match (wall, area) {
        (None, None) => None,
        (Some(wall), Some(area)) => Some((wall, area)),
        (Some(_), None) => {
            return Err(section
                .error_at("wall_area", "'wall_area' is missing")
                .help("the enclosure formula needs both: wall_area = \"40 m2\""));
        }
        (None, Some(_)) => {
            return Err(section
                .error_at("wall_emissivity", "'wall_emissivity' is missing")
                .help("the enclosure formula needs both: wall_emissivity = 0.2"));
        }
    };
    let pressure = keys::PRESSURE.read(&section)?;
    if pressure < 0.0 {
        return Err(section.error_at("pressure", "a pressure cannot be negative").help("leave it out for a perfect vacuum"));
    }
    let accommodation = keys::ACCOMMODATION.read(&section)?;
    if !(accommodation > 0.0 && accommodation <= 1.0) {
        return Err(section
            .error_at("accommodation", "an accommodation coefficient lies above 0 and at most at 1")
            .help("0.9 for machined metal in air"));
    }
    let gap = keys::GAP.read(&section)?;
    section.finish()?;
    Ok(Chamber { temperature, enclosure, pressure, accommodation, gap })
}

fn cells(root: &Section<'_>) -> Result<(usize, Option<f64>)> {
    let section = root.section_or_empty("mesh")?;
    let cells = CELLS.read_whole(&section)?;
    if cells > 1_000_000_000 {
        return Err(section.error_at("cells", "more than 10^9 cells").help("use fewer"));
    }
    let accuracy = section.has(ACCURACY.name).then(|| ACCURACY.read(&section)).transpose()?;
    section.finish()?;
    Ok((cells, accuracy))
}

/// Checks that no two blocks share volume.
fn check_overlaps(root: &Section<'_>, parts: &[Part]) -> Result<()> {
    let blocks: Vec<(&Part, usize)> = parts.iter().flat_map(|part| (0..part.blocks.len()).map(move |block| (part, block))).collect();
    let called = |(part, block): (&Part, usize)| {
        if part.blocks.len() == 1 { format!("'{}'", part.name) } else { format!("block {} of '{}'", block + 1, part.name) }
    };
    for (i, second) in blocks.iter().enumerate() {
        for first in &blocks[..i] {
            if overlap(&first.0.blocks[first.1].shape, &second.0.blocks[second.1].shape) {
                let what = format!("{} and {} overlap", called(*first), called(*second));
                let table = root.section("part")?;
                let help = "move one with 'at' or 'offset', or give the part that surrounds the other room with several blocks";
                return Err(table.section(&second.0.name)?.error(what).help(help));
            }
        }
    }
    super::import::check_overlaps(root, parts)
}

/// Computes the bend factors given as "auto" at the default condition, with the flow shared evenly among branches.
fn bend_factors(machine: &mut Machine, automatic: &[bool], root: &Section<'_>) -> Result<()> {
    for channel in (0..automatic.len()).filter(|channel| automatic[*channel]) {
        let table = root.section("channel")?.section(&machine.channels[channel].name)?;
        let refused = |what: &str| table.error_at("bend_factor", format!("\"auto\" cannot be worked out: {what}"));
        let help = "give defaults under [variables], or the factor itself (1.0 to 1.4)";
        let condition = machine.condition(&[]).map_err(|error| refused(error.what()).help(help))?;
        let supplies = machine.supplies(&machine.values(&condition)?)?;
        let fed = machine.circuits.iter().zip(supplies).find_map(|(c, supply)| Some((c, supply, branches(&c.layout, channel)?)));
        let Some((circuit, supply, ways)) = fed else { continue };
        let flow = supply.flow / ways as f64;
        let state = circuit.liquid.at(supply.temperature).map_err(|error| refused(error.what()).help(help))?;
        let run = &machine.channels[channel];
        let legs: Vec<f64> = run.path.windows(2).map(|leg| distance(leg[0], leg[1])).collect();
        let passes: Vec<f64> = legs.iter().copied().step_by(2).collect();
        let bends: Vec<f64> = legs.iter().copied().skip(1).step_by(2).collect();
        let mean = |lengths: &[f64]| lengths.iter().sum::<f64>() / lengths.len() as f64;
        if bends.is_empty() || mean(&bends) <= run.diameter {
            return Err(refused("the path is no serpentine of passes and bends wider than the diameter")
                .help("give the factor itself (1.0 to 1.4)"));
        }
        if flow <= 0.0 {
            return Err(refused("no coolant flows at the default condition").help(help));
        }
        let re = reynolds(flow, run.diameter, &state);
        let total = run.length.unwrap_or_else(|| legs.iter().sum());
        let FilmSource::Correlation { wall, .. } = run.film else { continue };
        let bendless = StraightChannel { diameter: run.diameter, length: total, wall, velocity_developed: false };
        let straight = nusselt(&bendless, re, state.prandtl(), state.prandtl());
        let factor = serpentine_bend_factor(re, state.prandtl(), run.diameter, mean(&bends), mean(&passes), straight).value;
        if !factor.is_finite() {
            return Err(refused("the correlations give no number here").help(help));
        }
        machine.channels[channel].film = FilmSource::Correlation { bend_factor: factor, wall };
    }
    Ok(())
}
