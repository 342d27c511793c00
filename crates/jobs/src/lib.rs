//! The main job: from a sweep file to one folder with tables, surrogate, figures and a report.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod adaptive;
pub mod charts;
pub mod course;
mod default_figures;
pub mod designs;
pub mod drift_report;
pub mod figures;
pub mod fitting;
pub mod gallery;
pub mod info;
pub mod measured;
pub mod moving;
pub mod reduced;
pub mod refit;
mod report;
pub mod sensitivity;
pub mod service;

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Instant;

use adaptive::{Adaptation, Ran};
use charts::Chart;
use charts::results::{Results, SweepResult};
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{self, Answered, Swept};
use coldplate_solve::meshed::{Inventory, inventory};
use coldplate_solve::sensitivity::Study;
use coldplate_surrogate::fit::model::{PointModel, Surrogate};
use coldplate_surrogate::fit::one_factor::OneFactor;
use coldplate_surrogate::fit::{Fit, PointReport, file};
use coldplate_tables::Table;
use designs::{Fitted, Tables, fit_designs, one_factor_tables};
use figures::Comparison;
use gallery::{Gallery, file_name};
use measured::Checked;

pub use default_figures::chart;

/// Name of the surrogate in the output folder.
pub const SURROGATE: &str = "surrogate.cps";
/// The held-out error aimed at, K. Chosen: drawn as a line in figures, it decides nothing.
pub const TARGET: f64 = 0.02;

/// Results of a job.
#[derive(Debug)]
pub struct Summary {
    /// The folder everything is in.
    pub folder: PathBuf,
    /// Conditions of the sweep, and how many of them came from the journal.
    pub conditions: (usize, usize),
    /// Conditions that failed, with the reason.
    pub failures: Vec<sweep::Failure>,
    /// Number of conditions that a reduced model answered, if the sweep file asks for an accuracy of all rows.
    pub answered: Option<Answered>,
    /// How the sweep came to the accuracy that the sweep file states, if it states one.
    pub adaptation: Option<Adaptation>,
    /// One per measurement point of the surrogate; empty for sweeps of one factor at a time.
    pub points: Vec<PointSummary>,
    /// Formulas of the one-factor sweeps.
    pub formulas: Vec<Formula>,
    /// Remarks of the fit.
    pub notes: Vec<String>,
    /// Files written, the report first.
    pub files: Vec<PathBuf>,
    /// Seconds: sweep, fit, figures and report.
    pub seconds: [f64; 3],
}

/// How well one measurement point is predicted.
#[derive(Debug, Clone)]
pub struct PointSummary {
    /// Name.
    pub name: String,
    /// The model in a few words.
    pub model: String,
    /// Unit of the point's errors: K for a temperature.
    pub unit: String,
    /// Root mean square of the leave-one-out errors.
    pub leave_one_out: f64,
    /// Root mean square of the k-fold errors of the whole procedure.
    pub k_fold: Option<f64>,
    /// Half width of the band.
    pub half_width: f64,
    /// On held-out conditions: largest error, root mean square error, share inside the band.
    pub held_out: Option<(f64, f64, f64)>,
}

impl Summary {
    /// The unit of the errors of all points, if it is the same for all.
    pub fn unit_of_errors(&self) -> Option<&str> {
        let first = self.points.first()?.unit.as_str();
        self.points.iter().all(|p| p.unit == first).then_some(first)
    }

    /// The largest error of a temperature on held-out conditions, K.
    pub fn worst_held_out(&self) -> Option<f64> {
        self.points.iter().filter(|p| p.unit == "K").filter_map(|p| p.held_out).map(|h| h.0).reduce(f64::max)
    }
}

/// The unit of errors of a point that is given in `unit`.
pub fn unit_of_errors(unit: &str) -> &str {
    if unit == "degC" { "K" } else { unit }
}

/// A fit in one variable, as the paper prints it.
#[derive(Debug, Clone)]
pub struct Formula {
    /// Name of the one-factor sweep.
    pub group: String,
    /// The variable, with its unit.
    pub variable: String,
    /// Name of the measurement point.
    pub point: String,
    /// The formula.
    pub text: String,
    /// Share of the variance explained.
    pub r_squared: f64,
    /// Root mean square of the residuals, K.
    pub rms: f64,
}

/// Runs the whole job into `folder`, resuming what the journal there holds.
///
/// # Errors
/// Bad input; numerics that failed at every condition; a folder that cannot be written.
pub fn run<'a>(sweep: &Sweep, folder: &Path, options: sweep::SweepOptions<'a>, progress: &'a dyn Progress) -> Result<Summary> {
    let clock = Instant::now();
    // Before the sweep, which takes its time: a mistake in a chart definition should show at once.
    let named = sweep.definition.charts.iter().map(Chart::read).collect::<Result<Vec<_>>>()?;
    designs::rehearse(sweep)?;
    let Ran { swept, adaptation, fit } = adaptive::run(sweep, folder, options, progress)?;
    let plan = &swept.plan;
    let mut checked = sweep.study().map(measured::check).transpose()?.unwrap_or_default();
    for path in &sweep.definition.compare {
        checked.extend(measured::check(&Study::read(path, &[], None)?)?);
    }
    let inventory = sweep.study().map(|study| inventory(&study.model, Some(&sweep.reference()))).transpose()?;
    let sweep_seconds = clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    progress.say("fitting");
    let result = Rc::new(SweepResult {
        plan: plan.clone(),
        machine: sweep.scope.name.clone(),
        table: swept.table.clone(),
        fitted: fit_designs(plan, &sweep.scope, &Tables::from(&swept), sweep.definition.fit, fit)?,
    });
    let fitted = result.fitted.as_ref();
    let one_factor = one_factor_tables(plan, &swept.table);
    let fit_seconds = clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    progress.say("drawing");
    let mut files = swept.files.clone();
    if let Some(fitted) = fitted {
        let path = folder.join(SURROGATE);
        file::write(&fitted.fit.surrogate, &path)?;
        files.push(path);
    }
    let mut gallery = Gallery::new(&folder.join("charts"))?;
    let mut results = Results::new(folder.parent().unwrap_or(Path::new(".")), options, progress);
    results.insert(sweep.definition.document().file(), Rc::clone(&result));
    for chart in &named {
        chart.draw(&mut results, &mut gallery)?;
    }
    if let Some(fitted) = fitted {
        let opened = file::open(&fitted.bytes)?;
        default_figures::draw_surrogate(&mut gallery, &opened, &fitted.comparison, &fitted.fit.points, &sweep.scope.name)?;
    }
    if !gallery.has("one_factor") && !gallery.has("published") {
        for (group, table) in &one_factor {
            let degree = group.degree.unwrap_or(2);
            let variable = &plan.variables[group.varied[0]].name;
            let title = format!("{}: temperatures over the {}", group.name, variable.replace('_', " "));
            for (i, figure) in figures::one_factor(table, variable, degree, &title)?.iter().enumerate() {
                gallery.add(&format!("one_factor_{}_{}", file_name(&group.name), i + 1), "one_factor", figure)?;
            }
        }
    }
    for check in &checked {
        gallery.add(&format!("measured_{}", file_name(&check.name)), "state", &check.figure)?;
        gallery.add(&format!("heat_{}", file_name(&check.name)), "state heat", &check.heat)?;
    }
    let formulas = formulas(sweep, &one_factor)?;
    let points = fitted.map(|f| point_summaries(&f.fit, &f.comparison)).unwrap_or_default();
    let mut summary = Summary {
        folder: folder.to_path_buf(),
        conditions: (plan.conditions.len(), swept.resumed),
        answered: swept.answered.clone(),
        adaptation,
        failures: swept.failures.clone(),
        points,
        formulas,
        notes: swept.notes.iter().chain(fitted.iter().flat_map(|f| &f.fit.notes)).cloned().collect(),
        files: Vec::new(),
        seconds: [sweep_seconds, fit_seconds, 0.0],
    };
    let report = folder.join("report.html");
    report::write(
        &report,
        &Material { sweep, swept: &swept, fitted, checked: &checked, inventory: inventory.as_ref(), gallery: &gallery, summary: &summary },
    )?;
    summary.files = [vec![report], files, gallery.files()].concat();
    summary.seconds[2] = clock.elapsed().as_secs_f64();
    Ok(summary)
}

/// Input of the report.
struct Material<'a> {
    sweep: &'a Sweep,
    swept: &'a Swept,
    fitted: Option<&'a Fitted>,
    checked: &'a [Checked],
    /// Inventory of the machine, if this program solved it.
    inventory: Option<&'a Inventory>,
    gallery: &'a Gallery,
    summary: &'a Summary,
}

fn formulas(sweep: &Sweep, tables: &[(&sweep::Group, Table)]) -> Result<Vec<Formula>> {
    let mut found = Vec::new();
    for (group, table) in tables {
        let variable = table.column(&sweep.plan.variables[group.varied[0]].name)?;
        let (low, high) = variable.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        for output in table.outputs() {
            let fitted = OneFactor::fit(&variable.values, &output.values, group.degree.unwrap_or(2))?;
            found.push(Formula {
                group: group.name.clone(),
                variable: variable.header(),
                point: output.name.clone(),
                text: fitted.honest_formula("y", "x", low, high),
                r_squared: fitted.r_squared,
                rms: fitted.rms,
            });
        }
    }
    Ok(found)
}

fn point_summaries(fit: &Fit, comparison: &Comparison) -> Vec<PointSummary> {
    let summary = |(i, report): (usize, &PointReport)| PointSummary {
        name: report.name.clone(),
        model: model_text(&fit.surrogate, i),
        unit: unit_of_errors(&report.unit).into(),
        leave_one_out: report.chosen.leave_one_out.rms,
        k_fold: report.chosen.k_fold.map(|k| k.rms),
        half_width: report.half_width,
        held_out: comparison.held_out_errors(i, report.half_width),
    };
    fit.points.iter().enumerate().map(summary).collect()
}

/// The model of a point in a few words.
pub fn model_text(surrogate: &Surrogate, point: usize) -> String {
    match &surrogate.points[point].model {
        PointModel::Polynomial(p) => {
            let degree = p.terms.iter().map(|t| t.iter().map(|e| u32::from(*e)).sum::<u32>()).max().unwrap_or(0);
            format!("polynomial, degree {degree}, {} terms", p.terms.len())
        }
        PointModel::Rbf { basis, weights, .. } => format!("{:?}, {} centres", surrogate.bases[*basis].kernel, weights.len()),
    }
}
