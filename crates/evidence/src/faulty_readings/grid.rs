//! Measured data beside predictions, and the scatter of what differs.

use super::Fault;
use crate::measurement::{Data, whiten};

/// Data beside predictions, row by row; readings of faults that were found are taken out on the way.
pub(super) struct Grid<'a> {
    pub(super) data: &'a Data,
    /// Noise of each sensor, K.
    pub(super) noise: &'a [f64],
    /// Readings, K, by row and sensor.
    pub(super) read: Vec<Vec<Option<f64>>>,
    /// Predictions, K, likewise; none if nothing was read.
    pub(super) predicted: Vec<Vec<Option<f64>>>,
}

impl<'a> Grid<'a> {
    /// Grid of data and predictions; `predicted` has one value (K) for every reading.
    pub(super) fn new(data: &'a Data, predicted: &[f64], noise: &'a [f64]) -> Self {
        let read = data.rows.iter().map(|row| row.readings.clone()).collect();
        let mut grid = Self { data, noise, read, predicted: vec![vec![None; data.names.len()]; data.rows.len()] };
        for ((r, k), value) in whiten::places(data).into_iter().zip(predicted) {
            grid.predicted[r][k] = Some(*value);
        }
        grid
    }

    /// Measured less predicted, K.
    pub(super) fn residual(&self, row: usize, sensor: usize) -> Option<f64> {
        Some(self.read[row][sensor]? - self.predicted[row][sensor]?)
    }

    /// Rows in which a sensor was read.
    pub(super) fn rows_of(&self, sensor: usize) -> Vec<usize> {
        (0..self.read.len()).filter(|r| self.read[*r][sensor].is_some()).collect()
    }

    /// Smallest step between readings of a sensor, K; that of all sensors if it shows one value only.
    pub(super) fn digit(&self, sensor: usize) -> f64 {
        let step = |sensors: &mut dyn Iterator<Item = usize>| -> Option<f64> {
            let mut smallest: Option<f64> = None;
            for k in sensors {
                let mut values: Vec<f64> = self.read.iter().filter_map(|row| row[k]).collect();
                values.sort_by(f64::total_cmp);
                let steps = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-9);
                smallest = steps.chain(smallest).min_by(f64::total_cmp);
            }
            smallest
        };
        step(&mut std::iter::once(sensor)).or_else(|| step(&mut (0..self.data.names.len()))).unwrap_or(0.0)
    }

    pub(super) fn take_out(&mut self, fault: &Fault) {
        for (r, k) in &fault.readings {
            self.read[*r][*k] = None;
        }
    }
}

pub(super) fn range(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    (high - low).max(0.0)
}

pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

/// Standard deviation of some deviations, from their median, so that a few wrong ones do not count.
pub(super) fn robust(deviations: impl Iterator<Item = f64>) -> f64 {
    1.4826 * median(deviations.map(f64::abs).collect()).unwrap_or(0.0)
}
