//! Water along the channels of a reduced network. Each of its stations stands for a few of the full network's
//! ([`super::stations`]), and is exact to second order in how far the water comes to the wall's temperature within it.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::family::Family;
use crate::discretise::network::{Network, StreamState};

/// How far what water takes along through a station may change, as a share, before what follows from it is found anew over time: it
/// counts only where walls change within a station.
const SAME: f64 = 1e-3;

/// What water is to the modes along all stations, as far as it follows from what it takes along through each of them.
pub(super) struct Along {
    onward: Vec<Onward>,
    /// How the walls that the water feels follow the amplitudes: n x stations.
    pub(super) felt: DMatrix<f64>,
    /// Those walls in the middle of the ranges, where dissipation warms the water all along, K.
    middle: DVector<f64>,
    /// How much cooler they seem where it warms the water at the end of each of the full network's stations, K.
    delays: DVector<f64>,
    /// What a watt into the water of each station takes from the modes: n x stations.
    pub(super) takes: DMatrix<f64>,
    /// What its dissipation leaves to the modes, W.
    late: DVector<f64>,
}

/// What water is to the modes, its streams' states given.
pub(super) struct Alongside {
    pub(super) along: Rc<Along>,
    /// What goes around the channels within the stations: n x (n + 1), the last column for the temperatures of the middle. W/K and W in a
    /// steady state, J/K and J over a while.
    pub(super) around: DMatrix<f64>,
}

impl Alongside {
    /// Temperatures of the walls (K) that water feels that is warmed by its dissipation all along.
    pub(super) fn walls(&self, a: &DVector<f64>) -> DVector<f64> {
        let mut walls = self.along.middle.clone();
        walls.gemv_tr(1.0, &self.along.felt, a, 1.0);
        walls
    }

    /// The same where dissipation warms it at the end of each of the full network's stations.
    pub(super) fn walls_of_steps(&self, a: &DVector<f64>) -> DVector<f64> {
        self.walls(a) - &self.along.delays
    }

    /// Adds what heats into the water of every station (J in `duration` s, or W in one) take from the modes.
    pub(super) fn take(&self, heats: &DVector<f64>, duration: f64, to: &mut DVector<f64>) {
        to.gemv(1.0, &self.along.takes, heats, 1.0);
        to.axpy(-duration, &self.along.late, 1.0);
    }
}

/// What a reduced network of n modes knows of its channels; see [`super::level::Level`].
pub(super) struct Channels<'l> {
    pub(super) network: &'l Network,
    pub(super) center: &'l DVector<f64>,
    pub(super) walls: &'l DMatrix<f64>,
    pub(super) tilts: &'l DMatrix<f64>,
    pub(super) rings: &'l Family,
    pub(super) drifts: &'l Family,
}

impl Channels<'_> {
    /// In a steady state.
    pub(super) fn alongside(&self, streams: &[StreamState]) -> Alongside {
        let exchange: Vec<f64> = streams.iter().flat_map(|state| &state.exchange).copied().collect();
        self.alongside_over(streams, &exchange, None)
    }

    /// Over a while in which the heat into the water follows the walls of all stations by `weights`, J/K. What is `known` of a moment ago
    /// serves as long as it is about the same.
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

/// What water takes along through a station; nothing where it stands.
struct Onward {
    /// Exchange, W/K.
    exchange: f64,
    /// Exchange as a share of the heat capacity rate.
    transfer: f64,
    /// What dissipation warms it by, K/m.
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
