//! A machine on a mesh, ready to be solved at any condition.

mod boundaries;
mod budget;
mod cells_by_error;
mod coarse_start;
pub mod described;
mod flows;
mod inventory;
mod limits;
mod mesh_error;
pub mod record;

pub use boundaries::BoundaryEntry;
pub use cells_by_error::ChosenCells;
pub use flows::{Flows, HeatPlace, NamedRoute, OutletSensor};
pub use inventory::{ChannelEntry, ContactEntry, ImportEntry, Inventory, PartEntry, SourceEntry, inventory, source_powers};
pub use limits::{LimitState, limit_states};
pub use mesh_error::MeshErrors;
pub use record::{ChosenRecord, MeshRecord, SolveRecord};

use crate::{Solution, Solver, SteadySettings};
use coldplate_base::error::Result;
use coldplate_base::progress::{Progress, Silent};
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::mesh::Mesh;
use coldplate_network::{Load, Network};

/// Machine, mesh and network.
#[derive(Debug, Clone)]
pub struct MeshedMachine {
    /// The machine.
    pub machine: Machine,
    /// Mesh of the machine.
    pub mesh: Mesh,
    /// Network of the machine on this mesh.
    pub network: Network,
    /// How the cells were chosen, if an accuracy was asked for.
    pub chosen: Option<ChosenCells>,
}

impl MeshedMachine {
    /// Meshes `machine` with about `cells` cells and builds its network. With `None` the machine file states their number, or the error
    /// that they may leave at the conditions that the machine is made for ([`Machine::usual_conditions`]).
    ///
    /// # Errors
    /// Errors of [`MeshedMachine::for_conditions`].
    pub fn new(machine: Machine, cells: Option<usize>) -> Result<Self> {
        Self::for_conditions(machine, cells, Machine::usual_conditions, &Silent)
    }

    /// Meshes `machine` as [`MeshedMachine::new`] does, with given `conditions` for an accuracy.
    ///
    /// # Errors
    /// Errors of [`Mesh::with_cells`] and [`Network::build`]; more cells than the free memory holds. If an accuracy is asked for,
    /// errors of [`MeshedMachine::within`] and of `conditions`.
    pub fn for_conditions(
        machine: Machine,
        cells: Option<usize>,
        conditions: impl FnOnce(&Machine) -> Result<Vec<Condition>>,
        progress: &dyn Progress,
    ) -> Result<Self> {
        if let (None, Some(accuracy)) = (cells, machine.accuracy) {
            let conditions = conditions(&machine)?;
            return Self::within(machine, accuracy, &conditions, progress);
        }
        let size = Mesh::size_for(&machine, cells.unwrap_or(machine.default_cells))?;
        budget::check(Mesh::count(&machine, size))?;
        let mesh = Mesh::with_size(&machine, size)?;
        Self::on(machine, mesh)
    }

    /// Builds the network of `machine` on a mesh of it.
    ///
    /// # Errors
    /// Errors of [`Network::build`].
    pub fn on(machine: Machine, mesh: Mesh) -> Result<Self> {
        let network = Network::build(&machine, &mesh).map_err(|error| error.in_file(&machine.file))?;
        Ok(Self { machine, mesh, network, chosen: None })
    }

    /// A solver whose setup is shared by every condition; `reference` should resemble them.
    ///
    /// # Errors
    /// Errors of [`Solver::new`].
    pub fn solver(&self, reference: &Condition) -> Result<Solver<'_>> {
        self.solver_heard(reference, &Silent).map_err(|error| error.in_file(&self.machine.file))
    }

    /// A solver whose setup is shared by every condition, with reports to `progress`.
    ///
    /// # Errors
    /// Errors of [`Solver::new`].
    pub fn solver_heard(&self, reference: &Condition, progress: &dyn Progress) -> Result<Solver<'_>> {
        let load = Load::at(&self.machine, reference)?;
        match self.start(reference) {
            Some(start) => Solver::near(&self.network, &load, start, SteadySettings::default(), progress)
                .or_else(|_| Solver::heard(&self.network, &load, progress)),
            None => Solver::heard(&self.network, &load, progress),
        }
    }

    /// Solves a single condition; [`MeshedMachine::solver`] and [`MeshedMachine::solve`] share the setup between many.
    ///
    /// # Errors
    /// Errors of [`MeshedMachine::solver`] and [`MeshedMachine::solve`].
    pub fn steady(&self, condition: &Condition) -> Result<SteadyState> {
        self.solve(&self.solver(condition)?, condition)
    }

    /// Solves one condition.
    ///
    /// # Errors
    /// Errors of [`Load::at`] and [`Solver::steady`].
    pub fn solve(&self, solver: &Solver<'_>, condition: &Condition) -> Result<SteadyState> {
        let load = Load::at(&self.machine, condition)?;
        let solution = solver.steady(&load)?;
        Ok(SteadyState { load: load.with_shares(&self.network, &solution.shares), solution })
    }

    /// Solves one condition from temperatures of all nodes (K) that are about `error` (K) from the solution.
    ///
    /// # Errors
    /// Errors of [`Load::at`] and [`Solver::steady_from`].
    pub fn solve_from(&self, solver: &Solver<'_>, condition: &Condition, start: &[f64], error: f64) -> Result<SteadyState> {
        let load = Load::at(&self.machine, condition)?;
        let solution = solver.steady_from(&load, start, error)?;
        Ok(SteadyState { load: load.with_shares(&self.network, &solution.shares), solution })
    }

    /// The machine's limits in a state.
    pub fn limits(&self, state: &SteadyState) -> Vec<LimitState> {
        limit_states(&self.machine, &self.read(state), &state.load.variables)
    }

    /// Values (degC) that sensors with an error of their own show in a state, by name.
    pub fn shown(&self, state: &SteadyState) -> Vec<(String, f64)> {
        let sensors = self.machine.sensors.iter().zip(self.read(state));
        let settled = sensors.map(|(s, t)| (s, t, s.shows.settled(t, state.load.chamber)));
        settled.filter(|(_, t, shown)| shown != t).map(|(s, _, shown)| (s.name.clone(), s.measurand().shown(shown))).collect()
    }

    /// Temperatures of the places of all sensors in a state, degC, and displacements, um, in the machine's order.
    pub fn readings(&self, state: &SteadyState) -> Vec<f64> {
        self.network.measurands.iter().zip(self.read(state)).map(|(own, reading)| own.shown(reading)).collect()
    }

    /// Temperatures of the places of all sensors in a state, K, and displacements, um, in the machine's order.
    pub fn read(&self, state: &SteadyState) -> Vec<f64> {
        self.network.sensors.iter().map(|s| s.read(&state.solution.temperatures, &state.load)).collect()
    }
}

/// A solved condition.
#[derive(Debug, Clone)]
pub struct SteadyState {
    /// The condition's numbers.
    pub load: Load,
    /// Temperatures, streams and balance.
    pub solution: Solution,
}
