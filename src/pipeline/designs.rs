//! What a sweep's tables give: a surrogate of its designs, and one table per one-factor sweep.

use super::figures::Comparison;
use super::fitting;
use crate::describe::machine::Machine;
use crate::error::Result;
use crate::explore::sweep::{Group, Plan, Purpose};
use crate::foundation::table::Table;
use crate::surrogate::fit::{Fit, FitOptions, file};

/// The surrogate of a sweep and how it compares.
#[derive(Debug)]
pub struct Fitted {
    /// The fit.
    pub fit: Fit,
    /// The surrogate file.
    pub bytes: Vec<u8>,
    /// Every condition of the sweep beside what the surrogate says there.
    pub comparison: Comparison,
}

/// Groups of one varied variable: the paper's one-factor sweeps.
pub fn is_one_factor(group: &Group) -> bool {
    group.purpose == Purpose::Fit && group.varied.len() == 1
}

/// Rows of `table` that belong to a group for which `keep` holds.
pub fn rows_of(table: &Table, plan: &Plan, keep: impl Fn(&Group) -> bool) -> Table {
    let names: Vec<&str> = plan.groups.iter().filter(|g| keep(g)).map(|g| g.name.as_str()).collect();
    match table.text("group") {
        Some(groups) => table.select(|row| names.contains(&groups.values[row].as_str())),
        None => table.clone(),
    }
}

/// A surrogate of everything that varies more than one variable at a time, if the sweep has such a design.
///
/// # Errors
/// As [`fitting::fit_table`].
pub fn fit_designs(plan: &Plan, machine: &Machine, table: &Table, validation: Option<&Table>) -> Result<Option<Fitted>> {
    if !plan.groups.iter().any(|g| g.purpose == Purpose::Fit && !is_one_factor(g)) {
        return Ok(None);
    }
    let table = rows_of(table, plan, |g| !is_one_factor(g));
    let fit = fitting::fit_table(&table, Some(machine), &FitOptions::default())?;
    let bytes = file::encode(&fit.surrogate)?;
    let mut comparison = Comparison::default();
    {
        let opened = file::open(&bytes)?;
        comparison.add(&opened, &table, false)?;
        if let Some(validation) = validation {
            comparison.add(&opened, validation, true)?;
        }
    }
    Ok(Some(Fitted { fit, bytes, comparison }))
}

/// The one-factor sweeps of a plan, each with its rows.
pub fn one_factor_tables<'a>(plan: &'a Plan, table: &Table) -> Vec<(&'a Group, Table)> {
    plan.groups.iter().filter(|g| is_one_factor(g)).map(|g| (g, rows_of(table, plan, |other| other.name == g.name))).collect()
}
