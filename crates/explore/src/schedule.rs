//! Conditions over time: breakpoints of a CSV file, with straight lines or steps between them.
//!
//! The header is that of measured data: `time [s]` (or `min`, `h`) and a column with its unit for each variable that changes.
//! Other variables take the values given beside the file or the machine's defaults. A time that stands in two rows is a step. A
//! variable of the machine that is called `time` is set to the time. `NAME [unit, held]` stays until the next row,
//! `NAME [unit, joined]` runs straight to it, whatever else is asked for.
//!
//! Between two breakpoints every condition is smooth: a solver that stops at each [`ScheduleSegment`]'s end never steps across a jump
//! or a corner.

use std::path::Path;

use sha2::{Digest, Sha256};

use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_base::units::Dimension;
use coldplate_describe::machine::{Condition, DescribedVariable, Machine};
use coldplate_tables::{Ledger, Table};

/// Name of the column of times, and of the variable that is the time.
pub const TIME: &str = "time";
/// Columns of measured data with the test of each row, and with remarks.
const REMARKS: [&str; 2] = ["test", "note"];
/// Longest schedule, s: 300 years. Chosen: a guard against typing errors; the times of longer ones have no digits for steps.
const LONGEST: f64 = 1e10;
/// Most breakpoints of a schedule with its repetitions, count. Chosen: a guard against typing errors.
const MOST_ROWS: usize = 10_000_000;

/// Options by which the rows of a file become a schedule.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ScheduleOptions {
    /// Whether every value stays until the next row instead of moving towards it.
    pub hold: bool,
    /// Number of passes through the rows; 0 counts as once.
    pub repeat: usize,
    /// Time at which the schedule ends, s: the last condition is kept up to then, or the rest is cut off.
    pub until: Option<f64>,
}

/// A breakpoint.
#[derive(Debug, Clone, PartialEq)]
pub struct Breakpoint {
    /// Time of the breakpoint, s.
    pub time: f64,
    /// SI value of every variable, in the machine's order.
    pub values: Vec<f64>,
}

/// Conditions over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    rows: Vec<Breakpoint>,
    /// Whether each variable stays until the next row instead of moving towards it; variables beyond the end move.
    held: Vec<bool>,
    /// Index of the variable that is the time.
    time: Option<usize>,
    /// Columns of sensors and of tests, which are no conditions and were left aside.
    pub ignored: Vec<String>,
    /// Sentences on how the file was read.
    pub read: Vec<String>,
}

/// A stretch of time with a smooth condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScheduleSegment {
    /// Start of the stretch, s.
    pub from: f64,
    /// End of the stretch, s; equal to `from` at a step.
    pub until: f64,
    /// Index of the row at which the stretch begins.
    pub row: usize,
}

impl Schedule {
    /// Reads a file for a machine or another source of [`Quantities`]; `given` are values (name, text with unit) of variables
    /// without a column.
    ///
    /// # Errors
    /// The file is no table or has no `time` column; a column that is neither condition nor sensor, such as a misspelt one;
    /// times that fall; a value that is missing, out of bounds or in a unit of another kind; a variable with neither column,
    /// value nor default; no duration. Each names its line.
    pub fn read<'a>(path: &Path, of: impl Into<Quantities<'a>>, given: &[(String, String)], options: ScheduleOptions) -> Result<Self> {
        let (mut table, mut ledger) = Table::read_with_ledger(path)?;
        table.read_stamps(&mut ledger, None).map_err(|e| e.in_file(path))?;
        Self::from_table(&table, &ledger, of, given, options).map_err(|e| e.in_file(path))
    }

    /// Schedule from a table; `ledger` is the account of its lines, for errors.
    ///
    /// # Errors
    /// Errors of [`Schedule::read`].
    pub fn from_table<'a>(
        table: &Table,
        ledger: &Ledger,
        of: impl Into<Quantities<'a>>,
        given: &[(String, String)],
        options: ScheduleOptions,
    ) -> Result<Self> {
        let header = Some(ledger.header).filter(|line| *line > 0);
        let place = |e: Error, row: Option<usize>| match row.map_or(header, |r| ledger.line(r)) {
            Some(line) => e.at_line(line),
            None => e,
        };
        let times = times(table).map_err(|e| place(e, None))?;
        let quantities = of.into();
        let columns = Columns::of(table, &quantities, given).map_err(|e| place(e, None))?;
        let mut rows: Vec<Breakpoint> = Vec::with_capacity(times.len());
        for (r, time) in times.iter().enumerate() {
            if time.is_nan() {
                let error = Error::input("this row has no time").at_key(TIME).help("give every row its time, or remove it");
                return Err(place(error, Some(r)));
            }
            if rows.last().is_some_and(|last| last.time > *time) {
                let error = Error::input("the times are not in order").at_key(TIME).read(format!("{time} s after {} s", rows[r - 1].time));
                return Err(place(error.help("sort the rows by time; a time that stands in two rows is a step"), Some(r)));
            }
            let condition = columns.condition(r, *time).map_err(|e| place(e, Some(r)))?;
            rows.push(Breakpoint { time: *time, values: condition.si().to_vec() });
        }
        let stated = |v: &DescribedVariable| ledger.between.iter().find(|(name, _)| *name == v.name).map(|(_, held)| *held);
        let held = quantities.variables.iter().map(|v| stated(v).unwrap_or(options.hold)).collect();
        let mut schedule = Self { rows, held, time: columns.time, ignored: columns.ignored, read: ledger.sentences() };
        schedule.repeat(options.repeat)?;
        if let Some(until) = options.until {
            schedule.end_at(until)?;
        }
        if schedule.end() - schedule.start() > LONGEST {
            return Err(Error::input("this schedule is longer than three hundred years")
                .at_key(TIME)
                .read(format!("{} s", schedule.end() - schedule.start()))
                .help("look at the unit of the times, or give a shorter --until"));
        }
        if schedule.end() > schedule.start() {
            return Ok(schedule);
        }
        let error = match schedule.rows.len() {
            0 => Error::input("the schedule has no rows").help("give a row for the start and one for every change"),
            1 => Error::input("the schedule has one row only, so it does not say when it ends").help("add a row, or give --until \"8 h\""),
            _ => Error::input("all rows stand at the same time").help("add a row for the end, or give --until \"8 h\""),
        };
        Err(error.at_key(TIME))
    }

    /// Schedule from rows in the order of time. Between them values run straight, but for those of variables that are held until
    /// the next row; `held` may end early.
    ///
    /// # Errors
    /// Times that fall, or no duration.
    pub fn from_rows(rows: Vec<Breakpoint>, held: &[bool]) -> Result<Self> {
        if rows.windows(2).any(|pair| pair[1].time < pair[0].time) {
            return Err(Error::input("the times are not in order").at_key(TIME).help("sort the rows by time"));
        }
        let schedule = Self { rows, held: held.to_vec(), time: None, ignored: Vec::new(), read: Vec::new() };
        if schedule.end() > schedule.start() {
            return Ok(schedule);
        }
        Err(Error::input("a log needs at least two times").at_key(TIME).help("without a time column each row is a steady reading"))
    }

    /// Repeats the rows so that they are passed `times` times; if the last condition differs from the first, there is a step.
    fn repeat(&mut self, times: usize) -> Result<()> {
        if times < 2 {
            return Ok(());
        }
        let (length, once) = (self.end() - self.start(), self.rows.clone());
        if length.is_nan() || length <= 0.0 {
            return Err(Error::input("a schedule without duration cannot be repeated").at_key(TIME).help("add a row for its end"));
        }
        if once.len().saturating_mul(times) > MOST_ROWS {
            return Err(Error::input(format!("repeated {times} times, the schedule has more than {MOST_ROWS} rows"))
                .at_key("--repeat")
                .help("repeat it less often"));
        }
        for _ in 1..times {
            let (start, end) = (self.start(), self.end());
            // Held values end with a row that only states the end: the next turn begins there.
            if self.is_held() {
                self.rows.pop();
            }
            let turn: Vec<Breakpoint> = once.iter().map(|row| self.at_time(end + (row.time - start), &row.values)).collect();
            self.rows.extend(turn);
        }
        self.rows.dedup();
        Ok(())
    }

    fn at_time(&self, time: f64, values: &[f64]) -> Breakpoint {
        let mut values = values.to_vec();
        if let Some(slot) = self.time {
            values[slot] = time;
        }
        Breakpoint { time, values }
    }

    /// Makes `until` the end.
    fn end_at(&mut self, until: f64) -> Result<()> {
        let Some(last) = self.rows.last() else { return Ok(()) };
        let start = self.start();
        if until.is_nan() || until <= start {
            return Err(Error::input(format!("the schedule begins at {start} s, at or after the end asked for"))
                .at_key("--until")
                .read(format!("{until} s"))
                .help("the end is a time on the schedule's own clock"));
        }
        if until > last.time {
            let row = self.at_time(until, &last.values);
            self.rows.push(row);
            return Ok(());
        }
        let Some(at) = self.rows.iter().position(|row| row.time >= until) else { return Ok(()) };
        let condition = self.condition(ScheduleSegment { from: self.rows[at - 1].time, until: self.rows[at].time, row: at - 1 }, until);
        self.rows.truncate(at);
        let row = self.at_time(until, condition.si());
        self.rows.push(row);
        Ok(())
    }

    /// Time of the first row, s.
    pub fn start(&self) -> f64 {
        self.rows.first().map_or(0.0, |row| row.time)
    }

    /// Time of the last row, s.
    pub fn end(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.time)
    }

    /// The breakpoints.
    pub fn rows(&self) -> &[Breakpoint] {
        &self.rows
    }

    /// The condition that a row states.
    pub fn stated(&self, row: usize) -> Condition {
        Condition::from_si(self.rows[row.min(self.rows.len() - 1)].values.clone())
    }

    /// At most `most` of the conditions that the rows state, those farthest apart.
    pub fn far_apart(&self, most: usize) -> Vec<Condition> {
        Condition::far_apart(&(0..self.rows.len()).map(|row| self.stated(row)).collect::<Vec<_>>(), most)
    }

    /// The stretches between the rows, those without duration (steps) included.
    pub fn segments(&self) -> impl Iterator<Item = ScheduleSegment> + '_ {
        self.rows.windows(2).enumerate().map(|(row, ends)| ScheduleSegment { from: ends[0].time, until: ends[1].time, row })
    }

    /// The condition at `time` (s) in a segment, its ends included.
    pub fn condition(&self, segment: ScheduleSegment, time: f64) -> Condition {
        let (before, after) = (&self.rows[segment.row], &self.rows[(segment.row + 1).min(self.rows.len() - 1)]);
        let share = if segment.until <= segment.from { 0.0 } else { (time - segment.from) / (segment.until - segment.from) };
        let held = self.held.iter().copied().chain(std::iter::repeat(false));
        // Weighted so that both ends come out as they were written.
        let mix = |((a, b), held): ((&f64, &f64), bool)| if held || a == b { *a } else { (1.0 - share) * a + share * b };
        let mut values: Vec<f64> = before.values.iter().zip(&after.values).zip(held).map(mix).collect();
        if let Some(slot) = self.time {
            values[slot] = time;
        }
        Condition::from_si(values)
    }

    /// The condition at the end of the schedule: that at the end of the last stretch with a duration.
    pub(crate) fn last_condition(&self) -> Condition {
        match self.segments().filter(|s| s.until > s.from).last() {
            Some(segment) => self.condition(segment, segment.until),
            None => self.stated(self.rows.len() - 1),
        }
    }

    /// Whether all values are held until the next row.
    pub fn is_held(&self) -> bool {
        !self.held.is_empty() && self.held.iter().all(|held| *held)
    }

    /// Smallest and largest value (SI) of a variable.
    pub fn range(&self, variable: usize) -> (f64, f64) {
        let values = self.rows.iter().map(|row| row.values[variable]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    }

    /// SHA-256 of everything that decides the course of conditions, in hexadecimal.
    pub fn hash(&self) -> String {
        let mut sum = Sha256::new();
        self.held.iter().for_each(|held| sum.update([u8::from(*held)]));
        for row in &self.rows {
            sum.update(row.time.to_le_bytes());
            row.values.iter().for_each(|v| sum.update(v.to_le_bytes()));
        }
        sum.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// The times, s; NaN if missing.
fn times(table: &Table) -> Result<Vec<f64>> {
    if table.columns.iter().all(|c| c.name != TIME) && table.text(TIME).is_none() {
        let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).chain(table.texts.iter().map(|t| t.name.as_str())).collect();
        let meant = did_you_mean(TIME, names.iter().copied()).map_or(String::new(), |name| format!(" in place of '{name}'"));
        return Err(Error::input("the schedule has no time column")
            .at_key(TIME)
            .help(format!("write 'time [s]', 'time [min]' or 'time [h]' in the header{meant}; columns here: {}", names.join(", "))));
    }
    table.column_si(TIME, Dimension::TIME)
}

/// Names that a schedule may use: the variables that it sets, and sensors and heat flows whose readings it may hold.
#[derive(Debug, Clone)]
pub struct Quantities<'a> {
    /// Variables, in the order of a condition.
    pub variables: &'a [DescribedVariable],
    /// Names of sensors.
    pub sensors: Vec<&'a str>,
    /// Names of heat-flow sensors.
    pub heat_flows: Vec<&'a str>,
}

impl<'a> From<&'a Machine> for Quantities<'a> {
    fn from(machine: &'a Machine) -> Self {
        Self {
            variables: &machine.variables,
            sensors: machine.sensors.iter().map(|s| s.name.as_str()).collect(),
            heat_flows: machine.heat_flows.iter().map(|h| h.name.as_str()).collect(),
        }
    }
}

/// Columns by the variables that they set, and the values of the others.
struct Columns<'a> {
    quantities: &'a Quantities<'a>,
    columns: Vec<&'a coldplate_tables::Column>,
    given: &'a [(String, String)],
    time: Option<usize>,
    ignored: Vec<String>,
}

impl<'a> Columns<'a> {
    fn of(table: &'a Table, quantities: &'a Quantities<'a>, given: &'a [(String, String)]) -> Result<Self> {
        let is_variable = |name: &str| quantities.variables.iter().any(|v| v.name == name);
        if let Some(text) = table.texts.iter().find(|t| is_variable(&t.name)) {
            table.column(&text.name)?;
        }
        let time = quantities.variables.iter().position(|v| v.name == TIME);
        if let Some(variable) = time.map(|t| &quantities.variables[t])
            && variable.dimension != Dimension::TIME
        {
            return Err(Error::input(format!("the machine's variable 'time' is in {}, not a time", variable.unit))
                .at_key(TIME)
                .help("give it the unit \"s\", or another name, in the machine file"));
        }
        let (columns, others): (Vec<_>, Vec<_>) = table.columns.iter().filter(|c| c.name != TIME).partition(|c| is_variable(&c.name));
        for column in &columns {
            let variable = quantities.variables.iter().find(|v| v.name == column.name);
            variable
                .map_or(Ok(0.0), |v| coldplate_base::units::convert(300.0, &column.unit, v.dimension))
                .map_err(|e| e.at_key(column.header()))?;
        }
        if let Some((name, text)) = given.iter().find(|(name, _)| name == TIME || columns.iter().any(|c| c.name == *name)) {
            return Err(Error::input(format!("'{name}' is given on the command line and by the schedule"))
                .at_key(name)
                .read(text)
                .help("remove one of the two"));
        }
        // Readings and remarks are no conditions; anything else was meant to be one.
        let is_called = |own: &str, kind: &str, name: &str| own == name || name.strip_suffix(kind).is_some_and(|n| n == own);
        let is_reading = |name: &str| {
            quantities.sensors.iter().any(|s| is_called(s, " (sensor)", name))
                || quantities.heat_flows.iter().any(|h| is_called(h, " (heat flow)", name))
        };
        let names = others.iter().map(|c| c.name.as_str()).chain(table.texts.iter().map(|t| t.name.as_str()));
        if let Some(name) = names.into_iter().find(|name| !is_reading(name) && !REMARKS.contains(name)) {
            let known: Vec<&str> = quantities.variables.iter().map(|v| v.name.as_str()).chain([TIME]).collect();
            let what = format!("the column '{name}' is neither a condition nor a sensor of this machine");
            let meant = did_you_mean(name, known.iter().copied()).map_or(String::new(), |meant| format!("did you mean '{meant}'? "));
            return Err(Error::input(what).at_key(name).help(format!("{meant}known here: {}", known.join(", "))));
        }
        let ignored = others.iter().map(|c| c.header()).chain(table.texts.iter().map(|t| t.name.clone())).collect();
        Ok(Self { quantities, columns, given, time, ignored })
    }

    /// The condition that row `row` states.
    fn condition(&self, row: usize, time: f64) -> Result<Condition> {
        let mut values: Vec<(&str, String)> = Vec::with_capacity(self.quantities.variables.len());
        for column in &self.columns {
            let value = column.values[row];
            if value.is_nan() {
                return Err(Error::input("a value is missing")
                    .at_key(column.header())
                    .help("a schedule has no gaps: fill it in, or remove the row"));
            }
            values.push((&column.name, format!("{value} {}", column.unit)));
        }
        values.extend(self.given.iter().map(|(name, text)| (name.as_str(), text.clone())));
        if self.time.is_some() {
            values.push((TIME, format!("{time} s")));
        }
        let pairs: Vec<(&str, &str)> = values.iter().map(|(name, text)| (*name, text.as_str())).collect();
        Condition::given(self.quantities.variables, &pairs)
    }
}
