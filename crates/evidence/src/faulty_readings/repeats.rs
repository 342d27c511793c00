//! Readings that repeat: copied rows, and sensors that are stuck while everything else moves.

use std::collections::HashMap;

use super::grid::{Grid, median, range};
use super::{Fault, FaultKind, kelvin};
use crate::measurement::ReadingRow;
use coldplate_base::units::celsius;

/// Least number of equal readings of a stuck sensor in a log, and in a steady table; count. Chosen: fewer may be equal by
/// chance.
const STUCK: [usize; 2] = [8, 4];
/// Least range of the prediction over a stuck stretch, in standard deviations of the noise; the other sensors move by half as
/// much. Chosen: a smaller one takes a machine at rest for a stuck sensor.
pub(super) const MOVES: f64 = 20.0;
/// Least range of the prediction over a stuck stretch beyond that, in steps of the last digit. Chosen: a smaller one takes
/// rounding for a stuck sensor.
const DIGITS: f64 = 5.0;
/// Probability of a chance agreement below which equal readings of two rows without names count as copied. Chosen.
const COPIED: f64 = 1e-4;

/// Rows that repeat an earlier reading: only one of them counts.
pub(super) fn duplicates(grid: &Grid<'_>) -> Vec<Fault> {
    let rows = &grid.data.rows;
    // Probability that two readings of a sensor are equal by chance.
    let alike = |k: usize| (grid.digit(k) / (2.0 * std::f64::consts::PI.sqrt() * grid.noise[k].max(1e-12))).min(1.0);
    let alike: Vec<f64> = (0..grid.data.names.len()).map(alike).collect();
    let mut first: HashMap<Vec<u64>, Vec<usize>> = HashMap::new();
    let mut found = Vec::new();
    for (r, row) in rows.iter().enumerate() {
        if row.readings.iter().all(Option::is_none) {
            // In a log the reader has joined the readings of one time.
            let is_again = |before: &ReadingRow| before.time == row.time && before.test == row.test && before.condition == row.condition;
            if row.time.is_some() && r > 0 && is_again(&rows[r - 1]) {
                let words = format!("the same time, conditions and readings as row {r}");
                found.push(Fault {
                    rows: r..=r,
                    line: row.line,
                    test: row.test.clone(),
                    ..Fault::new(grid.data, FaultKind::DuplicateRow, Vec::new(), None, words)
                });
            }
            continue;
        }
        let numbers = row.time.iter().chain(row.condition.si()).copied();
        let readings = row.readings.iter().map(|reading| reading.unwrap_or(f64::NAN));
        let same = first.entry(numbers.chain(readings).map(f64::to_bits).collect()).or_default();
        if let Some(other) = same.iter().find(|other| is_copy(&alike, &rows[**other], row)) {
            let readings = (0..row.readings.len()).filter(|k| row.readings[*k].is_some()).map(|k| (r, k)).collect();
            let words = format!("the same time, conditions and readings as row {}", other + 1);
            found.push(Fault::new(grid.data, FaultKind::DuplicateRow, readings, None, words));
        } else {
            same.push(r);
        }
    }
    found
}

/// Whether two equal rows are one reading. Rows without the name of a test could be two tests with equal results.
fn is_copy(alike: &[f64], one: &ReadingRow, other: &ReadingRow) -> bool {
    if one.test == other.test {
        return true;
    }
    let is_unnamed = |row: &ReadingRow| row.test.starts_with("row ");
    let chance: f64 = one.readings.iter().zip(alike).filter(|(reading, _)| reading.is_some()).map(|(_, alike)| alike).product();
    is_unnamed(one) && is_unnamed(other) && chance < COPIED
}

/// Stretches over which a sensor's readings are equal to the last digit, while its prediction and the other sensors move.
pub(super) fn stuck(grid: &Grid<'_>) -> Vec<Fault> {
    let least = STUCK[usize::from(!grid.data.is_transient())];
    let mut found = Vec::new();
    for k in 0..grid.data.names.len() {
        let rows = grid.rows_of(k);
        let digit = grid.digit(k);
        let is_next = |a: &usize, b: &usize| {
            let is_one_test = !grid.data.is_transient() || grid.data.rows[*a].test == grid.data.rows[*b].test;
            is_one_test && grid.read[*a][k] == grid.read[*b][k]
        };
        for run in rows.chunk_by(is_next).filter(|run| run.len() >= least) {
            let moved = range(run.iter().filter_map(|r| grid.predicted[*r][k]));
            let (first, last) = (run[0], run[run.len() - 1]);
            let others = (0..grid.data.names.len()).filter(|j| *j != k);
            let ranges = others.map(|j| range((first..=last).filter_map(|r| grid.read[r][j])) / grid.noise[j]);
            let around = median(ranges.collect()).unwrap_or(f64::INFINITY);
            if moved > MOVES * grid.noise[k] + DIGITS * digit && around > 0.5 * MOVES {
                let words = format!(
                    "stuck at {:.2} degC in {} readings, while the machine moves it by {}",
                    grid.read[first][k].map_or(f64::NAN, celsius),
                    run.len(),
                    kelvin(moved)
                );
                found.push(Fault::new(grid.data, FaultKind::StuckSensor, run.iter().map(|r| (*r, k)).collect(), Some(k), words));
            }
        }
    }
    found
}
