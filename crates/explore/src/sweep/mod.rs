//! Design of experiments: the conditions to run, on every core, never twice.
//!
//! ```text
//! sweep file -> SweepDefinition -> (with the machine's variables) Plan -> execute -> Table
//!                                                                            |
//!                                                        journal: finished conditions, safe on disk
//! ```
//!
//! [`execute`] knows nothing of machines: it gets a function from a condition to its outputs.

mod adaptive;
mod builder;
mod definition;
pub mod design;
pub mod journal;
mod lhs;
pub mod merge;
mod mesh_errors;
mod own_solver;
mod plan;
pub mod record;
mod reduced_answers;
pub mod runner;
pub mod shards;
mod sobol;
pub mod sweep_file;
mod target;
pub mod uncertain;

pub use adaptive::{ADDED, DesignGrowth};
pub use definition::{FitKeys, Openness, SweepDefinition};
pub use mesh_errors::MESH_ERRORS;
use mesh_errors::{Remark, Remarks};
pub use plan::{ConditionGroup, Plan, Purpose};
pub use reduced_answers::{BOUNDS, ReducedRows};
pub use runner::{SweepOptions, run};
pub use target::scope_of;
pub use uncertain::Open;

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::external::Class;
use crate::numerics;
use coldplate_base::error::{Error, Result};
use coldplate_base::roles;
use coldplate_tables::{Column, Table, TextColumn};
use journal::{ConditionOutcome, Header, Journal};

/// Name of the journal in the output folder.
pub const JOURNAL: &str = "sweep.journal";

/// Solver of the conditions.
#[derive(Debug, Clone, PartialEq)]
pub enum SolvedBy {
    /// Our own solver, with the mesh in a few words, for example its number of cells.
    Mesh(String),
    /// Another program.
    Program {
        /// Name and version of the program.
        name: String,
        /// Value in place of each output if a condition failed, for outputs with one in the sweep file.
        recover: Vec<Option<f64>>,
    },
}

/// Subject of a sweep: enough to tell whether results on disk belong to it.
#[derive(Debug, Clone)]
pub struct SweepSubject {
    /// Name of the machine.
    pub machine: String,
    /// Hash of the machine file with its changes.
    pub hash: String,
    /// Solver of the conditions.
    pub by: SolvedBy,
    /// Name and unit of each output.
    pub outputs: Vec<(String, String)>,
    /// Uncertain parameters of the machine; each output has a slope along each of them.
    pub open: Open,
}

impl SweepSubject {
    /// Name and unit of each slope: per output, its change with one standard deviation of each parameter.
    fn slopes(&self) -> Vec<(String, String)> {
        let of = |(output, unit): &(String, String)| -> Vec<(String, String)> {
            let unit = if unit == "degC" { "K" } else { unit };
            self.open.parameters.iter().map(|p| (slope_name(output, &p.name), unit.to_string())).collect()
        };
        self.outputs.iter().flat_map(of).collect()
    }
}

/// Name of the column of an output's slope along a parameter.
pub(crate) fn slope_name(output: &str, parameter: &str) -> String {
    format!("d({output})/d({parameter})")
}

/// A condition that gave no result.
#[derive(Debug, Clone, PartialEq)]
pub struct FailedCondition {
    /// Row of the [`Plan`].
    pub row: usize,
    /// Name of the group of the condition.
    pub group: String,
    /// Reason of the failure.
    pub reason: String,
}

/// State of a growing sweep after a round.
#[derive(Debug)]
pub struct SweepRound<'a> {
    /// Conditions of the sweep, added ones included.
    pub plan: &'a Plan,
    /// The solved conditions to be fitted.
    pub table: Table,
    /// The row of the plan of each row of the table.
    pub rows: Vec<usize>,
}

/// Function that gives the conditions to add after a round, one value per variable in its own unit; `None` ends the sweep. The
/// conditions must depend on nothing but the round and those before.
pub(crate) type Grow<'g> = dyn FnMut(&SweepRound<'_>) -> Result<Option<Vec<Vec<f64>>>> + 'g;

/// Function that completes some rows of a plan in a journal.
type Find<'f> = dyn Fn(&Plan, Range<usize>, &mut Journal) -> Result<()> + 'f;

/// The result of a sweep.
#[derive(Debug, Clone)]
pub struct Swept {
    /// The conditions that were run: those of the sweep file, and those added to them.
    pub plan: Plan,
    /// The conditions to be fitted, in the order of the design: a text column `group`, condition variables, outputs.
    pub table: Table,
    /// The held-out conditions, in the same columns, if the sweep has any.
    pub validation: Option<Table>,
    /// Outputs at conditions with held variables at other values, if the sweep file asks for them.
    pub followed: Option<Table>,
    /// The slopes of every output along all uncertain parameters, at the conditions to be fitted, if there are such parameters.
    pub slopes: Option<Table>,
    /// Bound on the distance of each reading from the full solution, row by row, if a reduced model answers conditions.
    pub bounds: Option<Table>,
    /// Number of conditions that the reduced model answered, and that were solved in full.
    pub answered: Option<ReducedRows>,
    /// Conditions without a result; they are in neither table.
    pub failures: Vec<FailedCondition>,
    /// Number of conditions that the journal held already.
    pub resumed: usize,
    /// Lines of the journal that were damaged; their conditions were run again.
    pub damaged_lines: Vec<usize>,
    /// Doubts about the conditions solved now, one sentence each.
    pub notes: Vec<String>,
    /// The files written.
    pub files: Vec<PathBuf>,
}

/// Runs the conditions of `plan` that the journal in `folder` does not hold. Writes `sweep.csv` and `sweep.parquet`, `slopes.*`
/// if the machine has uncertain parameters, `validation.*` if there are held-out conditions, and `failures.csv` if there are
/// failures.
///
/// `solve` takes a condition in SI, in the order of [`Plan::variables`]. The function returns the outputs in their units, in
/// the order of [`SweepSubject::outputs`], then their slopes, output by output (anything finite if [`Plan::is_sloped`] wants none);
/// see [`run`] for further demands on it.
///
/// # Errors
/// The folder or the journal cannot be written, the journal is that of another sweep, or every condition failed.
pub fn execute(
    plan: &Plan,
    subject: &SweepSubject,
    folder: &Path,
    options: SweepOptions<'_>,
    solve: impl Fn(&[f64]) -> Result<Vec<f64>> + Sync,
) -> Result<Swept> {
    execute_growing(plan, subject, folder, options, |plan, row| solve(&plan.conditions[row]), &mut |_| Ok(None))
}

/// Runs a design that grows, as [`execute`] does. After every round `grow` gives the conditions to add; `solve` gets the plan
/// as far as it has grown, and a row of it. Added conditions stand in the journal before they are solved, and a resumed sweep
/// takes them from there.
///
/// # Errors
/// Errors of [`execute`] and of `grow`.
pub fn execute_growing(
    plan: &Plan,
    subject: &SweepSubject,
    folder: &Path,
    options: SweepOptions<'_>,
    solve: impl Fn(&Plan, usize) -> Result<Vec<f64>> + Sync,
    grow: &mut Grow<'_>,
) -> Result<Swept> {
    execute_remarked(plan, subject, folder, options, solve, grow, &|_, _| Remarks::default())
}

/// [`execute_growing`] with remarks on the outcomes.
fn execute_remarked(
    plan: &Plan,
    subject: &SweepSubject,
    folder: &Path,
    options: SweepOptions<'_>,
    solve: impl Fn(&Plan, usize) -> Result<Vec<f64>> + Sync,
    grow: &mut Grow<'_>,
    remark: &Remark<'_>,
) -> Result<Swept> {
    let width = width(plan, subject);
    let find =
        |plan: &Plan, rows: Range<usize>, journal: &mut Journal| run(rows, width, journal, options, |row| solve(plan, row)).map(drop);
    execute_by(plan, subject, folder, &find, grow, remark)
}

/// [`execute_remarked`] with `find` in the place of a solver of single conditions.
fn execute_by(
    plan: &Plan,
    subject: &SweepSubject,
    folder: &Path,
    find: &Find<'_>,
    grow: &mut Grow<'_>,
    remark: &Remark<'_>,
) -> Result<Swept> {
    // Before the work: no table is to replace one that the sweep was read from.
    for (name, extension) in TABLES.iter().flat_map(|name| [(name, "csv"), (name, "parquet")]) {
        roles::may_write(&folder.join(name).with_extension(extension)).map_err(|e| e.at_key("--out"))?;
    }
    std::fs::create_dir_all(folder).map_err(|e| Error::file("make", folder, e).at_key("--out"))?;
    let mut journal = Journal::open(&folder.join(JOURNAL), &header(plan, subject))?;
    let resumed = journal.outcomes().iter().flatten().count();
    let (plan, outcomes) = completed(plan.clone(), subject, folder, &mut journal, find, grow)?;
    let failures = failures_of(&plan, &outcomes);
    let mut files = Vec::new();
    write_failures(&plan, subject, &failures, folder, &mut files)?;
    if let Some(first) = failures.first().filter(|_| failures.len() == outcomes.len()) {
        let help = match subject.by {
            SolvedBy::Mesh(_) => "solve one of them with `coldplate solve`; the reasons of all are in this file",
            SolvedBy::Program { .. } => "run the command by hand in the folder that the reason names; the reasons of all are in this file",
        };
        return Err(Error::numerics(format!("every condition failed, the first because: {}", first.reason))
            .in_file(folder.join("failures.csv"))
            .help(help));
    }
    let of = |purpose: Purpose| plan.groups.iter().any(|g| g.purpose == purpose).then(|| results(&plan, subject, &outcomes, purpose));
    let (bounds, answered) = reduced_answers::told(&plan, subject, &outcomes).unzip();
    let Remarks { provenance, notes } = remark(&plan, &outcomes);
    let mut swept = Swept {
        table: results(&plan, subject, &outcomes, Purpose::Fit),
        validation: of(Purpose::Validation),
        followed: of(Purpose::Follow),
        slopes: slopes(&plan, subject, &outcomes)?,
        bounds,
        answered,
        failures,
        resumed,
        damaged_lines: journal.damaged_lines().to_vec(),
        notes,
        files,
        plan,
    };
    swept.table.provenance.extend(provenance);
    swept.write_tables(folder)?;
    Ok(swept)
}

/// Completes the conditions of a plan in its journal, round by round as long as it grows. Returns the plan as far as it has
/// grown, and the outcome of each of its conditions.
fn completed(
    mut plan: Plan,
    subject: &SweepSubject,
    folder: &Path,
    journal: &mut Journal,
    find: &Find<'_>,
    grow: &mut Grow<'_>,
) -> Result<(Plan, Vec<ConditionOutcome>)> {
    let is_solved = |outcome: &ConditionOutcome| matches!(outcome, ConditionOutcome::Values(_));
    let (mut first, mut batches) = (0, 0);
    loop {
        let end = plan.conditions.len();
        find(&plan, first..end, journal)?;
        let outcomes = journal.held(end)?;
        if plan.growth.is_none() || !outcomes.iter().any(is_solved) {
            return Ok((plan, outcomes));
        }
        let is_of = |row: &usize| is_solved(&outcomes[*row]) && plan.group_of(*row).is_some_and(|g| g.purpose == Purpose::Fit);
        let table = results(&plan, subject, &outcomes, Purpose::Fit);
        let asked = match grow(&SweepRound { plan: &plan, table, rows: (0..end).filter(is_of).collect() }) {
            Ok(asked) => asked,
            Err(error) => {
                // The failures may be the reason that the sweep cannot go on: they are written in any case.
                write_failures(&plan, subject, &failures_of(&plan, &outcomes), folder, &mut Vec::new())?;
                return Err(error);
            }
        };
        let added = match (journal.added(batches), asked) {
            (Some(known), _) => known,
            (None, Some(asked)) => {
                journal.add(&asked)?;
                asked
            }
            (None, None) => return Ok((plan, outcomes)),
        };
        (first, batches) = (end, batches + 1);
        plan.grow(added);
    }
}

/// Tables that a sweep writes, without their endings.
const TABLES: [&str; 5] = ["sweep", "slopes", "validation", "followed", "bounds"];

impl Swept {
    /// Writes the tables, each as CSV and as Parquet, and removes those of an earlier run that this one does not have.
    fn write_tables(&mut self, folder: &Path) -> Result<()> {
        let tables = [Some(&self.table), self.slopes.as_ref(), self.validation.as_ref(), self.followed.as_ref(), self.bounds.as_ref()];
        for (name, table) in TABLES.iter().zip(tables) {
            for extension in ["csv", "parquet"] {
                let path = folder.join(name).with_extension(extension);
                let Some(table) = table else {
                    remove_stale(&path)?;
                    continue;
                };
                if extension == "csv" {
                    table.write_csv(&path)?
                } else {
                    table.write_parquet(&path)?
                }
                self.files.push(path);
            }
        }
        Ok(())
    }
}

/// Number of values of a condition: outputs, slopes and bounds.
fn width(plan: &Plan, subject: &SweepSubject) -> usize {
    subject.outputs.len() + subject.slopes().len() + reduced_answers::names(plan, subject).len()
}

/// Slopes of every output along all uncertain parameters, if there are such parameters.
fn slopes(plan: &Plan, subject: &SweepSubject, outcomes: &[ConditionOutcome]) -> Result<Option<Table>> {
    let names = subject.slopes();
    if names.is_empty() {
        return Ok(None);
    }
    let mut origin = provenance(plan, subject, Purpose::Fit);
    origin.push(subject.open.note(&subject.outputs, &plan.variables)?);
    Ok(Some(tabulated(plan, outcomes, |row| plan.is_sloped(row), subject.outputs.len(), &names, origin)))
}

/// The first line of the journals of a sweep.
fn header(plan: &Plan, subject: &SweepSubject) -> Header {
    let slopes = subject.slopes();
    let bounds = reduced_answers::names(plan, subject);
    let outputs: Vec<String> =
        subject.outputs.iter().chain(&slopes).chain(&bounds).map(|(name, unit)| format!("{name} [{unit}]")).collect();
    let mut deciding = identity(plan, subject);
    deciding.push(("numerics of the program".into(), numerics()));
    Header { identity: deciding, outputs, conditions: plan.conditions.len() }
}

fn failures_of(plan: &Plan, outcomes: &[ConditionOutcome]) -> Vec<FailedCondition> {
    let group_of = |row: usize| plan.group_of(row).map_or(String::new(), |g| g.name.clone());
    let failure = |(row, outcome): (usize, &ConditionOutcome)| match outcome {
        ConditionOutcome::Failed(reason) => Some(FailedCondition { row, group: group_of(row), reason: reason.clone() }),
        ConditionOutcome::Values(_) => None,
    };
    outcomes.iter().enumerate().filter_map(failure).collect()
}

/// Identity of the results: everything that they depend on.
fn identity(plan: &Plan, subject: &SweepSubject) -> Vec<(String, String)> {
    let (hashed, by) = match &subject.by {
        SolvedBy::Mesh(mesh) => (MACHINE_HASH, ("mesh", mesh.clone())),
        SolvedBy::Program { name, .. } => (SOLVER_HASH, ("solver", name.clone())),
    };
    let pairs =
        [("program", format!("coldplate {}", env!("CARGO_PKG_VERSION"))), (hashed, subject.hash.clone()), by, ("design hash", plan.hash())];
    let mut pairs = pairs.map(|(key, value)| (key.to_string(), value)).to_vec();
    let answers = |accuracy: f64| ("answers".into(), format!("by a reduced model where its bounds are within {accuracy} K, else in full"));
    pairs.extend(plan.accuracy.map(answers));
    pairs
}

/// Origin of the results of a sweep: no date and no path, so that the same sweep gives the same bytes.
pub fn provenance(plan: &Plan, subject: &SweepSubject, purpose: Purpose) -> Vec<(String, String)> {
    let mut pairs = vec![("sweep".to_string(), plan.name.clone()), ("machine".to_string(), subject.machine.clone())];
    pairs.extend(identity(plan, subject));
    for group in plan.groups.iter().filter(|g| g.purpose == purpose) {
        let varied: Vec<&str> = group.varied.iter().map(|v| plan.variables[*v].name.as_str()).collect();
        let degree = group.degree.map_or(String::new(), |degree| format!(", degree {degree}"));
        pairs.push((format!("group {}", group.name.replace(':', " ")), format!("{} of {}{degree}", group.description, varied.join(", "))));
    }
    pairs
}

/// Outputs at the rows of a purpose.
fn results(plan: &Plan, subject: &SweepSubject, outcomes: &[ConditionOutcome], purpose: Purpose) -> Table {
    let is_of = |row: usize| plan.group_of(row).is_some_and(|g| g.purpose == purpose);
    let mut table = tabulated(plan, outcomes, is_of, 0, &subject.outputs, provenance(plan, subject, purpose));
    reduced_answers::mark(&mut table, plan, subject, outcomes, is_of);
    table
}

/// Table of the values from index `first` on, under some names and units, at the rows that were solved and are wanted.
fn tabulated(
    plan: &Plan,
    outcomes: &[ConditionOutcome],
    is_wanted: impl Fn(usize) -> bool,
    first: usize,
    names: &[(String, String)],
    provenance: Vec<(String, String)>,
) -> Table {
    let mut rows = Vec::new();
    let mut values: Vec<&[f64]> = Vec::new();
    let mut groups = Vec::new();
    for (row, outcome) in outcomes.iter().enumerate() {
        if let (Some(group), ConditionOutcome::Values(v)) = (plan.group_of(row).filter(|_| is_wanted(row)), outcome) {
            rows.push(row);
            values.push(v);
            groups.push(group.name.clone());
        }
    }
    let mut columns = plan.columns(&rows);
    columns.extend(names.iter().enumerate().map(|(o, (name, unit))| Column {
        name: name.clone(),
        unit: unit.clone(),
        values: values.iter().map(|v| v[first + o]).collect(),
    }));
    let texts = vec![TextColumn { name: "group".into(), values: groups }];
    Table { texts, columns, inputs: plan.variables.len(), provenance }
}

/// Key of the provenance: hash of the machine that the outputs are those of.
pub const MACHINE_HASH: &str = "machine hash";
/// Key of the provenance: hash of the program, its files and its templates, that the outputs are by.
pub const SOLVER_HASH: &str = "solver hash";
/// Key of the provenance of a table whose outputs are no results.
pub const RECOVERED: &str = "recovered";

/// Writes the values in place of missing results, if the sweep file states any.
fn write_recovered(
    plan: &Plan,
    subject: &SweepSubject,
    failures: &[FailedCondition],
    folder: &Path,
    files: &mut Vec<PathBuf>,
) -> Result<()> {
    let path = folder.join("recovered.csv");
    let recover = match &subject.by {
        SolvedBy::Program { recover, .. } if !failures.is_empty() && recover.iter().any(Option::is_some) => recover,
        _ => return remove_stale(&path),
    };
    let rows: Vec<usize> = failures.iter().map(|f| f.row).collect();
    let mut columns = plan.columns(&rows);
    columns.extend(subject.outputs.iter().zip(recover).map(|((name, unit), value)| Column {
        name: name.clone(),
        unit: unit.clone(),
        values: vec![value.unwrap_or(f64::NAN); rows.len()],
    }));
    let text =
        |name: &str, value: fn(&FailedCondition) -> String| TextColumn { name: name.into(), values: failures.iter().map(value).collect() };
    let class = |f: &FailedCondition| Class::of(&f.reason).map_or(f.reason.clone(), |class| class.words().into());
    let texts = vec![text("group", |f| f.group.clone()), text(RECOVERED, class)];
    let mut provenance = provenance(plan, subject, Purpose::Fit);
    provenance.push((RECOVERED.into(), "values that the sweep file states in place of failed conditions; these are no results".into()));
    Table { texts, columns, inputs: plan.variables.len(), provenance }.write_csv(&path)?;
    files.push(path);
    Ok(())
}

fn write_failures(
    plan: &Plan,
    subject: &SweepSubject,
    failures: &[FailedCondition],
    folder: &Path,
    files: &mut Vec<PathBuf>,
) -> Result<()> {
    write_recovered(plan, subject, failures, folder, files)?;
    let path = folder.join("failures.csv");
    if failures.is_empty() {
        return remove_stale(&path);
    }
    let rows: Vec<usize> = failures.iter().map(|f| f.row).collect();
    let text =
        |name: &str, value: fn(&FailedCondition) -> String| TextColumn { name: name.into(), values: failures.iter().map(value).collect() };
    let texts = vec![text("group", |f| f.group.clone()), text("reason", |f| f.reason.clone())];
    let table =
        Table { texts, columns: plan.columns(&rows), inputs: plan.variables.len(), provenance: provenance(plan, subject, Purpose::Fit) };
    table.write_csv(&path)?;
    files.push(path);
    Ok(())
}

/// Removes a file of an earlier run that this run does not write.
fn remove_stale(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::file("remove", path, e)),
        _ => Ok(()),
    }
}
