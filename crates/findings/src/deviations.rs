//! Uncertainty of the causes in an extended machine file: standard deviations of the numbers and factors they became.

use coldplate_base::document::{Document, Leaf, quoted};
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_base::units;
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_diagnose::{Cause, Diagnosis, Problem};
use coldplate_solve::meshed::source_powers;
use coldplate_solve::study::{ParameterKind, Study};

/// Table of factors in a machine file.
const FACTOR: &str = "uncertain.";
/// Least correlation that is written, dimensionless. Chosen: smaller ones change no prediction.
const LEAST_CORRELATION: f64 = 0.02;
/// Largest standard deviation of a factor that is written, as a share of it. Chosen: with more the factor corrects
/// nothing.
const MOST: f64 = 0.9;
/// Largest decrease of a positive cause in a difference quotient, as a share of it. Chosen: it must stay positive.
const LEAST: f64 = 0.5;

/// Lines that state the standard deviation of every cause in an extended machine file. A number has it beside it; the power of a
/// source that is a formula, and several keys that one cause moves, have it as a factor. Other formulas have no place for one.
///
/// # Errors
/// The file is no machine; a cause cannot be written.
pub(super) fn lines(problem: &Problem, found: &Diagnosis, extended: &Document) -> Result<Vec<(String, String)>> {
    let study = Study::new(extended.clone(), Some(1))?;
    let mut causes: Vec<&Cause> = Vec::new();
    for cause in found.rungs.iter().flat_map(|rung| rung.causes.iter().chain(&rung.refitted)) {
        causes.retain(|other| !other.hypothesis.is_same(&cause.hypothesis));
        causes.push(cause);
    }
    let mut all: Vec<(String, String)> = Vec::new();
    let mut names: Vec<Named> = Vec::new();
    for cause in causes.iter().filter(|c| !c.hypothesis.is_fixed() && c.deviation > 0.0) {
        let Some(moved) = Moved::of(problem, found, cause)? else { continue };
        let own = moved.line(problem, &study, &cause.hypothesis.kind_and_place(), cause.deviation)?;
        if let Some(line) = own.filter(|line| extended.uncertain().iter().all(|stated| stated.key != line.key)) {
            let name = if line.key.starts_with(FACTOR) { cause.hypothesis.kind_and_place() } else { line.key.clone() };
            names.push(Named { cause: (*cause).clone(), name, is_opposed: line.is_opposed });
            all.push((line.key, line.value));
        }
    }
    all.extend(correlations(found, extended, &names)?);
    // A deviation that the file cannot carry is left out rather than the machine.
    let mut kept: Vec<(String, String)> = Vec::new();
    for line in all {
        let mut document = extended.clone();
        let is_sound = kept.iter().chain([&line]).all(|(key, value)| document.apply_set(key, value).is_ok())
            && Study::new(document, Some(1)).and_then(|study| study.open_parameters(false)).is_ok();
        if is_sound {
            kept.push(line);
        }
    }
    Ok(kept)
}

/// A line that states a deviation.
struct Line {
    key: String,
    value: String,
    /// Whether the number falls where the amplitude of its cause rises.
    is_opposed: bool,
}

/// A cause under the name of its uncertain number or factor.
struct Named {
    cause: Cause,
    name: String,
    is_opposed: bool,
}

/// The correlations of the causes and numbers fitted together last, behind those that the file has.
fn correlations(found: &Diagnosis, extended: &Document, names: &[Named]) -> Result<Option<(String, String)>> {
    let Some(rung) = found.rungs.iter().rev().find(|rung| !rung.correlations.is_empty()) else { return Ok(None) };
    let fitted: Vec<Option<&Named>> = (rung.causes.iter().chain(&rung.refitted))
        .map(|cause| names.iter().find(|own| own.cause.hypothesis.is_same(&cause.hypothesis)))
        .collect();
    let mut entries: Vec<String> = match extended.leaf("correlation")? {
        Some(Leaf::List(items)) => items.iter().map(Leaf::to_toml).collect(),
        _ => Vec::new(),
    };
    for (i, row) in rung.correlations.iter().enumerate() {
        for (j, value) in row.iter().enumerate().take(i) {
            if let (Some(a), Some(b)) = (fitted[i], fitted[j])
                && value.abs() >= LEAST_CORRELATION
            {
                let value = if a.is_opposed == b.is_opposed { *value } else { -value };
                let [a, b] = [b, a].map(|own| Leaf::Text(own.name.clone()).to_toml());
                entries.push(format!("{{ between = [{a}, {b}], value = {:?} }}", (1e4 * value).round() / 1e4));
            }
        }
    }
    Ok((!entries.is_empty()).then(|| ("correlation".to_string(), format!("[{}]", entries.join(", ")))))
}

/// The machine file with a cause a little smaller and a little larger.
struct Moved {
    low: Document,
    high: Document,
    /// Step from one to the other, in standard deviations.
    deviations: f64,
}

impl Moved {
    fn of(problem: &Problem, found: &Diagnosis, cause: &Cause) -> Result<Option<Self>> {
        let scales = &found.places.scales;
        if cause.hypothesis.is_mean(scales) {
            return Ok(None);
        }
        let (a, d) = (cause.amplitude, cause.deviation);
        let down = if cause.hypothesis.is_signed { d } else { d.min(LEAST * a) };
        let at = |amplitude: f64| -> Result<Option<Document>> {
            let Some(lines) = cause.hypothesis.written(&problem.study, &problem.data, scales, &problem.user, amplitude)? else {
                return Ok(None);
            };
            let mut document = problem.document(found.sets.as_deref().unwrap_or(&[]))?;
            for (key, value) in &lines {
                document.apply_set(key, value)?;
            }
            Ok(Some(document))
        };
        let (Some(low), Some(high)) = (at(a - down)?, at(a + d)?) else { return Ok(None) };
        Ok(Some(Self { low, high, deviations: (down + d) / d }))
    }

    /// The keys that differ, with both values.
    fn differing(&self) -> Result<Vec<(String, Leaf, Leaf)>> {
        let mut all = Vec::new();
        for key in self.high.keys() {
            if let (Some(low), Some(high)) = (self.low.leaf(&key)?, self.high.leaf(&key)?)
                && low.to_toml() != high.to_toml()
            {
                all.push((key, low, high));
            }
        }
        Ok(all)
    }

    fn line(&self, problem: &Problem, extended: &Study, name: &str, deviation: f64) -> Result<Option<Line>> {
        let differing = self.differing()?;
        // A number has its deviation in its unit and as a share of it, a source's formula as a share of its power.
        let mut numbers = Vec::new();
        let (mut factors, mut offsets) = (Vec::new(), Vec::new());
        for (key, low, high) in &differing {
            let Ok(parameter) = extended.parameter(key) else { continue };
            let now = extended.document().leaf(key)?;
            match (number_of(low), number_of(high), now.as_ref().and_then(number_of)) {
                (Some((low, unit)), Some((high, other)), Some((now, own))) if unit == other && unit == own => {
                    let deviation = (high - low) / self.deviations;
                    if parameter.kind == ParameterKind::Quantity && deviation != 0.0 {
                        numbers.push((key, now, unit, deviation));
                    }
                }
                _ if parameter.kind == ParameterKind::Offset => offsets.push(key),
                _ if parameter.kind == ParameterKind::Factor => {
                    factors.extend(self.share_of_power(problem, key)?.map(|share| (key, share)))
                }
                _ => {}
            }
        }
        if let [(key, now, unit, deviation)] = numbers.as_slice() {
            let is_opposed = *deviation < 0.0;
            let deviation = significant(deviation.abs(), 3);
            let text = match unit.as_str() {
                "1" => format!("\"{now:?} +- {deviation}\""),
                "degC" | "°C" => format!("\"{now:?} {unit} +- {deviation} K\""),
                unit => format!("\"{now:?} +- {deviation} {unit}\""),
            };
            if factors.is_empty() && offsets.is_empty() {
                return Ok(Some(Line { key: (*key).clone(), value: text, is_opposed }));
            }
        }
        let list = |keys: &[&String]| keys.iter().map(|key| Leaf::Text((*key).clone()).to_toml()).collect::<Vec<_>>().join(", ");
        let key = format!("{FACTOR}{}", quoted(name));
        if !offsets.is_empty() && numbers.is_empty() && factors.is_empty() {
            let value = format!("{{ numbers = [{}], offset = \"{} K\" }}", list(&offsets), significant(deviation, 3));
            return Ok(Some(Line { key, value, is_opposed: false }));
        }
        let shares = numbers.iter().map(|(key, now, _, deviation)| (*key, (deviation / now).abs())).chain(factors.iter().copied());
        let shares: Vec<(&String, f64)> = shares.filter(|(_, share)| share.is_finite() && *share > 0.0).collect();
        let Some(share) = shares.iter().map(|(_, share)| *share).reduce(f64::max) else { return Ok(None) };
        let keys: Vec<&String> = shares.iter().map(|(key, _)| *key).collect();
        let value = format!("{{ numbers = [{}], deviation = \"{} %\" }}", list(&keys), significant(100.0 * share.min(MOST), 3));
        Ok(Some(Line { key, value, is_opposed: false }))
    }

    /// Change of a source's power over the data's conditions per standard deviation, as a share of it; `None` if the
    /// key is no power.
    fn share_of_power(&self, problem: &Problem, key: &str) -> Result<Option<f64>> {
        let names = Document::names_in(key).unwrap_or_default();
        let ["source", name, "power" | "power_density"] = names.iter().map(String::as_str).collect::<Vec<_>>()[..] else {
            return Ok(None);
        };
        let [low, high] = [&self.low, &self.high].map(Machine::from_document);
        let (low, high) = (low?, high?);
        let Some(source) = high.sources.iter().position(|s| s.name == name) else { return Ok(None) };
        let (mut change, mut size) = (0.0, 0.0);
        for row in &problem.data.rows {
            let power = |machine: &Machine| {
                // The data may know the time as a variable that the file does not have.
                let given = &problem.study.model.machine.variables;
                let value = |v: &DescribedVariable| {
                    given.iter().position(|own| own.name == v.name).and_then(|at| row.condition.si().get(at)).copied()
                };
                let values: Option<Vec<f64>> = machine.variables.iter().map(value).collect();
                source_powers(machine, &Condition::from_si(values?)).ok().map(|powers| powers[source])
            };
            let (Some(low), Some(high)) = (power(&low), power(&high)) else { return Ok(None) };
            change += ((high - low) / self.deviations).powi(2);
            size += (0.5 * (low + high)).powi(2);
        }
        Ok((size > 0.0).then(|| (change / size).sqrt()))
    }
}

/// A number with its unit.
fn number_of(leaf: &Leaf) -> Option<(f64, String)> {
    match leaf {
        Leaf::Number(text) | Leaf::Integer(text) => Some((text.replace('_', "").parse().ok()?, "1".into())),
        Leaf::Text(text) => units::quantity(text).map(|(number, unit, _)| (number, unit.to_string())),
        _ => None,
    }
}
