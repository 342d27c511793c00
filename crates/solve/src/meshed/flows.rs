//! Heat of a state by source and by sink, with names.

use super::{MeshedMachine, SteadyState};
use crate::heat_paths::{RouteEnd, heat_routes};
use coldplate_describe::machine::SensorReading;

/// Heat by source and by sink, W.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Flows {
    /// Heat that enters: from every source of the machine file.
    pub sources: Vec<(String, f64)>,
    /// Heat that leaves: into the water of every circuit, the chamber wall, residual gas, boundaries and held nodes; negative where
    /// heat enters there.
    pub sinks: Vec<(String, f64)>,
}

/// A place that heat comes from or goes to.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatPlace {
    /// Kind and index of the place.
    pub stop: RouteEnd,
    /// Name of the place.
    pub name: String,
}

/// Heat from one named place to another.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedRoute {
    /// Place that the heat comes from.
    pub from: HeatPlace,
    /// Place that the heat goes to.
    pub to: HeatPlace,
    /// Heat, W; positive.
    pub watts: f64,
}

/// Water of a circuit whose outlet has a sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct OutletSensor {
    /// Sensor of the machine.
    pub sensor: usize,
    /// Circuit.
    pub circuit: usize,
    /// Stream that leaves.
    pub stream: usize,
}

impl MeshedMachine {
    /// The heat flows of a state.
    pub fn flows(&self, state: &SteadyState) -> Flows {
        let balance = &state.solution.balance;
        let sources = self.machine.sources.iter().zip(&balance.sources).map(|(s, q)| (s.name.clone(), *q));
        let circuits = self.network.circuits.iter().zip(&balance.circuits).map(|(c, q)| (format!("coolant {}", c.circuit.name), -q));
        let boundaries = self.machine.boundaries.iter().zip(&balance.boundaries).map(|(b, q)| (b.name.clone(), -q));
        let held = self.network.fixed.iter().zip(&balance.held).map(|((node, _), q)| {
            let group = self.network.group[*node as usize] as usize;
            (self.network.groups.get(group).cloned().unwrap_or_default(), -q)
        });
        let walls = [("chamber wall".to_string(), -balance.radiation), ("residual gas".to_string(), -balance.gas)];
        Flows { sources: sources.collect(), sinks: circuits.chain(walls).chain(boundaries).chain(held).collect() }
    }

    /// The ways heat takes in a state, from sources through parts to where it leaves.
    pub fn routes(&self, state: &SteadyState) -> Vec<NamedRoute> {
        let solution = &state.solution;
        let name = |stop: RouteEnd| match stop {
            RouteEnd::Source(s) => self.machine.sources.get(s).map(|s| s.name.clone()),
            RouteEnd::Group(g) => self.network.groups.get(g).cloned(),
            RouteEnd::Circuit(c) => self.network.circuits.get(c).map(|c| format!("coolant {}", c.circuit.name)),
            RouteEnd::Wall => Some("chamber wall".into()),
            RouteEnd::Gas => Some("residual gas".into()),
            RouteEnd::Boundary(b) => self.machine.boundaries.get(b).map(|b| b.name.clone()),
        };
        let named = |stop: RouteEnd| HeatPlace { stop, name: name(stop).unwrap_or_default() };
        let routes = heat_routes(&self.network, &state.load, &solution.streams, &solution.temperatures);
        routes.into_iter().map(|r| NamedRoute { from: named(r.from), to: named(r.to), watts: r.watts }).collect()
    }

    /// Sensors in the water that leaves a circuit, where all of it leaves through one channel and its inlet temperature is
    /// stated.
    pub fn outlet_sensors(&self) -> Vec<OutletSensor> {
        let streams = &self.network.streams;
        let leaves = |s: usize| streams.iter().all(|other| other.circuit != streams[s].circuit || !other.upstream.contains(&s));
        let of = |(sensor, stated): (usize, &coldplate_describe::machine::Sensor)| {
            let SensorReading::Outlet(channel) = stated.reads else { return None };
            let stream = streams.iter().position(|s| s.name == self.machine.channels[channel].name)?;
            let circuit = streams[stream].circuit;
            let ends = (0..streams.len()).filter(|s| streams[*s].circuit == circuit && leaves(*s)).count();
            let is_fed = !self.network.circuits[circuit].circuit.intake.feeders().is_empty();
            (leaves(stream) && ends == 1 && !is_fed).then_some(OutletSensor { sensor, circuit, stream })
        };
        self.machine.sensors.iter().enumerate().filter_map(of).collect()
    }
}
