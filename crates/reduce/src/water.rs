//! Water along the channels of a reduced network. Each station stands for a few of the full network's
//! ([`super::stations`]). The exchange is exact to second order in the share of the temperature difference to the wall
//! that the water loses within it.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::interpolation::OperatorFamily;
use coldplate_network::{Network, StreamState};

/// Relative change of a station's exchange, transfer or warming from which [`Along`] is computed anew over time. Chosen: the effect
/// counts only if the wall temperature varies within a station.
const SAME: f64 = 1e-3;

/// Coupling of the water to the modes along all stations, as far as it follows from exchange and warming within each
/// station.
pub(super) struct Along {
    onward: Vec<Onward>,
    /// Derivatives, with respect to the amplitudes, of the wall temperatures that the water feels: n x stations.
    pub(super) felt: DMatrix<f64>,
    /// Wall temperatures that the water feels in the middle of the ranges, if dissipation warms it all along, K.
    middle: DVector<f64>,
    /// Reduction of these wall temperatures if dissipation warms the water only at the end of each of the full
    /// network's stations, K.
    delays: DVector<f64>,
    /// Heat taken from the modes by a watt into the water of each station: n x stations.
    pub(super) takes: DMatrix<f64>,
    /// Heat that dissipation leaves to the modes, because it warms the water before it meets the wall, W.
    late: DVector<f64>,
}

/// Coupling of the water to the modes for given states of the streams.
pub(super) struct Alongside {
    pub(super) along: Rc<Along>,
    /// Heat moved around the channels within the stations: n x (n + 1), the last column for the temperatures of the middle. W/K and W in
    /// a steady state, J/K and J over a time step.
    pub(super) around: DMatrix<f64>,
}

impl Alongside {
    /// Wall temperatures (K) that the water feels, if dissipation warms it all along.
    pub(super) fn walls(&self, a: &DVector<f64>) -> DVector<f64> {
        let mut walls = self.along.middle.clone();
        walls.gemv_tr(1.0, &self.along.felt, a, 1.0);
        walls
    }

    /// Wall temperatures (K) that the water feels, if dissipation warms it only at the end of each of the full
    /// network's stations.
    pub(super) fn walls_of_steps(&self, a: &DVector<f64>) -> DVector<f64> {
        self.walls(a) - &self.along.delays
    }

    /// Adds the heat that the modes lose to the water: `heats` go into the water of every station (J in `duration` s,
    /// or W in one).
    pub(super) fn take(&self, heats: &DVector<f64>, duration: f64, to: &mut DVector<f64>) {
        to.gemv(1.0, &self.along.takes, heats, 1.0);
        to.axpy(-duration, &self.along.late, 1.0);
    }
}

/// Channels of a reduced network of n modes; see [`super::reduced_network::Level`].
pub(super) struct Channels<'l> {
    pub(super) network: &'l Network,
    pub(super) center: &'l DVector<f64>,
    pub(super) walls: &'l DMatrix<f64>,
    pub(super) tilts: &'l DMatrix<f64>,
    pub(super) rings: &'l OperatorFamily,
    pub(super) drifts: &'l OperatorFamily,
}

impl Channels<'_> {
    /// Coupling in a steady state.
    pub(super) fn alongside(&self, streams: &[StreamState]) -> Alongside {
        let exchange: Vec<f64> = streams.iter().flat_map(|state| &state.exchange).copied().collect();
        self.alongside_over(streams, &exchange, None)
    }

    /// Coupling over a time step in which the heat into the water follows the walls of all stations by `weights`, J/K. `known` from a
    /// moment ago is kept as long as it is about right.
    pub(super) fn alongside_over(&self, streams: &[StreamState], weights: &[f64], known: Option<&Rc<Along>>) -> Alongside {
        let onward: Vec<Onward> = onward(streams).collect();
        let mut around = DMatrix::zeros(self.walls.nrows(), self.walls.nrows() + 1);
        self.rings.add(self.rings.points.iter().map(|k| weights[*k]), &mut around);
        self.drifts.add(self.drifts.points.iter().map(|k| weights[*k] * onward[*k].transfer), &mut around);
        let known = known.filter(|known| known.onward.iter().zip(&onward).all(|(then, now)| now.is_about(then)));
        Alongside { along: known.map_or_else(|| Rc::new(self.along(onward)), Rc::clone), around }
    }

    fn along(&self, onward: Vec<Onward>) -> Along {
        let (n, count) = (self.walls.nrows(), self.walls.ncols());
        let (mut felt, mut takes) = (Vec::with_capacity(n * count), Vec::with_capacity(n * count));
        let (mut middle, mut delays, mut late) = (DVector::zeros(count), DVector::zeros(count), DVector::zeros(n));
        let stations = self.network.streams.iter().flat_map(|s| &s.stations);
        for (at, (station, on)) in stations.zip(&onward).enumerate() {
            let (wall, tilt) = (self.walls.column(at), self.tilts.column(at));
            let both = wall.as_slice().iter().zip(tilt.as_slice());
            felt.extend(both.clone().map(|(wall, tilt)| wall + on.transfer * tilt));
            takes.extend(both.map(|(wall, tilt)| wall - on.transfer * tilt));
            middle[at] = self.center[station.cells[0].0] + on.transfer * tilt[n];
            delays[at] = on.warming * tilt[n + 1];
            late.axpy(on.exchange * on.warming * station.length, &tilt.rows(0, n), 1.0);
        }
        let [felt, takes] = [felt, takes].map(|columns| DMatrix::from_vec(n, count, columns));
        Along { onward, felt, middle, delays, takes, late }
    }
}

/// Exchange and warming of the water within a station; both ratios are zero if the water stands still.
struct Onward {
    /// Exchange, W/K.
    exchange: f64,
    /// Exchange as a share of the heat capacity rate.
    transfer: f64,
    /// Warming of the water by dissipation, K/m.
    warming: f64,
}

impl Onward {
    fn is_about(&self, then: &Self) -> bool {
        let pairs = [(self.exchange, then.exchange), (self.transfer, then.transfer), (self.warming, then.warming)];
        pairs.iter().all(|(now, then)| (now - then).abs() <= SAME * then.abs())
    }
}

fn onward(streams: &[StreamState]) -> impl Iterator<Item = Onward> + '_ {
    streams.iter().flat_map(|state| {
        let inverse = if state.capacity_rate > 0.0 { 1.0 / state.capacity_rate } else { 0.0 };
        let warming = state.dissipation * inverse;
        state.exchange.iter().map(move |exchange| Onward { exchange: *exchange, transfer: exchange * inverse, warming })
    })
}
