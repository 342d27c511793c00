//! What to measure next: the conditions, interventions and sensors that set the surviving explanations furthest apart.

use rayon::prelude::*;

use super::catalogue::{Scales, hypotheses};
use super::refine::Bench;
use super::signature::signatures;
use super::trial::{Trial, trials};
use super::view::{is_open, open_factors};
use super::{Act, Explanation, Hypothesis, Problem, Verdict};
use crate::describe::machine::Condition;
use crate::error::Result;
use crate::evidence::measurement::{Data, Row, Whitener};

/// Most explanations that are told apart.
const MOST: usize = 6;
/// Most conditions that are tried.
const CONDITIONS: usize = 40;
/// Steady conditions, and interventions, that are proposed.
const PROPOSED: usize = 3;
/// Least distance worth a test, in standard deviations.
const TELLING: f64 = 1.0;

/// A test worth making.
#[derive(Debug, Clone, PartialEq)]
pub struct Next {
    /// What is done.
    pub trial: Trial,
    /// The condition it is done at, or begins with.
    pub condition: Condition,
    /// Distance of the two explanations it tells apart least, in standard deviations, over all sensors of the data.
    pub separation: f64,
    /// The probability-weighted mean distance.
    pub mean: f64,
    /// A sensor of the machine that the data lack and that would add most there, with the distance it alone gives.
    pub sensor: Option<(String, f64)>,
}

/// What a test would show of the explanations, reading by reading, K.
#[derive(Debug, Clone)]
pub(super) struct Outlook {
    /// Readings under each explanation, counted from any common base.
    pub shown: Vec<Vec<f64>>,
    /// What the amplitudes of each explanation leave open in them, one column per part.
    pub open: Vec<Vec<Vec<f64>>>,
    /// Standard deviation of each reading's own error.
    pub deviation: Vec<f64>,
    /// Errors that readings share, each of unit variance.
    pub common: Vec<Vec<f64>>,
}

impl Outlook {
    /// Distance of two explanations over some readings, in standard deviations: what their amplitudes could still make up for
    /// does not count.
    fn distance(&self, (a, b): (usize, usize), readings: &[usize]) -> f64 {
        let pick = |v: &Vec<f64>| readings.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        let shared = self.common.iter().chain(&self.open[a]).chain(&self.open[b]).map(pick).collect::<Vec<_>>();
        let whitener = Whitener::new(&pick(&self.deviation), &shared);
        let apart: Vec<f64> = readings.iter().map(|i| self.shown[a][*i] - self.shown[b][*i]).collect();
        whitener.apply(&apart).iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// The least distance of two explanations, and the mean one, weighted with their probabilities.
    pub fn apart(&self, probabilities: &[f64], readings: &[usize]) -> (f64, f64) {
        let (mut least, mut sum, mut weight) = (f64::INFINITY, 0.0, 0.0);
        for a in 0..self.shown.len() {
            for b in a + 1..self.shown.len() {
                let distance = self.distance((a, b), readings);
                let both = probabilities[a] * probabilities[b];
                least = least.min(distance);
                sum += both * distance;
                weight += both;
            }
        }
        (least, if weight > 0.0 { sum / weight } else { 0.0 })
    }
}

/// Ranks feasible tests, the most telling first; empty where fewer than two explanations survive, or no test tells them apart. Interventions are only proposed
/// where one of the explanations is right: they are solved with each in force.
///
/// # Errors
/// As [`signatures`].
pub(super) fn next(bench: &Bench<'_>, problem: &Problem, verdict: Verdict, explanations: &[&Explanation]) -> Result<Vec<Next>> {
    let is_finite = |e: &&Explanation| e.parts.iter().all(|p| p.deviation.is_finite());
    let alive: Vec<&Explanation> = explanations.iter().copied().take(MOST).filter(is_finite).collect();
    if alive.len() < 2 {
        return Ok(Vec::new());
    }
    let mut found = best(steady(problem, &alive, bench.scales)?);
    if verdict == Verdict::CannotTell {
        found.extend(best(trials(bench, problem, &alive)));
        found.sort_by(|a, b| b.mean.total_cmp(&a.mean));
    }
    Ok(found)
}

/// The most telling first; what tells nothing is left out.
fn best(mut tests: Vec<Next>) -> Vec<Next> {
    tests.retain(|n| n.mean >= TELLING);
    tests.sort_by(|a, b| b.mean.total_cmp(&a.mean));
    tests.truncate(PROPOSED);
    tests
}

/// Steady tests at conditions within the machine's ranges, from slopes.
fn steady(problem: &Problem, alive: &[&Explanation], scales: &Scales) -> Result<Vec<Next>> {
    let machine = &problem.study.model.machine;
    let mut conditions = candidates(problem);
    // Some cannot be run: water out of its range, no flow where heat needs it.
    conditions.retain(|c| problem.study.model.solver(c).is_ok());
    if conditions.is_empty() {
        return Ok(Vec::new());
    }
    let rows = conditions.iter().enumerate().map(|(i, c)| (format!("candidate {i}"), None, c.clone()));
    let data = all_sensors(problem, rows);
    let parts = alive.iter().flat_map(|e| &e.parts);
    let mut wanted: Vec<Hypothesis> = parts.map(|p| moved(p.hypothesis.clone(), problem)).collect();
    let (own, open) = (wanted.len(), open_causes(problem, &data));
    wanted.extend(open.iter().cloned());
    let found = signatures(&problem.study, &data, problem.start, &[], &wanted, scales, &problem.user)?;
    let (columns, factors) = found.columns.split_at(own);
    let factors = open_factors(&problem.openness, &open, factors, data.count());
    let sensors = data.sensors.len();
    let deviation = deviations(problem);
    let probabilities: Vec<f64> = alive.iter().map(|e| e.probability).collect();
    let rate = |c: usize| -> Next {
        let range = c * sensors..(c + 1) * sensors;
        let mut columns = columns.iter().map(|column| &column[range.clone()]);
        let (mut shown, mut open) = (Vec::new(), Vec::new());
        for e in alive {
            let (mut sum, mut own) = (vec![0.0; sensors], Vec::new());
            for (part, column) in e.parts.iter().zip(columns.by_ref()) {
                sum.iter_mut().zip(column).for_each(|(s, v)| *s += part.amplitude * v);
                own.push(column.iter().map(|v| part.deviation * v).collect());
            }
            shown.push(sum);
            open.push(own);
        }
        let slopes = &found.prediction.conditions[range.clone()];
        let errors = problem.uncertainty.at(&conditions[c]);
        let of_condition = errors.iter().enumerate().map(|(v, e)| slopes.iter().map(|row| row[v] * e).collect());
        let common = of_condition.chain(factors.iter().map(|f| f[range.clone()].to_vec())).collect();
        let outlook = Outlook { shown, open, deviation: deviation.clone(), common };
        let own = &problem.data.sensors;
        let (separation, mean) = outlook.apart(&probabilities, own);
        let extra = (0..sensors).filter(|s| !own.contains(s)).map(|s| (outlook.distance((0, 1), &[s]), s));
        let sensor = extra.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(d, _)| *d > 0.5).map(|(d, s)| (machine.sensors[s].name.clone(), d));
        Next { trial: Trial::Steady, condition: conditions[c].clone(), separation, mean, sensor }
    };
    Ok((0..conditions.len()).into_par_iter().map(rate).collect())
}

/// What every model leaves open: all films, heats and emissivities.
pub(super) fn open_causes(problem: &Problem, data: &Data) -> Vec<Hypothesis> {
    let mut found = hypotheses(&problem.study, data, &[]);
    found.retain(|h| is_open(h, &problem.openness));
    found
}

/// Rows (test, time, condition) to be predicted for all of the machine's sensors.
pub(super) fn all_sensors(problem: &Problem, rows: impl Iterator<Item = (String, Option<f64>, Condition)>) -> Data {
    let machine = &problem.study.model.machine;
    let sensors: Vec<usize> = (0..machine.sensors.len()).collect();
    let names = machine.sensors.iter().map(|s| s.name.clone()).collect();
    let row = |(test, time, condition): (String, Option<f64>, Condition)| Row {
        test,
        time,
        condition,
        readings: vec![Some(300.0); sensors.len()],
        line: None,
    };
    let rows = rows.map(row).collect();
    Data { source: String::new(), sensors, names, rows, notes: Vec::new() }
}

/// Standard deviation of a reading of each of the machine's sensors: noise, its own error, and what every model leaves open, K.
fn deviations(problem: &Problem) -> Vec<f64> {
    let of = |s: usize| {
        let k = problem.data.sensors.iter().position(|own| *own == s).unwrap_or(0);
        problem.uncertainty.noise[k].hypot(problem.uncertainty.bias[k]).hypot(problem.openness.model)
    };
    (0..problem.study.model.machine.sensors.len()).map(of).collect()
}

/// A sensor's own error refers to the columns of the data; here all of the machine's sensors are columns.
pub(super) fn moved(mut h: Hypothesis, problem: &Problem) -> Hypothesis {
    let to = |k: usize| problem.data.sensors[k];
    h.act = match h.act {
        Act::Bias(k) => Act::Bias(to(k)),
        Act::Gain(k) => Act::Gain(to(k)),
        Act::Lag(k) => Act::Lag(to(k)),
        Act::Swap(a, b) => Act::Swap(to(a), to(b)),
        other => other,
    };
    h
}

/// Ends and middle of every range, one variable at a time and in the corners.
fn candidates(problem: &Problem) -> Vec<Condition> {
    let machine = &problem.study.model.machine;
    let base = problem.data.rows[problem.data.rows.len() / 2].condition.si().to_vec();
    let ranged: Vec<(usize, (f64, f64))> =
        machine.variables.iter().enumerate().filter_map(|(v, variable)| variable.range.map(|r| (v, r))).collect();
    let mut found: Vec<Vec<f64>> = vec![base.clone()];
    for corner in 0..1usize << ranged.len().min(5) {
        let mut c = base.clone();
        for (i, (v, (low, high))) in ranged.iter().take(5).enumerate() {
            c[*v] = if corner >> i & 1 == 0 { *low } else { *high };
        }
        found.push(c);
    }
    for (v, (low, high)) in &ranged {
        for value in [*low, *high] {
            let mut c = base.clone();
            c[*v] = value;
            found.push(c);
        }
    }
    let mut seen: Vec<Vec<f64>> = Vec::new();
    found.retain(|c| {
        !seen.contains(c) && {
            seen.push(c.clone());
            true
        }
    });
    found.truncate(CONDITIONS);
    found.into_iter().map(Condition::from_si).collect()
}
