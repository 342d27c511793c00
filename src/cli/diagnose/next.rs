//! What to measure next, in words and as JSON.

use serde_json::{Map, Value, json};

use super::super::condition::{self, value};
use super::super::text::significant;
use super::{Found, number};
use crate::describe::machine::Machine;
use crate::evidence::diagnose::{Next, Trial};

/// A test as one would ask for it.
pub(super) fn test_words(machine: &Machine, next: &Next) -> String {
    let at = condition::words(machine, &next.condition);
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
            format!("a step of {} to {}, followed for 2 h from the steady state at {at}", v.name.replace('_', " "), value(v, *to, 4))
        }
    }
}

/// The best next measurement with the others inside it, or null.
pub(super) fn json(found: &Found<'_>) -> Value {
    let machine = &found.problem.study.model.machine;
    let one = |n: &Next| -> Map<String, Value> {
        let mut map = Map::new();
        map.insert("condition".into(), Value::Object(condition::to_json(machine, &n.condition)));
        map.insert("intervention".into(), trial(machine, &n.trial));
        map.insert("text".into(), json!(test_words(machine, n)));
        map.insert("separation_sigma".into(), number(n.mean));
        map.insert("least_sigma".into(), number(n.separation));
        map.insert("sensor".into(), json!(n.sensor.as_ref().map(|s| &s.0)));
        map.insert("sensor_sigma".into(), n.sensor.as_ref().map_or(Value::Null, |s| number(s.1)));
        map
    };
    let Some((best, others)) = found.diagnosis.next.split_first() else { return Value::Null };
    let mut best = one(best);
    best.insert("others".into(), others.iter().map(|n| Value::Object(one(n))).collect());
    Value::Object(best)
}

fn trial(machine: &Machine, trial: &Trial) -> Value {
    let kind = trial.code();
    match trial {
        Trial::Steady => json!({"kind": kind}),
        Trial::Pressure(pascal) => json!({"kind": kind, "pressure_Pa": pascal}),
        Trial::Heater { part, watts, seconds } => json!({"kind": kind, "part": part, "power_W": watts, "duration_s": seconds}),
        Trial::Step { variable, to } => {
            let v = &machine.variables[*variable];
            json!({"kind": kind, "variable": v.name, "to": value(v, *to, 6)})
        }
    }
}
