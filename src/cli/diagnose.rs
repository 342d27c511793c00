//! `coldplate diagnose`: what the simulation gets wrong, why, and how much better it gets.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::condition::{pair_of, start_of};
use super::output::Output;
use super::text::{significant, table};
use crate::diagnose::{self, Diagnosis, Explanation, Openness, Problem, UserKind, Verdict, sentence};
use crate::error::{Error, Result};
use crate::files;
use crate::machine::Condition;
use crate::measure::{Data, Uncertainty, whiten};
use crate::reader::{Document, edited};
use crate::report::{Align, Cell, KeyFigure, Report, Table, Tone};
use crate::sensitivity::{Parameter, Study};
use crate::units::{Celsius, Dimension, Kelvin, express, parse};

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
    let data = match &args.data {
        Some(path) => Data::read(path, machine)?,
        None => Data::of_machine(machine)?,
    };
    let uncertainty = match &args.data {
        Some(path) => Uncertainty::beside(path, &data, machine)?,
        None => Uncertainty::usual(&data, machine),
    };
    if uncertainty.file.is_none() {
        out.note("note: no file says how uncertain the readings are; taking limits of 0.1 K for readings, sensors and water, 0.05 L/min");
    }
    data.notes.iter().for_each(|note| out.note(&format!("note: {note}")));
    let start = start_of(&args.from)?;
    let uncertain = args.uncertain.iter().map(|text| uncertain(text, &study)).collect::<Result<Vec<_>>>()?;
    let user = match &args.kinds {
        Some(path) => user_kinds(path, &study)?,
        None => Vec::new(),
    };
    let path = match &args.out {
        Some(path) if path.exists() => {
            return Err(Error::input("this file is there already")
                .in_file(path)
                .at_key("--out")
                .help("give another name: nothing is written over"));
        }
        Some(path) => path.clone(),
        None => unused(&args.machine),
    };
    let problem =
        Problem { study, data, uncertainty, uncertain, openness: Openness::default(), user, start, seed: 1, without: args.without.clone() };
    let found = diagnose::diagnose(&problem, &mut |what| out.note(what))?;
    let written = match (&found.verdict, &found.sets) {
        (Verdict::Explained | Verdict::CannotTell, Some(sets)) if !sets.is_empty() => {
            files::write(&path, extended(&problem, &found, sets)?.as_bytes())?;
            Some(path)
        }
        _ => None,
    };
    if let Some(path) = &args.report {
        report(&problem, &found, written.as_deref())?.write(path)?;
        out.note(&format!("wrote {}", path.display()));
    }
    out.report(&text(&problem, &found, written.as_deref()), &to_json(&problem, &found, written.as_deref()));
    Ok(0)
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
    if deviation > 0.0 { Ok((parameter, deviation)) } else { Err(malformed().help("a standard deviation is positive")) }
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
            .edited(&[(format!("source.\"{name}\""), value)])
            .map_err(|e| Error::input(e.what()).at_key(format!("kind.{name}")).in_file(path).help(e.remedy().unwrap_or("").to_string()))?;
        found.push(kind);
    }
    root.finish()?;
    Ok(found)
}

/// A name beside the machine file that no file has.
fn unused(machine: &Path) -> PathBuf {
    let stem = machine.file_stem().map_or_else(|| "machine".into(), |s| s.to_string_lossy().into_owned());
    let named =
        |n: usize| machine.with_file_name(if n == 1 { format!("{stem}.extended.toml") } else { format!("{stem}.extended-{n}.toml") });
    (1..).map(named).find(|p| !p.exists()).unwrap_or_else(|| named(1))
}

/// Text of the extended machine file.
fn extended(problem: &Problem, found: &Diagnosis, sets: &[(String, String)]) -> Result<String> {
    let document = problem.study.document();
    let path = document.file();
    let text = std::fs::read_to_string(path).map_err(|e| Error::file("read", path, &e))?;
    let name = |p: &Path| p.file_name().map_or_else(|| p.display().to_string(), |n| n.to_string_lossy().into_owned());
    let best = &found.explanations[0];
    let mut lines = vec![
        format!("Extended by coldplate {} from {}", env!("CARGO_PKG_VERSION"), name(Path::new(&problem.data.source))),
        format!("of the machine file {}, SHA-256 {}", name(path), &document.hash()[..16]),
        format!(
            "verdict {}, probability {:.3}, misfit {:.1} before, {:.1} after",
            found.verdict.code(),
            best.probability,
            found.misfit.chi2,
            best.misfit
        ),
    ];
    for part in &best.parts {
        lines.push(sentence(part));
        let (low, high) = part.interval();
        lines.push(format!(
            "  amplitude {} [{}], 90 % interval {} to {}",
            significant(part.amplitude, 5),
            part.hypothesis.unit,
            significant(low, 5),
            significant(high, 5)
        ));
        if part.hypothesis.is_sensor() {
            lines.push("  (a sensor's own error: nothing in this file changes for it)".into());
        }
    }
    let comment: String = lines.iter().map(|line| format!("# {line}\n")).collect();
    let text = format!("{comment}\n{}", edited(&text, path, sets)?);
    // It must be a machine.
    crate::machine::Machine::from_document(&Document::parse(&text, path)?)?;
    Ok(text)
}

fn condition_text(problem: &Problem, condition: &Condition) -> String {
    let of = |(v, si): (&crate::machine::Variable, &f64)| {
        format!("{} {} {}", v.name.replace('_', " "), significant(express(*si, &v.unit, v.dimension).unwrap_or(*si), 4), v.unit)
    };
    problem.study.model.machine.variables.iter().zip(condition.si()).map(of).collect::<Vec<_>>().join(", ")
}

/// The answer in one sentence.
fn headline(found: &Diagnosis) -> String {
    match found.verdict {
        Verdict::Consistent => format!(
            "The readings do not contradict the machine: a misfit this large or larger has probability {:.2}, a cause this convincing {:.2}.",
            found.misfit.probability, found.misfit.look_elsewhere
        ),
        Verdict::Explained => {
            let best = &found.explanations[0];
            let what: Vec<String> = best.parts.iter().map(sentence).collect();
            format!("{}; probability {:.2}.", capital(&what.join("; and ")), found.level.probability.min(0.999))
        }
        Verdict::SomethingElse => format!(
            "Something is wrong that no cause of the catalogue explains{}.",
            if found.level.what.is_empty() { String::new() } else { format!("; what comes nearest points to {}", found.level.what) }
        ),
        Verdict::CannotTell => {
            let certain = match found.level.name {
                "place" => format!("it is at {}", found.level.what),
                "region" => format!("it touches {}", found.level.what),
                _ => "not even its place is certain".into(),
            };
            format!("Something is wrong; {certain}, and {} explanations fit alike: the data cannot tell them apart.", found.set)
        }
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn explanation_rows(explanations: &[Explanation], most: usize) -> Vec<Vec<String>> {
    let of = |e: &Explanation| {
        let what: Vec<String> = e.parts.iter().map(sentence).collect();
        vec![format!("{:.3}", e.probability), format!("{:.1}", e.misfit), what.join("; and ")]
    };
    explanations.iter().enumerate().filter(|(i, e)| *i < 3 || e.probability > 5e-4).take(most).map(|(_, e)| of(e)).collect()
}

fn text(problem: &Problem, found: &Diagnosis, written: Option<&Path>) -> String {
    let data = &problem.data;
    let mut text = format!(
        "{}\n{} readings of {} sensors\n\n{}\n\n",
        problem.study.model.machine.name,
        data.count(),
        data.sensors.len(),
        headline(found)
    );
    text += &format!(
        "  misfit {:.1} over {} readings, p = {:.2e}; best of {} causes that could show ({} tried), p = {:.2e}\n",
        found.misfit.chi2, found.misfit.freedom, found.misfit.probability, found.tried.1, found.tried.0, found.misfit.look_elsewhere
    );
    text += &format!("  nothing wrong {:.3}, something else {:.3}\n\n", found.others.0, found.others.1);
    if found.verdict != Verdict::Consistent {
        text += &table(&["probability", "misfit left", "cause"], &explanation_rows(&found.explanations, 12));
        text += "\n";
    }
    if let Some(gain) = &found.gain {
        text += &format!(
            "on {} conditions, each kept out of all of the above: error {:.3} K before, {:.3} K after; gain {:.3} K ({:.3} to {:.3}), noise floor {:.3} K\n",
            gain.conditions.len(),
            gain.before,
            gain.after,
            gain.before - gain.after,
            gain.interval.0,
            gain.interval.1,
            gain.noise_floor
        );
    } else {
        text += "too few conditions to keep some out: the gain on unseen ones is not known\n";
    }
    for (i, next) in found.next.iter().enumerate() {
        text += &format!(
            "{} {}: sets them {:.1} standard deviations apart",
            if i == 0 { "\nwhat to measure next:\n  a steady test at" } else { "  or at" },
            condition_text(problem, &next.condition),
            next.mean
        );
        if let Some((sensor, d)) = &next.sensor {
            text += &format!("; a sensor at {sensor} alone {d:.1}");
        }
        text += "\n";
    }
    if let Some(path) = written {
        text += &format!("\nwrote {}\n", path.display());
    }
    text += &format!("{:.2} s\n", found.seconds);
    text
}

fn celsius(kelvin: f64) -> f64 {
    Celsius::from(Kelvin(kelvin)).0
}

fn to_json(problem: &Problem, found: &Diagnosis, written: Option<&Path>) -> Value {
    let number = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
    let cause = |e: &Explanation| -> Vec<Value> {
        e.parts
            .iter()
            .map(|p| {
                let (low, high) = p.interval();
                json!({
                    "kind": p.hypothesis.kind, "place": p.hypothesis.place, "law": p.hypothesis.law.words(),
                    "parameters": {"amplitude": {"value": number(p.amplitude), "low": number(low), "high": number(high), "unit": p.hypothesis.unit}},
                    "probability": e.probability, "text": sentence(p),
                    "ambiguous_with": found.explanations.iter().take(found.set).filter(|o| *o != e).map(|o| o.parts.iter().map(|p| format!("{} at {}", p.hypothesis.kind, p.hypothesis.place)).collect::<Vec<_>>().join("; ")).collect::<Vec<_>>(),
                })
            })
            .collect()
    };
    let places = whiten::places(&problem.data);
    let readings = whiten::readings(&problem.data);
    let sheet: Vec<Value> = places
        .iter()
        .enumerate()
        .map(|(i, (r, k))| {
            let row = &problem.data.rows[*r];
            json!({"test": row.test, "time_s": row.time, "sensor": problem.data.names[*k], "measured_degC": celsius(readings[i]),
                "predicted_degC": celsius(found.sheet.predicted[i]), "residual_K": found.sheet.residual[i],
                "explained_degC": found.explained.as_ref().map(|e| celsius(e[i]))})
        })
        .collect();
    let condition = |c: &Condition| -> Map<String, Value> {
        let variables = &problem.study.model.machine.variables;
        variables
            .iter()
            .zip(c.si())
            .map(|(v, si)| {
                (v.name.clone(), json!(format!("{} {}", significant(express(*si, &v.unit, v.dimension).unwrap_or(*si), 6), v.unit)))
            })
            .collect()
    };
    json!({
        "misfit": {"chi2": found.misfit.chi2, "dof": found.misfit.freedom, "p": found.misfit.probability, "p_look_elsewhere": found.misfit.look_elsewhere},
        "verdict": found.verdict.code(),
        "headline": headline(found),
        "level": {"name": found.level.name, "what": found.level.what, "probability": found.level.probability},
        "probabilities": {"nothing": found.others.0, "something_else": found.others.1},
        "causes": if matches!(found.verdict, Verdict::Consistent | Verdict::SomethingElse) { Vec::new() } else { found.explanations.first().map(&cause).unwrap_or_default() },
        "set": found.explanations.iter().take(found.set).map(&cause).collect::<Vec<_>>(),
        "next_measurement": found.next.iter().map(|n| json!({"condition": condition(&n.condition), "separation_sigma": n.mean, "least_sigma": number(n.separation), "sensor": n.sensor.as_ref().map(|s| &s.0)})).collect::<Vec<_>>(),
        "gain": found.gain.as_ref().map(|g| json!({"rmse_before_K": g.before, "rmse_after_K": g.after, "low": g.interval.0, "high": g.interval.1, "noise_floor_K": g.noise_floor, "held_out": g.conditions})),
        "extended_machine": written.map(|p| p.display().to_string()),
        "tried": found.tried.0, "visible": found.tried.1,
        "readings": sheet,
        "seconds": found.seconds,
    })
}

/// A report for readers who were not there.
fn report(problem: &Problem, found: &Diagnosis, written: Option<&Path>) -> Result<Report> {
    let data = &problem.data;
    let mut report = Report::new(format!("{}: measured and simulated", problem.study.model.machine.name));
    report.subtitle(headline(found));
    let tone = match found.verdict {
        Verdict::Consistent => Tone::Good,
        Verdict::Explained => Tone::Uncertain,
        _ => Tone::Bad,
    };
    let section = report.section("What was found");
    let mut figures = vec![
        KeyFigure::new(found.verdict.code().replace('_', " "), "verdict").tone(tone),
        KeyFigure::new(format!("{:.1}", found.misfit.chi2), format!("misfit, where {} is expected", found.misfit.freedom)),
        KeyFigure::new(format!("{:.1e}", found.misfit.look_elsewhere.max(5e-4)), "probability that noise looks like some cause by chance"),
    ];
    if let Some(gain) = &found.gain {
        figures.push(KeyFigure::new(
            format!("{:.2} → {:.2} K", gain.before, gain.after),
            format!("error on conditions kept out; noise floor {:.2} K", gain.noise_floor),
        ));
    }
    section.key_figures(figures);
    if found.verdict != Verdict::Consistent {
        let mut table = Table::new([("probability", Align::Right), ("misfit left", Align::Right), ("cause", Align::Left)]);
        for row in explanation_rows(&found.explanations, 12) {
            table.row(row.into_iter().map(Cell::from));
        }
        section.table(table);
        section.paragraph(format!(
            "{} explanations cannot be refuted by these data. Nothing wrong: {:.3}; something else: {:.3}.",
            found.set, found.others.0, found.others.1
        ));
    }
    if !found.next.is_empty() {
        let section = report.section("What to measure next");
        section.list(found.next.iter().map(|n| {
            let sensor = n.sensor.as_ref().map_or(String::new(), |(s, d)| format!("; a sensor at {s} alone {d:.1}"));
            format!(
                "a steady test at {}: {:.1} standard deviations between the explanations{sensor}",
                condition_text(problem, &n.condition),
                n.mean
            )
        }));
    }
    let section = report.section("Residuals");
    section.paragraph("Measured less predicted, in kelvin; rows are conditions, columns sensors. The second number, where there is one, is what is left with the best explanation.");
    let mut head = vec!["test".to_string()];
    head.extend(data.names.iter().cloned());
    let mut table = Table::new(head.into_iter().enumerate().map(|(i, h)| (h, if i == 0 { Align::Left } else { Align::Right })));
    let places = whiten::places(data);
    let readings = whiten::readings(data);
    let shown: Vec<usize> = if data.rows.len() > 60 {
        (0..data.rows.len()).step_by(data.rows.len() / 60 + 1).collect()
    } else {
        (0..data.rows.len()).collect()
    };
    for r in shown {
        let mut cells = vec![data.rows[r].time.map_or(data.rows[r].test.clone(), |t| format!("{} at {t:.0} s", data.rows[r].test))];
        for k in 0..data.names.len() {
            cells.push(match places.iter().position(|p| *p == (r, k)) {
                Some(i) => match &found.explained {
                    Some(e) => format!("{:+.2} / {:+.2}", found.sheet.residual[i], readings[i] - e[i]),
                    None => format!("{:+.2}", found.sheet.residual[i]),
                },
                None => String::new(),
            });
        }
        table.row(cells.into_iter().map(Cell::from));
    }
    section.table(table);
    if let Some(path) = written {
        report
            .section("The extended machine")
            .paragraph(format!("Written to {}; the amplitude with its interval stands at its head.", path.display()));
    }
    report.footer(format!(
        "coldplate {}, data {}, machine file {}",
        env!("CARGO_PKG_VERSION"),
        data.source,
        problem.study.document().file().display()
    ));
    Ok(report)
}
