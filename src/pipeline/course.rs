//! A simulation over time as a figure.

use crate::explore::simulate::{History, Subject};
use crate::figures::chart::history::{Course, HistoryFigure};
use crate::figures::chart::style::Quantity;
use crate::foundation::numbers::duration;
use crate::units::Measurand;

/// The readings of every sensor over time; `notes` are lines for the footer.
pub fn figure(model: &Subject<'_>, history: &History, notes: Vec<String>) -> HistoryFigure {
    let courses = model
        .sensors
        .iter()
        .enumerate()
        .map(|(s, name)| Course { name: name.clone(), values: history.readings.iter().map(|r| model.measurands[s].shown(r[s])).collect() });
    let start = history.times.first().copied().unwrap_or(0.0);
    HistoryFigure {
        title: model.name.to_string(),
        times: history.times.clone(),
        quantity: match (model.measurands.contains(&Measurand::Temperature), model.measurands.contains(&Measurand::Displacement)) {
            (false, true) => Quantity::new("displacement", "um"),
            (true, true) => Quantity::new("temperature in degC, displacement in um", ""),
            _ => Quantity::new("temperature", "degC"),
        },
        courses: courses.collect(),
        mark: history
            .settled_overall()
            .filter(|after| *after > 0.0)
            .map(|after| (start + after, format!("all within {} K of the steady state after {}", history.within, duration(after)))),
        notes,
    }
}
