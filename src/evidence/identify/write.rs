//! The identified machine file, with its provenance.

use std::path::Path;

use super::{Estimate, Problem};
use crate::error::Result;
use crate::foundation::document::name_of;

/// Text of the machine file with the values found; comments stay, and a block above says where the values come from. Values of
/// one test alone stand in that block only.
///
/// # Errors
/// The file cannot be read again, or the changed text does not give the values found.
pub fn write_machine(problem: &Problem, estimate: &Estimate, tests: &[String]) -> Result<String> {
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
            sets.extend(p.to_set(estimate.values[k], machine)?);
        }
    }
    problem.study.document().rewritten(&sets, &remarks)
}
