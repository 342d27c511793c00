//! Thermal displacement: supports of the machine, stiffness of joints, and sensors of displacement.

use super::channels::absolute;
use super::geometry::check_length;
use super::keys::elastic::{AXES, DIRECTIONS, JOINT, NORMAL_STIFFNESS, REFERENCE_TEMPERATURE, TANGENTIAL_STIFFNESS};
use super::names::Index;
use super::parts::Face;
use super::readings::{Displacement, Sensor, SensorReading};
use super::response::SensorResponse;
use super::shape::{origin, part_contains};
use coldplate_base::document::{Section, Value};
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

/// Supports of the machine, and the reference of its displacements.
#[derive(Debug, Clone, PartialEq)]
pub struct Elasticity {
    /// Temperature at which nothing is displaced, K.
    pub reference: f64,
    /// Supports of the machine.
    pub supports: Vec<Support>,
}

/// Faces that do not move.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    /// Name.
    pub name: String,
    /// The faces.
    pub faces: Vec<Face>,
    /// Whether the faces are held along x, y, z.
    pub holds: [bool; 3],
}

/// Effect of a joint on the movements of its two sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointKind {
    /// Both sides move as one.
    Glued,
    /// The joint connects nothing.
    Open,
    /// Springs per area, N/m³, across the joint and along it: infinite is rigid, 0 leaves the sides free.
    Springs {
        /// Stiffness across the joint, N/m³.
        normal: f64,
        /// Stiffness along the joint, N/m³.
        tangential: f64,
    },
}

impl JointKind {
    pub(super) fn read(section: &Section<'_>) -> Result<Self> {
        let kind = JOINT.read_word(section)?;
        let [normal, tangential] = [&NORMAL_STIFFNESS, &TANGENTIAL_STIFFNESS]
            .map(|key| if section.has(key.name) { key.read(section).map(Some) } else { Ok(None) });
        match (kind, normal?, tangential?) {
            (0, None, None) => Ok(Self::Glued),
            (0, normal, tangential) => {
                Ok(Self::Springs { normal: normal.unwrap_or(f64::INFINITY), tangential: tangential.unwrap_or(f64::INFINITY) })
            }
            (1, normal, None) => Ok(Self::Springs { normal: normal.unwrap_or(f64::INFINITY), tangential: 0.0 }),
            (1, _, Some(_)) => Err(section
                .error_at(TANGENTIAL_STIFFNESS.name, "a sliding joint resists nothing along its faces")
                .help("leave it out, or leave out joint = \"sliding\"")),
            (_, None, None) => Ok(Self::Open),
            _ => Err(section.error_at(JOINT.name, "an open joint has no stiffness").help("leave the stiffness out, or the joint")),
        }
    }
}

/// Temperatures at which a machine may have no displacement, K. Chosen: from liquid helium to the melting point of steel.
const REFERENCES: std::ops::Range<f64> = 4.0..1800.0;

/// Reads `[elasticity]` and `[support.NAME]`.
pub(super) fn elasticity(root: &Section<'_>, index: &Index<'_>) -> Result<Elasticity> {
    let section = root.section_or_empty("elasticity")?;
    let reference = REFERENCE_TEMPERATURE.read(&section)?;
    if !REFERENCES.contains(&reference) {
        let error = section.error_at(REFERENCE_TEMPERATURE.name, "no machine is assembled at this temperature");
        return Err(error.help("20 degC is usual (ISO 1)"));
    }
    section.finish()?;
    let mut supports = Vec::new();
    for (name, section) in root.sections("support")? {
        check_length(&name, &section)?;
        let faces = section.list("faces")?.iter().map(|face| index.face(face)).collect::<Result<Vec<_>>>()?;
        let mut holds = [true; 3];
        if let Some(directions) = section.opt("directions") {
            holds = [false; 3];
            for word in directions.list()? {
                holds[word.choice(&AXES)?] = true;
            }
        }
        section.finish()?;
        supports.push(Support { name, faces, holds });
    }
    Ok(Elasticity { reference, supports })
}

/// Reads `[displacement.NAME]`: sensors that follow the others.
pub(super) fn displacements(root: &Section<'_>, index: &Index<'_>, sensors: &[Sensor]) -> Result<Vec<Sensor>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("displacement")? {
        check_length(&name, &section)?;
        if sensors.iter().any(|sensor| sensor.name == name) {
            return Err(section.error(format!("'{name}' is the name of a sensor and of a displacement")).help("rename one of them"));
        }
        let is_absolute = absolute(&section)?;
        let place = |key: &str, part: &str| -> Result<(usize, [f64; 3])> {
            let (value, part) = (section.value(key)?, index.part(&section.value(part)?)?);
            let at = value.triple(Dimension::LENGTH)?;
            let from = if is_absolute { [0.0; 3] } else { origin(&index.parts[part]) };
            let point: [f64; 3] = std::array::from_fn(|d| at[d] + from[d]);
            if !part_contains(&index.parts[part], point) {
                let help = "coordinates are relative to the smallest corner of the part's first block (cylinders: the centre of its \
                            base) unless coordinates = \"machine\"";
                return Err(value.error(format!("this point lies outside the part '{}'", index.parts[part].name)).help(help));
            }
            Ok((part, point))
        };
        let of = place("point", "in")?;
        let relative_to = match (section.has("relative_to"), section.has("relative_in")) {
            (false, false) => None,
            _ => Some(place("relative_to", "relative_in")?),
        };
        let direction = direction(&section.value("direction")?)?;
        let line = section.line();
        section.finish()?;
        let reads = SensorReading::Displacement(Displacement { of, relative_to, direction, line });
        found.push(Sensor { name, reads, shows: SensorResponse::default() });
    }
    Ok(found)
}

/// Displacements with a limited magnitude, each repeated with the opposite sign: if both values are small, the
/// magnitude is.
pub(super) fn turned(root: &Section<'_>, sensors: &[Sensor]) -> Result<Vec<Sensor>> {
    let mut found: Vec<Sensor> = Vec::new();
    for (_, section) in root.sections("limit")?.into_iter().filter(|(_, section)| section.has("magnitude")) {
        let Some(value) = section.opt("sensor") else { continue };
        let named = value.text()?;
        let Some((own, SensorReading::Displacement(reads))) = sensors.iter().find(|s| s.name == named).map(|own| (own, &own.reads)) else {
            continue;
        };
        let name = turned_name(&own.name);
        if sensors.iter().chain(&found).all(|other| other.name != name) {
            let reads = SensorReading::Displacement(Displacement { direction: reads.direction.map(|x| -x), ..reads.clone() });
            found.push(Sensor { name, reads, shows: own.shows });
        }
    }
    Ok(found)
}

/// Name of a displacement, or of its limit, with the opposite sign.
pub(super) fn turned_name(name: &str) -> String {
    format!("-{name}")
}

/// A unit vector: along an axis, or of three numbers.
fn direction(value: &Value<'_>) -> Result<[f64; 3]> {
    if value.is_text() {
        let word = value.choice(&DIRECTIONS)?;
        let mut unit = [0.0; 3];
        unit[word / 2] = if word % 2 == 0 { 1.0 } else { -1.0 };
        return Ok(unit);
    }
    let numbers = value.list()?.iter().map(Value::number).collect::<Result<Vec<f64>>>()?;
    // First divided by the largest: the square of a number that is not normalised may overflow or vanish.
    let largest = numbers.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    match numbers[..] {
        [x, y, z] if largest > 0.0 => {
            let scaled = [x, y, z].map(|c| c / largest);
            let length = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
            Ok(scaled.map(|c| c / length))
        }
        _ => Err(value.error("a direction is an axis, or three numbers that are not all zero").help("write \"z\" or [1, 0, 1]")),
    }
}

impl Elasticity {
    /// Axes along which the face of a block is held.
    pub fn held(&self, face: Face) -> [bool; 3] {
        let mut holds = [false; 3];
        for support in self.supports.iter().filter(|support| support.faces.iter().any(|own| own.covers(face))) {
            (0..3).for_each(|d| holds[d] |= support.holds[d]);
        }
        holds
    }
}
