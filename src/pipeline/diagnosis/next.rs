//! What to measure next, in words.

use crate::describe::machine::Machine;
use crate::evidence::diagnose::{Next, Trial};
use crate::foundation::numbers::significant;

/// A test as one would ask for it.
pub fn in_words(machine: &Machine, next: &Next) -> String {
    let at = next.condition.words(machine);
    match &next.trial {
        Trial::Steady => format!("a steady test at {at}"),
        Trial::Pressure(pascal) => format!("a steady test with {} Pa in the chamber at {at}", significant(*pascal, 3)),
        Trial::Heater { part, watts, seconds } => format!(
            "a heater of {} W at {part}, on for {} min, followed for 2 h from the steady state at {at}",
            significant(*watts, 3),
            significant(*seconds / 60.0, 3)
        ),
        Trial::Step { variable, to } => {
            let v = &machine.variables[*variable];
            format!("a step of {} to {}, followed for 2 h from the steady state at {at}", v.name.replace('_', " "), v.with_unit(*to, 4))
        }
    }
}
