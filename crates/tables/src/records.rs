//! Records of CSV text (RFC 4180 quoting): rows of cells, and remarks behind '#', '//' or '%'.

use coldplate_base::error::{Error, Result};

/// A record of a text file: a row of cells, or a remark.
pub(crate) struct Record<'a> {
    /// First line of the record.
    pub line: usize,
    /// Last line of the record; a quoted cell may hold line ends.
    pub last_line: usize,
    pub cells: Vec<String>,
    /// A remark: its mark, and the rest of the line behind it.
    pub comment: Option<(&'static str, &'a str)>,
}

/// Marks at the beginning of a remark.
const MARKS: [&str; 3] = ["#", "//", "%"];

/// Mark and text of a line that is a remark.
pub(crate) fn remark(line: &str) -> Option<(&'static str, &str)> {
    let line = line.trim_start();
    MARKS.into_iter().find_map(|mark| line.strip_prefix(mark).map(|rest| (mark, rest.trim())))
}

/// Splits text into records, skipping empty lines; quoted cells may hold line ends.
pub(crate) struct CsvRecords<'a> {
    rest: &'a str,
    line: usize,
    delimiter: char,
}

impl<'a> CsvRecords<'a> {
    pub(crate) fn new(text: &'a str, delimiter: char) -> Self {
        Self { rest: text, line: 0, delimiter }
    }

    /// Cells of one line, which may begin like a remark; `None` if a quote in it is not closed.
    pub(crate) fn row(line: &'a str, delimiter: char) -> Option<Vec<String>> {
        Self { rest: "", line: 1, delimiter }.cells(line).ok()
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
        let mut cells = Vec::new();
        // A tab may be a delimiter: blanks alone are trimmed in front of a cell.
        let trimmed = |text: &'a str| text.trim_start_matches([' ', '\u{a0}']);
        let mut rest = trimmed(first);
        loop {
            let Some(mut inside) = rest.strip_prefix('"') else {
                let (cell, after) = rest.split_once(self.delimiter).map_or((rest, None), |(cell, after)| (cell, Some(after)));
                cells.push(cell.trim().to_string());
                let Some(after) = after else { return Ok(cells) };
                rest = trimmed(after);
                continue;
            };
            let (mut text, start) = (String::new(), self.line);
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
                    None => break trimmed(&inside[end + 1..]),
                }
            };
            cells.push(text);
            if after.is_empty() {
                return Ok(cells);
            }
            rest = trimmed(after.strip_prefix(self.delimiter).ok_or_else(|| {
                let error = Error::input("text stands behind a closing quote").at_line(start).read(after);
                match self.line {
                    line if line == start => error.help("quote the whole cell"),
                    line => {
                        error.help(format!("the quote that opens here is closed in line {line}: close it in its own line, or remove it"))
                    }
                }
            })?);
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
            if let Some(comment) = remark(text) {
                return Some(Ok(Record { line, last_line: line, cells: Vec::new(), comment: Some(comment) }));
            }
            let cells = self.cells(text);
            return Some(cells.map(|cells| Record { line, last_line: self.line, cells, comment: None }));
        }
    }
}
