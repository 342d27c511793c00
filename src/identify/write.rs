//! The machine file with what was found, and where it comes from.

use std::path::Path;

use super::{Estimate, Problem};
use crate::error::{Error, Result};
use crate::reader::{Document, edited};

/// Keys of a machine file with their values, TOML.
type Sets = Vec<(String, String)>;

/// Text of the machine file with the values found; comments stay, and a block above says where the values come from.
///
/// # Errors
/// The file cannot be read again, or the changed text does not give the values found.
pub fn write_machine(problem: &Problem, estimate: &Estimate, tests: &[String]) -> Result<String> {
    let document = problem.study.document();
    let path = document.file();
    let text = std::fs::read_to_string(path).map_err(|e| Error::file("read", path, &e))?;
    let machine = &problem.study.model.machine;
    let (mut sets, beforehand) = changed_beforehand(document, &text, path)?;
    let mut lines = vec![
        format!("Identified by coldplate {} from {}", env!("CARGO_PKG_VERSION"), name_of(Path::new(&problem.data.source))),
        format!(
            "tests: {}; {} readings, misfit {:.1} before, {:.1} after",
            tests.join(", "),
            problem.data.count(),
            estimate.misfit.0,
            estimate.misfit.1
        ),
        format!("of the machine file {}, SHA-256 {}", name_of(path), &document.hash()[..16]),
    ];
    lines.extend(beforehand);
    for (k, free) in problem.free.iter().enumerate() {
        let p = &free.parameter;
        let shown = |v: f64| format!("{:.6} {}", p.shown(v), if p.unit == "1" { "" } else { &p.unit }).trim().to_string();
        lines.push(format!(
            "{}: {} -> {}, 95 % interval {} to {}",
            p.name,
            shown(p.value),
            shown(estimate.values[k]),
            shown(estimate.intervals[k].0),
            shown(estimate.intervals[k].1)
        ));
        if let Some((key, value)) = p.to_set(estimate.values[k], machine)? {
            sets.retain(|(other, _)| *other != key);
            sets.push((key, value));
        }
    }
    let comment: String = lines.iter().map(|line| format!("# {line}\n")).collect();
    let text = format!("{comment}\n{}", edited(&text, path, &sets)?);
    // What is written must be what was found.
    let written = Document::parse(&text, path)?;
    let pairs: Vec<_> = problem.free.iter().map(|f| &f.parameter).zip(estimate.values.iter().copied()).collect();
    let meant = problem.study.document_with(&pairs)?;
    for free in &problem.free {
        if written.leaf(&free.parameter.name)? != meant.leaf(&free.parameter.name)? {
            return Err(Error::numerics("the machine file could not be rewritten with the values found").at_key(&free.parameter.name));
        }
    }
    Ok(text)
}

/// What the document holds that the file's text does not, as keys with their values, and in words.
fn changed_beforehand(document: &Document, text: &str, path: &Path) -> Result<(Sets, Vec<String>)> {
    let own = Document::parse(text, path)?;
    let mut sets = Vec::new();
    for key in document.keys() {
        let now = document.leaf(&key)?;
        if let Some(leaf) = &now
            && own.leaf(&key)? != now
        {
            sets.push((key, leaf.to_toml()));
        }
    }
    let words = sets.iter().map(|(key, value)| format!("changed beforehand: {key} = {value}")).collect();
    Ok((sets, words))
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
