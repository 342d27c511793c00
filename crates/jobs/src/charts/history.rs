//! A simulation over time as a figure.

use coldplate_base::numbers::duration;
use coldplate_base::units::Measurand;
use coldplate_explore::simulate::{History, LimitCourse, SimulatedMachine};
use coldplate_figures::chart::history::{HistoryFigure, HistoryLine};
use coldplate_figures::chart::style::Quantity;

/// The readings of every sensor over time; `notes` are lines for the footer, followed by the state of the machine's limits. A dashed
/// line marks the time at which the first limit is broken, or, if none is, at which all sensors have settled.
pub fn figure(model: &SimulatedMachine<'_>, history: &History, mut notes: Vec<String>) -> HistoryFigure {
    let broken: Vec<(&LimitCourse, f64)> =
        history.limits.iter().filter_map(|limit| limit.first_broken.map(|passed| (limit, passed.at))).collect();
    let first = broken.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let broken_first = first.map(|(limit, at)| (*at, format!("limit '{}' broken at {}", limit.largest.name, duration(*at))));
    notes.extend(broken.iter().map(|(limit, at)| {
        let LimitCourse { largest, .. } = limit;
        let shown = |value: f64| format!("{:.2} {}", largest.shown(value), largest.unit());
        let name = &largest.name;
        format!("limit '{name}': {} allowed, largest {}, broken at {}", shown(largest.maximum), shown(largest.value), duration(*at))
    }));
    if broken.is_empty() && !history.limits.is_empty() {
        notes.push("all limits are kept".to_string());
    }
    let courses = model.sensors.iter().enumerate().map(|(s, name)| HistoryLine {
        name: name.clone(),
        values: history.readings.iter().map(|r| model.measurands[s].shown(r[s])).collect(),
    });
    let start = history.times.first().copied().unwrap_or(0.0);
    let settled = || {
        let after = history.settled_overall().filter(|after| *after > 0.0)?;
        Some((start + after, format!("all within {} K of the steady state after {}", history.within, duration(after))))
    };
    HistoryFigure {
        title: model.name.to_string(),
        times: history.times.clone(),
        quantity: match (model.measurands.contains(&Measurand::Temperature), model.measurands.contains(&Measurand::Displacement)) {
            (false, true) => Quantity::new("displacement", "um"),
            (true, true) => Quantity::new("temperature in degC, displacement in um", ""),
            _ => Quantity::new("temperature", "degC"),
        },
        courses: courses.collect(),
        mark: broken_first.or_else(settled),
        notes,
    }
}
