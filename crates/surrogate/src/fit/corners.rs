//! Corners of the fitted ranges that no row lies in.
//!
//! Each range may be full while the rows fill only part of the box: two variables move together, or one at a time. A fit
//! has no means to know its error in the rest, and its cross-validation never asks there. Two reasons make a corner of
//! two variables *empty*: as many rows with independent values would have had one there, or no row moves both variables.

use coldplate_runtime::{EmptyCorner, format};

use super::model::VariableSpec;

/// Probability that a design of independent values is said to have an empty corner anywhere. Chosen: the usual level.
const CHANCE: f64 = 0.05;
/// Distance, in halves of the ranges, up to which a condition beside the rows counts as among them. Chosen: the same
/// distance makes two measured conditions one (`verdict::update`).
const BESIDE: f64 = 0.05;

/// The empty corners of `rows`, one value per variable each.
///
/// The reach c of a corner is the largest sum u + v that a row has, each value scaled to -1 to 1 and counted towards the
/// corner. With independent variables of the same values, n rows would have on average
/// (pairs of values of all rows with u + v > c) / n rows beyond it, and none with exp(-average). The corner is empty if
/// that is below [`CHANCE`] shared by all corners; or if every row has the commonest value of one of both variables,
/// which leaves their joint effect unknown.
pub fn empty(variables: &[VariableSpec], rows: &[Vec<f64>]) -> Vec<EmptyCorner> {
    let scaled = |k: usize| -> Vec<f64> {
        let VariableSpec { low, high, .. } = variables[k];
        rows.iter().map(|row| (2.0 * row[k] - low - high) / (high - low)).collect()
    };
    let active: Vec<usize> = (0..variables.len()).filter(|k| variables[*k].high > variables[*k].low).collect();
    let values: Vec<Vec<f64>> = active.iter().map(|k| scaled(*k)).collect();
    let corners = 2 * active.len() * active.len().saturating_sub(1);
    let expected = (corners as f64 / CHANCE).ln();
    let mut found = Vec::new();
    for (a, first) in values.iter().enumerate() {
        for (b, second) in values.iter().enumerate().skip(a + 1) {
            let moves_one = moves_one_at_a_time(first, second);
            for is_low in [[false, false], [false, true], [true, false], [true, true]] {
                let towards = |own: &[f64], low: bool| -> Vec<f64> { own.iter().map(|u| if low { -u } else { *u }).collect() };
                let (u, v) = (towards(first, is_low[0]), towards(second, is_low[1]));
                let reach = u.iter().zip(&v).map(|(u, v)| u + v).fold(f64::NEG_INFINITY, f64::max) + BESIDE;
                if reach < 2.0 && (moves_one || rows_expected(&u, v, reach) > expected) {
                    found.push(EmptyCorner { variables: [active[a], active[b]], is_low, reach });
                }
            }
        }
    }
    found
}

/// Rows beyond the reach of a corner, on average, if their values were independent.
fn rows_expected(u: &[f64], mut v: Vec<f64>, reach: f64) -> f64 {
    v.sort_by(f64::total_cmp);
    let beyond: usize = u.iter().map(|u| v.len() - v.partition_point(|v| u + v <= reach)).sum();
    beyond as f64 / u.len() as f64
}

/// Whether every row has the commonest value of one of two variables, although both move.
fn moves_one_at_a_time(first: &[f64], second: &[f64]) -> bool {
    let (u, v) = (commonest(first), commonest(second));
    first.iter().zip(second).all(|(a, b)| *a == u || *b == v)
}

fn commonest(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let longest = sorted.chunk_by(|a, b| a == b).max_by_key(|run| run.len());
    longest.map_or(f64::NAN, |run| run[0])
}

/// Names of the corners, for a note.
pub(super) fn sentence(variables: &[VariableSpec], corners: &[EmptyCorner]) -> String {
    let named = |corner: &EmptyCorner| {
        let end = |k: usize| format!("{} {}", if corner.is_low[k] { "low" } else { "high" }, variables[corner.variables[k]].name);
        format!("{} with {}", end(0), end(1))
    };
    let named: Vec<String> = corners.iter().map(named).collect();
    format!("no row lies in these corners of the ranges, and answers there count as outside: {}", named.join("; "))
}

/// The content of the section of the file.
pub(super) fn section(corners: &[EmptyCorner]) -> Vec<u8> {
    let record = |corner: &EmptyCorner| {
        let [low, high] = corner.is_low.map(u8::from);
        let mut record = [0; format::CORNER_RECORD];
        record[..8].copy_from_slice(&corner.reach.to_le_bytes());
        // A surrogate has at most eight variables.
        record[8..11].copy_from_slice(&[corner.variables[0] as u8, corner.variables[1] as u8, low | high << 1]);
        record
    };
    corners.iter().flat_map(record).collect()
}
