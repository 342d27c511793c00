//! Where heat enters parts and lumped nodes: read from the network that the machine file's own sources and contacts give,
//! so that a derivative acts on the same nodes as the lines of the file.

use std::collections::HashMap;
use std::sync::OnceLock;

use super::file::{conductor, text};
use coldplate_base::document::quoted;
use coldplate_network::{FaceNode, Joint};
use coldplate_physics::radiation::SIGMA;
use coldplate_solve::study::Study;

/// Nodes with their shares, which sum to one.
pub type Shares = Vec<(u32, f64)>;

/// Name of what is added to find the nodes.
const PROBE: &str = "probe of the diagnosis";

/// Where heat enters each group of a network.
pub struct Ground<'a> {
    study: &'a Study,
    found: OnceLock<Vec<Entry>>,
}

/// Where heat enters a group; empty where nothing can be attached.
#[derive(Debug, Clone, Default)]
struct Entry {
    /// Nodes that a source in it heats.
    heated: Shares,
    /// Nodes that a contact of it joins: its open faces.
    joined: Shares,
}

impl<'a> Ground<'a> {
    /// Of a machine; nothing is done before something is asked for.
    pub fn new(study: &'a Study) -> Self {
        Self { study, found: OnceLock::new() }
    }

    /// Nodes of a group that a source of the file in it heats.
    pub fn heated(&self, group: u32) -> &[(u32, f64)] {
        &self.entry(group).heated
    }

    /// Nodes of a group that a contact of the file joins to something that it does not touch.
    pub fn joined(&self, group: u32) -> &[(u32, f64)] {
        &self.entry(group).joined
    }

    fn entry(&self, group: u32) -> &Entry {
        &self.found.get_or_init(|| entries(self.study))[group as usize]
    }

    /// The fields that paths between groups are made of at given temperatures: see [`PathFields`].
    pub(crate) fn path_fields(&self, temperatures: &[f64], free: impl Fn(u32) -> bool) -> PathFields {
        let groups = self.study.model.network.groups.len() as u32;
        let of = |g: u32| -> [Shares; POWERS] {
            let shares = self.joined(g);
            std::array::from_fn(|k| shares.iter().map(|(n, w)| (*n, w * temperatures[*n as usize].powi(k as i32))).collect())
        };
        let all: Vec<[Shares; POWERS]> = (0..groups).map(of).collect();
        let sums = all.iter().map(|powers| powers.each_ref().map(|field| field.iter().map(|(_, v)| v).sum())).collect();
        let fields = all.into_iter().flatten().map(|field| field.into_iter().filter(|(n, _)| free(*n)).collect()).collect();
        PathFields { lumped: (0..groups).map(|g| self.is_lumped(g)).collect(), sums, fields }
    }

    fn is_lumped(&self, group: u32) -> bool {
        group as usize >= self.study.model.machine.parts.len()
    }
}

/// Powers of the temperature that the heat of a path is made of, from none to the fourth.
const POWERS: usize = 5;

/// How a path between two groups conducts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PathLaw {
    /// A conductance: per W/K.
    Conductance,
    /// Black surfaces that see each other: per m² of exchange area.
    Radiation,
}

impl PathLaw {
    /// Coefficients of the powers of a node's temperature T in the heat that goes from it to a temperature t (K), W per unit of the
    /// path: T - t, or half of sigma (T + t)³ (T - t), as a conductance 4 sigma ((T + t)/2)³ makes it.
    fn heat(self, t: f64) -> [f64; POWERS] {
        match self {
            Self::Conductance => [-t, 1.0, 0.0, 0.0, 0.0],
            Self::Radiation => [-t.powi(4), -2.0 * t.powi(3), 0.0, 2.0 * t, 1.0].map(|c| 0.5 * SIGMA * c),
        }
    }

    /// The same of what it conducts between T and t, W/K per unit, but for a factor.
    fn conductance(self, t: f64) -> [f64; POWERS] {
        match self {
            Self::Conductance => [1.0, 0.0, 0.0, 0.0, 0.0],
            Self::Radiation => [t.powi(3), 3.0 * t * t, 3.0 * t, 1.0, 0.0],
        }
    }
}

/// What all paths between groups that do not touch are made of: of each group, and of each power of the temperature, the share of every
/// node of its open faces times that power. A path takes from each node heat that is a polynomial of the node's temperature, so that it is
/// a few of these fields, each with a coefficient, however many nodes it goes to.
#[derive(Debug, Clone)]
pub(crate) struct PathFields {
    lumped: Vec<bool>,
    /// Sums over the nodes of each group, K to the power.
    sums: Vec<[f64; POWERS]>,
    /// Nodes that are free to change, with their entries, group after group.
    fields: Vec<Shares>,
}

impl PathFields {
    /// All of them.
    pub(crate) fn into_fields(self) -> Vec<Shares> {
        self.fields
    }

    /// Heat (W) that a path between two groups takes from the nodes, per unit: fields by number, with their coefficients. Between two parts
    /// it goes through one node that stores nothing, as in the network of such a contact.
    pub fn path(&self, [a, b]: [u32; 2], law: PathLaw) -> Vec<(usize, f64)> {
        let sums = |g: u32| &self.sums[g as usize];
        if sums(a)[0] == 0.0 || sums(b)[0] == 0.0 {
            return Vec::new();
        }
        let of = |g: u32, heat: [f64; POWERS]| heat.into_iter().enumerate().map(move |(k, c)| (g as usize * POWERS + k, c));
        let sum = |g: u32, polynomial: &[f64; POWERS]| -> f64 { polynomial.iter().zip(sums(g)).map(|(c, s)| c * s).sum() };
        let is_lumped = |g: u32| self.lumped[g as usize];
        let lumped = [(a, b), (b, a)].into_iter().find(|(g, _)| is_lumped(*g));
        let terms: Vec<(usize, f64)> = if let Some((node, others)) = lumped {
            let heat = law.heat(sums(node)[1]);
            of(others, heat).chain([(node as usize * POWERS, -sum(others, &heat))]).collect()
        } else {
            let mut middle = 0.5 * (sums(a)[1] + sums(b)[1]);
            // The law hardly changes over the parts' own differences: each turn gains several digits.
            for _ in 0..4 {
                let weights = law.conductance(middle);
                let mut times_temperature = [0.0; POWERS];
                times_temperature[1..].copy_from_slice(&weights[..POWERS - 1]);
                middle = (sum(a, &times_temperature) + sum(b, &times_temperature)) / (sum(a, &weights) + sum(b, &weights));
            }
            let heat = law.heat(middle).map(|c| 2.0 * c);
            of(a, heat).chain(of(b, heat)).collect()
        };
        terms.into_iter().filter(|(_, c)| *c != 0.0).collect()
    }
}

fn entries(study: &Study) -> Vec<Entry> {
    let (network, parts) = (&study.model.network, study.model.machine.parts.len());
    // All at once; one by one where some part has no open face.
    let mut found = probed(study, 0..parts)
        .unwrap_or_else(|| (0..parts).map(|p| probed(study, p..p + 1).and_then(|mut one| one.pop()).unwrap_or_default()).collect());
    let lumped = |g: usize| {
        let node = (0..network.solids as u32).find(|n| network.group[*n as usize] == g as u32);
        let alone: Shares = node.map(|n| (n, 1.0)).into_iter().collect();
        Entry { heated: alone.clone(), joined: alone }
    };
    found.extend((parts..network.groups.len()).map(lumped));
    found
}

/// Where heat enters some parts: a source in each, and a contact from each to one held node.
fn probed(study: &Study, parts: std::ops::Range<usize>) -> Option<Vec<Entry>> {
    let own = &study.model.machine.parts;
    let name = |p: usize| format!("{PROBE}: {}", own[p].name);
    let mut lines = vec![(format!("node.{}", quoted(PROBE)), "{ temperature = \"20 degC\" }".to_string())];
    for p in parts.clone() {
        lines.push((format!("contact.{}", quoted(&name(p))), conductor([&own[p].name, PROBE], 1.0, None)));
        lines.push((format!("source.{}", quoted(&name(p))), format!("{{ in = {}, power = \"0 W\" }}", text(&own[p].name))));
    }
    let probe = study.edited(&lines).ok()?;
    let (machine, network) = (&probe.model.machine, &probe.model.network);
    // The probe is the last of the lumped nodes. With it, what comes after those has other numbers than in the study's network:
    // the nodes of faces, which are found again by their cell.
    let (cells, held) = (probe.model.mesh.cells as u32, (probe.model.mesh.cells + machine.nodes.len()) as u32 - 1);
    let face = |face: &FaceNode| (face.node, (face.cell, face.side));
    let theirs: HashMap<u32, (u32, u8)> = network.faces.iter().map(face).collect();
    let ours: HashMap<(u32, u8), u32> = study.model.network.faces.iter().map(|f| ((f.cell, f.side), f.node)).collect();
    let own_node = |joint: &Joint| {
        let node = if joint.a == held { joint.b } else { joint.a };
        if node < cells { node } else { theirs.get(&node).and_then(|at| ours.get(at)).copied().unwrap_or(node) }
    };
    let entry = |p: usize| -> Option<Entry> {
        let source = machine.sources.iter().position(|s| s.name == name(p))?;
        let contact = network.contacts.iter().find(|c| c.name == name(p))?;
        let joints = &network.joints[contact.joints.clone()];
        let whole: f64 = joints.iter().map(|j| j.area).sum();
        let joined = joints.iter().map(|j| (own_node(j), j.area / whole)).collect();
        Some(Entry { heated: network.sources[source].shares.clone(), joined })
    };
    parts.map(entry).collect()
}
