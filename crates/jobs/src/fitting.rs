//! From a table to a surrogate with limits and provenance.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::progress::{Progress, Silent};
use coldplate_base::units::express;
use coldplate_describe::machine::{self, PointColumn, Scope};
use coldplate_explore::sweep::{BOUNDS, MESH_ERRORS, RECOVERED};
use coldplate_surrogate::fit::model::{
    DEFAULT, FollowedSpec, HeldSpec, LimitKind, LimitSpec, PointModel, PointSpec, SurrogateSpec, UncertaintySpec, VariableSpec,
};
use coldplate_surrogate::fit::{self, FitOptions, FitOutput, FitSamples, ResidualSizes, SurrogateFit};
use coldplate_tables::{Ledger, Table};

/// The samples of a table: its varying condition variables and its outputs; and its held variables.
///
/// # Errors
/// No condition variable varies, or there is no output.
pub fn samples(table: &Table) -> Result<(FitSamples, Vec<HeldSpec>)> {
    if table.provenance.iter().any(|(key, _)| key == RECOVERED) {
        return Err(Error::input("the outputs of this table stand in the place of results that there are none of")
            .help("fit sweep.csv: the conditions that have results"));
    }
    let (mut variables, mut varying, mut held) = (Vec::new(), Vec::new(), Vec::new());
    for column in table.conditions() {
        let present = column.values.iter().filter(|v| v.is_finite());
        let (low, high) = present.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        if high > low {
            variables.push(VariableSpec { name: column.name.clone(), unit: column.unit.clone(), low, high });
            varying.push(column);
        } else if low.is_finite() {
            held.push(HeldSpec { name: column.name.clone(), unit: column.unit.clone(), value: low });
        }
    }
    if variables.is_empty() {
        return Err(Error::input("no condition variable of this table varies, so there is nothing to fit against").help(
            "condition columns are coolant_flow, coolant_temperature, motor_speed and ambient_temperature, with their units, \
             or those named by --input",
        ));
    }
    let rows = (0..table.rows()).map(|row| varying.iter().map(|c| c.values[row]).collect()).collect();
    let outputs =
        table.outputs().iter().map(|c| FitOutput { name: c.name.clone(), unit: c.unit.clone(), values: c.values.clone() }).collect();
    Ok((FitSamples { variables, rows, outputs }, held))
}

/// Fits a table and adds the machine's limits, the held variables, and the provenance of the numbers.
///
/// # Errors
/// Errors of [`samples`] and [`fit::fit`].
pub fn fit_table(table: &Table, scope: Option<&Scope>, options: &FitOptions) -> Result<SurrogateFit> {
    fit_table_heard(table, scope, options, &Silent)
}

/// Fits a table as [`fit_table`] does, and reports progress.
///
/// # Errors
/// Errors of [`fit_table`].
pub fn fit_table_heard(table: &Table, scope: Option<&Scope>, options: &FitOptions, progress: &dyn Progress) -> Result<SurrogateFit> {
    let (samples, mut held) = samples(table)?;
    // A variable that nothing in the machine depends on does not count as held.
    let is_unused = |name: &str| scope.is_some_and(|m| m.variables.iter().enumerate().any(|(i, v)| v.name == name && !m.uses(i)));
    held.retain(|held| !is_unused(&held.name));
    let mut fit = fit::fit_heard(&samples, options, progress)?;
    widen(&mut fit, table)?;
    add_mesh_errors(&mut fit.surrogate, table)?;
    if let Some(scope) = scope {
        let (limits, notes) = limits(scope, &fit.surrogate, &held);
        fit.surrogate.limits = limits;
        fit.notes.extend(notes);
        let defaults = defaults(scope, &fit.surrogate);
        fit.surrogate.provenance.extend(defaults);
    }
    let provenance = &mut fit.surrogate.provenance;
    provenance.extend(table.provenance.iter().cloned());
    if !provenance.iter().any(|(key, _)| key == "program") {
        provenance.push(("program".into(), format!("coldplate {}", env!("CARGO_PKG_VERSION"))));
    }
    provenance.push(("conditions".into(), table.rows().to_string()));
    fit.surrogate.held = held;
    Ok(fit)
}

/// Defaults of the machine file for variables of the surrogate, as provenance; those outside the fitted range are no
/// answer's condition.
fn defaults(scope: &Scope, surrogate: &SurrogateSpec) -> Vec<(String, String)> {
    let default = |v: &VariableSpec| {
        let own = scope.variables.iter().find(|own| own.name == v.name)?;
        let value = express(own.default?, &v.unit, own.dimension).ok().filter(|value| (v.low..=v.high).contains(value))?;
        Some((format!("{DEFAULT}{}", v.name), format!("{value} {}", v.unit)))
    };
    surrogate.variables.iter().filter_map(default).collect()
}

/// A size per output, by name, that the table states in its provenance under `key`; zero for outputs that it does not name.
fn stated_sizes(table: &Table, key: &str, points: &[PointSpec]) -> Result<Option<Vec<f64>>> {
    let Some((_, sizes)) = table.provenance.iter().find(|(own, _)| own == key) else { return Ok(None) };
    let sizes: BTreeMap<String, f64> = serde_json::from_str(sizes).map_err(|e| {
        Error::input(format!("the {key} that the table states cannot be read: {e}"))
            .at_key(key)
            .help("take the table as the sweep wrote it")
    })?;
    let of = |point: &PointSpec| sizes.get(&point.name).copied().filter(|size| *size >= 0.0).unwrap_or(0.0);
    Ok(Some(points.iter().map(of).collect()))
}

/// Widens the bands by the bounds of rows that a reduced model answered.
fn widen(fit: &mut SurrogateFit, table: &Table) -> Result<()> {
    let Some(bounds) = stated_sizes(table, BOUNDS, &fit.surrogate.points)? else { return Ok(()) };
    for ((report, point), bound) in fit.points.iter_mut().zip(&mut fit.surrogate.points).zip(&bounds) {
        report.half_width += bound;
        point.half_width += bound;
    }
    let largest = bounds.iter().copied().fold(0.0, f64::max);
    if largest > 0.0 {
        let largest = significant(largest, 2);
        fit.notes.push(format!("a reduced model answered rows of this table: bands are wider by its bounds, at most {largest} K"));
    }
    Ok(())
}

/// Adds the error of the mesh that a table states to the bands, in quadrature: it is independent of the fit.
///
/// # Errors
/// The errors that the table states cannot be read.
pub(crate) fn add_mesh_errors(surrogate: &mut SurrogateSpec, table: &Table) -> Result<()> {
    surrogate.mesh = stated_sizes(table, MESH_ERRORS, &surrogate.points)?.unwrap_or_default();
    for (point, error) in surrogate.points.iter_mut().zip(&surrogate.mesh) {
        point.half_width = point.half_width.hypot(*error);
    }
    Ok(())
}

/// Adds the uncertainty of the answers, from a table of slopes, if there is one.
///
/// # Errors
/// Errors of [`UncertaintySpec::fit`].
pub fn with_uncertainty(fit: &mut SurrogateFit, slopes: Option<&Table>) -> Result<()> {
    if let Some(slopes) = slopes {
        fit.surrogate.uncertainty = Some(UncertaintySpec::fit(&fit.surrogate, slopes)?);
    }
    Ok(())
}

/// Adds how the answers follow held variables, from a table of conditions at which these have other values, if there is one. A
/// limit of the machine over such a variable moves with it.
///
/// # Errors
/// Errors of [`FollowedSpec::fit`].
pub fn with_followed(fit: &mut SurrogateFit, scope: Option<&Scope>, table: Option<&Table>) -> Result<()> {
    let Some(table) = table else { return Ok(()) };
    let surrogate = &fit.surrogate;
    let mut followed = FollowedSpec::fit(surrogate, table)?;
    for limit in scope.iter().flat_map(|m| &m.limits) {
        let (Some(scope), LimitKind::Rise { variable, .. }) = (scope, &limit.kind) else { continue };
        let held = surrogate.held.iter().position(|held| held.name == scope.variables[*variable].name);
        let own = surrogate.limits.iter().position(|own| own.name == limit.name);
        followed.limits.extend(own.zip(held));
    }
    fit.surrogate.followed = Some(followed);
    Ok(())
}

/// The limits of a machine in the surrogate's points and units; notes name limits that cannot be carried over. A rise
/// over a variable that was held is a maximum.
pub(super) fn limits(scope: &Scope, surrogate: &SurrogateSpec, held: &[HeldSpec]) -> (Vec<LimitSpec>, Vec<String>) {
    let (mut limits, mut notes) = (Vec::new(), Vec::new());
    let point =
        |sensor: usize| surrogate.points.iter().position(|p| p.name == scope.points[sensor].name && p.unit == scope.points[sensor].unit);
    let variable = |index: usize| surrogate.variables.iter().position(|v| v.name == scope.variables[index].name);
    for limit in &scope.limits {
        if let LimitKind::Rise { point: sensor, variable } = limit.kind
            && let Some(held) = held.iter().find(|held| held.name == scope.variables[variable].name)
            && let Some(point) = point(sensor).filter(|point| surrogate.points[*point].unit == held.unit)
        {
            let maximum = held.value + limit.maximum;
            notes.push(format!("the limit '{}' is over {}, which was held: at most {maximum} {}", limit.name, held.name, held.unit));
            limits.push(LimitSpec { name: limit.name.clone(), kind: LimitKind::Maximum { point }, maximum });
            continue;
        }
        let kind = limit.kind.renumbered(point, variable);
        let maximum = in_unit(limit, &scope.points);
        match kind {
            Some(kind) => limits.push(LimitSpec { name: limit.name.clone(), kind, maximum }),
            None => notes.push(format!("the limit '{}' looks at something this table does not vary or hold: it is left out", limit.name)),
        }
    }
    (limits, notes)
}

/// Largest value that a limit allows, in the unit of its points.
fn in_unit(limit: &machine::MachineLimit, points: &[PointColumn]) -> f64 {
    let (point, is_difference) = match &limit.kind {
        LimitKind::Maximum { point } => (*point, false),
        LimitKind::Rise { .. } => return limit.maximum,
        LimitKind::Difference { first, .. } => (*first, true),
        LimitKind::Spread(all) => (all.first().copied().unwrap_or(0), true),
    };
    let Some(PointColumn { unit, dimension, .. }) = points.get(point) else { return limit.maximum };
    match (dimension.is_absolute(), is_difference) {
        (true, true) => limit.maximum,
        _ => express(limit.maximum, unit, *dimension).unwrap_or(limit.maximum),
    }
}

/// The unit of errors of a point that is given in `unit`.
pub fn unit_of_errors(unit: &str) -> &str {
    if unit == "degC" { "K" } else { unit }
}

/// The model of a point in a few words.
pub fn model_text(surrogate: &SurrogateSpec, point: usize) -> String {
    match &surrogate.points[point].model {
        PointModel::Polynomial(p) => {
            let degree = p.terms.iter().map(|t| t.iter().map(|e| u32::from(*e)).sum::<u32>()).max().unwrap_or(0);
            format!("polynomial, degree {degree}, {} terms", p.terms.len())
        }
        PointModel::Rbf { basis, weights, .. } => format!("{:?}, {} centres", surrogate.bases[*basis].kernel, weights.len()),
    }
}

/// A fit as outside programs read it: each field is a key of `coldplate fit --json`.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs)]
pub struct FitRecord {
    /// The surrogate file.
    pub file: String,
    pub bytes: u64,
    pub points: Vec<PointFitRecord>,
    pub notes: Vec<String>,
    /// Account of the table: lines that count, and those that do not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub account: Option<Ledger>,
    pub seconds: f64,
}

/// The fit of one point; errors in its unit.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PointFitRecord {
    pub name: String,
    pub unit: String,
    /// The kind of function in words.
    pub model: String,
    pub rows: usize,
    pub leave_one_out: ResidualSizes,
    pub k_fold: Option<ResidualSizes>,
    pub half_width: f64,
    /// Further error while the machine moves, in the unit; only with `--dynamics`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over_time: Option<f64>,
}

impl FitRecord {
    /// The record of a fit written to `path`, of `bytes` bytes, made in `seconds`.
    pub fn of(fit: &SurrogateFit, path: &Path, bytes: u64, seconds: f64) -> Self {
        let points = fit.points.iter().enumerate().map(|(i, p)| PointFitRecord {
            name: p.name.clone(),
            unit: p.unit.clone(),
            model: model_text(&fit.surrogate, i),
            rows: p.rows,
            leave_one_out: p.chosen.leave_one_out,
            k_fold: p.chosen.k_fold,
            half_width: p.half_width,
            over_time: fit.surrogate.in_time.as_ref().and_then(|own| own.errors.get(i).copied()),
        });
        Self { file: path.display().to_string(), bytes, points: points.collect(), account: None, notes: fit.notes.clone(), seconds }
    }
}
