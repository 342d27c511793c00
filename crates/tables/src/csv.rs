//! Tables as CSV: `# key: value` lines of provenance, a header `name [unit]`, rows (RFC 4180 quoting).
//!
//! The reader is written by hand for the sake of units in headers, provenance lines, and errors with line and column.
//! Values are written with all digits needed to read back bit for bit.

use std::path::Path;

use super::{Column, Ledger, Table, TextColumn};
use crate::layout::Layout;
use crate::ledger::{BLANK, REMARK, listed};
use crate::records::{CsvRecords, Record};
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

    /// Reads plain CSV text; `file` is the name used in errors.
    ///
    /// A column with a unit in its header holds numbers, one without holds text. The condition variables are the first
    /// N number columns if there is a line `# inputs: N`, otherwise the columns named in [`condition::NAMES`].
    ///
    /// # Errors
    /// Errors of [`Table::from_text`]; something had to be assumed.
    pub fn from_csv(text: &str, file: impl AsRef<Path>) -> Result<Table> {
        let (table, ledger) = Self::from_text(text, file.as_ref(), Ledger::default())?;
        table.plain(&ledger, file.as_ref())
    }

    /// Reads text as loggers and spreadsheets write it, with an account of its lines; `file` is the name used in errors.
    ///
    /// # Errors
    /// No header, a row with too many or too few cells, a cell that is not a number; each names line and column.
    pub fn from_text(text: &str, file: &Path, mut ledger: Ledger) -> Result<(Table, Ledger)> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let layout = Layout::of(text, file, &mut ledger)?;
        ledger.header = layout.header_line;
        ledger.lines = text.lines().count();
        let mut reader = Reader::new(&layout, ledger).map_err(|e| e.in_file(file).at_line(layout.header_line))?;
        let is_cut_off = !text.ends_with('\n');
        let mut lines = 0;
        for record in CsvRecords::new(text, layout.delimiter) {
            let record = record.map_err(|e| e.in_file(file))?;
            (lines + 1..record.line).for_each(|blank| reader.ledger.leave_out(BLANK, blank));
            lines = record.last_line;
            let is_last = is_cut_off && lines == reader.ledger.lines;
            let line = record.line;
            reader.take(record, is_last).map_err(|e| e.in_file(file).at_line(line))?;
        }
        let (mut table, mut ledger, inputs) = reader.end();
        (lines + 1..=ledger.lines).for_each(|blank| ledger.leave_out(BLANK, blank));
        table.check().map_err(|e| e.in_file(file))?;
        match inputs {
            Some((line, count)) => table.announced(count).map_err(|e| e.in_file(file).at_line(line).at_key(INPUTS))?,
            None => table.usual_inputs(),
        }
        Ok((table, ledger))
    }

    /// Makes the first `count` number columns the condition variables.
    fn announced(&mut self, count: usize) -> Result<()> {
        if count > self.columns.len() {
            return Err(Error::input(format!("{count} condition columns are announced, but there are {} columns", self.columns.len())));
        }
        if let Some(column) = self.columns[count..].iter().find(|c| condition::NAMES.contains(&c.name.as_str())) {
            let what = format!("the first {count} columns are announced as conditions, and '{}' stands behind them", column.name);
            return Err(Error::input(what).help("count it in, or leave the line out: the four usual conditions are known by their names"));
        }
        self.inputs = count;
        Ok(())
    }
}

/// Words that loggers and spreadsheets write where there is no number, in small letters.
const MISSING: [&str; 40] = [
    "nan",
    "na",
    "n/a",
    "n.a.",
    "#n/a",
    "#na",
    "null",
    "#null!",
    "none",
    "nil",
    "ol",
    "o.l.",
    "o/l",
    "+ol",
    "-ol",
    "ovl",
    "ovld",
    "over",
    "overflow",
    "overload",
    "overrange",
    "over range",
    "underrange",
    "under range",
    "open",
    "err",
    "error",
    "fail",
    "failed",
    "fault",
    "bad",
    "invalid",
    "missing",
    "no data",
    "nodata",
    "#num!",
    "#div/0!",
    "#value!",
    "#ref!",
    "#name?",
];

/// Kind of a column: the place its cells are stored in.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Text(usize),
    Number(usize),
    /// A column without a name.
    Nameless,
}

/// Takes records into a table.
struct Reader<'a> {
    layout: &'a Layout,
    table: Table,
    kinds: Vec<Kind>,
    ledger: Ledger,
    /// Line and number of the announcement of condition columns.
    inputs: Option<(usize, usize)>,
    /// Decimal mark of the first number that has one, with its line.
    decimal: Option<(char, usize)>,
    /// Nameless columns that held anything.
    lost: Vec<usize>,
    /// Lines that begin with '#' and were taken as rows.
    hash_rows: Vec<usize>,
}

impl<'a> Reader<'a> {
    fn new(layout: &'a Layout, ledger: Ledger) -> Result<Self> {
        let mut table = Table::default();
        let cells = layout.header.iter().enumerate();
        let kinds = cells
            .map(|(i, cell)| header_cell(&mut table, cell).map_err(|e| e.at_key(format!("column {}", i + 1))))
            .collect::<Result<_>>()?;
        Ok(Self { layout, table, kinds, ledger, inputs: None, decimal: None, lost: Vec::new(), hash_rows: Vec::new() })
    }

    fn take(&mut self, record: Record<'_>, is_last: bool) -> Result<()> {
        let line = record.line;
        if let Some(comment) = record.comment {
            return self.take_comment(line, comment);
        }
        if line <= self.layout.last_line {
            return Ok(());
        }
        if record.cells == self.layout.header || record.cells.iter().zip(&self.layout.header).all(|(a, b)| a == b && !a.is_empty()) {
            self.ledger.leave_out("the header once more", line);
            return Ok(());
        }
        if record.cells.len() < self.kinds.len() && is_last {
            self.ledger.leave_out("the file ends within it", line);
            return Ok(());
        }
        if is_last && let Some(cell) = record.cells.last().filter(|cell| cell.parse::<f64>().is_ok()) {
            self.ledger
                .noted
                .push(format!("the file ends without a line end behind '{cell}' (line {line}): the number may have been cut off"));
        }
        // A header that ends with a delimiter has a nameless last column, which rows may leave out.
        let mut cells = record.cells;
        if cells.len() + 1 == self.kinds.len() && matches!(self.kinds.last(), Some(Kind::Nameless)) {
            cells.push(String::new());
        }
        self.take_row(line, &cells)
    }

    /// A line behind '#': a remark, a line of provenance, or a row whose first cell begins so.
    fn take_comment(&mut self, line: usize, comment: &str) -> Result<()> {
        if line == self.layout.header_line {
            return Ok(());
        }
        if line > self.layout.last_line {
            let whole = format!("#{comment}");
            let cells = CsvRecords::row(&whole, self.layout.delimiter).filter(|cells| cells.len() == self.kinds.len() && cells.len() > 1);
            if let Some(cells) = cells {
                if matches!(self.kinds[0], Kind::Text(_)) {
                    self.hash_rows.push(line);
                    return self.take_row(line, &cells);
                }
                if is_missing(&cells[0]) {
                    return self.take_row(line, &cells);
                }
            }
            self.ledger.leave_out(REMARK, line);
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
                    let value = self.number(cell, line).map_err(|e| e.at_key(self.table.columns[c].header()))?;
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
    fn number(&mut self, cell: &str, line: usize) -> Result<f64> {
        if is_missing(cell) {
            if !cell.is_empty() {
                *self.ledger.missing.entry(cell.to_string()).or_default() += 1;
            }
            return Ok(f64::NAN);
        }
        let mark = [',', '.'].into_iter().find(|mark| cell.contains(*mark));
        let point = match mark {
            Some(',') => {
                if cell.contains('.') || cell.matches(',').count() > 1 {
                    return Err(Error::input("thousands are set apart in this number")
                        .read(cell)
                        .help("write numbers without thousands separators"));
                }
                cell.replacen(',', ".", 1)
            }
            _ => cell.to_string(),
        };
        let value = match point.parse::<f64>() {
            Ok(value) if value.is_finite() => value,
            Ok(_) => {
                return Err(Error::input("the number is not finite").read(cell).help("leave the cell empty where the reading is missing"));
            }
            Err(_) => {
                let error = Error::input("no number can be read here").read(cell);
                return Err(error.help("write it with a decimal point; the unit stands in the header"));
            }
        };
        if let Some(mark) = mark {
            self.agree(mark, cell, line)?;
        }
        Ok(value)
    }

    /// Holds a decimal mark against the first of the file.
    fn agree(&mut self, mark: char, cell: &str, line: usize) -> Result<()> {
        match self.decimal {
            Some((own, _)) if own == mark => Ok(()),
            Some((own, first)) => {
                let error = Error::input(format!("the decimal mark is '{mark}' here and '{own}' in line {first}")).read(cell);
                Err(error.help("write all numbers with one decimal mark"))
            }
            None => {
                if mark == ',' {
                    let thousands = self.layout.delimiter == ',' && cell.split_once(',').is_some_and(|(_, decimals)| decimals.len() == 3);
                    if thousands {
                        let error = Error::input("the comma of this number may be a decimal mark or set thousands apart").read(cell);
                        return Err(error.help("write numbers with a decimal point and without thousands separators"));
                    }
                    self.ledger.assumed.push(format!("numbers have decimal commas ('{cell}' in line {line})"));
                }
                self.decimal = Some((mark, line));
                Ok(())
            }
        }
    }

    fn end(mut self) -> (Table, Ledger, Option<(usize, usize)>) {
        for i in self.lost {
            self.ledger.assumed.push(format!("column {} has no name and was left out", i + 1));
        }
        if !self.hash_rows.is_empty() {
            let (line, begins, is) = if self.hash_rows.len() == 1 { ("line", "begins", "it is") } else { ("lines", "begin", "they are") };
            let lines = listed(&self.hash_rows);
            self.ledger.noted.push(format!("{line} {lines} {begins} with '#' and a row's number of cells: {is} taken in"));
        }
        (self.table, self.ledger, self.inputs)
    }
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

/// Whether a cell says that there is no number: it is empty, holds signs alone, or one of [`MISSING`].
fn is_missing(cell: &str) -> bool {
    cell.chars().all(|c| matches!(c, '-' | '*' | '?' | '#' | '.' | '_' | '\u{2013}' | '\u{2014}'))
        || MISSING.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// The shortest text that reads back as the same number; empty for a missing one.
pub(crate) fn number(value: f64) -> String {
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
    CsvRecords::new(text, ',').next().map_or(Ok(Vec::new()), |record| record.map(|record| record.cells))
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
            ("x [K];y [K]\n", &["separated by ';'"]),
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

    fn lenient(text: &str) -> (Table, Ledger) {
        Table::from_text(text, Path::new("f.csv"), Ledger::default()).unwrap_or_else(|e| panic!("{text:?}: {e}"))
    }

    #[test]
    fn semicolons_tabs_and_decimal_commas_are_read_and_said() {
        for text in ["a [K];b [K]\n1,5;2\n3;4,25\n", "a [K]\tb [K]\n1,5\t2\n3\t4,25\n", "sep=;\na [K];b [K]\n1,5;2\n3;4,25\n"] {
            let (table, ledger) = lenient(text);
            assert_eq!((&table.columns[0].values[..], &table.columns[1].values[..]), (&[1.5, 3.0][..], &[2.0, 4.25][..]), "{text:?}");
            assert!(ledger.assumed.iter().any(|s| s.contains("decimal commas")), "{:?}", ledger.assumed);
            assert!(Table::from_csv(text, "f.csv").unwrap_err().to_string().contains("not plain"));
        }
        for (text, needle) in [
            ("a [K],b [K]\n1,5,2,5\n3,4,4,5\n", "separate the columns by ';'"),
            ("a [K],b [K]\n\"1,500\",2\n", "set thousands apart"),
            ("a [K],b [K]\n\"1,030.02\",2\n", "thousands"),
            ("a [K];b [K]\n1,5;2\n1.5;2\n", "the decimal mark is '.' here and ',' in line 2"),
        ] {
            let message = Table::from_text(text, Path::new("f.csv"), Ledger::default()).unwrap_err().to_string();
            assert!(message.contains(needle), "{text:?}: {message}");
        }
    }

    #[test]
    fn headers_of_loggers_are_found() {
        let (table, ledger) = lenient("Logger 7\nserial: 12\n\ntime [s],motor [degC]\n0,20\n5,21\n");
        assert_eq!((table.rows(), &ledger.rows[..], ledger.header), (2, &[5, 6][..], 4));
        assert_eq!(ledger.left_out["above the header"], [1, 2]);
        let (table, _) = lenient("test,heater,motor\n,W,Deg C\n1,10,30.02\n");
        assert_eq!((table.columns[0].header().as_str(), table.columns[1].header().as_str()), ("heater [W]", "motor [degC]"));
        let toa5 = "\"TOA5\",\"x\"\n\"TIMESTAMP\",\"RECORD\",\"motor\"\n\"TS\",\"RN\",\"Deg C\"\n\"\",\"\",\"Avg\"\n\"2024-05-01 10:00:00\",0,30.02\n\"2024-05-01 10:01:00\",1,\"NAN\"\n";
        let (mut table, mut ledger) = lenient(toa5);
        table.read_stamps(&mut ledger, None).unwrap();
        assert_eq!(table.column("time").unwrap().values, [0.0, 60.0]);
        assert!(table.column("motor").unwrap().values[1].is_nan());
        let (table, ledger) = lenient("#test,motor [degC]\n1,20\n2,21\n");
        assert_eq!((table.rows(), table.texts[0].name.as_str()), (2, "test"));
        assert!(ledger.assumed[0].contains("begins with '#'"));
        let (table, _) = lenient("time (s),motor (°C),\n0,20,\n5,21\n");
        assert_eq!(table.columns[1].header(), "motor [°C]");
        let none = Table::from_text("1,20\n2,21\n", Path::new("f.csv"), Ledger::default()).unwrap_err().to_string();
        assert!(none.contains("no header"), "{none}");
    }

    #[test]
    fn no_line_vanishes() {
        let (table, ledger) = lenient("test,motor [degC]\n1,20\n#2,21\n# a word\ntest,motor [degC]\n\n3,OL\n4,2");
        assert_eq!(table.texts[0].values, ["1", "#2", "3", "4"]);
        assert_eq!((ledger.lines, &ledger.rows[..], ledger.missing["OL"]), (8, &[2, 3, 7, 8][..], 1));
        assert_eq!((&ledger.left_out["a remark behind '#'"][..], &ledger.left_out["the header once more"][..]), (&[4][..], &[5][..]));
        let told = ledger.sentences().join("\n");
        for needle in [
            "8 lines seen: 4 rows",
            "line 3 begins with '#' and a row's number of cells",
            "'OL' once",
            "without a line end behind '2' (line 8)",
        ] {
            assert!(told.contains(needle), "{told}");
        }
        let (table, ledger) = lenient("motor [degC],heater [W]\n20,1\n#N/A,2\n21,3\n22");
        assert_eq!((table.rows(), &ledger.left_out["the file ends within it"][..]), (3, &[5][..]));
        assert!(table.columns[0].values[1].is_nan());
    }
}
