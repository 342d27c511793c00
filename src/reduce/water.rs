//! Water along the channels of a reduced network. Each of its stations stands for a few of the full network's
//! ([`super::stations`]), and is exact to second order in how far the water comes to the wall's temperature within it.

use nalgebra::DVector;

use super::level::Level;
use crate::discretise::mesh::path::Station;
use crate::discretise::network::StreamState;

impl Level {
    /// Sets the walls of all stations in temperatures of the sampled network, as water feels them that is warmed by its dissipation
    /// all along.
    pub(super) fn set_walls(&self, streams: &[StreamState], a: &DVector<f64>, t: &mut [f64]) {
        let rises = self.walls.tr_mul(a);
        let stations = self.network.streams.iter().flat_map(|s| &s.stations);
        for (station, rise) in stations.zip(rises.iter()) {
            let node = station.cells[0].0;
            t[node] = self.center[node] + rise;
        }
        let felt = self.tilted(streams, a, t);
        let stations = self.network.streams.iter().flat_map(|s| &s.stations);
        stations.zip(felt).for_each(|(station, felt)| t[station.cells[0].0] = felt);
    }

    /// Temperatures of the walls (K) that the water feels, station by station, where dissipation warms it at the end of each of the
    /// full network's.
    pub(super) fn felt(&self, streams: &[StreamState], a: &DVector<f64>, t: &[f64]) -> Vec<f64> {
        let delays = self.tilts.row(self.len() + 1);
        let all = self.tilted(streams, a, t).into_iter().zip(onward(streams)).zip(delays.iter());
        all.map(|((wall, on), delay)| wall - on.warming * delay).collect()
    }

    /// Temperatures of the walls, those further down counting for more, K.
    fn tilted(&self, streams: &[StreamState], a: &DVector<f64>, t: &[f64]) -> Vec<f64> {
        let n = self.len();
        let tilts = self.tilts.rows(0, n).tr_mul(a);
        let stations = self.network.streams.iter().flat_map(|s| &s.stations);
        let all = stations.zip(onward(streams)).enumerate();
        let tilted =
            |(at, (station, on)): (usize, (&Station, Onward))| t[station.cells[0].0] + on.transfer * (tilts[at] + self.tilts[(n, at)]);
        all.map(tilted).collect()
    }

    /// Adds what heats into the water of every station (J in `duration` s, or W in one) take from the modes.
    pub(super) fn take(&self, streams: &[StreamState], heats: &DVector<f64>, duration: f64, to: &mut DVector<f64>) {
        to.gemv(1.0, &self.walls, heats, 1.0);
        let stations = self.network.streams.iter().flat_map(|s| &s.stations);
        let all = heats.iter().zip(stations).zip(onward(streams));
        let late = all.map(|((heat, station), on)| on.transfer * heat + duration * on.exchange * on.warming * station.length);
        let late = DVector::from_iterator(heats.len(), late);
        to.gemv(-1.0, &self.tilts.rows(0, self.len()), &late, 1.0);
    }
}

/// What water takes along through a station; nothing where it stands.
struct Onward {
    /// Exchange, W/K.
    exchange: f64,
    /// Exchange as a share of the heat capacity rate.
    transfer: f64,
    /// What dissipation warms it by, K/m.
    warming: f64,
}

fn onward(streams: &[StreamState]) -> impl Iterator<Item = Onward> + '_ {
    streams.iter().flat_map(|state| {
        let inverse = if state.capacity_rate > 0.0 { 1.0 / state.capacity_rate } else { 0.0 };
        let warming = state.dissipation * inverse;
        state.exchange.iter().map(move |exchange| Onward { exchange: *exchange, transfer: exchange * inverse, warming })
    })
}
