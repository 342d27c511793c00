//! A machine as outside programs read it: each field is a key of `coldplate check --json`.

use serde::Serialize;

use super::inventory::{ChannelEntry, ContactEntry, ImportEntry, PartEntry, SourceEntry};
use super::{BoundaryEntry, ChosenRecord, Inventory, MeshedMachine};
use coldplate_base::condition::COOLANT_TEMPERATURE;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Assumption, Condition};
use coldplate_network::{EnclosureViews, Load};
use coldplate_physics::water::water;

/// Description of a machine file.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs)]
pub struct MachineRecord<'a> {
    pub name: &'a str,
    /// SHA-256 of the machine file.
    pub hash: &'a str,
    pub cells: usize,
    pub unknowns: usize,
    pub element_size_m: f64,
    /// How the cells were chosen, where an accuracy was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen_cells: Option<ChosenRecord>,
    pub parts: &'a [PartEntry],
    pub imports: &'a [ImportEntry],
    pub contacts: &'a [ContactEntry],
    pub channels: &'a [ChannelEntry],
    pub enclosures: Vec<EnclosureRecord<'a>>,
    pub boundaries: &'a [BoundaryEntry],
    pub sources: &'a [SourceEntry],
    pub sensors: &'a [String],
    pub limits: Vec<&'a str>,
    pub assumptions: Vec<AssumptionRecord<'a>>,
    /// Numbers that the file states as uncertain.
    pub uncertain: Vec<UncertainRecord>,
    pub warnings: &'a [String],
    /// The flow that takes up all heat with a given rise, where one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flow_for_rise: Option<FlowForRise>,
}

/// View factors between the surfaces of an enclosure.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct EnclosureRecord<'a> {
    pub name: &'a str,
    pub surfaces: &'a [String],
    pub area_m2: &'a [f64],
    pub emissivity: &'a [f64],
    pub view_factors: &'a [Vec<f64>],
    pub chamber: &'a [f64],
    pub patches: usize,
    pub pairs_by_rays: usize,
    pub standard_error: f64,
    pub largest_correction: f64,
    pub notes: &'a [String],
}

/// A number the file marks as assumed.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct AssumptionRecord<'a> {
    pub key: &'a str,
    pub value: &'a str,
    pub reason: &'a str,
}

/// A number that the file states as uncertain.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct UncertainRecord {
    pub key: String,
    /// Value, in `unit`.
    pub value: f64,
    pub unit: String,
    /// Standard deviation, in `unit`; kelvin for temperatures.
    pub standard_deviation: f64,
    /// Limits that the file states, if any, in `unit`.
    pub limits: Option<[f64; 2]>,
}

/// The coolant flow that takes up the heat of all sources: q = P / (rho c dT).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct FlowForRise {
    pub rise_K: f64,
    pub heat_W: f64,
    pub flow_m3_s: f64,
}

impl MeshedMachine {
    /// The machine and its inventory for other programs.
    pub fn describe<'a>(&'a self, found: &'a Inventory) -> MachineRecord<'a> {
        let assumption = |a: &'a Assumption| AssumptionRecord { key: &a.key, value: &a.value, reason: &a.reason };
        MachineRecord {
            name: &self.machine.name,
            hash: &self.machine.hash,
            cells: self.mesh.cells,
            unknowns: self.network.nodes,
            element_size_m: self.mesh.element_size,
            chosen_cells: ChosenRecord::of(self),
            parts: &found.parts,
            imports: &found.imports,
            contacts: &found.contacts,
            channels: &found.channels,
            enclosures: self.network.enclosures.iter().map(EnclosureRecord::of).collect(),
            boundaries: &found.boundaries,
            sources: &found.sources,
            sensors: &self.network.sensor_names,
            limits: self.machine.limits.iter().map(|l| l.name.as_str()).collect(),
            assumptions: self.machine.assumptions.iter().map(assumption).collect(),
            uncertain: Vec::new(),
            warnings: &found.warnings,
            flow_for_rise: None,
        }
    }
}

impl MeshedMachine {
    /// The flow that takes up the heat of all sources with a `rise` (K), with water half the rise above its inlet temperature.
    ///
    /// # Errors
    /// A formula fails at the condition, the machine has no coolant temperature, or water leaves its property range.
    pub fn flow_for_rise(&self, rise: f64, condition: &Condition) -> Result<FlowForRise> {
        let heat: f64 = Load::at(&self.machine, condition)?.powers.iter().sum();
        let at = self.machine.variables.iter().position(|v| v.name == COOLANT_TEMPERATURE);
        let inlet =
            at.and_then(|i| condition.si().get(i).copied()).ok_or_else(|| Error::input("the machine has no coolant temperature"))?;
        Ok(FlowForRise { rise_K: rise, heat_W: heat, flow_m3_s: heat / (water(inlet + rise / 2.0)?.volumetric_heat() * rise) })
    }
}

impl<'a> EnclosureRecord<'a> {
    fn of(e: &'a EnclosureViews) -> Self {
        Self {
            name: &e.name,
            surfaces: &e.surfaces,
            area_m2: &e.areas,
            emissivity: &e.emissivities,
            view_factors: &e.view_factors,
            chamber: &e.chamber,
            patches: e.patches,
            pairs_by_rays: e.by_rays,
            standard_error: e.error,
            largest_correction: e.corrected,
            notes: &e.notes,
        }
    }
}
