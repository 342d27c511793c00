//! The report of a job: its question, its results, how far they can be trusted, and the assumptions.

use std::path::Path;

use super::adaptive::Adaptation;
use super::designs::FittedDesigns;
use super::figures as figures_of;
use super::gallery::Gallery;
use super::measured::CheckedState;
use super::summary::{SURROGATE, Summary, TARGET};
use coldplate_base::condition;
use coldplate_base::error::Result;
use coldplate_base::numbers::{compact, significant};
use coldplate_describe::machine::{Machine, NumberKind};
use coldplate_explore::sweep::Swept;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::chart::title_and_footer::fixed_conditions;
use coldplate_figures::report::{Align, KeyFigure, Report, ReportSection, ReportTable, TableCell, Tone};
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
    report.footer(format!("coldplate {}, {hashed} {}", env!("CARGO_PKG_VERSION"), scope.hash));
    summary(report.section("Summary"), material);
    if material.fitted.is_some() {
        acceptability(report.section("Is a condition acceptable?"), material)?;
        deciding(report.section("What decides the temperatures"), material)?;
    }
    if !material.checked.is_empty() {
        measured(report.section("Predicted beside measured"), material);
    }
    if !material.summary.formulas.is_empty() {
        one_factor(report.section("One variable at a time"), material);
    }
    if material.fitted.is_some() {
        slices(report.section("The surrogate along each variable"), material.gallery);
        accuracy(report.section("How far the surrogate can be trusted"), material);
    }
    let machine = report.section("The machine");
    for topic in ["machine", "sankey", "heat", "measured", "scan"] {
        figures(machine, material.gallery, topic);
    }
    if let Some(found) = material.inventory {
        inventory(machine, found);
    }
    if let Some(study) = material.sweep.study() {
        assumptions(report.section("What was assumed"), &study.model.machine);
    }
    provenance(report.section("Where the numbers come from"), material)?;
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

fn summary(section: &mut ReportSection, material: &ReportInput<'_>) {
    let study = material.sweep.study();
    if let Some(study) = study {
        section.paragraph(study.model.machine.description.trim());
    }
    let failed = material.summary.failures.len();
    let mut keys: Vec<KeyFigure> = known(material.summary).into_iter().collect();
    keys.push(KeyFigure::new(material.summary.conditions.0.to_string(), "conditions solved in full"));
    keys.push(match (study, material.sweep.program()) {
        (_, Some(program)) => KeyFigure::new(&program.name, format!("solved them, version {}", program.version())),
        (study, None) => KeyFigure::new(study.map_or(0, |study| study.model.network.nodes).to_string(), "unknowns each"),
    });
    if let Some(worst) = material.summary.worst_held_out() {
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
    if failed > 0 {
        section.note(Tone::Bad, format!("{failed} conditions failed; failures.csv has the reasons. They are in no table and no fit."));
    }
    if let Some(answered) = &material.summary.answered {
        section.note(Tone::Plain, answered.sentence());
    }
    if let Some(found) = &material.summary.adaptation {
        section.note(if found.reached { Tone::Good } else { Tone::Bad }, found.sentence());
    }
    for warning in material.inventory.iter().flat_map(|inventory| &inventory.warnings) {
        section.note(Tone::Uncertain, warning);
    }
    for note in &material.summary.notes {
        section.note(Tone::Plain, note);
    }
}

/// How well the machine is known: its measured readings, and the error of the mesh. The error of the fit says nothing of it.
fn known(summary: &Summary) -> [KeyFigure; 2] {
    let measured = match &summary.known {
        Some(known) => {
            let tone = if known.inside == known.readings { Tone::Good } else { Tone::Uncertain };
            let off =
                format!("measured readings inside their band; the worst is {} K off ({})", significant(known.distance, 2), known.worst);
            KeyFigure::new(format!("{} of {}", known.inside, known.readings), off).tone(tone)
        }
        None => KeyFigure::new("none", "measured readings: the numbers of the machine file stand unproved").tone(Tone::Uncertain),
    };
    let temperatures = summary.points.iter().filter(|p| p.unit == "K").filter_map(|p| Some((p.mesh?, &p.name)));
    let mesh = match temperatures.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((error, name)) => KeyFigure::new(format!("{} K", significant(error, 2)), format!("error of the mesh at most ({name})")),
        None => KeyFigure::new("–", "error of the mesh: not known"),
    };
    [measured, mesh]
}

/// Maps, the sheet, and a few conditions answered in words.
fn acceptability(section: &mut ReportSection, material: &ReportInput<'_>) -> Result<()> {
    let Some(fitted) = material.fitted else { return Ok(()) };
    let surrogate = file::open(&fitted.bytes)?;
    if surrogate.limit_count() == 0 {
        section.paragraph("The machine file has no limits, so nothing is acceptable or not.");
        return Ok(());
    }
    section.paragraph(match surrogate.uncertainty() {
        Some(_) => {
            "A condition is acceptable if all limits are kept with a probability of at least 95 %, not acceptable if with at most 5 %, \
             and uncertain otherwise. Outside the fitted range nothing is ever called acceptable."
        }
        None => {
            "A condition is acceptable if every limit is kept even at the unfavourable end of its band, not acceptable if some limit is \
             broken even at the favourable end, and uncertain otherwise. Outside the fitted range nothing is ever called acceptable."
        }
    });
    let held = figures_of::always(&surrogate);
    if !held.is_empty() {
        let reach = match surrogate.followed() {
            [] => "All of this, and the surrogate file, is for these values alone.",
            _ => {
                "All of this is for these values; the surrogate file answers for others too, within the ranges that `coldplate info` shows."
            }
        };
        section.note(Tone::Plain, format!("{}. {reach}", fixed_conditions(&held)));
    }
    figures(section, material.gallery, "acceptability");
    section.heading("Some conditions");
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
        let words: Vec<String> =
            variables.iter().zip(&x).map(|(q, v)| format!("{} {}", q.name.replace('_', " "), q.with_value(*v))).collect();
        let cells =
            [text(words.join(", ")), text(word).tone(tone), text(answer.binding_name().unwrap_or("none")), TableCell::optional(margin, 3)];
        table.row(cells);
    }
    section.table(table);
    section.folded("The sheet for the wall", |inside| figures(inside, material.gallery, "operator_sheet"));
    Ok(())
}

/// Sobol' indices of every limit and point.
fn deciding(section: &mut ReportSection, material: &ReportInput<'_>) -> Result<()> {
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
        if rows.len() > 12 {
            table.folded(format!("{} points, one by one", rows.len()));
        }
        if !rows.is_empty() {
            section.table(table);
        }
    }
    Ok(())
}

fn measured(section: &mut ReportSection, material: &ReportInput<'_>) {
    section.paragraph(
        "Every measured state of the machine file, solved in full at its own condition. This run fits nothing; where a number of the machine \
         file was chosen with readings in view, the assumptions below say so, and agreement there is no proof.",
    );
    let share = |kind: NumberKind| format!("{:.0} % on all {}", 100.0 * assumed(kind), kind.word());
    section.paragraph(format!(
        "The band counts what the machine file calls uncertain and what its model misses. Of the kinds of numbers of which the file states nothing \
         it assumes what is known of such machines before anything is measured: {}.",
        NumberKind::ALL.map(share).join(", ")
    ));
    let figures: Vec<_> = material.gallery.of("state").zip(material.gallery.of("state heat")).collect();
    for (check, (figure, heat)) in material.checked.iter().zip(figures) {
        section.heading(format!("{}: {}", check.machine, check.name));
        section.paragraph(format!("At {}.", check.condition));
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
        let rows = check.rows.len();
        if rows > 6 {
            table.folded(format!("{rows} sensors, number by number"));
        }
        section.table(table);
        if !check.note.is_empty() {
            section.note(Tone::Plain, check.note.trim());
        }
        let (into, out, open) = check.balance;
        section.svg(&figure.svg, "");
        section.svg(&heat.svg, format!("{into:.3} W in, {out:.3} W out, {open:.0e} of it open."));
    }
}

fn one_factor(section: &mut ReportSection, material: &ReportInput<'_>) {
    section.paragraph("Polynomials in one variable, the others held, in the form the paper prints its Tables 7 to 10; y in °C.");
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
                TableCell::number(formula.r_squared, 5),
                text(format!("{:.1e}", formula.rms)),
            ]);
        }
    }
    for (heading, mut table) in tables {
        table.folded(heading);
        section.table(table);
    }
    figures(section, material.gallery, "one_factor");
    figures(section, material.gallery, "published");
}

fn slices(section: &mut ReportSection, gallery: &Gallery) {
    section.paragraph("Lines through the middle of the fitted range, with the bands that their captions name.");
    let count = gallery.of("slices").count();
    section.folded(format!("{count} figures, one variable after the other"), |inside| figures(inside, gallery, "slices"));
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
    if material.summary.points.len() > 12 {
        table.folded(format!("{} points, number by number", material.summary.points.len()));
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

fn inventory(section: &mut ReportSection, found: &Inventory) {
    let mut parts = ReportTable::new([
        ("part", Align::Left),
        ("material", Align::Left),
        ("mass [kg]", Align::Right),
        ("radiating [m²]", Align::Right),
        ("cells", Align::Right),
    ]);
    for part in &found.parts {
        parts.row([
            text(&part.name),
            text(&part.material),
            TableCell::number(part.mass, 2),
            TableCell::number(part.radiating_area, 4),
            text(part.cells.to_string()),
        ]);
    }
    parts.folded(format!("{} parts", found.parts.len()));
    section.table(parts);
    let mut contacts = ReportTable::new([
        ("contact", Align::Left),
        ("between", Align::Left),
        ("true area [m²]", Align::Right),
        ("hA [W/K]", Align::Right),
    ]);
    for contact in &found.contacts {
        let conductance = if contact.conductance.is_finite() { TableCell::number(contact.conductance, 3) } else { text("bonded") };
        contacts.row([text(&contact.name), text(contact.between.join(" – ")), TableCell::number(contact.area, 5), conductance]);
    }
    contacts.folded(format!("{} contacts", found.contacts.len()));
    section.table(contacts);
    let mut channels = ReportTable::new([
        ("channel", Align::Left),
        ("length [m]", Align::Right),
        ("Re", Align::Right),
        ("h [W/(m² K)]", Align::Right),
        ("pressure drop [kPa]", Align::Right),
    ]);
    for channel in &found.channels {
        let kilopascal = channel.pressure_drop.map(|p| p / 1e3);
        channels.row([
            text(&channel.name),
            TableCell::number(channel.length, 3),
            TableCell::optional(channel.reynolds, 0),
            TableCell::optional(channel.film, 0),
            TableCell::optional(kilopascal, 2),
        ]);
    }
    if !channels.is_empty() {
        channels.caption("Channels, at the middle of the swept ranges");
        section.table(channels);
    }
    let mut sources = ReportTable::new([("source", Align::Left), ("heat [W]", Align::Right)]);
    for source in &found.sources {
        sources.row([text(&source.name), TableCell::optional(source.power, 3)]);
    }
    if !sources.is_empty() {
        sources.caption("Heat sources, at the middle of the swept ranges");
        section.table(sources);
    }
}

fn assumptions(section: &mut ReportSection, machine: &Machine) {
    let assumed = &machine.assumptions;
    if assumed.is_empty() {
        section.paragraph("The machine file marks no number as assumed.");
        return;
    }
    let mut table = ReportTable::new([("what", Align::Left), ("value", Align::Left), ("because", Align::Left)]);
    for assumption in assumed {
        table.row([text(&assumption.key), text(&assumption.value), text(&assumption.reason)]);
    }
    table.folded(format!("{} numbers of the machine file, each with its reason", assumed.len()));
    section.table(table);
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
