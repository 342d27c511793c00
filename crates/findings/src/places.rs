//! Places and kinds whose amplitude is free in every row of a table, as text and as outside programs read them.

use serde::Serialize;

use super::estimate::EstimateRecord;
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_base::progress::Progress;
use coldplate_base::units::Measurand;
use coldplate_diagnose::{AmplitudeSettings, Aside, Cause, PlaceAndKind, Places, Problem, places};

/// Sets that are told in text.
const TOLD: usize = 3;
/// Least probability of a set that is told beside the first.
const LEAST_TOLD: f64 = 0.01;

/// Part of an answer that `--amplitudes` adds.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PlacesRecord {
    /// Places and kinds that were tried, each fitted to the end.
    pub tried: usize,
    /// Sets, most probable first; one without causes is the machine as it is.
    pub sets: Vec<PlaceSetRecord>,
    /// Constants that decide the answer.
    pub settings: AmplitudeSettings,
}

/// A set of places and kinds.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PlaceSetRecord {
    pub causes: Vec<PlaceRecord>,
    pub probability: f64,
    /// Logarithm of the evidence over that of the machine as it is.
    pub log_evidence: f64,
    /// Logarithm of the density of each row given all others, over that of the machine as it is, summed over the rows.
    pub log_density_kept_out: f64,
    /// Standard error of that sum.
    pub standard_error: f64,
    /// Spread of the numbers of the machine file beside it, standard deviation of their logarithms.
    pub numbers: f64,
    /// Heat in every part, new in every row, beside it: standard deviation as a share of the machine's mean heat.
    pub disturbance: f64,
    /// Readings, rows and sensors that it calls grossly wrong.
    pub set_aside: Vec<AsideRecord>,
}

/// A part of the table that a set calls grossly wrong: a reading, a whole row or a whole sensor.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct AsideRecord {
    /// Row by its name; none for a whole sensor.
    pub test: Option<String>,
    /// Line of the file.
    pub line: Option<usize>,
    /// Sensor; none for a whole row.
    pub sensor: Option<String>,
    /// Reading less what all that is not set aside says of it; of a row or sensor the root mean square.
    pub off: f64,
    pub unit: &'static str,
    /// Value of a sensor that shows one throughout, degC (or um).
    pub stuck_at: Option<f64>,
}

/// A place and a kind with its amplitude in every row.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PlaceRecord {
    pub kind: String,
    pub place: String,
    /// Variable over which the amplitude runs smoothly, `row` for the order of the rows; none where it is alike in all rows or free.
    pub over: Option<String>,
    /// Whether every row has an amplitude of its own.
    pub free: bool,
    pub rows: Vec<RowAmplitudeRecord>,
}

/// The amplitude in one row.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct RowAmplitudeRecord {
    pub test: String,
    pub amplitude: EstimateRecord,
}

/// Finds places and kinds by their amplitudes alone.
///
/// # Errors
/// Errors of [`places`].
pub fn by_amplitude(problem: &Problem, progress: &dyn Progress) -> Result<Places> {
    places(problem, &AmplitudeSettings::default(), progress)
}

/// The number of a place and kind in each row, as readers count it.
fn in_rows(own: &PlaceAndKind) -> Vec<EstimateRecord> {
    let of = |(amplitude, deviation): (&f64, &f64)| {
        let shown = Cause::new(own.hypothesis.clone(), *amplitude, *deviation).shown();
        EstimateRecord { value: shown.value, low: shown.low, high: shown.high, unit: shown.unit.into() }
    };
    own.amplitudes.iter().zip(&own.deviations).map(of).collect()
}

/// For outside programs.
pub fn record(problem: &Problem, places: &Places) -> PlacesRecord {
    let tests: Vec<&str> = problem.data.rows.iter().filter(|row| row.has_readings()).map(|row| row.test.as_str()).collect();
    let place = |own: &PlaceAndKind| PlaceRecord {
        kind: own.hypothesis.kind().into(),
        place: own.hypothesis.place.clone(),
        over: own.over.clone(),
        free: own.is_free,
        rows: tests.iter().zip(in_rows(own)).map(|(test, amplitude)| RowAmplitudeRecord { test: (*test).into(), amplitude }).collect(),
    };
    let sets = places.sets.iter().map(|set| PlaceSetRecord {
        causes: set.members.iter().map(place).collect(),
        probability: set.probability,
        log_evidence: set.lead,
        log_density_kept_out: set.kept_out.0,
        standard_error: set.kept_out.1,
        numbers: set.spread,
        disturbance: set.disturbance,
        set_aside: set.aside.iter().map(|own| aside_record(problem, own)).collect(),
    });
    PlacesRecord { tried: places.tried, sets: sets.collect(), settings: AmplitudeSettings::default() }
}

/// A part that is set aside, for outside programs.
fn aside_record(problem: &Problem, own: &Aside) -> AsideRecord {
    let data = &problem.data;
    let row = own.row.map(|r| &data.rows[r]);
    let measurands = data.measurands(&problem.study.model.machine);
    // A row may have readings of both kinds; most have temperatures alone.
    let measurand = own.sensor.map_or(Measurand::Temperature, |k| measurands[k]);
    AsideRecord {
        test: row.map(|row| row.test.clone()),
        line: row.and_then(|row| row.line),
        sensor: own.sensor.map(|k| data.names[k].clone()),
        off: own.off,
        unit: measurand.unit_of_differences(),
        stuck_at: own.stuck_at.map(|value| measurand.shown(value)),
    }
}

/// A part that is set aside, in words.
fn aside_in_words(own: &AsideRecord) -> String {
    let (off, unit) = (significant(own.off.abs(), 3), own.unit);
    let line = own.line.map_or(String::new(), |line| format!(" (line {line})"));
    match (&own.test, &own.sensor, own.stuck_at) {
        (Some(test), Some(sensor), _) => {
            let more = if own.off > 0.0 { "more" } else { "less" };
            format!("the reading of {sensor} in {test}{line}: {off} {unit} {more} than the others say")
        }
        (Some(test), None, _) => format!("all readings of {test}{line}: {off} {unit} from what the other rows say"),
        (None, sensor, Some(value)) => {
            let shown = if unit == "K" { "degC" } else { unit };
            format!("the sensor {}: stuck at {} {shown}", sensor.as_deref().unwrap_or_default(), significant(value, 4))
        }
        (None, sensor, None) => {
            format!("the sensor {}: {off} {unit} from what the others say", sensor.as_deref().unwrap_or_default())
        }
    }
}

/// How an amplitude runs over the rows, in words.
fn run_in_words(own: &PlaceAndKind) -> String {
    match (&own.over, own.is_free) {
        (Some(over), _) if over == "row" => "runs with the order of the rows".into(),
        (Some(over), _) => format!("runs with {over}"),
        (None, true) => "own in every row".into(),
        (None, false) => "alike in all rows".into(),
    }
}

/// For readers: the first sets, and the amplitude of the first one's causes in every row as lines of a table.
pub fn text(problem: &Problem, places: &Places, table: impl Fn(&[&str], &[Vec<String>]) -> String) -> String {
    let mut text = format!("\nby amplitude alone, free in every row ({} places and kinds):\n", places.tried);
    for (i, set) in places.sets.iter().take(TOLD).enumerate().filter(|(i, set)| *i == 0 || set.probability > LEAST_TOLD) {
        let words: Vec<String> =
            set.members.iter().map(|own| format!("{}, {}", own.hypothesis.kind_and_place(), run_in_words(own))).collect();
        let words = if words.is_empty() { "nothing".into() } else { words.join("; ") };
        text += &format!("  {:.3}  {words}\n", set.probability);
        for own in &set.aside {
            text += &format!("         set aside: {}\n", aside_in_words(&aside_record(problem, own)));
        }
        if i == 0 && !set.members.is_empty() {
            let (sum, error) = set.kept_out;
            text += &format!(
                "         rows kept out are more probable by a factor of e^{} +- {}\n",
                significant(sum, 3),
                significant(error, 2)
            );
        }
    }
    let Some(first) = places.sets.first().filter(|set| !set.members.is_empty()) else { return text };
    let tests = problem.data.rows.iter().filter(|row| row.has_readings()).map(|row| row.test.clone());
    let columns: Vec<Vec<EstimateRecord>> = first.members.iter().map(in_rows).collect();
    let cell = |own: &EstimateRecord| {
        let unit = if own.unit == "1" { String::new() } else { format!(" {}", own.unit) };
        format!("{}{unit} ({} to {})", significant(own.value, 3), significant(own.low, 3), significant(own.high, 3))
    };
    let rows: Vec<Vec<String>> =
        tests.enumerate().map(|(row, test)| std::iter::once(test).chain(columns.iter().map(|own| cell(&own[row]))).collect()).collect();
    let heading: Vec<String> = first.members.iter().map(|own| own.hypothesis.kind_and_place()).collect();
    let heading: Vec<&str> = std::iter::once("test").chain(heading.iter().map(String::as_str)).collect();
    text + "\n" + &table(&heading, &rows)
}
