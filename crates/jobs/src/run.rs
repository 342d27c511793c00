//! The main job: from a sweep file to one folder with tables, surrogate, figures and a report.

use std::path::Path;
use std::rc::Rc;
use std::time::Instant;

use super::adaptive::{self, FinishedSweep};
use super::answer::{self, Answer};
use super::charts::Chart;
use super::charts::results::{Results, SweepResult};
use super::designs::{self, DesignTables, FittedDesigns, fit_designs, one_factor_tables};
use super::figures::{self, TableComparison};
use super::fitting::{model_text, unit_of_errors};
use super::gallery::{Gallery, file_name};
use super::measured::{self, CheckedState};
use super::summary::{MachineKnown, PointSummary, PrintedFormula, SURROGATE, Summary};
use super::{default_figures, report};
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{ConditionGroup, Plan, SweepOptions};
use coldplate_solve::meshed::inventory;
use coldplate_solve::study::Study;
use coldplate_surrogate::fit::one_factor::OneFactorFit;
use coldplate_surrogate::fit::{PointReport, SurrogateFit, file};
use coldplate_tables::Table;

/// Runs the whole job into `folder`, resuming what the journal there holds.
///
/// # Errors
/// Bad input; numerics that failed at every condition; a folder that cannot be written.
pub fn run<'a>(sweep: &Sweep, folder: &Path, options: SweepOptions<'a>, progress: &'a dyn Progress) -> Result<Summary> {
    let clock = Instant::now();
    // Before the sweep, which takes its time: a mistake in a chart definition should show at once.
    let named = sweep.definition.charts.iter().map(Chart::read).collect::<Result<Vec<_>>>()?;
    designs::rehearse(sweep)?;
    let FinishedSweep { swept, adaptation, fit } = adaptive::run(sweep, folder, options, progress)?;
    let plan = &swept.plan;
    let checked = checked(sweep)?;
    let inventory = sweep.study().map(|study| inventory(&study.model, Some(&sweep.reference()))).transpose()?;
    let sweep_seconds = clock.elapsed().as_secs_f64();

    let clock = Instant::now();
    progress.say("fitting");
    let result = Rc::new(SweepResult {
        plan: plan.clone(),
        machine: sweep.scope.name.clone(),
        table: swept.table.clone(),
        fitted: fit_designs(plan, &sweep.scope, &DesignTables::from(&swept), sweep.definition.fit, fit)?,
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
    let answer = draw_answer(&mut gallery, sweep, fitted)?;
    let mut results = Results::new(folder.parent().unwrap_or(Path::new(".")), options, progress);
    results.insert(sweep.definition.document().file(), Rc::clone(&result));
    for chart in &named {
        chart.draw(&mut results, &mut gallery)?;
    }
    if let Some(fitted) = fitted {
        let opened = file::open(&fitted.bytes)?;
        default_figures::draw_surrogate(&mut gallery, &opened, &fitted.comparison, &fitted.fit.points, &sweep.scope.name)?;
    }
    draw_one_factor(&mut gallery, plan, &one_factor)?;
    draw_states(&mut gallery, &checked)?;
    let formulas = formulas(sweep, &one_factor)?;
    let points = fitted.map(|f| point_summaries(&f.fit, &f.comparison)).unwrap_or_default();
    let mut summary = Summary {
        folder: folder.to_path_buf(),
        conditions: (plan.conditions.len(), swept.resumed),
        answered: swept.answered.clone(),
        adaptation,
        failures: swept.failures.clone(),
        answer,
        known: MachineKnown::of(&checked),
        points,
        formulas,
        notes: swept.notes.iter().chain(fitted.iter().flat_map(|f| &f.fit.notes)).cloned().collect(),
        files: Vec::new(),
        seconds: [sweep_seconds, fit_seconds, 0.0],
    };
    let report = folder.join("report.html");
    report::write(
        &report,
        &report::ReportInput {
            sweep,
            swept: &swept,
            fitted,
            checked: &checked,
            inventory: inventory.as_ref(),
            gallery: &gallery,
            summary: &summary,
        },
    )?;
    summary.files = [vec![report], files, gallery.files()].concat();
    summary.seconds[2] = clock.elapsed().as_secs_f64();
    Ok(summary)
}

/// The answer of the sweep, with the machine and the map about its condition.
fn draw_answer(gallery: &mut Gallery, sweep: &Sweep, fitted: Option<&FittedDesigns>) -> Result<Option<Answer>> {
    let Some(fitted) = fitted else {
        answer::draw_machine(gallery, sweep, None)?;
        return Ok(None);
    };
    let surrogate = file::open(&fitted.bytes)?;
    let found = Answer::of(&surrogate, &sweep.scope.variables)?;
    answer::draw_machine(gallery, sweep, found.as_ref().map(|answer| (&surrogate, answer)))?;
    if let Some(answer) = &found {
        answer.draw_map(gallery, &surrogate)?;
    }
    Ok(found)
}

/// Measured states of the machine, and of the machines that the sweep compares with, beside their predictions.
fn checked(sweep: &Sweep) -> Result<Vec<CheckedState>> {
    let mut checked = sweep.study().map(measured::check).transpose()?.unwrap_or_default();
    for path in &sweep.definition.compare {
        checked.extend(measured::check(&Study::read(path, &[], None)?)?);
    }
    Ok(checked)
}

/// Figures of the one-factor sweeps, unless definitions drew some.
fn draw_one_factor(gallery: &mut Gallery, plan: &Plan, one_factor: &[(&ConditionGroup, Table)]) -> Result<()> {
    if !gallery.has("one_factor") && !gallery.has("published") {
        for (group, table) in one_factor {
            let degree = group.degree.unwrap_or(2);
            let variable = &plan.variables[group.varied[0]].name;
            let title = format!("{}: temperatures over the {}", group.name, variable.replace('_', " "));
            for (i, figure) in figures::one_factor(table, variable, degree, &title)?.iter().enumerate() {
                gallery.add(&format!("one_factor_{}_{}", file_name(&group.name), i + 1), "one_factor", figure)?;
            }
        }
    }
    Ok(())
}

fn draw_states(gallery: &mut Gallery, checked: &[CheckedState]) -> Result<()> {
    for check in checked {
        gallery.add(&format!("measured_{}", file_name(&check.name)), "state", &check.figure)?;
        gallery.add(&format!("heat_{}", file_name(&check.name)), "state heat", &check.heat)?;
    }
    Ok(())
}

fn formulas(sweep: &Sweep, tables: &[(&ConditionGroup, Table)]) -> Result<Vec<PrintedFormula>> {
    let mut found = Vec::new();
    for (group, table) in tables {
        let variable = table.column(&sweep.plan.variables[group.varied[0]].name)?;
        let (low, high) = variable.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        for output in table.outputs() {
            let fitted = OneFactorFit::fit(&variable.values, &output.values, group.degree.unwrap_or(2))?;
            found.push(PrintedFormula {
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

fn point_summaries(fit: &SurrogateFit, comparison: &TableComparison) -> Vec<PointSummary> {
    let summary = |(i, report): (usize, &PointReport)| PointSummary {
        name: report.name.clone(),
        model: model_text(&fit.surrogate, i),
        unit: unit_of_errors(&report.unit).into(),
        leave_one_out: report.chosen.leave_one_out.rms,
        k_fold: report.chosen.k_fold.map(|k| k.rms),
        half_width: report.half_width,
        mesh: fit.surrogate.mesh.get(i).copied(),
        held_out: comparison.held_out_errors(i, report.half_width),
    };
    fit.points.iter().enumerate().map(summary).collect()
}
