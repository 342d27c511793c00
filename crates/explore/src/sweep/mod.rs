//! Design of experiments: the conditions to run, on every core, never twice.
//!
//! ```text
//! sweep file -> Definition -> (with the machine's variables) Plan -> execute -> Table
//!                                                                       |
//!                                                   journal: finished conditions, safe on disk
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

pub use adaptive::{ADDED, Growth};
pub use definition::{Definition, FitKeys, Openness};
pub use plan::{Group, Plan, Purpose};
pub use reduced_answers::{Answered, BOUNDS};
pub use runner::{SweepOptions, run};
pub use target::scope_of;
pub use uncertain::Open;

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::external::Class;
use crate::numerics;
use coldplate_base::error::{Error, Result};
use coldplate_tables::{Column, Table, TextColumn};
use journal::{Header, Journal, Outcome};

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
pub struct Subject {
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

impl Subject {
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
pub fn slope_name(output: &str, parameter: &str) -> String {
    format!("d({output})/d({parameter})")
}

/// A condition that gave no result.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Row of the [`Plan`].
    pub row: usize,
    /// Name of the group of the condition.
    pub group: String,
    /// Reason of the failure.
    pub reason: String,
}

/// State of a growing sweep after a round.
#[derive(Debug)]
pub struct Round<'a> {
    /// Conditions of the sweep, added ones included.
    pub plan: &'a Plan,
    /// The solved conditions to be fitted.
    pub table: Table,
    /// The row of the plan of each row of the table.
    pub rows: Vec<usize>,
}

/// Function that gives the conditions to add after a round, one value per variable in its own unit; `None` ends the sweep. The
/// conditions must depend on nothing but the round and those before.
pub type Grow<'g> = dyn FnMut(&Round<'_>) -> Result<Option<Vec<Vec<f64>>>> + 'g;

/// Function that completes some rows of a plan, of so many values each, in a journal.
type Find<'f> = dyn Fn(&Plan, Range<usize>, usize, &mut Journal) -> Result<()> + 'f;

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
    pub answered: Option<Answered>,
    /// Conditions without a result; they are in neither table.
    pub failures: Vec<Failure>,
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
/// the order of [`Subject::outputs`], then their slopes, output by output (anything finite if [`Plan::is_sloped`] wants none);
/// see [`run`] for further demands on it.
///
/// # Errors
/// The folder or the journal cannot be written, the journal is that of another sweep, or every condition failed.
pub fn execute(
    plan: &Plan,
    subject: &Subject,
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
    subject: &Subject,
    folder: &Path,
    options: SweepOptions<'_>,
    solve: impl Fn(&Plan, usize) -> Result<Vec<f64>> + Sync,
    grow: &mut Grow<'_>,
) -> Result<Swept> {
    let find = |plan: &Plan, rows: Range<usize>, width: usize, journal: &mut Journal| {
        run(rows, width, journal, options, |row| solve(plan, row)).map(drop)
    };
    execute_by(plan, subject, folder, &find, grow)
}

/// [`execute_growing`] with `find` in the place of a solver of single conditions.
fn execute_by(plan: &Plan, subject: &Subject, folder: &Path, find: &Find<'_>, grow: &mut Grow<'_>) -> Result<Swept> {
    std::fs::create_dir_all(folder).map_err(|e| Error::file("make", folder, e).at_key("--out"))?;
    let slopes = subject.slopes();
    let header = header(plan, subject);
    let width = header.outputs.len();
    let mut journal = Journal::open(&folder.join(JOURNAL), &header)?;
    let resumed = journal.outcomes().iter().flatten().count();
    let mut grown = plan.clone();
    let (mut first, mut batches) = (0, 0);
    let outcomes = loop {
        let end = grown.conditions.len();
        find(&grown, first..end, width, &mut journal)?;
        let outcomes = journal.held(end)?;
        let is_solved = |outcome: &Outcome| matches!(outcome, Outcome::Values(_));
        if grown.growth.is_none() || !outcomes.iter().any(is_solved) {
            break outcomes;
        }
        let is_of = |row: &usize| is_solved(&outcomes[*row]) && grown.group_of(*row).is_some_and(|g| g.purpose == Purpose::Fit);
        let round =
            Round { plan: &grown, table: results(&grown, subject, &outcomes, Purpose::Fit), rows: (0..end).filter(is_of).collect() };
        let asked = match grow(&round) {
            Ok(asked) => asked,
            Err(error) => {
                // The failures may be the reason that the sweep cannot go on: they are written in any case.
                write_failures(&grown, subject, &failures_of(&grown, &outcomes), folder, &mut Vec::new())?;
                return Err(error);
            }
        };
        let added = match (journal.added(batches), asked) {
            (Some(known), _) => known,
            (None, Some(asked)) => {
                journal.add(&asked)?;
                asked
            }
            (None, None) => break outcomes,
        };
        (first, batches) = (end, batches + 1);
        grown.grow(added);
    };
    let plan = &grown;

    let failures = failures_of(plan, &outcomes);
    let mut files = Vec::new();
    write_failures(plan, subject, &failures, folder, &mut files)?;
    if let Some(first) = failures.first().filter(|_| failures.len() == outcomes.len()) {
        let help = match subject.by {
            SolvedBy::Mesh(_) => "solve one of them with `coldplate solve`; the reasons of all are in this file",
            SolvedBy::Program { .. } => "run the command by hand in the folder that the reason names; the reasons of all are in this file",
        };
        return Err(Error::numerics(format!("every condition failed, the first because: {}", first.reason))
            .in_file(folder.join("failures.csv"))
            .help(help));
    }
    let table = results(plan, subject, &outcomes, Purpose::Fit);
    let of = |purpose: Purpose| plan.groups.iter().any(|g| g.purpose == purpose).then(|| results(plan, subject, &outcomes, purpose));
    let (validation, followed) = (of(Purpose::Validation), of(Purpose::Follow));
    let slopes = match slopes.is_empty() {
        true => None,
        false => {
            let mut origin = provenance(plan, subject, Purpose::Fit);
            origin.push(subject.open.note(&subject.outputs, &plan.variables)?);
            Some(tabulated(plan, &outcomes, |row| plan.is_sloped(row), subject.outputs.len(), &slopes, origin))
        }
    };
    let (bounds, answered) = reduced_answers::told(plan, subject, &outcomes).unzip();
    let tables = [
        ("sweep", Some(&table)),
        ("slopes", slopes.as_ref()),
        ("validation", validation.as_ref()),
        ("followed", followed.as_ref()),
        ("bounds", bounds.as_ref()),
    ];
    for (name, table) in tables {
        for extension in ["csv", "parquet"] {
            let path = folder.join(name).with_extension(extension);
            match table {
                None => remove_stale(&path)?,
                Some(table) => {
                    if extension == "csv" {
                        table.write_csv(&path)?
                    } else {
                        table.write_parquet(&path)?
                    }
                    files.push(path);
                }
            }
        }
    }
    let plan = plan.clone();
    Ok(Swept {
        plan,
        table,
        validation,
        followed,
        slopes,
        bounds,
        answered,
        failures,
        resumed,
        damaged_lines: journal.damaged_lines().to_vec(),
        notes: Vec::new(),
        files,
    })
}

/// The first line of the journals of a sweep.
fn header(plan: &Plan, subject: &Subject) -> Header {
    let slopes = subject.slopes();
    let bounds = reduced_answers::names(plan, subject);
    let outputs: Vec<String> =
        subject.outputs.iter().chain(&slopes).chain(&bounds).map(|(name, unit)| format!("{name} [{unit}]")).collect();
    let mut deciding = identity(plan, subject);
    deciding.push(("numerics of the program".into(), numerics()));
    Header { identity: deciding, outputs, conditions: plan.conditions.len() }
}

fn failures_of(plan: &Plan, outcomes: &[Outcome]) -> Vec<Failure> {
    let group_of = |row: usize| plan.group_of(row).map_or(String::new(), |g| g.name.clone());
    let failure = |(row, outcome): (usize, &Outcome)| match outcome {
        Outcome::Failed(reason) => Some(Failure { row, group: group_of(row), reason: reason.clone() }),
        Outcome::Values(_) => None,
    };
    outcomes.iter().enumerate().filter_map(failure).collect()
}

/// Identity of the results: everything that they depend on.
fn identity(plan: &Plan, subject: &Subject) -> Vec<(String, String)> {
    let (hashed, by) = match &subject.by {
        SolvedBy::Mesh(mesh) => ("machine hash", ("mesh", mesh.clone())),
        SolvedBy::Program { name, .. } => ("solver hash", ("solver", name.clone())),
    };
    let pairs =
        [("program", format!("coldplate {}", env!("CARGO_PKG_VERSION"))), (hashed, subject.hash.clone()), by, ("design hash", plan.hash())];
    let mut pairs = pairs.map(|(key, value)| (key.to_string(), value)).to_vec();
    let answers = |accuracy: f64| ("answers".into(), format!("by a reduced model where its bounds are within {accuracy} K, else in full"));
    pairs.extend(plan.accuracy.map(answers));
    pairs
}

/// Origin of the results of a sweep: no date and no path, so that the same sweep gives the same bytes.
pub fn provenance(plan: &Plan, subject: &Subject, purpose: Purpose) -> Vec<(String, String)> {
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
fn results(plan: &Plan, subject: &Subject, outcomes: &[Outcome], purpose: Purpose) -> Table {
    let is_of = |row: usize| plan.group_of(row).is_some_and(|g| g.purpose == purpose);
    let mut table = tabulated(plan, outcomes, is_of, 0, &subject.outputs, provenance(plan, subject, purpose));
    reduced_answers::mark(&mut table, plan, subject, outcomes, is_of);
    table
}

/// Table of the values from index `first` on, under some names and units, at the rows that were solved and are wanted.
fn tabulated(
    plan: &Plan,
    outcomes: &[Outcome],
    is_wanted: impl Fn(usize) -> bool,
    first: usize,
    names: &[(String, String)],
    provenance: Vec<(String, String)>,
) -> Table {
    let mut rows = Vec::new();
    let mut values: Vec<&[f64]> = Vec::new();
    let mut groups = Vec::new();
    for (row, outcome) in outcomes.iter().enumerate() {
        if let (Some(group), Outcome::Values(v)) = (plan.group_of(row).filter(|_| is_wanted(row)), outcome) {
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

/// Key of the provenance of a table whose outputs are no results.
pub const RECOVERED: &str = "recovered";

/// Writes the values in place of missing results, if the sweep file states any.
fn write_recovered(plan: &Plan, subject: &Subject, failures: &[Failure], folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
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
    let text = |name: &str, value: fn(&Failure) -> String| TextColumn { name: name.into(), values: failures.iter().map(value).collect() };
    let class = |f: &Failure| Class::of(&f.reason).map_or(f.reason.clone(), |class| class.words().into());
    let texts = vec![text("group", |f| f.group.clone()), text(RECOVERED, class)];
    let mut provenance = provenance(plan, subject, Purpose::Fit);
    provenance.push((RECOVERED.into(), "values that the sweep file states in place of failed conditions; these are no results".into()));
    Table { texts, columns, inputs: plan.variables.len(), provenance }.write_csv(&path)?;
    files.push(path);
    Ok(())
}

fn write_failures(plan: &Plan, subject: &Subject, failures: &[Failure], folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    write_recovered(plan, subject, failures, folder, files)?;
    let path = folder.join("failures.csv");
    if failures.is_empty() {
        return remove_stale(&path);
    }
    let rows: Vec<usize> = failures.iter().map(|f| f.row).collect();
    let text = |name: &str, value: fn(&Failure) -> String| TextColumn { name: name.into(), values: failures.iter().map(value).collect() };
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
