//! What could be wrong: place x kind x law, composed from the machine's own network.
//!
//! Nothing here is a list for one machine. Every part, contact, channel, circuit, source, surface, sensor and pair of them
//! is a place; what can go wrong there is a kind; how it depends on the condition is a law. A hypothesis is an edit of the
//! thermal network of one amplitude ([`Act`], for screening) and the same as lines of the machine file
//! ([`Hypothesis::sets`], for refitting and for the extended machine).

use crate::describe::machine::{BoundaryLaw, Condition, Machine, Place, Shape};
use crate::discretise::network::stream::members;
use crate::discretise::network::{Load, Network};
use crate::evidence::measurement::Data;
use crate::foundation::document::{Leaf, quoted};
use crate::solve::sensitivity::Study;

/// Reference temperature of drifts and gains, K.
pub const REFERENCE: f64 = 293.15;
/// Kelvin over which a drifting contact changes by its amplitude.
pub const DRIFT: f64 = 10.0;
/// Temperature a network's capacities are stated at, K.
const STANDARD: f64 = 300.0;
/// What solids store, J/(m³ K): steel 3.9e6, copper 3.4e6, aluminium 2.4e6, plastics 1.5e6 to 2.5e6. A part that stores much
/// less in the model is not made of anything.
const USUAL_STORE: f64 = 3.5e6;
/// Film of free convection and radiation in a room, W/(m² K).
const ROOM_FILM: f64 = 5.0;
/// A part's heat capacity can fall to this share of the model's.
pub(super) const LEAST_STORE: f64 = 0.05;
/// Name of what an extended machine file adds.
pub(super) const ADDED: &str = "diagnosed";

/// What acts on the network; amplitudes as the comments say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Act {
    /// Heat into a group, W.
    Heat(u32),
    /// Heat of a source of the file, relative.
    Source(usize),
    /// Heat of a source that the user's file of kinds adds, per unit.
    UserHeat(usize),
    /// Conductance of a contact, logarithm.
    Contact(usize),
    /// Film of a channel, logarithm.
    Film(usize),
    /// Flow of a circuit, logarithm.
    Flow(usize),
    /// Loss coefficient of one of parallel channels, more than the model has.
    Branch(usize),
    /// Inlet temperature of a circuit, K.
    Inlet(usize),
    /// Temperature of the chamber, K.
    Chamber,
    /// Emissivity of a group, logarithm.
    Emissivity(u32),
    /// Pressure of the residual gas, Pa more than the model has.
    Gas,
    /// Conductance from a group to the chamber's temperature, W/K.
    Leak(u32),
    /// Conductance between two groups, W/K.
    Link(u32, u32),
    /// Exchange area between two groups, m².
    Radiate(u32, u32),
    /// Film from the outer faces of a part that the model has adiabatic to the ambient temperature, W/(m² K).
    Loss(usize),
    /// Film of a boundary of the file, logarithm.
    Boundary(usize),
    /// Heat capacity of a group, J/K more than the model has; logs only.
    Capacity(u32),
    /// Offset of a sensor of the data, K.
    Bias(usize),
    /// Gain of a sensor of the data, relative, counted from 20 degC.
    Gain(usize),
    /// Time constant of a sensor of the data, s; logs only.
    Lag(usize),
    /// Two sensors of the data exchanged; amplitude 1.
    Swap(usize, usize),
}

/// How an effect depends on the condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Law {
    /// Not at all.
    Constant,
    /// In proportion to the motor speed.
    Speed,
    /// With the square of the motor speed.
    SpeedSquared,
    /// In proportion to one over the coolant flow.
    InverseFlow,
    /// In proportion to the temperature above 20 degC.
    Temperature,
}

impl Law {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Speed => "in proportion to the motor speed",
            Self::SpeedSquared => "with the square of the motor speed",
            Self::InverseFlow => "in proportion to one over the coolant flow",
            Self::Temperature => "in proportion to the temperature",
        }
    }
}

/// One cause that could explain the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// What kind it is.
    pub kind: &'static str,
    /// Where, in the machine file's names.
    pub place: String,
    /// Parts it touches.
    pub parts: Vec<String>,
    /// How it depends on the condition.
    pub law: Law,
    /// What it does to the network.
    pub act: Act,
    /// Prior standard deviation of its amplitude.
    pub scale: f64,
    /// Whether a negative amplitude means anything.
    pub is_signed: bool,
    /// Unit of the amplitude; `ln` for logarithms.
    pub unit: &'static str,
}

/// Where laws are one: largest motor speed and median coolant flow of the data, SI.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scales {
    /// rad/s
    pub speed: f64,
    /// m³/s
    pub flow: f64,
    speed_at: Option<usize>,
    flow_at: Option<usize>,
}

impl Scales {
    /// Of a data set.
    pub fn of(data: &Data, machine: &Machine) -> Self {
        let at = |name: &str| machine.variables.iter().position(|v| v.name == name);
        let (speed_at, flow_at) = (at("motor_speed"), at("coolant_flow"));
        let values = |v: Option<usize>| v.map_or(Vec::new(), |v| data.rows.iter().map(|r| r.condition.si()[v]).collect::<Vec<f64>>());
        let speed = values(speed_at).into_iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut flows = values(flow_at);
        flows.sort_by(f64::total_cmp);
        let flow = flows.get(flows.len() / 2).copied().unwrap_or(0.0);
        Self { speed, flow, speed_at, flow_at }
    }

    /// Factor of a law at a condition; `None` where the law needs a temperature.
    pub fn factor(&self, law: Law, condition: &Condition) -> f64 {
        let speed = self.speed_at.map_or(0.0, |v| condition.si()[v]) / if self.speed > 0.0 { self.speed } else { 1.0 };
        match law {
            Law::Constant | Law::Temperature => 1.0,
            Law::Speed => speed,
            Law::SpeedSquared => speed * speed,
            Law::InverseFlow => {
                let flow = self.flow_at.map_or(0.0, |v| condition.si()[v]);
                if flow > 0.0 { self.flow / flow } else { 0.0 }
            }
        }
    }

    /// The law as an expression of a machine file's formulas.
    pub(super) fn expression(&self, law: Law) -> String {
        // As a person would write it: nine digits.
        let rounded = |v: f64| format!("{v:.8e}").parse().unwrap_or(v);
        let rpm: f64 = rounded(self.speed * 60.0 / std::f64::consts::TAU);
        match law {
            Law::Constant | Law::Temperature => "1".into(),
            Law::Speed => format!("motor_speed_rpm / {rpm:?}"),
            Law::SpeedSquared => format!("(motor_speed_rpm / {rpm:?})^2"),
            Law::InverseFlow => format!("{:?} / coolant_flow_L_min", rounded(self.flow * 60_000.0)),
        }
    }
}

/// A heat source of the user's own: a kind that the program does not know.
#[derive(Debug, Clone, PartialEq)]
pub struct UserKind {
    /// Its name.
    pub name: String,
    /// Where the heat goes: parts, faces or nodes.
    pub places: Vec<String>,
    /// Heat per unit of amplitude, W: a formula of the machine file.
    pub expression: String,
    /// Prior standard deviation of the amplitude.
    pub scale: f64,
    /// Whether it may be negative.
    pub is_signed: bool,
}

/// Everything that could be wrong with this machine and could show in these data.
pub fn hypotheses(study: &Study, data: &Data, user: &[UserKind]) -> Vec<Hypothesis> {
    let (machine, network) = (&study.model.machine, &study.model.network);
    let varies = |name: &str| {
        let at = machine.variables.iter().position(|v| v.name == name);
        at.is_some_and(|v| data.rows.iter().any(|r| (r.condition.si()[v] / data.rows[0].condition.si()[v].max(1e-30) - 1.0).abs() > 0.02))
    };
    let (speed, flow) = (varies("motor_speed"), varies("coolant_flow"));
    let mut laws = vec![Law::Constant];
    if speed {
        laws.extend([Law::Speed, Law::SpeedSquared]);
    }
    let total: f64 = data
        .rows
        .iter()
        .filter_map(|row| Load::at(machine, &row.condition).ok())
        .map(|load| load.powers.iter().map(|p| p.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let heat = (0.05 * total).max(1.0);
    let mut found = Vec::new();
    let mut add = |kind, place: String, parts: Vec<String>, law, act, scale, is_signed, unit| {
        found.push(Hypothesis { kind, place, parts, law, act, scale, is_signed, unit });
    };
    let groups = groups(network);
    for (g, name) in &groups {
        for law in &laws {
            add("heat source", name.clone(), vec![name.clone()], *law, Act::Heat(*g), heat, true, "W");
        }
        add("leak to the surroundings", name.clone(), vec![name.clone()], Law::Constant, Act::Leak(*g), 0.1, false, "W/K");
        if data.is_transient() {
            let (own, usual) = store(machine, network, *g);
            // Half of what is there, or what a solid of this size stores where that is far more.
            let scale = (0.5 * own).max(usual - own);
            add("heat capacity", name.clone(), vec![name.clone()], Law::Constant, Act::Capacity(*g), scale, true, "J/K");
        }
    }
    for (s, source) in machine.sources.iter().enumerate() {
        let parts = part_names(machine, &source.places);
        for law in &laws {
            // Friction is a half to three times what is expected: 0.8 in the mean square.
            add("source factor", source.name.clone(), parts.clone(), *law, Act::Source(s), 0.8, true, "relative");
        }
        // Copper loses 4 % more per 10 K, grease up to a third less.
        add("source factor", source.name.clone(), parts, Law::Temperature, Act::Source(s), 0.15, true, "relative per 10 K");
    }
    for (c, contact) in machine.contacts.iter().enumerate() {
        let parts = part_names(machine, &contact.between);
        if network.contacts.iter().any(|g| g.name == contact.name) && contact_key(study, &contact.name).is_some() {
            add("contact conductance", contact.name.clone(), parts.clone(), Law::Constant, Act::Contact(c), 0.7, true, "ln");
            add("contact conductance", contact.name.clone(), parts, Law::Temperature, Act::Contact(c), 0.3, true, "ln per 10 K");
        }
    }
    for (c, channel) in machine.channels.iter().enumerate() {
        let parts = vec![machine.parts[channel.part].name.clone()];
        add("film coefficient", channel.name.clone(), parts.clone(), Law::Constant, Act::Film(c), 0.4, true, "ln");
        // Less flow in one of parallel channels is more in the others.
        if let Some(resistance) = data.rows.iter().find_map(|row| branch_resistance(machine, network, c, &row.condition)) {
            // Four times the resistance is half the flow.
            add("uneven split", channel.name.clone(), parts, Law::Constant, Act::Branch(c), 3.0 * resistance, false, "1");
        }
    }
    for (c, circuit) in machine.circuits.iter().enumerate() {
        let through: Vec<String> = circuit_parts(network, machine, c);
        add("coolant flow", circuit.name.clone(), through.clone(), Law::Constant, Act::Flow(c), 0.3, true, "ln");
        add("coolant inlet offset", circuit.name.clone(), through.clone(), Law::Constant, Act::Inlet(c), 0.3, true, "K");
        if flow {
            add("coolant line heat gain", circuit.name.clone(), through, Law::InverseFlow, Act::Inlet(c), 0.3, true, "K");
        }
    }
    let is_in_vacuum = network.surfaces.iter().any(|s| s.emissive > 0.0);
    if is_in_vacuum {
        add("chamber temperature", "chamber".into(), Vec::new(), Law::Constant, Act::Chamber, 0.7, true, "K");
        add("residual gas", "chamber".into(), Vec::new(), Law::Constant, Act::Gas, 1.0, false, "Pa");
    }
    for (b, boundary) in machine.boundaries.iter().enumerate() {
        if matches!(boundary.law, BoundaryLaw::Film(..)) && study.parameter(&film_key(&boundary.name)).is_ok() {
            let mut parts: Vec<String> = boundary.faces.iter().map(|f| machine.parts[f.part].name.clone()).collect();
            parts.dedup();
            add("boundary film", boundary.name.clone(), parts, Law::Constant, Act::Boundary(b), 0.4, true, "ln");
        }
    }
    // In a room, not in vacuum: where nothing radiates to a chamber, bare faces lose heat to the air.
    if !is_in_vacuum {
        for (p, part) in machine.parts.iter().enumerate() {
            let is_bare = machine.boundaries.iter().all(|b| b.faces.iter().all(|f| f.part != p));
            if is_bare && !outer_faces(machine, p).is_empty() {
                let parts = vec![part.name.clone()];
                add("loss to the surroundings", part.name.clone(), parts, Law::Constant, Act::Loss(p), ROOM_FILM, false, "W/(m2 K)");
            }
        }
    }
    let radiating: Vec<&(u32, String)> =
        groups.iter().filter(|(g, _)| network.surfaces.iter().any(|s| s.emissive > 0.0 && network.group[s.node as usize] == *g)).collect();
    for (g, name) in &radiating {
        if emissivity_key(study, name).is_some() {
            add("emissivity", name.clone(), vec![name.clone()], Law::Constant, Act::Emissivity(*g), 0.4, true, "ln");
        }
    }
    for (i, (a, first)) in groups.iter().enumerate() {
        for (b, second) in &groups[i + 1..] {
            if !touch(network, *a, *b) {
                let parts = vec![first.clone(), second.clone()];
                add("conductive link", format!("{first} - {second}"), parts, Law::Constant, Act::Link(*a, *b), 0.3, false, "W/K");
            }
        }
    }
    for (i, (a, first)) in radiating.iter().enumerate() {
        for (b, second) in &radiating[i + 1..] {
            if !touch(network, *a, *b) {
                let parts = vec![first.clone(), second.clone()];
                add("radiative link", format!("{first} - {second}"), parts, Law::Constant, Act::Radiate(*a, *b), 0.02, false, "m2");
            }
        }
    }
    for (k, name) in data.names.iter().enumerate() {
        add("sensor offset", name.clone(), Vec::new(), Law::Constant, Act::Bias(k), 0.5, true, "K");
        if data.rows.len() > 1 {
            add("sensor gain", name.clone(), Vec::new(), Law::Temperature, Act::Gain(k), 0.05, true, "relative");
        }
        if data.is_transient() {
            add("sensor lag", name.clone(), Vec::new(), Law::Constant, Act::Lag(k), 60.0, false, "s");
        }
        for (j, other) in data.names.iter().enumerate().skip(k + 1) {
            add("swapped sensors", format!("{name} - {other}"), Vec::new(), Law::Constant, Act::Swap(k, j), 1.0, true, "");
        }
    }
    for (u, kind) in user.iter().enumerate() {
        found.push(Hypothesis {
            kind: "user",
            place: kind.name.clone(),
            parts: kind.places.clone(),
            law: Law::Constant,
            act: Act::UserHeat(u),
            scale: kind.scale,
            is_signed: kind.is_signed,
            unit: "of its expression",
        });
    }
    found
}

/// Parts and lumped nodes that are free to move: index and name.
fn groups(network: &Network) -> Vec<(u32, String)> {
    let is_free =
        |g: usize| (0..network.solids).any(|n| network.group[n] == g as u32 && !network.fixed.iter().any(|(f, _)| *f as usize == n));
    network.groups.iter().enumerate().filter(|(g, _)| is_free(*g)).map(|(g, name)| (g as u32, name.clone())).collect()
}

/// What a group stores (J/K) and, for a part, what a solid of its volume usually does.
fn store(machine: &Machine, network: &Network, g: u32) -> (f64, f64) {
    let own = capacity(network, g);
    let part = machine.parts.iter().find(|p| p.name == network.groups[g as usize]);
    let material = part.map(|p| &machine.materials[p.material]);
    let usual = match material.map(|m| m.density * m.specific_heat.at(STANDARD)) {
        Some(per_volume) if per_volume > 0.0 => own / per_volume * USUAL_STORE,
        // A lumped node that stores nothing could store some of what the machine does.
        _ if own <= 0.0 => 0.02 * network.capacity.iter().sum::<f64>(),
        _ => own,
    };
    (own, usual)
}

/// Heat capacity of a group, J/K.
pub fn capacity(network: &Network, g: u32) -> f64 {
    (0..network.solids).filter(|n| network.group[*n] == g).map(|n| network.capacity[n]).sum()
}

/// The faces of a part's blocks that look outwards, as the machine file writes them; none for imported meshes.
pub(super) fn outer_faces(machine: &Machine, part: usize) -> Vec<String> {
    let part = &machine.parts[part];
    let of_block = |(i, block): (usize, &crate::describe::machine::Block)| -> Vec<String> {
        let sides: &[&str] = match &block.shape {
            Shape::Box { .. } => &["-x", "+x", "-y", "+y", "-z", "+z"],
            Shape::Cylinder { .. } => &["outer", "start", "end"],
            Shape::Sphere { .. } => &["outer"],
        };
        let number = if part.blocks.len() > 1 { format!("[{}]", i + 1) } else { String::new() };
        sides.iter().map(|side| format!("{}{number}.{side}", part.name)).collect()
    };
    part.blocks.iter().enumerate().flat_map(of_block).collect()
}

pub(super) fn film_key(boundary: &str) -> String {
    format!("boundary.{}.film", quoted(boundary))
}

fn touch(network: &Network, a: u32, b: u32) -> bool {
    let of = |n: u32| network.group[n as usize];
    network.joints.iter().any(|j| (of(j.a) == a && of(j.b) == b) || (of(j.a) == b && of(j.b) == a))
}

/// Loss coefficients of a channel that shares its flow with others, all together; none of others, or without flow.
fn branch_resistance(machine: &Machine, network: &Network, s: usize, condition: &Condition) -> Option<f64> {
    let stream = network.streams.get(s)?;
    let tree = network.circuits.get(stream.circuit)?;
    let shares_flow = members(&tree.layout).into_iter().any(|m| m != s && network.streams[m].upstream == stream.upstream);
    if !shares_flow {
        return None;
    }
    let load = Load::at(machine, condition).ok()?;
    let inlet = load.inlets[stream.circuit];
    let states = network.stream_states(&load, &vec![inlet; network.nodes]).ok()?;
    let liquid = tree.circuit.liquid.at(inlet).ok()?;
    let area = 0.25 * std::f64::consts::PI * stream.diameter * stream.diameter;
    let pressure = 0.5 * liquid.density * (states[s].flow / area).powi(2);
    (pressure > 0.0).then(|| states[s].pressure_drop / pressure)
}

fn circuit_parts(network: &Network, machine: &Machine, c: usize) -> Vec<String> {
    let streams = network.streams.iter().filter(|s| s.circuit == c);
    let part = |s: &crate::discretise::network::stream::Stream| {
        machine.channels.iter().find(|ch| ch.name == s.name).map(|ch| machine.parts[ch.part].name.clone())
    };
    let mut found: Vec<String> = streams.filter_map(part).collect();
    found.sort();
    found.dedup();
    found
}

fn part_names(machine: &Machine, places: &[Place]) -> Vec<String> {
    let name = |place: &Place| match place {
        Place::Part(p) => machine.parts[*p].name.clone(),
        Place::Face(face) => machine.parts[face.part].name.clone(),
        Place::Node(n) => machine.nodes[*n].name.clone(),
    };
    places.iter().map(name).collect()
}

/// Key of a contact's number.
pub fn contact_key(study: &Study, name: &str) -> Option<String> {
    ["conductance", "total_conductance"]
        .iter()
        .map(|law| format!("contact.{}.{law}", quoted(name)))
        .find(|key| matches!(study.document().leaf(key), Ok(Some(Leaf::Text(_)))))
}

pub(super) fn emissivity_key(study: &Study, part: &str) -> Option<String> {
    let keys = ["effective_emissivity", "emissivity"];
    let own = keys.iter().map(|k| format!("part.{}.surface.{k}", quoted(part)));
    let node = keys.iter().map(|k| format!("node.{}.{k}", quoted(part)));
    own.chain(node).find(|key| study.parameter(key).is_ok())
}
