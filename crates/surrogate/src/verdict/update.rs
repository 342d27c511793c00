//! Readings of a machine taken into the parameters of its surrogate file.

use coldplate_runtime::{LearnError, Point, Reading, Surprise, Surrogate, Variable, format};
use serde::Serialize;

use super::instruments::Instruments;
use super::learnt_readings::LearntReadings;
use super::{condition, stated};
use crate::fit::file;
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_tables::{Column, Table};

/// Probability of the misfit below which readings have left the model. Chosen: a false alarm in a thousand updates
/// against a late one.
pub const ALARM: f64 = 1e-3;
/// Distance, in halves of the fitted ranges, below which a condition counts as one that was measured already. Chosen:
/// the model error hardly changes over it.
const SAME: f64 = 0.05;

/// A surrogate file updated by readings.
#[derive(Debug, Clone)]
pub struct Updated {
    /// Bytes of the updated file.
    pub bytes: Vec<u8>,
    /// Record of the update for outside programs.
    pub record: UpdateRecord,
}

/// An update as outside programs read it.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct UpdateRecord {
    /// Rows of the data.
    pub rows: usize,
    /// Readings that were taken in.
    pub readings: usize,
    /// Rows outside the fitted range, from which nothing is learnt.
    pub outside: usize,
    /// Readings that the file has learnt before, from which nothing more is learnt.
    pub known: usize,
    /// Sum of the squared deviations from the expected readings, each over its variance.
    pub chi_square: f64,
    /// Probability of deviations at least as large from a machine that is as the file says.
    pub probability: f64,
    /// Whether the readings leave the model: the parameters alone do not say what has changed.
    pub alarm: bool,
    /// The rows that were least expected, the worst first.
    pub worst: Vec<RowSurprise>,
    /// Parameters before and after.
    pub parameters: Vec<Moved>,
    /// Model error at each point after the update.
    pub points: Vec<PointModelError>,
}

/// How unexpected a row was.
#[derive(Debug, Clone, Serialize)]
pub struct RowSurprise {
    /// Line in the file.
    pub line: usize,
    /// Name of its test, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    /// Sum of the squared deviations from the expected readings, each over its variance.
    pub chi_square: f64,
    /// Readings in it.
    pub readings: usize,
    /// Probability of deviations at least as large in this row, from a machine that is as the file says.
    pub probability: f64,
}

/// A parameter before and after.
#[derive(Debug, Clone, Serialize)]
pub struct Moved {
    /// Key in the machine file, or name of a factor.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Value before.
    pub before: f64,
    /// Standard deviation before.
    pub deviation_before: f64,
    /// Value after.
    pub value: f64,
    /// Standard deviation after.
    pub deviation: f64,
}

/// Model error at one point alone, in the point's unit.
#[derive(Debug, Clone, Serialize)]
pub struct PointModelError {
    /// The point.
    pub name: String,
    /// Mean excess of readings over the model there.
    pub value: f64,
    /// Standard deviation of the excess.
    pub deviation: f64,
}

/// Takes the steady readings of a table into the parameters of a surrogate file. The table names the variables and points of the
/// surrogate with their units; `lines` are the lines of its rows in the file.
///
/// # Errors
/// A file without uncertainty; a table without a variable, or with times; no reading inside the fitted range.
pub fn update(bytes: &[u8], table: &Table, lines: &[usize], instruments: &Instruments) -> Result<Updated> {
    if table.columns.iter().any(|c| c.name == "time") {
        return Err(Error::input("these readings are a log, and a surrogate knows steady states alone")
            .at_key("time")
            .help("keep the rows that are steady and leave the column out; logs are for `coldplate identify`"));
    }
    let bytes = &with_conditions(bytes, table)?;
    let opened = file::open(bytes)?;
    let uncertainty = opened.uncertainty().ok_or_else(|| {
        Error::input("this surrogate states no uncertainty of the machine, so nothing can be learnt of it")
            .help("sweep its machine and fit anew: `coldplate run SWEEP.toml`")
    })?;
    let data = Data::read(&opened, table)?;
    let before = states_of(&opened)?;
    let (mut total, mut outside, mut rows) = (Surprise { chi_square: 0.0, readings: 0 }, 0, Vec::new());
    let mut marks = LearntReadings::of(&opened);
    let learnt = stated::learnt(bytes, |belief, work| {
        for row in 0..table.rows() {
            let x = data.condition(row);
            let mut readings = data.readings(row, |point| instruments.deviation(&opened, &x, point));
            // Outside the range nothing is learnt, so nothing is marked.
            if opened.in_domain(&x) {
                readings.retain(|reading| marks.is_new(&opened, &x, reading));
            }
            if readings.is_empty() {
                continue;
            }
            let own = match opened.learn(&x, &readings, belief, work) {
                Ok(own) => own,
                Err(LearnError::OutsideRange) => {
                    outside += 1;
                    continue;
                }
                Err(e) => return Err(Error::input(e.to_string()).at_line(lines.get(row).copied().unwrap_or(row + 1))),
            };
            total = Surprise { chi_square: total.chi_square + own.chi_square, readings: total.readings + own.readings };
            rows.push(RowSurprise {
                line: lines.get(row).copied().unwrap_or(row + 1),
                test: table.text("test").and_then(|t| t.values.get(row)).cloned(),
                chi_square: own.chi_square,
                readings: own.readings,
                probability: own.probability(),
            });
        }
        Ok(())
    })?;
    if total.readings == 0 && marks.known > 0 {
        return Err(Error::input("the surrogate has learnt these readings before, each of them: nothing is written")
            .read(format!("{} readings", marks.known))
            .help("a reading counts once; give new ones, or begin again from the surrogate as it was fitted"));
    }
    if total.readings == 0 {
        return Err(
            Error::input("there is no reading inside the fitted range of this surrogate").help("`coldplate info SURROGATE` names it")
        );
    }
    let learnt = marks.written_into(&learnt)?;
    let after = states_of(&file::open(&learnt)?)?;
    let moved = |(k, p): (usize, coldplate_runtime::Parameter<'_>)| {
        let at = |state: &State| (p.value(state.mean), p.deviation * state.deviation);
        let ((before, deviation_before), (value, deviation)) = (at(&before[k]), at(&after[k]));
        Moved { name: p.name.to_owned(), unit: p.unit.to_owned(), before, deviation_before, value, deviation }
    };
    let count = uncertainty.parameter_count();
    let at_point = |(i, p): (usize, Point<'_>)| {
        let (own, state) = (uncertainty.missed(i).0, &after[count + i]);
        PointModelError { name: p.name.to_owned(), value: own * state.mean, deviation: own * state.deviation }
    };
    rows.sort_by(|a, b| a.probability.total_cmp(&b.probability));
    let worst = rows.iter().filter(|row| row.probability < ALARM).cloned().collect();
    let record = UpdateRecord {
        rows: table.rows(),
        readings: total.readings,
        outside,
        known: marks.known,
        chi_square: total.chi_square,
        probability: total.probability(),
        alarm: total.probability() < ALARM,
        worst,
        parameters: uncertainty.parameters().enumerate().map(moved).collect(),
        points: opened.points().enumerate().map(at_point).collect(),
    };
    Ok(Updated { bytes: learnt, record })
}

/// The file with the conditions of a table added to the measured ones. The growth of the model error away from measured
/// conditions must be known before anything is learnt of it.
fn with_conditions(bytes: &[u8], table: &Table) -> Result<Vec<u8>> {
    let (opened, mut surrogate) = (file::open(bytes)?, file::decode(bytes)?);
    let Some(own) = &mut surrogate.uncertainty else { return Ok(bytes.to_vec()) };
    let data = Data::read(&opened, table)?;
    let scale: Vec<f64> = surrogate.variables.iter().map(|v| 2.0 / (v.high - v.low).max(f64::MIN_POSITIVE)).collect();
    for x in (0..table.rows()).map(|row| data.condition(row)).filter(|x| opened.in_domain(x)) {
        let distance = |row: &Vec<f64>| row.iter().zip(&x).zip(&scale).map(|((a, b), s)| (s * (a - b)).powi(2)).sum::<f64>().sqrt();
        if own.measured.len() < format::MAX_MEASURED && own.measured.iter().all(|row| distance(row) > SAME) {
            own.measured.push(x);
        }
    }
    file::encode(&surrogate)
}

/// Mean and standard deviation of a state.
struct State {
    mean: f64,
    deviation: f64,
}

fn states_of(surrogate: &Surrogate<'_>) -> Result<Vec<State>> {
    let Some(uncertainty) = surrogate.uncertainty() else { return Ok(Vec::new()) };
    let (mut mean, mut covariance) = (vec![0.0; uncertainty.states()], vec![0.0; uncertainty.covariances()]);
    coldplate_runtime::Belief::begin(&uncertainty, &mut mean, &mut covariance).map_err(|e| Error::numerics(e.to_string()))?;
    let state = |(i, mean): (usize, &f64)| State { mean: *mean, deviation: covariance[i * (i + 1) / 2 + i].max(0.0).sqrt() };
    Ok(mean.iter().enumerate().map(state).collect())
}

/// The columns of a table that a surrogate knows, in its units.
struct Data {
    variables: Vec<Vec<f64>>,
    points: Vec<(usize, Vec<f64>)>,
}

impl Data {
    fn read(surrogate: &Surrogate<'_>, table: &Table) -> Result<Self> {
        let values = |column: &Column, own: Variable<'_>| -> Result<Vec<f64>> {
            let name = own.name;
            let one = |value: &f64| if value.is_finite() { condition::number_in(&own, *value, &column.unit) } else { Ok(f64::NAN) };
            column.values.iter().map(one).collect::<Result<_>>().map_err(|e: Error| e.at_key(name))
        };
        let variables = surrogate.variables().map(|v| values(table.column(v.name)?, v));
        let variables: Vec<Vec<f64>> = variables.collect::<Result<_>>()?;
        for held in surrogate.held() {
            if let Some(column) = table.columns.iter().find(|c| c.name == held.name) {
                let stated = values(column, Variable { name: held.name, unit: held.unit, low: held.value, high: held.value })?;
                if let Some(other) = stated.iter().find(|x| (*x - held.value).abs() > 1e-9 * held.value.abs().max(1.0)) {
                    let what = format!("'{}' was held at {} {} when the surrogate was made", held.name, held.value, held.unit);
                    return Err(Error::input(what).at_key(held.name).read(other).help("make a surrogate that varies it"));
                }
            }
        }
        let mut points = Vec::new();
        for column in &table.columns {
            if let Some((index, point)) = surrogate.points().enumerate().find(|(_, p)| p.name == column.name) {
                // A point has no range, so no value is snapped to an end.
                points.push((index, values(column, Variable { name: point.name, unit: point.unit, low: f64::NAN, high: f64::NAN })?));
            } else if !condition::variables(surrogate).iter().any(|v| v.name == column.name) {
                let known: Vec<&str> = surrogate.points().map(|p| p.name).collect();
                let error = Error::input(format!("the column '{}' is neither a variable nor a point of this surrogate", column.name));
                return Err(error.at_key(&column.name).help(match did_you_mean(&column.name, known.iter().copied()) {
                    Some(meant) => format!("did you mean '{meant}'?"),
                    None => format!("its points are: {}", known.join(", ")),
                }));
            }
        }
        Ok(Self { variables, points })
    }

    fn condition(&self, row: usize) -> Vec<f64> {
        self.variables.iter().map(|v| v[row]).collect()
    }

    fn readings(&self, row: usize, deviation: impl Fn(usize) -> f64) -> Vec<Reading> {
        let reading = |(point, values): &(usize, Vec<f64>)| Reading { point: *point, value: values[row], deviation: deviation(*point) };
        self.points.iter().map(reading).filter(|r| r.value.is_finite()).collect()
    }
}
