//! Columns of numbers without a unit that are times of a log by their names or their course.

use std::collections::BTreeMap;

use super::TEST;
use coldplate_tables::{Table, TextColumn};

/// Names of columns of times, in small letters and without blanks and signs.
const NAMES: [&str; 15] =
    ["t", "ts", "x", "xvalue", "s", "sec", "secs", "seconds", "min", "minutes", "h", "hours", "zeit", "laufzeit", "tijd"];
/// Beginnings of such names.
const BEGINNINGS: [&str; 3] = ["time", "elapsed", "reltime"];
/// Fewest rows of a test by which a column of such a name is times, and one of another name, counts. Chosen: any three numbers may
/// rise, and twenty in even steps hardly ever do.
const FEWEST: [usize; 2] = [3, 20];
/// Largest deviation of an even step from the median, as a share of it. Chosen: loggers keep their interval that well.
const EVEN: f64 = 0.01;

/// Whether a column without a unit holds numbers that rise in every test: in any steps if it is called so, otherwise in even steps
/// other than one, which would number the rows.
pub(super) fn is_like_times(table: &Table, column: &TextColumn) -> bool {
    let name: String = column.name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    let is_called_so = NAMES.contains(&name.as_str()) || BEGINNINGS.iter().any(|own| name.starts_with(own));
    let values = column.values.iter().map(|cell| cell.trim().replace(',', ".").parse().ok()).collect::<Option<Vec<f64>>>();
    values.is_some_and(|values| rises(table, &values, is_called_so))
}

/// Whether numbers rise in every test: in any steps if they are `known` as times, otherwise in many even ones other than one.
pub(super) fn rises(table: &Table, values: &[f64], known: bool) -> bool {
    let mut tests: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (r, value) in values.iter().enumerate() {
        tests.entry(table.text(TEST).map_or("", |t| &t.values[r])).or_default().push(*value);
    }
    let rises = |values: &Vec<f64>| {
        let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let is_still = steps.iter().all(|step| *step == 0.0);
        if values.len() < FEWEST[usize::from(!known)] || is_still || !steps.iter().all(|step| *step >= 0.0) {
            return false;
        }
        steps.sort_by(f64::total_cmp);
        let usual = steps[steps.len() / 2];
        known || (usual != 1.0 && steps.iter().all(|step| (step - usual).abs() <= EVEN * usual))
    };
    !tests.is_empty() && tests.values().all(rises)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_without_a_unit_are_told_from_numbers_of_rows() {
        let is_times = |name: &str, step: f64, rows: usize| {
            let values = (0..rows).map(|r| (step * r as f64).to_string()).collect();
            let table = Table { texts: vec![TextColumn { name: name.into(), values }], ..Table::default() };
            is_like_times(&table, &table.texts[0])
        };
        assert!(is_times("X_Value", 1.0, 5) && is_times("elapsed", 0.5, 5) && is_times("t", 10.0, 3) && is_times("channel 0", 0.1, 30));
        assert!(!is_times("Nr.", 1.0, 50) && !is_times("run", 10.0, 6) && !is_times("t", 0.0, 9) && !is_times("t", -1.0, 9));
    }
}
