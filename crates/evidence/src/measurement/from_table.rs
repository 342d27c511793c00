//! Measured data from a table: the columns by what they hold, then row by row.

use std::collections::{HashMap, HashSet};

use super::{Data, ReadingRow, ReadingSettings, TEST, TIME, beyond};
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::{self, Dimension, Measurand, celsius};
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_tables::{Column, Ledger, Table, is_stamp};

/// Largest displacement that a machine can have, um. Chosen: larger numbers point to a wrong unit.
const FARTHEST: f64 = 1e5;
/// Bounds of plausible temperatures of a machine, K. Chosen: numbers outside point to a wrong unit.
const PLAUSIBLE: (f64, f64) = (150.0, 1500.0);
/// Values outside the plausible bounds that scanners write if a sensor does not answer, degC: a missing reading. Chosen: any
/// other such value is refused.
const NO_ANSWER: [f64; 4] = [-127.0, -999.0, -9999.0, 9999.0];
/// By how much clocks are set forward and back, s.
const HOUR: f64 = 3600.0;
/// Numbers that are usual temperatures of such machines in kelvin, and hardly ever in degC. Chosen: a wider range refuses hot
/// machines.
const LIKE_KELVIN: std::ops::Range<f64> = 250.0..420.0;

/// Reads a table with the account of its lines.
pub(super) fn read(table: &Table, ledger: Ledger, settings: &ReadingSettings, machine: &Machine, source: &str) -> Result<Data> {
    let columns = Columns::of(table, &ledger, machine)?;
    let (mut rows, mut notes) = (Vec::with_capacity(table.rows()), ledger.sentences());
    let (mut latest, mut second) = (HashMap::new(), 0);
    for r in 0..table.rows() {
        let mut row = columns.row(r, &mut notes).map_err(|e| columns.place(e, r))?;
        follow(&mut rows, &mut latest, &mut row, &mut second).map_err(|e| columns.place(e, r))?;
        rows.push(row);
    }
    if second > 0 {
        notes.push(format!("{second} readings at a time that has one already were left out: of two rows at one time the first counts"));
    }
    columns.check_sensors(&rows, &mut notes)?;
    let held = settings.held(&rows, machine, &mut notes)?;
    gaps(&rows, &mut notes);
    notes.extend(columns.unneeded());
    notes.extend(columns.missing());
    notes.extend(beyond::remarks(&rows, machine));
    let sensors: Vec<usize> = columns.sensors.into_iter().map(|(s, _)| s).collect();
    let names = sensors.iter().map(|s| machine.sensors[*s].name.clone()).collect();
    Data { source: source.to_string(), sensors, names, rows, held, ledger, notes }.checked()
}

/// Columns of a table by what they hold.
struct Columns<'a> {
    machine: &'a Machine,
    table: &'a Table,
    ledger: &'a Ledger,
    /// Variables with a column.
    variables: Vec<(usize, &'a Column)>,
    /// Sensors with their readings, K or um; not a number where missing.
    sensors: Vec<(usize, Vec<f64>)>,
    /// Times of logs, s.
    times: Option<Vec<f64>>,
}

impl<'a> Columns<'a> {
    fn of(table: &'a Table, ledger: &'a Ledger, machine: &'a Machine) -> Result<Self> {
        let variable_of = |name: &str| machine.variables.iter().position(|v| v.name == name);
        let sensor_of = |name: &str| machine.sensors.iter().position(|s| s.name == name);
        let tests = table.text(TEST).map(|t| t.values.iter().collect::<HashSet<_>>().len());
        let is_steady = tests.is_some_and(|tests| 2 * tests > table.rows());
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
            if variable_of(&text.name).is_some() || sensor_of(&text.name).is_some() || text.name == TIME {
                table.column(&text.name)?; // says that the unit is missing
            }
            // A text that nobody asked for is left out with a word; one with almost the name of something asked for was meant.
            if ![TEST, "note"].contains(&text.name.as_str()) && did_you_mean(&text.name, known(machine)).is_some() {
                return Err(unknown(&text.name, machine));
            }
        }
        let (mut variables, mut sensors) = (Vec::new(), Vec::new());
        for column in table.columns.iter().filter(|c| c.name != TIME) {
            if let Some(variable) = variable_of(&column.name) {
                units::convert(300.0, &column.unit, machine.variables[variable].dimension).map_err(|e| e.at_key(column.header()))?;
                variables.push((variable, column));
            } else if let Some(sensor) = sensor_of(&column.name) {
                let own = machine.sensors[sensor].measurand();
                let values = table.column_si(&column.name, own.dimension())?;
                sensors.push((sensor, values.into_iter().map(|si| own.of_si(si)).collect()));
            } else {
                return Err(unknown(&column.name, machine));
            }
        }
        let times = if table.columns.iter().any(|c| c.name == TIME) { Some(table.column_si(TIME, Dimension::TIME)?) } else { None };
        Ok(Self { machine, table, ledger, variables, sensors, times })
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

    fn row(&self, r: usize, notes: &mut Vec<String>) -> Result<ReadingRow> {
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
        let readings = self.sensors.iter().map(|(sensor, values)| self.reading(r, *sensor, values[r], notes)).collect::<Result<_>>()?;
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
    fn reading(&self, r: usize, sensor: usize, value: f64, notes: &mut Vec<String>) -> Result<Option<f64>> {
        let (name, shown) = (&self.machine.sensors[sensor].name, celsius(value));
        let is_length = self.machine.sensors[sensor].measurand() == Measurand::Displacement;
        let is_plausible = if is_length { value.abs() < FARTHEST } else { (PLAUSIBLE.0..PLAUSIBLE.1).contains(&value) };
        if value.is_nan() || is_plausible {
            return Ok(Some(value).filter(|_| is_plausible));
        }
        if is_length {
            let error = Error::input("this reading is no displacement of a machine").at_key(name);
            return Err(error.read(format!("{value:.1} um")).help("check the unit in the header"));
        }
        if NO_ANSWER.iter().any(|sign| (shown - sign).abs() < 1e-3) {
            let at = self.line(r).map_or(String::new(), |line| format!(" (line {line})"));
            notes.push(format!("row {}{at}, '{name}': {shown:.0} degC is the sign of a sensor that does not answer: left out", r + 1));
            return Ok(None);
        }
        let error = Error::input("this reading is no temperature of a machine").at_key(name).read(format!("{shown:.1} degC"));
        Err(error.help("check the unit in the header; leave the cell empty where the sensor failed"))
    }

    /// Checks that no sensor shows kelvin as degC throughout; notes those that show nothing.
    fn check_sensors(&self, rows: &[ReadingRow], notes: &mut Vec<String>) -> Result<()> {
        for (k, (sensor, _)) in self.sensors.iter().enumerate() {
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

    /// Remark on the columns of texts that nothing needs.
    fn unneeded(&self) -> Option<String> {
        let names: Vec<String> =
            self.table.texts.iter().filter(|t| ![TEST, "note"].contains(&t.name.as_str())).map(|t| format!("'{}'", t.name)).collect();
        (!names.is_empty()).then(|| format!("columns without a unit that name nothing of this machine were left out: {}", names.join(", ")))
    }

    /// Remark on the variables without a column.
    fn missing(&self) -> Option<String> {
        let has_none = |(v, _): &(usize, &DescribedVariable)| self.variables.iter().all(|(own, _)| own != v);
        let missing: Vec<&str> = self.machine.variables.iter().enumerate().filter(has_none).map(|(_, v)| v.name.as_str()).collect();
        (!missing.is_empty()).then(|| format!("no column for {}: taken at the machine's default", missing.join(", ")))
    }
}

/// Checks the time of a row against the row before it in its test. At an equal time, other conditions are a step and equal ones
/// a copy; readings of one time count once, in the earlier row, and `second` counts the others. `latest` holds the last row of each
/// test.
fn follow(rows: &mut [ReadingRow], latest: &mut HashMap<String, usize>, row: &mut ReadingRow, second: &mut usize) -> Result<()> {
    let Some(time) = row.time else { return Ok(()) };
    let Some(other) = latest.insert(row.test.clone(), rows.len()) else { return Ok(()) };
    let before = rows[other].time;
    let period = rows[..other].iter().rev().filter(|r| r.test == row.test).find_map(|r| Some(before? - r.time?).filter(|step| *step > 0.0));
    let earlier = &mut rows[other];
    let Some(before) = earlier.time.filter(|before| time <= *before) else { return Ok(()) };
    let there = earlier.line.map_or(String::new(), |l| format!(" in line {l}"));
    if time < before {
        let step = period.filter(|step| (time - before - (step - HOUR)).abs() <= 0.5 * step);
        if step.is_some() {
            let error =
                Error::input("one hour stands twice in this log: its clock was set back").read(format!("{time} s after {before} s{there}"));
            let help = "give times in UTC or with their offset, or name the zone in the file beside the data: zone = \"Europe/Berlin\"";
            return Err(error.at_key(TIME).help(help));
        }
        let error = Error::input("the times are not in order").read(format!("{time} s after {before} s{there}"));
        return Err(error.at_key(TIME).help("sort the rows of each test by time"));
    }
    let differs = |(a, b): (&Option<f64>, &Option<f64>)| a.is_some() && b.is_some() && a != b;
    if earlier.condition == row.condition && earlier.readings.iter().zip(&row.readings).any(differs) {
        let error = Error::input(format!("two rows of '{}' stand at {time} s", row.test)).read(format!("{time} s, as{there}"));
        return Err(error.at_key(TIME).help("keep one row for each time; a step is two rows with conditions that differ"));
    }
    let lost = earlier.readings.iter().zip(&row.readings).filter(|(earlier, later)| earlier.is_some() && later.is_some()).count();
    earlier.readings.iter_mut().zip(&mut row.readings).for_each(|(earlier, later)| *earlier = earlier.or(later.take()));
    row.readings.fill(None);
    *second += lost;
    Ok(())
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
    let si = units::convert(value, &column.unit, variable.dimension)?;
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
