//! The report of a job. Its first screen answers the question of the sweep; charts, causes, measured states and details follow,
//! and how well the solver did comes last.

mod details;
mod first_screen;
mod statistics;

use std::path::Path;

use super::designs::FittedDesigns;
use super::figures::short_hash;
use super::gallery::Gallery;
use super::measured::CheckedState;
use super::summary::Summary;
use coldplate_base::error::Result;
use coldplate_describe::machine::NumberKind;
use coldplate_explore::sweep::Swept;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::report::{Align, Report, ReportSection, ReportTable, TableCell, Tone};
use coldplate_solve::meshed::Inventory;
use coldplate_solve::sensitivity::assumed;
use coldplate_surrogate::fit::file;
use coldplate_surrogate::verdict::{self, Acceptability, indices};

/// Input of the report.
pub(super) struct ReportInput<'a> {
    pub(super) sweep: &'a Sweep,
    pub(super) swept: &'a Swept,
    pub(super) fitted: Option<&'a FittedDesigns>,
    pub(super) checked: &'a [CheckedState],
    /// Inventory of the machine, if this program solved it.
    pub(super) inventory: Option<&'a Inventory>,
    pub(super) gallery: &'a Gallery,
    pub(super) summary: &'a Summary,
}

/// Writes the page.
///
/// # Errors
/// The surrogate cannot be queried, or the file cannot be written.
pub(super) fn write(path: &Path, material: &ReportInput<'_>) -> Result<()> {
    let scope = &material.sweep.scope;
    let mut report = Report::new(&scope.name);
    report.subtitle(format!(
        "{}: {} conditions {}",
        material.sweep.plan.name,
        material.summary.conditions.0,
        material.sweep.solver_in_words()
    ));
    let hashed = if material.sweep.program().is_some() { "solver" } else { "machine file" };
    report.footer(format!("coldplate {}, {hashed} {}", env!("CARGO_PKG_VERSION"), short_hash(&scope.hash)));
    first_screen::write(report.section("The answer"), material)?;
    charts(report.section("Charts"), material)?;
    let gallery = material.gallery;
    if material.fitted.is_some() || ["causes", "sankey", "heat"].iter().any(|topic| gallery.has(topic)) {
        causes(report.section("What makes the temperatures"), material)?;
    }
    if !material.checked.is_empty() {
        measured(report.section("Measured beside predicted"), material);
    }
    details::write(report.section("Details"), material);
    statistics::write(report.section("Solver and fit"), material)?;
    report.write(path)
}

fn text(value: impl Into<String>) -> TableCell {
    TableCell::from(value.into())
}

fn figures(section: &mut ReportSection, gallery: &Gallery, topic: &str) {
    for entry in gallery.of(topic) {
        // The title stands in the picture.
        section.svg(&entry.svg, "");
    }
}

/// Maps, conditions in words, curves along one variable, and the sheet for the wall.
fn charts(section: &mut ReportSection, material: &ReportInput<'_>) -> Result<()> {
    let gallery = material.gallery;
    figures(section, gallery, "acceptability");
    conditions(section, material)?;
    section.folded("The sheet for the wall", |inside| figures(inside, gallery, "operator_sheet"));
    for topic in ["published", "one_factor", "scan"] {
        figures(section, gallery, topic);
    }
    section.folded("Polynomials in one variable, the others held", |inside| formulas(inside, material));
    let count = gallery.of("slices").count();
    section.folded(format!("The surrogate along each variable: {count} figures"), |inside| figures(inside, gallery, "slices"));
    Ok(())
}

/// A few conditions answered in words.
fn conditions(section: &mut ReportSection, material: &ReportInput<'_>) -> Result<()> {
    let Some(fitted) = material.fitted else { return Ok(()) };
    let surrogate = file::open(&fitted.bytes)?;
    if surrogate.limit_count() == 0 {
        return Ok(());
    }
    let variables: Vec<Quantity> = surrogate.variables().map(|v| Quantity::new(v.name, v.unit)).collect();
    let columns = [("condition", Align::Left), ("verdict", Align::Left), ("limit that decides", Align::Left), ("margin [K]", Align::Right)];
    let mut table = ReportTable::new(columns);
    let ranges: Vec<(f64, f64)> = surrogate.variables().map(|v| (v.low, v.high)).collect();
    // Corners and middle of the first three variables tell most; other variables stay in the middle.
    for share in [[0.5, 0.5, 0.5], [0.0, 0.5, 0.0], [0.0, 0.5, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.5, 0.5, 0.8]] {
        let at = |(i, (low, high)): (usize, &(f64, f64))| low + (high - low) * share.get(i).copied().unwrap_or(0.5);
        let x: Vec<f64> = ranges.iter().enumerate().map(at).collect();
        let answer = verdict::query(&surrogate, &x)?;
        let (word, tone) = match answer.verdict {
            Acceptability::Acceptable => ("acceptable", Tone::Good),
            Acceptability::NotAcceptable => ("not acceptable", Tone::Bad),
            Acceptability::Uncertain => ("uncertain", Tone::Uncertain),
        };
        let margin = answer.binding.and_then(|i| answer.limits.get(i)).map(|l| l.margin);
        let words: Vec<String> = variables.iter().zip(&x).map(|(q, v)| q.named(*v)).collect();
        let cells =
            [text(words.join(", ")), text(word).tone(tone), text(answer.binding_name().unwrap_or("none")), TableCell::optional(margin, 3)];
        table.row(cells);
    }
    table.folded("Some conditions in words");
    section.table(table);
    Ok(())
}

fn formulas(section: &mut ReportSection, material: &ReportInput<'_>) {
    if material.summary.formulas.is_empty() {
        return;
    }
    section.paragraph("y in °C. A polynomial that changes nowhere by a thousandth of a kelvin is a constant, and has no R².");
    let mut group = "";
    let mut tables: Vec<(String, ReportTable)> = Vec::new();
    for formula in &material.summary.formulas {
        if formula.group != group {
            group = &formula.group;
            let columns = [("measurement point", Align::Left), ("formula", Align::Left), ("R²", Align::Right), ("rms [K]", Align::Right)];
            tables.push((format!("{group}: x is {}", formula.variable), ReportTable::new(columns)));
        }
        if let Some((_, table)) = tables.last_mut() {
            table.row([
                text(&formula.point),
                text(&formula.text),
                text(formula.r_squared_in_words().unwrap_or_else(|| "–".into())),
                text(formula.rms_in_words()),
            ]);
        }
    }
    for (heading, mut table) in tables {
        table.caption(heading);
        section.table(table);
    }
}

/// The ways of the heat, and Sobol' indices of every limit and point.
fn causes(section: &mut ReportSection, material: &ReportInput<'_>) -> Result<()> {
    for topic in ["causes", "sankey", "heat"] {
        figures(section, material.gallery, topic);
    }
    let Some(fitted) = material.fitted else { return Ok(()) };
    let surrogate = file::open(&fitted.bytes)?;
    let found = indices::indices(&surrogate, &vec![None; surrogate.variable_count()])?;
    section.paragraph(format!(
        "Shares of the variance over the fitted ranges and the machine's uncertain numbers (Sobol' indices). The first is what would go \
         if this alone were known; in brackets, what would be left if all else were known. Shares below 2 % are left out; the standard \
         error is {:.1} % at most.",
        100.0 * found.error
    ));
    for (is_limit, what) in [(true, "limit"), (false, "measurement point")] {
        let columns = [(what, Align::Left), ("standard deviation [K]", Align::Right), ("decided by, %", Align::Left)];
        let mut table = ReportTable::new(columns);
        let rows: Vec<_> = found.quantities.iter().filter(|own| own.is_limit == is_limit).collect();
        for own in &rows {
            let share = |(factor, index): (&indices::Factor, indices::SobolIndex)| {
                let assumed = if factor.is_assumed { ", assumed" } else { "" };
                let (first, total) = (100.0 * index.first_order.max(0.0), 100.0 * index.total);
                format!("{} {first:.0} ({total:.0}{assumed})", factor.name.replace('_', " "))
            };
            let shares: Vec<String> = own.ranked(&found.factors, 0.02).into_iter().map(share).collect();
            table.row([text(&own.name), TableCell::number(own.deviation, 3), text(shares.join(" · "))]);
        }
        if !is_limit {
            table.folded(format!("{} points, one by one", rows.len()));
        }
        if !rows.is_empty() {
            section.table(table);
        }
    }
    Ok(())
}

fn measured(section: &mut ReportSection, material: &ReportInput<'_>) {
    let figures: Vec<_> = material.gallery.of("state").zip(material.gallery.of("state heat")).collect();
    for (check, (figure, heat)) in material.checked.iter().zip(figures) {
        section.heading(format!("{}: {}", check.machine, check.name));
        let columns = [
            ("sensor", Align::Left),
            ("measured [°C]", Align::Right),
            ("predicted [°C]", Align::Right),
            ("95 % band ± [K]", Align::Right),
            ("difference [K]", Align::Right),
            ("published simulation [°C]", Align::Right),
        ];
        let mut table = ReportTable::new(columns);
        for row in &check.rows {
            let cells = [
                text(&row.name),
                TableCell::number(row.measured, 2),
                TableCell::number(row.predicted, 2),
                TableCell::number(row.band, 2),
                TableCell::number(row.predicted - row.measured, 2),
                TableCell::optional(row.other, 2),
            ];
            table.row(cells);
        }
        section.svg(&figure.svg, "");
        section.folded(format!("{} sensors, number by number, and the heat of this state", check.rows.len()), |inside| {
            if !check.note.is_empty() {
                inside.note(Tone::Plain, check.note.trim());
            }
            inside.table(table).svg(&heat.svg, "");
        });
    }
    section.folded("How these numbers are made", |inside| {
        inside.paragraph(
            "Every measured state of the machine file, solved in full at its own condition. This run fits nothing; where a number of the \
             machine file was chosen with readings in view, the assumptions below say so, and agreement there is no proof.",
        );
        let share = |kind: NumberKind| format!("{:.0} % on all {}", 100.0 * assumed(kind), kind.word());
        inside.paragraph(format!(
            "The band counts what the machine file calls uncertain and what its model misses. Of the kinds of numbers of which the file \
             states nothing it assumes what is known of such machines before anything is measured: {}.",
            NumberKind::ALL.map(share).join(", ")
        ));
    });
}
