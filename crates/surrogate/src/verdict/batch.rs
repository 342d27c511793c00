//! Many conditions from a CSV file, read piece by piece: however long the file, only a few pieces are in memory.

use std::borrow::Cow;
use std::io::{BufRead, Read};

use coldplate_runtime::{Surrogate, Variable};
use rayon::prelude::*;

use super::condition;
use coldplate_base::error::{Error, Result, did_you_mean};

/// Number of lines that are worked on as one piece. Chosen: more lines use the cores better, but hold more memory.
pub(super) const LINES: usize = 1024;
/// Longest line, in bytes (1 MiB). Chosen: far longer than any condition, and a bound on memory for files that are no
/// text.
const LONGEST: u64 = 1 << 20;

/// Rows of the file.
#[derive(Debug, Default)]
pub(crate) struct BatchRows<'p> {
    /// Lines in the file, from 1.
    pub lines: Vec<usize>,
    /// The labels in the column `test`; none without one.
    pub labels: Vec<Cow<'p, str>>,
    /// The conditions one after the other: the surrogate's variables in its units, without the held ones.
    pub conditions: Vec<f64>,
    /// The values of the held variables, likewise.
    pub held: Vec<f64>,
}

/// One row of the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BatchRow<'r> {
    pub line: usize,
    pub label: Option<&'r str>,
    pub condition: &'r [f64],
    pub held: &'r [f64],
}

impl BatchRows<'_> {
    /// Row `index`, which exists.
    pub(crate) fn row(&self, index: usize) -> BatchRow<'_> {
        let (line, rows) = (self.lines[index], self.lines.len());
        let of = |list: &'_ [f64]| index * (list.len() / rows)..(index + 1) * (list.len() / rows);
        let (condition, held) = (&self.conditions[of(&self.conditions)], &self.held[of(&self.held)]);
        BatchRow { line, label: self.labels.get(index).map(|own| &**own), condition, held }
    }
}

/// Meaning of a column of the file.
enum Column {
    /// A variable, with the unit from the header, or values that carry their own.
    Variable { index: usize, unit: Option<String> },
    /// The label of a row.
    Label,
    /// Measured readings of a point, or the times of readings: no part of a condition.
    Ignored,
}

/// The error for a file that has a header and nothing else.
pub(super) fn no_conditions() -> Error {
    Error::input("this file holds no conditions").help("write one condition a line below the header")
}

/// Some lines of a file.
#[derive(Debug)]
pub(crate) struct LinePiece {
    /// Number of the first line, from 1.
    first: usize,
    text: String,
}

impl LinePiece {
    /// The lines with something in them, and their numbers; blank lines and remarks carry nothing.
    fn content(&self) -> impl Iterator<Item = (usize, &str)> {
        let lines = self.text.lines().enumerate().map(|(i, line)| (self.first + i, line));
        lines.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'))
    }
}

/// The lines of a file, in pieces.
#[derive(Debug)]
pub(crate) struct LinePieces<R> {
    reader: R,
    done: usize,
}

impl<R: BufRead> LinePieces<R> {
    /// The lines of `reader` from the beginning.
    pub fn new(reader: R) -> Self {
        Self { reader, done: 0 }
    }

    /// The next lines, at most `most`; none at the end.
    ///
    /// # Errors
    /// The reader fails, or a line is no text or longer than 1 MiB.
    fn next(&mut self, most: usize) -> Result<Option<LinePiece>> {
        let first = self.done + 1;
        let mut bytes = Vec::new();
        while self.done + 1 < first + most {
            let before = bytes.len();
            let line = self.done + 1;
            let read = self.reader.by_ref().take(LONGEST).read_until(b'\n', &mut bytes);
            let read = read.map_err(|e| Error::input(format!("this line cannot be read: {e}")).at_line(line))?;
            if read == 0 {
                break;
            }
            if read as u64 == LONGEST && bytes.last() != Some(&b'\n') {
                return Err(Error::input("this line is longer than 1 MiB").at_line(line).help("give a table of conditions in CSV"));
            }
            if std::str::from_utf8(&bytes[before..]).is_err() {
                return Err(Error::input("this line is no UTF-8 text").at_line(line).help("save the table as CSV in UTF-8"));
            }
            self.done = line;
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        let mut text = String::from_utf8(bytes).unwrap_or_default();
        if first == 1 && text.starts_with('\u{feff}') {
            text.remove(0);
        }
        Ok(Some(LinePiece { first, text }))
    }

    /// Works on all pieces that are left, on every core, and gives the results in their order.
    ///
    /// # Errors
    /// Errors of `LinePieces::next` and of `work`: the first one in the order of the file.
    pub fn each<T: Send>(&mut self, work: impl Fn(&LinePiece) -> Result<T> + Sync, mut take: impl FnMut(T)) -> Result<()> {
        loop {
            let mut pieces = Vec::new();
            let mut broken = Ok(());
            while pieces.len() < 2 * rayon::current_num_threads() {
                match self.next(LINES) {
                    Ok(Some(piece)) => pieces.push(piece),
                    Ok(None) => break,
                    Err(error) => {
                        broken = Err(error);
                        break;
                    }
                }
            }
            let done: Vec<Result<T>> = pieces.par_iter().map(&work).collect();
            for result in done {
                take(result?);
            }
            broken?;
            if pieces.is_empty() {
                return Ok(());
            }
        }
    }
}

/// The header of a file of conditions, and the reader of its rows. The header names variables, with their unit as in
/// `coolant_flow [L/min]`; cells of a column without a unit carry their own. Variables that are the same in every row may
/// be given beside the file. A column `test` labels the rows. Columns named after measurement points are measurements,
/// and are passed over.
pub(crate) struct BatchHeader<'a> {
    surrogate: &'a Surrogate<'a>,
    variables: Vec<Variable<'a>>,
    columns: Vec<Column>,
    /// The values of variables without a column, held ones behind the others.
    common: Vec<f64>,
}

impl<'a> BatchHeader<'a> {
    /// Reads the header.
    ///
    /// # Errors
    /// Unknown or missing columns, no header; as [`condition::partial`] for the variables `given` beside the file.
    pub fn begin<R: BufRead>(surrogate: &'a Surrogate<'a>, lines: &mut LinePieces<R>, given: &[(String, String)]) -> Result<Self> {
        let common = condition::partial(surrogate, given)?;
        let mut batch = Self { surrogate, variables: condition::variables(surrogate), columns: Vec::new(), common: Vec::new() };
        while let Some(piece) = lines.next(1)? {
            if let Some((line, header)) = piece.content().next() {
                (batch.columns, batch.common) = batch.header(header, common).map_err(|e| e.at_line(line))?;
                return Ok(batch);
            }
        }
        Err(Error::input("this file holds no header").help("name the variables in the first line: coolant_flow [L/min], ..."))
    }

    /// Whether the rows have labels.
    pub(crate) fn is_labelled(&self) -> bool {
        self.columns.iter().any(|column| matches!(column, Column::Label))
    }

    /// The rows of a piece.
    ///
    /// # Errors
    /// A row with an unreadable, missing or surplus cell, named by its line.
    pub fn rows<'p>(&self, piece: &'p LinePiece) -> Result<BatchRows<'p>> {
        let (mut rows, mut row) = (BatchRows::default(), Vec::new());
        for (line, text) in piece.content() {
            self.read(text, &mut row, &mut rows).map_err(|e| e.at_line(line))?;
            rows.lines.push(line);
        }
        Ok(rows)
    }

    /// The columns, and the values of the variables without one.
    fn header(&self, header: &str, mut seen: Vec<Option<f64>>) -> Result<(Vec<Column>, Vec<f64>)> {
        let (mut columns, mut row) = (Vec::new(), Vec::new());
        cells(header, &mut row)?;
        for cell in row {
            let (name, unit) = match cell.split_once('[') {
                Some((name, unit)) => (name.trim(), Some(unit.trim().trim_end_matches(']').trim().to_owned())),
                None => (cell.trim(), None),
            };
            if let Some(index) = self.variables.iter().position(|v| v.name == name) {
                if seen[index].is_some() {
                    return Err(Error::input(format!("'{name}' is given twice"))
                        .at_key(name)
                        .help("give it as an option or as one column"));
                }
                seen[index] = Some(0.0);
                if let Some(unit) = &unit {
                    condition::number_in(&self.variables[index], 1.0, unit).map_err(|e| e.at_key(name).read(unit))?;
                }
                columns.push(Column::Variable { index, unit });
            } else if name == "test" {
                columns.push(Column::Label);
            } else if name == "time" || self.surrogate.points().any(|p| p.name == name) {
                columns.push(Column::Ignored);
            } else {
                let known: Vec<&str> = self.variables.iter().map(|v| v.name).collect();
                let error = Error::input(format!("the column '{name}' is neither a variable nor a point of this surrogate")).at_key(name);
                return Err(match did_you_mean(name, known.iter().copied()) {
                    Some(meant) => error.help(format!("did you mean '{meant}'? Its variables are: {}", known.join(", "))),
                    None => error.help(format!("its variables are: {}", known.join(", "))),
                });
            }
        }
        Ok((columns, condition::complete(self.surrogate, seen)?))
    }

    /// Reads a line behind the other rows; `row` is memory for its cells.
    fn read<'p>(&self, text: &'p str, row: &mut Vec<Cow<'p, str>>, rows: &mut BatchRows<'p>) -> Result<()> {
        cells(text, row)?;
        if row.len() != self.columns.len() {
            return Err(Error::input(format!("this row has {} cells, the header {}", row.len(), self.columns.len())));
        }
        let (varied, held) = self.common.split_at(self.surrogate.variable_count());
        let (from, held_from) = (rows.conditions.len(), rows.held.len());
        rows.conditions.extend_from_slice(varied);
        rows.held.extend_from_slice(held);
        for (column, cell) in self.columns.iter().zip(row.drain(..)) {
            match column {
                Column::Variable { index, unit } => {
                    let variable = &self.variables[*index];
                    let value = match unit {
                        Some(unit) => match cell.parse::<f64>() {
                            Ok(number) => condition::number_in(variable, number, unit),
                            Err(_) => Err(Error::input("no number can be read here").read(cell)),
                        },
                        None => condition::value_of(variable, &cell),
                    };
                    let value = value.map_err(|e| e.at_key(variable.name))?;
                    match index.checked_sub(varied.len()) {
                        None => rows.conditions[from + index] = value,
                        Some(index) => rows.held[held_from + index] = value,
                    }
                }
                Column::Label => {
                    // The last of several labels counts.
                    rows.labels.truncate(rows.lines.len());
                    rows.labels.push(cell);
                }
                Column::Ignored => {}
            }
        }
        Ok(())
    }
}

/// The cells of a line, trimmed, in place of those in `row`; a cell in double quotes may hold commas, and quotes written
/// twice.
fn cells<'p>(line: &'p str, row: &mut Vec<Cow<'p, str>>) -> Result<()> {
    row.clear();
    if !line.contains('"') {
        row.extend(line.split(',').map(|cell| Cow::Borrowed(cell.trim())));
        return Ok(());
    }
    let mut cells = vec![String::new()];
    let mut quoted = false;
    let mut characters = line.chars().peekable();
    while let (Some(c), Some(cell)) = (characters.next(), cells.last_mut()) {
        match c {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                cell.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            _ => cell.push(c),
        }
    }
    if quoted {
        return Err(Error::input("a quotation mark is opened and not closed on this line"));
    }
    row.extend(cells.into_iter().map(|cell| Cow::Owned(cell.trim().to_owned())));
    Ok(())
}
