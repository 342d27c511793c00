//! What heat-flow sensors read, in a steady state and at an instant.

use super::balance::balance;
use super::system::entering_temperature;
use super::transient::TransientState;
use super::transient::parcels::Parcels;
use crate::discretise::network::{Load, Network, Stream, StreamState, Through};
use crate::error::Result;

/// Heat (W) through every heat-flow sensor of the network in a steady state, in the network's order.
pub fn heat_flows(network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Vec<f64> {
    flows(network, load, temperatures, |s| {
        let (stream, state) = (&network.streams[s], &streams[s]);
        let mut entering = entering_temperature(network, load, streams, s, temperatures);
        let mut heat = 0.0;
        for (k, station) in stream.stations.iter().enumerate() {
            heat += station.cells.iter().map(|(cell, share)| state.exchange[k] * share * (temperatures[*cell] - entering)).sum::<f64>();
            entering = temperatures[stream.first_node as usize + k];
        }
        heat
    })
}

/// The same at an instant of a history: into the water by its film and its own temperatures along the channel.
///
/// # Errors
/// As [`Network::stream_states`].
pub fn heat_flows_at(network: &Network, load: &Load, state: &TransientState) -> Result<Vec<f64>> {
    if network.meters.is_empty() {
        return Ok(Vec::new());
    }
    let streams = network.stream_states(load, &state.temperatures)?;
    let into_water = |s: usize| wall_heat(&network.streams[s], &streams[s], &state.water[s], &state.temperatures);
    Ok(flows(network, load, &state.temperatures, into_water))
}

/// The same at temperatures within a step (K), through all that no water is part of.
pub fn heat_flows_within(network: &Network, load: &Load, temperatures: &[f64]) -> Vec<f64> {
    flows(network, load, temperatures, |_| f64::NAN)
}

fn flows(network: &Network, load: &Load, temperatures: &[f64], into_water: impl Fn(usize) -> f64) -> Vec<f64> {
    let has_boundary = network.meters.iter().any(|m| matches!(m.through, Through::Boundary(_)));
    // What boundaries bring does not depend on the water.
    let boundaries = if has_boundary { balance(network, load, &[], temperatures).boundaries } else { Vec::new() };
    let heat = |(joint, sign): &(u32, f64)| sign * network.joint_heat(&network.joints[*joint as usize], temperatures, &load.contacts);
    let of = |through: &Through| match through {
        Through::Joints(joints) => joints.iter().map(heat).sum(),
        Through::Boundary(boundary) => -boundaries[*boundary],
        Through::Stream(s) => into_water(*s),
    };
    network.meters.iter().map(|meter| of(&meter.through)).collect()
}

/// Heat (W) from the wall of a stream into its parcels: the difference to the wall falls exponentially along each piece of a
/// parcel in a station, as it does in a steady flow.
fn wall_heat(stream: &Stream, state: &StreamState, parcels: &Parcels, temperatures: &[f64]) -> f64 {
    let held: f64 = parcels.iter().map(|p| p.volume).sum();
    let length: f64 = stream.stations.iter().map(|s| s.length).sum();
    let (mut heat, mut begin) = (0.0, 0.0);
    let (mut at, mut parcel) = (0.0, 0);
    for (station, ua) in stream.stations.iter().zip(&state.conductance) {
        let (volume, end) = (held * station.length / length, begin + held * station.length / length);
        let wall: f64 = station.cells.iter().map(|(cell, share)| share * temperatures[*cell]).sum();
        let mut from = begin;
        while let Some(p) = parcels.get(parcel) {
            let to = end.min(at + p.volume);
            let along =
                |x: f64| wall - p.upstream - (p.downstream - p.upstream) * ((x - at) / p.volume.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            heat += ua * (to - from).max(0.0) / volume * mean_difference(along(from), along(to));
            from = to;
            if at + p.volume > end {
                break;
            }
            at += p.volume;
            parcel += 1;
        }
        begin = end;
    }
    heat
}

/// Mean of a difference that falls exponentially from one end to the other; straight where it changes its sign.
fn mean_difference(first: f64, last: f64) -> f64 {
    let ratio = last / first;
    if ratio > 0.0 && (ratio - 1.0).abs() > 1e-6 && ratio.is_finite() { (last - first) / ratio.ln() } else { f64::midpoint(first, last) }
}
