//! The page of a drift test: displacements of the tool point along and about the axes while the machine warms up, as tests of
//! machine tools report them (ISO 230-3).

use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::{duration, significant};
use coldplate_base::units::Measurand;
use coldplate_explore::simulate::drift::{Drift, Tilt};
use coldplate_explore::simulate::{History, SimulatedMachine};
use coldplate_figures::chart::history::{HistoryFigure, HistoryLine};
use coldplate_figures::chart::style::Quantity;
use coldplate_figures::report::{Align, KeyFigure, Report, ReportSection, ReportTable, TableCell};

/// Most stretches of one condition that are listed, a count. Chosen: a page that can be read.
const MOST: usize = 40;

/// Results that a drift test reports and no thermal model has.
const NOT_HERE: [&str; 5] = [
    "Scatter: noise and resolution of the probes, and repeatability of positioning. A model gives the same figure every time.",
    "What controls do: backlash, hysteresis, feedback by scales, the pitch of screws between two targets, and compensation that is \
     switched on. The distance of an axis between its targets is a displacement of two points here, without its drive.",
    "Movements of the spindle itself at speed: run-out, unbalance, and the shift of a rotor in bearings that are preloaded.",
    "What the shop does: draughts, warm walls, doors and people, beyond the ambient temperature that the schedule has.",
    "Readings of the machine as it was built. Figures here are as good as the machine file; identify and diagnose hold it against \
     measured ones.",
];

/// Checks that there is a displacement to report.
///
/// # Errors
/// No reading is a displacement.
pub fn check(measurands: &[Measurand]) -> Result<()> {
    if measurands.contains(&Measurand::Displacement) {
        return Ok(());
    }
    let help = "a machine file states them under [displacement.NAME]; a surrogate has those of the machine it was fitted for";
    Err(Error::input("there is no displacement to report").at_key("--report").help(help))
}

/// The page of a history of `model`; `schedule` names the schedule that was run.
///
/// # Errors
/// The model has no displacement, or a figure cannot be drawn.
pub fn report(model: &SimulatedMachine<'_>, history: &History, schedule: &str) -> Result<Report> {
    check(model.measurands)?;
    let (drifts, tilts) = (history.drifts(model), history.tilts(model));
    let (start, end) = (history.times.first().copied().unwrap_or(0.0), history.times.last().copied().unwrap_or(0.0));
    let mut report = Report::new(model.name);
    report.subtitle(format!("Thermal drift over {}, {schedule}", duration(end - start)));
    report.footer(format!("coldplate {}, machine {}", env!("CARGO_PKG_VERSION"), model.hash));
    summary(report.section("Drift"), history, &drifts, &tilts);
    courses(report.section("Over time"), model, history)?;
    let stretches = stretches(history);
    conditions(report.section("What was run"), model, history, &stretches);
    report.section("What these figures have, and what not").paragraph(
        "Ranges are largest less smallest value at the outputs of the run. Positive is along the direction of each displacement; an angle \
         is positive to the right about its axis. Drift that the ambient temperature makes alone is a schedule in which nothing else \
         changes. Not in a thermal model are:",
    ).list(NOT_HERE);
    Ok(report)
}

fn summary(section: &mut ReportSection, history: &History, drifts: &[Drift], tilts: &[Tilt]) {
    section.key_figures(drifts.iter().map(|d| KeyFigure::new(format!("{:.1} um", d.range_um), format!("range of {}", d.sensor))));
    section.table(figures(
        "displacement, um",
        drifts.iter().map(|d| (d.sensor.clone(), [d.range_um, d.first_hour_um, d.end_um], d.steady_um, d.settled_s)),
    ));
    if !tilts.is_empty() {
        section.table(figures(
            "angle, urad (um per m)",
            tilts.iter().map(|t| {
                let name = format!("about {}: {} and {}, {} mm apart", t.about, t.of[0], t.of[1], significant(1e3 * t.apart_m, 4));
                (name, [t.range_urad, t.first_hour_urad, t.end_urad], t.steady_urad, t.settled_s)
            }),
        ));
    }
    if let Err(reason) = &history.steady {
        section.paragraph(format!("The last condition has no steady state to reach: {reason}."));
    }
}

/// Row of the table: name; range, change in the first hour and change to the end; change to the steady state; time at
/// which little of it is left.
type Figures = (String, [f64; 3], Option<f64>, Option<f64>);

fn figures(title: &str, rows: impl Iterator<Item = Figures>) -> ReportTable {
    let right = Align::Right;
    let mut table = ReportTable::new([
        (title, Align::Left),
        ("range", right),
        ("in the first hour", right),
        ("to the end", right),
        ("to the steady state", right),
        ("within 10 % of it after", right),
    ]);
    for (name, ways, steady, settled) in rows {
        let ways = ways.map(|way| TableCell::number(way, 2));
        let settled = settled.map_or("not reached".to_string(), duration);
        table.row([TableCell::from(name)].into_iter().chain(ways).chain([TableCell::optional(steady, 2), settled.into()]));
    }
    table
}

/// Figures of displacements from their start, and of temperatures.
fn courses(section: &mut ReportSection, model: &SimulatedMachine<'_>, history: &History) -> Result<()> {
    for (measurand, title, quantity) in [
        (Measurand::Displacement, "Drift from the beginning", Quantity::new("drift", "um")),
        (Measurand::Temperature, "Temperatures", Quantity::new("temperature", "degC")),
    ] {
        let own = model.sensors.iter().enumerate().filter(|(s, _)| model.measurands[*s] == measurand);
        let course = |(s, name): (usize, &String)| {
            let begun = if measurand == Measurand::Displacement { history.readings.first().map_or(0.0, |r| r[s]) } else { 0.0 };
            HistoryLine { name: name.clone(), values: history.readings.iter().map(|r| measurand.shown(r[s]) - begun).collect() }
        };
        let courses: Vec<HistoryLine> = own.map(course).collect();
        if !courses.is_empty() {
            let figure = HistoryFigure { title: title.into(), times: history.times.clone(), quantity, courses, ..HistoryFigure::default() };
            section.figure(&figure, "")?;
        }
    }
    Ok(())
}

/// Outputs between two steps of the schedule, first and last.
fn stretches(history: &History) -> Vec<(usize, usize)> {
    let (mut all, mut from) = (Vec::new(), 0);
    for i in 1..=history.times.len() {
        // A step has two outputs at one time.
        if history.times.get(i).is_none_or(|time| *time <= history.times[i - 1]) {
            all.push((from, i - 1));
            from = i;
        }
    }
    all.retain(|(from, to)| history.times[*to] > history.times[*from]);
    all
}

/// Table of the condition of every stretch, and the change of each displacement in it.
fn conditions(section: &mut ReportSection, model: &SimulatedMachine<'_>, history: &History, stretches: &[(usize, usize)]) {
    let moving: Vec<usize> = (0..model.sensors.len()).filter(|s| model.measurands[*s] == Measurand::Displacement).collect();
    let held = |v: usize| history.conditions.iter().all(|c| c.si()[v] == history.conditions[0].si()[v]);
    let (held, changed): (Vec<usize>, Vec<usize>) = (0..model.variables.len()).partition(|v| held(*v));
    section.facts(held.iter().map(|v| {
        let variable = &model.variables[*v];
        (variable.name.replace('_', " "), variable.with_unit(history.conditions[0].si()[*v], 4))
    }));
    let titles =
        ["from".to_string(), "to".to_string()].into_iter().chain(changed.iter().map(|v| model.variables[*v].name.replace('_', " ")));
    let titles = titles.chain(moving.iter().map(|s| format!("{}, um", model.sensors[*s])));
    let mut table = ReportTable::new(titles.map(|title| (title, Align::Right)));
    table.caption("Every stretch of the schedule between two steps, and how far each displacement went in it");
    for (from, to) in stretches.iter().take(MOST) {
        let value = |v: &usize| {
            let shown = [*from, *to].map(|i| model.variables[*v].with_unit(history.conditions[i].si()[*v], 4));
            TableCell::from(if shown[0] == shown[1] { shown[0].clone() } else { shown.join(" to ") })
        };
        let way = |s: &usize| TableCell::number(history.readings[*to][*s] - history.readings[*from][*s], 2);
        let times = [*from, *to].map(|i| TableCell::from(duration(history.times[i] - history.times[0])));
        table.row(times.into_iter().chain(changed.iter().map(value)).chain(moving.iter().map(way)));
    }
    section.table(table);
    if stretches.len() > MOST {
        section.paragraph(format!("Not listed are the {} stretches that follow.", stretches.len() - MOST));
    }
}
