//! Paths for heat that the model lacks: to the surroundings, and between parts that do not touch.
//!
//! The surroundings are at the temperature of the chamber, in vacuum as in air: the model knows no other.

use super::file::{conductor, text};
use super::ground::PathLaw;
use super::words::Quantity;
use super::{Family, Group, Hypothesis, Law, Linearised, Lines, MachineEdit, Prepared, Site, Told, UserKind};
use coldplate_describe::machine::{PartBlock, Machine, BlockShape};
use coldplate_network::{FREE, Surface};
use coldplate_base::error::Result;
use coldplate_base::document::quoted;
use coldplate_physics::convection::{self, FreeConvection, Gas};
use coldplate_physics::radiation::SIGMA;
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;

/// Height of the plate that stands for a lumped node in a room, m.
const HEIGHT: f64 = 0.1;
/// The plate itself.
const PLATE: FreeConvection = FreeConvection { shape: convection::BodyShape::VerticalPlate, length: HEIGHT, gas: Gas::Air, pressure: 101_325.0 };

/// Paths for heat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Leak {
    /// Conductance from a group to the surroundings, W/K.
    Surroundings(u32),
    /// Film from the outer faces of a part, which the model has adiabatic, to the surroundings, W/(m² K).
    Film(usize),
    /// Conductance between two groups, the second perhaps a node of given temperature, W/K.
    Link(u32, u32),
    /// Free convection of a lumped node to the surroundings: area of an upright plate, m².
    Convection(usize),
    /// Radiation of a lumped node to the surroundings: black area, m².
    Radiation(usize),
}

impl Family for Leak {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let prior = &site.machine.priors;
        let leak = |g: &Group| Hypothesis::positive(Self::Surroundings(g.index), &g.name, vec![g.name.clone()], prior.leak, "W/K");
        let link = |(a, b): (&Group, &Group)| {
            let parts = vec![a.name.clone(), b.name.clone()];
            Hypothesis::positive(Self::Link(a.index, b.index), parts.join(" - "), parts, prior.link, "W/K")
        };
        let mut found: Vec<Hypothesis> = site.groups.iter().map(leak).collect();
        // In a room, not in vacuum: where nothing radiates to a chamber, bare faces lose heat to the air.
        let machine = site.machine;
        for (p, part) in machine.parts.iter().enumerate().filter(|_| !site.is_in_vacuum) {
            let is_bare = machine.boundaries.iter().all(|b| b.faces.iter().all(|f| f.part != p));
            if is_bare && !outer_faces(machine, p).is_empty() {
                found.push(Hypothesis::positive(Self::Film(p), &part.name, vec![part.name.clone()], prior.room_film, "W/(m2 K)"));
            }
        }
        found.extend(site.apart(&site.groups).into_iter().map(link));
        let given = site.given();
        let ends = site.groups.iter().flat_map(|free| given.iter().map(move |held| (free, held)));
        found.extend(ends.filter(|(free, held)| !site.touch(free.index, held.index)).map(link));
        // Nodes have no faces: what they lose by laws of their own is an area.
        for (n, node) in machine.nodes.iter().enumerate().filter(|(_, node)| node.fixed.is_none()) {
            let area = |effect: Self| Hypothesis::positive(effect, &node.name, vec![node.name.clone()], prior.room_area, "m2");
            if !site.is_in_vacuum {
                found.push(area(Self::Convection(n)));
            }
            if node.radiation.is_none() {
                found.push(area(Self::Radiation(n)));
            }
        }
        found
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Surroundings(_) => "leak to the surroundings",
            Self::Film(_) => "loss to the surroundings",
            Self::Link(..) => "conductive link",
            Self::Convection(_) => "free convection",
            Self::Radiation(_) => "radiation to the surroundings",
        }
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        Ok(Some(match *self {
            Self::Surroundings(g) => {
                let node = edit.added_name(&format!("surroundings of {}", edit.group(g)));
                let held = format!("{{ temperature = {} }}", edit.surroundings()?);
                let contact = conductor([edit.group(g), &node], edit.positive(), edit.when());
                vec![(format!("node.{}", quoted(&node)), held), (edit.added("contact"), contact)]
            }
            Self::Film(p) => vec![(edit.added("boundary"), film(edit.machine(), p, edit.positive(), &edit.surroundings()?))],
            Self::Link(a, b) => vec![(edit.added("contact"), conductor([edit.group(a), edit.group(b)], edit.positive(), edit.when()))],
            Self::Convection(n) | Self::Radiation(n) => {
                let law = if matches!(self, Self::Convection(_)) {
                    format!("free_convection = \"vertical_plate\", length = \"{HEIGHT} m\", fluid_temperature")
                } else {
                    "emissivity = 1.0, surroundings_temperature".to_string()
                };
                let (node, area) = (text(&edit.machine().nodes[n].name), text(format!("{:?} m2", edit.positive())));
                vec![(edit.added("boundary"), format!("{{ node = {node}, area = {area}, {law} = {} }}", edit.surroundings()?))]
            }
        }))
    }

    /// The file's own words say which faces are open.
    fn prepared(&self, study: &Study, _user: &[UserKind]) -> Option<Prepared> {
        let Self::Film(p) = *self else { return None };
        let added = "boundary.\"open faces\"".to_string();
        let edited = study.edited(&[(added, film(&study.model.machine, p, 1.0, &text("20 degC")))]).ok()?;
        let law = edited.model.machine.boundaries.iter().position(|b| b.name == "open faces")? as u32;
        let open = edited.model.network.surfaces.iter().filter(|s| s.laws.contains(&law));
        Some(Prepared::Surfaces(open.map(|s| Surface { laws: FREE, ..*s }).collect()))
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        let surroundings = at.load().chamber;
        Some(match *self {
            Self::Surroundings(g) => {
                let heat = |(n, w): &(u32, f64)| (*n, w * (at.temperatures()[*n as usize] - surroundings));
                at.screen.disturbance(at.ground.joined(g).iter().map(heat))
            }
            Self::Film(_) => {
                let Some(Prepared::Surfaces(surfaces)) = at.prepared else { return None };
                at.screen.opened(surfaces, |s, t| s.area * (t - surroundings))
            }
            Self::Link(..) => return None,
            Self::Convection(n) | Self::Radiation(n) => {
                let group = (at.machine().parts.len() + n) as u32;
                let node = at.ground.heated(group).first()?.0;
                let own = at.temperatures()[node as usize];
                let flux = match self {
                    Self::Convection(_) => PLATE.flux(own, surroundings).value,
                    _ => SIGMA * (own.powi(4) - surroundings.powi(4)),
                };
                at.screen.disturbance([(node, flux)])
            }
        })
    }

    fn path(&self) -> Option<([u32; 2], PathLaw)> {
        if let Self::Link(a, b) = *self { Some(([a, b], PathLaw::Conductance)) } else { None }
    }

    fn says_when(&self) -> bool {
        matches!(self, Self::Surroundings(_))
    }

    fn has_formula_of(&self, _law: Law) -> bool {
        matches!(self, Self::Surroundings(_) | Self::Link(..))
    }

    fn quantity(&self, _law: Law) -> Quantity {
        match self {
            Self::Surroundings(_) | Self::Link(..) => Quantity::plain("conductance", "W/K"),
            Self::Film(_) => Quantity::plain("film", "W/(m2 K)"),
            Self::Convection(_) | Self::Radiation(_) => Quantity::plain("area", "m2"),
        }
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        let place = told.place();
        match self {
            Self::Surroundings(_) => {
                format!("a cable, hose or foot conducts heat from {place} to the surroundings: {}{}", told.range(" W/K"), told.law())
            }
            Self::Film(_) => {
                let film = told.range(" W/(m2 K)");
                format!("{place} loses heat to the surroundings, which the model lacks: {film} over its outer faces")
            }
            Self::Convection(_) => {
                format!("{place} loses heat to the surroundings by free convection: as an upright plate of {}", told.range(" m2"))
            }
            Self::Radiation(_) => format!("{place} radiates to the surroundings: as a black surface of {}", told.range(" m2")),
            Self::Link(..) => format!("something conducts heat between {}: {}{}", told.both_places(), told.range(" W/K"), told.when()),
        }
    }
}

/// A boundary with a film over the outer faces of a part, as TOML.
fn film(machine: &Machine, part: usize, film: f64, fluid: &str) -> String {
    let faces: Vec<String> = outer_faces(machine, part).into_iter().map(text).collect();
    let film = text(format!("{film:?} W/(m2 K)"));
    format!("{{ faces = [{}], film = {film}, fluid_temperature = {fluid} }}", faces.join(", "))
}

/// The faces of a part's blocks that look outwards, as the machine file writes them; none for imported meshes.
fn outer_faces(machine: &Machine, part: usize) -> Vec<String> {
    let part = &machine.parts[part];
    let of_block = |(i, block): (usize, &PartBlock)| -> Vec<String> {
        let sides: &[&str] = match &block.shape {
            BlockShape::Box { .. } => &["-x", "+x", "-y", "+y", "-z", "+z"],
            BlockShape::Cylinder { .. } => &["outer", "start", "end"],
            BlockShape::Sphere { .. } => &["outer"],
        };
        let number = if part.blocks.len() > 1 { format!("[{}]", i + 1) } else { String::new() };
        sides.iter().map(|side| format!("{}{number}.{side}", part.name)).collect()
    };
    part.blocks.iter().enumerate().flat_map(of_block).collect()
}
