//! Coolant channels and the circuits that feed them.

use super::condition::Symbols;
use super::film::Film;
use super::fluids::Fluids;
use super::keys::flow as keys;
use super::names::{Index, lookup};
use super::shape::{distance, origin, part_contains};
use super::variables::formula_or;
use super::{Part, Shape};
use crate::describe::schema::Key;
use crate::error::Result;
use crate::foundation::document::{Section, Value};
use crate::foundation::formula::Formula;
use crate::physics::channel::Wall;
use crate::physics::liquid::Liquid;
use crate::units::{Dimension, ZERO_CELSIUS};

/// A coolant channel: a round hole along a path through parts.
#[derive(Debug, Clone)]
pub struct Channel {
    /// Name.
    pub name: String,
    /// Corners of the path, m, in the machine's coordinates, from inlet to outlet.
    pub path: Vec<[f64; 3]>,
    /// Index of the part it runs through.
    pub part: usize,
    /// Hydraulic diameter, m.
    pub diameter: f64,
    /// Wetted length, m; `None` takes the length of the path.
    pub length: Option<f64>,
    /// How its film is found.
    pub film: Film,
    /// Factor on it: fouling, or a correlation known to be off (1 = as found).
    pub film_factor: f64,
    /// Resistance of scale on the wall, in series with the film, m² K/W.
    pub fouling_resistance: f64,
    /// Loss coefficients summed over the bends, inlet and outlet.
    pub minor_loss: f64,
    /// Wall roughness, m.
    pub roughness: f64,
    /// Whether it is the bore of a hollow cylinder, whose inner face is its wall; otherwise a hole in solid.
    pub is_bore: bool,
}

/// A coolant circuit: what flows in, and through which channels.
#[derive(Debug, Clone)]
pub struct Circuit {
    /// Name.
    pub name: String,
    /// Volume flow, m³/s at inlet conditions.
    pub flow: Formula,
    /// Inlet temperature, K.
    pub inlet: Formula,
    /// Properties of the liquid.
    pub liquid: Liquid,
    /// Absolute pressure where it is lowest, Pa: what the liquid boils under.
    pub pressure: f64,
    /// The order in which the channels are passed.
    pub layout: Layout,
    /// Whether viscous dissipation heats the liquid.
    pub dissipation: bool,
}

/// Channels in series and parallel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Layout {
    /// Index into [`Machine::channels`](super::Machine::channels).
    Channel(usize),
    /// One after the other.
    Series(Vec<Layout>),
    /// Side by side; the flow splits so that the pressure drops agree.
    Parallel(Vec<Layout>),
}

/// Most corners of a path.
const MOST_CORNERS: usize = 20_000;

/// Reads `[channel.NAME]`; the flags say which bend factors are to be found ("auto").
pub(super) fn channels(root: &Section<'_>, parts: &[Part], symbols: &Symbols) -> Result<(Vec<Channel>, Vec<bool>)> {
    let (mut found, mut automatic) = (Vec::new(), Vec::new());
    for (name, section) in root.sections("channel")? {
        let index = Index { parts, nodes: &[], channels: &[] };
        let part = index.part(&section.value("in")?)?;
        if parts[part].import.is_some() {
            return Err(section
                .error_at("in", format!("'{}' is an imported mesh, and channels run through blocks only", parts[part].name))
                .help("leave the hole in the mesh, name its wall as a physical surface, and give that a [boundary.NAME] with film and fluid_temperature"));
        }
        let bore = bore(&section, &parts[part])?;
        let is_bore = bore.is_some();
        if found.iter().any(|c: &Channel| is_bore && c.is_bore && c.part == part) {
            return Err(section.error_at("bore", format!("another channel takes the bore of '{}' already", parts[part].name)));
        }
        let (diameter, path) = match bore {
            Some(bore) => bore,
            None => (section.positive("diameter", Dimension::LENGTH)?, path(&section, &parts[part])?),
        };
        let straight: f64 = path.windows(2).map(|w| distance(w[0], w[1])).sum();
        if diameter >= straight {
            return Err(section
                .error_at("diameter", "the channel is wider than it is long")
                .help(format!("its path is {straight} m long; check the units")));
        }
        let length = section.opt_positive("length", Dimension::LENGTH)?;
        let wall = [Wall::Flux, Wall::Temperature][keys::WALL.read_word(&section)?];
        let auto = section.opt("bend_factor").is_some_and(|value| value.text().is_ok_and(|text| text == "auto"));
        let bend_factor = if auto { 1.0 } else { keys::BEND_FACTOR.read(&section)? };
        if !(0.5..=3.0).contains(&bend_factor) {
            return Err(section
                .error_at("bend_factor", "bends raise the film by a factor between 1 and 1.4")
                .help("give 1.0..1.4, or \"auto\""));
        }
        let film = Film::read(&section, symbols)?.unwrap_or(Film::Correlation { bend_factor, wall });
        let film_factor = keys::FILM_FACTOR.read(&section)?;
        if !(1e-3..=1e3).contains(&film_factor) {
            return Err(section
                .error_at("film_factor", "the factor on a film lies between 0.001 and 1000")
                .help("1 is a clean channel; 0.7 a fouled one"));
        }
        let fouling_resistance = keys::FOULING_RESISTANCE.read(&section)?;
        if !(0.0..=0.1).contains(&fouling_resistance) {
            return Err(section
                .error_at("fouling_resistance", "the resistance of scale lies between 0 and 0.1 m2 K/W")
                .help("\"2e-4 m2 K/W\" is 0.4 mm of lime"));
        }
        let minor_loss = keys::MINOR_LOSS.read(&section)?;
        if minor_loss < 0.0 {
            return Err(section
                .error_at("minor_loss", "a loss coefficient cannot be negative")
                .help("the sum over bends, inlet and outlet"));
        }
        let roughness = keys::ROUGHNESS.read(&section)?;
        if !(0.0..diameter / 2.0).contains(&roughness) {
            return Err(section
                .error_at("roughness", "the roughness must lie between zero and the radius")
                .help("drilled holes: \"2 um\""));
        }
        section.finish()?;
        automatic.push(auto);
        found.push(Channel { name, path, part, diameter, length, film, film_factor, fouling_resistance, minor_loss, roughness, is_bore });
    }
    Ok((found, automatic))
}

/// Diameter and path of the bore of a hollow cylinder, where the section asks for it.
fn bore(section: &Section<'_>, part: &Part) -> Result<Option<(f64, Vec<[f64; 3]>)>> {
    let Some(reversed) = section.opt_choice("bore", &["start", "end"])? else { return Ok(None) };
    let hollow = match part.blocks.as_slice() {
        [block] => match &block.shape {
            Shape::Cylinder { axis, base, length, inner, turn, .. } if *inner > 0.0 && turn.1 - turn.0 >= std::f64::consts::TAU - 1e-9 => {
                let mut far = *base;
                far[axis.index()] += length;
                Some((2.0 * inner, *base, far))
            }
            _ => None,
        },
        _ => None,
    };
    let Some((diameter, start, end)) = hollow else {
        return Err(section
            .error_at("bore", format!("'{}' is not one hollow cylinder", part.name))
            .help("give path = [...] and a diameter for a channel in solid material"));
    };
    if let Some(key) = section.one_of(&["diameter", "path", "serpentine", "coordinates"])? {
        return Err(section.error_at(key, format!("the cylinder says it all: a bore has no '{key}'")).help("remove it"));
    }
    Ok(Some((diameter, if reversed == 0 { vec![start, end] } else { vec![end, start] })))
}

/// The corners of a channel in the machine's coordinates, checked to lie inside its part.
fn path(section: &Section<'_>, part: &Part) -> Result<Vec<[f64; 3]>> {
    if part.blocks.iter().any(|block| matches!(block.shape, Shape::Sphere { .. })) {
        return Err(section
            .error_at("in", format!("'{}' has a spherical block, whose temperature depends on the radius alone", part.name))
            .help("run the channel through a part of boxes and cylinders"));
    }
    let absolute = absolute(section)?;
    let key = section.one_of(&["path", "serpentine"])?;
    let value = section.value(key.unwrap_or("path"))?;
    let path = if key == Some("serpentine") {
        if section.has("coordinates") {
            return Err(section.error_at("coordinates", "a serpentine has no coordinates").help("remove it"));
        }
        serpentine(value.section()?, part)?
    } else {
        let from = if absolute { [0.0; 3] } else { origin(part) };
        let corners = value.list()?;
        if corners.len() > MOST_CORNERS {
            return Err(section.error_at("path", format!("more than {MOST_CORNERS} corners")));
        }
        let corner = |corner: &Value<'_>| corner.triple(Dimension::LENGTH).map(|p| std::array::from_fn(|d| p[d] + from[d]));
        corners.iter().map(corner).collect::<Result<Vec<[f64; 3]>>>()?
    };
    let place = section.value(key.unwrap_or("path"))?;
    if path.len() < 2 {
        return Err(place.error("a path has two corners or more").help("write path = [[x, y, z], [x, y, z], ...] with units"));
    }
    for (i, leg) in path.windows(2).enumerate() {
        if distance(leg[0], leg[1]) < 1e-9 {
            return Err(place.error(format!("corners {} and {} of this path coincide", i + 1, i + 2)).help("remove one of them"));
        }
        // Blocks of one part may leave room between them, so the legs are looked at too, not the corners alone.
        for step in 0..=64 {
            let s = f64::from(step) / 64.0;
            let point: [f64; 3] = std::array::from_fn(|d| leg[0][d] + s * (leg[1][d] - leg[0][d]));
            if !part_contains(part, point) {
                let from = origin(part);
                let shown: Vec<String> = (0..3).map(|d| format!("{:.6} m", point[d] - from[d])).collect();
                let what =
                    format!("the path leaves the part '{}' between corners {} and {}, at [{}]", part.name, i + 1, i + 2, shown.join(", "));
                return Err(place
                    .error(what)
                    .help("coordinates are relative to the smallest corner of the part's first block unless coordinates = \"machine\""));
            }
        }
    }
    Ok(path)
}

/// Whether coordinates are those of the machine, not those of the part.
pub(super) fn absolute(section: &Section<'_>) -> Result<bool> {
    Ok(keys::COORDINATES.read_word(section)? == 1)
}

/// Parallel passes joined at alternating ends, in a box.
fn serpentine(section: Section<'_>, part: &Part) -> Result<Vec<[f64; 3]>> {
    let number = keys::BLOCK.read_whole(&section)?;
    let Some(Shape::Box { min, max }) = part.blocks.get(number - 1).map(|block| &block.shape) else {
        return Err(section
            .error_at("block", format!("block {number} of '{}' is no box", part.name))
            .help("a serpentine needs a box; give path = [...] for other shapes"));
    };
    let direction = |key: &Key| key.read_word(&section).map(|at| (at / 2, at % 2 == 0));
    let (along, forward) = direction(&keys::ALONG)?;
    let (across, upward) = direction(&keys::ACROSS)?;
    if along == across {
        return Err(section
            .error_at("across", "'along' and 'across' are the same axis")
            .help("the passes run along one axis and are stacked across another"));
    }
    let level_axis = 3 - along - across;
    let passes = section.integer("passes", 1)?;
    if passes > MOST_CORNERS / 2 {
        return Err(section.error_at("passes", format!("more than {} passes", MOST_CORNERS / 2)).help("use fewer"));
    }
    let pitch = if passes > 1 {
        section.positive("pitch", Dimension::LENGTH)?
    } else {
        section.opt_positive("pitch", Dimension::LENGTH)?.unwrap_or(0.0)
    };
    let margin = section.opt_quantity("margin", Dimension::LENGTH)?.unwrap_or(pitch / 2.0);
    let size = |axis: usize| max[axis] - min[axis];
    if margin < 0.0 || 2.0 * margin >= size(along) {
        return Err(section
            .error_at("margin", "the passes have no length left")
            .help(format!("the box is {} m long there; the margin is left free at both ends", size(along))));
    }
    let width = pitch * (passes - 1) as f64;
    if width > size(across) {
        let help = format!("{passes} passes need {width} m, the box has {} m", size(across));
        return Err(section.error_at("pitch", "the passes do not fit into the box").help(help));
    }
    let level = section.opt_quantity("level", Dimension::LENGTH)?.unwrap_or(size(level_axis) / 2.0);
    if !(0.0..=size(level_axis)).contains(&level) {
        return Err(section
            .error_at("level", "the level lies outside the box")
            .help(format!("between 0 and {} m above the low face", size(level_axis))));
    }
    let first = section.opt_quantity("first", Dimension::LENGTH)?.unwrap_or((size(across) - width) / 2.0);
    if first < 0.0 || first + width > size(across) + 1e-9 {
        return Err(section
            .error_at("first", "the passes do not fit into the box")
            .help("'first' is the distance of the first pass from the side it starts at"));
    }
    section.finish()?;
    let mut path = Vec::with_capacity(2 * passes);
    for pass in 0..passes {
        let mut point = *min;
        point[level_axis] += level;
        let step = first + pitch * pass as f64;
        point[across] = if upward { min[across] + step } else { max[across] - step };
        let (mut start, mut end) = (point, point);
        (start[along], end[along]) = (min[along] + margin, max[along] - margin);
        if forward == (pass % 2 == 0) {
            path.extend([start, end]);
        } else {
            path.extend([end, start]);
        }
    }
    Ok(path)
}

/// Reads `[circuit.NAME]`; every channel must be fed exactly once.
pub(super) fn circuits(root: &Section<'_>, names: &[String], symbols: &Symbols, fluids: &Fluids) -> Result<Vec<Circuit>> {
    let mut found = Vec::new();
    let mut fed: Vec<Option<String>> = vec![None; names.len()];
    for (name, section) in root.sections("circuit")? {
        let flow = formula_or(&section, &keys::FLOW, symbols)?;
        if flow.as_constant().is_some_and(|q| q < 0.0) {
            return Err(section.error_at("flow", "a flow cannot be negative").help("turn the layout round instead"));
        }
        let inlet = formula_or(&section, &keys::INLET_TEMPERATURE, symbols)?;
        let liquid = match section.opt("liquid") {
            None => Liquid::Water,
            Some(value) if value.is_text() => fluids.find(&value)?,
            Some(value) => {
                let table = value.section()?;
                let liquid = Liquid::Constant {
                    density: table.positive("density", Dimension::DENSITY)?,
                    specific_heat: table.positive("specific_heat", Dimension::SPECIFIC_HEAT)?,
                    viscosity: table.positive("viscosity", Dimension::VISCOSITY)?,
                    conductivity: table.positive("conductivity", Dimension::CONDUCTIVITY)?,
                };
                table.finish()?;
                liquid
            }
        };
        let layout = layout(&section.value("layout")?, true, names, &name, &mut fed)?;
        let dissipation = keys::DISSIPATION.read_flag(&section)?;
        let pressure = keys::PRESSURE.read(&section)?;
        if !(1e3..=1e6).contains(&pressure) {
            return Err(section.error_at("pressure", "properties of liquids hold from 0.01 to 10 bar").help("state the absolute pressure"));
        }
        let boils = liquid.boils_at(pressure);
        if let Some((inlet, boils)) = inlet.as_constant().zip(boils).filter(|(inlet, boils)| inlet > boils) {
            let help = format!(
                "water boils at {:.1} degC under {:.4} bar: state the circuit's absolute pressure",
                boils - ZERO_CELSIUS,
                pressure / 1e5
            );
            let what = format!("the water enters as steam, at {:.1} degC", inlet - ZERO_CELSIUS);
            return Err(section.error_at("inlet_temperature", what).help(help));
        }
        section.finish()?;
        found.push(Circuit { name, flow, inlet, liquid, pressure, layout, dissipation });
    }
    match fed.iter().position(Option::is_none) {
        None => Ok(found),
        Some(at) => {
            let what = format!("no circuit feeds the channel '{}'", names[at]);
            let table = root.section("channel")?;
            Err(table.error_at(&names[at], what).help("name it in the layout of a [circuit.NAME]"))
        }
    }
}

/// The outer list is in series, a list inside it in parallel, a list inside that in series, and so on.
fn layout(value: &Value<'_>, series: bool, names: &[String], circuit: &str, fed: &mut [Option<String>]) -> Result<Layout> {
    if value.is_text() {
        let channel = lookup(value, names, "channel")?;
        if let Some(other) = &fed[channel] {
            return Err(value
                .error(format!("the channel '{}' is fed already, by circuit '{other}'", names[channel]))
                .help("name every channel once"));
        }
        fed[channel] = Some(circuit.to_string());
        return Ok(Layout::Channel(channel));
    }
    let entries = value.list()?;
    if entries.is_empty() {
        return Err(value
            .error("this part of the layout is empty")
            .help("write layout = [\"first\", [\"one side\", \"other side\"], \"last\"]"));
    }
    let mut inside = entries.iter().map(|entry| layout(entry, !series, names, circuit, fed)).collect::<Result<Vec<_>>>()?;
    match (inside.len(), inside.pop()) {
        (1, Some(only)) => Ok(only),
        (_, last) => {
            inside.extend(last);
            Ok(if series { Layout::Series(inside) } else { Layout::Parallel(inside) })
        }
    }
}

/// How many ways side by side the flow has taken where it passes `channel`; `None` if it does not.
pub(super) fn branches(layout: &Layout, channel: usize) -> Option<usize> {
    match layout {
        Layout::Channel(index) => (*index == channel).then_some(1),
        Layout::Series(inside) => inside.iter().find_map(|layout| branches(layout, channel)),
        Layout::Parallel(inside) => inside.iter().find_map(|layout| branches(layout, channel)).map(|n| n * inside.len()),
    }
}
