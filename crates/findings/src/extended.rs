//! The machine file with the best explanation in it.

use std::path::{Path, PathBuf};

use super::{deviations, ladder};
use coldplate_base::document::{Document, Leaf, name_of};
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_describe::machine::{DescribedVariable, Machine};
use coldplate_diagnose::{Cause, Diagnosis, Problem, sentence};
use coldplate_evidence::identify::model_error_line;

/// The extended machine file as it is to be written.
#[derive(Debug)]
pub struct ExtendedMachine {
    /// Path of the file.
    pub path: PathBuf,
    /// Text of the file.
    pub text: String,
    /// Keys that change.
    pub changes: Vec<KeyChange>,
}

/// A key that changes.
#[derive(Debug, Clone, serde::Serialize)]
pub struct KeyChange {
    /// The key.
    pub key: String,
    /// Value before, as TOML; `None` if the key is new.
    pub before: Option<String>,
    /// Value now, as TOML.
    pub after: String,
    /// Values at the ends of the 90 % interval, if one number decides.
    pub interval: Option<[String; 2]>,
}

impl ExtendedMachine {
    /// The extended machine file; `None` if nothing is to be extended: no cause that the machine file has words for, and no numbers
    /// that predict better.
    ///
    /// # Errors
    /// The file cannot be read again, or the result is no machine.
    pub fn of(problem: &Problem, found: &Diagnosis, path: &Path) -> Result<Option<Self>> {
        let Some(sets) = found.sets.as_ref().filter(|sets| !sets.is_empty()) else { return Ok(None) };
        let mut remarks =
            vec![format!("Extended by coldplate {} from {}", env!("CARGO_PKG_VERSION"), name_of(Path::new(&problem.data.source)))];
        let five = |v: f64| significant(v, 5);
        match found.explanations.first().filter(|_| !found.is_calibrated()) {
            Some(best) => {
                remarks.push(format!(
                    "verdict {}, probability {:.3}, misfit {:.1} before, {:.1} after, {} readings",
                    found.verdict.code(),
                    best.probability,
                    found.misfit.chi2,
                    best.misfit,
                    found.misfit.freedom
                ));
                for part in &best.causes {
                    remarks.push(sentence(part));
                    let (low, high) = part.interval();
                    let unit = part.hypothesis.unit;
                    remarks.push(format!("  amplitude {} [{unit}], 90 % interval {} to {}", five(part.amplitude), five(low), five(high)));
                    if part.hypothesis.is_fixed() {
                        remarks.push("  (their entries have changed places here: each reads where the other one was)".into());
                    }
                    if part.hypothesis.is_written_afterwards(&found.places.scales) {
                        remarks.push("  (it depends on the order of the rows: here it is as is expected after the last one)".into());
                    }
                }
            }
            None => {
                let error = found
                    .gain
                    .as_ref()
                    .map(|gain| format!("; error on conditions kept out {} K, {} K before", five(gain.after), five(gain.before)));
                remarks.push(format!("verdict {}: {}{}", found.verdict.code(), ladder::NUMBERS, error.unwrap_or_default()));
            }
        }
        remarks.extend(found.rungs.iter().filter_map(ladder::left_out));
        let document = problem.document(sets)?;
        // The model error is now the error on data kept out, if there were any.
        let left = found.rungs.last().map_or(0.0, |rung| rung.rms);
        let left_out = found.rungs.iter().filter_map(|rung| rung.left_out.as_ref()).fold(0.0, |most: f64, own| most.max(own.rms));
        let deviation = found.gain.as_ref().map_or(left, |gain| gain.after).max(left_out).max(problem.discrepancy.model);
        let has = |v: &DescribedVariable| problem.states(&v.name) || matches!(document.leaf(&format!("variables.{}", v.name)), Ok(Some(_)));
        let error = model_error_line(&problem.study.model.machine, &problem.data, deviation, has)?;
        let lines: Vec<(String, String)> = sets.iter().cloned().chain([error]).collect();
        let extended = Document::parse(&document.rewritten(&lines, &remarks)?, path)?;
        let sure = deviations::lines(problem, found, &extended)?;
        let lines: Vec<(String, String)> = lines.into_iter().chain(sure).collect();
        let text = document.rewritten(&lines, &remarks)?;
        // The text must be a machine.
        Machine::from_document(&Document::parse(&text, path)?)?;
        let ends = ends(problem, found)?;
        let change = |(key, value): &(String, String)| -> Result<KeyChange> {
            Ok(KeyChange {
                key: key.clone(),
                before: document.leaf(key)?.as_ref().map(Leaf::to_toml),
                after: value.clone(),
                interval: ends.iter().find(|(other, _)| other == key).map(|(_, ends)| ends.clone()),
            })
        };
        let changes = sets.iter().map(change).collect::<Result<Vec<_>>>()?;
        Ok(Some(Self { path: path.to_path_buf(), text, changes }))
    }
}

/// Value of every key at both ends of the interval of its cause.
fn ends(problem: &Problem, found: &Diagnosis) -> Result<Vec<(String, [String; 2])>> {
    let scales = &found.places.scales;
    let parts: &[Cause] = match (found.rungs.first(), found.explanations.first()) {
        (Some(rung), _) if found.is_calibrated() => &rung.refitted,
        (_, Some(best)) => &best.causes,
        (_, None) => &[],
    };
    let mut all: Vec<(String, [String; 2])> = Vec::new();
    for part in parts.iter().filter(|part| !part.hypothesis.is_mean(scales)) {
        let (low, high) = part.interval();
        let at = |amplitude: f64| part.hypothesis.written(&problem.study, &problem.data, scales, &problem.user, amplitude);
        let (Some(low), Some(high)) = (at(low)?, at(high)?) else { continue };
        for ((key, low), (other, high)) in low.into_iter().zip(high) {
            if key == other && all.iter().all(|(known, _)| *known != key) {
                all.push((key, [low, high]));
            }
        }
    }
    Ok(all)
}
