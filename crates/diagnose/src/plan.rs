//! Before there are data: which causes some sensors would see in some conditions, which of them they could never tell apart, and which sensor
//! more would help most.
//!
//! To first order a cause of amplitude a changes all readings by a c, where c is its signature. Beside the covariance of everything that a
//! careful machine file leaves open, its length |c| counts in standard deviations, and the angle between two signatures says how much of one
//! the other leaves over. So no reading is needed.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::Problem;
use super::amplitude::{Beside, Errors, Looseness, Rows};
use super::effects::{Hypothesis, Sensor};
use super::next::{Proposed, with_all_proposed};
use super::when::TEST_NUMBER;
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, TIME, whiten};
use coldplate_explore::simulate::Start;

/// Standard deviations that nine draws of noise in ten take an effect down by less than: the normal quantile of 0.9.
const NINE_OF_TEN: f64 = 1.2816;
/// Sensors more that are reported.
const MOST: usize = 5;

/// Causes by what readings could show of them.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Conditions that were looked at, a count.
    pub conditions: usize,
    /// Sensors that read in each, a count.
    pub sensors: usize,
    /// Causes that would be seen, the most visible first.
    pub seen: Vec<Detectable>,
    /// Causes that would not be seen at the largest amplitude that is usual.
    pub unseen: Vec<Hypothesis>,
    /// Causes among those seen that could never be told apart, in groups of two and more, by their places in the list.
    pub alike: Vec<Vec<usize>>,
    /// Sensors more, the one that would help most first.
    pub further: Vec<FurtherSensor>,
}

/// A cause that would be seen.
#[derive(Debug, Clone)]
pub struct Detectable {
    /// Place and kind, under the usual law of the kind.
    pub hypothesis: Hypothesis,
    /// Least amplitude that nine tables in ten would show, in the hypothesis' unit.
    pub least: f64,
    /// Largest change of a reading at that amplitude, K.
    pub change: f64,
}

/// A sensor that the machine lacks.
#[derive(Debug, Clone, PartialEq)]
pub struct FurtherSensor {
    /// Name of the sensor.
    pub name: String,
    /// Entry of the sensor in the machine file, as TOML.
    pub entry: String,
    /// Causes that would be seen with it and not without, a count.
    pub seen: usize,
    /// Groups of causes that could be told apart with it and not without, a count.
    pub apart: usize,
}

/// Conditions for a plan: all variables at their defaults (those without at the middle of their range), then each at both ends of its range.
/// The cells of all sensors are empty: [`plan`] reads none.
///
/// # Errors
/// A variable has neither default nor range; the machine has no sensor.
pub fn planned_conditions(machine: &Machine) -> Result<Data> {
    let middle = |v: &DescribedVariable| {
        v.default.or_else(|| v.range.map(|(low, high)| 0.5 * (low + high))).ok_or_else(|| {
            Error::input(format!("variable '{}' has neither a default nor a range", v.name))
                .at_key(format!("variables.{}", v.name))
                .help("state one, or name a table with the conditions: --plan MACHINE.toml DATA.csv")
        })
    };
    let middle = machine.variables.iter().map(middle).collect::<Result<Vec<f64>>>()?;
    let mut all = vec![middle.clone()];
    for (v, variable) in machine.variables.iter().enumerate().filter(|(_, own)| own.name != TIME && own.name != TEST_NUMBER) {
        let ends = variable.range.map_or_else(Vec::new, |(low, high)| vec![low, high]);
        for end in ends.into_iter().filter(|end| *end != middle[v]) {
            let mut values = middle.clone();
            values[v] = end;
            all.push(values);
        }
    }
    let names: Vec<String> = machine.sensors.iter().map(|s| s.name.clone()).collect();
    if names.is_empty() {
        return Err(Error::input("the machine has no sensor")
            .at_key("sensor")
            .help("add [sensor.NAME] tables: a plan says what they would show"));
    }
    let row = |(n, values): (usize, Vec<f64>)| ReadingRow {
        test: (n + 1).to_string(),
        time: None,
        condition: Condition::from_si(values),
        readings: vec![None; names.len()],
        line: None,
    };
    let rows = all.into_iter().enumerate().map(row).collect();
    Ok(Data { source: "a plan".into(), sensors: (0..names.len()).collect(), names, rows, ..Data::default() })
}

/// Says what readings of all sensors of the data in all of their conditions could show, whatever they have been.
///
/// # Errors
/// The data are logs; the machine cannot be solved at one of the conditions.
pub fn plan(problem: &Problem, progress: &dyn Progress) -> Result<Plan> {
    if problem.data.is_transient() {
        return Err(Error::input("a plan is made for steady conditions, and these are logs").at_key("--plan"));
    }
    let own = problem.data.sensors.len();
    let (wide, proposed) = with_further(problem)?;
    progress.say(&format!("{} conditions, {own} sensors and {} that could be", wide.data.rows.len(), proposed.len()));
    let beside = Beside::of(&wide)?;
    let errors = beside.errors();
    let places = whiten::places(&wide.data);
    let reads = |sensors: &dyn Fn(usize) -> bool| (0..places.len()).filter(|i| sensors(places[*i].1)).collect::<Vec<usize>>();
    let all = beside.catalogue.iter().zip(&beside.base.found.columns).filter(|(h, _)| is_among(h, own));
    let largest = problem.settings.sizes.last().copied().unwrap_or(1.0);
    // An exchange of sensors is or is not.
    let most = |h: &Hypothesis| if h.is_fixed() { 1.0 } else { (largest * h.scale).min(h.range().1) };
    let (causes, columns): (Vec<&Hypothesis>, Vec<Vec<f64>>) = all
        .map(|(h, column)| (h, most(h), column))
        .map(|(h, most, column)| (h, column.iter().map(|c| most * c).collect::<Vec<f64>>()))
        .unzip();
    if causes.is_empty() {
        return Err(Error::input("no kind of cause is left to plan for").at_key("--without").help("leave some of the kinds in"));
    }
    let odds = (problem.settings.certain / (1.0 - problem.settings.certain)).ln();
    let among = (causes.len() as f64 / problem.settings.expected_causes).max(1.0).ln();
    let detection = Detection {
        columns: &columns,
        errors: &errors,
        // Instruments as they are stated.
        looseness: Looseness { wandering: 0.0, noise: 1.0, ..problem.settings.usual },
        seen: (2.0 * (odds + among)).sqrt() + NINE_OF_TEN,
        apart: (2.0 * odds).sqrt() + NINE_OF_TEN,
    };
    let usual = reads(&|k| k < own);
    let without = detection.of(&usual)?;
    progress.say("one sensor more");
    let further = |(n, proposed): (usize, &Proposed)| -> Result<FurtherSensor> {
        let with = detection.of(&reads(&|k| k < own || k == own + n))?;
        let more = |with: usize, without: usize| with.saturating_sub(without);
        Ok(FurtherSensor {
            name: proposed.name.clone(),
            entry: proposed.entry.clone(),
            seen: more(with.seen.len(), without.seen.len()),
            apart: more(with.groups.len(), without.groups.len()),
        })
    };
    let mut further = proposed.par_iter().enumerate().map(further).collect::<Result<Vec<_>>>()?;
    further.retain(|own| own.seen + own.apart > 0);
    further.sort_by_key(|own| std::cmp::Reverse((own.apart, own.seen)));
    further.truncate(MOST);
    let detectable = |(c, length): &(usize, f64)| {
        let h = causes[*c];
        let share = if h.is_fixed() { 1.0 } else { detection.seen / length };
        let change = usual.iter().fold(0.0, |most: f64, i| most.max((share * columns[*c][*i]).abs()));
        Detectable { hypothesis: h.clone(), least: share * most(h), change }
    };
    let is_seen = |c: usize| without.seen.iter().any(|(own, _)| *own == c);
    Ok(Plan {
        conditions: wide.data.rows.len(),
        sensors: own,
        seen: without.seen.iter().map(detectable).collect(),
        unseen: (0..causes.len()).filter(|c| !is_seen(*c)).map(|c| causes[c].clone()).collect(),
        alike: without.groups.into_iter().filter(|group| group.len() > 1).collect(),
        further,
    })
}

/// Whether a cause is an error of sensors among the first `own` ones of the data, or of none.
fn is_among(h: &Hypothesis, own: usize) -> bool {
    match h.sensor() {
        Some(Sensor::Offset(k) | Sensor::Gain(k) | Sensor::Surroundings(k) | Sensor::Lag(k)) => k < own,
        Some(Sensor::Swap(a, b)) => a < own && b < own,
        Some(Sensor::All) | None => true,
    }
}

/// The problem with every sensor that its machine could have, all of them read in every row as the machine predicts.
fn with_further(problem: &Problem) -> Result<(Problem, Vec<Proposed>)> {
    let (mut wide, proposed) = with_all_proposed(problem)?.unwrap_or_else(|| (problem.clone(), Vec::new()));
    let first = wide.study.model.machine.sensors.len() - proposed.len();
    wide.data.sensors.extend(first..first + proposed.len());
    wide.data.names.extend(proposed.iter().map(|own| own.name.clone()));
    let count = wide.data.sensors.len();
    wide.data.rows.iter_mut().for_each(|row| row.readings = vec![Some(0.0); count]);
    let values = identify::values(&wide.study, &wide.data, Start::Steady)?;
    for (row, values) in wide.data.rows.iter_mut().zip(values.chunks(count)) {
        row.readings = values.iter().copied().map(Some).collect();
    }
    let usual = MeasurementUncertainty::usual(&wide.data, &wide.study.model.machine);
    let own = problem.uncertainty.noise.len();
    wide.uncertainty.noise.extend(&usual.noise[own..]);
    wide.uncertainty.bias.extend(&usual.bias[own..]);
    Ok((wide, proposed))
}

/// Causes at their largest amplitudes beside the errors of readings.
struct Detection<'a> {
    /// Change of every reading with each cause, K.
    columns: &'a [Vec<f64>],
    errors: &'a Errors,
    looseness: Looseness,
    /// Least length of a cause that is seen, and least distance between two that are told apart, in standard deviations.
    seen: f64,
    apart: f64,
}

/// Causes that some readings detect.
struct Detected {
    /// Causes that are seen, with their lengths in standard deviations, the longest first.
    seen: Vec<(usize, f64)>,
    /// Causes that cannot be told from the first one of their group, by their places among those that are seen.
    groups: Vec<Vec<usize>>,
}

impl Detection<'_> {
    fn of(&self, readings: &[usize]) -> Result<Detected> {
        let open = || Error::numerics("the covariance of the readings is not positive: state their noise");
        let errors = self.errors.of_readings(readings);
        let rows = Rows::under(&errors, self.looseness).ok_or_else(open)?;
        let eliminated = rows.eliminated(self.looseness).ok_or_else(open)?;
        let whitened = |column: &Vec<f64>| rows.whiten(&readings.iter().map(|i| column[*i]).collect::<Vec<f64>>());
        let columns = DMatrix::from_columns(&self.columns.par_iter().map(whitened).collect::<Vec<_>>());
        let products = rows.shared.tr_mul(&columns);
        let shared = eliminated.along(columns.ncols(), |k, c| products[(k, c)]);
        let square = |c: usize| columns.column(c).norm_squared() - shared.column(c).norm_squared();
        let mut seen: Vec<(usize, f64)> = (0..columns.ncols()).map(|c| (c, square(c).max(0.0).sqrt())).collect();
        seen.retain(|(_, length)| *length >= self.seen);
        seen.sort_by(|a, b| b.1.total_cmp(&a.1));
        // Of two the shorter one decides: it has to leave enough beside the other.
        let is_alike = |a: &(usize, f64), b: &(usize, f64)| {
            let product = columns.column(a.0).dot(&columns.column(b.0)) - shared.column(a.0).dot(&shared.column(b.0));
            let cosine = product / (a.1 * b.1);
            a.1.min(b.1) * (1.0 - cosine * cosine).max(0.0).sqrt() < self.apart
        };
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (n, own) in seen.iter().enumerate() {
            match groups.iter_mut().find(|group| is_alike(&seen[group[0]], own)) {
                Some(group) => group.push(n),
                None => groups.push(vec![n]),
            }
        }
        Ok(Detected { seen, groups })
    }
}
