//! The next measurement: in words, and as outside programs read it.

use std::collections::BTreeMap;

use serde::Serialize;

use coldplate_base::numbers::significant;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_diagnose::{Costs, Expected, Next, Problem, Trial};

/// The variables of a condition that the machine file has, by name, as values with their units.
pub(super) fn by_name(problem: &Problem, condition: &Condition) -> BTreeMap<String, String> {
    let mut all = condition.by_name(&problem.study.model.machine);
    all.retain(|name, _| problem.states(name));
    all
}

/// A test as one would ask for it, with the sensor it needs.
pub fn in_words(problem: &Problem, next: &Next) -> String {
    let sensor = next.sensor.as_ref().map_or(String::new(), |s| match s.entry {
        Some(_) => format!(", with a new thermometer at: {}", s.name),
        None => format!(", with the sensor {} read too", s.name),
    });
    format!("{}{sensor}", trial_in_words(problem, next))
}

/// Expected gain of a test, and its cost, in words.
pub fn worth_in_words(next: &Next, costs: &Costs) -> String {
    let share = |p: f64| if p < 1e-3 { "below 0.1 %".to_string() } else { format!("{} %", significant(100.0 * p, 2)) };
    let percent = |c: &Expected| format!("{} -> {}", share(c.before), share(c.after));
    let (worth, cost) = (&next.worth, significant(next.cost, 3));
    let prediction = format!("{} -> {} K", significant(worth.prediction.before, 2), significant(worth.prediction.after, 2));
    let verdict = worth.wrong_verdict.as_ref().map_or(String::new(), |c| format!(", a wrong verdict {}", percent(c)));
    let name = percent(&worth.wrong_name);
    format!("a wrong name {name}, what is open in predictions {prediction}{verdict}; costs {cost} {}", costs.unit)
}

fn trial_in_words(problem: &Problem, next: &Next) -> String {
    let machine = &problem.study.model.machine;
    let at = next.condition.words_of(machine, |v| problem.states(&v.name));
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

/// A test worth making.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct NextRecord {
    pub condition: BTreeMap<String, String>,
    pub intervention: InterventionRecord,
    pub text: String,
    /// Mean distance of open explanations, in standard deviations of the expected readings.
    pub separation_sigma: f64,
    pub least_sigma: f64,
    /// A sensor that the data lack and that the test needs.
    pub sensor: Option<String>,
    /// Distance of the two most probable explanations by this sensor alone, in standard deviations.
    pub sensor_sigma: Option<f64>,
    /// Entry of the sensor in the machine file, if it does not exist yet.
    pub sensor_entry: Option<String>,
    pub cost: f64,
    pub cost_unit: String,
    /// Probability that the name is wrong.
    pub wrong_name: ExpectedRecord,
    /// Root mean square uncertainty of predictions over the ranges, K.
    pub prediction_K: ExpectedRecord,
    /// Probability of a wrong verdict about the limits over the ranges.
    pub wrong_verdict: Option<ExpectedRecord>,
    /// The next best tests; only the best test has them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub others: Option<Vec<NextRecord>>,
}

/// A quantity now, and as it is expected after a test.
#[derive(Debug, Clone, Copy, Serialize)]
#[allow(missing_docs)]
pub struct ExpectedRecord {
    pub before: f64,
    pub after: f64,
}

/// Actions of a test.
#[derive(Debug, Clone, Default, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct InterventionRecord {
    pub kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_Pa: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_W: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variable: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
}

impl NextRecord {
    pub(super) fn of(problem: &Problem, next: &Next) -> Self {
        let (machine, costs) = (&problem.study.model.machine, &problem.costs);
        let change = |c: &Expected| ExpectedRecord { before: c.before, after: c.after };
        Self {
            condition: by_name(problem, &next.condition),
            intervention: InterventionRecord::of(machine, &next.trial),
            text: in_words(problem, next),
            separation_sigma: next.mean,
            least_sigma: next.separation,
            sensor: next.sensor.as_ref().map(|s| s.name.clone()),
            sensor_sigma: next.sensor.as_ref().map(|s| s.separation),
            sensor_entry: next.sensor.as_ref().and_then(|s| s.entry.clone()),
            cost: next.cost,
            cost_unit: costs.unit.clone(),
            wrong_name: change(&next.worth.wrong_name),
            prediction_K: change(&next.worth.prediction),
            wrong_verdict: next.worth.wrong_verdict.as_ref().map(change),
            others: None,
        }
    }
}

impl InterventionRecord {
    fn of(machine: &Machine, trial: &Trial) -> Self {
        let plain = Self { kind: trial.code(), ..Self::default() };
        match trial {
            Trial::Steady => plain,
            Trial::Pressure(pascal) => Self { pressure_Pa: Some(*pascal), ..plain },
            Trial::Heater { part, watts, seconds } => {
                Self { part: Some(part.clone()), power_W: Some(*watts), duration_s: Some(*seconds), ..plain }
            }
            Trial::Step { variable, to } => {
                let v = &machine.variables[*variable];
                Self { variable: Some(v.name.clone()), to: Some(v.with_unit(*to, 6)), ..plain }
            }
        }
    }
}
