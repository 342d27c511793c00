//! Sweeps that are solved in full only at conditions that a reduced model does not answer well enough. The model is made of
//! conditions of the sweep itself. Beside its readings each condition has a bound on every reading: zero for a full solution.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use serde::Serialize;

use super::journal::{ConditionOutcome, Journal};
use super::mesh_errors::remarks;
use super::own_solver::Own;
use super::runner::{Pieces, run_rows};
use super::{Plan, Purpose, SweepOptions, SweepSubject, Swept, execute_by, provenance, tabulated, width};
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_base::progress::Silent;
use coldplate_describe::machine::Condition;
use coldplate_reduce::{Asked, Guess, Guesses, ReducedAnswer, answers};
use coldplate_tables::{Table, TextColumn};

/// Key of the provenance of a table some of whose rows a reduced model answered: the largest bound of each output.
pub const BOUNDS: &str = "bounds";

/// Number of conditions that a reduced model answered; each field is a key under `answered` of `coldplate sweep --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct ReducedRows {
    /// Accuracy that the sweep file asks for, K.
    #[serde(rename = "accuracy_K")]
    pub accuracy: f64,
    pub in_full: usize,
    pub by_reduced_model: usize,
    /// Largest bound on any reading, K.
    #[serde(rename = "largest_bound_K")]
    pub largest_bound: f64,
}

impl ReducedRows {
    /// The numbers in a sentence.
    pub fn sentence(&self) -> String {
        format!(
            "{} solved in full, {} answered by a reduced model, the largest bound {} K (accuracy {} K)",
            self.in_full,
            self.by_reduced_model,
            significant(self.largest_bound, 2),
            self.accuracy
        )
    }
}

/// Runs a sweep as [`super::execute`] does, with a reduced model in place of full solutions where it is accurate enough.
///
/// # Errors
/// Errors of [`super::execute`].
pub(super) fn execute(
    own: &Own<'_>,
    plan: &Plan,
    subject: &SweepSubject,
    folder: &Path,
    options: SweepOptions<'_>,
    accuracy: f64,
) -> Result<Swept> {
    let width = width(plan, subject);
    let find = |plan: &Plan, _, journal: &mut Journal| fill(own, plan, width, journal, options, accuracy);
    let remark = |plan: &Plan, outcomes: &[ConditionOutcome]| remarks(&own.study.model, subject, plan, outcomes);
    let mut swept = execute_by(plan, subject, folder, &find, &mut |_| Ok(None), &remark)?;
    swept.notes.extend(own.notes());
    Ok(swept)
}

/// Completes every condition in the journal.
fn fill(own: &Own<'_>, plan: &Plan, width: usize, journal: &mut Journal, options: SweepOptions<'_>, accuracy: f64) -> Result<()> {
    let count = plan.conditions.len();
    let sensors = own.study.model.machine.sensors.len();
    let solve = |row: usize, guess: Option<Guess>, keep: &dyn Fn(Vec<f64>)| {
        let state = own.state(plan, row, guess)?;
        let mut values = own.values(plan, row, &state)?;
        values.extend(std::iter::repeat_n(0.0, sensors));
        keep(state.solution.temperatures);
        Ok(values)
    };
    let is_solved = |outcome: &Option<ConditionOutcome>| matches!(outcome, Some(ConditionOutcome::Values(_)));
    let is_done = |outcome: &Option<ConditionOutcome>| is_solved(outcome) || outcome.is_some() && !options.retry_failed;
    if !journal.outcomes().iter().all(is_done) {
        let mut in_full = |rows: &[usize], guess: &Guesses<'_>| -> Result<Vec<Option<Vec<f64>>>> {
            let fields: Mutex<HashMap<usize, Vec<f64>>> = Mutex::default();
            let keep = |row: usize, field| drop(fields.lock().unwrap_or_else(PoisonError::into_inner).insert(row, field));
            let mut sorted = rows.to_vec();
            sorted.sort_unstable();
            run_rows(&sorted, Pieces { total: sorted.len(), name: "conditions in full" }, width, journal, options, |row| {
                solve(row, guess(row), &|field| keep(row, field))
            })?;
            let mut fields = fields.into_inner().unwrap_or_else(PoisonError::into_inner);
            // The journal holds readings, not fields: a condition of the basis that an earlier run solved is solved again, to
            // the same field.
            let lacks = |row: &&usize| is_solved(&journal.outcomes()[**row]) && !fields.contains_key(row);
            let lacking: Vec<usize> = rows.iter().filter(lacks).copied().collect();
            let again = |row: &usize| Some((*row, own.state(plan, *row, guess(*row)).ok()?.solution.temperatures));
            fields.extend(lacking.par_iter().filter_map(again).collect::<Vec<_>>());
            Ok(rows.iter().map(|row| fields.remove(row)).collect())
        };
        let conditions: Vec<Condition> = plan.conditions.iter().map(|si| Condition::from_si(si.clone())).collect();
        let asked = Asked { conditions: &conditions, in_full: &|row| own.is_sloped(plan, row), accuracy };
        let progress = options.progress.unwrap_or(&Silent);
        let found = answers(own.study, &own.reference, own.center()?, &asked, &mut in_full, progress)?;
        let held = journal.outcomes();
        let new =
            found.iter().enumerate().filter(|(row, _)| !is_done(&held[*row])).filter_map(|(row, answer)| Some((row, answer.as_ref()?)));
        let new: Vec<(usize, ConditionOutcome)> =
            new.map(|(row, answer)| (row, ConditionOutcome::Values(values_of(own, answer)))).collect();
        journal.absorb(new)?;
    }
    run_rows(&(0..count).collect::<Vec<_>>(), Pieces { total: count, name: "conditions" }, width, journal, options, |row| {
        solve(row, None, &|_| ())
    })
}

/// Values of an answer in the order of the journal: readings as they are shown, zeros for slopes, bounds.
fn values_of(own: &Own<'_>, answer: &ReducedAnswer) -> Vec<f64> {
    own.count_boiling(answer.boiling.iter().copied());
    let measurands = &own.study.model.network.measurands;
    let shown = measurands.iter().zip(&answer.readings).map(|(measurand, reading)| measurand.shown(*reading));
    let slopes = std::iter::repeat_n(0.0, own.open.parameters.len() * answer.readings.len());
    shown.chain(slopes).chain(answer.bounds.iter().copied()).collect()
}

/// Name and unit of every output's bound.
pub(super) fn names(plan: &Plan, subject: &SweepSubject) -> Vec<(String, String)> {
    let unit = |unit: &str| if unit == "degC" { "K".to_string() } else { unit.to_string() };
    let all = if plan.accuracy.is_some() { &subject.outputs[..] } else { &[] };
    all.iter().map(|(name, own)| (format!("bound({name})"), unit(own))).collect()
}

/// Index of the first bound among the values of a condition.
fn place(subject: &SweepSubject) -> usize {
    subject.outputs.len() * (1 + subject.open.parameters.len())
}

/// Adds to every row of a table, those of `is_of`, the way it was answered and its largest bound, and to the table the largest
/// bound of each output.
pub(super) fn mark(table: &mut Table, plan: &Plan, subject: &SweepSubject, outcomes: &[ConditionOutcome], is_of: impl Fn(usize) -> bool) {
    if plan.accuracy.is_none() {
        return;
    }
    let mut outputs: BTreeMap<&str, f64> = subject.outputs.iter().map(|(name, _)| (name.as_str(), 0.0)).collect();
    let (mut answered, mut within) = (Vec::new(), Vec::new());
    for (_, outcome) in outcomes.iter().enumerate().filter(|(row, _)| is_of(*row)) {
        let ConditionOutcome::Values(values) = outcome else { continue };
        let bounds = &values[place(subject)..];
        let largest = bounds.iter().copied().fold(0.0, f64::max);
        answered.push(if largest > 0.0 { "by reduced model" } else { "in full" }.to_string());
        within.push(format!("{largest} K"));
        for ((name, _), bound) in subject.outputs.iter().zip(bounds) {
            outputs.entry(name).and_modify(|most| *most = most.max(*bound));
        }
    }
    table.texts.push(TextColumn { name: "answered".into(), values: answered });
    table.texts.push(TextColumn { name: "within".into(), values: within });
    table.provenance.push((BOUNDS.into(), serde_json::to_string(&outputs).unwrap_or_default()));
}

/// The bound of every reading, row by row, and the number of conditions that the reduced model answered.
pub(super) fn told(plan: &Plan, subject: &SweepSubject, outcomes: &[ConditionOutcome]) -> Option<(Table, ReducedRows)> {
    let accuracy = plan.accuracy?;
    let names = names(plan, subject);
    let table = tabulated(plan, outcomes, |_| true, place(subject), &names, provenance(plan, subject, Purpose::Fit));
    let largest = |row: usize| table.outputs().iter().map(|column| column.values[row]).fold(0.0, f64::max);
    let bounds: Vec<f64> = (0..table.rows()).map(largest).collect();
    let by_reduced_model = bounds.iter().filter(|bound| **bound > 0.0).count();
    let largest_bound = bounds.iter().copied().fold(0.0, f64::max);
    Some((table, ReducedRows { accuracy, in_full: bounds.len() - by_reduced_model, by_reduced_model, largest_bound }))
}
