//! `coldplate diagnose`: what the simulation gets wrong, why, and how much better it gets.

mod energy;
mod extended;
mod figures;
mod json;
mod next;
mod refit;
mod report;
mod text;

use std::path::{Path, PathBuf};

use super::condition::pair_of;
use super::measured;
use super::output::Output;
use crate::error::{Error, Result, did_you_mean};
use crate::evidence::diagnose::{self, Diagnosis, Discrepancy, Explanation, Problem, UserKind, Verdict, hypotheses, sentence};
use crate::foundation::atomic_file;
use crate::foundation::document::{Document, quoted};
use crate::solve::sensitivity::{Parameter, Study};
use crate::units::{Dimension, parse};
use energy::Energy;
use extended::Extended;
use refit::Refitted;

/// What the simulation gets wrong against measured data, the cause by name, the extended machine and its gain
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file
    machine: PathBuf,
    /// Measured data: CSV with test, conditions and sensors (default: the measurements in the machine file)
    data: Option<PathBuf>,
    /// A number of the machine file that is itself uncertain, with its standard deviation: KEY=10% or KEY=+-0.1 UNIT; may be repeated
    #[arg(long = "uncertain", value_name = "KEY=DEVIATION")]
    uncertain: Vec<String>,
    /// Causes of your own: a file of [kind.NAME] tables
    #[arg(long, value_name = "FILE")]
    kinds: Option<PathBuf>,
    /// Do not try a kind of cause, for example "radiative link"; may be repeated
    #[arg(long, value_name = "KIND")]
    without: Vec<String>,
    /// The state logs begin with: "steady", "readings" (each test at the mean of its first readings), or a temperature
    #[arg(long, value_name = "STATE", default_value = "steady")]
    from: String,
    /// Write the extended machine here (default: beside the machine file, as NAME.extended.toml); never over a file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a report for readers who were not there: one HTML file
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Fit surrogates of the machine as it is and of the extended one over the ranges of the machine file; write the latter here
    #[arg(long, value_name = "FILE")]
    surrogate: Option<PathBuf>,
    /// Change a value of the machine file first
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// About how many cells (default: 3000 or the machine file's own, whichever is less)
    #[arg(long, value_name = "N")]
    cells: Option<usize>,
}

/// Cells that suffice where only differences matter.
const USUAL_CELLS: usize = 3000;

/// Runs the command.
///
/// # Errors
/// Bad input, or numerics that failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let sets = args.set.iter().map(|s| pair_of(s, "--set")).collect::<Result<Vec<_>>>()?;
    let study = Study::read(&args.machine, &sets, Some(args.cells.unwrap_or(USUAL_CELLS)))?;
    let machine = &study.model.machine;
    let path = measured::goal(args.out.as_deref(), &args.machine, machine, "extended")?;
    if let Some(report) = &args.report {
        if !report.extension().is_some_and(|e| e == "html" || e == "htm") {
            return Err(Error::input("a report is an HTML file").in_file(report).at_key("--report").help("end the name in .html"));
        }
        atomic_file::check(report).map_err(|e| e.at_key("--report"))?;
    }
    if let Some(surrogate) = &args.surrogate {
        measured::must_be_new(surrogate, "--surrogate")?;
        refit::check(machine).map_err(|e| e.in_file(&args.machine))?;
    }
    let data = measured::data(args.data.as_deref(), machine)?;
    let uncertainty = measured::uncertainty(args.data.as_deref(), &args.machine, &data, machine, out)?;
    let start = measured::start(&args.from)?;
    let uncertain = args.uncertain.iter().map(|text| uncertain(text, &study)).collect::<Result<Vec<_>>>()?;
    let user = match &args.kinds {
        Some(path) => user_kinds(path, &study)?,
        None => Vec::new(),
    };
    let without = args.without.iter().map(|kind| kind_named(kind, &study, &data, &user)).collect::<Result<Vec<_>>>()?;
    let problem = Problem { study, data, uncertainty, uncertain, openness: Discrepancy::default(), user, start, seed: 1, without };
    let diagnosis = diagnose::diagnose(&problem, &mut |what| out.note(what))?;
    let extended = Extended::of(&problem, &diagnosis, &path)?;
    out.note("heat balances");
    let energy = Energy::of(&problem, &diagnosis, extended.is_some())?;
    let refitted = match &args.surrogate {
        Some(path) => Some(Refitted::of(&problem, extended.as_ref(), path, out)?),
        None => None,
    };
    let found =
        Found { problem: &problem, diagnosis: &diagnosis, extended: extended.as_ref(), energy: &energy, refitted: refitted.as_ref() };
    // Everything is made before anything is written.
    let report = match &args.report {
        Some(_) => Some(report::report(&found)?),
        None => None,
    };
    if let Some(extended) = &extended {
        atomic_file::write(&extended.path, extended.text.as_bytes())?;
    }
    if let Some(fit) = refitted.as_ref().and_then(|r| r.fit.as_ref()) {
        atomic_file::write(&fit.path, &fit.bytes)?;
    }
    if let (Some(report), Some(path)) = (report, &args.report) {
        report.write(path)?;
        out.note(&format!("wrote {}", path.display()));
    }
    out.report(&text::text(&found), &json::json(&found));
    Ok(0)
}

/// What was found and what was made of it.
struct Found<'a> {
    problem: &'a Problem,
    diagnosis: &'a Diagnosis,
    extended: Option<&'a Extended>,
    energy: &'a Energy,
    refitted: Option<&'a Refitted>,
}

impl Found<'_> {
    /// Explanations that the data cannot refute.
    fn open(&self) -> Vec<&Explanation> {
        self.diagnosis.set.iter().filter_map(|i| self.diagnosis.explanations.get(*i)).collect()
    }

    /// Explanations worth showing: the first three, and what has some probability.
    fn ranked(&self, most: usize) -> impl Iterator<Item = (usize, &Explanation)> {
        self.diagnosis.explanations.iter().enumerate().filter(|(i, e)| *i < 3 || e.probability > 2e-3).take(most)
    }

    /// The answer in one sentence.
    fn headline(&self) -> String {
        let found = self.diagnosis;
        match found.verdict {
            Verdict::Consistent => format!(
                "The readings do not contradict the machine: a misfit this large or larger has probability {:.2}, a cause this convincing {:.2}.",
                found.misfit.probability, found.misfit.look_elsewhere
            ),
            Verdict::Explained => {
                let what = found.explanations.first().map(words).unwrap_or_default();
                let p = found.level.probability;
                let p = if p > 0.994 { "above 0.99".to_string() } else { format!("{p:.2}") };
                format!("{}; probability {p}.", capital(&what))
            }
            Verdict::SomethingElse => format!(
                "Something is wrong that no cause of the catalogue explains{}.",
                if found.level.what.is_empty() { String::new() } else { format!("; what comes nearest points to {}", found.level.what) }
            ),
            Verdict::CannotTell => {
                let certain = match found.level.name {
                    "one" => format!("certain is {}, and something acts beside it", found.level.what),
                    "place" => format!("it is at {}", found.level.what),
                    "region" => format!("it touches {}", found.level.what),
                    _ => "not even its place is certain".into(),
                };
                let n = found.set.len();
                let fit = if n == 1 { "1 explanation fits".to_string() } else { format!("{n} explanations fit alike") };
                format!("Something is wrong; {certain}, and {fit}: the data cannot tell which it is.")
            }
        }
    }

    /// Why no extended machine was written.
    fn why_not_extended(&self) -> &'static str {
        match self.diagnosis.verdict {
            Verdict::Consistent => "nothing is wrong, so there is nothing to extend",
            Verdict::SomethingElse => "no cause explains the readings, so there is nothing to extend the machine by",
            _ if self.diagnosis.sets.as_ref().is_some_and(Vec::is_empty) => {
                "the cause lies in the readings: nothing changes in the machine file"
            }
            _ => "the machine file has no number that is the cause",
        }
    }
}

/// An explanation in words.
fn words(explanation: &Explanation) -> String {
    explanation.parts.iter().map(sentence).collect::<Vec<_>>().join("; and ")
}

/// An explanation by kind and place.
fn name(explanation: &Explanation) -> String {
    explanation.parts.iter().map(|p| format!("{} at {}", p.hypothesis.kind, p.hypothesis.place)).collect::<Vec<_>>().join("; ")
}

fn number(value: f64) -> serde_json::Value {
    if value.is_finite() { serde_json::json!(value) } else { serde_json::Value::Null }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// A kind that is not to be tried, which must be one that this machine and these data have.
fn kind_named(text: &str, study: &Study, data: &crate::evidence::measurement::Data, user: &[UserKind]) -> Result<String> {
    let mut kinds: Vec<&str> = hypotheses(study, data, user).iter().map(|h| h.kind).collect();
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

/// `KEY=10%` or `KEY=+-0.1 UNIT`
fn uncertain(text: &str, study: &Study) -> Result<(Parameter, f64)> {
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
        Ok((parameter, deviation))
    } else {
        Err(Error::input("a standard deviation is positive").at_key("--uncertain").read(text).help("write KEY=10% or KEY=+-50 W/(m2 K)"))
    }
}

/// `[kind.NAME]` tables: `heat_into = ["part"]`, `per_unit = "formula in W"`, `scale`, `signed`.
fn user_kinds(path: &Path, study: &Study) -> Result<Vec<UserKind>> {
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
        // The machine file's own reader says what is wrong with places and expression.
        let value = format!("{{ in = {:?}, power = {:?} }}", kind.places, kind.expression);
        study
            .edited(&[(format!("source.{}", quoted(&name)), value)])
            .map_err(|e| Error::input(e.what()).at_key(format!("kind.{name}")).in_file(path).help(e.remedy().unwrap_or("").to_string()))?;
        found.push(kind);
    }
    root.finish()?;
    Ok(found)
}
