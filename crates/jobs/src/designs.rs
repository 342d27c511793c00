//! Results from a sweep's tables: a surrogate of its designs, and one table per one-factor sweep.

use super::figures::TableComparison;
use super::fitting;
use coldplate_base::error::Result;
use coldplate_describe::machine::{DescribedVariable, Scope};
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{self, ConditionGroup, FitKeys, Plan, Purpose, Swept};
use coldplate_surrogate::fit::model::{HeldSpec, PointModel, PointSpec, PolynomialSpec, SurrogateSpec, Transform};
use coldplate_surrogate::fit::{self, FitOptions, SurrogateFit, file};
use coldplate_tables::Table;

/// The surrogate of a sweep and its comparison with the sweep.
#[derive(Debug)]
pub struct FittedDesigns {
    /// The fit.
    pub fit: SurrogateFit,
    /// The surrogate file.
    pub bytes: Vec<u8>,
    /// Every condition of the sweep beside the surrogate's prediction.
    pub comparison: TableComparison,
}

/// Groups of one varied variable: the paper's one-factor sweeps.
pub(crate) fn is_one_factor(group: &ConditionGroup) -> bool {
    group.purpose == Purpose::Fit && group.varied.len() == 1
}

/// Rows of `table` that belong to a group for which `keep` holds.
pub fn rows_of(table: &Table, plan: &Plan, keep: impl Fn(&ConditionGroup) -> bool) -> Table {
    let names: Vec<&str> = plan.groups.iter().filter(|g| keep(g)).map(|g| g.name.as_str()).collect();
    match table.text("group") {
        Some(groups) => table.select(|row| names.contains(&groups.values[row].as_str())),
        None => table.clone(),
    }
}

/// The tables of a sweep.
#[derive(Debug, Clone)]
pub(crate) struct DesignTables {
    /// Conditions to be fitted.
    pub fitted: Table,
    /// Held-out conditions, if there are any.
    pub validation: Option<Table>,
    /// Slopes along the uncertain parameters, at the conditions to be fitted, if there are any.
    pub slopes: Option<Table>,
    /// Conditions with held variables at other values, if there are any.
    pub followed: Option<Table>,
}

impl From<&Swept> for DesignTables {
    fn from(swept: &Swept) -> Self {
        let (validation, slopes, followed) = (swept.validation.clone(), swept.slopes.clone(), swept.followed.clone());
        Self { fitted: swept.table.clone(), validation, slopes, followed }
    }
}

/// A surrogate of the designs that vary more than one variable at a time, if the sweep has any; made from `fit` if the sweep was
/// fitted already.
///
/// # Errors
/// Errors of [`fitting::fit_table`].
pub(crate) fn fit_designs(
    plan: &Plan,
    scope: &Scope,
    swept: &DesignTables,
    keys: FitKeys,
    fit: Option<SurrogateFit>,
) -> Result<Option<FittedDesigns>> {
    if !plan.groups.iter().any(|g| g.purpose == Purpose::Fit && !is_one_factor(g)) {
        return Ok(None);
    }
    let table = rows_of(&swept.fitted, plan, |g| !is_one_factor(g));
    let mut fit = match fit {
        // The bands of this fit were stated round by round, before the error of the mesh was known.
        Some(mut fit) => {
            fitting::add_mesh_errors(&mut fit.surrogate, &table)?;
            fit
        }
        None => fitting::fit_table(&table, Some(scope), &fit_options(keys))?,
    };
    let slopes = swept.slopes.as_ref().map(|slopes| rows_of(slopes, plan, |g| !is_one_factor(g)));
    fitting::with_uncertainty(&mut fit, slopes.as_ref())?;
    fitting::with_followed(&mut fit, Some(scope), swept.followed.as_ref())?;
    let bytes = file::encode(&fit.surrogate)?;
    let mut comparison = TableComparison::default();
    {
        let opened = file::open(&bytes)?;
        comparison.add(&opened, &table, false)?;
        if let Some(validation) = &swept.validation {
            comparison.add(&opened, validation, true)?;
        }
    }
    Ok(Some(FittedDesigns { fit, bytes, comparison }))
}

/// Settings of the fit, as a sweep file states them.
pub(crate) fn fit_options(keys: FitKeys) -> FitOptions {
    let usual = FitOptions::default();
    FitOptions {
        max_degree: keys.max_degree.unwrap_or(usual.max_degree),
        folds: keys.folds.unwrap_or(usual.folds),
        seed: keys.seed.unwrap_or(usual.seed),
        ..usual
    }
}

/// The one-factor sweeps of a plan, each with its rows.
pub(crate) fn one_factor_tables<'a>(plan: &'a Plan, table: &Table) -> Vec<(&'a ConditionGroup, Table)> {
    plan.groups.iter().filter(|g| is_one_factor(g)).map(|g| (g, rows_of(table, plan, |other| other.name == g.name))).collect()
}

/// Checks, before the sweep takes its time, that a surrogate file can hold its result: a constant is written in the place of
/// every function.
///
/// # Errors
/// Errors of [`file::encode`]: a name that is too long, too many points, variables or limits.
pub fn rehearse(sweep: &Sweep) -> Result<()> {
    let plan = &sweep.plan;
    let designs = || plan.groups.iter().filter(|g| g.purpose == Purpose::Fit && !is_one_factor(g));
    if designs().next().is_none() {
        return Ok(());
    }
    let mut varied: Vec<usize> = designs().flat_map(|g| g.varied.iter().copied()).collect();
    varied.sort_unstable();
    varied.dedup();
    let constant = PolynomialSpec { transforms: vec![Transform::Identity; varied.len()], terms: Vec::new(), coefficients: Vec::new() };
    let subject = sweep.subject();
    let point = |(name, unit): &(String, String)| PointSpec {
        name: name.clone(),
        unit: unit.clone(),
        model: PointModel::Polynomial(constant.clone()),
        half_width: 0.0,
    };
    let variable = |v: &usize| {
        let DescribedVariable { name, unit, .. } = &plan.variables[*v];
        fit::model::VariableSpec { name: name.clone(), unit: unit.clone(), low: 0.0, high: 1.0 }
    };
    let mut surrogate = SurrogateSpec {
        variables: varied.iter().map(variable).collect(),
        points: subject.outputs.iter().map(point).collect(),
        provenance: sweep::provenance(plan, &subject, Purpose::Fit),
        ..SurrogateSpec::default()
    };
    let others = plan.variables.iter().enumerate().filter(|(v, _)| !varied.contains(v));
    surrogate.held = others.map(|(_, v)| HeldSpec { name: v.name.clone(), unit: v.unit.clone(), value: 0.0 }).collect();
    surrogate.limits = fitting::limits(&sweep.scope, &surrogate, &surrogate.held).0;
    file::encode(&surrogate).map(|_| ()).map_err(|e| e.in_file(sweep.definition.document().file()))
}
