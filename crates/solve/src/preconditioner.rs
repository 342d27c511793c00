//! Preconditioner of a network with water: solids by one cycle of multigrid, the water by one pass along the streams.

use super::multigrid::{Multigrid, Workspace};
use coldplate_network::stream::members;
use coldplate_network::{Network, StreamState};

/// Approximate solution (K) of the linearised network for a right-hand side (W): solids by one cycle, then the water downstream.
pub(super) fn downstream(
    network: &Network,
    streams: &[StreamState],
    multigrid: &Multigrid,
    r: &[f64],
    z: &mut [f64],
    work: &mut Workspace,
) {
    let (solid_right, right) = r.split_at(network.solids);
    let (solid, water) = z.split_at_mut(network.solids);
    multigrid.apply(solid_right, solid, work);
    for s in network.circuits.iter().flat_map(|tree| members(&tree.layout)) {
        let (stream, state) = (&network.streams[s], &streams[s]);
        let first = stream.first_node as usize - solid.len();
        let outlet = |u: &usize| water[network.streams[*u].outlet() as usize - solid.len()];
        let mut above: f64 = stream.upstream.iter().zip(&state.mixture).map(|(u, w)| w * outlet(u)).sum();
        for (k, station) in stream.stations.iter().enumerate() {
            let wall: f64 = station.cells.iter().map(|(n, w)| w * solid[*n]).sum();
            let (rate, exchange) = (state.capacity_rate, state.exchange[k]);
            above =
                if rate > 0.0 { (right[first + k] + (rate - exchange) * above + exchange * wall) / rate } else { right[first + k] + wall };
            water[first + k] = above;
        }
    }
}

/// Approximate solution of the transposed network: the water against its flow, then solids by one cycle.
pub(super) fn upstream(network: &Network, streams: &[StreamState], multigrid: &Multigrid, r: &[f64], z: &mut [f64], work: &mut Workspace) {
    let mut right = r.to_vec();
    let (solid_right, water_right) = right.split_at_mut(network.solids);
    let (solid, water) = z.split_at_mut(network.solids);
    let order: Vec<usize> = network.circuits.iter().flat_map(|tree| members(&tree.layout)).collect();
    for s in order.into_iter().rev() {
        let (stream, state) = (&network.streams[s], &streams[s]);
        let first = stream.first_node as usize - solid.len();
        let rate = state.capacity_rate;
        for (k, station) in stream.stations.iter().enumerate().rev() {
            let exchange = state.exchange[k];
            // Value of this node, and the coefficients by which it adds to the node above and to the cells of the wall.
            let (own, carried, given) =
                if rate > 0.0 { (water_right[first + k] / rate, rate - exchange, exchange) } else { (water_right[first + k], 0.0, 1.0) };
            water[first + k] = own;
            station.cells.iter().for_each(|(n, w)| solid_right[*n] += given * w * own);
            if k > 0 {
                water_right[first + k - 1] += carried * own;
            } else {
                for (u, w) in stream.upstream.iter().zip(&state.mixture) {
                    water_right[network.streams[*u].outlet() as usize - solid.len()] += w * carried * own;
                }
            }
        }
    }
    multigrid.apply(solid_right, solid, work);
}
