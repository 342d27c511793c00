//! A case by its seed: a machine, what is hidden in it, what reality does beside that, and the readings.

use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::Problem;
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, Whitener, whiten};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use serde::{Deserialize, Serialize};

use crate::machines::{SETTINGS, Setting};
use crate::outside::{Memory, outside};
use crate::truth::{Truth, fine};
use crate::unkind::Unkindness;
use coldplate_testing::twin::score::least;
use coldplate_testing::twin::{Case, Hidden, between, effects, perturbed, stated};

/// Families of cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Family {
    /// Nothing is hidden.
    Clean,
    /// One effect of the catalogue.
    One,
    /// Two.
    Two,
    /// Three.
    Three,
    /// Four.
    Four,
    /// One that the catalogue does not have.
    Outside,
}

impl Family {
    /// All of them, with their share of the cases in per cent.
    pub const ALL: [(Self, f64); 6] =
        [(Self::Clean, 20.0), (Self::One, 28.0), (Self::Two, 12.0), (Self::Three, 5.0), (Self::Four, 1.0), (Self::Outside, 34.0)];

    /// By its name in lower case.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(family, _)| family).find(|family| format!("{family:?}").to_lowercase() == name)
    }

    fn count(self) -> usize {
        match self {
            Self::Clean => 0,
            Self::One | Self::Outside => 1,
            Self::Two => 2,
            Self::Three => 3,
            Self::Four => 4,
        }
    }
}

/// How far an effect alone stands out of the instruments' errors, and of several each beside the others.
const SHOWS: (f64, f64) = (4.0, 300.0);
const BESIDE: f64 = 8.0;
/// Draws after which the last is taken as it is.
const MOST_DRAWS: usize = 15;
/// Rows of a table that the program never sees; of logs it is a test.
const UNSEEN: usize = 8;

/// A case with everything that is known of it.
pub struct Drawn {
    /// What the program sees, and what was hidden.
    pub case: Case,
    pub family: Family,
    pub setting: &'static Setting,
    pub unkind: Vec<Unkindness>,
    /// Readings that the program never sees.
    pub unseen: Data,
    /// What is left of them by the machine as it is if everything hidden is taken away, K: root mean square.
    pub floor: f64,
}

/// Machine and family of a seed, and its further random numbers.
fn begun(seed: u64) -> (&'static Setting, Family, Random) {
    let mut random = Random::new(seed.wrapping_mul(104_729).wrapping_add(17));
    let setting = &SETTINGS[weighted(SETTINGS.iter().map(|s| s.share), &mut random)];
    let family = Family::ALL[weighted(Family::ALL.iter().map(|f| f.1), &mut random)].0;
    (setting, family, random)
}

/// The family of a seed.
pub fn family(seed: u64) -> Family {
    begun(seed).1
}

/// The case of a seed.
pub fn draw(seed: u64) -> Drawn {
    let (setting, family, mut random) = begun(seed);
    let unkind = Unkindness::some(setting, &mut random);
    let study = Study::new(setting.document(), setting.cells.map(|c| c[0])).expect("a machine of the benchmark");
    let sensors = some_sensors(study.model.machine.sensors.len(), &mut random);
    let mut rows = match setting.log {
        Some(length) => logs(&study, length, sensors.len(), &mut random),
        None => table(&study, sensors.len(), &mut random),
    };
    let own = |random: &mut Random| between(random, 0.03, 0.1);
    let (noise, bias) = (own(&mut random), own(&mut random));
    let uncertainty = |factor: f64| MeasurementUncertainty {
        noise: vec![factor * noise; sensors.len()],
        bias: vec![factor * bias; sensors.len()],
        variables: study.model.machine.variables.iter().map(stated).collect(),
        model: 0.0,
        timing: if setting.log.is_some() { 0.6 } else { 0.0 },
        file: None,
    };
    let truth = made(&study, setting, &unkind, &rows, &sensors, &uncertainty(1.0), &mut random);
    let seen = |row: &ReadingRow| !row.test.starts_with("unseen");
    let width = sensors.len();
    let of_seen = |values: &[f64]| -> Vec<f64> {
        rows.iter().zip(values.chunks(width)).filter(|(row, _)| seen(row)).flat_map(|(_, values)| values.to_vec()).collect()
    };
    let instruments = {
        let count = rows.iter().filter(|row| seen(row)).count() * width;
        let own = |k: usize| (0..count).map(|i| if i % width == k { bias } else { 0.0 }).collect();
        Whitener::new(&vec![noise; count], &(0..width).map(own).collect::<Vec<_>>())
    };
    let Found { hidden, values, shifts, whole } = loop {
        let found = effects_of(family, setting, &truth, &sensors, &mut random, &|shifts| {
            let seen: Vec<Vec<f64>> = shifts.iter().map(|shift| of_seen(shift)).collect();
            least(&seen, &instruments)
        });
        if let Some(found) = found {
            break found;
        }
    };
    let shifts: Vec<Vec<f64>> = shifts.iter().map(|shift| of_seen(shift)).collect();
    let errors: Vec<f64> = (0..width).map(|_| bias * random.normal()).collect();
    for (row, values) in rows.iter_mut().zip(values.chunks(width)) {
        row.readings = values.iter().zip(&errors).map(|(v, e)| Some(v + e + noise * random.normal())).collect();
    }
    let names: Vec<String> = sensors.iter().map(|s| study.model.machine.sensors[*s].name.clone()).collect();
    let part = |is: bool| Data {
        source: "a twin".into(),
        sensors: sensors.clone(),
        names: names.clone(),
        rows: rows.iter().filter(|row| seen(row) == is).cloned().collect(),
        ..Data::default()
    };
    let (mut data, unseen) = (part(true), part(false));
    let floor = {
        let predicted = identify::values(&study, &unseen, Start::Steady).expect("the machine as it is");
        let hidden = rows.iter().zip(whole.chunks(width)).filter(|(row, _)| !seen(row)).flat_map(|(_, shift)| shift.to_vec());
        let squares: f64 = whiten::readings(&unseen).iter().zip(&predicted).zip(hidden).map(|((r, p), h)| (r - p - h).powi(2)).sum();
        (squares / predicted.len().max(1) as f64).sqrt()
    };
    let sound = data.clone();
    unkind.iter().for_each(|one| one.spoil(&mut data, &hidden, &mut random));
    // A reading that is spoilt shows nothing, and neither does a sensor most of whose readings are.
    let is_sound = |row: usize, k: usize| sound.rows[row].readings[k] == data.rows[row].readings[k];
    let shows: Vec<bool> =
        (0..width).map(|k| 2 * (0..data.rows.len()).filter(|row| is_sound(*row, k)).count() >= data.rows.len()).collect();
    let spoilt: Vec<Vec<bool>> = (0..data.rows.len()).map(|row| (0..width).map(|k| !shows[k] || !is_sound(row, k)).collect()).collect();
    let whole_rows = data.rows.iter().map(|row| (row.test.clone(), row.time)).collect::<Vec<_>>();
    let stated = uncertainty(Unkindness::stated(&unkind));
    let mut problem = Problem::new(study, data);
    (problem.uncertainty, problem.seed) = (stated, seed);
    let problem = problem.cleared().expect("the machine as it is").thinned().timed().expect("a machine with a time");
    let unseen = problem.unseen(unseen);
    // Shifts of the readings that are left.
    let at = |(r, k): &(usize, usize)| {
        let row = &problem.data.rows[*r];
        let original = whole_rows.iter().position(|(test, time)| *test == row.test && *time == row.time);
        let original = original.expect("a row of the data");
        (!spoilt[original][*k]).then_some(original * width + k)
    };
    let left: Vec<Option<usize>> = whiten::places(&problem.data).iter().map(at).collect();
    let shifts = shifts.iter().map(|shift| left.iter().map(|i| i.map_or(0.0, |i| shift[i])).collect()).collect();
    Drawn { case: Case { problem, hidden, shifts }, family, setting, unkind, unseen, floor }
}

/// What was drawn, with what it does to every row.
struct Found {
    hidden: Vec<Hidden>,
    values: Vec<f64>,
    /// Each effect alone, K.
    shifts: Vec<Vec<f64>>,
    /// All of them together, K.
    whole: Vec<f64>,
}

/// Effects that show; none where they cannot be together.
fn effects_of(
    family: Family,
    setting: &Setting,
    truth: &Truth,
    sensors: &[usize],
    random: &mut Random,
    shows: &dyn Fn(&[Vec<f64>]) -> f64,
) -> Option<Found> {
    let less = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
    let clean = truth.values(&[], None)?;
    let (mut hidden, mut shifts): (Vec<Hidden>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let mut memory: Option<Memory> = None;
    let kinds = if setting.log.is_some() { effects::LOGS } else { effects::TABLES };
    for draws in 0.. {
        if hidden.len() == family.count() {
            break;
        }
        let one = match family {
            Family::Outside => {
                let made = outside(&truth.study, setting, sensors, random);
                memory = made.memory;
                made.hidden
            }
            // Of two, a third have what all members of a kind share.
            Family::Two if hidden.is_empty() && random.unit() < 0.3 => match effects::common(&truth.study, random) {
                Some(common) => common,
                None => continue,
            },
            _ => effects::effect(&truth.study, sensors, kinds, random),
        };
        if hidden.iter().any(|h| h.place == one.place || h.kind == one.kind) {
            continue;
        }
        let Some(with) = truth.values(std::slice::from_ref(&one), memory) else { continue };
        shifts.push(less(&with, &clean));
        let (alone, together) = (shows(&shifts[shifts.len() - 1..]), shows(&shifts));
        if draws < MOST_DRAWS && !(alone > SHOWS.0 && alone < SHOWS.1 && (shifts.len() == 1 || together > BESIDE)) {
            shifts.pop();
            continue;
        }
        hidden.push(one);
    }
    let values = truth.values(&hidden, memory)?;
    let whole = less(&values, &clean);
    Some(Found { hidden, values, shifts, whole })
}

/// The truth: other films, heats and emissivities, another mesh, and what unkindness does to it.
fn made(
    study: &Study,
    setting: &Setting,
    unkind: &[Unkindness],
    rows: &[ReadingRow],
    sensors: &[usize],
    uncertainty: &MeasurementUncertainty,
    random: &mut Random,
) -> Truth {
    let mut document = setting.document();
    let sizes = if unkind.contains(&Unkindness::Geometry) { setting.resized(0.05, random) } else { Vec::new() };
    for (key, value) in sizes.into_iter().chain(perturbed(study, random)) {
        document.apply_set(&key, &value).expect("a key of the machine");
    }
    let finer = if unkind.contains(&Unkindness::Mesh) { 2.0 } else { 1.0 };
    let cells = setting.cells.map(|c| (finer * between(random, c[1] as f64, c[2] as f64)) as usize);
    let truth = Study::new(document, cells).expect("the truth of a machine of the benchmark");
    let names: Vec<&str> = study.model.machine.variables.iter().map(|v| v.name.as_str()).collect();
    let scatter = unkind.contains(&Unkindness::Scatter).then(|| between(random, 0.02, 0.05));
    // One draw for each test.
    let mut last: Option<(String, Vec<f64>, f64)> = None;
    let mut real = Vec::new();
    let fine = fine(rows);
    for row in &fine.rows {
        if last.as_ref().is_none_or(|(test, ..)| *test != row.test) {
            let errors = names.iter().map(|_| random.normal()).collect();
            last = Some((row.test.clone(), errors, 1.0 + scatter.unwrap_or(0.0) * random.normal()));
        }
        let Some((_, errors, heat)) = &last else { continue };
        let deviation = |v: usize, stated: f64| match (scatter, names[v]) {
            (Some(_), "ambient_temperature") => stated.hypot(0.3),
            (Some(_), "coolant_temperature") => stated.hypot(0.2),
            _ => stated,
        };
        let at = uncertainty.at(&row.condition);
        let si = row.condition.si().iter().enumerate().map(|(v, value)| value + deviation(v, at[v]) * errors[v]).collect();
        real.push((ReadingRow { condition: Condition::from_si(si), readings: vec![Some(300.0); sensors.len()], ..row.clone() }, *heat));
    }
    let (rows, heats): (Vec<ReadingRow>, Vec<f64>) = real.into_iter().unzip();
    let names = sensors.iter().map(|s| study.model.machine.sensors[*s].name.clone()).collect();
    let data = Data { source: "a twin".into(), sensors: sensors.to_vec(), names, rows, ..Data::default() };
    Truth { study: truth, data, kept: fine.kept, heats: scatter.map(|_| heats) }
}

fn weighted(shares: impl Iterator<Item = f64> + Clone, random: &mut Random) -> usize {
    let mut at = random.unit() * shares.clone().sum::<f64>();
    shares
        .clone()
        .position(|share| {
            at -= share;
            at < 0.0
        })
        .unwrap_or(0)
}

/// Some sensors are lost; four are left at least.
fn some_sensors(all: usize, random: &mut Random) -> Vec<usize> {
    let kept: Vec<usize> = (0..all).filter(|_| random.unit() > 0.12).collect();
    if kept.len() < 4 { (0..all).collect() } else { kept }
}

/// A condition anywhere in the ranges.
fn anywhere(study: &Study, random: &mut Random) -> Condition {
    let of = |v: &coldplate_describe::machine::DescribedVariable| match v.range {
        Some((low, high)) => between(random, low, high),
        None => v.default.unwrap_or(0.0),
    };
    Condition::from_si(study.model.machine.variables.iter().map(of).collect())
}

/// A table of 5 to 16 rows, and some that the program never sees.
fn table(study: &Study, width: usize, random: &mut Random) -> Vec<ReadingRow> {
    let seen = (5.0 * 3.2f64.powf(random.unit())).round() as usize;
    let row = |i: usize| ReadingRow {
        test: if i < seen { format!("test {}", i + 1) } else { format!("unseen {}", i + 1 - seen) },
        time: None,
        condition: anywhere(study, random),
        readings: vec![Some(300.0); width],
        line: None,
    };
    (0..seen + UNSEEN).map(row).collect()
}

/// Two or three logs of two or three conditions each, 60 to 80 rows in all, and one more that the program never sees. A change of
/// condition takes a second; each begins in its steady state.
fn logs(study: &Study, length: f64, width: usize, random: &mut Random) -> Vec<ReadingRow> {
    let tests = 2 + random.below(2);
    let each = between(random, 60.0, 80.0) / tests as f64;
    let mut rows = Vec::new();
    for test in 0..=tests {
        let turns: Vec<f64> = (1..2 + random.below(2)).map(|i| (length * i as f64 * between(random, 0.2, 0.4)).round()).collect();
        let conditions: Vec<Condition> = (0..=turns.len() + 1).map(|_| anywhere(study, random)).collect();
        let mut times: Vec<f64> = (0..each as usize).map(|i| (i as f64 * length / each).round()).collect();
        times.extend(turns.iter().flat_map(|turn| [turn - 1.0, *turn]).chain([1.0]));
        times.sort_by(f64::total_cmp);
        times.dedup();
        let name = if test < tests { format!("log {}", test + 1) } else { "unseen".to_string() };
        rows.extend(times.iter().map(|time| ReadingRow {
            test: name.clone(),
            time: Some(*time),
            condition: conditions[if *time < 1.0 { 0 } else { 1 + turns.iter().filter(|turn| **turn <= *time).count() }].clone(),
            readings: vec![Some(300.0); width],
            line: None,
        }));
    }
    rows
}
