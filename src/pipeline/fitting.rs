//! From a table to a surrogate with limits and provenance.

use crate::describe::machine::{self, Machine};
use crate::error::{Error, Result};
use crate::foundation::table::Table;
use crate::surrogate::fit::model::{Limit, LimitKind, Surrogate, Variable};
use crate::surrogate::fit::{self, Fit, FitOptions, Output, Samples};
use crate::units::{Celsius, Kelvin};

/// A condition variable that a table holds at one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value.
    pub value: f64,
}

/// The samples of a table: its varying condition variables and its outputs, and what it holds fixed.
///
/// # Errors
/// No condition variable varies, or there is no output.
pub fn samples(table: &Table) -> Result<(Samples, Vec<Held>)> {
    let (mut variables, mut varying, mut held) = (Vec::new(), Vec::new(), Vec::new());
    for column in table.conditions() {
        let present = column.values.iter().filter(|v| v.is_finite());
        let (low, high) = present.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        if high > low {
            variables.push(Variable { name: column.name.clone(), unit: column.unit.clone(), low, high });
            varying.push(column);
        } else if low.is_finite() {
            held.push(Held { name: column.name.clone(), unit: column.unit.clone(), value: low });
        }
    }
    if variables.is_empty() {
        return Err(Error::input("no condition variable of this table varies, so there is nothing to fit against").help(
            "condition columns are coolant_flow, coolant_temperature, motor_speed and ambient_temperature, with their units, \
             or those named by --input",
        ));
    }
    let rows = (0..table.rows()).map(|row| varying.iter().map(|c| c.values[row]).collect()).collect();
    let outputs = table.outputs().iter().map(|c| Output { name: c.name.clone(), unit: c.unit.clone(), values: c.values.clone() }).collect();
    Ok((Samples { variables, rows, outputs }, held))
}

/// Fits a table and adds the machine's limits, what was held, and where the numbers come from.
///
/// # Errors
/// As [`samples`] and [`fit::fit`].
pub fn fit_table(table: &Table, machine: Option<&Machine>, options: &FitOptions) -> Result<Fit> {
    let (samples, held) = samples(table)?;
    let mut fit = fit::fit(&samples, options)?;
    if let Some(machine) = machine {
        let (limits, notes) = limits(machine, &fit.surrogate);
        fit.surrogate.limits = limits;
        fit.notes.extend(notes);
    }
    let provenance = &mut fit.surrogate.provenance;
    provenance.extend(table.provenance.iter().cloned());
    if !provenance.iter().any(|(key, _)| key == "program") {
        provenance.push(("program".into(), format!("coldplate {}", env!("CARGO_PKG_VERSION"))));
    }
    provenance.push(("conditions".into(), table.rows().to_string()));
    provenance.extend(held.into_iter().map(|h| (format!("held {}", h.name), format!("{} {}", h.value, h.unit))));
    Ok(fit)
}

/// The limits of a machine in the surrogate's points and units; notes name those that cannot be carried over.
fn limits(machine: &Machine, surrogate: &Surrogate) -> (Vec<Limit>, Vec<String>) {
    let (mut limits, mut notes) = (Vec::new(), Vec::new());
    let point = |sensor: usize| surrogate.points.iter().position(|p| p.name == machine.sensors[sensor].name);
    let ambient = surrogate.variables.iter().position(|v| v.name == "ambient_temperature");
    for limit in &machine.limits {
        let kind = match &limit.kind {
            machine::LimitKind::Maximum(s) => point(*s).map(LimitKind::Maximum),
            machine::LimitKind::RiseOverAmbient(s) => point(*s).zip(ambient).map(|(p, a)| LimitKind::Rise(p, a)),
            machine::LimitKind::Difference(a, b) => point(*a).zip(point(*b)).map(|(a, b)| LimitKind::Difference(a, b)),
            machine::LimitKind::Spread(several) => several.iter().map(|s| point(*s)).collect::<Option<Vec<_>>>().map(LimitKind::Spread),
        };
        let maximum = match limit.kind {
            machine::LimitKind::Maximum(_) => Celsius::from(Kelvin(limit.maximum)).0,
            _ => limit.maximum,
        };
        match kind {
            Some(kind) => limits.push(Limit { name: limit.name.clone(), kind, maximum }),
            None => notes.push(format!("the limit '{}' looks at something this table does not vary or hold: it is left out", limit.name)),
        }
    }
    (limits, notes)
}
