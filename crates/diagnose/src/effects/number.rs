//! Numbers of the machine file that the user calls uncertain: no causes, but refitted beside one.

use super::words::Quantity;
use super::{Family, Hypothesis, Law, Linearised, Lines, MachineEdit, Site, Told};
use coldplate_base::error::Result;
use coldplate_solve::sensitivity::{Disturbance, UncertainNumber};
use coldplate_base::units::si_unit;

/// A number of the file, SI more than it says; the place of its hypothesis is its key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Number;

impl Number {
    /// A number that may be off by its standard deviation.
    pub fn of(uncertain: &UncertainNumber) -> Hypothesis {
        let unit = si_unit(uncertain.parameter.dimension.of_differences()).unwrap_or("SI");
        Hypothesis::signed(Self, &uncertain.parameter.name, Vec::new(), uncertain.deviation, unit)
    }
}

impl Family for Number {
    /// It is a nuisance of every cause and none itself.
    fn candidates(_site: &Site<'_>) -> Vec<Hypothesis> {
        Vec::new()
    }

    fn kind(&self) -> &'static str {
        "uncertain number"
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        let key = &edit.hypothesis.place;
        let now = edit.study.parameter(key)?.value;
        // What is positive stays so.
        let least = if now > 0.0 { 0.01 * now } else { f64::NEG_INFINITY };
        edit.shifted(key, (now + edit.amplitude).max(least) - now)
    }

    fn disturbance(&self, _at: &Linearised<'_, '_>) -> Option<Disturbance> {
        None
    }

    fn quantity(&self, _law: Law) -> Quantity {
        Quantity::plain("change", "SI")
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        let unit = Some(told.hypothesis.unit).filter(|unit| *unit != "1").map(|unit| format!(" {unit}")).unwrap_or_default();
        format!("{} is off by {}", told.place(), told.range(&unit))
    }
}
