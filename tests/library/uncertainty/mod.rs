//! Whether bands and probabilities hold: slopes against differences of solves, bands against draws through the full solver, and
//! coverage over twins whose truth has another mesh, drawn parameters and errors of its own.

mod followed;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use coldplate_base::document::Document;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_explore::sweep::{SweepOptions, sweep_file::Sweep};
use coldplate_jobs::fitting::{fit_table, with_uncertainty};
use coldplate_solve::sensitivity::{Derivatives, OpenParameter, Scale};
use coldplate_solve::study::Study;
use coldplate_surrogate::fit::FitOptions;
use coldplate_surrogate::fit::file::{encode, open};
use coldplate_surrogate::verdict::instruments::Instruments;
use coldplate_surrogate::verdict::{Acceptability, query, update};
use coldplate_tables::{Column, Table};
use rayon::prelude::*;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The tutorial's machine: two numbers and a pair of them stated as uncertain, everything else as it is assumed.
fn machine() -> Document {
    let mut document = Document::read(root().join("examples/tutorial/machine.toml")).unwrap();
    for (key, value) in [
        ("contact.motor_foot.conductance", "\"600 +- 60 W/(m2 K)\""),
        ("source.bearing.power", "\"0.008 * motor_speed_rpm\""),
        ("contact.shaft.conductance", "\"600 +- 80 W/(m2 K)\""),
        ("surfaces.emissivity", "\"0.4 +- 0.05\""),
        ("uncertain.heats", "{ all = \"heats\", deviation = \"6 %\", source = \"the drive's data sheet\" }"),
    ] {
        document.apply_set(key, value).unwrap();
    }
    document
}

/// Lines of the machine file with an open parameter at a standardised deviation.
fn lines(study: &Study, parameter: &OpenParameter, z: f64) -> Vec<(String, String)> {
    let share = parameter.deviation / parameter.nominal;
    let factor = match parameter.scale {
        Scale::Linear => 1.0 + share * z,
        Scale::Log => (share * z).exp(),
        Scale::Reciprocal => 1.0 / (1.0 - share * z),
    };
    let machine = &study.model.machine;
    let keys: Vec<String> = match parameter.name.as_str() {
        "all films" => machine.channels.iter().map(|c| format!("channel.{}.film_factor", c.name)).collect(),
        "other contacts" => vec!["contact.pedestal_foot.conductance".into(), "contact.seat.conductance".into()],
        "heats" | "all heats" => machine.sources.iter().map(|s| format!("source.{}.power", s.name)).collect(),
        key => vec![key.to_string()],
    };
    let line = |key: &String| {
        let own = study.parameter(key).unwrap();
        own.to_set(own.value * factor, machine).unwrap().unwrap()
    };
    keys.iter().map(line).collect()
}

fn readings(study: &Study, condition: &Condition) -> Vec<f64> {
    let state = study.model.solve(&study.model.solver(condition).unwrap(), condition).unwrap();
    study.model.readings(&state)
}

fn condition(study: &Study) -> Condition {
    study.model.machine.condition(&[("motor_speed", "2500 rpm"), ("coolant_flow", "3 L/min")]).unwrap()
}

#[test]
fn slopes_are_differences_of_solves() {
    let study = Study::new(machine(), Some(300)).unwrap();
    let parameters = study.open_parameters(true).unwrap();
    let names: Vec<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(
        names,
        ["surfaces.emissivity", "contact.motor_foot.conductance", "contact.shaft.conductance", "heats", "all films", "other contacts"]
    );
    let at = condition(&study);
    let state = study.model.solve(&study.model.solver(&at).unwrap(), &at).unwrap();
    let slopes = Derivatives::at(&study, &at, &state.solution.temperatures).unwrap().along_open(&parameters).unwrap();
    for (k, parameter) in parameters.iter().enumerate() {
        let moved = |z: f64| readings(&study.edited(&lines(&study, parameter, z)).unwrap(), &at);
        let (more, less) = (moved(0.05), moved(-0.05));
        for (s, (more, less)) in more.iter().zip(&less).enumerate() {
            let difference = (more - less) / 0.1;
            assert!(
                (slopes[s][k] - difference).abs() < 1e-3 * difference.abs() + 1e-6,
                "{} {s}: {} {difference}",
                parameter.name,
                slopes[s][k]
            );
        }
    }
}

/// The same whether the sensors or the parameters are fewer.
#[test]
fn both_ways_to_the_slopes_agree() {
    let study = Study::new(machine(), Some(300)).unwrap();
    let parameters = study.open_parameters(true).unwrap();
    let many: Vec<OpenParameter> = parameters.iter().cycle().take(3 * parameters.len()).cloned().collect();
    let at = condition(&study);
    let state = study.model.solve(&study.model.solver(&at).unwrap(), &at).unwrap();
    let derivatives = Derivatives::at(&study, &at, &state.solution.temperatures).unwrap();
    let (fields, adjoints) = (derivatives.along_open(&parameters).unwrap(), derivatives.along_open(&many).unwrap());
    for (a, b) in fields.iter().flatten().zip(adjoints.iter().flat_map(|row| &row[..parameters.len()])) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

/// The surrogate file of a machine, and its design's folder.
fn surrogate(document: &Document, cells: usize, folder: &Path) -> Vec<u8> {
    std::fs::create_dir_all(folder).unwrap();
    let sweep = std::fs::read_to_string(root().join("examples/tutorial/sweep.toml")).unwrap();
    let definition = coldplate_explore::sweep::SweepDefinition::new(Document::parse(&sweep, "sweep.toml").unwrap()).unwrap();
    let study = Study::new(document.clone(), Some(cells)).unwrap();
    let plan = definition.plan(&study.model.machine.variables).unwrap();
    let sweep = Sweep::of(definition, plan, study).unwrap();
    let mut swept = sweep.run(folder, SweepOptions::default()).unwrap();
    // The true machines are solved on the same mesh: its error is none of theirs.
    swept.table.provenance.retain(|(key, _)| key != coldplate_explore::sweep::MESH_ERRORS);
    let mut fit = fit_table(&swept.table, Some(&sweep.scope), &FitOptions::default()).unwrap();
    with_uncertainty(&mut fit, swept.slopes.as_ref()).unwrap();
    encode(&fit.surrogate).unwrap()
}

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("uncertainty-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

/// 2000 draws of the parameters through the full solver at one condition, beside the file's band.
#[test]
fn bands_agree_with_draws_through_the_solver() {
    let document = machine();
    let bytes = surrogate(&document, 300, &folder("draws"));
    let file = open(&bytes).unwrap();
    let study = Study::new(document, Some(300)).unwrap();
    let parameters = study.open_parameters(true).unwrap();
    let at = condition(&study);
    let all: Vec<Vec<f64>> = (0..2000u64)
        .into_par_iter()
        .map(|seed| {
            let mut random = Random::new(seed + 1);
            let sets: BTreeMap<String, String> = parameters.iter().flat_map(|p| lines(&study, p, random.normal())).collect();
            readings(&study.edited(&sets.into_iter().collect::<Vec<_>>()).unwrap(), &at)
        })
        .collect();
    let x = in_units(&file, &study, &at);
    let answer = query(&file, &x).unwrap();
    for (s, point) in answer.temperatures.iter().enumerate() {
        let n = all.len() as f64;
        let mean = all.iter().map(|r| r[s]).sum::<f64>() / n;
        let deviation = (all.iter().map(|r| (r[s] - mean).powi(2)).sum::<f64>() / n).sqrt();
        let band = point.parts.unwrap().parameters / coldplate_runtime::NINETY_FIVE;
        println!("{}: {band:.4} K, drawn {deviation:.4} K", point.name);
        assert!((band / deviation - 1.0).abs() < 0.05, "{}: {band} {deviation}", point.name);
    }
}

/// A condition in the variables and units of a surrogate.
fn in_units(file: &coldplate_runtime::Surrogate<'_>, study: &Study, at: &Condition) -> Vec<f64> {
    let machine = &study.model.machine;
    let value = |v: coldplate_runtime::Variable<'_>| {
        let index = machine.variables.iter().position(|own| own.name == v.name).unwrap();
        coldplate_base::units::express(at.si()[index], v.unit, machine.variables[index].dimension).unwrap()
    };
    file.variables().map(value).collect()
}

/// Hits of bands and of stated verdicts.
#[derive(Default, Clone, Copy)]
struct Count {
    values: usize,
    held: usize,
    margins: usize,
    margins_held: usize,
    stated: usize,
    right: usize,
}

impl Count {
    fn join(self, other: Self) -> Self {
        Self {
            values: self.values + other.values,
            held: self.held + other.held,
            margins: self.margins + other.margins,
            margins_held: self.margins_held + other.margins_held,
            stated: self.stated + other.stated,
            right: self.right + other.right,
        }
    }

    /// What a file says of unseen conditions, against their truth.
    fn of(bytes: &[u8], study: &Study, conditions: &[Condition], truths: &[Vec<f64>]) -> Self {
        let file = open(bytes).unwrap();
        let mut count = Self::default();
        for (at, truth) in conditions.iter().zip(truths) {
            let x = in_units(&file, study, at);
            let answer = query(&file, &x).unwrap();
            for (point, truth) in answer.temperatures.iter().zip(truth) {
                count.values += 1;
                count.held += usize::from(point.low <= *truth && *truth <= point.high);
            }
            let rise = |truth: &[f64]| truth[2] - coldplate_base::units::celsius(at.si()[3]);
            let margins = [60.0 - truth[0], 15.0 - rise(truth)];
            for (limit, margin) in answer.limits.iter().zip(margins) {
                let half = (limit.high - limit.low) / 2.0;
                count.margins += 1;
                count.margins_held += usize::from((limit.margin - margin).abs() <= half);
            }
            let is_kept = margins.iter().all(|m| *m >= 0.0);
            if answer.verdict != Acceptability::Uncertain {
                count.stated += 1;
                count.right += usize::from(is_kept == (answer.verdict == Acceptability::Acceptable));
            }
        }
        count
    }

    fn share(held: usize, of: usize) -> f64 {
        held as f64 / of as f64
    }
}

/// 300 machines drawn from what is stated, on another mesh, with errors of every sensor and of all together that change with the
/// condition: their unseen temperatures and margins lie in the bands as often as these say, before and after 4 to 20 conditions
/// were read.
#[test]
fn bands_cover_what_they_say() {
    let mut document = machine();
    document.apply_set("model_error", "{ sensors = \"0.3 K\", common = \"0.2 K\", growth = 0.3 }").unwrap();
    let bytes = surrogate(&document, 400, &folder("coverage"));
    let study = Study::new(document.clone(), Some(900)).unwrap();
    let parameters = study.open_parameters(true).unwrap();
    let twin = |seed: u64| -> (Count, Count) {
        let mut random = Random::new(1000 + seed);
        let sets: BTreeMap<String, String> = parameters.iter().flat_map(|p| lines(&study, p, random.normal())).collect();
        let truth = study.edited(&sets.into_iter().collect::<Vec<_>>()).unwrap();
        let common = 0.2 * random.normal();
        let errors: Vec<f64> = (0..5).map(|_| common + 0.3 * random.normal()).collect();
        let read = [4, 8, 20][seed as usize % 3];
        let draw = |random: &mut Random| -> Condition {
            let of =
                |v: &coldplate_describe::machine::DescribedVariable| v.range.map(|(low, high)| low + (high - low) * random.unit()).unwrap();
            Condition::from_si(study.model.machine.variables.iter().map(of).collect())
        };
        let conditions: Vec<Condition> = (0..read + 6).map(|_| draw(&mut random)).collect();
        // What changes of an error over half of a range is a third of it.
        let common_tilt = [(); 4].map(|()| 0.3 * 0.2 * random.normal());
        let tilts: Vec<[f64; 4]> = (0..5).map(|_| common_tilt.map(|common| common + 0.3 * 0.3 * random.normal())).collect();
        let true_readings = |at: &Condition| -> Vec<f64> {
            let scaled: Vec<f64> = (at.si().iter().zip(&study.model.machine.variables))
                .map(|(x, v)| v.range.map_or(0.0, |(low, high)| 2.0 * (x - low) / (high - low) - 1.0))
                .collect();
            let error = |s: usize| errors[s] + tilts[s].iter().zip(&scaled).map(|(a, u)| a * u).sum::<f64>();
            readings(&truth, at).iter().enumerate().map(|(s, t)| t + error(s)).collect()
        };
        let truths: Vec<Vec<f64>> = conditions.iter().map(true_readings).collect();
        let (unseen, unseen_truths) = (&conditions[read..], &truths[read..]);
        let before = Count::of(&bytes, &study, unseen, unseen_truths);
        let file = open(&bytes).unwrap();
        let rows: Vec<Vec<f64>> = conditions[..read].iter().map(|at| in_units(&file, &study, at)).collect();
        let mut columns: Vec<Column> = file
            .variables()
            .enumerate()
            .map(|(k, v)| Column { name: v.name.into(), unit: v.unit.into(), values: rows.iter().map(|r| r[k]).collect() })
            .collect();
        columns.extend(file.points().enumerate().map(|(p, point)| Column {
            name: point.name.into(),
            unit: "degC".into(),
            values: truths[..read].iter().map(|t| t[p] + 0.05 * random.normal()).collect(),
        }));
        let table = Table { texts: vec![], columns, inputs: 4, provenance: vec![] };
        let lines: Vec<usize> = (2..2 + read).collect();
        let after = update::update(&bytes, &table, &lines, &Instruments::with_noise(&open(&bytes).unwrap(), 0.05)).unwrap();
        (before, Count::of(&after.bytes, &study, unseen, unseen_truths))
    };
    let counts: Vec<(Count, Count)> = (0..300).into_par_iter().map(twin).collect();
    let (before, after) = counts.into_iter().reduce(|a, b| (a.0.join(b.0), a.1.join(b.1))).unwrap();
    for (when, count) in [("before", before), ("after", after)] {
        let (values, margins) = (Count::share(count.held, count.values), Count::share(count.margins_held, count.margins));
        let right = Count::share(count.right, count.stated);
        println!("{when}: values {values:.4}, margins {margins:.4}, {} of {} verdicts right ({right:.4})", count.right, count.stated);
    }
    // Afterwards the bands are a little wider than they need be: an error that changes smoothly with the condition counts as new at
    // every condition, while the parameters follow part of it.
    for (count, most) in [(before, 0.97), (after, 0.985)] {
        let (values, margins) = (Count::share(count.held, count.values), Count::share(count.margins_held, count.margins));
        assert!((0.93..=most).contains(&values) && (0.93..=most).contains(&margins), "{values} {margins}");
        assert!(Count::share(count.right, count.stated) >= 0.95);
    }
    assert!(after.stated > before.stated);
}
