//! Sheets of workbooks (`.xlsx`, `.xlsm`, `.xlsb`, `.xls`, `.ods`), read as text in CSV.

use std::borrow::Cow;
use std::fmt::Write;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use calamine::{Data, Ods, Range, Reader, SheetVisible, Sheets, StyleRange, Xls, Xlsb, Xlsx};

use crate::csv::{number, quoted};
use crate::{Ledger, Table};
use coldplate_base::error::{Error, Result, did_you_mean};

/// Endings of the names of workbooks.
pub(crate) const ENDINGS: [&str; 5] = ["xlsx", "xlsm", "xlsb", "xls", "ods"];

/// Book and sheet of a name such as `log.xlsx#March`; `None` if no sheet is named.
pub(crate) fn named_sheet(path: &Path) -> Option<(PathBuf, String)> {
    let (book, sheet) = path.to_str()?.rsplit_once('#')?;
    (is_book(Path::new(book)) && !path.exists()).then(|| (book.into(), sheet.into()))
}

fn is_book(path: &Path) -> bool {
    ENDINGS.contains(&ending(path).as_str())
}

fn ending(path: &Path) -> String {
    path.extension().map_or(String::new(), |e| e.to_string_lossy().to_ascii_lowercase())
}

/// Content of a sheet.
struct SheetContent {
    name: String,
    is_hidden: bool,
    /// Names of the sheets that a reader of the book sees.
    others: usize,
    cells: Range<Data>,
    formulas: Range<String>,
    styles: StyleRange,
}

/// Reads a sheet, the first visible one if none is named.
///
/// # Errors
/// The bytes are no workbook; there is no such sheet; formulas without values; errors of [`Table::from_text`].
pub(crate) fn read(bytes: Vec<u8>, sheet: Option<&str>, path: &Path) -> Result<(Table, Ledger)> {
    // The decoder may panic on a damaged file.
    let damaged = |_| Err(Error::input("this workbook cannot be read: it is damaged"));
    let sheet = catch_unwind(AssertUnwindSafe(|| content(bytes, sheet, path))).unwrap_or_else(damaged).map_err(|e| e.in_file(path))?;
    let mut ledger = Ledger::default();
    if sheet.others > 0 {
        let (name, all) = (&sheet.name, sheet.others + 1);
        ledger.assumed.push(format!("sheet '{name}' of {all} was read: name another as {}#NAME", bare(path).display()));
    }
    if sheet.is_hidden {
        ledger.noted.push(format!("sheet '{}' is hidden in the workbook", sheet.name));
    }
    check_formulas(&sheet).map_err(|e| e.in_file(path))?;
    // Lines are rows of the sheet, which may begin below its top.
    let (row, column) = sheet.cells.start().unwrap_or((0, 0));
    let mut text = "\n".repeat(row as usize);
    for (r, cells) in sheet.cells.rows().enumerate() {
        let is_percent = |c: usize| {
            let style = sheet.styles.get((row + r as u32, column + c as u32));
            style.and_then(|style| style.number_format.as_ref()).is_some_and(|format| format.format_code.contains('%'))
        };
        let cells: Vec<String> = cells.iter().enumerate().map(|(c, cell)| quoted(&shown(cell, is_percent(c)))).collect();
        let line = cells.join(",");
        // A row without any cell is a blank line.
        let _ = writeln!(text, "{}", if line.chars().all(|c| c == ',') { "" } else { &line });
    }
    Table::from_text(&text, path, ledger)
}

fn content(bytes: Vec<u8>, sheet: Option<&str>, path: &Path) -> Result<SheetContent> {
    let failed = |e: calamine::Error| Error::input(format!("this workbook cannot be read: {e}"));
    let bytes = Cursor::new(bytes);
    let book = match ending(&bare(path)).as_str() {
        "xls" => Xls::new(bytes).map(Sheets::Xls).map_err(calamine::Error::Xls),
        "xlsb" => Xlsb::new(bytes).map(Sheets::Xlsb).map_err(calamine::Error::Xlsb),
        "ods" => Ods::new(bytes).map(Sheets::Ods).map_err(calamine::Error::Ods),
        _ => Xlsx::new(bytes).map(Sheets::Xlsx).map_err(calamine::Error::Xlsx),
    };
    let mut book = book.map_err(failed)?;
    let sheets = book.sheets_metadata().to_vec();
    let is_visible = |sheet: &&calamine::Sheet| sheet.visible == SheetVisible::Visible;
    let own = match sheet {
        Some(name) => sheets.iter().find(|own| own.name == name),
        None => sheets.iter().find(is_visible).or(sheets.first()),
    };
    let Some(own) = own else {
        let Some(sheet) = sheet else { return Err(Error::input("this workbook has no sheet")) };
        let error = Error::input(format!("there is no sheet '{sheet}'"));
        return Err(match did_you_mean(sheet, sheets.iter().map(|own| own.name.as_str())) {
            Some(near) => error.help(format!("did you mean '{near}'?")),
            None => error.help(format!("sheets here: {}", sheets.iter().map(|own| own.name.as_str()).collect::<Vec<_>>().join(", "))),
        });
    };
    Ok(SheetContent {
        name: own.name.clone(),
        is_hidden: !is_visible(&own),
        others: sheets.len() - 1,
        cells: book.worksheet_range(&own.name).map_err(failed)?,
        formulas: book.worksheet_formula(&own.name).map_err(failed)?,
        styles: book.worksheet_style(&own.name).map_err(failed)?,
    })
}

/// Refuses a sheet of formulas that no program has computed: all of their cells would be empty.
fn check_formulas(sheet: &SheetContent) -> Result<()> {
    let Some((row, column)) = sheet.formulas.start() else { return Ok(()) };
    let places = sheet.formulas.used_cells().map(|(r, c, formula)| ((row + r as u32, column + c as u32), formula));
    let formulas: Vec<((u32, u32), &String)> = places.filter(|(_, formula)| !formula.is_empty()).collect();
    let is_empty = |place: &(u32, u32)| sheet.cells.get_value(*place).is_none_or(|cell| *cell == Data::Empty);
    match formulas.first().filter(|_| formulas.iter().all(|(place, _)| is_empty(place))) {
        Some(((row, _), formula)) => Err(Error::input(format!("the formulas of sheet '{}' have no values", sheet.name))
            .at_line(*row as usize + 1)
            .read(format!("={formula}"))
            .help("open the workbook in a spreadsheet program, which computes them, and save it")),
        None => Ok(()),
    }
}

/// Name of the book without that of a sheet.
fn bare(path: &Path) -> PathBuf {
    named_sheet(path).map_or_else(|| path.to_path_buf(), |(book, _)| book)
}

fn shown(cell: &Data, is_percent: bool) -> Cow<'_, str> {
    match cell {
        Data::Float(value) if is_percent => Cow::Owned(format!("{}%", number(100.0 * value))),
        Data::String(text) => Cow::Owned(text.replace(['\r', '\n'], " ")),
        Data::Float(value) => Cow::Owned(number(*value)),
        Data::Int(value) => Cow::Owned(value.to_string()),
        Data::Bool(value) => Cow::Borrowed(if *value { "TRUE" } else { "FALSE" }),
        Data::DateTime(stamp) if stamp.is_datetime() => {
            let (year, month, day, hour, minute, second, milli) = stamp.to_ymd_hms_milli();
            Cow::Owned(format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}.{milli:03}"))
        }
        Data::DateTime(span) => {
            let seconds = 86_400.0 * span.as_f64();
            let whole = seconds.floor() as i64;
            Cow::Owned(format!("{}:{:02}:{:06.3}", whole / 3600, whole / 60 % 60, seconds - (whole / 60 * 60) as f64))
        }
        Data::DateTimeIso(text) | Data::DurationIso(text) => Cow::Borrowed(text),
        Data::Error(error) => Cow::Owned(error.to_string()),
        Data::Empty => Cow::Borrowed(""),
    }
}
