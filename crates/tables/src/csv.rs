//! Tables as CSV: `# key: value` lines of provenance, a header `name [unit]`, rows (RFC 4180 quoting).
//!
//! The reader is written by hand for the sake of units in headers, provenance lines, and errors with line and column.
//! Values are written with all digits needed to read back bit for bit.

use std::path::Path;

use super::{Ledger, Table};
use crate::aligned;
use crate::layout::Layout;
use crate::ledger::BLANK;
use crate::reader::{INPUTS, Reader};
use crate::records::{CsvRecords, remark};
use coldplate_base::condition;
use coldplate_base::error::{Error, Result};

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
        let delimited = aligned::delimited(text, &mut ledger);
        let layout = Layout::of(&delimited, file, &mut ledger)?;
        ledger.header = layout.header_line;
        ledger.lines = text.lines().count();
        let mut reader = Reader::new(&layout, ledger).map_err(|e| e.in_file(file).at_line(layout.header_line))?;
        let is_cut_off = !text.ends_with('\n');
        let mut lines = 0;
        for record in CsvRecords::new(&delimited, layout.delimiter) {
            let record = record.map_err(|e| e.in_file(file))?;
            (lines + 1..record.line).for_each(|blank| reader.ledger.leave_out(BLANK, blank));
            lines = record.last_line;
            let is_last = is_cut_off && lines == reader.ledger.lines;
            let line = record.line;
            reader.take(record, is_last).map_err(|e| e.in_file(file).at_line(line))?;
        }
        let (mut table, mut ledger, inputs) = reader.end().map_err(|e| e.in_file(file))?;
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
    let plain = !text.contains([',', '"', '\n', '\r']) && !text.starts_with('\u{feff}') && remark(text).is_none() && text.trim() == text;
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

    fn refused(text: &str) -> String {
        Table::from_text(text, Path::new("f.csv"), Ledger::default()).map(|_| ()).unwrap_err().to_string()
    }

    /// Rows that a quote in front of them takes into a cell, and a quote that is never closed.
    #[test]
    fn no_quote_swallows_rows() {
        let closed = refused("test,motor [degC],note\n1,20,\"warm\n2,21,cold\n3,22,\"\n4,23,\n");
        assert!(closed.contains("f.csv:2") && closed.contains("closed in line 4"), "{closed}");
        let behind = refused("test,motor [degC],note\n1,20,a\n2,20,\"warm\n3,21,\"cold\"\n");
        assert!(behind.contains("f.csv:3") && behind.contains("line 4"), "{behind}");
        let open = refused("test,motor [degC],note\n1,20,a\n2,20,\"warm\n3,21,cold\n");
        assert!(open.contains("f.csv:3") && open.contains("never closed"), "{open}");
        let (table, _) = lenient("test,motor [degC],note\n1,20,\"two\nlines\"\n2,21,\n");
        assert_eq!(table.rows(), 2);
    }

    /// Statistics, words and blank rows below a table are no tests; a test called Max is one.
    #[test]
    fn lines_below_the_last_row_are_left_out_with_a_word() {
        let (table, ledger) = lenient("test,motor [degC],flow [L/min]\na,20.1,4\nb,21.4,6\n,,\nMean,20.75,5\nStd,0.92,1.41\nEnd of file\n");
        assert_eq!((table.rows(), &ledger.left_out["a statistic of the rows above"][..]), (2, &[5, 6][..]));
        assert_eq!((&ledger.left_out["words below the last row"][..], &ledger.left_out["blank"][..]), (&[7][..], &[4][..]));
        let (table, ledger) = lenient("test,motor [degC],flow [L/min]\nMin,20.1,4\na,21.4,6\nMax,27,9\n");
        assert_eq!(table.texts[0].values, ["Min", "a", "Max"]);
        assert!(ledger.noted.iter().any(|s| s.contains("line 4 is called 'Max'")), "{:?}", ledger.noted);
        let (table, _) = lenient("time [s],motor [degC]\n0,20\n5,21\nAverage,20.5\n");
        assert_eq!(table.rows(), 2);
        let other = refused("time [s],motor [degC]\n0,20\n5,21\n\ntime [s],flow [L/min]\n0,4\n");
        assert!(other.contains("f.csv:5") && other.contains("another header"), "{other}");
        let (table, ledger) = lenient("test,heater,motor\n,W,Deg C\n1,10,30.02\ntest,heater,motor\n,W,Deg C\n2,10,31\n");
        assert_eq!((table.rows(), &ledger.left_out["the header once more"][..]), (2, &[4, 5][..]));
    }

    #[test]
    fn rows_and_remarks_behind_other_marks_are_told_apart() {
        let (table, ledger) = lenient("test,motor [degC]\n1,20\n//2,21\n%3,22\n% a word\n// another\n");
        assert_eq!(table.texts[0].values, ["1", "//2", "%3"]);
        assert!(ledger.noted.iter().any(|s| s.contains("line 3 begins with '//'")), "{:?}", ledger.noted);
        assert_eq!(ledger.left_out["a remark behind '%'"], [5]);
        let (table, ledger) = lenient("% Logger 7\ntime [s]|motor [degC]\n0|20\n%5|21\n10|22\n");
        assert_eq!((table.rows(), &ledger.left_out["a remark behind '%'"][..]), (2, &[4][..]));
    }

    #[test]
    fn cells_with_units_and_open_commas() {
        let (table, ledger) = lenient("test,heater [W],share [1]\na,12 W,50%\nb,1.5 kW,0.25\n");
        assert_eq!((&table.columns[0].values[..], &table.columns[1].values[..]), (&[12.0, 1500.0][..], &[0.5, 0.25][..]));
        assert!(ledger.assumed.iter().any(|s| s.contains("2 numbers have a unit in the cells of 'heater [W]'")), "{:?}", ledger.assumed);
        let open = refused("heater [W]\tmotor [degC]\n1,045\t20\n1,200\t21\n");
        assert!(open.contains("f.csv:2") && open.contains("heater [W]") && open.contains("thousands"), "{open}");
        for known in
            ["heater [W]\tmotor [degC]\n1,045\t20,5\n", "heater [W]\tmotor [degC]\n1,045\t2000\n", "heater [W];motor [degC]\n1,045;20\n"]
        {
            assert_eq!(lenient(known).0.columns[0].values, [1.045], "{known}");
        }
        let blanks = refused("time [s] motor [degC]\n0 20.5\n5 21\n");
        assert!(blanks.contains("f.csv:2") && blanks.contains("a single blank separates no cells"), "{blanks}");
    }

    /// Blanks separate cells only if every line has as many of them, and no delimiter does.
    #[test]
    fn aligned_and_framed_tables_are_read_with_a_word() {
        for text in [
            "test   heater [W]   motor [degC]\na      10           20.5\nday b  12.5         21\n",
            "# a  remark\n  test     heater [W]  motor [degC]\n  a          10,0          20,5\n  day b      12,5          21,0\n",
            "| test | heater [W] | motor [degC] |\n| a | 10 | 20.5 |\n| day b | 12.5 | 21 |\n",
        ] {
            let (table, ledger) = lenient(text);
            assert_eq!((&table.columns[0].values[..], &table.columns[1].values[..]), (&[10.0, 12.5][..], &[20.5, 21.0][..]), "{text}");
            assert_eq!(table.texts[0].values, ["a", "day b"], "{text}");
            let said = if text.starts_with('|') { "a '|' frames every line" } else { "aligned by two or more blanks" };
            assert!(ledger.assumed.iter().any(|s| s.contains(said)), "{:?}", ledger.assumed);
            assert!(Table::from_csv(text, "f.csv").is_err());
        }
        // A reading is missing: which one, blanks do not say.
        let hole = Table::from_text("heater [W]  motor [degC]\n10  20.5\n    21\n", Path::new("f.csv"), Ledger::default());
        assert!(hole.is_err() || hole.unwrap().0.columns.len() < 2);
        let (table, ledger) = lenient("heater [W],  motor [degC]\n10,  20.5\n12,  21\n");
        assert!(table.columns[1].values == [20.5, 21.0] && ledger.assumed.is_empty(), "{:?}", ledger.assumed);
    }

    #[test]
    fn a_header_may_say_what_a_column_does_between_two_rows() {
        for text in
            ["heater [W, held],motor [degC]\n1,20\n", "\"heater [W, held]\",motor [degC]\n1,20\n", "heater (W held);motor (°C)\n1;20\n"]
        {
            let (table, ledger) = lenient(text);
            assert_eq!(
                (table.columns[0].header().as_str(), &ledger.between[..]),
                ("heater [W]", &[("heater".to_string(), true)][..]),
                "{text}"
            );
            assert!(Table::from_csv(text, "f.csv").is_err());
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
