//! The machine that a file describes, as one value.

use super::channels::Channel;
use super::circuits::Circuit;
use super::contact_law::ContactLaw;
use super::contacts::{Boundary, Contact, RadiationLink};
use super::controllers::Controller;
use super::elastic::Elasticity;
use super::enclosures::Enclosure;
use super::heat_flows::HeatFlow;
use super::names::sides;
use super::parts::{Face, LumpedNode, Material, Part, Place};
use super::prior::Priors;
use super::readings::{MachineLimit, Measurement, Sensor};
use super::sources::Source;
use super::symbols::Symbols;
use super::uncertain::{Correlation, ModelError, SharedFactor};
use super::variables::{DescribedVariable, Drive, NamedFormula};
use coldplate_base::error::{Error, Result};
use coldplate_base::formula::Formula;
/// A machine, as described by one file.
#[derive(Debug, Clone)]
pub struct Machine {
    /// One-line name.
    pub name: String,
    /// The file the machine was read from, under the name used in errors.
    pub file: std::path::PathBuf,
    /// Free text.
    pub description: String,
    /// SHA-256 of the file's text with every `--set` applied, and of every imported mesh, in hexadecimal.
    pub hash: String,
    /// The condition variables: first the four that always exist, then the file's own.
    pub variables: Vec<DescribedVariable>,
    /// Named intermediate formulas, in the order they must be evaluated.
    pub definitions: Vec<NamedFormula>,
    /// Drives; formulas see their heats as `NAME_motor_W` and so forth.
    pub drives: Vec<Drive>,
    /// The vacuum chamber around the machine.
    pub chamber: Chamber,
    /// Materials in use.
    pub materials: Vec<Material>,
    /// Parts made of blocks, or of imported meshes.
    pub parts: Vec<Part>,
    /// Hand-written lumped nodes.
    pub nodes: Vec<LumpedNode>,
    /// Law for touching faces without a named contact; `None` means bonded, with a warning.
    pub default_contact: Option<ContactLaw>,
    /// Named contacts.
    pub contacts: Vec<Contact>,
    /// Coolant channels.
    pub channels: Vec<Channel>,
    /// Coolant circuits that feed the channels.
    pub circuits: Vec<Circuit>,
    /// Prescribed film, flux or temperature on faces.
    pub boundaries: Vec<Boundary>,
    /// Radiative links between facing surfaces.
    pub radiation_links: Vec<RadiationLink>,
    /// Enclosures of surfaces that see each other.
    pub enclosures: Vec<Enclosure>,
    /// Heat sources.
    pub sources: Vec<Source>,
    /// Controllers of sources.
    pub controllers: Vec<Controller>,
    /// Measurement points.
    pub sensors: Vec<Sensor>,
    /// Heat-flow sensors.
    pub heat_flows: Vec<HeatFlow>,
    /// Supports of the machine, and the reference of its displacements.
    pub elasticity: Elasticity,
    /// Limits of acceptable operation.
    pub limits: Vec<MachineLimit>,
    /// Numbers the file marks as assumed, with the reason.
    pub assumptions: Vec<Assumption>,
    /// Measured readings to print beside the prediction.
    pub measurements: Vec<Measurement>,
    /// Uncertain factors shared by several numbers.
    pub shared_factors: Vec<SharedFactor>,
    /// Correlations of uncertain numbers.
    pub correlations: Vec<Correlation>,
    /// Standard deviations of the model error.
    pub model_error: ModelError,
    /// How large causes of an error usually are.
    pub priors: Priors,
    /// Number of cells aimed at when the caller does not say.
    pub default_cells: usize,
    /// Largest error of a reading from the mesh, K, if the file states it in place of a number of cells.
    pub accuracy: Option<f64>,
    /// The names of the formulas, slot by slot.
    pub(super) symbols: Symbols,
    /// Indices of the variables that affect nothing.
    pub(super) unused: Vec<usize>,
}

impl Machine {
    /// Refuses a machine with controllers, on behalf of a computation that would take their sources at full power.
    ///
    /// # Errors
    /// There is a controller.
    pub fn without_controllers(&self, computation: &str) -> Result<()> {
        let Some(controller) = self.controllers.first() else { return Ok(()) };
        Err(Error::input(format!("{computation} cannot follow a controller"))
            .in_file(&self.file)
            .at_key(format!("controller.{}", controller.name))
            .help("`coldplate solve`, `simulate` and `sweep` solve controllers; here make the power of the source a variable"))
    }

    /// Whether parts or nodes have a start temperature of their own for a schedule or log.
    pub fn has_starts(&self) -> bool {
        self.parts.iter().any(|p| p.start.is_some()) || self.nodes.iter().any(|n| n.start.is_some())
    }

    /// A face as the machine file writes it: `plate.+z`, `bed[2].outer`, `bracket.foot`.
    pub fn face_name(&self, face: Face) -> String {
        let part = &self.parts[face.part];
        if let Some(import) = &part.import {
            return match face.block {
                Some(surface) => format!("{}.{}", part.name, import.body.surfaces[surface].name),
                None => part.name.clone(),
            };
        }
        let shape = part.blocks.get(face.block.unwrap_or(0)).map(|block| &block.shape);
        let side = shape.and_then(|shape| sides(shape).get(face.side as usize)).copied().unwrap_or_default();
        match face.block {
            Some(block) => format!("{}[{}].{side}", part.name, block + 1),
            None => format!("{}.{side}", part.name),
        }
    }

    /// The contact that covers two touching faces of blocks, as an index, and whether its sides are in the opposite
    /// order. A contact between named faces takes precedence.
    pub fn contact_between(&self, faces: [Face; 2]) -> Option<(usize, bool)> {
        let covers = |place: &Place, face: Face| match place {
            Place::Part(p) => *p == face.part,
            Place::Face(own) => own.covers(face),
            Place::Node(_) => false,
        };
        let is_specific = |c: &Contact| c.between.iter().any(|p| matches!(p, Place::Face(_)));
        let (specific, general): (Vec<_>, Vec<_>) = self.contacts.iter().enumerate().partition(|(_, c)| is_specific(c));
        specific.into_iter().chain(general).find_map(|(i, c)| {
            let straight = covers(&c.between[0], faces[0]) && covers(&c.between[1], faces[1]);
            let crossed = covers(&c.between[0], faces[1]) && covers(&c.between[1], faces[0]);
            (straight || crossed).then_some((i, crossed && !straight))
        })
    }
}

/// The chamber: wall temperature, enclosure, residual gas.
#[derive(Debug, Clone)]
pub struct Chamber {
    /// Wall temperature, K.
    pub temperature: Formula,
    /// Wall emissivity and area (m²) for the enclosure formula; `None`: the effective emissivity equals the emissivity.
    pub enclosure: Option<(f64, f64)>,
    /// Pressure of the residual gas, Pa.
    pub pressure: f64,
    /// Energy accommodation coefficient of the residual gas.
    pub accommodation: f64,
    /// Distance from machine to wall, m, for the continuum limit of the gas conduction.
    pub gap: f64,
}

/// A number the file marks as assumed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assumption {
    /// Dotted key of the number.
    pub key: String,
    /// The value as written.
    pub value: String,
    /// Why it was chosen.
    pub reason: String,
}
