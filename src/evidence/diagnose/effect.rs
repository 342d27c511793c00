//! What each act of the catalogue changes in the residual of the network, at a state of the machine.

use std::collections::HashMap;

use rayon::prelude::*;

use super::catalogue::{Act, DRIFT, Hypothesis, Law, REFERENCE, Scales, UserKind};
use crate::describe::machine::Machine;
use crate::discretise::network::{Load, Network};
use crate::foundation::document::quoted;
use crate::physics::{gas, radiation::SIGMA};
use crate::solve::sensitivity::{Derivatives, Effect, Screen, Study, Variation};

/// Pressure over which the film of residual gas is followed, Pa: it saturates where molecules meet before they cross to the wall.
const GAS: f64 = 1.0;

/// What acts need that does not depend on the state, made ready once.
pub struct Acting<'a> {
    study: &'a Study,
    /// Shares of every group's nodes in what is spread over it.
    shares: Vec<Vec<(u32, f64)>>,
    prepared: HashMap<Act, Prepared>,
}

enum Prepared {
    /// Differences along a number of the machine file.
    Along(Box<Variation>),
    /// Heat of the user's own kind: where it goes, and the machine and its source that say how much.
    Heat(Vec<(u32, f64)>, Box<Machine>, usize),
    /// Nodes behind bare faces, with their areas, m².
    Open(Vec<(u32, f64)>),
}

impl<'a> Acting<'a> {
    /// For the acts of some hypotheses.
    pub fn new(study: &'a Study, hypotheses: &[Hypothesis], user: &[UserKind]) -> Self {
        let network = &study.model.network;
        let mut acts: Vec<Act> = hypotheses.iter().map(|h| h.act).collect();
        acts.sort_by_key(|a| format!("{a:?}"));
        acts.dedup();
        let prepared = acts.par_iter().filter_map(|act| Some((*act, prepare(study, *act, user)?))).collect();
        Self { study, shares: (0..network.groups.len() as u32).map(|g| shares(network, g)).collect(), prepared }
    }

    /// What an act does to the residual at a state, per unit of its amplitude; a drift per 10 K away from 20 degC. `None` for what
    /// acts on sensors, or where the machine file has no words for it.
    pub fn effect(&self, at: &Derivatives<'_>, screen: &Screen<'_>, act: Act, drifts: bool) -> Option<Effect> {
        let (network, machine) = (&self.study.model.network, &self.study.model.machine);
        let shares = |g: u32| &self.shares[g as usize];
        let temperatures = &at.state.solution.temperatures;
        let load = &at.state.load;
        let scaled = |mut e: Effect, by: f64| {
            e.rows.iter_mut().for_each(|(_, r)| *r *= by);
            e
        };
        let along = || -> Option<Effect> {
            let Some(Prepared::Along(variation)) = self.prepared.get(&act) else { return None };
            let partial = at.partial_of(variation).ok()?;
            let rows = partial.residual.iter().enumerate().filter(|(_, r)| **r != 0.0).map(|(n, r)| (n as u32, *r));
            Some(Effect { rows: rows.collect(), inlets: Vec::new() })
        };
        let stream = |channel: usize| network.streams.iter().position(|s| s.name == machine.channels[channel].name);
        Some(match act {
            Act::Heat(g) => screen.source(shares(g)),
            Act::Source(s) if drifts => scaled(screen.temperature_coefficient(s), 1.0 / DRIFT),
            Act::Source(s) => screen.power(s),
            Act::UserHeat(_) => {
                let Some(Prepared::Heat(shares, machine, source)) = self.prepared.get(&act) else { return None };
                scaled(screen.source(shares), Load::at(machine, &at.condition).ok()?.powers[*source])
            }
            Act::Contact(i) => {
                let contact = &machine.contacts[i].name;
                let whole = screen.contact(contact);
                if !drifts {
                    return Some(whole);
                }
                let joints = network.contacts.iter().filter(|g| g.name == *contact).flat_map(|g| g.joints.clone());
                let (mut sum, mut area) = (0.0, 0.0);
                for joint in joints.map(|j| &network.joints[j]) {
                    let (a, b) = network.joint_ends(joint, temperatures);
                    sum += joint.area * 0.5 * (a + b);
                    area += joint.area;
                }
                scaled(whole, if area > 0.0 { (sum / area - REFERENCE) / DRIFT } else { 0.0 })
            }
            Act::Film(channel) => screen.stream_film(stream(channel)?),
            Act::Branch(_) | Act::Chamber => along()?,
            Act::Flow(circuit) => screen.flow(circuit).ok()?,
            Act::Inlet(circuit) => screen.inlet(circuit).ok()?,
            Act::Emissivity(g) => screen.emissivity(screen.surfaces_of(g)),
            Act::Boundary(b) => screen.boundary(b as u32),
            Act::Loss(_) => {
                let Some(Prepared::Open(faces)) = self.prepared.get(&act) else { return None };
                let rows = faces.iter().map(|(node, area)| (*node, area * (temperatures[*node as usize] - load.chamber)));
                Effect { rows: rows.collect(), inlets: Vec::new() }
            }
            Act::Gas => {
                let wetted =
                    (0..network.surfaces.len()).filter(|s| network.surfaces[*s].gas_area > 0.0 || network.surfaces[*s].emissive > 0.0);
                let film = |pressure: f64| gas::film(pressure, load.chamber, machine.chamber.accommodation, machine.chamber.gap);
                let own = machine.chamber.pressure;
                scaled(screen.film(wetted, load.chamber), (film(own + GAS) - film(own)) / GAS)
            }
            Act::Leak(g) => {
                let rows = shares(g).iter().map(|(n, w)| (*n, w * (temperatures[*n as usize] - load.chamber)));
                Effect { rows: rows.collect(), inlets: Vec::new() }
            }
            Act::Link(a, b) | Act::Radiate(a, b) => {
                let (first, second) = (shares(a), shares(b));
                let (ta, tb) = (mean(first, temperatures), mean(second, temperatures));
                let heat = if matches!(act, Act::Link(..)) { ta - tb } else { SIGMA * (ta.powi(4) - tb.powi(4)) };
                let rows = first.iter().map(|(n, w)| (*n, w * heat)).chain(second.iter().map(|(n, w)| (*n, -w * heat)));
                Effect { rows: rows.collect(), inlets: Vec::new() }
            }
            // A part that stores more takes heat up as it warms; what stores nothing has no rate of its own.
            Act::Capacity(g) => {
                let residual = at.tangent.residual(network, load, temperatures).ok()?;
                let row = |(n, w): &(u32, f64)| -> Option<(u32, f64)> {
                    let own = network.capacity_at(*n as usize, temperatures[*n as usize]);
                    (own > 0.0).then(|| (*n, -w * residual[*n as usize] / own))
                };
                Effect { rows: shares(g).iter().map(row).collect::<Option<_>>()?, inlets: Vec::new() }
            }
            Act::Bias(_) | Act::Gain(_) | Act::Lag(_) | Act::Swap(..) => return None,
        })
    }
}

fn prepare(study: &Study, act: Act, user: &[UserKind]) -> Option<Prepared> {
    let along = |key: &str| Some(Prepared::Along(Box::new(study.variation(&study.parameter(key).ok()?).ok()?)));
    match act {
        Act::Branch(channel) => along(&format!("channel.{}.minor_loss", quoted(&study.model.machine.channels[channel].name))),
        Act::Chamber => along("chamber.temperature"),
        Act::UserHeat(u) => {
            // Where the file's own source would put it.
            let value = format!("{{ in = {:?}, power = {:?} }}", user[u].places, user[u].expression);
            let edited = study.edited(&[("source.\"user kind\"".to_string(), value)]).ok()?;
            let source = edited.model.machine.sources.iter().position(|s| s.name == "user kind")?;
            let shares = edited.model.network.sources.get(source)?.shares.clone();
            Some(Prepared::Heat(shares, Box::new(edited.model.machine), source))
        }
        Act::Loss(_) => {
            // The file's own words say which faces are open.
            let h = Hypothesis {
                kind: "",
                place: String::new(),
                parts: Vec::new(),
                law: Law::Constant,
                act,
                scale: 1.0,
                is_signed: false,
                unit: "",
            };
            let sets = h.sets(study, &Scales::default(), &[], 1.0).ok()??;
            let edited = study.edited(&sets).ok()?;
            let law = (edited.model.machine.boundaries.len() - 1) as u32;
            let open = edited.model.network.surfaces.iter().filter(|s| s.law == law);
            Some(Prepared::Open(open.map(|s| (s.node, s.area)).collect()))
        }
        _ => None,
    }
}

/// Shares of a group's nodes in what is spread over it: by heat capacity, or evenly where there is none.
pub fn shares(network: &Network, group: u32) -> Vec<(u32, f64)> {
    let nodes: Vec<u32> = (0..network.solids as u32).filter(|n| network.group[*n as usize] == group).collect();
    let total: f64 = nodes.iter().map(|n| network.capacity[*n as usize]).sum();
    let share = |n: &u32| if total > 0.0 { network.capacity[*n as usize] / total } else { 1.0 / nodes.len() as f64 };
    nodes.iter().map(|n| (*n, share(n))).collect()
}

fn mean(shares: &[(u32, f64)], temperatures: &[f64]) -> f64 {
    shares.iter().map(|(n, w)| w * temperatures[*n as usize]).sum()
}
