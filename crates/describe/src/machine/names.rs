//! Names of parts, nodes, channels and faces, resolved to indices.

use super::parts::{BlockShape, Face, HeatedPlace, Part, Place, Side};
use coldplate_base::document::{Value, suggestion};
use coldplate_base::error::Result;

/// The six sides of a box in the order of [`Side::ALL`].
pub(super) const BOX_SIDES: [&str; 6] = ["-x", "+x", "-y", "+y", "-z", "+z"];
/// The six sides of a cylinder in the order of [`Side::ALL`].
pub(super) const CYLINDER_SIDES: [&str; 6] = ["inner", "outer", "cut1", "cut2", "start", "end"];

/// The sides of a sphere, the first two of [`Side::ALL`].
pub(super) const SPHERE_SIDES: [&str; 2] = ["inner", "outer"];

/// `part`, `part.side` or `part[block].side`, split.
pub(super) struct Spelling {
    pub(super) name: String,
    /// Number of the block from 1, as written.
    pub(super) block: Option<usize>,
    pub(super) side: Option<String>,
}

impl Spelling {
    pub(super) fn of(value: &Value<'_>) -> Result<Self> {
        let text = value.text()?;
        let (name, side) = match text.split_once('.') {
            Some((name, side)) => (name, Some(side.trim().to_string())),
            None => (text.as_str(), None),
        };
        let (name, block) = match name.split_once('[') {
            None => (name, None),
            Some((name, rest)) => {
                let number = rest.strip_suffix(']').and_then(|n| n.trim().parse::<usize>().ok());
                let help = "write for example \"bed[2].+z\"; blocks are counted from 1";
                (name, Some(number.ok_or_else(|| value.error(format!("'{text}' names no block")).help(help))?))
            }
        };
        Ok(Self { name: name.trim().into(), block, side })
    }
}

/// The names of a shape's sides, in the order of [`Side::ALL`].
pub(super) fn sides(shape: &BlockShape) -> &'static [&'static str] {
    match shape {
        BlockShape::Box { .. } => &BOX_SIDES,
        BlockShape::Cylinder { .. } => &CYLINDER_SIDES,
        BlockShape::Sphere { .. } => &SPHERE_SIDES,
    }
}

/// The side called `name` on `shape`.
pub(super) fn side_of(shape: &BlockShape, name: &str) -> Option<Side> {
    sides(shape).iter().position(|side| *side == name).map(|at| Side::ALL[at])
}

/// Whether a shape really has a side: a solid cylinder or sphere has no inner one, a full turn no cuts.
pub(super) fn has_side(shape: &BlockShape, side: Side) -> bool {
    match shape {
        BlockShape::Box { .. } => true,
        BlockShape::Cylinder { inner, turn, .. } => match side {
            Side::Low0 => *inner > 0.0,
            Side::Low1 | Side::High1 => turn.1 - turn.0 < 2.0 * std::f64::consts::PI,
            _ => true,
        },
        BlockShape::Sphere { inner, .. } => match side {
            Side::Low0 => *inner > 0.0,
            _ => side == Side::High0,
        },
    }
}

/// All items that can be named.
pub(super) struct Index<'a> {
    pub(super) parts: &'a [Part],
    pub(super) nodes: &'a [String],
    pub(super) channels: &'a [String],
}

impl Index<'_> {
    /// Index of the part a value names.
    pub(super) fn part(&self, value: &Value<'_>) -> Result<usize> {
        let name = value.text()?;
        let known: Vec<&str> = self.parts.iter().map(|p| p.name.as_str()).collect();
        known
            .iter()
            .position(|part| *part == name)
            .ok_or_else(|| value.error(format!("there is no part '{name}'")).help(suggestion(&name, &known)))
    }

    /// Index of the node a value names.
    pub(super) fn node(&self, value: &Value<'_>) -> Result<usize> {
        lookup(value, self.nodes, "node")
    }

    /// Index of the channel a value names.
    pub(super) fn channel(&self, value: &Value<'_>) -> Result<usize> {
        lookup(value, self.channels, "channel")
    }

    /// The part, face or node a value names.
    pub(super) fn place(&self, value: &Value<'_>) -> Result<Place> {
        let spelling = Spelling::of(value)?;
        let node = self.nodes.iter().position(|n| *n == spelling.name);
        let part = self.parts.iter().position(|p| p.name == spelling.name);
        match (part, node, &spelling.side) {
            (Some(part), _, None) if spelling.block.is_none() => Ok(Place::Part(part)),
            (Some(part), _, Some(side)) => self.side(value, part, spelling.block, side).map(Place::Face),
            (Some(_), _, None) => Err(value.error("a block is named, but none of its faces").help("add one, for example \"bed[2].+z\"")),
            (None, Some(node), None) if spelling.block.is_none() => Ok(Place::Node(node)),
            (None, Some(_), _) => Err(value.error("a node has neither blocks nor faces").help(format!("write \"{}\"", spelling.name))),
            (None, None, _) => {
                let known = self.parts.iter().map(|p| p.name.as_str()).chain(self.nodes.iter().map(String::as_str));
                let help = suggestion(&spelling.name, &known.collect::<Vec<_>>());
                Err(value.error(format!("there is no part or node '{}'", spelling.name)).help(help))
            }
        }
    }

    /// The part, block of a part, face or node a value names.
    pub(super) fn heated(&self, value: &Value<'_>) -> Result<HeatedPlace> {
        let spelling = Spelling::of(value)?;
        let whole = || self.place(value).map(|place| HeatedPlace { place, block: None });
        let (Some(number), None) = (spelling.block, &spelling.side) else { return whole() };
        let Some(part) = self.parts.iter().position(|p| p.name == spelling.name) else { return whole() };
        let blocks = self.parts[part].blocks.len();
        if (1..=blocks).contains(&number) {
            return Ok(HeatedPlace { place: Place::Part(part), block: Some(number - 1) });
        }
        let what = format!("'{}' has no block number {number}", spelling.name);
        Err(value.error(what).help(format!("it has {blocks}; they are counted from 1")))
    }

    /// The face a value names.
    pub(super) fn face(&self, value: &Value<'_>) -> Result<Face> {
        match self.place(value)? {
            Place::Face(face) => Ok(face),
            Place::Part(part) if self.parts[part].import.is_some() => {
                let names = self.parts[part].import.iter().flat_map(|i| &i.body.surfaces).map(|s| s.name.as_str()).collect::<Vec<_>>();
                Err(value.error("the face of a part is wanted here").help(format!("add one of its surfaces: {}", names.join(", "))))
            }
            _ => Err(value.error("the face of a part is wanted here").help(format!("add its side: {}", all_sides()))),
        }
    }

    /// The side `name` of a part, for spellings that may omit the part because it is known.
    pub(super) fn side(&self, value: &Value<'_>, part: usize, block: Option<usize>, name: &str) -> Result<Face> {
        if let Some(import) = &self.parts[part].import {
            return super::import::face(value, part, &self.parts[part].name, &import.body, block, name);
        }
        let blocks = &self.parts[part].blocks;
        let in_question: Vec<&BlockShape> = match block {
            None => blocks.iter().map(|b| &b.shape).collect(),
            Some(number) => match blocks.get(number.wrapping_sub(1)) {
                Some(block) => vec![&block.shape],
                None => {
                    let what = format!("'{}' has no block number {number}", self.parts[part].name);
                    return Err(value.error(what).help(format!("it has {}; they are counted from 1", blocks.len())));
                }
            },
        };
        let kind = |shape: &BlockShape| match shape {
            BlockShape::Box { .. } => 0,
            BlockShape::Cylinder { axis, .. } => 1 + axis.index(),
            BlockShape::Sphere { .. } => 4,
        };
        if in_question.iter().any(|shape| kind(shape) != kind(in_question[0])) {
            let what = format!("the blocks of '{}' are of several kinds, so '{name}' does not say which face", self.parts[part].name);
            return Err(value.error(what).help(format!("name the block too: \"{}[1].{name}\"", self.parts[part].name)));
        }
        let found = in_question.iter().find_map(|shape| side_of(shape, name).filter(|side| has_side(shape, *side)));
        match found {
            Some(side) => Ok(Face { part, block: block.map(|number| number - 1), side }),
            None => {
                let mut known: Vec<&str> = Vec::new();
                for shape in in_question {
                    let real = sides(shape).iter().copied().zip(Side::ALL).filter(|(_, side)| has_side(shape, *side)).map(|(name, _)| name);
                    known.extend(real.filter(|name| !known.contains(name)).collect::<Vec<_>>());
                }
                Err(value
                    .error(format!("'{}' has no side '{name}'", self.parts[part].name))
                    .help(format!("its sides: {}", known.join(" "))))
            }
        }
    }
}

fn all_sides() -> String {
    format!("{} on boxes, {} on cylinders, {} on spheres", BOX_SIDES.join(" "), CYLINDER_SIDES.join(" "), SPHERE_SIDES.join(" "))
}

/// The index of the name a value holds.
pub(super) fn lookup(value: &Value<'_>, names: &[String], what: &str) -> Result<usize> {
    let name = value.text()?;
    names.iter().position(|n| *n == name).ok_or_else(|| {
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        value.error(format!("there is no {what} '{name}'")).help(suggestion(&name, &known))
    })
}
