//! Places and kinds whose amplitude is free in every row of a table, or in time, as text and as outside programs read them.

use serde::Serialize;

use super::Findings;
use super::estimate::EstimateRecord;
use coldplate_base::numbers::significant;
use coldplate_base::units::{Measurand, express};
use coldplate_describe::machine::Priors;
use coldplate_diagnose::{AmplitudeSettings, Aside, Cause, Law, PlaceAndKind, PlaceSet, Places, Problem, Way};
use coldplate_evidence::measurement::ReadingRow;

/// Sets that are told in text.
const TOLD: usize = 3;
/// Least probability of a set that is told beside the first.
const LEAST_TOLD: f64 = 0.01;
/// Rows of a log whose amplitudes are told, about.
const ROWS_TOLD: usize = 12;

/// Result of a search for places and kinds, with its assumptions.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PlacesRecord {
    /// Places and kinds that were tried, each fitted to the end.
    pub tried: usize,
    /// Causes among them that were followed by their slope alone: in logs of a machine of cells all but the best that bend.
    pub by_slope: usize,
    /// Sets, most probable first; one without causes is the machine as it is.
    pub sets: Vec<PlaceSetRecord>,
    /// Constants that decide the answer.
    pub settings: AmplitudeSettings,
    /// How large causes are usually, SI: the machine file's `[prior]`, or the usual.
    pub priors: Priors,
}

/// A set of places and kinds.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PlaceSetRecord {
    pub causes: Vec<PlaceRecord>,
    /// Laws under which they act, most probable first.
    pub ways: Vec<WayRecord>,
    pub probability: f64,
    /// Logarithm of the evidence over that of the machine as it is.
    pub log_evidence: f64,
    /// Logarithm of the density of each row given all others, over that of the machine as it is, summed over the rows. In logs of each test, or
    /// of each stretch of time where tests are few.
    pub log_density_kept_out: f64,
    /// Standard error of that sum.
    pub standard_error: f64,
    /// Spread of the numbers of the machine file beside it, standard deviation of their logarithms.
    pub numbers: f64,
    /// Heat in every part, new in every row, in logs wandering with the time, beside it: standard deviation as a share of the machine's mean
    /// heat.
    pub disturbance: f64,
    /// Level of all heats, new in every row of a table and in every test of a log, beside it: standard deviation as a share of them.
    pub level: f64,
    /// Further error of each condition, new in every row of a table, beside it: standard deviation as a multiple of what is stated.
    pub conditions: f64,
    /// Error of each sensor of a log that wanders with the time, beside what is stated: standard deviation, K.
    pub wandering: f64,
    /// Noise of readings and biases of sensors beside it, as multiples of what is stated.
    pub noise: f64,
    /// Readings, rows and sensors that it calls grossly wrong.
    pub set_aside: Vec<AsideRecord>,
}

/// A part of the data that a set calls grossly wrong: a reading, a whole row, a whole sensor, or a condition of a row.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct AsideRecord {
    /// Row by its name; none for a whole sensor.
    pub test: Option<String>,
    /// Time of a row of a log since the start of its test, s.
    #[serde(rename = "time_s", skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// Line of the file.
    pub line: Option<usize>,
    /// Sensor; none for a whole row or a condition.
    pub sensor: Option<String>,
    /// Variable of which the row states a wrong value; none of readings.
    pub condition: Option<String>,
    /// Reading less what all that is not set aside says of it; of a row or sensor the root mean square; of a condition what is stated less what
    /// the readings ask for.
    pub off: f64,
    pub unit: String,
    /// Value of a sensor that shows one throughout, degC (or um).
    pub stuck_at: Option<f64>,
}

/// One way in which a set acts.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct WayRecord {
    /// One for each cause of the set, in its order.
    pub laws: Vec<PlaceLawRecord>,
    /// Probability among all ways of the set.
    pub probability: f64,
    /// Whether a machine file has words for it.
    pub writable: bool,
}

/// The law of one cause.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PlaceLawRecord {
    /// In words.
    pub law: String,
    /// Amplitude where the law is one.
    pub amplitude: EstimateRecord,
    /// Formula of the law in a machine file; none where it has none, or the law is not one of the condition.
    pub formula: Option<String>,
}

/// A place and a kind with its amplitude in every row.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PlaceRecord {
    pub kind: String,
    pub place: String,
    /// Variable over which the amplitude runs smoothly, `row` for the order of the rows; none where it is alike in all rows or free. In logs
    /// `time` where it runs smoothly in time, and variables that it is in proportion to, joined by `, `.
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
    /// Time of a row of a log, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    pub amplitude: EstimateRecord,
}

fn way(places: &Places, own: &Way) -> WayRecord {
    let law = |cause: &Cause| {
        let (shown, law) = (cause.shown(), cause.hypothesis.law);
        let is_formula = !matches!(law, Law::Constant | Law::Temperature) && places.scales.has_formula(law);
        PlaceLawRecord {
            law: cause.hypothesis.law_words(),
            amplitude: EstimateRecord { value: shown.value, low: shown.low, high: shown.high, unit: shown.unit.into() },
            formula: is_formula.then(|| places.scales.expression(law)),
        }
    };
    WayRecord { laws: own.causes.iter().map(law).collect(), probability: own.probability, writable: own.is_writable }
}

/// The law of a cause with its amplitude, in words.
fn law_in_words(cause: &Cause) -> String {
    let unit = if cause.hypothesis.unit == "1" { String::new() } else { format!(" {}", cause.hypothesis.unit) };
    let number = format!("{} +- {}{unit}", significant(cause.amplitude, 3), significant(cause.deviation, 2));
    format!("{number}, {}", cause.hypothesis.law_words())
}

/// The ways of a set, a line each.
fn ways_in_words(set: &PlaceSet) -> String {
    let told = set.ways.iter().filter(|way| way.probability > LEAST_TOLD && !way.causes.is_empty());
    let line = |way: &Way| {
        let laws: Vec<String> = way.causes.iter().map(law_in_words).collect();
        let unsaid = if way.is_writable { "" } else { " (no words in a machine file)" };
        format!("           {:.3}  {}{unsaid}\n", way.probability, laws.join("; "))
    };
    told.map(line).collect()
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
pub fn record(found: &Findings<'_>) -> PlacesRecord {
    let places = &found.diagnosis.places;
    let read: Vec<&ReadingRow> = found.problem.data.rows.iter().filter(|row| row.has_readings()).collect();
    let at = |(row, amplitude): (&&ReadingRow, EstimateRecord)| RowAmplitudeRecord { test: row.test.clone(), time_s: row.time, amplitude };
    let place = |own: &PlaceAndKind| PlaceRecord {
        kind: own.hypothesis.kind().into(),
        place: own.hypothesis.place.clone(),
        over: own.over.clone(),
        free: own.is_free,
        rows: read.iter().zip(in_rows(own)).map(at).collect(),
    };
    let sets = places.sets.iter().map(|set| PlaceSetRecord {
        causes: set.members.iter().map(place).collect(),
        ways: set.ways.iter().map(|own| way(places, own)).collect(),
        probability: set.probability,
        log_evidence: set.lead,
        log_density_kept_out: set.kept_out.0,
        standard_error: set.kept_out.1,
        numbers: set.looseness.spread,
        disturbance: set.looseness.disturbance,
        level: set.looseness.level,
        conditions: set.looseness.conditions,
        wandering: set.looseness.wandering,
        noise: set.looseness.noise,
        set_aside: set.aside.iter().map(|own| aside_record(found.problem, own)).collect(),
    });
    PlacesRecord {
        tried: places.tried,
        by_slope: places.by_slope,
        sets: sets.collect(),
        settings: found.problem.settings.clone(),
        priors: found.problem.study.model.machine.priors,
    }
}

/// A part that is set aside, for outside programs.
fn aside_record(problem: &Problem, own: &Aside) -> AsideRecord {
    let data = &problem.data;
    let row = own.row.map(|r| &data.rows[r]);
    let measurands = data.measurands(&problem.study.model.machine);
    // A row may have readings of both kinds; most have temperatures alone.
    let measurand = own.sensor.map_or(Measurand::Temperature, |k| measurands[k]);
    let variable = own.variable.map(|v| &problem.study.model.machine.variables[v]);
    let of_reading = (own.off, measurand.unit_of_differences().to_string());
    let (off, unit) = variable.map_or(of_reading, |variable| match variable.dimension.of_differences() {
        differences if differences == variable.dimension => {
            (express(own.off, &variable.unit, variable.dimension).unwrap_or(own.off), variable.unit.clone())
        }
        _ => (own.off, "K".into()),
    });
    AsideRecord {
        test: row.map(|row| row.test.clone()),
        time: row.and_then(|row| row.time),
        line: row.and_then(|row| row.line),
        sensor: own.sensor.map(|k| data.names[k].clone()),
        condition: variable.map(|variable| variable.name.clone()),
        off,
        unit,
        stuck_at: own.stuck_at.map(|value| measurand.shown(value)),
    }
}

/// Parts of the data that the answer calls grossly wrong, in words.
pub fn set_aside(found: &Findings<'_>) -> Vec<String> {
    found.diagnosis.aside().iter().map(|own| aside_in_words(&aside_record(found.problem, own))).collect()
}

/// A part that is set aside, in words.
fn aside_in_words(own: &AsideRecord) -> String {
    let (off, unit) = (significant(own.off.abs(), 3), &own.unit);
    let more = if own.off > 0.0 { "more" } else { "less" };
    let line = own.line.map_or(String::new(), |line| format!(" (line {line})"));
    let at = own.time.map_or(String::new(), |time| format!(" at {} s", significant(time, 9)));
    match (&own.test, &own.sensor, own.stuck_at) {
        (Some(test), None, _) if own.condition.is_some() => {
            let condition = own.condition.as_deref().unwrap_or_default();
            format!("the {condition} that {test}{line} states: {off} {unit} {more} than its readings ask for")
        }
        (Some(test), Some(sensor), _) => {
            format!("the reading of {sensor} in {test}{at}{line}: {off} {unit} {more} than the others say")
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
pub fn text(found: &Findings<'_>, table: impl Fn(&[&str], &[Vec<String>]) -> String) -> String {
    let places = &found.diagnosis.places;
    let is_log = found.problem.data.is_transient();
    let free = if is_log { "free in time" } else { "free in every row" };
    let by_slope = if places.by_slope > 0 { format!(", {} of them by their slope alone", places.by_slope) } else { String::new() };
    let mut text = format!("\nby amplitude alone, {free} ({} places and kinds{by_slope}):\n", places.tried);
    for (i, set) in places.sets.iter().take(TOLD).enumerate().filter(|(i, set)| *i == 0 || set.probability > LEAST_TOLD) {
        let words: Vec<String> =
            set.members.iter().map(|own| format!("{}, {}", own.hypothesis.kind_and_place(), run_in_words(own))).collect();
        let words = if words.is_empty() { "nothing".into() } else { words.join("; ") };
        text += &format!("  {:.3}  {words}\n", set.probability);
        text += &ways_in_words(set);
        for own in &set.aside {
            text += &format!("         set aside: {}\n", aside_in_words(&aside_record(found.problem, own)));
        }
        if i == 0 && !set.members.is_empty() {
            let (sum, error) = set.kept_out;
            text += &format!(
                "         {} kept out are more probable by a factor of e^{} +- {}\n",
                if is_log { "stretches of time" } else { "rows" },
                significant(sum, 3),
                significant(error, 2)
            );
        }
    }
    let Some(first) = places.sets.first().filter(|set| !set.members.is_empty()) else { return text };
    let read: Vec<&ReadingRow> = found.problem.data.rows.iter().filter(|row| row.has_readings()).collect();
    let columns: Vec<Vec<EstimateRecord>> = first.members.iter().map(in_rows).collect();
    let cell = |own: &EstimateRecord| {
        let unit = if own.unit == "1" { String::new() } else { format!(" {}", own.unit) };
        format!("{}{unit} ({} to {})", significant(own.value, 3), significant(own.low, 3), significant(own.high, 3))
    };
    let name = |row: &ReadingRow| match row.time {
        Some(time) => format!("{} at {} s", row.test, significant(time, 6)),
        None => row.test.clone(),
    };
    let stride = if is_log { read.len().div_ceil(ROWS_TOLD).max(1) } else { 1 };
    let line = |row: usize| std::iter::once(name(read[row])).chain(columns.iter().map(|own| cell(&own[row]))).collect();
    let rows: Vec<Vec<String>> = (0..read.len()).step_by(stride).map(line).collect();
    let heading: Vec<String> = first.members.iter().map(|own| own.hypothesis.kind_and_place()).collect();
    let heading: Vec<&str> = std::iter::once("test").chain(heading.iter().map(String::as_str)).collect();
    text + "\n" + &table(&heading, &rows)
}
