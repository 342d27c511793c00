//! Steady tests at conditions within the machine's ranges.

use rayon::prelude::*;

use super::outlook::{Outlook, all_sensors, moved, open_causes};
use super::worth::Stakes;
use crate::stated::Stated;
use crate::view::open_factors;
use crate::{Cause, Explanation, Hypothesis, Predictor, Problem, signatures};
use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;

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
pub(super) fn steady(problem: &Problem, alive: &[&Explanation], predictor: &Predictor<'_>) -> Result<Option<SteadyTests>> {
    let machine = &problem.study.model.machine;
    let mut conditions = candidates(problem);
    // Some cannot be run: water out of its range, no flow where heat needs it.
    let model = &problem.study.model;
    let Some(solver) = conditions.iter().find_map(|c| model.solver(c).ok()) else { return Ok(None) };
    let runs: Vec<bool> = conditions.par_iter().map(|c| model.solve(&solver, c).is_ok()).collect();
    let mut runs = runs.into_iter();
    conditions.retain(|_| runs.next() == Some(true));
    if conditions.is_empty() {
        return Ok(None);
    }
    let rows = conditions.iter().enumerate().map(|(i, c)| (format!("candidate {i}"), None, c.clone()));
    let data = all_sensors(problem, rows);
    let parts = alive.iter().flat_map(|e| &e.causes);
    let mut wanted: Vec<Hypothesis> = parts.map(|p| moved(p.hypothesis.clone(), problem)).collect();
    let (own, causes) = (wanted.len(), open_causes(problem, &data));
    wanted.extend(causes.iter().cloned());
    let found = signatures(&problem.study, &data, problem.runs(), &[], &wanted, predictor.scales, &problem.user)?;
    let (columns, factors) = found.columns.split_at(own);
    let factors = open_factors(&problem.discrepancy, &Stated::of(problem, &problem.study), &causes, factors, data.count());
    let (values, fields) = (&found.prediction.values, &found.fields);
    let there = Predictor { data: &data, predicted: values, fields, ..*predictor };
    let first = |k: usize| alive[..k].iter().map(|e| e.causes.len()).sum::<usize>();
    let of = |k: usize| -> (Vec<f64>, Vec<Vec<f64>>) {
        let (causes, of_causes) = (&alive[k].causes, first(k)..first(k + 1));
        let changes = Changes { causes, hypotheses: &wanted[of_causes.clone()], slopes: &columns[of_causes] };
        changes.in_force(&there).unwrap_or_else(|_| changes.by_slopes(values.len()))
    };
    let (shown, open): (Vec<_>, Vec<_>) = (0..alive.len()).into_par_iter().map(of).unzip();
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

/// Causes of an explanation beside slopes of what they change.
struct Changes<'a> {
    causes: &'a [Cause],
    /// The same of a table of all of the machine's sensors.
    hypotheses: &'a [Hypothesis],
    /// K per unit.
    slopes: &'a [Vec<f64>],
}

impl Changes<'_> {
    /// What the causes change, K, and what each is open by: with all of them in force, since a film at a seventh of its value does less than
    /// its slope, and scale that leaves as much of it more.
    fn in_force(&self, there: &Predictor<'_>) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
        let with = |moved: Option<usize>| -> Result<Vec<f64>> {
            let amplitude = |(k, cause): (usize, &Cause)| cause.amplitude + if moved == Some(k) { cause.deviation } else { 0.0 };
            let amplitudes = self.causes.iter().enumerate().map(amplitude);
            there.predict(&self.hypotheses.iter().zip(amplitudes).collect::<Vec<_>>())
        };
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let shown = with(None)?;
        let open = (0..self.causes.len()).map(|k| Ok(apart(&with(Some(k))?, &shown))).collect::<Result<_>>()?;
        Ok((apart(&shown, there.predicted), open))
    }

    /// The same to first order, where the machine cannot be solved so.
    fn by_slopes(&self, readings: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
        let mut shown = vec![0.0; readings];
        let mut open = Vec::new();
        for (cause, slope) in self.causes.iter().zip(self.slopes) {
            shown.iter_mut().zip(slope).for_each(|(s, v)| *s += cause.amplitude * v);
            open.push(slope.iter().map(|v| cause.deviation * v).collect());
        }
        (shown, open)
    }
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
