//! A network in three parts: the linear one that is the same at every condition, contacts that have a factor, and the
//! rest.
//!
//! In an enclosure every face exchanges heat with every other one, so the number of conductors is the square of the number of faces. A node
//! emits the same heat towards all of them. The rest therefore has one conductor for each emitting node, to no other node, and the emitted
//! heat reaches the others by their areas ([`NetworkParts::reached`]).

use std::collections::BTreeMap;

use coldplate_network::{HeatSource, Joint, Load, NONE, Network};
use coldplate_solve::residual;

/// The parts of a network, all with its nodes.
#[derive(Debug)]
pub(crate) struct NetworkParts {
    /// Linear conduction that is the same at every condition.
    pub plain: Network,
    /// Sources, in the network's order; the shares are empty if the power follows the temperature.
    pub sources: Vec<HeatSource>,
    /// Joints of constant laws by contact of the network; their conductances follow the contact's factor.
    pub contacts: Vec<(usize, Vec<Joint>)>,
    /// The parts that follow the temperature or the surroundings: open faces, radiative conductors, joints and faces of
    /// blocks with a varying conductance, sources with a varying power. Streams and sensors are here too. After its
    /// radiative links come the emitting nodes of enclosures, each to no node and with an area of one.
    pub rest: Network,
    /// Nodes that each emitting node reaches, with the area of the exchange, m².
    pub reached: Vec<Vec<(u32, f64)>>,
}

impl NetworkParts {
    /// Takes a network apart.
    pub fn of(network: &Network) -> Self {
        let is_constant = |property: u32| property == NONE || network.properties[property as usize].is_constant();
        let (mut plain, mut rest) = (network.clone(), network.clone());
        let mut contacts: Vec<(usize, Vec<Joint>)> = Vec::new();
        (plain.joints, rest.joints) = (Vec::new(), Vec::new());
        let is_held = |node: u32| network.fixed.iter().any(|(held, _)| *held == node);
        for joint in &network.joints {
            let is_steady = is_constant(joint.property_a) && is_constant(joint.property_b);
            let group = network.contacts.get(joint.contact as usize);
            match group {
                _ if !is_steady => rest.joints.push(*joint),
                None => plain.joints.push(*joint),
                Some(group) if group.law.follows_temperature() => rest.joints.push(*joint),
                Some(group) if group.of.is_none() => plain.joints.push(*joint),
                Some(_) if is_held(joint.a) || is_held(joint.b) => rest.joints.push(*joint),
                Some(_) => match contacts.iter_mut().find(|(c, _)| *c == joint.contact as usize) {
                    Some((_, joints)) => joints.push(*joint),
                    None => contacts.push((joint.contact as usize, vec![*joint])),
                },
            }
        }
        let (constant, varying): (Vec<_>, Vec<_>) = network.blocks.iter().cloned().partition(|b| b.is_constant(&network.properties));
        for block in &varying {
            for segment in block.segments(block.nodes()) {
                segment.each_face(block.cells[0], |at, d, other, is_next, owner| {
                    let gap = block.faces[d][owner];
                    if is_next && gap.area > 0.0 {
                        rest.joints.push(Joint {
                            a: (segment.node + at) as u32,
                            b: other as u32,
                            area: gap.area,
                            length_a: gap.length_a,
                            length_b: gap.length_b,
                            property_a: block.property[d],
                            property_b: block.property[d],
                            contact: NONE,
                            reach: [NONE; 2],
                        });
                    }
                });
            }
        }
        (plain.blocks, rest.blocks) = (constant, Vec::new());
        (plain.surfaces, plain.radiative, plain.streams, plain.circuits) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut sources = std::mem::take(&mut plain.sources);
        for (own, other) in sources.iter_mut().zip(&mut rest.sources) {
            let empty = |source: &HeatSource| HeatSource { shares: Vec::new(), law: source.law.clone() };
            if own.law.follows_temperature() { *own = empty(own) } else { *other = empty(other) }
        }
        let is_enclosed = |k: &usize| network.enclosures.iter().any(|views| views.conductors.contains(k));
        let (enclosed, links): (Vec<usize>, Vec<usize>) = (0..network.radiative.len()).partition(is_enclosed);
        let mut reached: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
        for (a, b, area) in enclosed.iter().map(|k| network.radiative[*k]) {
            reached.entry(a).or_default().push((b, area));
            reached.entry(b).or_default().push((a, area));
        }
        let links = links.iter().map(|k| network.radiative[*k]);
        rest.radiative = links.chain(reached.keys().map(|node| (*node, NONE, 1.0))).collect();
        (plain.sensors, plain.sensor_names, plain.meters) = (Vec::new(), Vec::new(), Vec::new());
        plain.measurands = Vec::new();
        Self { plain, sources, contacts, rest, reached: reached.into_values().collect() }
    }

    /// Number of conductors that follow the temperature or the surroundings.
    pub fn conductors(&self) -> usize {
        let shares: usize = self.rest.sources.iter().map(|s| s.shares.len()).sum();
        self.rest.surfaces.len() + self.rest.joints.len() + self.rest.radiative.len() + shares
    }

    /// Heat (W) that leaves every node by linear conduction, at temperatures or differences of them (K).
    pub fn conduction(&self, temperatures: &[f64], load: &Load) -> Vec<f64> {
        residual(&self.plain, load, &[], temperatures)
    }
}
