//! `coldplate diagnose --plan`: what readings could show before there are any.

use serde::Serialize;

use super::super::output::Output;
use super::super::text::table;
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_diagnose::{Hypothesis, Plan, Problem, plan};

/// Causes and groups that are listed in a terminal at most, and causes that one line names.
const LISTED: usize = 40;
const GROUPS: usize = 20;
const NAMED: usize = 8;

/// Says what readings would show, and prints it.
///
/// # Errors
/// The data are logs; the machine cannot be solved at one of the conditions.
pub(super) fn run(problem: &Problem, out: Output) -> Result<u8> {
    let found = plan(problem, &out.progress())?;
    out.report(&text(&found, &problem.study.model.machine.name), &PlanRecord::of(&found));
    Ok(0)
}

/// A cause by kind and place, and by its law where that is not the usual one.
fn name(h: &Hypothesis) -> String {
    let law = if h.law == h.effect.usual_law() { String::new() } else { format!(", {}", h.law_words()) };
    h.kind_and_place() + &law
}

/// An amplitude in words.
fn words(h: &Hypothesis, least: f64) -> String {
    match amplitude(h, least) {
        _ if h.is_fixed() => "at once".into(),
        (value, unit) => match unit.strip_prefix("relative") {
            Some(rest) => format!("{} %{rest}", significant(100.0 * value, 3)),
            None => format!("{} {unit}", significant(value, 3)),
        },
    }
}

/// An amplitude and its unit; of a number that moves by its logarithm the factor.
fn amplitude(h: &Hypothesis, least: f64) -> (f64, &'static str) {
    if h.unit.starts_with("ln") { (least.exp(), "times") } else { (least, h.unit) }
}

fn listed(names: &[String]) -> String {
    let more = names.len().saturating_sub(NAMED);
    let all = names.iter().take(NAMED).cloned().collect::<Vec<_>>().join("; ");
    if more > 0 { format!("{all}; and {more} more") } else { all }
}

fn text(found: &Plan, machine: &str) -> String {
    let named = |n: &usize| name(&found.seen[*n].hypothesis);
    let all = found.seen.len() + found.unseen.len();
    let mut text = format!(
        "{machine}\n{} conditions, {} sensors\n\n{} of {all} causes would be seen, each in nine tables of ten from the amplitude below on\n\n",
        found.conditions,
        found.sensors,
        found.seen.len()
    );
    let row = |own: &coldplate_diagnose::Detectable| {
        vec![name(&own.hypothesis), words(&own.hypothesis, own.least), format!("{} K", significant(own.change, 2))]
    };
    text += &table(&["cause", "seen from", "largest change"], &found.seen.iter().take(LISTED).map(row).collect::<Vec<_>>());
    if found.seen.len() > LISTED {
        text += &format!("and {} more: --json has all\n", found.seen.len() - LISTED);
    }
    if !found.unseen.is_empty() {
        let names: Vec<String> = found.unseen.iter().map(name).collect();
        text += &format!("\nnot seen, however large they usually are: {}\n", listed(&names));
    }
    text += if found.alike.is_empty() { "\nall that are seen can be told apart\n" } else { "\nnever told apart:\n" };
    for group in found.alike.iter().take(GROUPS) {
        text += &format!("  {}\n", listed(&group.iter().map(named).collect::<Vec<_>>()));
    }
    if found.alike.len() > GROUPS {
        text += &format!("  and {} groups more: --json has all\n", found.alike.len() - GROUPS);
    }
    for (n, own) in found.further.iter().enumerate() {
        let before = if n == 0 { "\none sensor more:\n" } else { "" };
        text += &format!("{before}  {}: {} more causes seen, {} more told apart\n", own.name, own.seen, own.apart);
        text += &format!("     in the machine file: sensor.\"{}\" = {}\n", own.name, own.entry);
    }
    if found.further.is_empty() {
        text += "\nno sensor more would help: every part, node and outlet has one, or none shows another cause\n";
    }
    text
}

/// A plan as outside programs read it.
#[derive(Debug, Serialize)]
struct PlanRecord {
    conditions: usize,
    sensors: usize,
    seen: Vec<SeenRecord>,
    unseen: Vec<CauseRecord>,
    /// Groups of causes that could never be told apart, by their places in `seen`.
    alike: Vec<Vec<usize>>,
    further_sensors: Vec<SensorRecord>,
}

#[derive(Debug, Serialize)]
struct CauseRecord {
    kind: String,
    place: String,
}

#[derive(Debug, Serialize)]
struct SeenRecord {
    #[serde(flatten)]
    cause: CauseRecord,
    /// Least amplitude that is seen; with the unit `times` a factor.
    least: f64,
    unit: &'static str,
    #[serde(rename = "largest_change_K")]
    change: f64,
}

#[derive(Debug, Serialize)]
struct SensorRecord {
    name: String,
    entry: String,
    more_seen: usize,
    more_told_apart: usize,
}

impl PlanRecord {
    fn of(found: &Plan) -> Self {
        let cause = |h: &Hypothesis| CauseRecord { kind: h.kind().into(), place: h.place.clone() };
        let seen = |own: &coldplate_diagnose::Detectable| {
            let (least, unit) = amplitude(&own.hypothesis, own.least);
            SeenRecord { cause: cause(&own.hypothesis), least, unit, change: own.change }
        };
        let sensor = |own: &coldplate_diagnose::FurtherSensor| SensorRecord {
            name: own.name.clone(),
            entry: own.entry.clone(),
            more_seen: own.seen,
            more_told_apart: own.apart,
        };
        Self {
            conditions: found.conditions,
            sensors: found.sensors,
            seen: found.seen.iter().map(seen).collect(),
            unseen: found.unseen.iter().map(cause).collect(),
            alike: found.alike.clone(),
            further_sensors: found.further.iter().map(sensor).collect(),
        }
    }
}
