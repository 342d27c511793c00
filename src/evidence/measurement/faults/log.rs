//! Single wrong readings of logs: against their neighbours in time, beside what the machine predicts for all three.

use super::{Fault, FaultKind, Grid, is_sign, kelvin, robust};
use crate::evidence::measurement::Data;
use crate::units::celsius;

/// Standard deviations that a wrong reading is off its neighbours, of the noise or of what the whole log scatters.
const OFF: f64 = 8.0;
/// Digits of the readings that it is off.
const DIGITS: f64 = 5.0;
/// Times that the neighbours differ among each other, two on either side.
const ALONE: f64 = 3.0;
/// Share of its deviation that the prediction, or another sensor of the row, may have alike.
const SHARED: [f64; 2] = [0.3, 0.1];
/// Share of a variable's range by which a condition may leave those of the neighbours.
const LEAVES: f64 = 0.01;

/// How far a reading lies from the line between its neighbours.
struct Bend {
    row: usize,
    /// Rows of the neighbours, two on either side where there are as many.
    near: Vec<usize>,
    /// Of the readings, K.
    read: f64,
    /// Of the predictions, K.
    predicted: f64,
    /// Noise of the reading less its neighbours, K, as stated or as the log scatters.
    noise: f64,
}

impl Bend {
    fn residual(&self) -> f64 {
        self.read - self.predicted
    }
}

/// Readings off their neighbours that nothing else shares.
pub fn wrong_readings(grid: &Grid<'_>) -> Vec<Fault> {
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
    let read = super::range(bend.near.iter().filter_map(|r| grid.read[*r][k]));
    let residual = super::range(bend.near.iter().filter_map(|r| grid.residual(*r, k)));
    let off = bend.residual().abs();
    off > ALONE * residual && bend.read.abs() > ALONE * read && bend.predicted.abs() < SHARED[0] * off
}

/// The range of every variable in the data, SI.
fn reaches(data: &Data) -> Vec<f64> {
    let variables = data.rows[0].condition.si().len();
    (0..variables).map(|v| super::range(data.rows.iter().map(|row| row.condition.si()[v]))).collect()
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
