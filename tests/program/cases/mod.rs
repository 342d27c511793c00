//! Runs `cases.toml`: inputs that failed once.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use crate::common::{coldplate_in, copy_all, message, scratch};

/// Largest difference of a number from its expected value, in its own unit, unless the case states one. Chosen: rounding of a
/// reading through kelvin.
const WITHIN: f64 = 1e-9;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cases {
    #[serde(rename = "case")]
    cases: Vec<Case>,
}

/// Commands on files of this folder, and the right answer of the last one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    name: String,
    /// Texts that stand for `{}` in the arguments, one after the other.
    #[serde(default)]
    files: Vec<String>,
    /// Arguments of each command; `--json` is added.
    run: Vec<Vec<String>>,
    /// Exit status of the last command; those before it succeed.
    #[serde(default)]
    status: i32,
    /// Numbers of the JSON by their pointer (RFC 6901).
    #[serde(default)]
    values: BTreeMap<String, f64>,
    /// Largest difference of each of these numbers, in its own unit.
    #[serde(default = "rounding")]
    within: f64,
    /// Words that standard error holds.
    #[serde(default)]
    says: Vec<String>,
    /// Words that neither standard error nor standard output holds.
    #[serde(default)]
    never: Vec<String>,
}

fn rounding() -> f64 {
    WITHIN
}

/// Fault in the answer to a case with one of its files; `None` if the answer is right.
fn fault(case: &Case, file: &str, folder: &Path) -> Option<String> {
    let last = case.run.len() - 1;
    for (number, arguments) in case.run.iter().enumerate() {
        let arguments: Vec<String> = arguments.iter().map(|a| a.replace("{}", file)).chain(["--json".to_string()]).collect();
        let output = coldplate_in(folder, &arguments);
        let (told, out) = (message(&output), String::from_utf8_lossy(&output.stdout).into_owned());
        let status = if number == last { case.status } else { 0 };
        if output.status.code() != Some(status) {
            return Some(format!("{arguments:?} ended with {}, not with status {status}: {told}", output.status));
        }
        if let Some(word) = case.never.iter().map(String::as_str).chain(["panicked"]).find(|w| told.contains(w) || out.contains(w)) {
            return Some(format!("{arguments:?} says '{word}': {told}{out}"));
        }
        if number < last {
            continue;
        }
        if let Some(missing) = case.says.iter().find(|words| !told.contains(words.as_str())) {
            return Some(format!("no '{missing}' in {told}"));
        }
        if case.status == 2 && !out.is_empty() {
            return Some(format!("refused, yet it printed: {out}"));
        }
        let found: Value = serde_json::from_str(&out).unwrap_or(Value::Null);
        for (pointer, expected) in &case.values {
            let shown = found.pointer(pointer).and_then(Value::as_f64);
            let is_near = shown.is_some_and(|shown| (shown - expected).abs() <= case.within);
            if !is_near {
                return Some(format!("{pointer} is {shown:?}, not {expected} to {}: {told}", case.within));
            }
        }
    }
    None
}

#[test]
fn every_input_that_failed_once_is_answered_rightly() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/cases");
    let text = std::fs::read_to_string(source.join("cases.toml")).unwrap();
    let all: Cases = toml::from_str(&text).unwrap_or_else(|e| panic!("cases.toml: {e}"));
    let (mut tried, mut faults) = (0, Vec::new());
    for (number, case) in all.cases.iter().enumerate() {
        let own = [String::new()];
        for (which, file) in if case.files.is_empty() { &own[..] } else { &case.files[..] }.iter().enumerate() {
            let folder = scratch(&format!("case-{number}-{which}"));
            copy_all(&source, &folder);
            tried += 1;
            faults.extend(fault(case, file, &folder).map(|fault| format!("{} {file}: {fault}", case.name)));
        }
    }
    assert!(faults.is_empty(), "{} of {tried}:\n\n{}", faults.len(), faults.join("\n\n"));
}

/// A file beside the manifest that no case names is forgotten.
#[test]
fn every_file_stands_in_a_case() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/cases");
    let text = std::fs::read_to_string(source.join("cases.toml")).unwrap();
    for folder in std::fs::read_dir(&source).unwrap().map(|e| e.unwrap().path()).filter(|p| p.is_dir()) {
        for file in std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()) {
            let stem = file.file_stem().unwrap().to_str().unwrap();
            let mut places = text.match_indices(stem).map(|(at, _)| (&text[at - 1..at], &text[at + stem.len()..=at + stem.len()]));
            assert!(places.any(|(before, behind)| "/\"".contains(before) && ".\"".contains(behind)), "{}", file.display());
        }
    }
}
