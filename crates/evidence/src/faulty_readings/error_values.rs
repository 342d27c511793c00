//! Values that stand for no reading: one number, equal to the last digit, in several readings far from everything around them.
//!
//! An instrument that cannot read shows a number of its own: 988.79, 0.00, 85. In a log, readings jump to it and back at once
//! while conditions, predictions and other sensors stay; in a table, it comes back in rows that the machine keeps apart.

use super::grid::{Grid, range};
use super::log::{LEAVES, SHARED};
use super::repeats::MOVES;
use super::signs::{ABSURD, is_sign};
use super::{Fault, FaultKind, kelvin};
use coldplate_base::units::celsius;

/// Least ratio of the value's distance to the sensor's other changes from row to row (logs) or other residuals (tables); dimensionless.
/// Chosen: a smaller one takes fronts and effects for such values.
const BEYOND: f64 = 5.0;
/// Fewest equal readings of a table that no known sign and no second sensor vouch for, a count. Chosen: two may be equal by chance.
const FEWEST: usize = 3;

/// Stretches of a log, or readings of a table, that show a value in place of a reading.
pub(super) fn error_values(grid: &Grid<'_>) -> Vec<Fault> {
    let groups: Vec<Vec<Vec<usize>>> = (0..grid.data.names.len()).map(|k| equal(grid, k)).collect();
    let mut found = Vec::new();
    for (k, own) in groups.iter().enumerate() {
        for rows in own {
            let Some(value) = grid.read[rows[0]][k] else { continue };
            let is_shared = groups.iter().enumerate().any(|(j, others)| {
                j != k && others.iter().any(|other| grid.read[other[0]][j] == Some(value) && other.iter().any(|r| rows.contains(r)))
            });
            let is_error = if grid.data.is_transient() { jumps(grid, k, rows, is_shared) } else { comes_back(grid, k, rows, is_shared) };
            if is_error {
                let words = format!("{:.2} degC in {} readings stands for no reading", celsius(value), rows.len());
                let off = rows.iter().filter_map(|r| grid.residual(*r, k)).fold(f64::INFINITY, |least, off| least.min(off.abs()));
                let words = if off.is_finite() { format!("{words}: {} off at least", kelvin(off)) } else { words };
                found.push(Fault::new(grid.data, FaultKind::ErrorValue, rows.iter().map(|r| (*r, k)).collect(), Some(k), words));
            }
        }
    }
    found
}

/// Rows of equal readings of a sensor, two at least: stretches of a test in a log, any rows of a table.
fn equal(grid: &Grid<'_>, k: usize) -> Vec<Vec<usize>> {
    let mut rows = grid.rows_of(k);
    let is_log = grid.data.is_transient();
    if !is_log {
        rows.sort_by(|a, b| grid.read[*a][k].unwrap_or(0.0).total_cmp(&grid.read[*b][k].unwrap_or(0.0)));
    }
    let is_next =
        |a: &usize, b: &usize| grid.read[*a][k] == grid.read[*b][k] && (!is_log || grid.data.rows[*a].test == grid.data.rows[*b].test);
    rows.chunk_by(is_next).filter(|run| run.len() > 1).map(<[usize]>::to_vec).collect()
}

/// Whether a stretch of a log is entered and left by a jump that nothing shares.
fn jumps(grid: &Grid<'_>, k: usize, run: &[usize], is_shared: bool) -> bool {
    let test = &grid.data.rows[run[0]].test;
    let rows: Vec<usize> = grid.rows_of(k).into_iter().filter(|r| grid.data.rows[*r].test == *test).collect();
    let Some(first) = rows.iter().position(|r| *r == run[0]) else { return false };
    let last = first + run.len() - 1;
    let read = |r: usize| grid.read[r][k].unwrap_or(f64::NAN);
    // At an end of the log one jump has to do, if the value is known for it.
    let is_known = is_shared || grid.predicted[run[0]][k].is_some_and(|told| is_sign(read(run[0]), told));
    let ends: Vec<(usize, usize)> = first
        .checked_sub(1)
        .map(|before| (rows[before], rows[first]))
        .into_iter()
        .chain(rows.get(last + 1).map(|after| (rows[last], *after)))
        .collect();
    if ends.is_empty() || (ends.len() == 1 && !is_known) {
        return false;
    }
    let value = read(run[0]);
    let others = rows.windows(2).filter(|pair| read(pair[0]) != value && read(pair[1]) != value);
    let usual = others.map(|pair| (read(pair[1]) - read(pair[0])).abs()).fold(0.0, f64::max);
    ends.into_iter().all(|(a, b)| {
        let jump = (read(b) - read(a)).abs();
        let told = grid.predicted[a][k].zip(grid.predicted[b][k]).map_or(0.0, |(a, b)| (b - a).abs());
        let is_followed = (0..grid.data.names.len()).filter(|j| *j != k).any(|j| {
            let step = grid.read[a][j].zip(grid.read[b][j]).map_or(0.0, |(a, b)| (b - a).abs());
            step > SHARED[1] * jump && grid.read[a][j] != Some(value) && grid.read[b][j] != Some(value)
        });
        jump > ABSURD && jump > BEYOND * usual && told < SHARED[1] * jump && !is_followed && stays(grid, a, b)
    })
}

/// Whether the conditions of two rows are the same.
fn stays(grid: &Grid<'_>, a: usize, b: usize) -> bool {
    let at = |r: usize| grid.data.rows[r].condition.si();
    (0..at(a).len()).all(|v| (at(a)[v] - at(b)[v]).abs() <= LEAVES * range(grid.data.rows.iter().map(|row| row.condition.si()[v])))
}

/// Whether equal readings of a table are far from their predictions, unlike the sensor's other readings, while the machine keeps these
/// rows apart.
fn comes_back(grid: &Grid<'_>, k: usize, rows: &[usize], is_shared: bool) -> bool {
    let residual = |r: &usize| grid.residual(*r, k).map(f64::abs);
    let least = rows.iter().filter_map(residual).fold(f64::INFINITY, f64::min);
    let others: Vec<usize> = grid.rows_of(k).into_iter().filter(|r| !rows.contains(r)).collect();
    let usual = others.iter().filter_map(residual).fold(0.0, f64::max);
    if others.len() < 2 || least < ABSURD || least < BEYOND * usual {
        return false;
    }
    let is_known =
        is_shared || rows.iter().all(|r| grid.read[*r][k].zip(grid.predicted[*r][k]).is_some_and(|(read, told)| is_sign(read, told)));
    let moved = range(rows.iter().filter_map(|r| grid.predicted[*r][k]));
    is_known || (rows.len() >= FEWEST && moved > MOVES * grid.noise[k])
}

#[cfg(test)]
mod tests {
    use super::super::{find, without};
    use super::*;
    use crate::measurement::{Data, ReadingRow};
    use coldplate_describe::machine::Condition;

    fn data(is_log: bool, readings: &[[f64; 2]]) -> Data {
        let row = |(r, pair): (usize, &[f64; 2])| ReadingRow {
            test: if is_log { "log".into() } else { format!("t{r}") },
            time: is_log.then_some(60.0 * r as f64),
            condition: Condition::from_si(vec![if is_log { 1.0 } else { r as f64 }]),
            readings: pair.iter().map(|t| Some(t + 273.15)).collect(),
            line: Some(r + 2),
        };
        let rows = readings.iter().enumerate().map(row).collect();
        Data { source: String::new(), sensors: vec![0, 1], names: vec!["a".into(), "b".into()], rows, ..Data::default() }
    }

    fn kinds(is_log: bool, readings: &[[f64; 2]], predicted: &[[f64; 2]]) -> Vec<(FaultKind, usize, bool)> {
        let data = data(is_log, readings);
        let told: Vec<f64> = predicted.iter().flatten().map(|t| t + 273.15).collect();
        let mut faults = find(&data, &told, &[0.05, 0.05]);
        without(&data, &mut faults);
        faults.iter().map(|f| (f.kind, f.count(), f.is_left_out)).collect()
    }

    #[test]
    fn runs_of_one_value_in_logs_are_found_and_plateaus_are_not() {
        let course = |r: usize| [30.0 + 0.1 * r as f64, 25.0 + 0.05 * r as f64];
        let told: Vec<[f64; 2]> = (0..40).map(course).collect();
        for (value, length) in [(988.79, 3), (0.0, 2), (85.0, 12)] {
            let mut read = told.clone();
            read[10..10 + length].iter_mut().for_each(|pair| pair[0] = value);
            assert_eq!(kinds(true, &read, &told), [(FaultKind::ErrorValue, length, true)], "{value}");
        }
        // Two stretches of two sensors, one up to the end of the log.
        let mut read = told.clone();
        read[5..8].iter_mut().for_each(|pair| *pair = [988.79, 988.79]);
        read[30..].iter_mut().for_each(|pair| *pair = [988.79, 988.79]);
        assert_eq!(
            kinds(true, &read, &told).iter().map(|(kind, count, out)| (*kind == FaultKind::ErrorValue, *count, *out)).collect::<Vec<_>>(),
            [(true, 3, true), (true, 3, true), (true, 10, true), (true, 10, true)]
        );
        // A part that cools at once and stays there, as nothing else does, is an effect: it is not left again.
        let mut read = told.clone();
        read[20..].iter_mut().for_each(|pair| pair[0] = 22.0);
        assert!(kinds(true, &read, &told).iter().all(|(kind, ..)| *kind != FaultKind::ErrorValue));
    }

    #[test]
    fn a_value_that_comes_back_in_a_table_is_found() {
        let told: Vec<[f64; 2]> = (0..12).map(|r| [30.0 + 3.0 * r as f64, 25.0 + 2.0 * r as f64]).collect();
        let near: Vec<[f64; 2]> = told.iter().map(|[a, b]| [a + 0.07, b - 0.03]).collect();
        let mut read = near.clone();
        [2, 5, 9].iter().for_each(|r: &usize| read[*r][0] = 988.79);
        assert_eq!(kinds(false, &read, &told), [(FaultKind::ErrorValue, 3, true)]);
        let mut read = near.clone();
        [2, 5].iter().for_each(|r: &usize| read[*r][1] = 0.0);
        assert_eq!(kinds(false, &read, &told), [(FaultKind::ErrorValue, 2, true)]);
        // A heater that does not heat in three rows of one room: equal readings, but the others are off as well.
        let read: Vec<[f64; 2]> = told.iter().map(|[_, b]| [22.0, *b]).collect();
        assert!(kinds(false, &read, &told).iter().all(|(kind, ..)| *kind != FaultKind::ErrorValue));
    }
}
