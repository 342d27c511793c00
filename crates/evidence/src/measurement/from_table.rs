//! Measured data from a table: the columns by what they hold, then row by row.

use std::collections::{HashMap, HashSet};

use super::{Data, ReadingRow, ReadingSettings, TEST, TIME, bare_times, beyond, repeated_times};
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{self, Dimension, Measurand, celsius};
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_tables::{Column, Ledger, Table, is_stamp};

/// Largest displacement that a machine can have, um. Chosen: larger numbers point to a wrong unit.
const FARTHEST: f64 = 1e5;
/// Bounds of plausible temperatures of a machine, K. Chosen: numbers outside point to a wrong unit.
const PLAUSIBLE: (f64, f64) = (150.0, 1500.0);
/// Numbers outside the plausible bounds that scanners write if a sensor does not answer, in whatever unit: a missing reading. Chosen:
/// any other such value is refused.
const NO_ANSWER: [f64; 4] = [-127.0, -999.0, -9999.0, 9999.0];
/// By how much clocks are set forward and back, s.
const HOUR: f64 = 3600.0;
/// Numbers that are usual temperatures of such machines in kelvin, and hardly ever in degC. Chosen: a wider range refuses hot
/// machines.
const LIKE_KELVIN: std::ops::Range<f64> = 250.0..420.0;

/// Reads a table with the account of its lines.
pub(super) fn read(table: &Table, ledger: Ledger, settings: &ReadingSettings, machine: &Machine, source: &str) -> Result<Data> {
    let columns = Columns::of(table, &ledger, machine)?;
    let mut notes = ledger.sentences();
    let mut rows = (0..table.rows()).map(|r| columns.row(r).map_err(|e| columns.place(e, r))).collect::<Result<Vec<_>>>()?;
    notes.extend(columns.without_answer());
    notes.extend(spread(&mut rows, machine));
    notes.extend(follow(&mut rows)?);
    columns.check_sensors(&rows, &mut notes)?;
    let held = settings.held(&rows, &ledger.between, machine, &mut notes)?;
    gaps(&rows, &mut notes);
    notes.extend(columns.unneeded());
    notes.extend(columns.missing());
    notes.extend(beyond::remarks(&rows, machine));
    let sensors: Vec<usize> = columns.sensors.into_iter().map(|(s, ..)| s).collect();
    let names = sensors.iter().map(|s| machine.sensors[*s].name.clone()).collect();
    Data { source: source.to_string(), sensors, names, rows, held, ledger, notes }.checked()
}

/// Cell of a sensor's column.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Measured {
    Missing,
    /// The sign of a sensor that does not answer, as it stands in the file.
    NoAnswer(f64),
    /// A reading, K or um; temperatures below absolute zero are negative.
    Value(f64),
}

impl Measured {
    /// The content of a cell in a unit of `own`.
    fn of(value: f64, unit: &str, own: Measurand) -> Self {
        if value.is_nan() {
            return Self::Missing;
        }
        let si = units::convert(value, unit, own.dimension());
        let reading = si.map_or(-1.0, |si| own.of_si(si));
        let is_sign = own == Measurand::Temperature && !(PLAUSIBLE.0..PLAUSIBLE.1).contains(&reading) && NO_ANSWER.contains(&value);
        if is_sign { Self::NoAnswer(value) } else { Self::Value(reading) }
    }
}

/// A sensor with its column and the content of the cells.
type SensorColumn<'a> = (usize, &'a Column, Vec<Measured>);

/// Columns of a table by what they hold.
struct Columns<'a> {
    machine: &'a Machine,
    table: &'a Table,
    ledger: &'a Ledger,
    /// Variables with a column.
    variables: Vec<(usize, &'a Column)>,
    /// Sensors with their readings.
    sensors: Vec<SensorColumn<'a>>,
    /// Headers of columns with a unit that name nothing of the machine.
    surplus: Vec<String>,
    /// Times of logs, s.
    times: Option<Vec<f64>>,
}

impl<'a> Columns<'a> {
    fn of(table: &'a Table, ledger: &'a Ledger, machine: &'a Machine) -> Result<Self> {
        let variable_of = |name: &str| machine.variables.iter().position(|v| v.name == name);
        let sensor_of = |name: &str| machine.sensors.iter().position(|s| s.name == name);
        let tests = table.text(TEST).map(|t| t.values.iter().collect::<HashSet<_>>().len());
        let is_steady = tests.is_some_and(|tests| 2 * tests > table.rows());
        let is_without_times = !is_steady && table.columns.iter().all(|c| c.name != TIME);
        for text in &table.texts {
            // Times that cannot be read throughout: without them the rows of a log would be steady readings.
            let stamps = text.values.iter().filter(|cell| is_stamp(cell)).count();
            if !is_steady && stamps > 1 && 2 * stamps > table.rows() && text.name != TEST {
                let odd = text.values.iter().position(|cell| !is_stamp(cell));
                let what = format!("the column '{}' holds times, and they cannot be read as the times of a log", text.name);
                let error = Error::input(what).at_key(text.name.clone());
                let help = "call it 'time', with all its cells in one form such as 2024-05-01 10:00:00; in a table of steady readings, name each test";
                return Err(match odd {
                    Some(r) => match ledger.line(r) {
                        Some(line) => error.read(&text.values[r]).at_line(line),
                        None => error.read(&text.values[r]),
                    },
                    None => error,
                }
                .help(help));
            }
            if is_steady && text.name == TIME {
                continue;
            }
            if is_without_times && bare_times::is_like_times(table, text) {
                return Err(like_times(&text.name, "has no unit and").at_line(ledger.header));
            }
            if variable_of(&text.name).is_some() || sensor_of(&text.name).is_some() || text.name == TIME {
                table.column(&text.name)?; // says that the unit is missing
            }
            // A text that nobody asked for is left out with a word; one with almost the name of something asked for was meant.
            if ![TEST, "note"].contains(&text.name.as_str()) && did_you_mean(&text.name, known(machine)).is_some() {
                return Err(unknown(&text.name, machine));
            }
        }
        let (mut variables, mut sensors, mut surplus) = (Vec::new(), Vec::new(), Vec::new());
        for column in table.columns.iter().filter(|c| c.name != TIME) {
            if let Some(variable) = variable_of(&column.name) {
                units::convert(300.0, &column.unit, machine.variables[variable].dimension).map_err(|e| e.at_key(column.header()))?;
                variables.push((variable, column));
            } else if let Some(sensor) = sensor_of(&column.name) {
                let own = machine.sensors[sensor].measurand();
                units::convert(300.0, &column.unit, own.dimension()).map_err(|e| e.at_key(column.header()))?;
                sensors.push((sensor, column, column.values.iter().map(|value| Measured::of(*value, &column.unit, own)).collect()));
            } else if did_you_mean(&column.name, known(machine)).is_some() {
                return Err(unknown(&column.name, machine));
            } else if is_without_times
                && units::dimension_of(&column.unit).is_ok_and(|d| d == Dimension::TIME)
                && bare_times::rises(table, &column.values, true)
            {
                return Err(like_times(&column.name, "is not called 'time' and"));
            } else {
                surplus.push(column.header());
            }
        }
        let times = if table.columns.iter().any(|c| c.name == TIME) { Some(table.column_si(TIME, Dimension::TIME)?) } else { None };
        Ok(Self { machine, table, ledger, variables, sensors, surplus, times })
    }

    /// Line of a row, if known.
    fn line(&self, r: usize) -> Option<usize> {
        self.ledger.line(r)
    }

    /// An error at a row.
    fn place(&self, e: Error, r: usize) -> Error {
        match self.line(r) {
            Some(line) => e.at_line(line),
            None => e,
        }
    }

    fn row(&self, r: usize) -> Result<ReadingRow> {
        let test = match (self.table.text(TEST).map(|t| t.values[r].trim()), &self.times) {
            (Some(""), _) => return Err(Error::input("this row has no name of its test").at_key(TEST)),
            (Some(name), _) => name.to_string(),
            (None, Some(_)) => "log".to_string(),
            (None, None) => format!("row {}", r + 1),
        };
        let time = self.times.as_ref().map(|t| t[r]);
        if time.is_some_and(f64::is_nan) {
            return Err(Error::input("this row has no time").at_key(TIME).help("give every row its time, or remove it"));
        }
        let condition = self.condition(r, time)?;
        let readings = self.sensors.iter().map(|own| self.reading(own, r)).collect::<Result<_>>()?;
        Ok(ReadingRow { test, time, condition, readings, line: self.line(r) })
    }

    fn condition(&self, r: usize, time: Option<f64>) -> Result<Condition> {
        let knows_time = self.machine.variables.iter().any(|v| v.name == TIME);
        let mut given: Vec<(&str, String)> = Vec::with_capacity(self.variables.len() + 1);
        given.extend(time.filter(|_| knows_time).map(|time| (TIME, format!("{time:?} s"))));
        for (_, column) in &self.variables {
            if column.values[r].is_nan() {
                let error = Error::input("a condition is missing").at_key(column.header());
                return Err(error.help("readings mean nothing without their condition: fill it in, or remove the row"));
            }
            given.push((&column.name, format!("{:?} {}", column.values[r], column.unit)));
        }
        for (v, column) in &self.variables {
            possible(&self.machine.variables[*v], column, column.values[r])?;
        }
        let pairs: Vec<(&str, &str)> = given.iter().map(|(n, v)| (*n, v.as_str())).collect();
        self.machine.condition(&pairs)
    }

    /// Reading of a sensor (K or um) in a row; `None` if it is missing, or the sign of a sensor that does not answer.
    fn reading(&self, (sensor, column, values): &SensorColumn<'a>, r: usize) -> Result<Option<f64>> {
        let Measured::Value(value) = values[r] else { return Ok(None) };
        let name = &self.machine.sensors[*sensor].name;
        let is_length = self.machine.sensors[*sensor].measurand() == Measurand::Displacement;
        let is_plausible = if is_length { value.abs() < FARTHEST } else { (PLAUSIBLE.0..PLAUSIBLE.1).contains(&value) };
        if is_plausible {
            return Ok(Some(value));
        }
        if is_length {
            let error = Error::input("this reading is no displacement of a machine").at_key(name);
            return Err(error.read(format!("{value:.1} um")).help("check the unit in the header"));
        }
        let shown = if value < 0.0 { format!("{} {}", column.values[r], column.unit) } else { format!("{:.1} degC", celsius(value)) };
        let error = Error::input("this reading is no temperature of a machine").at_key(name).read(shown);
        Err(error.help("check the unit in the header; leave the cell empty where the sensor failed"))
    }

    /// Sentences on readings that are the sign of a sensor that does not answer.
    fn without_answer(&self) -> Vec<String> {
        let of = |(sensor, _, values): &SensorColumn<'a>| {
            let rows: Vec<usize> = (0..values.len()).filter(|r| matches!(values[*r], Measured::NoAnswer(_))).collect();
            let Measured::NoAnswer(sign) = values[*rows.first()?] else { return None };
            let at = self.line(rows[0]).map_or(String::new(), |line| format!(" (line {line})"));
            let more = if rows.len() > 1 { format!(" and {} more", rows.len() - 1) } else { String::new() };
            let name = &self.machine.sensors[*sensor].name;
            let row = rows[0] + 1;
            Some(format!("row {row}{at}{more}, '{name}': {sign:.0} is the sign of a sensor that does not answer: left out"))
        };
        self.sensors.iter().filter_map(of).collect()
    }

    /// Checks that no sensor shows kelvin as degC throughout; notes those that show nothing.
    fn check_sensors(&self, rows: &[ReadingRow], notes: &mut Vec<String>) -> Result<()> {
        for (k, (sensor, ..)) in self.sensors.iter().enumerate() {
            let name = &self.machine.sensors[*sensor].name;
            if let Some(column) = self.table.columns.iter().find(|c| c.name == *name && c.unit.trim() == "degC")
                && let Some(first) = like_kelvin(rows, k, self.machine)
            {
                let error = Error::input("the readings of this sensor look like kelvin, not degC").at_key(column.header());
                let help = format!("write '{name} [K]' in the header; if they really are that hot, give them in kelvin as well");
                return Err(self.place(error.read(format!("{:.1} degC", column.values[first])).help(help), first));
            }
            if rows.iter().all(|row| row.readings[k].is_none()) {
                notes.push(format!("'{name}' has a column but no reading"));
            }
        }
        Ok(())
    }

    /// Remarks on the columns that nothing needs.
    fn unneeded(&self) -> Vec<String> {
        let texts = self.table.texts.iter().filter(|t| t.name != TEST).map(|t| format!("'{}'", t.name)).collect();
        let numbers = self.surplus.iter().map(|header| format!("'{header}'")).collect();
        let told = |(what, names): (&str, Vec<String>)| {
            (!names.is_empty()).then(|| format!("columns {what} that name nothing of this machine were left out: {}", names.join(", ")))
        };
        [("without a unit", texts), ("with a unit", numbers)].into_iter().filter_map(told).collect()
    }

    /// Remark on the variables without a column.
    fn missing(&self) -> Option<String> {
        let has_none = |(v, _): &(usize, &DescribedVariable)| self.variables.iter().all(|(own, _)| own != v);
        let missing: Vec<&str> = self.machine.variables.iter().enumerate().filter(has_none).map(|(_, v)| v.name.as_str()).collect();
        (!missing.is_empty()).then(|| format!("no column for {}: taken at the machine's default", missing.join(", ")))
    }
}

/// Spreads rows evenly within the last digit of a clock that repeats plainly; the sentences on it.
fn spread(rows: &mut [ReadingRow], machine: &Machine) -> Vec<String> {
    let Some(mut times) = rows.iter().map(|row| row.time).collect::<Option<Vec<f64>>>() else { return Vec::new() };
    let tests: Vec<String> = rows.iter().map(|row| row.test.clone()).collect();
    let clock = machine.variables.iter().position(|v| v.name == TIME);
    let others = |row: &ReadingRow| row.condition.si().iter().enumerate().filter(|(v, _)| Some(*v) != clock).map(|(_, x)| *x).collect();
    let told = repeated_times::spread(&mut times, &tests, |a, b| {
        let [a, b]: [Vec<f64>; 2] = [&rows[a], &rows[b]].map(others);
        a == b
    });
    for (row, time) in rows.iter_mut().zip(times) {
        row.time = Some(time);
        if let Some(clock) = clock {
            let mut si = row.condition.si().to_vec();
            si[clock] = time;
            row.condition = Condition::from_si(si);
        }
    }
    told
}

/// Checks the time of every row against the row before it in its test; the sentences on rows at one time. At an equal time, other
/// conditions are a step, of which the first reading counts; with equal conditions, equal readings are a copy and others a second
/// reading.
fn follow(rows: &mut [ReadingRow]) -> Result<Vec<String>> {
    let mut latest: HashMap<String, usize> = HashMap::new();
    let (mut lost, mut second) = (0, 0);
    for r in 0..rows.len() {
        let (before, own) = rows.split_at_mut(r);
        let row = &mut own[0];
        let Some(time) = row.time else { continue };
        let Some(other) = latest.insert(row.test.clone(), r) else { continue };
        let earlier = &mut before[other];
        let Some(before) = earlier.time.filter(|before| time <= *before) else { continue };
        if time < before {
            let (there, line) = (earlier.line.map_or(String::new(), |l| format!(" in line {l}")), row.line);
            let error = set_back(rows, r, before).read(format!("{time} s after {before} s{there}")).at_key(TIME);
            return Err(match line {
                Some(line) => error.at_line(line),
                None => error,
            });
        }
        let differs = |(a, b): (&Option<f64>, &Option<f64>)| a.is_some() && b.is_some() && a != b;
        if earlier.condition == row.condition && earlier.readings.iter().zip(&row.readings).any(differs) {
            second += 1;
            continue;
        }
        lost += earlier.readings.iter().zip(&row.readings).filter(|(earlier, later)| earlier.is_some() && later.is_some()).count();
        earlier.readings.iter_mut().zip(&mut row.readings).for_each(|(earlier, later)| *earlier = earlier.or(later.take()));
        row.readings.fill(None);
    }
    let lost = (lost > 0)
        .then(|| format!("{lost} readings at a time that has one already were left out: of two rows at one time the first counts"));
    let second = (second > 0).then(|| {
        let rows = if second == 1 { "1 row stands".into() } else { format!("{second} rows stand") };
        format!("{rows} at the time of the row above, with other readings under the same conditions: kept as second readings")
    });
    Ok(lost.into_iter().chain(second).collect())
}

/// Error of a row that stands before the time of the row above it in its test: the hour that stands twice, or rows out of order.
fn set_back(rows: &[ReadingRow], r: usize, before: f64) -> Error {
    let times: Vec<f64> = rows.iter().filter(|row| row.test == rows[r].test).filter_map(|row| row.time).collect();
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let fall = before - rows[r].time.unwrap_or(before);
    let is_hour = steps.get(steps.len() / 2).is_some_and(|step| (fall - (HOUR - step)).abs() <= 0.5 * step);
    if is_hour {
        let help = "give times in UTC or with their offset, or name the zone in the file beside the data: zone = \"Europe/Berlin\"";
        return Error::input("one hour stands twice in this log: its clock was set back").help(help);
    }
    Error::input("the times are not in order").help("sort the rows of each test by time")
}

/// Remarks on gaps of an hour and a period: clocks that are set forward leave such gaps.
fn gaps(rows: &[ReadingRow], notes: &mut Vec<String>) {
    let mut latest: HashMap<&str, (f64, f64, Option<usize>)> = HashMap::new();
    for row in rows {
        let Some(time) = row.time else { continue };
        let Some((before, period, line)) = latest.insert(&row.test, (time, f64::NAN, row.line)) else { continue };
        let step = time - before;
        if let (true, Some(a), Some(b)) = ((step - HOUR - period).abs() <= 0.01 * period + 1.0, line, row.line) {
            notes.push(format!(
                "between lines {a} and {b} one hour is missing, as if the clock had been set forward: taken as a gap (zone = \"Europe/Berlin\" in the file beside the data tells the clock's own time)"
            ));
        }
        latest.insert(&row.test, (time, if step > 0.0 && step < HOUR { step } else { period }, row.line));
    }
}

/// Checks that a condition can be meant as it is written.
fn possible(variable: &DescribedVariable, column: &Column, value: f64) -> Result<()> {
    if variable.dimension == Dimension::VOLUME_FLOW && value < 0.0 {
        let error = Error::input("a flow is negative").at_key(column.header()).read(value);
        return Err(error.help("give its amount: the machine file says which way the water runs"));
    }
    let is_in_range = |si: f64| variable.range.is_some_and(|(low, high)| (low..=high).contains(&si));
    let place = |e: Error| e.at_key(column.header()).read(format!("{value} {}", column.unit));
    let si = units::convert(value, &column.unit, variable.dimension)
        .map_err(|e| place(e).help("if the logger writes this number where it has none, fill the condition in, or remove the row"))?;
    if variable.dimension == Dimension::TEMPERATURE && column.unit.trim() == "degC" && LIKE_KELVIN.contains(&value) && !is_in_range(si) {
        let error = Error::input("this temperature looks like kelvin, not degC").at_key(column.header()).read(value);
        return Err(error.help(format!("write '{} [K]' in the header", column.name)));
    }
    Ok(())
}

/// First row of a column in degC that seems to hold kelvin: all its readings would be near its conditions in kelvin, and are
/// far hotter as they stand. `None` otherwise.
fn like_kelvin(rows: &[ReadingRow], column: usize, machine: &Machine) -> Option<usize> {
    let mut first = None;
    for (r, row) in rows.iter().enumerate() {
        let Some(kelvin) = row.readings[column] else { continue };
        let around = machine.variables.iter().zip(row.condition.si()).filter(|(v, _)| v.dimension == Dimension::TEMPERATURE);
        let hottest = around.map(|(_, t)| *t).fold(f64::NEG_INFINITY, f64::max);
        if !LIKE_KELVIN.contains(&celsius(kelvin)) || kelvin - hottest < 150.0 {
            return None;
        }
        first.get_or_insert(r);
    }
    first
}

/// Error of a column that seems to hold the times of a log, and is left unread as it is written.
fn like_times(name: &str, why: &str) -> Error {
    let error = Error::input(format!("the column '{name}' {why} grows from row to row like the times of a log")).at_key(name);
    error.help("call it 'time [s]' (or ms, min, h, d) if it holds times; in a table of steady readings, name each row's test")
}

fn known(machine: &Machine) -> impl Iterator<Item = &str> {
    machine.variables.iter().map(|v| v.name.as_str()).chain(machine.sensors.iter().map(|s| s.name.as_str())).chain([TEST, TIME])
}

fn unknown(name: &str, machine: &Machine) -> Error {
    let error = Error::input(format!("'{name}' is neither a condition nor a sensor of this machine")).at_key(name);
    match did_you_mean(name, known(machine)) {
        Some(near) => error.help(format!("did you mean '{near}'?")),
        None => error.help(format!("known: {}", known(machine).collect::<Vec<_>>().join(", "))),
    }
}
