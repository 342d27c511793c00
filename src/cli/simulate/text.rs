//! A simulation over time as text.

use super::super::text::{block, table};
use coldplate_base::numbers::{duration, significant};
use coldplate_base::units::Measurand;
use coldplate_explore::simulate::drift::{Drift, Tilt};
use coldplate_explore::simulate::{FirstPassings, History, LimitCourse, Passed, SimulatedMachine};
use coldplate_network::HeatMeter;

/// The history for a terminal; `seconds` is the time taken.
pub(super) fn text(model: &SimulatedMachine<'_>, history: &History, seconds: f64) -> String {
    let (start, end) = (history.times.first().copied().unwrap_or(0.0), history.times.last().copied().unwrap_or(0.0));
    let bounds = history.bounds.as_ref().map(|all| largest(all, model.sensors.len()));
    let mut text = format!("{}\n{} from {} to {}\n\n", model.name, duration(end - start), duration(start), duration(end));
    text += &sensors(model, history, bounds.as_deref());
    text += &heat_flows(model, history);
    let drifts: Vec<Vec<String>> = history.drifts(model).iter().map(drift_row).collect();
    text += &block(&["drift um", "range", "first hour", "to the end", "to steady", "within 10 % after"], &drifts);
    let tilts: Vec<Vec<String>> = history.tilts(model).iter().map(tilt_row).collect();
    text += &block(&["tilt urad", "about", "range", "first hour", "to the end", "to steady", "within 10 % after"], &tilts);
    text += &passes(model, history);
    let limits: Vec<Vec<String>> = history.limits.iter().map(limit_row).collect();
    text += &block(&["limit", "largest value", "at most", "margin", "when", "first broken at"], &limits);
    text += "\n";
    text += &settling(model, history);
    text + &match bounds {
        Some(bounds) => bounded(model, history, &bounds, seconds),
        None => balanced(model, history, seconds),
    }
}

fn is_mixed(model: &SimulatedMachine<'_>) -> bool {
    model.measurands.contains(&Measurand::Displacement)
}

/// Unit behind a reading: in a table with temperatures, displacements carry theirs.
fn unit(model: &SimulatedMachine<'_>, sensor: usize) -> String {
    if is_mixed(model) { format!(" {}", model.measurands[sensor].unit()) } else { String::new() }
}

/// Unit of differences of all readings.
fn kelvin(model: &SimulatedMachine<'_>) -> &'static str {
    if is_mixed(model) { "K (um)" } else { "K" }
}

fn sensors(model: &SimulatedMachine<'_>, history: &History, bounds: Option<&[f64]>) -> String {
    let row = |(s, name): (usize, &String)| {
        let shown = |r: &Vec<f64>| format!("{:.3}{}", model.measurands[s].shown(r[s]), unit(model, s));
        let at = |readings: Option<&Vec<f64>>| readings.map_or(String::new(), shown);
        let mut row = vec![
            name.clone(),
            at(history.readings.first()),
            at(history.readings.last()),
            at(history.steady.as_ref().ok()),
            history.settled[s].map_or("not reached".into(), duration),
        ];
        row.extend(bounds.map(|bounds| significant(bounds[s], 2)));
        row
    };
    let rows: Vec<Vec<String>> = model.sensors.iter().enumerate().map(row).collect();
    let [start, end, steady] = ["start", "end", "steady"].map(|what| what.to_string() + if is_mixed(model) { "" } else { " degC" });
    let near_after = format!("within {} {} after", history.within, kelvin(model));
    let bound = format!("bound {}", kelvin(model));
    let heading: Vec<&str> = ["sensor", &start, &end, &steady, &near_after].into_iter().chain(bounds.map(|_| &*bound)).collect();
    table(&heading, &rows)
}

fn heat_flows(model: &SimulatedMachine<'_>, history: &History) -> String {
    let row = |(m, meter): (usize, &HeatMeter)| {
        let at = |heats: Option<&Vec<f64>>| heats.map_or(String::new(), |heats| format!("{:+.3}", heats[m]));
        vec![meter.name.clone(), at(history.heat_flows.first()), at(history.heat_flows.last())]
    };
    block(&["heat flow", "start W", "end W"], &model.meters.iter().enumerate().map(row).collect::<Vec<_>>())
}

fn passes(model: &SimulatedMachine<'_>, history: &History) -> String {
    let row = |c: &FirstPassings| {
        let at = |passed: Option<Passed>| passed.map_or("never".into(), moment);
        let value = significant(model.measurands[c.watch.sensor].shown(c.watch.value), 4) + &unit(model, c.watch.sensor);
        vec![model.sensors[c.watch.sensor].clone(), value, at(c.rising), at(c.falling)]
    };
    let heading = ["passes", if is_mixed(model) { "" } else { "degC" }, "rising at", "falling at"];
    block(&heading, &history.passes.iter().map(row).collect::<Vec<_>>())
}

/// Whether and when the steady state of the last condition is reached.
fn settling(model: &SimulatedMachine<'_>, history: &History) -> String {
    let (near, kelvin) = (history.within, kelvin(model));
    match (&history.steady, history.settled_overall()) {
        (Err(reason), _) => format!("the last condition has no steady state to reach: {reason}\n"),
        (_, Some(after)) => {
            format!("every sensor stays within {near} {kelvin} of the steady state of the last condition after {}\n", duration(after))
        }
        (_, None) => {
            let late = history.settled.iter().filter(|s| s.is_none()).count();
            let of = history.settled.len();
            format!("not reached: {late} of {of} sensors do not stay within {near} {kelvin} of the steady state of the last condition\n")
        }
    }
}

/// Bounds of a reduced model or a surrogate.
fn bounded(model: &SimulatedMachine<'_>, history: &History, bounds: &[f64], seconds: f64) -> String {
    let widest = bounds.iter().zip(model.sensors).enumerate().max_by(|a, b| a.1.0.total_cmp(b.1.0));
    let widest = widest.map_or(String::new(), |(s, (bound, name))| {
        format!("largest bound {} {}, that of '{name}', ", significant(*bound, 2), model.measurands[s].unit_of_differences())
    });
    let cells = if model.cells > 0 { format!(" on {} cells", model.cells) } else { String::new() };
    format!("{widest}against the full model{cells}\n{} time steps, {seconds:.3} s\n", history.steps)
}

/// Heat balance of a run in full.
fn balanced(model: &SimulatedMachine<'_>, history: &History, seconds: f64) -> String {
    let energy = &history.energy;
    format!(
        "heat entered {} J, left {} J, stored {} J, open {:.1e}\n{} unknowns, {} time steps, {} tried again, {seconds:.2} s\n",
        significant(energy.entered, 6),
        significant(energy.left, 6),
        significant(energy.stored, 6),
        energy.relative(),
        model.nodes,
        history.steps,
        history.rejected
    )
}

/// A displacement's drift, for a reader.
fn drift_row(drift: &Drift) -> Vec<String> {
    vec![
        drift.sensor.clone(),
        format!("{:.2}", drift.range_um),
        format!("{:.2}", drift.first_hour_um),
        format!("{:+.2}", drift.end_um),
        drift.steady_um.map_or(String::new(), |um| format!("{um:+.2}")),
        drift.settled_s.map_or("not reached".into(), duration),
    ]
}

/// The drift of an angle, for a reader.
fn tilt_row(tilt: &Tilt) -> Vec<String> {
    vec![
        tilt.of.join(", "),
        tilt.about.clone(),
        format!("{:.2}", tilt.range_urad),
        format!("{:.2}", tilt.first_hour_urad),
        format!("{:+.2}", tilt.end_urad),
        tilt.steady_urad.map_or(String::new(), |urad| format!("{urad:+.2}")),
        tilt.settled_s.map_or("not reached".into(), duration),
    ]
}

/// The largest bound of each of so many sensors over time.
fn largest(bounds: &[Vec<f64>], sensors: usize) -> Vec<f64> {
    (0..sensors).map(|s| bounds.iter().map(|row| row[s]).fold(0.0, f64::max)).collect()
}

/// A time at which a value is passed, in words and in seconds, and its error if known.
fn moment(passed: Passed) -> String {
    let within = passed.within.map_or(String::new(), |within| format!(" +- {}", significant(within, 2)));
    format!("{} ({}{within} s)", duration(passed.at), significant(passed.at, 6))
}

/// A limit over the run, for a reader.
fn limit_row(limit: &LimitCourse) -> Vec<String> {
    let LimitCourse { largest, at, first_broken, bound } = limit;
    let band = bound.map_or(String::new(), |bound| format!(" +- {}", significant(bound, 2)));
    vec![
        largest.name.clone(),
        format!("{:.3}{band} {}", largest.shown(largest.value), largest.unit()),
        format!("{:.3} {}", largest.shown(largest.maximum), largest.unit()),
        format!("{:+.3} {}", largest.margin(), largest.measurand.unit_of_differences()),
        duration(*at),
        first_broken.map_or("never".into(), moment),
    ]
}
