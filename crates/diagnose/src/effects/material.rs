//! Materials: their conductivity, in all parts that are made of one.

use super::file::text;
use super::words::Quantity;
use super::{Family, Hypothesis, Law, Linearised, Lines, MachineEdit, Prepared, Site, Told, UserKind};
use coldplate_describe::machine::{Machine, Property};
use coldplate_network::Network;
use coldplate_base::error::Result;
use coldplate_base::document::quoted;
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;
use coldplate_base::units::ZERO_CELSIUS;

/// Step of the difference of networks, logarithm.
const STEP: f64 = 1e-3;

/// Conductivity of a material, logarithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Material(pub usize);

impl Material {
    fn name(self, machine: &Machine) -> &str {
        &machine.materials[self.0].name
    }

    fn parts(self, machine: &Machine) -> impl Iterator<Item = &str> {
        machine.parts.iter().filter(move |p| p.material == self.0).map(|p| p.name.as_str())
    }

    fn key(name: &str) -> String {
        format!("material.{}.conductivity", quoted(name))
    }

    /// The conductivity, the same along all axes; `None` where it is not.
    fn even(self, machine: &Machine) -> Option<&Property> {
        let [x, y, z] = &machine.materials[self.0].conductivity;
        (x == y && y == z).then_some(x)
    }

    /// Lines that make it so many times what it is: a number of the file is changed, what a library or a table states is replaced
    /// by a material of its own.
    fn scaled(self, study: &Study, factor: f64) -> Result<Lines> {
        let machine = &study.model.machine;
        let name = self.name(machine);
        if let Some(parameter) = study.known_parameter(&Self::key(name)) {
            return Ok(parameter.to_set(parameter.value * factor, machine)?.map(|set| vec![set]));
        }
        let value = match self.even(machine) {
            Some(Property::Constant(k)) => text(format!("{:?} W/(m K)", k * factor)),
            Some(Property::Table(rows)) => {
                let row = |(t, k): &(f64, f64)| format!("[\"{:?} degC\", \"{:?} W/(m K)\"]", t - ZERO_CELSIUS, k * factor);
                format!("[{}]", rows.iter().map(row).collect::<Vec<_>>().join(", "))
            }
            None => return Ok(None),
        };
        let new = format!("{name} as diagnosed");
        let mut lines = vec![(format!("material.{}", quoted(&new)), format!("{{ base = {}, conductivity = {value} }}", text(name)))];
        lines.extend(self.parts(machine).map(|part| (format!("part.{}.material", quoted(part)), text(new.clone()))));
        Ok(Some(lines))
    }
}

impl Family for Material {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let machine = site.machine;
        let used = (0..machine.materials.len()).map(Self).filter(|m| m.parts(machine).next().is_some() && m.even(machine).is_some());
        let one = |m: Self| {
            let parts = m.parts(machine).map(String::from).collect();
            Hypothesis::signed(m, m.name(machine), parts, machine.priors.conductivity, "ln")
        };
        used.map(one).collect()
    }

    fn kind(&self) -> &'static str {
        "thermal conductivity"
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        self.scaled(edit.study, edit.amplitude.exp())
    }

    /// Contacts, surfaces and joints all change with it: the network is built to both sides.
    fn prepared(&self, study: &Study, _user: &[UserKind]) -> Option<Prepared> {
        let built = |amplitude: f64| -> Option<Network> {
            let lines = self.scaled(study, amplitude.exp()).ok()??;
            Some(study.edited(&lines).ok()?.model.network).filter(|network| network.nodes == study.model.network.nodes)
        };
        Some(Prepared::Networks { less: Box::new(built(-STEP)?), more: Box::new(built(STEP)?), apart: 2.0 * STEP })
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        let Some(Prepared::Networks { less, more, apart }) = at.prepared else { return None };
        let residual = |network: &Network| at.at.tangent.residual(network, at.load(), at.temperatures()).ok();
        let (less, more) = (residual(less)?, residual(more)?);
        let row = |(n, (l, m)): (usize, (&f64, &f64))| (l != m).then(|| (n as u32, (m - l) / apart));
        Some(at.screen.disturbance(less.iter().zip(&more).enumerate().filter_map(row)))
    }

    fn quantity(&self, _law: Law) -> Quantity {
        Quantity::factor("factor")
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        format!("the conductivity of {} is {} times what the machine file says", told.place(), told.range(""))
    }
}
