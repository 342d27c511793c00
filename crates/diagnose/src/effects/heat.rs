//! Heat that the model lacks, and heat of its sources that is more or less than stated.

use super::file::text;
use super::words::Quantity;
use super::{CommonFactor, Family, Hypothesis, Law, Linearised, Lines, MachineEdit, Site, Told};
use coldplate_describe::machine::LinearPower;
use coldplate_base::error::Result;
use coldplate_base::document::{Leaf, quoted};
use coldplate_solve::sensitivity::Disturbance;
use coldplate_base::units;

/// Kelvin over which a source that follows its temperature changes by its amplitude.
const DRIFT: f64 = 10.0;

/// Heat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Heat {
    /// Heat into a group, W.
    Into(u32),
    /// Heat of a source of the file, relative.
    Source(usize),
}

impl Family for Heat {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        let prior = &site.machine.priors;
        let heat = (prior.added_heat * site.whole_heat()).max(prior.least_added_heat);
        let mut found = Vec::new();
        for g in &site.groups {
            let into = Hypothesis::signed(Self::Into(g.index), &g.name, vec![g.name.clone()], heat, "W");
            found.extend(site.laws.iter().map(|law| into.clone().under_of(*law, &site.scales)));
        }
        for (s, source) in site.machine.sources.iter().enumerate() {
            let factor = Hypothesis::signed(Self::Source(s), &source.name, site.part_names(&source.places.iter().map(|heated| heated.place).collect::<Vec<_>>()), prior.source, "relative");
            found.extend(site.laws.iter().map(|law| factor.clone().under_of(*law, &site.scales)));
            let drift = Hypothesis { scale: prior.source_drift, unit: "relative per 10 K", law: Law::Temperature, ..factor };
            found.extend(source.law.linear().map(|_| drift));
        }
        found
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Into(_) => "heat source",
            Self::Source(_) => "source factor",
        }
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        let amplitude = edit.amplitude;
        match *self {
            Self::Into(g) => {
                // A formula needs a name; a constant is a number with its unit.
                let power =
                    if edit.is_constant() { format!("{amplitude:?} W") } else { format!("({amplitude:?}) * ({})", edit.law()) };
                Ok(Some(vec![(edit.added("source"), format!("{{ in = {}, power = {} }}", text(edit.group(g)), text(power)))]))
            }
            Self::Source(s) => {
                let source = &edit.machine().sources[s];
                if edit.hypothesis.is_drift() {
                    let Some(law) = source.law.linear() else { return Ok(None) };
                    let key = format!("source.{}.{}", quoted(&source.name), LinearPower::COEFFICIENT);
                    let coefficient = law.coefficient + amplitude / DRIFT;
                    return Ok(Some(vec![(key, text(format!("{coefficient:?} 1/K")))]));
                }
                let (key, unit) = match source.volume {
                    Some(_) => (format!("source.{}.power_density", quoted(&source.name)), "W/m3"),
                    None => (format!("source.{}.power", quoted(&source.name)), "W"),
                };
                let Some(Leaf::Text(now)) = edit.study.document().leaf(&key)? else { return Ok(None) };
                let factor = |power: &str| format!("({power}) * (1 + ({amplitude:?}) * ({}))", edit.law());
                let line = match (units::quantity(&now), edit.machine().variables.iter().find(|v| v.name == now.trim())) {
                    (Some((number, stated, dimension)), _) => {
                        let watts = units::convert(number, stated, dimension)?;
                        match edit.is_constant() {
                            true => text(format!("{:?} {unit}", watts * (1.0 + amplitude))),
                            false => text(factor(&format!("{watts:?}"))),
                        }
                    }
                    // A variable alone has its unit with it; in a formula it is a number.
                    (None, Some(variable)) => {
                        let (name, unit) = variable.in_expressions();
                        format!("{{ formula = {}, unit = {} }}", text(factor(&name)), text(unit))
                    }
                    (None, None) => text(factor(&now)),
                };
                Ok(Some(vec![(key, line)]))
            }
        }
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        Some(match *self {
            Self::Into(g) => at.screen.source(at.ground.heated(g)),
            Self::Source(s) if at.is_drift => at.screen.temperature_coefficient(s)?.times(1.0 / DRIFT),
            Self::Source(s) => at.screen.power(s),
        })
    }

    fn says_when(&self) -> bool {
        true
    }

    fn quantity(&self, law: Law) -> Quantity {
        match self {
            Self::Into(_) => Quantity::plain("heat", "W"),
            Self::Source(_) if law == Law::Temperature => Quantity::grown("factor_per_10_K"),
            Self::Source(_) => Quantity::grown("factor"),
        }
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        let (place, law) = (told.place(), told.law());
        match self {
            Self::Into(_) if told.amplitude >= 0.0 => {
                format!("heat enters at {place} that the model lacks: {}{}{law}", told.range(" W"), told.where_stated())
            }
            Self::Into(_) => {
                format!("less heat enters at {place} than the model has: {}{}{law}", told.range(" W"), told.where_stated())
            }
            Self::Source(_) if told.is_constant() => format!("the heat of {place} is {} times what the model has", told.range("")),
            Self::Source(_) if told.hypothesis.is_drift() => {
                let range = told.range("");
                format!("the heat of {place} grows with its temperature otherwise than the model's: {range} times as much per 10 K")
            }
            Self::Source(_) if told.hypothesis.law.says_when() => {
                format!("the heat of {place} is {} times what the model has{law}", told.range(""))
            }
            Self::Source(_) => {
                format!("the heat of {place} follows another law:{} {} times the model's{law}", told.where_stated(), told.range(""))
            }
        }
    }

    fn common_factor(&self) -> Option<CommonFactor> {
        matches!(self, Self::Source(_)).then_some(CommonFactor::Heats)
    }
}
