//! Every constant that decides an answer halved and doubled, on drawn cases: the settings of the diagnosis, and the usual sizes of causes.

use std::collections::BTreeMap;
use std::path::PathBuf;

use coldplate_base::progress::Silent;
use coldplate_describe::machine::SCHEMA;
use coldplate_diagnose::{Problem, diagnose};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::draw::{Drawn, draw};
use crate::journal::{Entry, Journal};
use crate::run::{Answer, answer};

/// Probabilities near one: what is halved and doubled is their distance from one.
const NEAR_ONE: [&str; 2] = ["certain", "set"];
/// Factors on a constant.
const FACTORS: [f64; 2] = [0.5, 2.0];

/// A case with one constant changed.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Changed {
    seed: u64,
    /// Name of the constant; empty of the case as it is.
    constant: String,
    factor: f64,
    /// None where there is no answer.
    answer: Option<Answer>,
}

impl Entry for Changed {
    fn is_of(&self, seed: u64) -> bool {
        self.seed == seed
    }
}

/// Constants by name: those of the settings, then those of `[prior]`.
fn constants(problem: &Problem) -> Vec<String> {
    let names = |record: Value, before: &str| -> Vec<String> {
        record.as_object().map(|own| own.keys().map(|name| format!("{before}{name}")).collect()).unwrap_or_default()
    };
    let settings = serde_json::to_value(&problem.settings).unwrap_or_default();
    let priors = serde_json::to_value(problem.study.model.machine.priors).unwrap_or_default();
    [names(settings, ""), names(priors, "prior.")].concat()
}

/// A value with every number in it multiplied.
fn times(value: &Value, factor: f64) -> Value {
    match value {
        Value::Number(number) => number.as_f64().map_or(Value::Null, |own| Value::from(own * factor)),
        Value::Array(all) => all.iter().map(|own| times(own, factor)).collect(),
        Value::Object(all) => all.iter().map(|(name, own)| (name.clone(), times(own, factor))).collect(),
        other => other.clone(),
    }
}

/// The problem with a constant multiplied.
fn changed(problem: &Problem, constant: &str, factor: f64) -> Problem {
    let mut problem = problem.clone();
    if let Some(name) = constant.strip_prefix("prior.") {
        let record = serde_json::to_value(problem.study.model.machine.priors).unwrap_or_default();
        let unit = SCHEMA.find(&["prior", name]).and_then(|found| found.form.unit()).map_or("", |unit| unit.name);
        let value = format!("{:?} {unit}", factor * record[name].as_f64().unwrap_or_default());
        problem.study = problem.study.edited(&[(constant.into(), format!("\"{}\"", value.trim()))]).expect("a prior of the machine file");
    } else if !constant.is_empty() {
        let mut record = serde_json::to_value(&problem.settings).unwrap_or_default();
        let now = &record[constant];
        record[constant] = match now.as_f64().filter(|_| NEAR_ONE.contains(&constant)) {
            Some(probability) => Value::from(1.0 - factor * (1.0 - probability)),
            None => times(now, factor),
        };
        problem.settings = serde_json::from_value(record).expect("a record of the same fields");
    }
    problem
}

fn of(drawn: &Drawn, seed: u64, constant: &str, factor: f64) -> Changed {
    let problem = changed(&drawn.case.problem, constant, factor);
    let found = diagnose(&problem, &Silent);
    Changed { seed, constant: constant.into(), factor, answer: found.ok().map(|found| answer(drawn, &found)) }
}

/// Runs cases as they are and with every constant changed; goes on where it was stopped.
pub fn run(path: PathBuf, seeds: impl Iterator<Item = u64>) {
    let mut journal: Journal<Changed> = Journal::open(path);
    for seed in seeds {
        let drawn = draw(seed);
        let all = constants(&drawn.case.problem);
        let variants = std::iter::once((String::new(), 1.0)).chain(all.into_iter().flat_map(|name| FACTORS.map(|f| (name.clone(), f))));
        for (constant, factor) in variants {
            if !journal.records.iter().any(|own| own.seed == seed && own.constant == constant && own.factor == factor) {
                journal.add(of(&drawn, seed, &constant, factor));
            }
        }
    }
}

/// A question about an answer.
type Question = fn(&Answer) -> bool;

/// Questions whose answers are counted.
const COUNTED: [(&str, Question); 5] = [
    ("detected", |a| a.detected),
    ("kind and place first", |a| a.right),
    ("in the set", |a| a.in_set),
    ("certain", |a| a.confident),
    ("certain and wrong", |a| a.misnamed),
];

/// Prints how many answers each constant changes, and what of them.
pub fn print(records: &[Changed]) {
    let mut by: BTreeMap<(&str, u64), Vec<(&Answer, &Answer)>> = BTreeMap::new();
    let plain: BTreeMap<u64, &Answer> =
        records.iter().filter(|own| own.constant.is_empty()).filter_map(|own| Some((own.seed, own.answer.as_ref()?))).collect();
    for own in records.iter().filter(|own| !own.constant.is_empty()) {
        if let (Some(base), Some(answer)) = (plain.get(&own.seed), &own.answer) {
            by.entry((&own.constant, own.factor.to_bits())).or_default().push((base, answer));
        }
    }
    let base = |good: Question| plain.values().filter(|a| good(a)).count();
    let as_it_is: Vec<String> = COUNTED.iter().map(|(name, good)| format!("{name} {}", base(*good))).collect();
    println!("{} cases; as they are: {}.\n", plain.len(), as_it_is.join(", "));
    let heads: Vec<&str> = COUNTED.iter().map(|(name, _)| *name).collect();
    println!("| constant | times | cases | another verdict | {} | error on unseen data, mean ratio |", heads.join(" | "));
    println!("|---|---:|---:|---:|{}---:|", "---:|".repeat(COUNTED.len()));
    for ((constant, factor), pairs) in &by {
        let other = pairs.iter().filter(|(base, own)| base.verdict != own.verdict).count();
        let change = |good: Question| {
            let (gained, lost) = pairs.iter().fold((0, 0), |(gained, lost), (base, own)| {
                (gained + usize::from(!good(base) && good(own)), lost + usize::from(good(base) && !good(own)))
            });
            if (gained, lost) == (0, 0) { "0".to_string() } else { format!("+{gained} -{lost}") }
        };
        let cells: Vec<String> = COUNTED.iter().map(|(_, good)| change(*good)).collect();
        let ratio = pairs.iter().map(|(base, own)| (own.after / base.after).ln()).sum::<f64>() / pairs.len() as f64;
        println!(
            "| {} | {} | {} | {other} | {} | {:.3} |",
            constant.replace('_', " "),
            f64::from_bits(*factor),
            pairs.len(),
            cells.join(" | "),
            ratio.exp()
        );
    }
}
