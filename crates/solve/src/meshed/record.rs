//! A solved condition as outside programs read it: each field is a key of `coldplate solve --json`. Numbers that are not
//! finite become `null`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{LimitState, MeshErrors, MeshedMachine, SteadyState};
use crate::balance::{ContactFlow, contact_flows, enclosure_heats};
use crate::heat_flow::{Holder, exchanged, heat_flows};
use coldplate_base::units::{Measurand, celsius};
use coldplate_network::BoundaryState;

/// A solved condition.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs)]
pub struct SolveRecord {
    /// Temperatures of the sensors' places, degC; limits are judged by them.
    pub sensors: BTreeMap<String, f64>,
    /// Values that sensors with a gain or offset of their own show there, degC; left out where there is none.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub readings: BTreeMap<String, f64>,
    pub coolant: BTreeMap<String, ChannelRecord>,
    pub contacts: BTreeMap<String, ContactRecord>,
    /// Heat-flow sensors, W; left out where there is none.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub heat_flows: BTreeMap<String, f64>,
    /// Share of its sources' power that each controller gives, from 0 to 1; left out where there is none.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub controllers: BTreeMap<String, f64>,
    pub enclosures: BTreeMap<String, Vec<SurfaceRecord>>,
    pub limits: Vec<LimitRecord>,
    pub boundaries: BTreeMap<String, BoundaryRecord>,
    pub heat_balance: BalanceRecord,
    pub part_to_part: Vec<FlowRecord>,
    /// Imported parts in several pieces, and boundaries whose laws are outside their ranges.
    pub notes: Vec<String>,
    /// Error of the mesh in every reading, if it was estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshRecord>,
    /// How the cells were chosen, where an accuracy was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen_cells: Option<ChosenRecord>,
    pub unknowns: usize,
    pub newton_iterations: usize,
    pub krylov_iterations: usize,
    pub seconds: SecondsRecord,
}

/// Water in one channel.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct ChannelRecord {
    pub outlet_degC: f64,
    pub flow_m3_s: f64,
    pub reynolds: f64,
    pub h_W_m2K: f64,
    pub pressure_drop_Pa: f64,
    /// A law outside its range.
    pub note: Option<String>,
}

/// One contact.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct ContactRecord {
    pub area_m2: f64,
    /// Infinite where bonded.
    pub hA_W_K: f64,
    pub heat_W: f64,
    pub drop_K: f64,
}

/// One boundary.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct BoundaryRecord {
    /// Open area that it acts on.
    pub area_m2: f64,
    /// Heat that it brings into the machine.
    pub heat_W: f64,
}

/// Error of the mesh.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct MeshRecord {
    /// Estimated error of each reading, K.
    pub errors_K: BTreeMap<String, f64>,
    /// Estimated error of each displacement, um.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub errors_um: BTreeMap<String, f64>,
    /// Estimated error of each heat-flow sensor, W.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub heat_flows_W: BTreeMap<String, f64>,
    /// Estimated error of the heat through each contact, W.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub contacts_W: BTreeMap<String, f64>,
    /// Observed order of convergence; `null` where readings do not approach a limit evenly.
    pub orders: BTreeMap<String, Option<f64>>,
    /// Cells of the two coarser meshes that were solved for the estimate.
    pub cells: [usize; 2],
    pub tolerance_K: f64,
    /// Whether every estimate keeps the tolerance.
    pub within_tolerance: bool,
}

impl MeshRecord {
    /// Errors of a model's sensors beside a tolerance (K).
    pub fn of(model: &MeshedMachine, mesh: &MeshErrors, tolerance: f64) -> Self {
        let names = || model.network.sensor_names.iter().cloned();
        let all = |measurand| {
            names().zip(&mesh.errors).zip(&model.network.measurands).filter(move |(_, own)| **own == measurand).map(|(own, _)| own)
        };
        let temperatures = || all(Measurand::Temperature);
        Self {
            errors_K: temperatures().map(|(name, e)| (name, *e)).collect(),
            errors_um: all(Measurand::Displacement).map(|(name, e)| (name, *e)).collect(),
            heat_flows_W: model.network.meters.iter().map(|own| own.name.clone()).zip(mesh.heats.iter().copied()).collect(),
            contacts_W: model
                .network
                .contacts
                .iter()
                .map(|own| own.name.clone())
                .zip(mesh.heats.iter().skip(model.network.meters.len()).copied())
                .collect(),
            orders: names().zip(mesh.orders.iter().copied()).collect(),
            cells: mesh.cells,
            tolerance_K: tolerance,
            within_tolerance: temperatures().all(|(_, e)| *e <= tolerance),
        }
    }
}

/// Cells that were chosen to keep readings within an accuracy.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct ChosenRecord {
    pub accuracy_K: f64,
    pub cells: usize,
    /// Estimated error of the mesh in each temperature, at the condition with the largest error.
    pub errors_K: BTreeMap<String, f64>,
    /// Estimated error of the mesh in each limit's value.
    pub limits_K: BTreeMap<String, f64>,
    /// Estimated error from cells that the file states for a part, by part; not counted in `errors_K`.
    pub stated_K: BTreeMap<String, f64>,
    /// Cells of the mesh with all lines cut in two, from which the estimates come.
    pub checked_on: usize,
    /// Number of conditions that keep the accuracy.
    pub conditions: usize,
    /// Cells and largest estimate, K, of every mesh on the way.
    pub rounds: Vec<(usize, f64)>,
}

impl ChosenRecord {
    /// Record of a model's cells; `None` if they were not chosen for an accuracy.
    pub fn of(model: &MeshedMachine) -> Option<Self> {
        let chosen = model.chosen.as_ref()?;
        let named = |names: &mut dyn Iterator<Item = &String>, errors: &[Option<f64>]| -> BTreeMap<String, f64> {
            names.zip(errors).filter_map(|(name, e)| Some((name.clone(), (*e)?))).collect()
        };
        Some(Self {
            accuracy_K: chosen.accuracy,
            cells: model.mesh.cells,
            errors_K: named(&mut model.network.sensor_names.iter(), &chosen.sensors),
            limits_K: named(&mut model.machine.limits.iter().map(|l| &l.name), &chosen.limits),
            stated_K: chosen.stated.iter().map(|(part, open)| (model.machine.parts[*part].name.clone(), *open)).collect(),
            checked_on: chosen.checked_on,
            conditions: chosen.conditions,
            rounds: chosen.rounds.clone(),
        })
    }
}

/// One surface of an enclosure.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct SurfaceRecord {
    pub surface: String,
    /// Heat that the surface gives off.
    pub heat_W: f64,
}

/// One limit; absolute temperatures in degC, differences in K, displacements in um.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct LimitRecord {
    pub name: String,
    pub value: f64,
    pub limit: f64,
    pub margin: f64,
}

/// The heat balance; positive is into the machine.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct BalanceRecord {
    pub in_W: f64,
    pub out_W: f64,
    pub relative: f64,
    pub sources_W: BTreeMap<String, f64>,
    pub radiation_W: f64,
    pub gas_W: f64,
    pub coolant_W: f64,
}

/// Heat from one part to another.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct FlowRecord {
    pub from: String,
    pub to: String,
    pub heat_W: f64,
}

/// Computing times, s.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct SecondsRecord {
    pub assemble: f64,
    pub solve: f64,
    /// From the machine file to the result, if it was timed.
    pub total: f64,
}

impl MeshedMachine {
    /// Remarks on a state: imported parts in several pieces, and boundaries whose laws leave their ranges.
    pub fn notes(&self, state: &SteadyState) -> Vec<String> {
        self.loose_pieces().chain(self.held_heats()).chain(self.boundary_notes(state)).collect()
    }

    /// Remarks on boundaries whose laws leave their ranges in a state, one for each boundary.
    fn boundary_notes(&self, state: &SteadyState) -> Vec<String> {
        let (network, load) = (&self.network, &state.load);
        let note = |(b, at): (usize, &BoundaryState)| {
            let BoundaryState::FreeConvection(law, gas) = at else { return None };
            let own = network.surfaces.iter().filter(|surface| surface.laws.contains(&(b as u32)));
            let mut notes = own.filter_map(|surface| {
                let temperature = surface.state(state.solution.temperatures[surface.node as usize], &network.properties, load).temperature;
                law.note(temperature, *gas)
            });
            notes.next().map(|note| format!("boundary '{}': {note}", self.machine.boundaries[b].name))
        };
        load.boundaries.iter().enumerate().filter_map(note).collect()
    }

    /// Heat through every heat-flow sensor, W.
    pub fn heat_flows(&self, state: &SteadyState) -> Vec<f64> {
        heat_flows(&self.network, &state.load, &state.solution.streams, &state.solution.temperatures)
    }

    /// A state for other programs; the total time is that of assembly and solution.
    pub fn record(&self, state: &SteadyState) -> SolveRecord {
        let (network, solution) = (&self.network, &state.solution);
        let notes = network.coolant_notes(&solution.streams, &solution.temperatures);
        let coolant = (network.streams.iter().zip(&solution.streams).zip(notes)).map(|((stream, at), note)| {
            let record = ChannelRecord {
                outlet_degC: celsius(solution.temperatures[stream.outlet() as usize]),
                flow_m3_s: at.flow,
                reynolds: at.reynolds,
                h_W_m2K: at.film,
                pressure_drop_Pa: at.pressure_drop,
                note,
            };
            (stream.name.clone(), record)
        });
        let enclosures = (network.enclosures.iter().zip(enclosure_heats(network, &solution.temperatures))).map(|(e, heats)| {
            let surfaces = e.surfaces.iter().zip(heats).map(|(s, q)| SurfaceRecord { surface: s.clone(), heat_W: q });
            (e.name.clone(), surfaces.collect())
        });
        let name = |holder: Holder| match holder {
            Holder::Group(group) => network.groups[group].clone(),
            Holder::Wall => "chamber wall".to_string(),
        };
        let flow = |(a, b, heat): (Holder, Holder, f64)| FlowRecord { from: name(a), to: name(b), heat_W: heat };
        let balance = &solution.balance;
        let boundaries = (self.machine.boundaries.iter().zip(&network.acting).zip(&balance.boundaries))
            .map(|((b, area), heat)| (b.name.clone(), BoundaryRecord { area_m2: area.acting, heat_W: *heat }));
        SolveRecord {
            readings: self.shown(state).into_iter().collect(),
            sensors: network.sensor_names.iter().cloned().zip(self.readings(state)).collect(),
            coolant: coolant.collect(),
            contacts: contact_flows(network, &state.load.contacts, &solution.temperatures).into_iter().map(ContactRecord::of).collect(),
            heat_flows: network.meters.iter().map(|m| m.name.clone()).zip(self.heat_flows(state)).collect(),
            controllers: network.loops.iter().map(|own| own.name.clone()).zip(solution.shares.iter().copied()).collect(),
            enclosures: enclosures.collect(),
            limits: self.limits(state).iter().map(LimitRecord::of).collect(),
            boundaries: boundaries.collect(),
            heat_balance: BalanceRecord {
                in_W: balance.in_watts,
                out_W: balance.out_watts,
                relative: balance.relative,
                sources_W: self.machine.sources.iter().zip(&balance.sources).map(|(s, q)| (s.name.clone(), *q)).collect(),
                radiation_W: balance.radiation,
                gas_W: balance.gas,
                coolant_W: balance.circuits.iter().sum(),
            },
            part_to_part: exchanged(network, &state.load, &solution.temperatures).into_iter().map(flow).collect(),
            notes: self.notes(state),
            mesh: None,
            chosen_cells: ChosenRecord::of(self),
            unknowns: network.nodes,
            newton_iterations: solution.newton_iterations,
            krylov_iterations: solution.krylov_iterations,
            seconds: SecondsRecord {
                assemble: solution.assemble_seconds,
                solve: solution.solve_seconds,
                total: solution.assemble_seconds + solution.solve_seconds,
            },
        }
    }
}

impl ContactRecord {
    fn of(flow: ContactFlow) -> (String, Self) {
        (flow.name, Self { area_m2: flow.area, hA_W_K: flow.conductance, heat_W: flow.heat, drop_K: flow.drop })
    }
}

impl LimitRecord {
    fn of(limit: &LimitState) -> Self {
        let (value, maximum) = (limit.shown(limit.value), limit.shown(limit.maximum));
        Self { name: limit.name.clone(), value, limit: maximum, margin: limit.margin() }
    }
}
