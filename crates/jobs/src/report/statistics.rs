//! How well the solver and the fit did, and where the numbers come from: folded, since the answer is no surer than the machine
//! is known.

use super::super::adaptive::Adaptation;
use super::super::summary::{SURROGATE, TARGET};
use super::{ReportInput, figures, text};
use coldplate_base::condition;
use coldplate_base::error::Result;
use coldplate_base::numbers::{compact, significant};
use coldplate_figures::report::{Align, KeyFigure, ReportSection, ReportTable, Tone};
use coldplate_surrogate::fit::file;

pub(super) fn write(section: &mut ReportSection, material: &ReportInput<'_>) -> Result<()> {
    section.folded("How well the solver and the fit did", |inside| solved(inside, material));
    let mut told = Ok(());
    section.folded("Where the numbers come from", |inside| told = provenance(inside, material));
    told
}

fn solved(section: &mut ReportSection, material: &ReportInput<'_>) {
    let summary = material.summary;
    let mut keys = vec![KeyFigure::new(summary.conditions.0.to_string(), "conditions solved in full")];
    keys.push(match (material.sweep.study(), material.sweep.program()) {
        (_, Some(program)) => KeyFigure::new(&program.name, format!("solved them, version {}", program.version())),
        (study, None) => KeyFigure::new(study.map_or(0, |study| study.model.network.nodes).to_string(), "unknowns each"),
    });
    if let Some(worst) = summary.worst_held_out() {
        let tone = if worst < TARGET { Tone::Plain } else { Tone::Bad };
        keys.push(
            KeyFigure::new(format!("{worst:.4} K"), format!("by which the fit misses the solver at most (aim {TARGET} K)")).tone(tone),
        );
    }
    let open = material.checked.iter().map(|c| c.balance.2).fold(0.0, f64::max);
    if !material.checked.is_empty() {
        keys.push(KeyFigure::new(format!("{open:.0e}"), "largest heat imbalance, relative"));
    }
    section.key_figures(keys);
    if let Some(answered) = &summary.answered {
        section.note(Tone::Plain, answered.sentence());
    }
    if let Some(found) = summary.adaptation.as_ref().filter(|found| found.reached) {
        section.note(Tone::Good, found.sentence());
    }
    if material.fitted.is_some() {
        accuracy(section, material);
    }
}

/// How the sweep came to its accuracy, round by round.
fn rounds(section: &mut ReportSection, found: &Adaptation) {
    let mut table = ReportTable::new([
        ("runs", Align::Right),
        ("band ± [K]", Align::Right),
        ("of", Align::Left),
        ("predicted before they were solved", Align::Right),
        ("largest error [K]", Align::Right),
        ("of", Align::Left),
        ("in band", Align::Right),
    ]);
    let none = || text("–");
    for round in &found.rounds {
        let predicted = round.predicted.as_ref();
        table.row([
            text(round.runs.to_string()),
            text(significant(round.band, 2)),
            text(&round.point),
            predicted.map_or_else(none, |p| text(p.conditions.to_string())),
            predicted.map_or_else(none, |p| text(significant(p.error, 2))),
            predicted.map_or_else(none, |p| text(&p.point)),
            predicted.map_or_else(none, |p| text(format!("{:.1} %", 100.0 * p.share_in_band))),
        ]);
    }
    table.caption(format!(
        "Runs were added until bands and predictions were within {} K: each time where the fit was least sure, predicted by the fit \
         before they were solved",
        found.accuracy
    ));
    section.table(table);
}

fn accuracy(section: &mut ReportSection, material: &ReportInput<'_>) {
    let unit = material.summary.unit_of_errors();
    let errors = ["leave-one-out rms", "k-fold rms", "fit ±", "mesh ±", "held-out max", "held-out rms"];
    let in_unit = |of: &str| (unit.map_or_else(|| of.to_string(), |unit| format!("{of} [{unit}]")), Align::Right);
    let mut columns = vec![("measurement point".to_string(), Align::Left), ("model".into(), Align::Left)];
    columns.extend(errors.map(in_unit));
    columns.extend(unit.is_none().then(|| ("unit".into(), Align::Left)));
    columns.push(("in band".into(), Align::Right));
    let mut table = ReportTable::new(columns);
    let short = |value: f64| text(format!("{value:.1e}"));
    for point in &material.summary.points {
        let held = |f: fn(&(f64, f64, f64)) -> f64| point.held_out.as_ref().map_or_else(|| text("–"), |h| short(f(h)));
        let inside = point.held_out.map_or_else(|| text("–"), |h| text(format!("{:.1} %", 100.0 * h.2)));
        let k_fold = point.k_fold.map_or_else(|| text("–"), short);
        let mut row = vec![text(&point.name), text(&point.model), short(point.leave_one_out), k_fold, short(point.half_width)];
        row.extend([point.mesh.map_or_else(|| text("–"), short), held(|h| h.0), held(|h| h.1)]);
        row.extend(unit.is_none().then(|| text(&point.unit)));
        row.push(inside);
        table.row(row);
    }
    section.table(table);
    section.paragraph(
        "Leave-one-out errors are optimistic, since settings were chosen by them; the k-fold errors repeat the whole choice in every \
         fold and make the band of the fit; held-out conditions were never seen by any fit. All of these lie beside the solver's results \
         on its mesh; the error of the mesh itself is a part of its own in every answer.",
    );
    if let Some(found) = &material.summary.adaptation {
        rounds(section, found);
    }
    figures(section, material.gallery, "errors");
    figures(section, material.gallery, "parity");
    figures(section, material.gallery, "residuals");
}

fn provenance(section: &mut ReportSection, material: &ReportInput<'_>) -> Result<()> {
    let groups = material.swept.plan.groups.iter().map(|g| (g.name.clone(), g.description.clone()));
    section.facts(groups);
    section.facts(material.swept.table.provenance.iter().cloned());
    section.paragraph(format!("In this folder: sweep.csv and sweep.parquet with every condition, {SURROGATE} for queries and embedding, charts/ with every figure."));
    if let Some(fitted) = material.fitted {
        let surrogate = file::open(&fitted.bytes)?;
        let flag = |v: coldplate_runtime::Variable<'_>| {
            let value = format!("{} {}", compact(f64::midpoint(v.low, v.high), 4), v.unit);
            match condition::NAMES.contains(&v.name) {
                true => format!("--{} \"{value}\"", v.name.replace('_', "-")),
                false => format!("--at {}=\"{value}\"", v.name),
            }
        };
        section.code(format!("coldplate query {SURROGATE} {}", surrogate.variables().map(flag).collect::<Vec<_>>().join(" ")));
    }
    Ok(())
}
