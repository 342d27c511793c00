//! How a table lies in a text file: delimiter, header, units, first row.

use std::collections::BTreeMap;
use std::path::Path;

use crate::header::{is_header, is_time, is_units, rejoined, split_between, split_unit, unit_of_time};
use crate::ledger::{ABOVE, Ledger};
use crate::records::{CsvRecords, Record, remark};
use crate::stamps::{TIME, is_stamp};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{dimension_of, spelled};

/// Delimiters; of two that explain the file alike, the first is taken.
pub(crate) const DELIMITERS: [char; 4] = [',', ';', '\t', '|'];
/// Records at the beginning of a file by which its layout is recognised, a count. Chosen: longer than the preambles of loggers.
const SAMPLE: usize = 200;
/// First cell of the headers of Campbell's loggers (LoggerNet manual, appendix B): names stand in the second line, units in the third,
/// the kind of statistic in the fourth.
const TOA5: &str = "TOA5";

/// Layout of a table in a text file.
#[derive(Debug)]
pub(crate) struct Layout {
    /// Character between cells.
    pub delimiter: char,
    /// Cells of the header, each `name [unit]` or a name alone.
    pub header: Vec<String>,
    /// Line of the header.
    pub header_line: usize,
    /// Last line above the first row.
    pub last_line: usize,
    /// Lines of names and units as they stand in the file: further copies of them are no rows.
    pub written: Vec<Vec<String>>,
}

/// A record of the sample that is no remark.
struct Sampled {
    line: usize,
    cells: Vec<String>,
}

impl Layout {
    /// Recognises the layout of `text`.
    ///
    /// # Errors
    /// The text has no header, or a quoted cell is never closed.
    pub(crate) fn of(text: &str, file: &Path, ledger: &mut Ledger) -> Result<Self> {
        let stated =
            text.lines().next().and_then(|line| line.strip_prefix("sep=")).and_then(|rest| rest.trim_end_matches('\r').chars().next());
        let candidates = stated.map_or(DELIMITERS.to_vec(), |delimiter| vec![delimiter]);
        let samples: Vec<(char, Result<Vec<Sampled>>)> = candidates.iter().map(|d| (*d, sample(text, *d, stated.is_some()))).collect();
        let share = |records: &Result<Vec<Sampled>>| records.as_ref().map_or(0, |records| usual_count(records).1);
        // The last of equals would win.
        let best = samples.into_iter().rev().max_by_key(|(_, records)| share(records));
        let (delimiter, records) = best.map_or((',', Ok(Vec::new())), |best| best);
        let records = records.map_err(|e| e.in_file(file))?;
        if delimiter != ',' {
            let name = if delimiter == '\t' { "tabs".into() } else { format!("'{delimiter}'") };
            ledger.assumed.push(format!("cells are separated by {name}"));
        }
        if stated.is_some() {
            ledger.leave_out(ABOVE, 1);
        }
        if records.first().is_some_and(|first| first.cells.first().is_some_and(|cell| cell == TOA5)) {
            return Self::of_toa5(&records, delimiter, file, ledger);
        }
        let (count, _) = usual_count(&records);
        let place = records.iter().position(|r| r.cells.len() == count && is_header(&r.cells));
        let Some(place) = place.or_else(|| records.first().filter(|first| is_header(&first.cells)).map(|_| 0)) else {
            return Self::behind_hash(text, delimiter, &records, count, file, ledger);
        };
        for above in &records[..place] {
            ledger.leave_out(ABOVE, above.line);
        }
        let own = &records[place];
        let mut layout = Self::with(delimiter, own.cells.clone(), own.line);
        let has_units = own.cells.iter().any(|cell| split_unit(cell).is_some());
        if let Some(units) =
            records.get(place + 1).filter(|next| !has_units && is_units(&next.cells) && next.cells.len() == own.cells.len())
        {
            layout.join_units(&units.cells, units.line);
            ledger.assumed.push(format!("line {} holds the units of the columns", units.line));
        }
        layout.spell(ledger);
        if let Some(first) = records.iter().find(|r| r.line > layout.last_line) {
            layout.unit_of_stamps(&first.cells, ledger);
            layout.name_of_times(&first.cells, ledger);
        }
        Ok(layout)
    }

    fn with(delimiter: char, header: Vec<String>, line: usize) -> Self {
        Self { delimiter, written: vec![header.clone()], header, header_line: line, last_line: line }
    }

    /// Makes a column of numbers whose name is a unit of time the column of times, if there is no other.
    fn name_of_times(&mut self, first: &[String], ledger: &mut Ledger) {
        let is_other = |(header, cell): (&String, &String)| {
            let is_named = split_unit(header).is_some_and(|(name, unit, _)| name.eq_ignore_ascii_case(TIME) || is_time(unit));
            is_named || (is_stamp(cell) && cell.parse::<f64>().is_err())
        };
        if self.header.iter().zip(first).any(is_other) {
            return;
        }
        let is_number = |cell: &String| cell.replace(',', ".").parse::<f64>().is_ok();
        let found =
            self.header.iter_mut().zip(first).find_map(|(header, cell)| Some((unit_of_time(header)?, header)).filter(|_| is_number(cell)));
        if let Some((unit, header)) = found {
            let new = format!("{TIME} [{unit}]");
            ledger.assumed.push(format!("column '{header}' is read as '{new}'"));
            *header = new;
        }
    }

    /// Takes the unit off a column of times that holds dates.
    fn unit_of_stamps(&mut self, first: &[String], ledger: &mut Ledger) {
        for (header, cell) in self.header.iter_mut().zip(first) {
            let Some((name, unit, _)) = split_unit(header) else { continue };
            if is_time(unit) && is_stamp(cell) && cell.parse::<f64>().is_err() {
                ledger.assumed.push(format!("column '{header}' holds dates: its unit is not looked at"));
                *header = name.to_string();
            }
        }
    }

    fn of_toa5(records: &[Sampled], delimiter: char, file: &Path, ledger: &mut Ledger) -> Result<Self> {
        let [first, names, units, kinds, ..] = records else {
            return Err(Error::input("the file ends within its header (TOA5: four lines)").in_file(file));
        };
        if names.cells.len() != units.cells.len() {
            return Err(Error::input("the lines of names and units differ in their number of cells").in_file(file).at_line(units.line));
        }
        ledger.assumed.push("the file is a logger's (TOA5): names in its second line, units in its third".into());
        ledger.leave_out(ABOVE, first.line);
        let mut layout = Self::with(delimiter, names.cells.clone(), names.line);
        layout.join_units(&units.cells, kinds.line);
        layout.spell(ledger);
        Ok(layout)
    }

    /// A header that begins like a remark, as some programs write it: the last remark above the first row, if it has as many cells.
    fn behind_hash(text: &str, delimiter: char, records: &[Sampled], count: usize, file: &Path, ledger: &mut Ledger) -> Result<Self> {
        let Some(first) = records.first() else {
            return Err(Error::input("the file holds no table")
                .in_file(file)
                .help("the first line is the header: name [unit], name [unit], ..."));
        };
        let remarks = text.lines().enumerate().take(first.line).filter_map(|(n, line)| Some((n + 1, remark(line)?)));
        let last = remarks.last().and_then(|(line, (mark, rest))| {
            let cells = rejoined(CsvRecords::new(rest, delimiter).next()?.ok()?.cells);
            (cells.len() == count && is_header(&cells)).then_some((line, mark, cells))
        });
        let Some((line, mark, header)) = last else {
            let error = Error::input("the file has no header: its first line holds numbers").in_file(file).at_line(first.line);
            return Err(error
                .read(first.cells.join(","))
                .help("write a first line with the names of the columns: name [unit], name [unit], ..."));
        };
        ledger.assumed.push(format!("line {line} begins with '{mark}' and is the header: its first column is '{}'", header[0]));
        let mut layout = Self::with(delimiter, header, line);
        layout.spell(ledger);
        Ok(layout)
    }

    fn join_units(&mut self, units: &[String], last_line: usize) {
        for (name, unit) in self.header.iter_mut().zip(units) {
            if let Some(unit) = spelled(unit) {
                *name = format!("{name} [{unit}]");
            }
        }
        self.written.push(units.to_vec());
        self.last_line = last_line;
    }

    /// Writes every unit in square brackets and in the spelling of the files; says so where letters change.
    fn spell(&mut self, ledger: &mut Ledger) {
        let mut read = Vec::new();
        for cell in &mut self.header {
            let Some((name, stated, bracket)) = split_unit(cell) else { continue };
            let (unit, between) = split_between(stated);
            if let Some(held) = between {
                ledger.between.push((name.to_string(), held));
            }
            let Some(own) = spelled(unit) else { continue };
            if own != stated || bracket != '[' {
                let new = format!("{name} [{own}]");
                // Characters that look alike are no assumption.
                if bracket != '[' || between.is_some() || dimension_of(unit).is_err() {
                    read.push(format!("'{cell}' as '{new}'"));
                }
                *cell = new;
            }
        }
        if !read.is_empty() {
            ledger.assumed.push(format!("columns are read: {}", read.join(", ")));
        }
    }
}

fn sample(text: &str, delimiter: char, skips_first: bool) -> Result<Vec<Sampled>> {
    let records =
        CsvRecords::new(text, delimiter).skip(usize::from(skips_first)).filter(|r| r.as_ref().map_or(true, |r| r.comment.is_none()));
    records.take(SAMPLE).map(|record| record.map(|Record { line, cells, .. }| Sampled { line, cells: rejoined(cells) })).collect()
}

/// The most frequent number of cells, and how many records have it; more than one cell is a table.
fn usual_count(records: &[Sampled]) -> (usize, usize) {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    for record in records {
        *counts.entry(record.cells.len()).or_default() += 1;
    }
    let (count, times) = counts.into_iter().max_by_key(|(count, times)| (*times, *count)).unwrap_or((1, 0));
    (count, if count > 1 { times } else { 0 })
}
