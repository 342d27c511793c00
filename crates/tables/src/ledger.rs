//! Account of the lines of a file: seen, read, assumed, left out.

use std::collections::BTreeMap;

use serde::Serialize;

/// Most lines that a sentence lists one by one, a count. Chosen: more say nothing to a reader.
const MOST_LISTED: usize = 8;

/// Account of the reading of a table.
///
/// The keys of its JSON are these fields but for the lines of header and rows; `rows` is their number.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Ledger {
    /// Lines of the file; 0 for a Parquet file, which has none.
    pub lines: usize,
    /// Line of the header.
    #[serde(skip)]
    pub header: usize,
    /// Line of every row; empty for a Parquet file.
    #[serde(serialize_with = "count")]
    pub rows: Vec<usize>,
    /// Sentences on what was assumed because the file does not say it.
    pub assumed: Vec<String>,
    /// Sentences on what a reader should look at, though it was read as it stands.
    pub noted: Vec<String>,
    /// Lines that are no rows, by the reason.
    pub left_out: BTreeMap<&'static str, Vec<usize>>,
    /// Number of cells without a number, by what stands in them.
    pub missing: BTreeMap<String, usize>,
    /// Columns whose header says what they do between two rows: whether they are held.
    #[serde(skip)]
    pub between: Vec<(String, bool)>,
}

/// Reasons for lines that are no rows of any table; lines left out for another reason had been meant as rows.
pub(crate) const BLANK: &str = "blank";
const REMARKS: [(&str, &str); 3] = [("#", "a remark behind '#'"), ("//", "a remark behind '//'"), ("%", "a remark behind '%'")];
pub(crate) const ABOVE: &str = "above the header";

impl Ledger {
    pub(crate) fn leave_out(&mut self, reason: &'static str, line: usize) {
        self.left_out.entry(reason).or_default().push(line);
    }

    pub(crate) fn leave_out_remark(&mut self, mark: &str, line: usize) {
        let reason = REMARKS.iter().find(|(own, _)| *own == mark).map_or(REMARKS[0].1, |(_, reason)| reason);
        self.leave_out(reason, line);
    }

    /// Line of a row, counted from 0, where it is known.
    pub fn line(&self, row: usize) -> Option<usize> {
        self.rows.get(row).copied()
    }

    /// Reason why a table is not plain: something was assumed, or lines that had been meant as rows were left out.
    pub(crate) fn doubt(&self) -> Option<String> {
        let lost = self.left_out.iter().find(|(reason, _)| **reason != BLANK && REMARKS.iter().all(|(_, own)| own != *reason));
        let between = || self.between.first().map(|(name, _)| format!("the header of '{name}' says what it does between two rows"));
        self.assumed.first().cloned().or_else(|| lost.map(|(reason, lines)| left_out(reason, lines))).or_else(between)
    }

    /// Sentences for a reader: the count, then everything that was assumed, noted or left out.
    pub fn sentences(&self) -> Vec<String> {
        let mut told = Vec::new();
        if self.lines > 0 {
            let rest = self.lines - self.rows.len();
            let rest = if rest > 1 { format!(", {rest} others") } else { String::new() };
            told.push(format!("{} lines seen: {} rows{rest}", self.lines, self.rows.len()));
        }
        told.extend(self.assumed.iter().cloned());
        told.extend(self.noted.iter().cloned());
        told.extend(self.left_out.iter().filter(|(reason, _)| **reason != BLANK).map(|(reason, lines)| left_out(reason, lines)));
        if !self.missing.is_empty() {
            let words: Vec<String> = self
                .missing
                .iter()
                .map(|(word, n)| format!("'{word}' {}", if *n == 1 { "once".into() } else { format!("{n} times") }))
                .collect();
            told.push(format!("cells read as missing: {}", words.join(", ")));
        }
        told
    }
}

fn count<S: serde::Serializer>(rows: &[usize], out: S) -> Result<S::Ok, S::Error> {
    out.serialize_u64(rows.len() as u64)
}

fn left_out(reason: &str, lines: &[usize]) -> String {
    let (line, was) = if lines.len() == 1 { ("line", "was") } else { ("lines", "were") };
    format!("{line} {} {was} left out: {reason}", listed(lines))
}

/// Line numbers, the first few one by one.
pub(crate) fn listed(lines: &[usize]) -> String {
    let shown: Vec<String> = lines.iter().take(MOST_LISTED).map(usize::to_string).collect();
    let more = if lines.len() > MOST_LISTED { format!(" and {} more", lines.len() - MOST_LISTED) } else { String::new() };
    shown.join(", ") + &more
}
