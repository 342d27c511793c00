//! The coolant's part of the Jacobian: films, water properties, flow splits and wall conductivities depend on the
//! temperatures.
//!
//! The states of a circuit's streams depend on the temperatures through few numbers: the mean water and the mean wall temperature of
//! each stream, the temperature of the water that leaves it, and where the wall's conductivity is a table, the mean cell temperature of each station. With such a number m = v·T the
//! derivative of the residual R is the rank-one matrix u vᵀ, u = dR/dm; their sum is left out of the station-by-station Jacobian.

use std::collections::BTreeMap;

use super::stream::{StreamMeans, members};
use super::{Load, NONE, Network, StreamState};
use coldplate_base::error::Result;

/// Step of the mean temperatures for u = dR/dm, K. The properties of water are polynomials over 17.5 K:
/// with four points the error is near (2 x 0.05/17.5)^4 = 1e-9 of the slope.
const STEP: f64 = 0.05;
/// Four-point central difference: places in units of the step, and weights over the step (dimensionless); exact for polynomials of
/// degree four.
pub const STENCIL: [(f64, f64); 4] = [(-2.0, 1.0 / 12.0), (-1.0, -8.0 / 12.0), (1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0)];

/// One of the means of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Moved {
    Wall,
    Water,
    Leaving,
}

impl Moved {
    fn of(self, means: &mut StreamMeans) -> &mut f64 {
        match self {
            Self::Wall => &mut means.wall,
            Self::Water => &mut means.water,
            Self::Leaving => &mut means.leaving,
        }
    }
}

/// The matrix u vᵀ.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RankOne {
    /// u: row and W per K.
    pub rows: Vec<(u32, f64)>,
    /// v: column and weight; the number m that the state depends on is their sum over temperatures.
    pub weights: Vec<(u32, f64)>,
}

impl Network {
    /// The streams' part of the derivative of the residual at `temperatures` (K).
    ///
    /// # Errors
    /// Errors of [`Network::stream_states`].
    pub fn stream_slopes(&self, load: &Load, states: &[StreamState], temperatures: &[f64]) -> Result<Vec<RankOne>> {
        let mut found = Vec::new();
        let means: Vec<StreamMeans> = self.streams.iter().map(|s| s.means(temperatures)).collect();
        for (c, tree) in self.circuits.iter().enumerate() {
            if load.flows[c] == 0.0 {
                continue; // water at rest exchanges nothing
            }
            // Circuits fed by a circuit follow its split.
            let circuits = self.downstream(c);
            for s in members(&tree.layout) {
                for moved in [Moved::Wall, Moved::Water, Moved::Leaving] {
                    let shifted = |by: f64| {
                        let mut means = means.clone();
                        *moved.of(&mut means[s]) += by;
                        let mut states = states.to_vec();
                        let all = circuits.iter().try_for_each(|c| self.circuit_states(*c, load, temperatures, &means, &mut states));
                        all.map(|()| states)
                    };
                    let mut rows = BTreeMap::new();
                    for (place, weight) in STENCIL {
                        let states = shifted(place * STEP)?;
                        for c in &circuits {
                            self.circuit_rows(*c, load, &states, temperatures, |row, heat| {
                                *rows.entry(row).or_insert(0.0) += weight / STEP * heat;
                            });
                        }
                    }
                    // Rounding of heats that did not change is no derivative.
                    let largest = rows.values().fold(0.0, |m: f64, r: &f64| m.max(r.abs()));
                    let rows: Vec<(u32, f64)> = rows.into_iter().filter(|(_, r)| r.abs() > 1e-14 * largest).collect();
                    if largest > 0.0 {
                        found.push(RankOne { rows, weights: self.mean_weights(s, moved) });
                    }
                }
                self.wall_slopes(s, load, states, temperatures, &mut found);
            }
        }
        Ok(found)
    }

    /// Weights of the nodes' temperatures in one of a stream's means.
    fn mean_weights(&self, s: usize, mean: Moved) -> Vec<(u32, f64)> {
        let stream = &self.streams[s];
        if mean == Moved::Leaving {
            return vec![(stream.outlet(), 1.0)];
        }
        let total: f64 = stream.stations.iter().map(|station| station.length).sum();
        let mut weights = BTreeMap::new();
        for (k, station) in stream.stations.iter().enumerate() {
            let share = station.length / total;
            if mean == Moved::Water {
                weights.insert(stream.first_node + k as u32, share);
            } else {
                for (cell, w) in &station.cells {
                    *weights.entry(*cell as u32).or_insert(0.0) += share * w;
                }
            }
        }
        weights.into_iter().collect()
    }

    /// Stations whose wall conducts by a table k(T).
    fn wall_slopes(&self, s: usize, load: &Load, states: &[StreamState], temperatures: &[f64], found: &mut Vec<RankOne>) {
        let (stream, state) = (&self.streams[s], &states[s]);
        let mut entering = self.entering(s, load, states, temperatures);
        for (k, station) in stream.stations.iter().enumerate() {
            let own = stream.first_node + k as u32;
            let slope = self.exchange_slopes(s, k, state, temperatures).wall_temperature;
            if slope != 0.0 {
                let mut rows: Vec<(u32, f64)> = Vec::with_capacity(station.cells.len() + 1);
                for (cell, share) in &station.cells {
                    rows.push((*cell as u32, slope * share * (temperatures[*cell] - entering)));
                }
                rows.push((own, -rows.iter().map(|r| r.1).sum::<f64>()));
                found.push(RankOne { rows, weights: station.cells.iter().map(|(cell, w)| (*cell as u32, *w)).collect() });
            }
            entering = temperatures[own as usize];
        }
    }

    /// How the exchange C (1 - exp(-UA/C)) of station `k` of stream `s` follows film and wall, the rest held.
    pub fn exchange_slopes(&self, s: usize, k: usize, state: &StreamState, temperatures: &[f64]) -> ExchangeSlopes {
        let (stream, station) = (&self.streams[s], &self.streams[s].stations[k]);
        let rate = state.capacity_rate;
        let wetted = std::f64::consts::PI * stream.diameter * station.length;
        let film = 1.0 / (state.film * wetted);
        let (mut spread, mut relative) = (0.0, 0.0);
        if stream.property != NONE {
            let cell: f64 = station.cells.iter().map(|(n, w)| w * temperatures[*n]).sum();
            let mut log_k = 0.0;
            for (axis, weight) in station.across.iter().enumerate() {
                let (k, slope) = self.properties[stream.property as usize + axis].with_slope(cell);
                log_k += weight * k.ln();
                relative += weight * slope / k;
            }
            spread = station.shape / (log_k.exp() * station.length);
        }
        // On fine grids the spread is negative and must not eat up the film: see the stream's state.
        let is_bounded = film + spread < 0.2 * film;
        let resistance = if is_bounded { 0.2 * film } else { film + spread };
        let spread = if is_bounded { 0.0 } else { spread };
        let conductance = 1.0 / (resistance + stream.fouling_resistance / wetted);
        // dE/dR = -exp(-UA/C) UA²
        let steepness = if rate > 0.0 { (-conductance / rate).exp() * conductance * conductance } else { 0.0 };
        ExchangeSlopes {
            log_film: steepness * (resistance - spread),
            log_conductivity: steepness * spread,
            wall_temperature: steepness * spread * relative,
            fouling: -steepness / wetted,
        }
    }

    /// Temperature (K) of the water entering a stream.
    pub fn entering(&self, s: usize, load: &Load, states: &[StreamState], temperatures: &[f64]) -> f64 {
        let stream = &self.streams[s];
        if stream.upstream.is_empty() {
            return load.inlets[stream.circuit];
        }
        let mix = stream.upstream.iter().zip(&states[s].mixture);
        mix.map(|(u, w)| w * temperatures[self.streams[*u].outlet() as usize]).sum()
    }

    /// The part of the residual that a circuit contributes: every cell and water node with its heat, W.
    pub fn circuit_rows(&self, c: usize, load: &Load, states: &[StreamState], temperatures: &[f64], mut visit: impl FnMut(u32, f64)) {
        for s in members(&self.circuits[c].layout) {
            let (stream, state) = (&self.streams[s], &states[s]);
            let mut entering = self.entering(s, load, states, temperatures);
            for (k, station) in stream.stations.iter().enumerate() {
                let own = stream.first_node as usize + k;
                let (mut gained, mut wall) = (0.0, 0.0);
                for (cell, share) in &station.cells {
                    let heat = state.exchange[k] * share * (temperatures[*cell] - entering);
                    visit(*cell as u32, heat);
                    gained += heat;
                    wall += share * temperatures[*cell];
                }
                let balance = if state.capacity_rate > 0.0 {
                    state.capacity_rate * (temperatures[own] - entering) - gained - state.dissipation * station.length
                } else {
                    temperatures[own] - wall
                };
                visit(own as u32, balance);
                entering = temperatures[own];
            }
        }
    }
}

/// Derivatives of a station's exchange, W/K.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExchangeSlopes {
    /// Per relative change of the film, W/K.
    pub log_film: f64,
    /// Per relative change of the wall's conductivity, W/K.
    pub log_conductivity: f64,
    /// Per kelvin of the mean cell temperature, W/K².
    pub wall_temperature: f64,
    /// Per m² K/W of scale, W/K.
    pub fouling: f64,
}
