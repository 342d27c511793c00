//! A sweep as outside programs read it: each field is a key of `coldplate sweep --json`.

use serde::Serialize;

use super::sweep_file::Sweep;
use super::{FailedCondition, ReducedRows, Swept};
use crate::external::{Class, Program};

/// Result of a sweep.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs)]
pub struct SweepRecord {
    pub conditions: usize,
    /// Conditions that the journal held already.
    pub resumed: usize,
    pub failed: usize,
    pub groups: Vec<GroupRecord>,
    pub failures: Vec<FailureRecord>,
    /// Doubts about the conditions solved now.
    pub notes: Vec<String>,
    pub files: Vec<String>,
    /// Cells of the machine; none if another program solves.
    pub cells: Option<usize>,
    /// Name and version of another program that solves; left out for our own solver.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub solver: Option<String>,
    /// Number of conditions that a reduced model answered, if the sweep file asks for an accuracy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub answered: Option<ReducedRows>,
    pub seconds: f64,
}

/// One design of the sweep file.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct GroupRecord {
    pub name: String,
    pub design: String,
    pub conditions: usize,
}

/// A condition without a result.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct FailureRecord {
    /// Number of the condition from 1, in the order of the design.
    pub row: usize,
    pub group: String,
    pub reason: String,
    /// Class of the failure of another program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub class: Option<Class>,
}

impl Swept {
    /// The results of `sweep` for other programs; `seconds` is the time that the sweep took.
    pub fn record(&self, sweep: &Sweep, seconds: f64) -> SweepRecord {
        let failure = |f: &FailedCondition| FailureRecord {
            row: f.row + 1,
            group: f.group.clone(),
            reason: f.reason.clone(),
            class: Class::of(&f.reason),
        };
        let groups = self.plan.groups.iter();
        SweepRecord {
            conditions: self.plan.conditions.len(),
            resumed: self.resumed,
            failed: self.failures.len(),
            groups: groups.map(|g| GroupRecord { name: g.name.clone(), design: g.description.clone(), conditions: g.rows.len() }).collect(),
            failures: self.failures.iter().map(failure).collect(),
            notes: self.notes.clone(),
            files: self.files.iter().map(|f| f.display().to_string()).collect(),
            cells: sweep.study().map(|study| study.model.mesh.cells),
            solver: sweep.program().map(Program::called),
            answered: self.answered.clone(),
            seconds,
        }
    }
}
