//! Enclosures: surfaces that exchange radiation.

use std::path::{Path, PathBuf};

use super::geometry::emissivity;
use super::keys::radiation as keys;
use super::names::Index;
use super::parts::{Face, Place};
use coldplate_base::document::{Section, Value};
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

/// Grey diffuse surfaces that exchange radiation, each with all others.
#[derive(Debug, Clone)]
pub struct Enclosure {
    /// Name.
    pub name: String,
    /// Surfaces of the enclosure.
    pub surfaces: Vec<EnclosureSurface>,
    /// View factors between the surfaces.
    pub views: Views,
    /// Whether no radiation leaves between the surfaces; otherwise the rest of each surface's view is the chamber.
    pub closed: bool,
    /// Largest error of given view factors in reciprocity and in the sum of a row (dimensionless).
    pub tolerance: f64,
    /// File that keeps view factors computed by rays, if any.
    pub cache: Option<std::path::PathBuf>,
    /// Line in the machine file.
    pub line: usize,
}

/// One surface of an enclosure.
#[derive(Debug, Clone)]
pub struct EnclosureSurface {
    /// Name in reports: the text that named the surface.
    pub name: String,
    /// Place of the surface; `None` is the chamber wall.
    pub place: Option<Place>,
    /// Emissivity.
    pub emissivity: f64,
    /// Area, m²; `None` takes the open area of the faces.
    pub area: Option<f64>,
    /// Number of pieces along the two axes of the surface's faces.
    pub patches: [usize; 2],
}

/// Source of the view factors of an enclosure.
#[derive(Debug, Clone)]
pub enum Views {
    /// From the file, row by row; `None` entries follow from the others.
    Given(Vec<Vec<Option<f64>>>),
    /// In closed form if there is one, else by this many rays from each surface.
    Computed {
        /// Rays from each surface.
        rays: usize,
        /// Whether closed forms may be used.
        closed_forms: bool,
    },
}

/// Largest number of rays from each surface (count). Chosen: bounds the time of the search; the error of a view factor
/// falls with the root of the number.
const MOST_RAYS: usize = 100_000_000;
/// Largest number of pieces of a surface along one axis (count). Chosen: bounds the time, which grows with the square
/// of the pieces.
const MOST_PATCHES: usize = 32;

/// Reads `[enclosure.NAME]`; `wall` is the chamber's emissivity and area, `file` the machine file.
pub(super) fn enclosures(root: &Section<'_>, index: &Index<'_>, wall: Option<(f64, f64)>, file: &Path) -> Result<Vec<Enclosure>> {
    let mut found: Vec<Enclosure> = Vec::new();
    for (name, section) in root.sections("enclosure")? {
        let mut surfaces: Vec<EnclosureSurface> = Vec::new();
        for (i, entry) in section.list("surfaces")?.iter().enumerate() {
            let read = surface(entry.section()?, index, wall)?;
            let earlier = found.iter().flat_map(|e| &e.surfaces).chain(&surfaces).any(|s| shares(s.place, read.place));
            if earlier {
                return Err(entry
                    .error(format!("'{}' is a surface of an enclosure already", read.name))
                    .help("a surface belongs to one enclosure and stands there once"));
            }
            if read.place.is_none() && i != section.list("surfaces")?.len() - 1 {
                return Err(entry.error("the chamber must be the last surface").help("move it to the end of the list"));
            }
            surfaces.push(read);
        }
        if surfaces.is_empty() {
            return Err(section.error_at("surfaces", "this enclosure has no surface").help(EXAMPLE));
        }
        let has_chamber = surfaces.iter().any(|s| s.place.is_none());
        let closed = section.opt_flag("closed")?.unwrap_or(has_chamber);
        if has_chamber && !closed {
            return Err(section.error_at("closed", "an enclosure with the chamber among its surfaces is closed").help("remove 'closed'"));
        }
        let views = views(&section, &surfaces)?;
        let tolerance = keys::TOLERANCE.read(&section)?;
        if !(0.0..=0.1).contains(&tolerance) {
            return Err(section.error_at("tolerance", "the tolerance lies between 0 and 0.1").help("0.001 for tables of three digits"));
        }
        let cache = keys::CACHE.read_flag(&section)?.then(|| beside(file, &name)).flatten();
        let line = section.line();
        section.finish()?;
        found.push(Enclosure { name, surfaces, views, closed, tolerance, cache, line });
    }
    Ok(found)
}

/// Help text with an example of surfaces.
const EXAMPLE: &str = "write surfaces = [{ face = \"plate.+z\", emissivity = 0.6 }, { face = \"lid.-z\", emissivity = 0.3 }]";

/// Whether two places have a face or node in common.
fn shares(a: Option<Place>, b: Option<Place>) -> bool {
    match (a, b) {
        (Some(Place::Part(p)), Some(Place::Part(q))) => p == q,
        (Some(Place::Part(p)), Some(Place::Face(f))) | (Some(Place::Face(f)), Some(Place::Part(p))) => f.part == p,
        (Some(Place::Face(f)), Some(Place::Face(g))) => {
            f.part == g.part && f.side == g.side && (f.block.is_none() || g.block.is_none() || f.block == g.block)
        }
        (Some(Place::Node(_)), Some(Place::Node(_))) => false, // the two sides of a plate may be one node
        _ => false,
    }
}

fn surface(section: Section<'_>, index: &Index<'_>, wall: Option<(f64, f64)>) -> Result<EnclosureSurface> {
    let Some(kind) = section.one_of(&["face", "part", "node", "chamber"])? else {
        return Err(section.error("this surface is nowhere").help("give one of face, part, node, or chamber = true"));
    };
    let value = section.value(kind)?;
    let place = match kind {
        "face" => Some(Place::Face(index.face(&value)?)),
        "part" => Some(Place::Part(index.part(&value)?)),
        "node" => Some(Place::Node(index.node(&value)?)),
        _ => {
            if !value.flag()? {
                return Err(value.error("'chamber' can only be true").help("remove the entry if the wall is no surface of the enclosure"));
            }
            None
        }
    };
    let part = match place {
        Some(Place::Face(Face { part, .. }) | Place::Part(part)) => Some(&index.parts[part]),
        Some(Place::Node(_)) | None => None,
    };
    if let Some(part) = part.filter(|part| part.import.is_some()) {
        return Err(value
            .error(format!("'{}' is an imported mesh, and the surfaces of an enclosure are those of blocks", part.name))
            .help("join it with a [radiation_link.NAME], or leave it out: rays that fall on it count as the chamber's"));
    }
    let name = if place.is_some() { value.text()? } else { "chamber".into() };
    let area = section.opt_positive("area", Dimension::AREA)?;
    if area.is_some() && matches!(place, Some(Place::Face(_) | Place::Part(_))) {
        return Err(section
            .error_at("area", "the area of a face is its open area")
            .help("remove 'area'; it belongs to nodes and the chamber"));
    }
    let area = area.or(if place.is_none() { wall.map(|w| w.1) } else { None });
    if area.is_none() && !matches!(place, Some(Place::Face(_) | Place::Part(_))) {
        return Err(section.error_at("area", "the area of this surface is missing").help("write area = \"0.02 m2\""));
    }
    let emissivity = match (section.opt("emissivity"), place, wall) {
        (None, None, Some((wall, _))) => wall,
        _ => emissivity(&section.value("emissivity")?)?,
    };
    let patches = match section.opt("patches") {
        None => [1, 1],
        Some(value) => {
            let list = value.list()?;
            let [a, b] = list.as_slice() else {
                return Err(value.error("two whole numbers are wanted here").help("write patches = [4, 4]"));
            };
            if !matches!(place, Some(Place::Face(_) | Place::Part(_))) {
                return Err(value.error("this surface has one temperature and cannot be cut").help("remove 'patches'"));
            }
            let count = |v: &Value<'_>| {
                let n = v.integer(1)?;
                if n > MOST_PATCHES {
                    Err(v.error(format!("more than {MOST_PATCHES} patches along one axis")).help("use fewer"))
                } else {
                    Ok(n)
                }
            };
            [count(a)?, count(b)?]
        }
    };
    section.finish()?;
    Ok(EnclosureSurface { name, place, emissivity, area, patches })
}

fn views(section: &Section<'_>, surfaces: &[EnclosureSurface]) -> Result<Views> {
    let value = section.value("view_factors")?;
    if value.is_text() {
        let closed_forms = value.choice(&["computed", "rays"])? == 0;
        if let Some(node) = surfaces.iter().find(|s| matches!(s.place, Some(Place::Node(_)))) {
            return Err(value
                .error(format!("the node '{}' has no shape to compute view factors from", node.name))
                .help("give view_factors as a table, [[0, 0.2, ...], ...]"));
        }
        let rays = keys::RAYS.read_whole(section)?;
        if rays > MOST_RAYS {
            return Err(section.error_at("rays", format!("more than {MOST_RAYS} rays")).help("the error falls about with their number"));
        }
        return Ok(Views::Computed { rays, closed_forms });
    }
    if section.has(keys::RAYS.name) {
        return Err(section
            .error_at("rays", "given view factors need no rays")
            .help("remove 'rays', or write view_factors = \"computed\""));
    }
    let n = surfaces.len();
    if let Some(cut) = surfaces.iter().find(|s| s.patches != [1, 1]) {
        return Err(value
            .error(format!("a table of view factors has one row for '{}', which is cut into patches", cut.name))
            .help("write view_factors = \"computed\", or remove 'patches'"));
    }
    let rows = value.list()?;
    if rows.len() != n {
        return Err(value
            .error(format!("the table has {} rows for {n} surfaces", rows.len()))
            .help("one row and one column per surface, in the order of 'surfaces'"));
    }
    let entry = |value: &Value<'_>| -> Result<Option<f64>> {
        if value.is_text() && value.text()?.trim() == "?" {
            return Ok(None);
        }
        let number = value.number()?;
        if !(0.0..=1.0).contains(&number) {
            return Err(value
                .error("a view factor lies between 0 and 1")
                .help("the share of the row's radiation that reaches the column's surface; \"?\" if it follows from the others"));
        }
        Ok(Some(number))
    };
    let mut table = Vec::new();
    for row in &rows {
        let entries = row.list()?;
        if entries.len() != n {
            return Err(row
                .error(format!("this row has {} entries for {n} surfaces", entries.len()))
                .help("one per surface, the surface itself included (0 where it is flat or convex)"));
        }
        table.push(entries.iter().map(entry).collect::<Result<Vec<_>>>()?);
    }
    Ok(Views::Given(table))
}

/// The cache of an enclosure, next to the machine file; `None` for a machine that comes from no file.
fn beside(file: &Path, enclosure: &str) -> Option<PathBuf> {
    let folder = file.parent()?;
    let stem = file.file_stem()?.to_string_lossy();
    let plain: String = enclosure.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect();
    file.is_file().then(|| folder.join(format!("{stem}.{plain}.views")))
}
