//! Sensors that do not exist yet: a thermometer in water that leaves, on a part or node that an explanation speaks of.

use crate::{Explanation, Problem};
use coldplate_base::document::{Leaf, quoted};
use coldplate_base::error::Result;
use coldplate_describe::machine::SensorReading;

/// Most sensors that are proposed.
const MOST: usize = 6;

/// A sensor that a machine file could have.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Proposed {
    /// Its name.
    pub name: String,
    /// Its entry in the machine file, as TOML.
    pub entry: String,
}

/// A diagnosis of a machine that has further sensors, after its own; `None` where no place for one is left.
pub(super) fn with_proposed(problem: &Problem, alive: &[&Explanation]) -> Result<Option<(Problem, Vec<Proposed>)>> {
    let parts: Vec<&String> = alive.iter().flat_map(|e| e.causes.iter().flat_map(|c| &c.hypothesis.parts)).collect();
    let places: Vec<&String> = alive.iter().flat_map(|e| e.causes.iter().map(|c| &c.hypothesis.place)).collect();
    let mut proposed = proposals(problem, &parts, &places);
    proposed.truncate(MOST);
    with(problem, proposed)
}

/// A diagnosis of a machine that has a sensor in every place without one.
pub(crate) fn with_all_proposed(problem: &Problem) -> Result<Option<(Problem, Vec<Proposed>)>> {
    let machine = &problem.study.model.machine;
    let parts: Vec<&String> = machine.parts.iter().map(|p| &p.name).chain(machine.nodes.iter().map(|n| &n.name)).collect();
    let places: Vec<&String> = machine.channels.iter().map(|c| &c.name).collect();
    with(problem, proposals(problem, &parts, &places))
}

fn with(problem: &Problem, proposed: Vec<Proposed>) -> Result<Option<(Problem, Vec<Proposed>)>> {
    let sets: Vec<(String, String)> = proposed.iter().map(|p| (format!("sensor.{}", quoted(&p.name)), p.entry.clone())).collect();
    if sets.is_empty() {
        return Ok(None);
    }
    let study = problem.study.edited(&sets)?;
    let (own, new) = (&problem.study.model.machine.sensors, &study.model.machine.sensors);
    // The data speak of sensors by their place in the list.
    let is_after = own.iter().zip(new).all(|(a, b)| a.name == b.name);
    Ok(is_after.then(|| (Problem { study, ..problem.clone() }, proposed)))
}

/// Water that leaves a circuit, then some parts and nodes, where nothing is measured.
fn proposals(problem: &Problem, parts: &[&String], places: &[&String]) -> Vec<Proposed> {
    let machine = &problem.study.model.machine;
    let text = |t: &str| Leaf::Text(t.into()).to_toml();
    let is_free = |name: &str| machine.sensors.iter().all(|s| s.name != name);
    let mut found: Vec<Proposed> = Vec::new();
    let mut add = |name: String, key: &str, place: &str| {
        if is_free(&name) && found.iter().all(|p| p.name != name) {
            found.push(Proposed { name, entry: format!("{{ {key} = {} }}", text(place)) });
        }
    };
    for (c, channel) in machine.channels.iter().enumerate() {
        let is_measured = machine.sensors.iter().any(|s| s.reads == SensorReading::Outlet(c));
        let is_meant = places.contains(&&channel.name) || parts.contains(&&machine.parts[channel.part].name);
        if !is_measured && (is_meant || machine.channels.len() <= 2) {
            add(format!("water leaving {}", channel.name), "outlet", &channel.name);
        }
    }
    for part in parts.iter().copied() {
        let own = machine.parts.iter().position(|p| p.name == *part);
        let node = machine.nodes.iter().position(|n| n.name == *part && n.fixed.is_none());
        let is_measured = machine.sensors.iter().any(|s| match (&s.reads, own, node) {
            (SensorReading::Point(p, _) | SensorReading::PartMean(p), Some(own), _) => *p == own,
            (SensorReading::FaceMean(face), Some(own), _) => face.part == own,
            (SensorReading::Node(n), _, Some(node)) => *n == node,
            _ => false,
        });
        match (own, node) {
            _ if is_measured => {}
            (Some(_), _) => add(format!("{part}, mean"), "part", part),
            (_, Some(_)) => add(format!("{part}, itself"), "node", part),
            _ => {}
        }
    }
    found
}
