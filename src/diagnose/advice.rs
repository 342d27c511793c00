//! What to measure next: the condition and the sensors that set the surviving explanations furthest apart.

use rayon::prelude::*;

use super::catalogue::Scales;
use super::signature::signatures;
use super::{Explanation, Hypothesis, Problem};
use crate::error::Result;
use crate::machine::Condition;
use crate::measure::{Data, Row, Whitener};

/// Most explanations that are told apart.
const MOST: usize = 6;
/// Most conditions that are tried.
const CONDITIONS: usize = 40;

/// A steady test worth making.
#[derive(Debug, Clone, PartialEq)]
pub struct Next {
    /// The condition.
    pub condition: Condition,
    /// Distance of the two explanations it tells apart least, in standard deviations, over all sensors of the data.
    pub separation: f64,
    /// The probability-weighted mean distance.
    pub mean: f64,
    /// A sensor of the machine that the data lack and that would add most there, with the distance it alone gives.
    pub sensor: Option<(String, f64)>,
}

/// Ranks feasible conditions; empty where fewer than two explanations survive.
///
/// # Errors
/// As [`signatures`].
pub fn next(problem: &Problem, explanations: &[&Explanation], scales: &Scales) -> Result<Vec<Next>> {
    let alive: Vec<&Explanation> =
        explanations.iter().copied().take(MOST).filter(|e| e.parts.iter().all(|p| p.deviation.is_finite())).collect();
    if alive.len() < 2 {
        return Ok(Vec::new());
    }
    let machine = &problem.study.model.machine;
    let sensors: Vec<usize> = (0..machine.sensors.len()).collect();
    let mut conditions = candidates(problem);
    // Some cannot be run: water out of its range, no flow where heat needs it.
    conditions.retain(|c| problem.study.model.solver(c).is_ok());
    if conditions.is_empty() {
        return Ok(Vec::new());
    }
    let rows = conditions.iter().enumerate().map(|(i, c)| Row {
        test: format!("candidate {i}"),
        time: None,
        condition: c.clone(),
        readings: vec![Some(300.0); sensors.len()],
        line: None,
    });
    let names = machine.sensors.iter().map(|s| s.name.clone()).collect();
    let data = Data { source: String::new(), sensors: sensors.clone(), names, rows: rows.collect(), notes: Vec::new() };
    let hypotheses: Vec<Hypothesis> =
        alive.iter().flat_map(|e| e.parts.iter().map(|p| p.hypothesis.clone())).map(|h| moved(h, problem, &data)).collect();
    let found = signatures(&problem.study, &data, problem.start, &[], &hypotheses, scales, &problem.user)?;
    let n = sensors.len();
    let deviation: Vec<f64> = sensors
        .iter()
        .map(|s| {
            let k = problem.data.sensors.iter().position(|own| own == s).unwrap_or(0);
            problem.uncertainty.noise[k].hypot(problem.uncertainty.bias[k]).hypot(problem.openness.model)
        })
        .collect();
    let rate = |c: usize| -> Next {
        let range = c * n..(c + 1) * n;
        let mut next = 0;
        let shifts: Vec<Vec<f64>> = alive
            .iter()
            .map(|e| {
                let mut sum = vec![0.0; n];
                for part in &e.parts {
                    sum.iter_mut().zip(&found.columns[next][range.clone()]).for_each(|(s, v)| *s += part.amplitude * v);
                    next += 1;
                }
                sum
            })
            .collect();
        let errors = problem.uncertainty.at(&conditions[c]);
        let common = |which: &[usize]| -> Vec<Vec<f64>> {
            errors.iter().enumerate().map(|(v, e)| which.iter().map(|k| found.prediction.conditions[c * n + k][v] * e).collect()).collect()
        };
        let distance = |which: &[usize], a: &[f64], b: &[f64]| -> f64 {
            let whitener = Whitener::new(&which.iter().map(|k| deviation[*k]).collect::<Vec<_>>(), &common(which));
            whitener.apply(&which.iter().map(|k| a[*k] - b[*k]).collect::<Vec<_>>()).iter().map(|v| v * v).sum::<f64>().sqrt()
        };
        let own: Vec<usize> = problem.data.sensors.clone();
        let (mut least, mut sum, mut weight) = (f64::INFINITY, 0.0, 0.0);
        for i in 0..alive.len() {
            for j in i + 1..alive.len() {
                let d = distance(&own, &shifts[i], &shifts[j]);
                let w = alive[i].probability * alive[j].probability;
                least = least.min(d);
                sum += w * d;
                weight += w;
            }
        }
        let extra = sensors.iter().filter(|s| !own.contains(s)).map(|s| (distance(&[*s], &shifts[0], &shifts[1]), *s));
        let sensor = extra.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(d, _)| *d > 0.5).map(|(d, s)| (machine.sensors[s].name.clone(), d));
        Next { condition: conditions[c].clone(), separation: least, mean: if weight > 0.0 { sum / weight } else { 0.0 }, sensor }
    };
    let mut rated: Vec<Next> = (0..conditions.len()).into_par_iter().map(rate).collect();
    rated.sort_by(|a, b| b.mean.total_cmp(&a.mean));
    rated.truncate(3);
    Ok(rated)
}

/// A sensor's own error refers to the columns of the data; here all of the machine's sensors are columns.
fn moved(mut h: Hypothesis, problem: &Problem, data: &Data) -> Hypothesis {
    use super::Act;
    let to = |k: usize| data.sensors.iter().position(|s| *s == problem.data.sensors[k]).unwrap_or(0);
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
    found.dedup();
    found.truncate(CONDITIONS);
    found.into_iter().map(Condition::from_si).collect()
}
