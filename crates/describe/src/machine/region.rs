//! Parts of faces, for boundaries that do not act on whole faces.

use super::keys::joints as keys;
use super::parts::{Face, Part};
use super::shape::{distance, origin};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

/// Overlap of two regions that counts as rounding, m. Chosen: above the rounding of coordinates of a machine.
const TOUCH: f64 = 1e-9;

/// A part of a face, in the machine's coordinates, m.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// Between two coordinates along each axis; infinite along axes without stated coordinates.
    Ranges {
        /// The smaller coordinates.
        low: [f64; 3],
        /// The larger coordinates.
        high: [f64; 3],
    },
    /// All places within a radius of a point: a disc, if the point lies on a plane face.
    Disc {
        /// The point.
        centre: [f64; 3],
        /// Largest distance from the point, m.
        radius: f64,
    },
}

impl Region {
    /// Whether a point (m) lies in the region.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        match self {
            Self::Ranges { low, high } => (0..3).all(|d| point[d] >= low[d] - TOUCH && point[d] <= high[d] + TOUCH),
            Self::Disc { centre, radius } => distance(point, *centre) <= *radius,
        }
    }

    /// Whether the region shares no area with another.
    pub(super) fn is_apart(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Ranges { low, high }, Self::Ranges { low: l, high: h }) => (0..3).any(|d| high[d].min(h[d]) - low[d].max(l[d]) <= TOUCH),
            (Self::Disc { centre, radius }, Self::Disc { centre: c, radius: r }) => distance(*centre, *c) >= radius + r - TOUCH,
            (Self::Ranges { low, high }, Self::Disc { centre, radius }) | (Self::Disc { centre, radius }, Self::Ranges { low, high }) => {
                let nearest = std::array::from_fn(|d| centre[d].clamp(low[d], high[d]));
                distance(*centre, nearest) >= radius - TOUCH
            }
        }
    }
}

/// Reads `within` of a boundary on `faces`.
pub(super) fn within(section: &Section<'_>, faces: &[Face], parts: &[Part]) -> Result<Option<Region>> {
    let Some(section) = section.opt_section("within")? else { return Ok(None) };
    let Some(first) = faces.first() else {
        return Err(section.error("a lumped node has no parts of a face").help("remove it, or name faces"));
    };
    if faces.iter().any(|face| parts[face.part].import.is_some()) {
        return Err(section
            .error("part of a face of an imported mesh cannot be cut out here")
            .help("give it a physical surface of its own in the mesh, and name that under 'faces'"));
    }
    let is_absolute = keys::WITHIN_COORDINATES.read_word(&section)? == 1;
    if !is_absolute && faces.iter().any(|face| face.part != first.part) {
        return Err(section
            .error("these faces belong to several parts, each with coordinates of its own")
            .help("write coordinates = \"machine\", or one boundary for each part"));
    }
    let from = if is_absolute { [0.0; 3] } else { origin(&parts[first.part]) };
    let region = if section.has("centre") || section.has("radius") {
        let (centre, radius) = (section.value("centre")?.triple(Dimension::LENGTH)?, section.positive("radius", Dimension::LENGTH)?);
        if let Some(key) = section.one_of(&["x", "y", "z"])? {
            return Err(section.error_at(key, "a disc is said by its centre and radius alone").help("remove it, or give ranges instead"));
        }
        Region::Disc { centre: std::array::from_fn(|d| centre[d] + from[d]), radius }
    } else {
        let (mut low, mut high) = ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);
        for (d, key) in ["x", "y", "z"].into_iter().enumerate() {
            if let Some((l, h)) = section.opt_range(key, Dimension::LENGTH)? {
                (low[d], high[d]) = (l + from[d], h + from[d]);
            }
        }
        if low.iter().all(|l| l.is_infinite()) {
            let help = "write within = { x = [\"10 mm\", \"30 mm\"] } or { centre = [x, y, z], radius = \"10 mm\" }";
            return Err(section.error("this says no part of a face").help(help));
        }
        Region::Ranges { low, high }
    };
    section.finish()?;
    Ok(Some(region))
}
