//! Sheets of `.xlsx` workbooks, read as text in CSV.

use std::borrow::Cow;
use std::fmt::Write;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use calamine::{Data, Reader, Xlsx};

use crate::csv::{number, quoted};
use crate::{Ledger, Table};
use coldplate_base::error::{Error, Result, did_you_mean};

/// Book and sheet of a name such as `log.xlsx#March`; `None` if no sheet is named.
pub(crate) fn named_sheet(path: &Path) -> Option<(PathBuf, String)> {
    let (book, sheet) = path.to_str()?.rsplit_once('#')?;
    (book.to_ascii_lowercase().ends_with(".xlsx") && !path.exists()).then(|| (book.into(), sheet.into()))
}

/// Reads a sheet, the first one if none is named.
///
/// # Errors
/// The bytes are no workbook; there is no such sheet; errors of [`Table::from_text`].
pub(crate) fn read(bytes: Vec<u8>, sheet: Option<&str>, path: &Path) -> Result<(Table, Ledger)> {
    let failed = |e: calamine::XlsxError| Error::input(format!("this workbook cannot be read: {e}")).in_file(path);
    let mut book: Xlsx<_> = Xlsx::new(Cursor::new(bytes)).map_err(failed)?;
    let names = book.sheet_names();
    let Some(first) = names.first() else { return Err(Error::input("this workbook has no sheet").in_file(path)) };
    let sheet = sheet.unwrap_or(first);
    if !names.iter().any(|name| name == sheet) {
        let error = Error::input(format!("there is no sheet '{sheet}'")).in_file(path);
        return Err(match did_you_mean(sheet, names.iter().map(String::as_str)) {
            Some(near) => error.help(format!("did you mean '{near}'?")),
            None => error.help(format!("sheets here: {}", names.join(", "))),
        });
    }
    let range = book.worksheet_range(sheet).map_err(failed)?;
    let mut ledger = Ledger::default();
    if names.len() > 1 {
        ledger.assumed.push(format!("sheet '{sheet}' of {} was read: name another as {}#NAME", names.len(), bare(path).display()));
    }
    // Lines are rows of the sheet, which may begin below its top.
    let mut text = "\n".repeat(range.start().map_or(0, |(row, _)| row as usize));
    for row in range.rows() {
        let cells: Vec<String> = row.iter().map(|cell| quoted(&shown(cell))).collect();
        let line = cells.join(",");
        // A row without any cell is a blank line.
        let _ = writeln!(text, "{}", if line.chars().all(|c| c == ',') { "" } else { &line });
    }
    Table::from_text(&text, path, ledger)
}

/// Name of the book without that of a sheet.
fn bare(path: &Path) -> PathBuf {
    named_sheet(path).map_or_else(|| path.to_path_buf(), |(book, _)| book)
}

fn shown(cell: &Data) -> Cow<'_, str> {
    match cell {
        Data::String(text) => Cow::Owned(text.replace(['\r', '\n'], " ")),
        Data::Float(value) => Cow::Owned(number(*value)),
        Data::Int(value) => Cow::Owned(value.to_string()),
        Data::Bool(value) => Cow::Borrowed(if *value { "TRUE" } else { "FALSE" }),
        Data::DateTime(stamp) if stamp.is_datetime() => {
            let (year, month, day, hour, minute, second, milli) = stamp.to_ymd_hms_milli();
            Cow::Owned(format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}.{milli:03}"))
        }
        Data::DateTime(span) => Cow::Owned(number(span.as_f64())),
        Data::DateTimeIso(text) | Data::DurationIso(text) => Cow::Borrowed(text),
        Data::Error(error) => Cow::Owned(error.to_string()),
        Data::Empty => Cow::Borrowed(""),
    }
}
