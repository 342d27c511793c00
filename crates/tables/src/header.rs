//! Cells of a header: name, unit, and what the column does between two rows.

use coldplate_base::units::{Dimension, dimension_of, spelled};

/// Words in a header, behind the unit, for what a condition does between two rows of a log: whether it is held.
const BETWEEN: [(&str, bool); 2] = [("held", true), ("joined", false)];
/// Units that names end in behind an underscore, as in `block_degC`. Chosen: units that are no words and no ends of other names.
const BEHIND_UNDERSCORE: [&str; 9] = ["degC", "DegC", "degc", "°C", "degF", "°F", "rpm", "kW", "L/min"];
/// Names of columns of times that are a unit, in small letters, with the unit.
const TIMES: [(&[&str], &str); 4] = [
    (&["seconds", "second", "secs", "sec", "sekunden"], "s"),
    (&["milliseconds", "msec", "millisekunden"], "ms"),
    (&["minutes", "mins", "minuten"], "min"),
    (&["hours", "hrs", "stunden"], "h"),
];
/// Words for a time in front of a unit, as in `elapsed_s`, in small letters.
const TIME_WORDS: [&str; 5] = ["time", "elapsed", "t", "zeit", "laufzeit"];

/// Name, unit, and the character in front of the unit: `name [unit]`, `name (unit)`, `name / unit`, `name in unit`, `name_unit`.
pub(crate) fn split_unit(cell: &str) -> Option<(&str, &str, char)> {
    if let Some(rest) = cell.strip_suffix(']') {
        return rest.rsplit_once('[').map(|(name, unit)| (name.trim(), unit.trim(), '['));
    }
    let is_unit = |unit: &str| spelled(split_between(unit).0).is_some();
    let is_scale = |unit: &str| ["°", "º", "deg"].iter().any(|sign| unit.starts_with(sign));
    let brackets = cell.strip_suffix(')').and_then(|rest| rest.split_once('(')).map(|(name, unit)| (name, unit, '('));
    let slash = cell.split_once(" / ").or_else(|| cell.split_once('/').filter(|(_, unit)| is_scale(unit)));
    let found = brackets
        .or_else(|| slash.map(|(name, unit)| (name, unit, '/')))
        .or_else(|| cell.rsplit_once(" in ").map(|(name, unit)| (name, unit, 'i')))
        .or_else(|| cell.rsplit_once('_').filter(|(_, unit)| BEHIND_UNDERSCORE.contains(unit)).map(|(name, unit)| (name, unit, '_')));
    found.map(|(name, unit, mark)| (name.trim(), unit.trim(), mark)).filter(|(name, unit, _)| !name.is_empty() && is_unit(unit))
}

/// A unit without the word behind it for what the column does between two rows, and whether it is held: `W, held` or `W held`.
pub(crate) fn split_between(unit: &str) -> (&str, Option<bool>) {
    let stated = BETWEEN.iter().find_map(|(word, held)| {
        let rest = unit.strip_suffix(word)?;
        let own = rest.trim_end_matches([',', ';', ' ']);
        (own.len() < rest.len() && !own.is_empty()).then_some((own, Some(*held)))
    });
    stated.unwrap_or((unit, None))
}

/// Cells in which `[unit`, `held]` are one cell again: a comma inside the brackets is none between cells.
pub(crate) fn rejoined(cells: Vec<String>) -> Vec<String> {
    let mut found: Vec<String> = Vec::with_capacity(cells.len());
    for cell in cells {
        let ends = BETWEEN.iter().any(|(word, _)| cell.strip_suffix([']', ')']) == Some(word));
        match found.last_mut().filter(|last| ends && last.contains(['[', '(']) && !last.ends_with([']', ')'])) {
            Some(last) => *last += &format!(", {cell}"),
            None => found.push(cell),
        }
    }
    found
}

/// Whether cells can be a header: one carries a unit, or none is a number.
pub(crate) fn is_header(cells: &[String]) -> bool {
    // A title stands alone in its line, whatever delimiters a spreadsheet puts behind it.
    if cells.len() > 1 && cells.iter().filter(|cell| !cell.is_empty()).count() < 2 {
        return false;
    }
    let has_bracket = |cell: &String| split_unit(cell).is_some_and(|(_, _, bracket)| bracket == '[');
    cells.iter().any(has_bracket) || !cells.iter().any(|cell| is_number(cell))
}

fn is_number(cell: &str) -> bool {
    cell.replace(',', ".").parse::<f64>().is_ok()
}

/// Whether cells below the header are one themselves: none is a number, and one carries a unit in brackets.
pub(crate) fn is_other_header(cells: &[String]) -> bool {
    let has_unit = |cell: &String| split_unit(cell).is_some_and(|(_, unit, mark)| matches!(mark, '[' | '(') && spelled(unit).is_some());
    cells.iter().filter(|cell| !cell.is_empty()).count() > 1 && !cells.iter().any(|cell| is_number(cell)) && cells.iter().any(has_unit)
}

/// Whether cells can be the units of the columns: all that are filled are units, and one at least is no number.
pub(crate) fn is_units(cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
    filled.peek().is_some()
        && filled.all(|cell| spelled(cell).is_some())
        && cells.iter().any(|c| !c.is_empty() && c.parse::<f64>().is_err())
}

/// Unit of a column of times whose name is the unit: `seconds`, `elapsed_s`, `Time min`.
pub(crate) fn unit_of_time(name: &str) -> Option<&'static str> {
    let name = name.to_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let (unit, before) = words.split_last()?;
    let named = TIMES.iter().find(|(names, own)| names.contains(unit) || (!before.is_empty() && own == unit)).map(|(_, own)| *own);
    named.filter(|_| before.iter().all(|word| TIME_WORDS.contains(word)))
}

/// Whether a unit is one of time.
pub(crate) fn is_time(unit: &str) -> bool {
    dimension_of(unit).is_ok_and(|d| d == Dimension::TIME)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_found_in_every_spelling() {
        for (cell, name, unit) in [
            ("block [degC]", "block", "degC"),
            ("block (°C)", "block", "°C"),
            ("block / °C", "block", "°C"),
            ("block/°C", "block", "°C"),
            ("block in °C", "block", "°C"),
            ("flow / L/min", "flow", "L/min"),
            ("block_degC", "block", "degC"),
            ("motor_speed_rpm", "motor_speed", "rpm"),
            ("heater (W, held)", "heater", "W, held"),
        ] {
            assert_eq!(split_unit(cell).map(|(name, unit, _)| (name, unit)), Some((name, unit)), "{cell}");
        }
        for cell in ["block", "in/out", "temperature_min", "warm (left)", "water in motor", "block_C"] {
            assert_eq!(split_unit(cell), None, "{cell}");
        }
    }

    #[test]
    fn a_header_says_what_a_column_does_between_two_rows() {
        assert_eq!(split_between("W, held"), ("W", Some(true)));
        assert_eq!(split_between("kW joined"), ("kW", Some(false)));
        assert_eq!(split_between("held"), ("held", None));
        let cells: Vec<String> = ["heater [W", "held]", "motor [degC]"].map(String::from).to_vec();
        assert_eq!(rejoined(cells), ["heater [W, held]", "motor [degC]"]);
    }

    #[test]
    fn times_are_known_by_the_names_of_their_units() {
        for (name, unit) in [("seconds", "s"), ("Sec", "s"), ("Elapsed_s", "s"), ("time min", "min"), ("Minuten", "min"), ("t_ms", "ms")] {
            assert_eq!(unit_of_time(name), Some(unit), "{name}");
        }
        for name in ["min", "s", "t", "motor_s", "second motor", "h"] {
            assert_eq!(unit_of_time(name), None, "{name}");
        }
    }
}
