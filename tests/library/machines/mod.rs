//! The shipped machines: every one loads and solves, and their numbers agree with hand calculations.

mod five_axis;
mod rig;
mod sweeps;
mod teaching;

use std::path::{Path, PathBuf};

use coldplate_base::units::{Celsius, Measurand};
use coldplate_describe::machine::{Condition, Machine};
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// A folder of the project.
fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The files with one extension in a folder of the project.
fn files(name: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut found: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    found.sort();
    found
}

/// A machine with its state at one condition.
struct Solved {
    model: MeshedMachine,
    condition: Condition,
    state: SteadyState,
}

impl Solved {
    /// Solves `machines/NAME.toml` with `--set` pairs at a condition, on about `cells` cells.
    fn new(name: &str, sets: &[(&str, &str)], condition: &[(&str, &str)], cells: Option<usize>) -> Self {
        let sets: Vec<(String, String)> = sets.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        let machine = Machine::read(folder("machines").join(name), &sets).unwrap_or_else(|e| panic!("{name}: {e}"));
        let condition = machine.condition(condition).unwrap_or_else(|e| panic!("{name}: {e}"));
        let model = MeshedMachine::new(machine, cells).unwrap_or_else(|e| panic!("{name}: {e}"));
        let state = {
            let solver = model.solver(&condition).unwrap_or_else(|e| panic!("{name}: {e}"));
            model.solve(&solver, &condition).unwrap_or_else(|e| panic!("{name}: {e}"))
        };
        Self { model, condition, state }
    }

    /// A sensor's reading, degC.
    fn read(&self, sensor: &str) -> f64 {
        let at = self.model.machine.sensors.iter().position(|s| s.name == sensor).unwrap_or_else(|| panic!("no sensor {sensor}"));
        self.model.readings(&self.state)[at]
    }

    /// Power of a source, W.
    fn power(&self, source: &str) -> f64 {
        let at = self.model.machine.sources.iter().position(|s| s.name == source).unwrap_or_else(|| panic!("no source {source}"));
        self.state.load.powers[at]
    }

    /// A contact: area (m²), conductance of the interface (W/K), heat (W), drop (K).
    fn contact(&self, name: &str) -> coldplate_solve::balance::ContactFlow {
        let flows =
            coldplate_solve::balance::contact_flows(&self.model.network, &self.state.load.contacts, &self.state.solution.temperatures);
        flows.into_iter().find(|f| f.name == name).unwrap_or_else(|| panic!("no contact {name}"))
    }

    /// Outlet temperature of a channel, degC.
    fn outlet(&self, channel: &str) -> f64 {
        let stream = self.model.network.streams.iter().find(|s| s.name == channel).unwrap_or_else(|| panic!("no channel {channel}"));
        let kelvin = self.state.solution.temperatures[stream.outlet() as usize];
        Celsius::from(coldplate_base::units::Kelvin(kelvin)).0
    }
}

/// A condition of the four variables for machines that have no defaults.
const USUAL: [(&str, &str); 4] =
    [("coolant_flow", "4 L/min"), ("coolant_temperature", "20.5 degC"), ("motor_speed", "1000 rpm"), ("ambient_temperature", "23 degC")];

#[test]
fn every_machine_solves() {
    let machines = files("machines");
    assert!(machines.len() >= 4, "{machines:?}");
    for path in machines {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let solved = Solved::new(&name, &[], &USUAL, Some(2000));
        let balance = &solved.state.solution.balance;
        assert!(balance.relative < 1e-8, "{name}: {}", balance.relative);
        assert!(!solved.model.machine.sensors.is_empty() && !solved.model.machine.limits.is_empty(), "{name} asks nothing");
        // Heat is put in everywhere, so nothing is colder than the colder of water and wall.
        for (sensor, reading) in solved.model.machine.sensors.iter().zip(solved.model.readings(&solved.state)) {
            let is_usual = match sensor.measurand() {
                Measurand::Temperature => (20.499..90.0).contains(&reading),
                Measurand::Displacement => reading.abs() < 100.0,
            };
            assert!(is_usual, "{name}: {} {reading}", sensor.name);
        }
    }
}

/// The paper's machines say why each assumed number was chosen, and compare themselves with readings.
#[test]
fn assumptions_and_measurements() {
    for (name, least, readings) in [("rig.toml", 15, [4, 4].as_slice()), ("five_axis.toml", 60, &[16])] {
        let machine = Machine::read(folder("machines").join(name), &[]).unwrap();
        assert!(machine.assumptions.len() >= least, "{name}: {}", machine.assumptions.len());
        assert_eq!(machine.measurements.iter().map(|m| m.readings.len()).collect::<Vec<_>>(), readings, "{name}");
    }
}
