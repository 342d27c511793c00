//! The next measurement: in words, and as outside programs read it.

use std::collections::BTreeMap;

use serde::Serialize;

use coldplate_base::numbers::significant;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_diagnose::{Costs, Expected, Next, Problem, Trial};
use coldplate_figures::report::{Align, ReportTable, TableCell};

use super::capital;

/// The variables of a condition that the machine file has, by name, as values with their units.
pub(super) fn by_name(problem: &Problem, condition: &Condition) -> BTreeMap<String, String> {
    let mut all = condition.by_name(&problem.study.model.machine);
    all.retain(|name, _| problem.states(name));
    all
}

/// A test as one would ask for it, with the sensor it needs.
pub fn in_words(problem: &Problem, next: &Next) -> String {
    let (from, at) = (
        if matches!(next.trial, Trial::Heater { .. } | Trial::Step { .. }) { " from the steady state" } else { "" },
        condition_in_words(problem, next),
    );
    format!("{}{from} at {at}{}", trial_in_words(problem, next), sensor_in_words(next).map_or(String::new(), |s| format!(", with {s}")))
}

/// Condition of a test.
fn condition_in_words(problem: &Problem, next: &Next) -> String {
    next.condition.words_of(&problem.study.model.machine, |v| problem.states(&v.name))
}

/// Sensor that a test needs, if the readings lack it.
fn sensor_in_words(next: &Next) -> Option<String> {
    next.sensor.as_ref().map(|s| match s.entry {
        Some(_) => format!("a new thermometer at: {}", s.name),
        None => format!("the sensor {} read too", s.name),
    })
}

/// Probability now, and as it is expected after a test.
fn chances_in_words(c: &Expected) -> String {
    let share = |p: f64| if p < 1e-3 { "below 0.1 %".to_string() } else { format!("{} %", significant(100.0 * p, 2)) };
    format!("{} -> {}", share(c.before), share(c.after))
}

/// Uncertainty of predictions now, and as it is expected after a test, K.
fn open_in_words(c: &Expected) -> String {
    format!("{} -> {}", significant(c.before, 2), significant(c.after, 2))
}

/// Expected gain of a test, and its cost, in words.
pub fn worth_in_words(next: &Next, costs: &Costs) -> String {
    let (worth, cost) = (&next.worth, significant(next.cost, 3));
    let prediction = open_in_words(&worth.prediction);
    let verdict = worth.wrong_verdict.as_ref().map_or(String::new(), |c| format!(", a wrong verdict {}", chances_in_words(c)));
    let name = chances_in_words(&worth.wrong_name);
    format!("a wrong name {name}, what is open in predictions {prediction} K{verdict}; costs {cost} {}", costs.unit)
}

/// Tests worth making, the best first.
pub(super) fn table(problem: &Problem, next: &[Next]) -> ReportTable {
    let text = |words: String| TableCell::from(words);
    let mut head = vec![
        ("test", Align::Left),
        ("at", Align::Left),
        ("besides", Align::Left),
        ("apart [σ]", Align::Right),
        ("wrong name", Align::Right),
        ("predictions open [K]", Align::Right),
    ];
    let has_verdict = next.iter().any(|n| n.worth.wrong_verdict.is_some());
    head.extend(has_verdict.then_some(("wrong verdict", Align::Right)));
    let cost = format!("cost [{}]", problem.costs.unit);
    head.push((cost.as_str(), Align::Right));
    let mut table = ReportTable::new(head);
    for n in next {
        let mut cells = vec![
            text(capital(&trial_in_words(problem, n))),
            text(condition_in_words(problem, n)),
            text(sensor_in_words(n).unwrap_or_else(|| "–".into())),
            TableCell::number(n.mean, 1),
            text(chances_in_words(&n.worth.wrong_name)),
            text(open_in_words(&n.worth.prediction)),
        ];
        let verdict = |c: &Expected| text(chances_in_words(c));
        cells.extend(has_verdict.then(|| n.worth.wrong_verdict.as_ref().map_or_else(|| text("–".into()), verdict)));
        cells.push(text(significant(n.cost, 3)));
        table.row(cells);
    }
    table
}

/// Action of a test, without its condition.
fn trial_in_words(problem: &Problem, next: &Next) -> String {
    match &next.trial {
        Trial::Steady => "a steady test".into(),
        Trial::Pressure(pascal) => format!("a steady test with {} Pa in the chamber", significant(*pascal, 3)),
        Trial::Heater { part, watts, seconds } => {
            let minutes = significant(*seconds / 60.0, 3);
            format!("a heater of {} W at {part}, on for {minutes} min, followed for 2 h", significant(*watts, 3))
        }
        Trial::Step { variable, to } => {
            let v = &problem.study.model.machine.variables[*variable];
            format!("a step of {} to {}, followed for 2 h", v.name.replace('_', " "), v.with_unit(*to, 4))
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
