//! Answers to a file of conditions as a stream: read, evaluated on every core, and written in pieces, in the order of the
//! file. Memory does not grow with the file.

use std::io::{BufRead, Write};

use coldplate_runtime::{CONFIDENCE, Surrogate};
use serde::Serialize;
use serde_json::ser::{CompactFormatter, Formatter, Serializer};

use super::batch::{BatchHeader, LinePiece, LinePieces, no_conditions};
use super::columns::{AnswerColumns, AnswerMemory};
use super::{Acceptability, digits, query_at};
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;

/// Form of the answers to rows.
#[derive(Debug, Clone)]
pub struct AnswerForm {
    /// One JSON object with the rows under `conditions`, in place of CSV.
    pub json: bool,
    /// Names of the columns, as [`AnswerColumns::new`] takes them; empty for all. JSON rows are flat objects of these columns.
    pub columns: Vec<String>,
    /// Significant digits of every number; `None` for all digits.
    pub digits: Option<usize>,
    /// Probability with which verdicts are said.
    pub confidence: f64,
}

impl Default for AnswerForm {
    fn default() -> Self {
        Self { json: false, columns: Vec::new(), digits: None, confidence: CONFIDENCE }
    }
}

/// Count of the answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Number of rows.
    pub rows: usize,
    /// Whether a row is not acceptable.
    pub refused: bool,
    /// Whether a row is uncertain.
    pub open: bool,
}

impl Tally {
    fn add(&mut self, verdict: Acceptability) {
        self.rows += 1;
        self.refused |= verdict == Acceptability::NotAcceptable;
        self.open |= verdict == Acceptability::Uncertain;
    }

    fn join(&mut self, other: Self) {
        *self = Self { rows: self.rows + other.rows, refused: self.refused | other.refused, open: self.open | other.open };
    }
}

/// Reads every row without answering, so that a mistake shows before the first answer; gives the number of rows.
///
/// # Errors
/// Errors of [`BatchHeader`]; no rows.
pub fn check(surrogate: &Surrogate<'_>, reader: impl BufRead, given: &[(String, String)]) -> Result<usize> {
    let mut lines = LinePieces::new(reader);
    let batch = BatchHeader::begin(surrogate, &mut lines, given)?;
    let count = |piece: &LinePiece| batch.rows(piece).try_fold(0, |count, row| row.map(|_| count + 1));
    let mut rows = 0;
    lines.each(count, |count| rows += count)?;
    if rows == 0 { Err(no_conditions()) } else { Ok(rows) }
}

/// Answers every row; `take` gets the text in order. `total` is the number of rows where it is known, for `progress`.
///
/// # Errors
/// Errors of [`check`], and a column that does not exist. Answers to the rows before the wrong one have been taken by
/// then.
pub fn answer(
    surrogate: &Surrogate<'_>,
    reader: impl BufRead,
    given: &[(String, String)],
    form: &AnswerForm,
    total: Option<usize>,
    progress: &dyn Progress,
    mut take: impl FnMut(&[u8]),
) -> Result<Tally> {
    let mut lines = LinePieces::new(reader);
    let batch = BatchHeader::begin(surrogate, &mut lines, given)?;
    let columns = AnswerColumns::new(surrogate, batch.is_labelled(), &form.columns, form.digits, form.confidence)?;
    let mut tally = Tally::default();
    let work =
        |piece: &LinePiece| if form.json { objects(surrogate, &batch, &columns, form, piece) } else { rows(&batch, &columns, piece) };
    lines.each(work, |(text, counted)| {
        if text.is_empty() {
            return;
        }
        match (form.json, tally.rows) {
            (true, 0) => take(b"{\"conditions\": [\n"),
            (true, _) => take(b",\n"),
            (false, 0) => take(columns.header().as_bytes()),
            (false, _) => {}
        }
        take(&text);
        tally.join(counted);
        if let Some(total) = total {
            progress.count(tally.rows, total, "conditions");
        }
    })?;
    if tally.rows == 0 {
        return Err(no_conditions());
    }
    if form.json {
        take(b"\n]}\n");
    }
    Ok(tally)
}

fn rows(batch: &BatchHeader<'_>, columns: &AnswerColumns<'_>, piece: &LinePiece) -> Result<(Vec<u8>, Tally)> {
    let (mut text, mut room, mut tally) = (String::new(), AnswerMemory::default(), Tally::default());
    for row in batch.rows(piece) {
        let row = row?;
        let answer = columns.answer(row.label.as_deref(), &row.condition, &mut room);
        columns.csv(&answer, &mut text);
        tally.add(answer.verdict);
    }
    Ok((text.into_bytes(), tally))
}

fn objects(
    surrogate: &Surrogate<'_>,
    batch: &BatchHeader<'_>,
    columns: &AnswerColumns<'_>,
    form: &AnswerForm,
    piece: &LinePiece,
) -> Result<(Vec<u8>, Tally)> {
    let (mut text, mut room, mut tally) = (Vec::new(), AnswerMemory::default(), Tally::default());
    for row in batch.rows(piece) {
        let row = row?;
        if tally.rows > 0 {
            text.extend(b",\n");
        }
        if form.columns.is_empty() {
            let answer = query_at(surrogate, &row.condition, form.confidence)?;
            put(&answer.record_of_row(surrogate, &row), form.digits, &mut text)?;
            tally.add(answer.verdict);
        } else {
            let answer = columns.answer(row.label.as_deref(), &row.condition, &mut room);
            put(&columns.object(&answer), form.digits, &mut text)?;
            tally.add(answer.verdict);
        }
    }
    Ok((text, tally))
}

/// A record as JSON on one line.
fn put(record: &impl Serialize, digits: Option<usize>, text: &mut Vec<u8>) -> Result<()> {
    let written = record.serialize(&mut Serializer::with_formatter(text, Rounded { digits }));
    written.map_err(|e| Error::input(format!("this row cannot be written as JSON: {e}")))
}

/// JSON whose numbers have as many digits as asked for.
struct Rounded {
    digits: Option<usize>,
}

impl Formatter for Rounded {
    fn write_f64<W: ?Sized + Write>(&mut self, writer: &mut W, value: f64) -> std::io::Result<()> {
        match self.digits {
            Some(digits) => {
                let mut text = String::new();
                digits::push(value, digits, &mut text);
                writer.write_all(text.as_bytes())
            }
            None => CompactFormatter.write_f64(writer, value),
        }
    }
}
