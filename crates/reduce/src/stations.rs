//! Stations of a channel put together. A fine mesh cuts a channel into far more stations than a few dozen modes can tell apart.
//! Water is not reduced, so its cost grows with the number of stations.
//!
//! Only neighbours with the same wall are put together, so that their conductances add and the film between water and wall stays as
//! in the full network. The variation of wall and water along the group is lost beyond second order in its length.

use std::collections::HashSet;
use std::ops::Range;

use coldplate_network::mesh::path::Station;
use coldplate_network::{Network, Stream, StreamState};

/// Difference of shape factors below which stations count as having one wall, dimensionless. Chosen: above rounding
/// of the mesh, below any real change of the wall.
const ALIKE: f64 = 1e-3;

/// The stations of one stream in groups.
#[derive(Debug)]
pub(super) struct Groups {
    groups: Vec<Range<usize>>,
    /// A station for each group.
    pub(super) stations: Vec<Station>,
    /// Weight of each group's leaving water in the mean over the stream, m.
    pub(super) water_weights: Vec<f64>,
}

impl Groups {
    /// Groups of every stream of a network, none longer than the share `longest` of its channel. The water that a sensor
    /// reads leaves a group.
    pub(super) fn of(network: &Network, longest: f64) -> Vec<Self> {
        let read: HashSet<u32> = network.sensors.iter().flat_map(|sensor| &sensor.weights).map(|(node, _)| *node).collect();
        network.streams.iter().map(|stream| Self::of_stream(stream, longest, &read)).collect()
    }

    fn of_stream(stream: &Stream, longest: f64, read: &HashSet<u32>) -> Self {
        let all = &stream.stations;
        let is_cut = |first: usize, k: usize| {
            let (begun, after) = (&all[first], &all[k]);
            // The water that enters the channel is no node, so the first station stands alone.
            k == 1
                || (begun.shape - after.shape).abs() > ALIKE
                || begun.across != after.across
                || read.contains(&(stream.first_node + k as u32 - 1))
        };
        let mut groups = Vec::new();
        let mut first = 0;
        for end in 1..=all.len() {
            if end == all.len() || is_cut(first, end) {
                split(all, first..end, longest * stream.length, &mut groups);
                first = end;
            }
        }
        let stations = groups.iter().map(|group| together(&all[group.clone()])).collect();
        let water_weights = water_weights(all, &groups);
        Self { groups, stations, water_weights }
    }

    /// The stations of each group.
    pub(super) fn members(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.groups.iter().cloned()
    }

    /// Number of groups.
    pub(super) fn len(&self) -> usize {
        self.groups.len()
    }

    /// Last station of a group.
    pub(super) fn last(&self, group: usize) -> usize {
        self.groups[group].end - 1
    }

    /// Weights of the cells of a group's stations in the rise of the wall along the group: the covariance with the distance along it,
    /// as a share of the group.
    pub(super) fn tilts<'s>(&self, stream: &'s Stream, group: Range<usize>) -> impl Iterator<Item = (usize, f64)> + 's {
        let stations = &stream.stations[group];
        let length: f64 = stations.iter().map(|s| s.length).sum();
        let middles = shares(stations).zip(stations).map(move |(end, station)| (station, end - 0.5 * station.length / length));
        middles.flat_map(move |(station, middle)| {
            station.cells.iter().map(move |(cell, share)| (*cell, share * station.length / length * (middle - 0.5)))
        })
    }

    /// Mean length (m) along which dissipation has warmed the water before it meets the walls of a group's stations.
    pub(super) fn delay(&self, stream: &Stream, group: Range<usize>) -> f64 {
        let stations = &stream.stations[group];
        let length: f64 = stations.iter().map(|s| s.length).sum();
        0.5 * (length - stations.iter().map(|s| s.length * s.length).sum::<f64>() / length)
    }

    /// Exchange of every group (W/K) in a state of the stream's own stations.
    pub(super) fn exchange(&self, state: &StreamState) -> Vec<f64> {
        let rate = state.capacity_rate;
        let of = |group: &Range<usize>| match &state.exchange[group.clone()] {
            [one] => *one,
            _ if rate <= 0.0 => 0.0,
            some => rate * (1.0 - some.iter().map(|exchange| 1.0 - exchange / rate).product::<f64>()),
        };
        self.groups.iter().map(of).collect()
    }
}

/// Cuts a run of stations into the fewest groups of about equal length that are no longer than `longest` (m).
fn split(all: &[Station], run: Range<usize>, longest: f64, groups: &mut Vec<Range<usize>>) {
    let length: f64 = all[run.clone()].iter().map(|s| s.length).sum();
    let pieces = (length / longest).ceil().max(1.0);
    let mut first = run.start;
    let (mut passed, mut cuts) = (0.0, 1.0);
    for k in run.clone() {
        passed += all[k].length;
        if k + 1 == run.end || passed >= cuts * length / pieces * (1.0 - 1e-9) {
            groups.push(first..k + 1);
            first = k + 1;
            cuts += 1.0;
        }
    }
}

/// One station in place of several.
fn together(stations: &[Station]) -> Station {
    let length: f64 = stations.iter().map(|s| s.length).sum();
    let cells = stations.iter().flat_map(|s| s.cells.iter().map(move |(cell, share)| (*cell, share * s.length / length)));
    let shape = stations.iter().map(|s| s.shape * s.length / length).sum();
    Station { length, cells: cells.collect(), shape, across: stations[0].across }
}

/// Distance along the group after each station, as a share of the group.
fn shares(stations: &[Station]) -> impl Iterator<Item = f64> + '_ {
    let length: f64 = stations.iter().map(|s| s.length).sum();
    stations.iter().scan(0.0, move |passed, station| {
        *passed += station.length / length;
        Some(*passed)
    })
}

/// Weights of the water after every group such that its mean is that over all stations.
fn water_weights(all: &[Station], groups: &[Range<usize>]) -> Vec<f64> {
    let mut weights = vec![0.0; groups.len()];
    for (g, group) in groups.iter().enumerate() {
        let stations = &all[group.clone()];
        for (station, share) in stations.iter().zip(shares(stations)) {
            weights[g] += station.length * share;
            if g > 0 {
                weights[g - 1] += station.length * (1.0 - share);
            }
        }
    }
    weights
}
