//! Takes the records of a text file into a table, with an account of every line.

use std::collections::BTreeMap;

use super::{Column, Ledger, Table, TextColumn};
use crate::cell::{self, is_missing};
use crate::header::is_other_header;
use crate::layout::Layout;
use crate::ledger::{BLANK, listed};
use crate::records::{CsvRecords, Record};
use crate::statistic::{Statistic, last_digit};
use coldplate_base::error::{Error, Result, did_you_mean};

/// Provenance key of the number of condition variables among the number columns.
pub(crate) const INPUTS: &str = "inputs";

/// Kind of a column: the place its cells are stored in.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Text(usize),
    Number(usize),
    /// A column without a name.
    Nameless,
}

/// A record that is no row if no row follows.
struct Pending {
    line: usize,
    cells: Vec<String>,
    /// The statistic that it seems to hold; `None` for words at the end of a file.
    statistic: Option<Statistic>,
}

/// Decimal marks of the numbers of a file.
#[derive(Default)]
struct DecimalMarks {
    /// Mark of the first number that has one, with its line.
    first: Option<(char, usize)>,
    /// First number whose comma may as well set thousands apart: line, header, cell.
    open: Option<(usize, String, String)>,
    /// Whether some number shows that commas are decimal marks.
    is_known: bool,
}

/// Line of an announcement of condition columns, and the number that it announces.
pub(crate) type Announced = (usize, usize);

/// Takes records into a table.
pub(crate) struct Reader<'a> {
    layout: &'a Layout,
    table: Table,
    kinds: Vec<Kind>,
    pub ledger: Ledger,
    /// Line and number of the announcement of condition columns.
    inputs: Option<Announced>,
    marks: DecimalMarks,
    /// Nameless columns that held anything.
    lost: Vec<usize>,
    /// Lines that begin like a remark and were taken as rows, by the mark.
    marked_rows: BTreeMap<&'static str, Vec<usize>>,
    /// Cells with a unit of their own, by the header of their column: the number of them, and the first.
    own_units: BTreeMap<String, (usize, String)>,
    pending: Vec<Pending>,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(layout: &'a Layout, ledger: Ledger) -> Result<Self> {
        let mut table = Table::default();
        let cells = layout.header.iter().enumerate();
        let kinds = cells
            .map(|(i, cell)| header_cell(&mut table, cell).map_err(|e| e.at_key(format!("column {}", i + 1))))
            .collect::<Result<_>>()?;
        Ok(Self {
            layout,
            table,
            kinds,
            ledger,
            inputs: None,
            marks: DecimalMarks::default(),
            lost: Vec::new(),
            marked_rows: BTreeMap::new(),
            own_units: BTreeMap::new(),
            pending: Vec::new(),
        })
    }

    pub(crate) fn take(&mut self, record: Record<'_>, is_last: bool) -> Result<()> {
        let line = record.line;
        if let Some((mark, comment)) = record.comment {
            return self.take_comment(line, mark, comment);
        }
        if line <= self.layout.last_line {
            return Ok(());
        }
        self.swallowed(&record)?;
        let is_copy = |written: &Vec<String>| {
            let pairs = || record.cells.iter().zip(written);
            record.cells == *written || pairs().all(|(a, b)| a == b && !a.is_empty())
        };
        if self.layout.written.iter().chain([&self.layout.header]).any(is_copy) {
            self.ledger.leave_out("the header once more", line);
            return Ok(());
        }
        if is_other_header(&record.cells) {
            let error = Error::input("another header begins here").read(record.cells.join(", "));
            return Err(error.help("put each table into a file of its own, or remove the line if the columns are those above"));
        }
        let filled: Vec<&String> = record.cells.iter().filter(|cell| !cell.is_empty()).collect();
        if filled.is_empty() && record.cells.len() > 1 {
            self.ledger.leave_out(BLANK, line);
            return Ok(());
        }
        if record.cells.len() < self.kinds.len() && is_last && !is_words(&filled) {
            self.ledger.leave_out("the file ends within it", line);
            return Ok(());
        }
        if is_last && let Some(cell) = record.cells.last().filter(|cell| cell.parse::<f64>().is_ok()) {
            self.ledger
                .noted
                .push(format!("the file ends without a line end behind '{cell}' (line {line}): the number may have been cut off"));
        }
        let statistic = record.cells.first().and_then(|cell| Statistic::named(cell)).filter(|_| record.cells.len() == self.kinds.len());
        if statistic.is_some() || (is_words(&filled) && (self.kinds.len() > 2 || record.cells.len() < self.kinds.len())) {
            self.pending.push(Pending { line, cells: record.cells, statistic });
            return Ok(());
        }
        self.take_pending()?;
        // A header that ends with a delimiter has a nameless last column, which rows may leave out.
        let mut cells = record.cells;
        if cells.len() + 1 == self.kinds.len() && matches!(self.kinds.last(), Some(Kind::Nameless)) {
            cells.push(String::new());
        }
        self.take_row(line, &cells)
    }

    /// Refuses a cell that holds rows of the table, because a quote in front of them is not closed in its line.
    fn swallowed(&self, record: &Record<'_>) -> Result<()> {
        if record.last_line == record.line {
            return Ok(());
        }
        let is_row = |line: &str| {
            let cells: Vec<&str> = line.split(self.layout.delimiter).collect();
            cells.len() > 1
                && cells.len() == self.kinds.len()
                && cells.iter().any(|cell| cell.trim().replace(',', ".").parse::<f64>().is_ok())
        };
        let inside = record.cells.iter().filter(|cell| cell.contains('\n')).flat_map(|cell| cell.lines().skip(1));
        if inside.into_iter().any(is_row) {
            let what = format!("a quote that opens here is closed in line {}, and rows stand between", record.last_line);
            return Err(Error::input(what).help("close the quote in its own line, or remove it"));
        }
        Ok(())
    }

    /// A remark, a line of provenance, or a row whose first cell begins so.
    fn take_comment(&mut self, line: usize, mark: &'static str, comment: &str) -> Result<()> {
        if line == self.layout.header_line {
            return Ok(());
        }
        if line > self.layout.last_line {
            let whole = format!("{mark}{comment}");
            let cells = CsvRecords::row(&whole, self.layout.delimiter).filter(|cells| cells.len() == self.kinds.len() && cells.len() > 1);
            if let Some(cells) = cells {
                if matches!(self.kinds[0], Kind::Text(_)) {
                    self.marked_rows.entry(mark).or_default().push(line);
                    self.take_pending()?;
                    return self.take_row(line, &cells);
                }
                if is_missing(&cells[0]) {
                    self.take_pending()?;
                    return self.take_row(line, &cells);
                }
            }
            self.ledger.leave_out_remark(mark, line);
        }
        let Some((key, value)) = comment.split_once(':').map(|(k, v)| (k.trim(), v.trim())) else { return Ok(()) };
        if key != INPUTS && value.parse::<usize>().is_ok() && did_you_mean(key, [INPUTS]).is_some() {
            let error = Error::input("this line is not known, and looks like one that is").read(comment);
            return Err(error.help(format!("did you mean '# {INPUTS}: {value}'? It says how many columns are conditions")));
        }
        if key == INPUTS {
            let count =
                value.parse().map_err(|_| Error::input("the number of condition columns is not a number").at_key(INPUTS).read(value))?;
            if let Some((before, other)) = self.inputs.filter(|(_, other)| *other != count) {
                let what = format!("{count} condition columns are announced, and {other} in line {before}");
                return Err(Error::input(what).at_key(INPUTS).help("keep the line that is true"));
            }
            self.inputs = Some((line, count));
        } else if line < self.layout.header_line {
            self.table.provenance.push((key.to_string(), value.to_string()));
        }
        Ok(())
    }

    /// Takes the records as rows that would be none at the end of the file.
    fn take_pending(&mut self) -> Result<()> {
        for Pending { line, cells, .. } in std::mem::take(&mut self.pending) {
            self.take_row(line, &cells).map_err(|e| e.at_line(line))?;
        }
        Ok(())
    }

    fn take_row(&mut self, line: usize, cells: &[String]) -> Result<()> {
        if cells.len() != self.kinds.len() {
            let has_commas = self.layout.delimiter == ',' && cells.len() > self.kinds.len();
            let help = if has_commas {
                "separate the columns by ';' if numbers have decimal commas; give every column a cell, and leave it empty where the reading is missing"
            } else {
                "give every column a cell; leave it empty where the reading is missing"
            };
            return Err(Error::input(format!("the row has {} cells, the header has {}", cells.len(), self.kinds.len())).help(help));
        }
        for (i, cell) in cells.iter().enumerate() {
            match self.kinds[i] {
                Kind::Text(t) => self.table.texts[t].values.push(cell.clone()),
                Kind::Number(c) => {
                    let value = self.number(cell, c, line).map_err(|e| e.at_key(self.table.columns[c].header()))?;
                    self.table.columns[c].values.push(value);
                }
                Kind::Nameless if !cell.is_empty() && !self.lost.contains(&i) => self.lost.push(i),
                Kind::Nameless => {}
            }
        }
        self.ledger.rows.push(line);
        Ok(())
    }

    /// The number in a cell; not a number where it is missing.
    fn number(&mut self, cell: &str, column: usize, line: usize) -> Result<f64> {
        let own = &self.table.columns[column];
        let Some(found) = cell::read(cell, &own.unit)? else {
            if !cell.is_empty() {
                *self.ledger.missing.entry(cell.to_string()).or_default() += 1;
            }
            return Ok(f64::NAN);
        };
        let header = own.header();
        if found.has_unit {
            self.own_units.entry(header.clone()).or_insert((0, format!("'{cell}' in line {line}"))).0 += 1;
        }
        match found.mark {
            Some(mark) => self.agree(mark, header, cell, line)?,
            // Four digits in a row: thousands are not set apart.
            None => self.marks.is_known |= cell.len() > 3 && cell.trim_start_matches('-').chars().all(|c| c.is_ascii_digit()),
        }
        Ok(found.value)
    }

    /// Holds a decimal mark against the first of the file.
    fn agree(&mut self, mark: char, header: String, cell: &str, line: usize) -> Result<()> {
        if mark == ',' {
            let is_open = cell.split_once(',').is_some_and(|(whole, decimals)| {
                let whole = whole.trim_start_matches(['-', '+']);
                decimals.len() == 3 && (1..=3).contains(&whole.len()) && !whole.starts_with('0')
            });
            self.marks.is_known |= !is_open;
            if is_open && self.marks.open.is_none() {
                self.marks.open = Some((line, header, cell.to_string()));
            }
        }
        match self.marks.first {
            Some((own, _)) if own == mark => Ok(()),
            Some((own, first)) => {
                let error = Error::input(format!("the decimal mark is '{mark}' here and '{own}' in line {first}")).read(cell);
                Err(error.help("write all numbers with one decimal mark, and without thousands separators"))
            }
            None => {
                if mark == ',' {
                    let thousands = self.layout.delimiter == ',' && cell.split_once(',').is_some_and(|(_, decimals)| decimals.len() == 3);
                    if thousands {
                        return Err(thousands_or_decimals(cell));
                    }
                    self.ledger.assumed.push(format!("numbers have decimal commas ('{cell}' in line {line})"));
                }
                self.marks.first = Some((mark, line));
                Ok(())
            }
        }
    }

    /// The table, its account, and line and number of the announcement of condition columns.
    ///
    /// # Errors
    /// All commas of the numbers may as well set thousands apart.
    pub(crate) fn end(mut self) -> Result<(Table, Ledger, Option<Announced>)> {
        self.judge_pending()?;
        // Files with ';' between cells have decimal commas as a rule.
        if let Some((line, header, cell)) = self.marks.open.take().filter(|_| self.layout.delimiter != ';' && !self.marks.is_known) {
            return Err(thousands_or_decimals(&cell).at_line(line).at_key(header));
        }
        for i in self.lost {
            self.ledger.assumed.push(format!("column {} has no name and was left out", i + 1));
        }
        for (header, (count, first)) in self.own_units {
            let cells = if count == 1 { "1 number has".into() } else { format!("{count} numbers have") };
            self.ledger.assumed.push(format!("{cells} a unit in the cells of '{header}' ({first}): read in it"));
        }
        for (mark, lines) in self.marked_rows {
            let (line, begins, is) = if lines.len() == 1 { ("line", "begins", "it is") } else { ("lines", "begin", "they are") };
            let lines = listed(&lines);
            self.ledger.noted.push(format!("{line} {lines} {begins} with '{mark}' and a row's number of cells: {is} taken in"));
        }
        Ok((self.table, self.ledger, self.inputs))
    }

    /// Leaves out statistics and words below the last row; a row that only bears the name of a statistic is taken in.
    fn judge_pending(&mut self) -> Result<()> {
        let pending = std::mem::take(&mut self.pending);
        let last = pending.iter().rposition(|own| own.statistic.is_some_and(|statistic| !self.holds(statistic, &own.cells)));
        let rows = self.table.rows();
        for (n, Pending { line, cells, statistic }) in pending.into_iter().enumerate() {
            match statistic {
                _ if last.is_some_and(|last| n <= last) => {
                    self.take_row(line, &cells).map_err(|e| e.at_line(line))?;
                    let first = &cells[0];
                    let what = format!("line {line} is called '{first}' and does not hold that of the {rows} rows above: it is taken in");
                    self.ledger.noted.push(what);
                }
                Some(_) => self.ledger.leave_out("a statistic of the rows above", line),
                None => self.ledger.leave_out("words below the last row", line),
            }
        }
        Ok(())
    }

    /// Whether all numbers of a record are a statistic of the rows above; without any row of text in front there is no other reading.
    fn holds(&self, statistic: Statistic, cells: &[String]) -> bool {
        if matches!(self.kinds[0], Kind::Number(_)) {
            return true;
        }
        let mut numbers = cells.iter().zip(&self.kinds).filter_map(|(cell, kind)| match kind {
            Kind::Number(c) => Some((cell, &self.table.columns[*c])).filter(|(cell, _)| !is_missing(cell)),
            _ => None,
        });
        numbers.all(|(cell, column)| {
            let number = cell::read(cell, &column.unit).ok().flatten();
            number.is_some_and(|number| statistic.is_of(&column.values, number.value, last_digit(cell)))
        })
    }
}

/// Whether one cell alone is filled, with words.
fn is_words(filled: &[&String]) -> bool {
    matches!(filled, [cell] if !is_missing(cell) && cell.chars().any(char::is_alphabetic) && cell.replace(',', ".").parse::<f64>().is_err())
}

fn thousands_or_decimals(cell: &str) -> Error {
    let error = Error::input("the comma of this number may be a decimal mark or set thousands apart").read(cell);
    error.help("write numbers with a decimal point and without thousands separators")
}

fn header_cell(table: &mut Table, text: &str) -> Result<Kind> {
    if text.is_empty() {
        return Ok(Kind::Nameless);
    }
    let with_unit = text.strip_suffix(']').and_then(|t| t.rsplit_once('['));
    let Some((name, unit)) = with_unit else {
        table.texts.push(TextColumn { name: text.to_string(), values: Vec::new() });
        return Ok(Kind::Text(table.texts.len() - 1));
    };
    let (name, unit) = (name.trim().to_string(), unit.trim().to_string());
    if name.is_empty() || unit.is_empty() {
        let error = Error::input("a column lacks its name or its unit").read(text);
        return Err(error.help("write name [unit]; the unit of a pure number is [1]"));
    }
    table.columns.push(Column { name, unit, values: Vec::new() });
    Ok(Kind::Number(table.columns.len() - 1))
}
