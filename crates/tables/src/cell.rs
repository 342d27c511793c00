//! Cells of number columns: numbers, words for a missing one, and numbers with a unit of their own.

use coldplate_base::error::{Error, Result};
use coldplate_base::units::{rescaling, spelled};

/// Words that loggers, scanners and spreadsheets write where there is no number, in small letters.
const MISSING: &[&str] = &[
    "nan",
    "-nan",
    "+nan",
    "nan(ind)",
    "-nan(ind)",
    "qnan",
    "snan",
    "1.#qnan",
    "1.#qnan0",
    "-1.#qnan",
    "1.#snan",
    "1.#ind",
    "-1.#ind",
    "-1.#ind00",
    "1.#inf",
    "1.#inf00",
    "-1.#inf",
    "<na>",
    "nat",
    "na",
    "n/a",
    "n.a.",
    "#n/a",
    "#na",
    "#nv",
    "null",
    "(null)",
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
    "ovrld",
    "over",
    "overflow",
    "overload",
    "overrange",
    "over range",
    "underrange",
    "under range",
    "open",
    "short",
    "err",
    "error",
    "fehler",
    "fail",
    "failed",
    "fault",
    "bad",
    "invalid",
    "missing",
    "no data",
    "nodata",
    "#num!",
    "#zahl!",
    "#div/0!",
    "#value!",
    "#wert!",
    "#ref!",
    "#bezug!",
    "#name?",
];
/// Numbers by which instruments say that there is none (SCPI 1999, volume 1, section 7.2.1.4 and 7.2.1.5): 9.9E37 for too large, 9.91E37
/// for not a number, with either sign.
const NO_NUMBER: std::ops::RangeInclusive<f64> = 9.895e37..=9.915e37;

/// A number in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CellNumber {
    /// The value in the unit of the column.
    pub value: f64,
    /// Decimal mark of the number.
    pub mark: Option<char>,
    /// Whether the cell has a unit of its own.
    pub has_unit: bool,
}

/// The number in a cell of a column in `unit`; `None` where it is missing.
///
/// # Errors
/// No number, thousands set apart, a number that is not finite, a unit of another kind than the column's.
pub(crate) fn read(cell: &str, unit: &str) -> Result<Option<CellNumber>> {
    if is_missing(cell) {
        return Ok(None);
    }
    let (digits, own) = split(cell);
    let thousands = || {
        let error = Error::input("thousands are set apart in this number").read(cell);
        Err(error.help("write numbers without thousands separators"))
    };
    let is_mark = |c: char| matches!(c, '.' | ',');
    let is_blank = |c: char| c == '\'' || c == '\u{2019}' || c.is_whitespace();
    let mut groups = digits.split(is_blank);
    if groups.clone().count() > 1 {
        let is_first = groups.next().is_some_and(|first| !first.is_empty() && first.trim_start_matches('-').len() <= 3);
        if is_first && groups.all(|group| group.split(is_mark).next().is_some_and(|own| own.len() == 3)) {
            return thousands();
        }
        if digits.split_whitespace().all(|part| part.replace(',', ".").parse::<f64>().is_ok()) {
            let error = Error::input("several numbers stand in this cell").read(cell);
            return Err(
                error.help("write one delimiter between the columns: commas, semicolons, tabs or '|'; a single blank separates no cells")
            );
        }
    }
    if digits.matches(is_mark).count() > 1 {
        return thousands();
    }
    let mark = digits.chars().find(|c| is_mark(*c));
    let value = match digits.replacen(',', ".", 1).parse::<f64>() {
        Ok(value) if value.is_finite() => value,
        Ok(_) => return Err(Error::input("the number is not finite").read(cell).help("leave the cell empty where the reading is missing")),
        Err(_) => {
            let error = Error::input("no number can be read here").read(cell);
            return Err(error.help("write it with a decimal point; the unit stands in the header"));
        }
    };
    if NO_NUMBER.contains(&value.abs()) {
        return Ok(None);
    }
    if own.is_empty() {
        return Ok(Some(CellNumber { value, mark, has_unit: false }));
    }
    let scale = spelled(own).and_then(|own| rescaling(&own, unit).ok());
    let Some((factor, offset)) = scale else {
        let error = Error::input(format!("this number has a unit of its own, which is not the header's [{unit}]")).read(cell);
        return Err(error.help("write the number alone: the unit stands in the header"));
    };
    Ok(Some(CellNumber { value: factor * value + offset, mark, has_unit: true }))
}

/// A cell cut into its digits and the unit behind them, which begins with a letter, a degree or a percent sign.
fn split(cell: &str) -> (&str, &str) {
    let is_exponent = |at: usize| {
        let rest = cell[at + 1..].trim_start_matches(['+', '-']);
        at > 0 && rest.starts_with(|c: char| c.is_ascii_digit())
    };
    let is_end = |(at, c): (usize, char)| match c {
        'e' | 'E' => !is_exponent(at),
        _ => c.is_alphabetic() || matches!(c, '°' | 'º' | '%' | '\u{2103}' | '\u{2109}'),
    };
    let at = cell.char_indices().find(|own| is_end(*own)).map_or(cell.len(), |(at, _)| at);
    // Words such as `inf` have no digits.
    if cell[..at].trim().is_empty() { (cell, "") } else { (cell[..at].trim(), cell[at..].trim()) }
}

/// Whether a cell says that there is no number: it is empty, holds signs alone, or one of [`MISSING`].
pub(crate) fn is_missing(cell: &str) -> bool {
    cell.chars().all(|c| matches!(c, '-' | '*' | '?' | '#' | '.' | '_' | '\u{2013}' | '\u{2014}'))
        || MISSING.contains(&cell.to_lowercase().as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(cell: &str, unit: &str) -> Option<f64> {
        read(cell, unit).unwrap_or_else(|e| panic!("{cell}: {e}")).map(|own| own.value)
    }

    #[test]
    fn words_and_numbers_for_no_reading_are_missing() {
        for cell in
            ["#NV", "#WERT!", "#DIV/0!", "1.#QNAN", "-nan", "<NA>", "NaT", "9.9E37", "+9.91E+37", "-9.9e37", "Fehler", "OVLD", "open"]
        {
            assert_eq!(value(cell, "degC"), None, "{cell}");
        }
        assert_eq!(value("9.8e37", "1"), Some(9.8e37));
    }

    #[test]
    fn units_of_cells_are_converted_or_refused() {
        for (cell, unit, own) in [
            ("12 W", "W", 12.0),
            ("1.5 kW", "W", 1500.0),
            ("50%", "1", 0.5),
            ("50 %", "%", 50.0),
            ("20,5 °C", "degC", 20.5),
            ("300 K", "degC", 300.0 - 273.15),
            ("1e3W", "W", 1000.0),
            ("-2E-3", "1", -2e-3),
        ] {
            let found = value(cell, unit).unwrap();
            assert!((found - own).abs() < 1e-9 * own.abs().max(1.0), "{cell}: {found}");
        }
        for (cell, needle) in [
            ("12 W", "unit of its own"),
            ("12:30", "no number"),
            ("warm", "no number"),
            ("inf", "not finite"),
            ("1'234.5", "thousands"),
            ("1 234,5", "thousands"),
            ("1.234.567", "thousands"),
            ("0 20.5", "several numbers"),
            ("2;5", "no number"),
        ] {
            let message = read(cell, "degC").unwrap_err().to_string();
            assert!(message.contains(needle), "{cell}: {message}");
        }
    }
}
