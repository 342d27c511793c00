//! User input of a diagnosis: own kinds of cause, kinds to leave out, uncertain numbers, and costs of tests.

use std::path::Path;

use coldplate_base::document::{Document, Value, quoted};
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{Dimension, parse};
use coldplate_diagnose::{Costs, UserKind, hypotheses};
use coldplate_evidence::measurement::Data;
use coldplate_solve::sensitivity::UncertainNumber;
use coldplate_solve::study::Study;

/// A kind that is not to be tried.
///
/// # Errors
/// This machine and these data have no cause of that kind.
pub fn kind_named(text: &str, study: &Study, data: &Data, user: &[UserKind]) -> Result<String> {
    let mut kinds: Vec<&str> = hypotheses(study, data, user).iter().map(|h| h.kind()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    if kinds.contains(&text.trim()) {
        return Ok(text.trim().to_string());
    }
    let error = Error::input("no cause is of this kind").at_key("--without").read(text);
    Err(match did_you_mean(text, kinds.iter().copied()) {
        Some(near) => error.help(format!("did you mean '{near}'?")),
        None => error.help(format!("kinds here: {}", kinds.join(", "))),
    })
}

/// A number of the machine file with its standard deviation (SI), written `KEY=10%` or `KEY=+-0.1 UNIT`.
///
/// # Errors
/// The text is not of that form, the key is none of the machine's, or the deviation is not positive.
pub fn uncertain(text: &str, study: &Study) -> Result<UncertainNumber> {
    let malformed =
        || Error::input("this is no uncertainty of a number").at_key("--uncertain").read(text).help("write KEY=10% or KEY=+-50 W/(m2 K)");
    let (key, spread) = text.split_once('=').ok_or_else(malformed)?;
    let parameter = study.parameter(key)?;
    if parameter.variable().is_some() {
        return Err(malformed().help("the uncertainty of a condition belongs into DATA.toml"));
    }
    let spread = spread.trim();
    let deviation = match spread.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map_err(|_| malformed())? / 100.0 * parameter.value.abs(),
        None => {
            let dimension = if parameter.dimension.is_absolute() { Dimension::DIFFERENCE } else { parameter.dimension };
            parse(spread.trim_start_matches("+-").trim_start_matches('±').trim(), dimension).map_err(|e| e.at_key("--uncertain"))?
        }
    };
    if deviation > 0.0 {
        Ok(UncertainNumber { parameter, deviation, limits: None })
    } else {
        Err(Error::input("a standard deviation is positive").at_key("--uncertain").read(text).help("write KEY=10% or KEY=+-50 W/(m2 K)"))
    }
}

/// Kinds of cause from a file of `[kind.NAME]` tables: `heat_into = ["part"]`, `per_unit = "formula in W"`, `scale`, `signed`.
///
/// # Errors
/// The file cannot be read, a key is missing, unknown or of the wrong type, or the machine has no such part.
pub fn user_kinds(path: &Path, study: &Study) -> Result<Vec<UserKind>> {
    let document = Document::read(path)?;
    let root = document.root();
    let mut found = Vec::new();
    for (name, section) in root.sections("kind")? {
        let kind = UserKind {
            name: name.clone(),
            places: section.value("heat_into")?.texts()?,
            expression: section.value("per_unit")?.text()?,
            scale: section.opt("scale").map_or(Ok(1.0), |v| v.number())?,
            is_signed: section.opt("signed").map_or(Ok(true), |v| v.flag())?,
        };
        section.finish()?;
        if kind.scale <= 0.0 {
            return Err(Error::input("the scale of an amplitude is positive").at_key(format!("kind.{name}.scale")).in_file(path));
        }
        // The machine file's own reader finds errors in places and expression.
        let value = format!("{{ in = {:?}, power = {:?} }}", kind.places, kind.expression);
        study
            .edited(&[(format!("source.{}", quoted(&name)), value)])
            .map_err(|e| Error::input(e.what()).at_key(format!("kind.{name}")).in_file(path).help(e.remedy().unwrap_or("").to_string()))?;
        found.push(kind);
    }
    root.finish()?;
    Ok(found)
}

/// Costs of tests and sensors: `unit`, `[test]` with `steady`, `step`, `heater_pulse`, `chamber_pressure`, and `[sensor]` with
/// `existing`, `new` and sensors by name. Costs that are not stated are those of [`Costs::default`].
///
/// # Errors
/// The file cannot be read, a key is unknown or of the wrong type, or a cost is not positive.
pub fn costs(path: &Path) -> Result<Costs> {
    let document = Document::read(path)?;
    let root = document.root();
    let mut costs = Costs::default();
    let positive = |value: Value<'_>| -> Result<f64> {
        let cost = value.number()?;
        if cost > 0.0 { Ok(cost) } else { Err(value.error("a cost is positive").help("write a number above 0, in one unit for all")) }
    };
    if let Some(unit) = root.opt("unit") {
        costs.unit = unit.text()?;
    }
    if let Some(test) = root.opt_section("test")? {
        let tests = [
            ("steady", &mut costs.steady),
            ("step", &mut costs.step),
            ("heater_pulse", &mut costs.heater_pulse),
            ("chamber_pressure", &mut costs.chamber_pressure),
        ];
        for (key, cost) in tests {
            if let Some(value) = test.opt(key) {
                *cost = positive(value)?;
            }
        }
        test.finish()?;
    }
    if let Some(sensor) = root.opt_section("sensor")? {
        for key in sensor.keys() {
            let cost = positive(sensor.value(key)?)?;
            match key {
                "existing" => costs.existing_sensor = cost,
                "new" => costs.new_sensor = cost,
                _ => _ = costs.sensors.insert(key.to_string(), cost),
            }
        }
        sensor.finish()?;
    }
    root.finish()?;
    Ok(costs)
}
