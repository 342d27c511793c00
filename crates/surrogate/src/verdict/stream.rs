//! Answers to a file of conditions as a stream: read, evaluated on every core, and written in pieces, in the order of the
//! file. Memory does not grow with the file.

use std::io::{BufRead, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use coldplate_runtime::{CONFIDENCE, Surrogate};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::ser::{CompactFormatter, Formatter, Serializer};

use super::batch::{BatchHeader, BatchRows, LINES, LinePiece, LinePieces, no_conditions};
use super::columns::{AnswerColumns, ConditionAnswer};
use super::stated::StatedValue;
use super::{Acceptability, condition, digits, query_at};
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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tally {
    /// Number of rows.
    pub rows: usize,
    /// The gravest verdict on a row.
    pub worst: Acceptability,
}

impl Tally {
    const NONE: Self = Self { rows: 0, worst: Acceptability::Acceptable };

    fn join(&mut self, rows: usize, worst: Acceptability) {
        *self = Self { rows: self.rows + rows, worst: self.worst.max(worst) };
    }
}

/// Reads every row without answering, so that a mistake shows before the first answer; gives the number of rows.
///
/// # Errors
/// Errors of [`BatchHeader`]; no rows.
pub fn check(surrogate: &Surrogate<'_>, reader: impl BufRead, given: &[(String, String)]) -> Result<usize> {
    let mut lines = LinePieces::new(reader);
    let batch = BatchHeader::begin(surrogate, &mut lines, given)?;
    let count = |piece: &LinePiece| batch.rows(piece).map(|rows| rows.lines.len());
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
    let mut tally = Tally::NONE;
    let refused = AtomicBool::new(false);
    let work = |piece: &LinePiece| {
        let rows = batch.rows(piece)?;
        if form.json && form.columns.is_empty() { objects(surrogate, form, &rows) } else { table(&columns, form, &rows, &refused) }
    };
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
        tally.join(counted.rows, counted.worst);
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

/// Answers to conditions, each as names and values with units, as the JSON of [`answer`] with columns.
///
/// # Errors
/// A column that does not exist; otherwise the error of the first condition with one.
pub fn answer_given(surrogate: &Surrogate<'_>, conditions: &[&[StatedValue]], form: &AnswerForm) -> Result<Vec<u8>> {
    let columns = AnswerColumns::new(surrogate, false, &form.columns, form.digits, form.confidence)?;
    // Nobody asks for the gravest verdict.
    let settled = AtomicBool::new(true);
    let piece = |(number, given): (usize, &[&[StatedValue]])| {
        let mut rows = BatchRows::default();
        for (index, given) in given.iter().enumerate() {
            let place = number * LINES + index;
            let x = condition::condition(surrogate, given).map_err(|e| e.within(&format!("conditions[{place}]")))?;
            let (varied, held) = x.split_at(surrogate.variable_count());
            rows.lines.push(place + 1);
            rows.conditions.extend_from_slice(varied);
            rows.held.extend_from_slice(held);
        }
        Ok(table(&columns, form, &rows, &settled)?.0)
    };
    let texts = conditions.par_chunks(LINES).enumerate().map(piece).collect::<Result<Vec<_>>>()?;
    Ok([b"{\"conditions\": [\n", &texts.join(&b",\n"[..])[..], b"\n]}\n"].concat())
}

fn objects(surrogate: &Surrogate<'_>, form: &AnswerForm, rows: &BatchRows<'_>) -> Result<(Vec<u8>, Tally)> {
    let (mut text, mut tally) = (Vec::new(), Tally::NONE);
    for index in 0..rows.lines.len() {
        let row = rows.row(index);
        let condition: Vec<f64> = row.condition.iter().chain(row.held).copied().collect();
        let answer = query_at(surrogate, &condition, form.confidence)?;
        put(&answer.record_of_row(surrogate, &row), form.digits, &mut text)?;
        tally.join(1, answer.verdict);
    }
    Ok((text, tally))
}

fn table(columns: &AnswerColumns<'_>, form: &AnswerForm, rows: &BatchRows<'_>, refused: &AtomicBool) -> Result<(Vec<u8>, Tally)> {
    let (mut text, mut tally) = (Vec::new(), Tally::NONE);
    let take = |answer: &ConditionAnswer<'_>| {
        if form.json {
            put(&columns.object(answer), form.digits, &mut text)?;
        } else {
            columns.csv(answer, &mut text);
        }
        if answer.verdict == Acceptability::NotAcceptable {
            refused.store(true, Ordering::Relaxed);
        }
        tally.join(1, answer.verdict);
        Ok(())
    };
    columns.each(rows, || refused.load(Ordering::Relaxed), take)?;
    Ok((text, tally))
}

/// A record as JSON on one line, behind those before it.
fn put(record: &impl Serialize, digits: Option<usize>, text: &mut Vec<u8>) -> Result<()> {
    if !text.is_empty() {
        text.extend(b",\n");
    }
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
                let mut text = Vec::new();
                digits::push(value, Some(digits), &mut text);
                writer.write_all(&text)
            }
            None => CompactFormatter.write_f64(writer, value),
        }
    }
}
