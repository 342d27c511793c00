//! Single wrong readings of logs: judged by their neighbours in time, together with the predictions for all three.

use super::grid::{Grid, range, robust};
use super::signs::is_sign;
use super::{Fault, FaultKind, kelvin};
use crate::measurement::Data;
use coldplate_base::units::celsius;

/// Least deviation of a wrong reading from its neighbours, in standard deviations of the noise or of the scatter of the whole
/// log, whichever is larger. Chosen: a smaller one takes noise for faults.
const OFF: f64 = 8.0;
/// Least deviation of a wrong reading, in steps of the last digit. Chosen: a smaller one takes rounding for faults.
const DIGITS: f64 = 5.0;
/// Least ratio of the deviation to the range of the neighbours, two on either side; dimensionless. Chosen: a smaller one takes
/// fronts for faults.
const ALONE: f64 = 3.0;
/// Largest share of the deviation that the prediction may have too, and that another sensor of the row may have. Chosen: a
/// larger one takes effects of the machine for faults.
pub(super) const SHARED: [f64; 2] = [0.3, 0.1];
/// Share of a variable's range by which a condition may leave those of the neighbours. Chosen: beyond it the readings may
/// follow the condition.
pub(super) const LEAVES: f64 = 0.01;

/// Distance of a reading from the line between its neighbours.
struct Bend {
    row: usize,
    /// Rows of the neighbours, two on either side if there are as many.
    near: Vec<usize>,
    /// Distance of the reading, K.
    read: f64,
    /// Distance of the prediction, K.
    predicted: f64,
    /// Standard deviation of the reading less its neighbours, K: the stated noise or the scatter of the log, whichever is
    /// larger.
    noise: f64,
}

impl Bend {
    fn residual(&self) -> f64 {
        self.read - self.predicted
    }
}

/// Readings off their neighbours by a deviation that no neighbour, prediction or other sensor shares.
pub(super) fn wrong_readings(grid: &Grid<'_>) -> Vec<Fault> {
    let tests = grid.data.tests();
    let series = |test: &String| -> Vec<Vec<Bend>> { (0..grid.data.names.len()).map(|k| bends(grid, test, k)).collect() };
    let reaches = reaches(grid.data);
    let mut found = Vec::new();
    for sensors in tests.iter().map(series) {
        for (k, own) in sensors.iter().enumerate() {
            let digit = grid.digit(k);
            for bend in own {
                let (row, off) = (bend.row, bend.residual());
                let is_far = off.abs() > OFF * bend.noise && off.abs() > DIGITS * digit;
                if !is_far || !is_alone(grid, k, bend) || leaves(grid.data, bend, &reaches) {
                    continue;
                }
                let alike = |other: &Bend| other.row == row && other.residual().abs() > (OFF * other.noise).max(SHARED[1] * off.abs());
                if sensors.iter().enumerate().any(|(j, others)| j != k && others.iter().any(alike)) {
                    continue;
                }
                let Some(read) = grid.read[row][k] else { continue };
                let sign = grid.predicted[row][k].is_some_and(|predicted| is_sign(read, predicted));
                let what = if sign { ", the sign of a sensor that does not answer" } else { "" };
                let words = format!("{:.1} degC is {} off its neighbours{what}", celsius(read), kelvin(bend.read));
                found.push(Fault::new(grid.data, FaultKind::WrongReading, vec![(row, k)], Some(k), words));
            }
        }
    }
    found
}

/// All readings of a sensor in a test that have a neighbour on either side.
fn bends(grid: &Grid<'_>, test: &str, k: usize) -> Vec<Bend> {
    let rows: Vec<usize> = grid.rows_of(k).into_iter().filter(|r| grid.data.rows[*r].test == test).collect();
    let time = |r: usize| grid.data.rows[r].time.unwrap_or(0.0);
    let of = |j: usize| -> Option<Bend> {
        let (before, row, after) = (rows[j - 1], rows[j], rows[j + 1]);
        let span = time(after) - time(before);
        let share = if span > 0.0 { (time(row) - time(before)) / span } else { 0.5 };
        let off = |values: &[Vec<Option<f64>>]| Some(values[row][k]? - (1.0 - share) * values[before][k]? - share * values[after][k]?);
        let near = rows[j.saturating_sub(2)..j].iter().chain(&rows[j + 1..(j + 3).min(rows.len())]).copied().collect();
        let (read, predicted) = (off(&grid.read)?, off(&grid.predicted)?);
        let noise = grid.noise[k] * (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt();
        Some(Bend { row, near, read, predicted, noise })
    };
    let mut all: Vec<Bend> = (1..rows.len().saturating_sub(1)).filter_map(of).collect();
    let scatter = robust(all.iter().map(Bend::residual));
    all.iter_mut().for_each(|bend| bend.noise = bend.noise.max(scatter));
    all
}

/// Whether the neighbours lie close together, both as they were read and beside their predictions: at a front they do not.
fn is_alone(grid: &Grid<'_>, k: usize, bend: &Bend) -> bool {
    let read = range(bend.near.iter().filter_map(|r| grid.read[*r][k]));
    let residual = range(bend.near.iter().filter_map(|r| grid.residual(*r, k)));
    let off = bend.residual().abs();
    off > ALONE * residual && bend.read.abs() > ALONE * read && bend.predicted.abs() < SHARED[0] * off
}

/// The range of every variable in the data, SI.
fn reaches(data: &Data) -> Vec<f64> {
    let variables = data.rows[0].condition.si().len();
    (0..variables).map(|v| range(data.rows.iter().map(|row| row.condition.si()[v]))).collect()
}

/// Whether the conditions of a row leave those of its neighbours: then its readings may do so too.
fn leaves(data: &Data, bend: &Bend, reaches: &[f64]) -> bool {
    reaches.iter().enumerate().any(|(v, reach)| {
        let at = |r: usize| data.rows[r].condition.si()[v];
        let low = bend.near.iter().map(|r| at(*r)).fold(f64::INFINITY, f64::min);
        let high = bend.near.iter().map(|r| at(*r)).fold(f64::NEG_INFINITY, f64::max);
        let beyond = (at(bend.row) - high).max(low - at(bend.row));
        beyond > LEAVES * reach && beyond > 0.0
    })
}
