//! Steady tests at conditions within the machine's ranges, from slopes.

use super::outlook::{Outlook, all_sensors, moved, open_causes};
use super::worth::Stakes;
use crate::describe::machine::Condition;
use crate::error::Result;
use crate::evidence::diagnose::view::open_factors;
use crate::evidence::diagnose::{Explanation, Hypothesis, Problem, Scales, signatures};

/// Most conditions that are tried.
const CONDITIONS: usize = 40;
/// Variables whose ranges' corners are tried.
const CORNERED: usize = 4;

/// What steady tests would show, at each condition, and what rests on them.
pub(super) struct SteadyTests {
    /// Conditions that can be run.
    pub conditions: Vec<Condition>,
    /// What each would show, one reading per sensor of the machine.
    pub outlooks: Vec<Outlook>,
    /// Predictions over all of them.
    pub stakes: Stakes,
}

/// Steady tests over the ranges of a machine's variables; `None` where none can be run.
///
/// # Errors
/// As [`signatures`].
pub(super) fn steady(problem: &Problem, alive: &[&Explanation], scales: &Scales) -> Result<Option<SteadyTests>> {
    let machine = &problem.study.model.machine;
    let mut conditions = candidates(problem);
    // Some cannot be run: water out of its range, no flow where heat needs it.
    conditions.retain(|c| problem.study.model.solver(c).is_ok());
    if conditions.is_empty() {
        return Ok(None);
    }
    let rows = conditions.iter().enumerate().map(|(i, c)| (format!("candidate {i}"), None, c.clone()));
    let data = all_sensors(problem, rows);
    let parts = alive.iter().flat_map(|e| &e.causes);
    let mut wanted: Vec<Hypothesis> = parts.map(|p| moved(p.hypothesis.clone(), problem)).collect();
    let (own, causes) = (wanted.len(), open_causes(problem, &data));
    wanted.extend(causes.iter().cloned());
    let found = signatures(&problem.study, &data, problem.start, &[], &wanted, scales, &problem.user)?;
    let (columns, factors) = found.columns.split_at(own);
    let factors = open_factors(&problem.discrepancy, &causes, factors, data.count());
    let (mut shown, mut open, mut columns) = (Vec::new(), Vec::new(), columns.iter());
    for e in alive {
        let (mut sum, mut own) = (vec![0.0; data.count()], Vec::new());
        for (part, column) in e.causes.iter().zip(columns.by_ref()) {
            sum.iter_mut().zip(column).for_each(|(s, v)| *s += part.amplitude * v);
            own.push(column.iter().map(|v| part.deviation * v).collect::<Vec<f64>>());
        }
        shown.push(sum);
        open.push(own);
    }
    let stakes = Stakes::new(machine, &conditions, &found.prediction.values, &shown, &open, &problem.data.sensors);
    let (sensors, deviation) = (data.sensors.len(), deviations(problem));
    let outlook = |(c, condition): (usize, &Condition)| -> Outlook {
        let range = c * sensors..(c + 1) * sensors;
        let part = |v: &Vec<f64>| v[range.clone()].to_vec();
        let slopes = &found.prediction.conditions[range.clone()];
        let errors = problem.uncertainty.at(condition);
        let of_condition = errors.iter().enumerate().map(|(v, e)| slopes.iter().map(|row| row[v] * e).collect());
        Outlook {
            shown: shown.iter().map(part).collect(),
            open: open.iter().map(|columns| columns.iter().map(part).collect()).collect(),
            deviation: deviation.clone(),
            common: of_condition.chain(factors.iter().map(part)).collect(),
        }
    };
    let outlooks = conditions.iter().enumerate().map(outlook).collect();
    Ok(Some(SteadyTests { outlooks, stakes, conditions }))
}

/// Standard deviation of a reading of each of the machine's sensors: noise, its own error, and what every model leaves open, K.
fn deviations(problem: &Problem) -> Vec<f64> {
    let of = |s: usize| {
        let k = problem.data.sensors.iter().position(|own| *own == s).unwrap_or(0);
        problem.uncertainty.noise[k].hypot(problem.uncertainty.bias[k]).hypot(problem.discrepancy.model)
    };
    (0..problem.study.model.machine.sensors.len()).map(of).collect()
}

/// The middle of the data; half the corners of the first few ranges, such that no two of them differ in one variable alone; and both ends
/// of every range, one variable at a time.
pub fn candidates(problem: &Problem) -> Vec<Condition> {
    let machine = &problem.study.model.machine;
    let base = problem.data.rows[problem.data.rows.len() / 2].condition.si().to_vec();
    let ranged: Vec<(usize, (f64, f64))> =
        machine.variables.iter().enumerate().filter_map(|(v, variable)| variable.range.map(|r| (v, r))).collect();
    let mut found: Vec<Vec<f64>> = vec![base.clone()];
    let cornered = ranged.len().min(CORNERED);
    for corner in (0..1usize << cornered).filter(|corner| corner.count_ones() % 2 == 0 || cornered < 3) {
        let mut c = base.clone();
        for (i, (v, (low, high))) in ranged.iter().take(cornered).enumerate() {
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
