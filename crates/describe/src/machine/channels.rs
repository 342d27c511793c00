//! Coolant channels.

use super::film::FilmSource;
use super::keys::flow as keys;
use super::names::Index;
use super::parts::{BlockShape, Part};
use super::shape::{distance, origin, part_contains};
use super::symbols::Symbols;
use crate::schema::Key;
use coldplate_base::document::{Section, Value};
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;
use coldplate_physics::channel::Wall;

/// A coolant channel: a round hole along a path through parts.
#[derive(Debug, Clone)]
pub struct Channel {
    /// Name.
    pub name: String,
    /// Corners of the path, m, in the machine's coordinates, from inlet to outlet.
    pub path: Vec<[f64; 3]>,
    /// Index of the part the channel runs through.
    pub part: usize,
    /// Hydraulic diameter, m.
    pub diameter: f64,
    /// Wetted length, m; `None` takes the length of the path.
    pub length: Option<f64>,
    /// Source of the film coefficient.
    pub film: FilmSource,
    /// Factor on the film (dimensionless): fouling, or a correlation known to be off; 1 leaves the film unchanged.
    pub film_factor: f64,
    /// Resistance of scale on the wall, in series with the film, m² K/W.
    pub fouling_resistance: f64,
    /// Loss coefficients summed over the bends, inlet and outlet.
    pub minor_loss: f64,
    /// Wall roughness, m.
    pub roughness: f64,
    /// Whether the channel is the bore of a hollow cylinder, with the inner face as its wall; otherwise it is a hole in
    /// solid.
    pub is_bore: bool,
}

/// Largest number of corners of a path (count). Chosen: bounds memory and time against a mistyped pitch.
const MOST_CORNERS: usize = 20_000;

/// Reads `[channel.NAME]`; the flags mark bend factors given as "auto".
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
        let film = FilmSource::read(&section, symbols)?.unwrap_or(FilmSource::Correlation { bend_factor, wall });
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

/// Diameter and path of the bore of a hollow cylinder, if the section asks for one.
fn bore(section: &Section<'_>, part: &Part) -> Result<Option<(f64, Vec<[f64; 3]>)>> {
    let Some(reversed) = section.opt_choice("bore", &["start", "end"])? else { return Ok(None) };
    let hollow = match part.blocks.as_slice() {
        [block] => match &block.shape {
            BlockShape::Cylinder { axis, base, length, inner, turn, .. }
                if *inner > 0.0 && turn.1 - turn.0 >= std::f64::consts::TAU - 1e-9 =>
            {
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
    if part.blocks.iter().any(|block| matches!(block.shape, BlockShape::Sphere { .. })) {
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
        // Blocks of one part may leave room between them: the legs are checked too, not the corners alone.
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

/// Whether the coordinates are in the system of the machine, not of the part.
pub(super) fn absolute(section: &Section<'_>) -> Result<bool> {
    Ok(keys::COORDINATES.read_word(section)? == 1)
}

/// Parallel passes joined at alternating ends, in a box.
fn serpentine(section: Section<'_>, part: &Part) -> Result<Vec<[f64; 3]>> {
    let number = keys::BLOCK.read_whole(&section)?;
    let Some(BlockShape::Box { min, max }) = part.blocks.get(number - 1).map(|block| &block.shape) else {
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
