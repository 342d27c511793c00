//! Heat-flow sensors: the heat through a contact, a boundary, a face or into a channel.

use super::contacts::{Boundary, Contact};
use super::geometry::check_length;
use super::names::{Index, lookup};
use super::parts::Face;
use coldplate_base::document::{Section, Value};
use coldplate_base::error::Result;

/// A heat-flow sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatFlow {
    /// Name.
    pub name: String,
    /// Path of the heat.
    pub through: HeatPath,
    /// Line in the machine file.
    pub line: usize,
}

/// Path of the heat of a heat-flow sensor, with its positive direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeatPath {
    /// A contact, out of one of its two sides.
    Contact {
        /// Index into the machine's contacts.
        contact: usize,
        /// The side, 0 or 1.
        out_of: usize,
    },
    /// A boundary, out of the machine; index into the machine's boundaries.
    Boundary(usize),
    /// A face, out of its part.
    Face(Face),
    /// The wall of a channel, out of the part into the water; index into the machine's channels.
    Channel(usize),
}

/// Reads `[heat_flow.NAME]`.
pub(super) fn heat_flows(root: &Section<'_>, index: &Index<'_>, contacts: &[Contact], boundaries: &[Boundary]) -> Result<Vec<HeatFlow>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("heat_flow")? {
        check_length(&name, &section)?;
        let kinds = ["contact", "boundary", "face", "channel"];
        let Some(kind) = section.one_of(&kinds)? else {
            let help = format!("give one of: {}; for example face = \"motor.-z\"", kinds.join(", "));
            return Err(section.error("this heat flow goes through nothing").help(help));
        };
        let value = section.value(kind)?;
        let through = match kind {
            "contact" => {
                let names: Vec<String> = contacts.iter().map(|c| c.name.clone()).collect();
                let contact = lookup(&value, &names, "contact")?;
                HeatPath::Contact { contact, out_of: side(section.opt("out_of"), &contacts[contact], index)? }
            }
            "boundary" => {
                let names: Vec<String> = boundaries.iter().map(|b| b.name.clone()).collect();
                HeatPath::Boundary(lookup(&value, &names, "boundary")?)
            }
            "face" => {
                let face = index.face(&value)?;
                if index.parts[face.part].import.is_some() {
                    let what = "the vertices of a mesh belong to several faces, so that the heat through one is not known";
                    return Err(value.error(what).help("name the contact or the boundary that the heat goes through"));
                }
                HeatPath::Face(face)
            }
            _ => HeatPath::Channel(index.channel(&value)?),
        };
        if kind != "contact" && section.opt("out_of").is_some() {
            let help = "a boundary counts out of the machine, a face and a channel out of their part";
            return Err(section.error_at("out_of", "only a contact has two sides to choose from").help(help));
        }
        let line = section.line();
        section.finish()?;
        found.push(HeatFlow { name, through, line });
    }
    Ok(found)
}

/// The side of a contact that a value names; without a value the first.
fn side(value: Option<Value<'_>>, contact: &Contact, index: &Index<'_>) -> Result<usize> {
    let Some(value) = value else { return Ok(0) };
    let place = index.place(&value)?;
    let is_side = |side: &usize| contact.between[*side] == place || contact.between[*side].part().is_some_and(|p| Some(p) == place.part());
    (0..2).find(is_side).ok_or_else(|| {
        value.error(format!("the contact '{}' has no such side", contact.name)).help("name one of the two places under its 'between'")
    })
}
