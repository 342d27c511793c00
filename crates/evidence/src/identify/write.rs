//! The identified machine file, with its provenance.

use std::path::Path;

use super::{Estimate, IdentifyProblem};
use crate::measurement::Data;
use coldplate_base::document::{Leaf, name_of};
use coldplate_base::error::Result;
use coldplate_base::numbers::{TWO_SIDED_95, significant};
use coldplate_base::units;
use coldplate_describe::machine::{DescribedVariable, Machine};
use coldplate_solve::study::{MachineParameter, ParameterKind};

/// Least correlation that is written, dimensionless. Chosen: keeps the file short.
const LEAST_CORRELATION: f64 = 0.02;
/// Most conditions that are written, count. Chosen: enough for a design, not for a log.
const MOST_CONDITIONS: usize = 64;

/// Text of the machine file with the values found, each with its standard deviation, their correlations and the model error
/// that was learnt. Comments stay, and a block above says where the values come from. Values of one test alone stand in that
/// block only.
///
/// # Errors
/// The file cannot be read again, or the changed text does not give the values found.
pub fn write_machine(problem: &IdentifyProblem, estimate: &Estimate, tests: &[String]) -> Result<String> {
    let machine = &problem.study.model.machine;
    let mut remarks = vec![
        format!("Identified by coldplate {} from {}", env!("CARGO_PKG_VERSION"), name_of(Path::new(&problem.data.source))),
        format!(
            "tests: {}; {} readings, misfit {:.1} before, {:.1} after",
            tests.join(", "),
            problem.data.count(),
            estimate.misfit.0,
            estimate.misfit.1
        ),
    ];
    if let Some(reason) = estimate.search_end.reason() {
        remarks.push(format!("the search did not come to rest ({reason}): the values are the best so far"));
    }
    if let Some(learnt) = estimate.model_error.map(|m| m.level.in_words(problem.data.is_transient())).filter(|text| !text.is_empty()) {
        remarks.push(format!("model error learnt from the readings: {learnt}"));
    }
    let mut sets = Vec::new();
    for (k, free) in problem.free.iter().enumerate() {
        let p = &free.parameter;
        let shown = |v: f64| format!("{:.6} {}", p.shown(v), if p.unit == "1" { "" } else { &p.unit }).trim().to_string();
        if estimate.kept[k] {
            remarks.push(format!("{}: not determined by these data, kept at {}", free.name(), shown(p.value)));
            continue;
        }
        remarks.push(format!(
            "{}: {} -> {}, 95 % interval {} to {}",
            free.name(),
            shown(p.value),
            shown(estimate.values[k]),
            shown(estimate.intervals[k].0),
            shown(estimate.intervals[k].1)
        ));
        if free.test.is_none() {
            sets.extend(p.to_set(estimate.values[k], machine)?.map(|(key, value)| (key, uncertain(p, estimate, k).unwrap_or(value))));
        }
    }
    sets.extend(correlations(problem, estimate));
    sets.extend(model_error(problem, estimate)?);
    problem.study.document().rewritten(&sets, &remarks)
}

/// A number that was found, with its standard deviation, as TOML. `None` for a factor or offset, which is no number of the
/// file.
fn uncertain(p: &MachineParameter, estimate: &Estimate, k: usize) -> Option<String> {
    let (low, high) = estimate.intervals[k];
    let deviation = (high - low).abs() / (2.0 * TWO_SIDED_95) / p.per_unit(1.0).abs();
    if p.kind != ParameterKind::Quantity || !(deviation > 0.0 && deviation.is_finite()) {
        return None;
    }
    let (value, deviation) = (p.shown(estimate.values[k]), significant(deviation, 3));
    Some(match p.unit.as_str() {
        "1" => format!("\"{value:?} +- {deviation}\""),
        unit if p.dimension.is_absolute() => format!("\"{value:?} {unit} +- {deviation} K\""),
        unit => format!("\"{value:?} +- {deviation} {unit}\""),
    })
}

/// Correlations of the numbers that were found, and those of other numbers that the file states.
fn correlations(problem: &IdentifyProblem, estimate: &Estimate) -> Option<(String, String)> {
    let is_found = |k: &usize| {
        let free = &problem.free[*k];
        free.test.is_none() && !estimate.kept[*k] && uncertain(&free.parameter, estimate, *k).is_some()
    };
    let found: Vec<usize> = (0..problem.free.len()).filter(is_found).collect();
    let name = |k: usize| problem.free[k].parameter.name.as_str();
    let entry = |a: &str, b: &str, value: f64| format!("{{ between = [{}, {}], value = {value:?} }}", text(a), text(b));
    let mut all = Vec::new();
    for own in &problem.study.model.machine.correlations {
        let [a, b] = &own.between;
        if !found.iter().any(|k| name(*k) == a) && !found.iter().any(|k| name(*k) == b) {
            all.push(entry(a, b, own.value));
        }
    }
    for (i, a) in found.iter().enumerate() {
        for b in &found[..i] {
            let value = (1e4 * estimate.correlation[(*a, *b)]).round() / 1e4;
            if value.abs() >= LEAST_CORRELATION {
                all.push(entry(name(*b), name(*a), value));
            }
        }
    }
    let is_new = !all.is_empty() || !problem.study.model.machine.correlations.is_empty();
    is_new.then(|| ("correlation".to_string(), format!("[{}]", all.join(", "))))
}

/// Model error as a line of the file. If the stated errors explain the residual of a table, it is the one that they state.
fn model_error(problem: &IdentifyProblem, estimate: &Estimate) -> Result<Option<(String, String)>> {
    let learnt = estimate.model_error.map(|own| own.level.wandering).filter(|own| *own > 0.0);
    if learnt.is_none() && problem.data.is_transient() {
        return Ok(None);
    }
    model_error_line(&problem.study.model.machine, &problem.data, learnt.unwrap_or(problem.uncertainty.model), |_| true).map(Some)
}

/// Line of a machine file with the model's error against readings, as a standard deviation in kelvin, and the conditions of
/// these readings, by the variables that it has: key and TOML value. Conditions of logs are not states and are left out.
///
/// # Errors
/// A unit of a variable that cannot be expressed.
pub fn model_error_line(
    machine: &Machine,
    data: &Data,
    deviation: f64,
    has: impl Fn(&DescribedVariable) -> bool,
) -> Result<(String, String)> {
    let mut conditions: Vec<String> = Vec::new();
    for row in data.rows.iter().filter(|_| !data.is_transient()) {
        let value = |(v, si): (&DescribedVariable, &f64)| {
            Ok(format!("{} = \"{:?} {}\"", v.name, units::express(*si, &v.unit, v.dimension)?, v.unit))
        };
        let all = machine.variables.iter().zip(row.condition.si()).filter(|(v, _)| has(v)).map(value).collect::<Result<Vec<String>>>()?;
        let condition = format!("{{ {} }}", all.join(", "));
        if !conditions.contains(&condition) && conditions.len() < MOST_CONDITIONS {
            conditions.push(condition);
        }
    }
    let entries = [
        format!("sensors = \"{} K\"", significant(deviation, 3)),
        format!("growth = {:?}", machine.model_error.growth),
        format!("measured = [{}]", conditions.join(", ")),
    ];
    Ok(("model_error".into(), format!("{{ {} }}", entries.join(", "))))
}

/// A text as TOML.
fn text(text: &str) -> String {
    Leaf::Text(text.into()).to_toml()
}
