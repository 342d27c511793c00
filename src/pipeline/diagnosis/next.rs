//! What to measure next, in words.

use crate::describe::machine::Machine;
use crate::evidence::diagnose::{Costs, Expected, Next, Trial};
use crate::foundation::numbers::significant;

/// A test as one would ask for it, with the sensor it needs.
pub fn in_words(machine: &Machine, next: &Next) -> String {
    let sensor = next.sensor.as_ref().map_or(String::new(), |s| match s.entry {
        Some(_) => format!(", with a new thermometer at: {}", s.name),
        None => format!(", with the sensor {} read too", s.name),
    });
    format!("{}{sensor}", trial_in_words(machine, next))
}

/// What it would settle of what is open, and its cost.
pub fn worth_in_words(next: &Next, costs: &Costs) -> String {
    let share = |p: f64| if p < 1e-3 { "below 0.1 %".to_string() } else { format!("{} %", significant(100.0 * p, 2)) };
    let percent = |c: &Expected| format!("{} -> {}", share(c.before), share(c.after));
    let (worth, cost) = (&next.worth, significant(next.cost, 3));
    let prediction = format!("{} -> {} K", significant(worth.prediction.before, 2), significant(worth.prediction.after, 2));
    let verdict = worth.wrong_verdict.as_ref().map_or(String::new(), |c| format!(", a wrong verdict {}", percent(c)));
    let name = percent(&worth.wrong_name);
    format!("a wrong name {name}, what is open in predictions {prediction}{verdict}; costs {cost} {}", costs.unit)
}

fn trial_in_words(machine: &Machine, next: &Next) -> String {
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
