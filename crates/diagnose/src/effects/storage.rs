//! Heat capacities: what parts and lumped nodes store, which only logs show.

use super::file::text;
use super::words::Quantity;
use super::{Family, Group, Hypothesis, Law, Linearised, Lines, MachineEdit, Site, Told};
use coldplate_describe::machine::Property;
use coldplate_network::Network;
use coldplate_base::error::Result;
use crate::Discrepancy;
use coldplate_base::document::quoted;
use coldplate_solve::sensitivity::Disturbance;
use coldplate_base::units::ZERO_CELSIUS;

/// Temperature a network's capacities are stated at, K.
const STANDARD: f64 = 300.0;
/// What solids store, J/(m³ K): steel 3.9e6, copper 3.4e6, aluminium 2.4e6, plastics 1.5e6 to 2.5e6. A part that stores much
/// less in the model is not made of anything.
const USUAL_STORE: f64 = 3.5e6;
/// A part's heat capacity can fall to this share of the model's.
const LEAST_STORE: f64 = 0.05;

/// Heat capacity of a group, J/K more than the model has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Storage(pub u32);

impl Storage {
    /// Heat capacity of the group in the model, J/K.
    pub(super) fn own(self, network: &Network) -> f64 {
        self.nodes(network).map(|n| network.capacity[n]).sum()
    }

    fn nodes(self, network: &Network) -> impl Iterator<Item = usize> {
        (0..network.solids).filter(move |n| network.group[*n] == self.0)
    }

    /// What a solid of the group's volume usually stores, J/K.
    fn usual(self, site: &Site<'_>, group: &Group) -> f64 {
        let own = self.own(site.network);
        let part = site.machine.parts.iter().find(|p| p.name == group.name);
        let material = part.map(|p| &site.machine.materials[p.material]);
        match material.map(|m| m.density * m.specific_heat.at(STANDARD)) {
            Some(per_volume) if per_volume > 0.0 => own / per_volume * USUAL_STORE,
            // A lumped node that stores nothing could store some of what the machine does.
            _ if own <= 0.0 => 0.02 * site.network.capacity.iter().sum::<f64>(),
            _ => own,
        }
    }

    fn of_node(own: f64, factor: f64, name: &str, edit: &MachineEdit<'_>) -> Result<Lines> {
        let key = format!("node.{}.capacity", quoted(name));
        if own > 0.0 {
            return edit.scaled(&key, factor);
        }
        Ok(Some(vec![(key, text(format!("{:?} J/K", edit.amplitude.max(0.0))))]))
    }
}

impl Family for Storage {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let one = |g: &Group| {
            let (own, usual) = (Self(g.index).own(site.network), Self(g.index).usual(site, g));
            // A share of what is there, or what a solid of this size stores where that is far more.
            let scale = (site.machine.priors.capacity * own).max(usual - own);
            Hypothesis::signed(Self(g.index), &g.name, vec![g.name.clone()], scale, "J/K")
        };
        if site.data.is_transient() { site.groups.iter().map(one).collect() } else { Vec::new() }
    }

    fn kind(&self) -> &'static str {
        "heat capacity"
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        let (machine, name) = (edit.machine(), edit.group(self.0));
        let own = self.own(edit.network());
        let factor = if own > 0.0 { (1.0 + edit.amplitude / own).max(LEAST_STORE) } else { 1.0 };
        let Some(part) = machine.parts.iter().find(|p| p.name == name) else { return Self::of_node(own, factor, name, edit) };
        let material = &machine.materials[part.material];
        let key = format!("material.{}.specific_heat", quoted(&material.name));
        let is_own = machine.parts.iter().filter(|p| p.material == part.material).count() == 1;
        if is_own && edit.study.known_parameter(&key).is_some() {
            return edit.scaled(&key, factor);
        }
        // Others are made of it too: the part gets a material of its own.
        let value = match &material.specific_heat {
            Property::Constant(c) => text(format!("{:?} J/(kg K)", c * factor)),
            Property::Table(rows) => {
                let row = |(t, c): &(f64, f64)| format!("[\"{:?} degC\", \"{:?} J/(kg K)\"]", t - ZERO_CELSIUS, c * factor);
                format!("[{}]", rows.iter().map(row).collect::<Vec<_>>().join(", "))
            }
        };
        let new = edit.added_name(name);
        let made = format!("{{ base = {}, specific_heat = {value} }}", text(&material.name));
        Ok(Some(vec![(format!("material.{}", quoted(&new)), made), (format!("part.{}.material", quoted(name)), text(new))]))
    }

    /// A part that stores more takes heat up as it warms; what stores nothing has no rate of its own.
    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        let (network, temperatures) = (at.network(), at.temperatures());
        let residual = at.residual()?;
        let whole = self.own(network);
        let row = |n: usize| -> Option<(u32, f64)> {
            let own = network.capacity_at(n, temperatures[n]);
            (own > 0.0).then(|| (n as u32, -network.capacity[n] / whole * residual[n] / own))
        };
        // Faces within a part store nothing, and no share of what is added.
        let storing = self.nodes(network).filter(|n| whole <= 0.0 || network.capacity[*n] > 0.0);
        Some(at.screen.disturbance(storing.map(row).collect::<Option<Vec<_>>>()?))
    }

    fn quantity(&self, _law: Law) -> Quantity {
        Quantity::plain("heat_capacity", "J/K")
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        let more = if told.amplitude >= 0.0 { "more" } else { "less" };
        format!("{} stores {more} heat than the model has: {}", told.place(), told.range(" J/K"))
    }

    fn discrepancy(&self, network: &Network, all: &Discrepancy) -> Option<f64> {
        Some(all.capacities * self.own(network))
    }

    fn is_bent(&self) -> bool {
        true
    }
}
