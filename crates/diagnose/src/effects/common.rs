//! What all members of a kind share: a correlation for every film, a supply for every heat, a paint on every surface, a torque
//! for every joint, the chiller before every circuit and its pump. Its derivative and its lines are those of all members together.

use super::words::Quantity;
use super::{Contact, Effect, Family, Flow, Heat, Hypothesis, Law, Linearised, Lines, MachineEdit, Radiation, Site, Told};
use coldplate_base::error::Result;
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;

/// A common factor or offset as a cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Common {
    /// Films of all channels, logarithm.
    Films,
    /// Heats of all sources, relative.
    Heats,
    /// Emissivities of all that radiates, logarithm.
    Emissivities,
    /// Conductances of all contacts, logarithm.
    Contacts,
    /// Inlet temperatures of all circuits, K.
    Inlets,
    /// Flows of all circuits, logarithm: one pump, or flow meters in another unit.
    Flows,
}

impl Common {
    const ALL: [Self; 6] = [Self::Films, Self::Heats, Self::Emissivities, Self::Contacts, Self::Inlets, Self::Flows];

    /// The effects of the members, each of which is a cause of its own too.
    fn members(self, study: &Study) -> Vec<Effect> {
        let machine = &study.model.machine;
        match self {
            Self::Films => (0..machine.channels.len()).map(|c| Flow::Film(c).into()).collect(),
            Self::Heats => (0..machine.sources.len()).map(|s| Heat::Source(s).into()).collect(),
            Self::Emissivities => Radiation::emissivities(study).into_iter().map(Effect::from).collect(),
            Self::Contacts => Contact::scalable(study).into_iter().map(Effect::from).collect(),
            // What another circuit feeds has no inlet temperature and no flow of its own.
            Self::Inlets | Self::Flows => {
                let fed_from_without = (0..machine.circuits.len()).filter(|c| machine.circuits[*c].intake.feeders().is_empty());
                let of: fn(usize) -> Flow = if self == Self::Inlets { Flow::Inlet } else { Flow::Rate };
                fed_from_without.map(|c| of(c).into()).collect()
            }
        }
    }

    /// What they are called.
    fn name(self) -> &'static str {
        match self {
            Self::Films => "all films",
            Self::Heats => "all heats",
            Self::Emissivities => "all emissivities",
            Self::Contacts => "all contacts",
            Self::Inlets => "all inlets",
            Self::Flows => "all flows",
        }
    }
}

impl Family for Common {
    /// One member alone is no common cause.
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let prior = &site.machine.priors;
        let one = |common: &Self| {
            let (scale, unit) = match common {
                Self::Heats => (prior.all_heats, "relative"),
                Self::Inlets => (prior.all_inlets, "K"),
                _ => (prior.all_factors, "ln"),
            };
            (common.members(site.study).len() > 1).then(|| Hypothesis::signed(*common, common.name(), Vec::new(), scale, unit))
        };
        Self::ALL.iter().filter_map(one).collect()
    }

    fn kind(&self) -> &'static str {
        self.name()
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        let mut all = Vec::new();
        for member in self.members(edit.study) {
            let Some(lines) = member.family().lines(edit)? else { return Ok(None) };
            all.extend(lines);
        }
        Ok(Some(all))
    }

    /// Where that of each member can.
    fn has_formula_of(&self, _law: Law) -> bool {
        matches!(self, Self::Heats | Self::Contacts)
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        let mut sum = Disturbance::default();
        for member in self.members(at.at.study) {
            let Disturbance { rows, inlets, surroundings } = member.family().disturbance(at)?;
            sum.rows.extend(rows);
            sum.inlets.extend(inlets);
            sum.surroundings += surroundings;
        }
        Some(sum)
    }

    fn quantity(&self, _law: Law) -> Quantity {
        match self {
            Self::Heats => Quantity::grown("factor"),
            Self::Inlets => Quantity::plain("offset", "K"),
            _ => Quantity::factor("factor"),
        }
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        match self {
            Self::Inlets => format!("the water enters all circuits {}: the chiller and its line", told.warmer()),
            Self::Flows => format!("all flows are {} times what is stated", told.range("")),
            _ => format!("{} are {} times what the machine file says", self.name(), told.range("")),
        }
    }
}
