//! What every test here does: machine text -> mesh -> network -> solution -> numbers, and the comparison.

use coldplate_base::units::ZERO_CELSIUS;
use coldplate_describe::machine::Machine;
use coldplate_network::Network;
use coldplate_network::mesh::Mesh;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// Values of the four variables, for machines that name none of them.
pub const CONDITION: [(&str, &str); 4] =
    [("coolant_flow", "1 L/min"), ("coolant_temperature", "20 degC"), ("motor_speed", "0 rpm"), ("ambient_temperature", "20 degC")];

/// A machine solved on one mesh.
pub struct Solved {
    /// Machine, mesh and network.
    pub model: MeshedMachine,
    /// The steady state.
    pub state: SteadyState,
}

/// Reads a machine from the text of a machine file. What no steady state depends on (its name, density and
/// specific heat of its materials) is filled in here.
#[track_caller]
pub fn machine(text: &str) -> Machine {
    let mut whole = String::from("name = \"case\"\n");
    for line in text.lines() {
        whole += line;
        whole += "\n";
        if line.trim_start().starts_with("[material.") {
            whole += "density = \"7900 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"\n";
        }
    }
    match Machine::from_text(&whole, "case.toml", &[]) {
        Ok(machine) => machine,
        Err(e) => panic!("{e}\n{whole}"),
    }
}

/// The machine on a mesh of an element size (m), not solved.
#[track_caller]
pub fn model(text: &str, size: f64) -> MeshedMachine {
    let machine = machine(text);
    let mesh = Mesh::with_size(&machine, size).unwrap_or_else(|e| panic!("{e}"));
    let network = Network::build(&machine, &mesh).unwrap_or_else(|e| panic!("{e}"));
    MeshedMachine { machine, mesh, network, chosen: None }
}

/// Solves the machine on a mesh of an element size (m), at [`CONDITION`].
#[track_caller]
pub fn solve(text: &str, size: f64) -> Solved {
    solved(model(text, size))
}

/// Solves a model at [`CONDITION`].
#[track_caller]
pub fn solved(model: MeshedMachine) -> Solved {
    let condition = model.machine.condition(&CONDITION).unwrap_or_else(|e| panic!("{e}"));
    let state = {
        let solver = model.solver(&condition).unwrap_or_else(|e| panic!("{e}"));
        model.solve(&solver, &condition).unwrap_or_else(|e| panic!("{e}"))
    };
    Solved { model, state }
}

impl Solved {
    /// Reading of a sensor, degC.
    #[track_caller]
    pub fn celsius(&self, sensor: &str) -> f64 {
        self.kelvin(sensor) - ZERO_CELSIUS
    }

    /// Reading of a sensor, K.
    #[track_caller]
    pub fn kelvin(&self, sensor: &str) -> f64 {
        let i = position(self.model.network.sensor_names.iter().map(String::as_str), sensor);
        self.model.network.sensors[i].read(&self.state.solution.temperatures, &self.state.load)
    }

    /// Heat that a boundary brings into the machine, W.
    #[track_caller]
    pub fn heat_in(&self, boundary: &str) -> f64 {
        let i = position(self.model.machine.boundaries.iter().map(|b| b.name.as_str()), boundary);
        self.state.solution.balance.boundaries[i]
    }

    /// Heat through a contact from its first side to its second, W, and its area, m².
    #[track_caller]
    pub fn contact(&self, name: &str) -> (f64, f64) {
        let flows =
            coldplate_solve::balance::contact_flows(&self.model.network, &self.state.load.contacts, &self.state.solution.temperatures);
        let i = position(flows.iter().map(|f| f.name.as_str()), name);
        (flows[i].heat, flows[i].area)
    }
}

#[track_caller]
fn position<'a>(mut names: impl Iterator<Item = &'a str>, name: &str) -> usize {
    names.position(|n| n == name).unwrap_or_else(|| panic!("the machine has no '{name}'"))
}

/// Richardson's extrapolation of values on meshes of which each is `ratio` times finer than the one
/// before: removes the errors of order `first`, `first` + 2, ... in turn.
pub fn extrapolate(values: &[f64], ratio: f64, first: i32) -> f64 {
    let mut column = values.to_vec();
    let mut order = first;
    while column.len() > 1 {
        let weight = ratio.powi(order);
        column = column.windows(2).map(|v| (weight * v[1] - v[0]) / (weight - 1.0)).collect();
        order += 2;
    }
    column[0]
}

/// Observed order of convergence of three values on meshes of equal refinement `ratio`.
pub fn observed_order(values: [f64; 3], ratio: f64) -> f64 {
    ((values[0] - values[1]) / (values[1] - values[2])).abs().ln() / ratio.ln()
}

/// Compares a computed value with the exact one, relative to `span`, and prints a row of the table in
/// docs/record/verification.md.
#[track_caller]
pub fn check(case: &str, quantity: &str, found: f64, exact: f64, span: f64, tolerance: f64) {
    let error = ((found - exact) / span).abs();
    println!("| {case} | {quantity} | {exact:.9} | {found:.9} | {error:.1e} | {tolerance:.0e} |");
    assert!(
        error <= tolerance,
        "{case}, {quantity}: found {found:.12}, exact {exact:.12}: error {error:.3e} of {span}, allowed {tolerance:.1e}"
    );
}
