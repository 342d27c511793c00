//! What to measure next: the conditions, interventions and sensors that set the surviving explanations furthest apart.

use rayon::prelude::*;

use super::effects::Scales;
use super::outlook::{Outlook, all_sensors, moved, open_causes};
use super::refine::Predictor;
use super::trial::{ExtraSensor, Next, Trial, trials};
use super::view::open_factors;
use super::{Explanation, Hypothesis, Problem, Verdict, signatures};
use crate::describe::machine::Condition;
use crate::error::Result;

/// Most explanations that are told apart.
const MOST: usize = 6;
/// Most conditions that are tried.
const CONDITIONS: usize = 40;
/// Steady conditions, and interventions, that are proposed.
const PROPOSED: usize = 3;
/// Least distance worth a test, in standard deviations.
const TELLING: f64 = 1.0;

/// Ranks feasible tests, the most telling first; empty where fewer than two explanations survive, or no test tells them apart. Interventions are only proposed
/// where one of the explanations is right: they are solved with each in force.
///
/// # Errors
/// As [`signatures`].
pub(super) fn next(predictor: &Predictor<'_>, problem: &Problem, verdict: Verdict, explanations: &[&Explanation]) -> Result<Vec<Next>> {
    let is_finite = |e: &&Explanation| e.causes.iter().all(|p| p.deviation.is_finite());
    let alive: Vec<&Explanation> = explanations.iter().copied().take(MOST).filter(is_finite).collect();
    if alive.len() < 2 {
        return Ok(Vec::new());
    }
    let mut found = best(steady(problem, &alive, predictor.scales)?);
    if verdict == Verdict::CannotTell {
        found.extend(best(trials(predictor, problem, &alive)));
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
    let parts = alive.iter().flat_map(|e| &e.causes);
    let mut wanted: Vec<Hypothesis> = parts.map(|p| moved(p.hypothesis.clone(), problem)).collect();
    let (own, open) = (wanted.len(), open_causes(problem, &data));
    wanted.extend(open.iter().cloned());
    let found = signatures(&problem.study, &data, problem.start, &[], &wanted, scales, &problem.user)?;
    let (columns, factors) = found.columns.split_at(own);
    let factors = open_factors(&problem.discrepancy, &open, factors, data.count());
    let sensors = data.sensors.len();
    let deviation = deviations(problem);
    let probabilities: Vec<f64> = alive.iter().map(|e| e.probability).collect();
    let rate = |c: usize| -> Next {
        let range = c * sensors..(c + 1) * sensors;
        let mut columns = columns.iter().map(|column| &column[range.clone()]);
        let (mut shown, mut open) = (Vec::new(), Vec::new());
        for e in alive {
            let (mut sum, mut own) = (vec![0.0; sensors], Vec::new());
            for (part, column) in e.causes.iter().zip(columns.by_ref()) {
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
        let sensor = extra
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(d, _)| *d > 0.5)
            .map(|(separation, s)| ExtraSensor { name: machine.sensors[s].name.clone(), separation });
        Next { trial: Trial::Steady, condition: conditions[c].clone(), separation, mean, sensor }
    };
    Ok((0..conditions.len()).into_par_iter().map(rate).collect())
}

/// Standard deviation of a reading of each of the machine's sensors: noise, its own error, and what every model leaves open, K.
fn deviations(problem: &Problem) -> Vec<f64> {
    let of = |s: usize| {
        let k = problem.data.sensors.iter().position(|own| *own == s).unwrap_or(0);
        problem.uncertainty.noise[k].hypot(problem.uncertainty.bias[k]).hypot(problem.discrepancy.model)
    };
    (0..problem.study.model.machine.sensors.len()).map(of).collect()
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
