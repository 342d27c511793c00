//! Where heat enters parts and lumped nodes: read from the network that the machine file's own sources and contacts give,
//! so that a derivative acts on the same nodes as the lines of the file.

use std::collections::HashMap;
use std::sync::OnceLock;

use super::file::{conductor, text};
use crate::discretise::network::{FaceNode, Joint};
use crate::foundation::document::quoted;
use crate::solve::sensitivity::Study;

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

    /// Heat (W) that a conductance between two groups takes from each node, per W/K; at a mean temperature the conductance is
    /// `law` times as large. Between two parts it goes through one node that stores nothing, as in the network of such a contact.
    pub fn conductor(&self, [a, b]: [u32; 2], temperatures: &[f64], law: impl Fn(f64) -> f64) -> Shares {
        let t = |node: u32| temperatures[node as usize];
        let heat = |from: f64, to: f64| law(0.5 * (from + to)) * (from - to);
        let (first, second) = (self.joined(a), self.joined(b));
        if first.is_empty() || second.is_empty() {
            return Vec::new();
        }
        let lumped = [(a, first, second), (b, second, first)].into_iter().find(|(g, ..)| self.is_lumped(*g));
        if let Some((_, node, others)) = lumped {
            let node = node[0].0;
            let each: Shares = others.iter().map(|(n, w)| (*n, w * heat(t(*n), t(node)))).collect();
            let whole: f64 = each.iter().map(|(_, heat)| heat).sum();
            return each.into_iter().chain([(node, -whole)]).collect();
        }
        let all = || first.iter().chain(second);
        let mut middle = 0.5 * all().map(|(n, w)| w * t(*n)).sum::<f64>();
        // The law hardly changes over the parts' own differences: each turn gains several digits.
        for _ in 0..4 {
            let weight = |(n, w): &(u32, f64)| w * law(0.5 * (t(*n) + middle));
            middle = all().map(|s| weight(s) * t(s.0)).sum::<f64>() / all().map(weight).sum::<f64>();
        }
        all().map(|(n, w)| (*n, 2.0 * w * heat(t(*n), middle))).collect()
    }

    fn is_lumped(&self, group: u32) -> bool {
        group as usize >= self.study.model.machine.parts.len()
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
