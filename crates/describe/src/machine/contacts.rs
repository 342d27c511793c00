//! Contacts, boundaries and radiation links: everything that joins parts, nodes and surroundings.

use super::contact_law::{Bonded, ContactLaw, Insulated};
use super::elastic::JointKind;
use super::geometry::{emissivity, two_emissivities};
use super::keys::joints as keys;
use super::names::Index;
use super::parts::{Face, Part, Place};
use super::region::{Region, within};
use super::symbols::Symbols;
use super::variables::{formula, formula_or};
use coldplate_base::condition::AMBIENT_TEMPERATURE;
use coldplate_base::document::Section;
use coldplate_base::error::{Location, Result};
use coldplate_base::formula::Formula;
use coldplate_base::units::Dimension;
use coldplate_physics::convection::{BodyShape, FreeConvection, Gas};

/// A named contact between two places.
#[derive(Debug, Clone)]
pub struct Contact {
    /// Name.
    pub name: String,
    /// The two sides.
    pub between: [Place; 2],
    /// Law of the conductance.
    pub law: ContactLaw,
    /// Area, m². A contact with a lumped node needs it. Between two parts the touching area is computed; a stated area
    /// replaces it in total (hA = h x area).
    pub area: Option<f64>,
    /// Factor on the law's conductance.
    pub factor: Formula,
    /// Effect of the contact on movements.
    pub joint: JointKind,
    /// Line in the machine file.
    pub line: usize,
}

/// A prescribed thermal condition on faces.
#[derive(Debug, Clone)]
pub struct Boundary {
    /// Name.
    pub name: String,
    /// The faces the boundary applies to; none if it applies to a lumped node.
    pub faces: Vec<Face>,
    /// The lumped node the boundary applies to.
    pub node: Option<ExposedNode>,
    /// The part of the faces the boundary applies to; `None` means all.
    pub within: Option<Region>,
    /// The boundary condition.
    pub law: BoundaryLaw,
    /// Line in the machine file.
    pub line: usize,
}

/// A lumped node that a boundary acts on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExposedNode {
    /// Index into the machine's nodes.
    pub node: usize,
    /// Area, m².
    pub area: f64,
}

/// A boundary condition.
#[derive(Debug, Clone)]
pub enum BoundaryLaw {
    /// Surface temperature, K.
    Temperature(Formula),
    /// Film coefficient W/(m² K) to a fluid at a temperature (K).
    Film(Formula, Formula),
    /// Heat flux into the machine, W/m².
    Flux(Formula),
    /// Radiation to a temperature (K) with an emissivity.
    Radiation(f64, Formula),
    /// Free convection to a gas at a temperature (K).
    FreeConvection(FreeConvection, Formula),
}

/// Radiation between two places that face each other.
#[derive(Debug, Clone)]
pub struct RadiationLink {
    /// Name.
    pub name: String,
    /// The two surfaces.
    pub between: [Place; 2],
    /// Area of the first, m²; `None` takes its exposed area.
    pub area: Option<f64>,
    /// View factor from the first to the second.
    pub view_factor: f64,
    /// Emissivities of the two.
    pub emissivity: [f64; 2],
}

/// Reads `[contact.NAME]`.
pub(super) fn contacts(root: &Section<'_>, index: &Index<'_>, symbols: &Symbols) -> Result<Vec<Contact>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("contact")? {
        let between = pair(&section, index)?;
        let Some(law) = ContactLaw::read(&section)? else {
            let help = format!("give one of: {}", ContactLaw::names().join(", "));
            return Err(section.error("this contact does not say how heat crosses it").help(help));
        };
        let area = section.opt_positive("area", Dimension::AREA)?;
        let has_node = between.iter().any(|place| matches!(place, Place::Node(_)));
        if let Some(what) = law.refusal_at_node(area.is_some()).filter(|_| has_node) {
            return Err(section.error(what).help("give total_conductance = \"7.3 W/K\", or conductance and area = \"143 cm2\""));
        }
        if area.is_some() && law.is_total() {
            return Err(section
                .error_at("area", "a total conductance is spread over the true area")
                .help("remove 'area', or give 'conductance' with it"));
        }
        let factor = match section.opt(keys::FACTOR.name) {
            None => Formula::constant(1.0),
            Some(value) if law.is_bonded() || matches!(law, ContactLaw::Insulated(_)) => {
                return Err(value
                    .error("there is no conductance here for a factor to act on")
                    .help("give a conductance, or leave the factor out"));
            }
            Some(value) => formula(&value, Dimension::NUMBER, symbols)?,
        };
        let joint = JointKind::read(&section)?;
        let line = section.line();
        section.finish()?;
        found.push(Contact { name, between, law, area, factor, joint, line });
    }
    Ok(found)
}

/// Reads `[contacts] default`.
pub(super) fn default_contact(root: &Section<'_>) -> Result<Option<ContactLaw>> {
    let Some(section) = root.opt_section("contacts")? else { return Ok(None) };
    let found = match section.opt("default") {
        None => None,
        Some(value) if value.is_text() => {
            Some([ContactLaw::Bonded(Bonded), ContactLaw::Insulated(Insulated)][value.choice(&["bonded", "insulated"])?].clone())
        }
        Some(value) => {
            let table = value.section()?;
            let found = ContactLaw::read(&table)?;
            if found.as_ref().is_none_or(ContactLaw::is_total) {
                let help = "write \"bonded\", \"insulated\" or { conductance = \"500 W/(m2 K)\" }";
                return Err(value.error("this law cannot hold for every touching pair").help(help));
            }
            table.finish()?;
            found
        }
    };
    section.finish()?;
    Ok(found)
}

/// The two different places under `between`.
fn pair(section: &Section<'_>, index: &Index<'_>) -> Result<[Place; 2]> {
    let value = section.value("between")?;
    let list = value.list()?;
    let [first, second] = list.as_slice() else {
        return Err(value
            .error(format!("two places are wanted here, not {}", list.len()))
            .help("write between = [\"motor\", \"plate.+z\"]"));
    };
    let places = [index.place(first)?, index.place(second)?];
    let same_part = places[0].part().is_some() && places[0].part() == places[1].part();
    if places[0] == places[1] || same_part {
        return Err(value
            .error("both places belong to the same body")
            .help("name two different parts or nodes; blocks of one part are one piece"));
    }
    Ok(places)
}

/// Reads `[boundary.NAME]`.
pub(super) fn boundaries(root: &Section<'_>, index: &Index<'_>, symbols: &Symbols) -> Result<Vec<Boundary>> {
    let mut found: Vec<Boundary> = Vec::new();
    for (name, section) in root.sections("boundary")? {
        let node = exposed_node(&section, index)?;
        let faces = match node {
            Some(_) => Vec::new(),
            None => section.list("faces")?.iter().map(|value| index.face(value)).collect::<Result<Vec<_>>>()?,
        };
        if faces.is_empty() && node.is_none() {
            return Err(section.error_at("faces", "no face is named").help("write faces = [\"bed.-z\"]"));
        }
        let within = within(&section, &faces, index.parts)?;
        let law = match section.one_of(&["temperature", "film", "heat_flux", "free_convection", "emissivity"])? {
            Some("temperature") if node.is_some() => {
                let help = "give the node itself its temperature: [node.NAME] temperature = \"20 degC\"";
                return Err(section.error_at("temperature", "a boundary cannot hold a lumped node").help(help));
            }
            Some("temperature") => BoundaryLaw::Temperature(formula(&section.value("temperature")?, Dimension::TEMPERATURE, symbols)?),
            Some("film") => {
                let film = formula(&section.value("film")?, Dimension::FILM, symbols)?;
                if film.as_constant().is_some_and(|h| h <= 0.0) {
                    return Err(section.error_at("film", "a film coefficient must be larger than zero"));
                }
                BoundaryLaw::Film(film, formula(&section.value("fluid_temperature")?, Dimension::TEMPERATURE, symbols)?)
            }
            Some("heat_flux") => BoundaryLaw::Flux(formula(&section.value("heat_flux")?, Dimension::HEAT_FLUX, symbols)?),
            Some("free_convection") => {
                let convection = FreeConvection {
                    shape: BodyShape::ALL[section.choice("free_convection", &BodyShape::NAMES)?],
                    length: section.positive("length", Dimension::LENGTH)?,
                    gas: Gas::ALL[keys::GAS.read_word(&section)?],
                    pressure: keys::GAS_PRESSURE.read(&section)?,
                };
                if !(1e3..=1e6).contains(&convection.pressure) {
                    return Err(section
                        .error_at("gas_pressure", "free convection is known from 0.01 to 10 bar")
                        .help("residual gas of a vacuum is [chamber] pressure"));
                }
                let ambient = || symbols.parse(AMBIENT_TEMPERATURE, Dimension::TEMPERATURE, None, Location::default());
                let gas = section.opt("fluid_temperature").map(|value| formula(&value, Dimension::TEMPERATURE, symbols));
                BoundaryLaw::FreeConvection(convection, gas.unwrap_or_else(ambient)?)
            }
            Some(_) => {
                let number = emissivity(&section.value("emissivity")?)?;
                let to = formula_or(&section, &keys::SURROUNDINGS, symbols)?;
                BoundaryLaw::Radiation(number, to)
            }
            None => {
                let help = "give temperature, film and fluid_temperature, heat_flux, free_convection and length, or emissivity";
                return Err(section.error("this boundary prescribes nothing").help(help));
            }
        };
        let line = section.line();
        let boundary = Boundary { name, faces, within, node, law, line };
        if let Some((other, what)) = found.iter().find_map(|other| Some((other, contradiction(other, &boundary, index.parts)?))) {
            return Err(section
                .error_at("faces", format!("'{}' and '{}' act on the same face, and {what}", other.name, boundary.name))
                .help("take the face out of one of them, or say with 'within' which part of it each means; a film, a flux and radiation add up"));
        }
        section.finish()?;
        found.push(boundary);
    }
    Ok(found)
}

/// The lumped node of a boundary, if it acts on one.
fn exposed_node(section: &Section<'_>, index: &Index<'_>) -> Result<Option<ExposedNode>> {
    if section.one_of(&["faces", "node"])? != Some("node") {
        return Ok(None);
    }
    let value = section.value("node")?;
    let Place::Node(node) = index.place(&value)? else {
        return Err(value.error("this is no lumped node").help("name a [node.NAME], or faces = [\"bed.-z\"]"));
    };
    Ok(Some(ExposedNode { node, area: section.positive("area", Dimension::AREA)? }))
}

/// Reason why two boundaries contradict each other on a face they share.
fn contradiction(a: &Boundary, b: &Boundary, parts: &[Part]) -> Option<&'static str> {
    let what = match (&a.law, &b.law) {
        (BoundaryLaw::Temperature(_), BoundaryLaw::Temperature(_)) => "it cannot have two temperatures",
        (BoundaryLaw::Temperature(_), _) | (_, BoundaryLaw::Temperature(_)) => {
            "one prescribes its temperature: nothing else acts beside that"
        }
        (BoundaryLaw::Film(..) | BoundaryLaw::FreeConvection(..), BoundaryLaw::Film(..) | BoundaryLaw::FreeConvection(..)) => {
            "it cannot have two films"
        }
        (BoundaryLaw::Flux(_), BoundaryLaw::Flux(_)) => "it cannot have two fluxes",
        (BoundaryLaw::Radiation(..), BoundaryLaw::Radiation(..)) => "it cannot radiate to two surroundings",
        _ => return None,
    };
    // Boundaries on a node have areas of their own, which add up; `check` says so.
    let is_apart = a.within.as_ref().zip(b.within.as_ref()).is_some_and(|(a, b)| a.is_apart(b));
    let meets = |f: &Face| b.faces.iter().any(|g| share_area(*f, *g, parts));
    (!is_apart && a.faces.iter().any(meets)).then_some(what)
}

/// Whether two faces share some area.
fn share_area(a: Face, b: Face, parts: &[Part]) -> bool {
    if a.part != b.part {
        return false;
    }
    let Some(import) = &parts[a.part].import else {
        return a.side == b.side && (a.block.is_none() || b.block.is_none() || a.block == b.block);
    };
    match (a.block, b.block) {
        (Some(a), Some(b)) => import.body.surfaces[a].faces.iter().any(|f| import.body.surfaces[b].faces.contains(f)),
        _ => true,
    }
}

/// Reads `[radiation_link.NAME]`.
pub(super) fn radiation_links(root: &Section<'_>, index: &Index<'_>) -> Result<Vec<RadiationLink>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("radiation_link")? {
        let between = pair(&section, index)?;
        let view_factor = section.number("view_factor")?;
        if !(view_factor > 0.0 && view_factor <= 1.0) {
            let help = "the share of the first surface's radiation that reaches the second; two parallel squares a tenth of their side apart: 0.83";
            return Err(section.error_at("view_factor", "a view factor lies above 0 and at most at 1").help(help));
        }
        let emissivity = two_emissivities(&section.value("emissivity")?)?;
        let area = section.opt_positive("area", Dimension::AREA)?;
        if area.is_none() && matches!(between[0], Place::Node(_)) {
            return Err(section
                .error_at("area", "a lumped node has no area of its own")
                .help("give the area of the first surface, area = \"0.02 m2\""));
        }
        section.finish()?;
        found.push(RadiationLink { name, between, area, view_factor, emissivity });
    }
    Ok(found)
}
