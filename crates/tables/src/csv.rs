//! Tables as CSV: `# key: value` lines of provenance, a header `name [unit]`, rows (RFC 4180 quoting).
//!
//! The reader is written by hand for the sake of units in headers, provenance lines, and errors with line and column.
//! Values are written with all digits needed to read back bit for bit.

use std::path::Path;

use super::{Column, Table, TextColumn};
use coldplate_base::condition;
use coldplate_base::error::{Error, Result, did_you_mean};

/// Provenance key of the number of condition variables among the number columns.
const INPUTS: &str = "inputs";

impl Table {
    /// The table as CSV.
    ///
    /// # Errors
    /// Errors of [`Table::check`].
    pub fn to_csv(&self) -> Result<String> {
        self.check()?;
        let mut text = String::new();
        for (key, value) in &self.provenance {
            text += &format!("# {}: {}\n", one_line(key), one_line(value));
        }
        text += &format!("# {INPUTS}: {}\n", self.inputs);
        let headers: Vec<String> =
            self.texts.iter().map(|t| quoted(&t.name)).chain(self.columns.iter().map(|c| quoted(&c.header()))).collect();
        text += &(headers.join(",") + "\n");
        for row in 0..self.rows() {
            let texts = self.texts.iter().map(|t| quoted(&t.values[row]));
            let cells: Vec<String> = texts.chain(self.columns.iter().map(|c| number(c.values[row]))).collect();
            // An empty line would not count as a row.
            text += &(if cells == [""] { "\"\"".to_string() } else { cells.join(",") } + "\n");
        }
        Ok(text)
    }

    /// Reads CSV text; `file` is the name used in errors.
    ///
    /// A column with a unit in its header holds numbers, one without holds text. The condition variables are the first
    /// N number columns if there is a line `# inputs: N`, otherwise the columns named in [`condition::NAMES`].
    ///
    /// # Errors
    /// No header, a row with too many or too few cells, a cell that is not a number; each names line and column.
    pub fn from_csv(text: &str, file: impl AsRef<Path>) -> Result<Table> {
        let file = file.as_ref();
        let mut table = Table::default();
        let mut inputs = None;
        let mut header: Option<Vec<Kind>> = None;
        for record in CsvRecords::new(text.strip_prefix('\u{feff}').unwrap_or(text)) {
            let Record { line, cells, comment } = record.map_err(|e| e.in_file(file))?;
            if let Some(comment) = comment {
                let Some((key, value)) = comment.split_once(':').map(|(k, v)| (k.trim(), v.trim())) else { continue };
                if key != INPUTS && value.parse::<usize>().is_ok() && did_you_mean(key, [INPUTS]).is_some() {
                    let error =
                        Error::input("this line is not known, and looks like one that is").in_file(file).at_line(line).read(comment);
                    return Err(error.help(format!("did you mean '# {INPUTS}: {value}'? It says how many columns are conditions")));
                }
                if key == INPUTS {
                    let count = value.parse().map_err(|_| {
                        Error::input("the number of condition columns is not a number")
                            .in_file(file)
                            .at_line(line)
                            .at_key(INPUTS)
                            .read(value)
                    })?;
                    if let Some((before, other)) = inputs.filter(|(_, other)| *other != count) {
                        let what = format!("{count} condition columns are announced, and {other} in line {before}");
                        return Err(Error::input(what).in_file(file).at_line(line).at_key(INPUTS).help("keep the line that is true"));
                    }
                    inputs = Some((line, count));
                } else if header.is_none() {
                    table.provenance.push((key.to_string(), value.to_string()));
                }
                continue;
            }
            match &header {
                None => header = Some(read_header(&mut table, &cells).map_err(|e| e.in_file(file).at_line(line))?),
                Some(kinds) => read_row(&mut table, kinds, &cells).map_err(|e| e.in_file(file).at_line(line))?,
            }
        }
        if header.is_none() {
            return Err(Error::input("the file holds no table")
                .in_file(file)
                .help("the first line is the header: name [unit], name [unit], ..."));
        }
        table.check().map_err(|e| e.in_file(file))?;
        match inputs {
            Some((line, count)) if count > table.columns.len() => {
                return Err(Error::input(format!(
                    "{count} condition columns are announced, but there are {} columns",
                    table.columns.len()
                ))
                .in_file(file)
                .at_line(line)
                .at_key(INPUTS));
            }
            Some((line, count)) => {
                if let Some(column) = table.columns[count..].iter().find(|c| condition::NAMES.contains(&c.name.as_str())) {
                    let what = format!("the first {count} columns are announced as conditions, and '{}' stands behind them", column.name);
                    let error = Error::input(what).in_file(file).at_line(line).at_key(INPUTS);
                    return Err(error.help("count it in, or leave the line out: the four usual conditions are known by their names"));
                }
                table.inputs = count;
            }
            None => table.usual_inputs(),
        }
        Ok(table)
    }

    /// Line numbers in CSV text: of the header, then of every row up to the first unreadable one.
    pub fn csv_lines(text: &str) -> Vec<usize> {
        let records = CsvRecords::new(text.strip_prefix('\u{feff}').unwrap_or(text));
        records.map_while(Result::ok).filter(|record| record.comment.is_none()).map(|record| record.line).collect()
    }
}

/// Kind of a column: the place its cells are stored in.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Text(usize),
    Number(usize),
}

fn read_header(table: &mut Table, cells: &[String]) -> Result<Vec<Kind>> {
    if let [only] = cells
        && only.contains(';')
    {
        return Err(Error::input("the columns are separated by semicolons")
            .read(only)
            .help("separate them by commas, with a decimal point"));
    }
    cells.iter().enumerate().map(|(i, cell)| header_cell(table, cell).map_err(|e| e.at_key(format!("column {}", i + 1)))).collect()
}

fn header_cell(table: &mut Table, text: &str) -> Result<Kind> {
    if text.is_empty() {
        return Err(Error::input("a column has no name").help("name every column: name [unit]"));
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

fn read_row(table: &mut Table, kinds: &[Kind], cells: &[String]) -> Result<()> {
    if cells.len() != kinds.len() {
        return Err(Error::input(format!("the row has {} cells, the header has {}", cells.len(), kinds.len()))
            .help("give every column a cell; leave it empty where the reading is missing"));
    }
    for (kind, cell) in kinds.iter().zip(cells) {
        match *kind {
            Kind::Text(t) => table.texts[t].values.push(cell.clone()),
            Kind::Number(c) => {
                let value = read_number(cell).map_err(|e| e.at_key(table.columns[c].header()))?;
                table.columns[c].values.push(value);
            }
        }
    }
    Ok(())
}

fn read_number(cell: &str) -> Result<f64> {
    if cell.is_empty() || ["nan", "na", "null"].iter().any(|missing| cell.eq_ignore_ascii_case(missing)) {
        return Ok(f64::NAN);
    }
    match cell.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(Error::input("the number is not finite").read(cell).help("leave the cell empty where the reading is missing")),
        Err(_) => {
            Err(Error::input("no number can be read here").read(cell).help("write it with a decimal point; the unit stands in the header"))
        }
    }
}

/// The shortest text that reads back as the same number; empty for a missing one.
fn number(value: f64) -> String {
    match value.abs() {
        _ if value.is_nan() => String::new(),
        0.0 | 1e-4..1e16 => format!("{value}"),
        _ => format!("{value:e}"),
    }
}

fn one_line(text: &str) -> String {
    text.split(['\r', '\n']).map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ")
}

/// A cell of a CSV file, in quotes if it needs them.
pub fn quoted(text: &str) -> String {
    let plain = !text.contains([',', '"', '\n', '\r']) && !text.starts_with(['#', '\u{feff}']) && text.trim() == text;
    if plain { text.to_string() } else { format!("\"{}\"", text.replace('"', "\"\"")) }
}

/// Cells of the first row of CSV text; none if it is a remark.
///
/// # Errors
/// A quoted cell that is never closed, or has text behind its end.
pub fn cells(text: &str) -> Result<Vec<String>> {
    CsvRecords::new(text).next().map_or(Ok(Vec::new()), |record| record.map(|record| record.cells))
}

struct Record<'a> {
    line: usize,
    cells: Vec<String>,
    comment: Option<&'a str>,
}

/// Splits text into records, skipping empty lines; quoted cells may hold line ends.
struct CsvRecords<'a> {
    rest: &'a str,
    line: usize,
}

impl<'a> CsvRecords<'a> {
    fn new(text: &'a str) -> Self {
        Self { rest: text, line: 0 }
    }

    fn next_line(&mut self) -> Option<&'a str> {
        if self.rest.is_empty() {
            return None;
        }
        let (line, rest) = self.rest.split_once('\n').unwrap_or((self.rest, ""));
        (self.rest, self.line) = (rest, self.line + 1);
        Some(line.strip_suffix('\r').unwrap_or(line))
    }

    /// The cells of a row that starts with `first`; an open quote continues the row on the next line.
    fn cells(&mut self, first: &'a str) -> Result<Vec<String>> {
        let start = self.line;
        let mut cells = Vec::new();
        let mut rest = first.trim_start();
        loop {
            let Some(mut inside) = rest.strip_prefix('"') else {
                let (cell, after) = rest.split_once(',').map_or((rest, None), |(cell, after)| (cell, Some(after)));
                cells.push(cell.trim().to_string());
                let Some(after) = after else { return Ok(cells) };
                rest = after.trim_start();
                continue;
            };
            let mut text = String::new();
            let after = loop {
                let Some(end) = inside.find('"') else {
                    text += inside;
                    text.push('\n');
                    inside = self.next_line().ok_or_else(|| {
                        Error::input("a quoted cell is never closed")
                            .at_line(start)
                            .help("close it with a quote; write a quote inside it twice")
                    })?;
                    continue;
                };
                text += &inside[..end];
                match inside[end + 1..].strip_prefix('"') {
                    Some(more) => (text, inside) = (text + "\"", more),
                    None => break inside[end + 1..].trim_start(),
                }
            };
            cells.push(text);
            if after.is_empty() {
                return Ok(cells);
            }
            rest = after
                .strip_prefix(',')
                .ok_or_else(|| {
                    Error::input("text stands behind a closing quote").at_line(self.line).read(after).help("quote the whole cell")
                })?
                .trim_start();
        }
    }
}

impl<'a> Iterator for CsvRecords<'a> {
    type Item = Result<Record<'a>>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let text = self.next_line()?;
            let line = self.line;
            if text.trim().is_empty() {
                continue;
            }
            if let Some(comment) = text.trim_start().strip_prefix('#') {
                return Some(Ok(Record { line, cells: Vec::new(), comment: Some(comment.trim()) }));
            }
            return Some(self.cells(text).map(|cells| Record { line, cells, comment: None }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerates_what_spreadsheets_write() {
        let text =
            "\u{feff}# machine: rig\r\n\r\n motor [degC] , \"coolant_flow [L/min]\",note\r\n 21.5 , 9.42 ,\"two\r\nlines\"\r\n,4.71,";
        let table = Table::from_csv(text, "x.csv").unwrap();
        assert_eq!(table.provenance, [("machine".to_string(), "rig".to_string())]);
        assert_eq!((table.inputs, table.columns[0].name.as_str(), table.rows()), (1, "coolant_flow", 2));
        assert_eq!(table.columns[0].values, [9.42, 4.71]);
        assert!(table.columns[1].values[1].is_nan());
        assert_eq!(table.texts[0].values, ["two\nlines", ""]);
    }

    #[test]
    fn mistakes_name_line_column_and_value() {
        for (text, needles) in [
            ("# a: b\nx [K], y [K]\n1,2\n1,2;5\n", &["f.csv:4", "y [K]", "2;5"][..]),
            ("x [K], y [K]\n1\n", &["f.csv:2", "1 cells"]),
            ("x [K]\ninf\n", &["f.csv:2", "not finite", "inf"]),
            ("x [K], x [K]\n1,2\n", &["two columns are called 'x'"]),
            ("x [K];y [K]\n", &["semicolons"]),
            ("x [], y [K]\n", &["f.csv:1", "column 1"]),
            ("x [K]\n\"1\n", &["f.csv:2", "never closed"]),
            ("# only: this\n", &["no table"]),
            ("# inputs: 3\nx [K]\n1\n", &["f.csv:1", "3 condition columns"]),
            ("# inputs: 1\n# inputs: 2\nx [K],y [K]\n1,2\n", &["f.csv:2", "1 in line 1"]),
            ("# inptus: 1\nx [K],y [K]\n1,2\n", &["f.csv:1", "did you mean '# inputs: 1'"]),
            ("# inputs: 1\nx [K],motor_speed [rpm]\n1,2\n", &["f.csv:1", "'motor_speed' stands behind"]),
        ] {
            let message = Table::from_csv(text, "f.csv").unwrap_err().to_string();
            for needle in needles {
                assert!(message.contains(needle), "{text:?}: {message}");
            }
        }
    }
}
