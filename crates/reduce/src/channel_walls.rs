//! Walls along the channels of a reduced network: a station for each group of the full network's
//! ([`super::stations`]), and the losses of putting them together, to second order.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::assemble::{Assembly, Snapshot};
use super::interpolation::OperatorFamily;
use super::stations::Groups;
use coldplate_network::Stream;
use coldplate_network::mesh::path::Station;

/// Longest groups of stations that are tried, as shares of their channel, from the longest on; the last entry leaves all
/// stations alone. Chosen: longer groups make an answer faster, and the losses of each are computed.
const LONGEST: [f64; 8] = [1.0 / 6.0, 1.0 / 12.0, 1.0 / 24.0, 1.0 / 36.0, 1.0 / 48.0, 1.0 / 72.0, 1.0 / 96.0, 0.0];
/// Cutoff, per kelvin of accuracy, as a share of the largest exchange: for heat moved around the channel within a ring of cells
/// (tenths of a kelvin at most). Chosen: with 0.1 the bound at 150 000 cells asked for twice the solves.
const RINGS: f64 = 0.01;
/// Cutoff, per kelvin of accuracy, as a share of the largest: for heat that the water carries along a group of stations
/// (hundredths of a kelvin). Chosen ten times [`RINGS`], because these heats are smaller.
const DRIFTS: f64 = 0.1;

impl Assembly<'_> {
    /// The longest groups of stations by which no reading of these states loses more than `allowed` (K).
    pub(super) fn along(&self, modes: &[Vec<f64>], snapshots: &[Snapshot], readings: &DMatrix<f64>, allowed: f64) -> Vec<Groups> {
        let walls = |stream: &Stream| stream.stations.iter().map(|station| self.wall(modes, station)).collect();
        let walls: Vec<Vec<DVector<f64>>> = self.network.streams.par_iter().map(walls).collect();
        let groups = LONGEST.iter().map(|longest| Groups::of(self.network, *longest));
        let lost = |along: &Vec<Groups>| snapshots.par_iter().map(|shot| self.lost(shot, along, &walls, readings)).reduce(|| 0.0, f64::max);
        groups.into_iter().find(|along| lost(along) <= allowed).unwrap_or_else(|| Groups::of(self.network, 0.0))
    }

    /// Loss of a state if stations are put together, K: in the water that leaves a stream, and in the readings through the heat
    /// of the walls. Modes are scaled so that a watt moves them by a kelvin.
    fn lost(&self, shot: &Snapshot, along: &[Groups], walls: &[Vec<DVector<f64>>], readings: &DMatrix<f64>) -> f64 {
        let n = readings.ncols();
        let (mut apart, mut water): (DVector<f64>, f64) = (DVector::zeros(n), 0.0);
        for (s, (groups, stream)) in along.iter().zip(&self.network.streams).enumerate() {
            let (state, rate) = (&shot.streams[s], shot.streams[s].capacity_rate);
            if rate <= 0.0 || groups.len() == stream.stations.len() {
                continue;
            }
            let wall = |station: &Station| -> f64 {
                station.cells.iter().map(|(cell, share)| share * (self.center[*cell] + shot.rise[*cell])).sum()
            };
            let (mut above, mut above_group) = (shot.entering[s], shot.entering[s]);
            for ((group, all), exchange) in groups.stations.iter().zip(groups.members()).zip(groups.exchange(state)) {
                let mean = wall(group);
                let mean_modes =
                    all.clone().fold(DVector::zeros(n), |sum, k| sum + &walls[s][k] * (stream.stations[k].length / group.length));
                let (mut tilt, mut tilt_modes, mut taken, mut passed) = (0.0, DVector::zeros(n), 0.0, 0.0);
                for k in all.clone() {
                    let (station, own) = (&stream.stations[k], state.exchange[k]);
                    let share = station.length / group.length;
                    let (warmer, modes) = (wall(station) - mean, &walls[s][k] - &mean_modes);
                    let heat = own * (mean + warmer - above);
                    apart.axpy(heat, &walls[s][k], 1.0);
                    above += (heat + state.dissipation * station.length) / rate;
                    apart.axpy(exchange * exchange / rate * share * taken - own * warmer, &modes, 1.0);
                    tilt += share * (passed + 0.5 * share - 0.5) * warmer;
                    tilt_modes.axpy(share * (passed + 0.5 * share - 0.5), &modes, 1.0);
                    taken += share * warmer;
                    passed += share;
                }
                let transfer = exchange / rate;
                let delay = state.dissipation / rate * groups.delay(stream, all);
                let heat = exchange * (mean + transfer * tilt - delay - above_group);
                let warmer = (heat + state.dissipation * group.length) / rate;
                apart.axpy(-heat, &mean_modes, 1.0);
                apart.axpy(exchange * warmer, &tilt_modes, 1.0);
                above_group += warmer;
            }
            water = water.max((above - above_group).abs());
        }
        (readings * apart).amax().max(water)
    }

    /// Heat moved around the channel: within the ring of cells of a group it depends on each cell's temperature, not on their
    /// mean.
    pub(super) fn rings(&self, modes: &[Vec<f64>], snapshots: &[Snapshot], along: &[Groups]) -> OperatorFamily {
        let n = modes.len();
        let of_groups = columns(snapshots, |shot| by_group(shot, along, |exchange, _| exchange));
        let of_stations = columns(snapshots, |shot| shot.streams.iter().flat_map(|state| &state.exchange).copied().collect());
        let operator = |weights: &[f64]| {
            let mut sum = DMatrix::zeros(n, n + 1);
            let mut weights = weights.iter();
            for (groups, stream) in along.iter().zip(&self.network.streams) {
                for (group, all) in groups.stations.iter().zip(groups.members()) {
                    let wall = self.wall(modes, group);
                    let mean = self.middle(group);
                    for (station, weight) in stream.stations[all].iter().zip(&mut weights) {
                        for (cell, share) in &station.cells {
                            let apart = self.at(modes, *cell as u32) - &wall;
                            sum.columns_mut(0, n).ger(weight * share, &apart, &apart, 1.0);
                            sum.column_mut(n).axpy(weight * share * (self.center[*cell] - mean), &apart, 1.0);
                        }
                    }
                }
            }
            sum
        };
        OperatorFamily::told(&of_groups, &of_stations, RINGS * self.accuracy, operator)
    }

    /// Heat that the water brings, within a group of stations, from walls further up to those further down.
    pub(super) fn drifts(&self, modes: &[Vec<f64>], snapshots: &[Snapshot], along: &[Groups]) -> OperatorFamily {
        let n = modes.len();
        let carried = |exchange: f64, rate: f64| if rate > 0.0 { exchange * exchange / rate } else { 0.0 };
        let samples = columns(snapshots, |shot| by_group(shot, along, carried));
        let operator = |weights: &[f64]| {
            let mut sum = DMatrix::zeros(n, n + 1);
            let mut weights = weights.iter();
            for (groups, stream) in along.iter().zip(&self.network.streams) {
                for ((group, all), weight) in groups.stations.iter().zip(groups.members()).zip(&mut weights) {
                    let wall = self.wall(modes, group);
                    let mean = self.middle(group);
                    // Heat taken so far from walls that are warmer than the mean of the group.
                    let mut taken = DVector::zeros(n + 1);
                    for station in &stream.stations[all] {
                        let share = station.length / group.length;
                        let apart = self.wall(modes, station) - &wall;
                        sum.ger(-weight * share, &apart, &taken, 1.0);
                        taken.rows_mut(0, n).axpy(share, &apart, 1.0);
                        taken[n] += share * (self.middle(station) - mean);
                    }
                }
            }
            sum
        };
        OperatorFamily::new(&samples, DRIFTS * self.accuracy, operator)
    }

    /// Rise of the modes and of the temperatures of the middle along each group of stations, and the length along which its
    /// dissipation has warmed the water before it meets the wall: (n + 2) x groups.
    pub(super) fn tilts(&self, modes: &[Vec<f64>], along: &[Groups]) -> DMatrix<f64> {
        let n = modes.len();
        let of = |(groups, stream): (&Groups, &Stream)| -> Vec<DVector<f64>> {
            let tilt = |group: Range<usize>| {
                let delay = groups.delay(stream, group.clone());
                let mut tilt = groups.tilts(stream, group).fold(DVector::zeros(n + 2), |mut sum: DVector<f64>, (cell, weight)| {
                    sum.rows_mut(0, n).axpy(weight, &self.at(modes, cell as u32), 1.0);
                    sum[n] += weight * self.center[cell];
                    sum
                });
                tilt[n + 1] = delay;
                tilt
            };
            groups.members().map(tilt).collect()
        };
        let columns: Vec<DVector<f64>> = along.iter().zip(&self.network.streams).flat_map(of).collect();
        DMatrix::from_fn(n + 2, columns.len(), |i, at| columns[at][i])
    }

    pub(super) fn wall(&self, modes: &[Vec<f64>], station: &Station) -> DVector<f64> {
        station.cells.iter().fold(DVector::zeros(modes.len()), |sum, (cell, share)| sum + self.at(modes, *cell as u32) * *share)
    }

    /// Mean temperature of a station's wall in the middle of the ranges, K.
    pub(super) fn middle(&self, station: &Station) -> f64 {
        station.cells.iter().map(|(cell, share)| share * self.center[*cell]).sum()
    }
}

/// A column for each state.
fn columns(snapshots: &[Snapshot], of: impl Fn(&Snapshot) -> Vec<f64>) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = snapshots.iter().map(|shot| DVector::from_vec(of(shot))).collect();
    DMatrix::from_columns(&columns)
}

/// Values of `of` at exchange and heat capacity rate (W/K) of the groups of all streams in a state.
fn by_group(shot: &Snapshot, along: &[Groups], of: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let all = along.iter().zip(&shot.streams);
    all.flat_map(|(groups, state)| groups.exchange(state).into_iter().map(|exchange| of(exchange, state.capacity_rate))).collect()
}
