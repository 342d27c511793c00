//! The main job: from a sweep file to one folder with tables, surrogate, figures and a report.

pub mod diagnosis;
pub mod figures;
pub mod fitting;
mod measured;
mod pages;
pub mod refit;

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::describe::machine::Machine;
use crate::error::{Error, Result};
use crate::explore::sweep::bridge::Sweep;
use crate::explore::sweep::{self, Purpose, Swept};
use crate::figures::chart::{Figure, draw};
use crate::foundation::table::Table;
use crate::solve::meshed::{Inventory, MeshedMachine, inventory};
use crate::surrogate::fit::model::{PointModel, Surrogate};
use crate::surrogate::fit::one_factor::OneFactor;
use crate::surrogate::fit::{Fit, FitOptions, PointReport, file};
use figures::Comparison;
use measured::Checked;

/// Name of the surrogate in the output folder.
pub const SURROGATE: &str = "surrogate.cps";
/// The held-out error aimed at, K.
pub const TARGET: f64 = 0.02;

/// What a job did, point by point.
#[derive(Debug)]
pub struct Summary {
    /// The folder everything is in.
    pub folder: PathBuf,
    /// Conditions of the sweep, and how many of them came from the journal.
    pub conditions: (usize, usize),
    /// Conditions that failed, with the reason.
    pub failures: Vec<sweep::Failure>,
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
    /// Root mean square of the leave-one-out errors, K.
    pub leave_one_out: f64,
    /// Root mean square of the k-fold errors of the whole procedure, K.
    pub k_fold: Option<f64>,
    /// Half width of the band, K.
    pub half_width: f64,
    /// On held-out conditions: largest error, root mean square error (K), share inside the band.
    pub held_out: Option<(f64, f64, f64)>,
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

/// The surrogate of a job and how it compares.
struct Fitted {
    fit: Fit,
    bytes: Vec<u8>,
    comparison: Comparison,
}

/// Runs the whole job into `folder`, resuming what the journal there holds.
///
/// # Errors
/// Bad input; numerics that failed at every condition; a folder that cannot be written.
pub fn run(sweep: &Sweep, folder: &Path, options: sweep::SweepOptions<'_>, say: &dyn Fn(&str)) -> Result<Summary> {
    let clock = Instant::now();
    let swept = sweep.run(folder, options)?;
    let mut checked = measured::check(&sweep.model)?;
    for path in &sweep.definition.compare {
        checked.extend(measured::check(&MeshedMachine::new(Machine::read(path, &[])?, None)?)?);
    }
    let inventory = inventory(&sweep.model, Some(&sweep.reference()))?;
    let sweep_seconds = clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    say("fitting");
    let fitted = fit_designs(sweep, &swept)?;
    let one_factor = one_factor_tables(sweep, &swept.table);
    let fit_seconds = clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    say("drawing");
    let mut files = swept.files.clone();
    if let Some(fitted) = &fitted {
        let path = folder.join(SURROGATE);
        file::write(&fitted.fit.surrogate, &path)?;
        files.push(path);
    }
    let mut gallery = Gallery::new(folder)?;
    if let Some(fitted) = &fitted {
        let opened = file::open(&fitted.bytes)?;
        draw_surrogate(&mut gallery, &opened, &fitted.comparison, &fitted.fit.points, &sweep.model.machine.name)?;
    }
    for (group, table) in &one_factor {
        let degree = group.degree.unwrap_or(2);
        let variable = &sweep.plan.variables[group.varied[0]].name;
        for (i, figure) in
            figures::one_factor(table, variable, degree, &format!("{}: one variable at a time", group.name))?.iter().enumerate()
        {
            gallery.add(&format!("one_factor_{}_{}", file_name(&group.name), i + 1), "one factor", figure)?;
        }
    }
    for check in &checked {
        gallery.add(&format!("measured_{}", file_name(&check.name)), "measured", &check.figure)?;
        gallery.add(&format!("heat_{}", file_name(&check.name)), "heat", &check.heat)?;
    }
    let formulas = formulas(sweep, &one_factor)?;
    let points = fitted.as_ref().map(|f| point_summaries(&f.fit, &f.comparison)).unwrap_or_default();
    let mut summary = Summary {
        folder: folder.to_path_buf(),
        conditions: (sweep.plan.conditions.len(), swept.resumed),
        failures: swept.failures.clone(),
        points,
        formulas,
        notes: fitted.as_ref().map(|f| f.fit.notes.clone()).unwrap_or_default(),
        files: Vec::new(),
        seconds: [sweep_seconds, fit_seconds, 0.0],
    };
    let report = folder.join("report.html");
    pages::write(
        &report,
        &Material {
            sweep,
            swept: &swept,
            fitted: fitted.as_ref(),
            checked: &checked,
            inventory: &inventory,
            gallery: &gallery,
            summary: &summary,
        },
    )?;
    summary.files = [vec![report], files, gallery.files()].concat();
    summary.seconds[2] = clock.elapsed().as_secs_f64();
    Ok(summary)
}

/// Everything the report is made from.
struct Material<'a> {
    sweep: &'a Sweep,
    swept: &'a Swept,
    fitted: Option<&'a Fitted>,
    checked: &'a [Checked],
    inventory: &'a Inventory,
    gallery: &'a Gallery,
    summary: &'a Summary,
}

/// Groups of one varied variable: the paper's one-factor sweeps.
fn is_one_factor(group: &sweep::Group) -> bool {
    group.purpose == Purpose::Fit && group.varied.len() == 1
}

/// Rows of `table` that belong to a group for which `keep` holds.
fn rows_of(table: &Table, sweep: &Sweep, keep: impl Fn(&sweep::Group) -> bool) -> Table {
    let names: Vec<&str> = sweep.plan.groups.iter().filter(|g| keep(g)).map(|g| g.name.as_str()).collect();
    match table.text("group") {
        Some(groups) => table.select(|row| names.contains(&groups.values[row].as_str())),
        None => table.clone(),
    }
}

/// A surrogate of everything that varies more than one variable at a time, if the sweep has such a design.
fn fit_designs(sweep: &Sweep, swept: &Swept) -> Result<Option<Fitted>> {
    if !sweep.plan.groups.iter().any(|g| g.purpose == Purpose::Fit && !is_one_factor(g)) {
        return Ok(None);
    }
    let table = rows_of(&swept.table, sweep, |g| !is_one_factor(g));
    let fit = fitting::fit_table(&table, Some(&sweep.model.machine), &FitOptions::default())?;
    let bytes = file::encode(&fit.surrogate)?;
    let mut comparison = Comparison::default();
    {
        let opened = file::open(&bytes)?;
        comparison.add(&opened, &table, false)?;
        if let Some(validation) = &swept.validation {
            comparison.add(&opened, validation, true)?;
        }
    }
    Ok(Some(Fitted { fit, bytes, comparison }))
}

fn one_factor_tables<'a>(sweep: &'a Sweep, table: &Table) -> Vec<(&'a sweep::Group, Table)> {
    sweep.plan.groups.iter().filter(|g| is_one_factor(g)).map(|g| (g, rows_of(table, sweep, |other| other.name == g.name))).collect()
}

fn formulas(sweep: &Sweep, tables: &[(&sweep::Group, Table)]) -> Result<Vec<Formula>> {
    let mut found = Vec::new();
    for (group, table) in tables {
        let variable = table.column(&sweep.plan.variables[group.varied[0]].name)?;
        for output in table.outputs() {
            let fitted = OneFactor::fit(&variable.values, &output.values, group.degree.unwrap_or(2))?;
            found.push(Formula {
                group: group.name.clone(),
                variable: variable.header(),
                point: output.name.clone(),
                text: fitted.formula("y", "x", 6),
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

/// Draws everything a surrogate and its comparison say.
fn draw_surrogate(
    gallery: &mut Gallery,
    surrogate: &crate::surrogate::verdict::Surrogate<'_>,
    comparison: &Comparison,
    fits: &[PointReport],
    machine: &str,
) -> Result<()> {
    let x = figures::centre(surrogate);
    let index = |name: &str| crate::surrogate::verdict::condition::index_of(surrogate, name).ok();
    if surrogate.limit_count() > 0 {
        let pairs = [("motor_speed", "coolant_flow"), ("coolant_temperature", "ambient_temperature")];
        for (across, up) in pairs {
            if let (Some(a), Some(u)) = (index(across), index(up)) {
                let map = figures::map(surrogate, a, u, &x, None)?;
                gallery.add(&format!("acceptability_{across}_{up}"), "acceptability", &map)?;
            }
        }
        if ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"].iter().all(|n| index(n).is_some()) {
            let provenance: Vec<String> =
                surrogate.provenance().filter(|(k, _)| ["program", "machine hash"].contains(k)).map(|(k, v)| format!("{k} {v}")).collect();
            let sheet = figures::operator_sheet(surrogate, machine, &provenance.join("; "))?;
            gallery.add("operator_sheet", "operator sheet", &sheet)?;
        }
    }
    for variable in 0..surrogate.variable_count() {
        let name = surrogate.variable(variable).map_or(String::new(), |v| v.name.to_string());
        for (i, figure) in figures::slices(surrogate, variable, &x)?.iter().enumerate() {
            gallery.add(&format!("against_{name}_{}", i + 1), "slices", figure)?;
        }
    }
    gallery.add("errors", "errors", &figures::errors(surrogate, comparison, fits, Some(TARGET)))?;
    // Parity and residuals of the point with the largest error; the others are one command away.
    let worst = (0..surrogate.point_count()).max_by(|a, b| {
        let error = |p: usize| comparison.held_out_errors(p, 0.0).map_or(0.0, |e| e.0);
        error(*a).total_cmp(&error(*b))
    });
    if let Some(point) = worst {
        if let Some(figure) = figures::parity(surrogate, comparison, point) {
            gallery.add("parity_worst_point", "accuracy", &figure)?;
        }
        if let Some(figure) = figures::residuals(surrogate, comparison, point) {
            gallery.add("residuals_worst_point", "accuracy", &figure)?;
        }
    }
    Ok(())
}

/// Figures drawn so far: files on disk, and the SVG text for the report.
#[derive(Debug)]
pub struct Gallery {
    folder: PathBuf,
    entries: Vec<Entry>,
}

/// A figure in the gallery.
#[derive(Debug)]
pub struct Entry {
    /// What it belongs to.
    pub topic: &'static str,
    /// Its title.
    pub title: String,
    /// The SVG document.
    pub svg: String,
    files: Vec<PathBuf>,
}

impl Gallery {
    /// A gallery in `folder`/charts.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn new(folder: &Path) -> Result<Self> {
        let folder = folder.join("charts");
        std::fs::create_dir_all(&folder).map_err(|e| Error::file("make", &folder, e))?;
        Ok(Self { folder, entries: Vec::new() })
    }

    /// Draws a figure as SVG and PNG under `name`.
    ///
    /// # Errors
    /// The figure has nothing to show, or cannot be written.
    pub fn add<F: Figure>(&mut self, name: &str, topic: &'static str, figure: &F) -> Result<()> {
        let written = draw(self.folder.join(name), figure)?;
        let svg = crate::figures::chart::to_svg_string(figure)?;
        self.entries.push(Entry { topic, title: figure.title().to_string(), svg, files: vec![written.svg, written.png] });
        Ok(())
    }

    /// Figures of a topic.
    pub fn of<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a Entry> {
        self.entries.iter().filter(move |e| e.topic == topic)
    }

    /// All files.
    pub fn files(&self) -> Vec<PathBuf> {
        self.entries.iter().flat_map(|e| e.files.iter().cloned()).collect()
    }
}

/// Draws the figures of a surrogate alone, or with tables to compare with; for `coldplate chart`.
///
/// # Errors
/// As [`run`].
pub fn chart(surrogate: &crate::surrogate::verdict::Surrogate<'_>, tables: &[(Table, bool)], folder: &Path) -> Result<Vec<PathBuf>> {
    let mut comparison = Comparison::default();
    for (table, held_out) in tables {
        comparison.add(surrogate, table, *held_out)?;
    }
    comparison.values.resize(surrogate.point_count(), Vec::new());
    let mut gallery = Gallery::new(folder)?;
    let machine = surrogate.provenance().find(|(k, _)| *k == "machine").map_or("machine", |(_, v)| v).to_string();
    draw_surrogate(&mut gallery, surrogate, &comparison, &[], &machine)?;
    if !tables.is_empty() {
        for point in 0..surrogate.point_count() {
            let name = surrogate.point(point).map_or(String::new(), |p| file_name(p.name));
            if let Some(figure) = figures::parity(surrogate, &comparison, point) {
                gallery.add(&format!("parity_{name}"), "accuracy", &figure)?;
            }
            if let Some(figure) = figures::residuals(surrogate, &comparison, point) {
                gallery.add(&format!("residuals_{name}"), "accuracy", &figure)?;
            }
        }
    }
    Ok(gallery.files())
}

/// A name as part of a file name.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect()
}
