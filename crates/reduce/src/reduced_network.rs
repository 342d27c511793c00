//! A reduced network: the temperatures of a machine as a combination of few modes.
//!
//! Temperatures of the solids are T = C + V a, with C the temperatures in the middle of the ranges. The heat balance is projected
//! on the modes (Galerkin): Vᵀ R(C + V a) = 0 for the residual R of the network. Linear conduction is one small matrix. A contact,
//! and the heat within a ring of channel wall, is one small matrix for each of a few coefficients ([`OperatorFamily`]). Open faces, and all
//! else that follows the temperature, are handled likewise, linearised at C. Their deviations from the tangents are sampled at a
//! weighted few conductors ([`super::cubature`]), evaluated by their own laws. Water is no part of the modes. It follows the wall
//! along stations ([`super::stations`]), each of which stands for a few of the full network's, and is eliminated exactly.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, DVectorViewMut};
use serde::{Deserialize, Serialize};

use super::conductors::{Conductor, conductors};
use super::interpolation::OperatorFamily;
use super::water::{Alongside, Channels};
use coldplate_base::error::{Error, Result, Stop};
use coldplate_network::stream::members;
use coldplate_network::{Joint, Load, NONE, Network, StreamState};
use coldplate_solve::entering_temperature;

/// The iteration stops when the next step, predicted as the last one times the larger of the last two contraction ratios, is below
/// this, K. Chosen: well below the accuracies asked for, far above rounding.
const STEP_TOLERANCE: f64 = 1e-6;
/// Most steps of the iteration, a count. Chosen: a solution that exists is found in far fewer.
const MOST_STEPS: usize = 60;
/// Least contraction ratio that is believed, dimensionless: a step small by chance must not end the iteration.
/// Chosen: smaller trusts chance, larger costs a step.
const QUICKEST: f64 = 0.05;
/// Contraction ratio, dimensionless, from which the matrix of derivatives is computed anew. Chosen: a matrix costs
/// more than a few slow steps.
const SLOW: f64 = 0.5;
/// Steps of the power iteration for the slowest time constant, a count. Chosen: two digits of it are enough.
const POWER_STEPS: usize = 40;

/// A reduced network: `n` modes, `s` solid nodes of the sampled network, `c` chosen conductors.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ReducedNetwork {
    /// Temperatures that the modes are added to, K: s.
    pub center: DVector<f64>,
    /// Held temperatures in the middle of the ranges, K.
    pub center_held: Vec<f64>,
    /// Matrix of linear conduction and of the contacts at their usual conductances: n x (n + 1), the last column for the temperatures of
    /// the middle. W/K and W.
    pub conduction: DMatrix<f64>,
    /// Heat capacity, J/K: n x n.
    pub capacity: DMatrix<f64>,
    /// Heat stored in the modes: if everything is a kelvin warmer, J/K, and at the temperatures of the middle, J: n
    /// x 2.
    pub stored: DMatrix<f64>,
    /// Heat that leaves the modes per kelvin of each held temperature, W/K: n x temperatures.
    pub held: DMatrix<f64>,
    /// Share of each source's power that reaches the modes: n x sources.
    pub sources: DMatrix<f64>,
    /// Contacts of constant laws.
    pub contacts: Vec<ReducedContact>,
    /// Heat moved around the channel within each station's ring of cells: n x (n + 1), by the exchange of all stations.
    pub rings: OperatorFamily,
    /// Tangents of the conductors that follow the temperature, at the temperatures of the middle: heats (n x 1), slopes at
    /// the first and at the second end (n x n).
    pub tangents: [OperatorFamily; 3],
    /// The sampled network: chosen conductors, a node per station of channel wall, water.
    #[serde(skip)]
    pub network: Network,
    /// Modes at the solid nodes of the sampled network: s x n.
    pub rows: DMatrix<f64>,
    /// Modes at the first end of every chosen conductor less those at the second, times its weight: n x c.
    pub patterns: DMatrix<f64>,
    /// Modes at the first and at the second end of every chosen conductor: n x c.
    pub ends: [DMatrix<f64>; 2],
    /// Modes at the walls of all stations: n x stations.
    pub walls: DMatrix<f64>,
    /// Rise of the modes along each station, then that of the temperatures of the middle, K, and the length along which dissipation
    /// warms the water before it meets the wall, m: (n + 2) x stations. Water that is warmed on its way takes less heat further down.
    pub tilts: DMatrix<f64>,
    /// Heat that the water brings from wall to wall within a station: n x (n + 1), by exchange² over capacity rate of all
    /// stations.
    pub drifts: OperatorFamily,
    /// Modes in each sensor's reading: sensors x n.
    pub readings: DMatrix<f64>,
    /// Part of each sensor's reading from the solids' temperatures of the middle, K.
    pub base: Vec<f64>,
}

/// A contact of a constant law.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ReducedContact {
    /// The joints whose conductances are evaluated.
    pub joints: Vec<Joint>,
    /// Conductances of these joints at the load of the middle, W/K.
    pub usual: Vec<f64>,
    /// Operators of the contact: n x (n + 1).
    pub family: OperatorFamily,
}

impl ReducedContact {
    /// Conductances of the evaluated joints, W/K.
    pub(super) fn conductances<'c>(&'c self, network: &'c Network, load: &'c Load) -> impl Iterator<Item = f64> + 'c {
        self.joints.iter().map(|joint| network.joint_state(joint, 300.0, 300.0, &load.contacts).conductance)
    }
}

/// A solved reduced network.
#[derive(Debug, Clone)]
pub struct ReducedState {
    /// Amplitudes of the modes, K.
    pub amplitudes: DVector<f64>,
    /// Temperatures of the sampled network's nodes, K.
    pub temperatures: Vec<f64>,
    /// State of each stream.
    pub streams: Vec<StreamState>,
    /// Steps of the iteration.
    pub steps: usize,
}

/// Parts of the equations that stay constant while a condition is solved.
pub(super) struct ConstantTerms {
    /// Linear part: n x n, W/K.
    pub(super) linear: DMatrix<f64>,
    /// Heat that leaves the modes at the temperatures of the middle, W.
    pub(super) constant: DVector<f64>,
    /// The chosen conductors at the temperatures of the middle.
    tangents: Vec<Conductor>,
}

impl ReducedNetwork {
    /// Modes.
    pub fn len(&self) -> usize {
        self.rows.ncols()
    }

    /// Whether there is no mode.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether all sizes and indices belong together, as they do unless a file was made up.
    pub(super) fn is_sound(&self) -> bool {
        let (n, net) = (self.len(), &self.network);
        let (solids, count) = (net.solids, self.patterns.ncols());
        let node = |i: &u32| (*i as usize) < net.nodes;
        let solid = |i: u32| (i as usize) < solids;
        let property = |p: u32| p == NONE || (p as usize) < net.properties.len();
        let conductors =
            net.surfaces.len() + net.joints.len() + net.radiative.len() + net.sources.iter().map(|s| s.shares.len()).sum::<usize>();
        let stations: usize = net.streams.iter().map(|s| s.stations.len()).sum();
        let is_joint = |j: &Joint| solid(j.a) && solid(j.b) && property(j.property_a) && property(j.property_b);
        let circuits = net.circuits.len();
        let is_stream = |s: &coldplate_network::Stream| {
            let last = s.first_node as usize + s.stations.len();
            let walls = s.stations.iter().all(|k| k.cells.len() == 1 && (solids.saturating_sub(stations)..solids).contains(&k.cells[0].0));
            walls
                && !s.stations.is_empty()
                && s.water_weights.len() == s.stations.len()
                && last <= net.nodes
                && s.circuit < circuits
                && s.upstream.iter().all(|u| *u < net.streams.len())
                && (s.property as usize + 2 < net.properties.len())
        };
        let square = |m: &DMatrix<f64>, columns: usize| m.shape() == (n, columns);
        let family = |f: &OperatorFamily, members: usize, columns: usize| f.points.iter().all(|p| *p < members) && f.is_of((n, columns));
        self.rows.nrows() == solids
            && self.center.len() == solids
            && net.group.len() == solids
            && stations <= solids
            && conductors == count
            && square(&self.conduction, n + 1)
            && square(&self.capacity, n)
            && square(&self.stored, 2)
            && square(&self.held, self.center_held.len())
            && square(&self.sources, net.sources.len())
            && square(&self.patterns, count)
            && self.ends.iter().all(|e| square(e, count))
            && square(&self.walls, stations)
            && self.tilts.shape() == (n + 2, stations)
            && self.readings.shape() == (net.sensors.len(), n)
            && self.base.len() == net.sensors.len()
            && [&self.rings, &self.drifts].iter().all(|f| family(f, stations, n + 1))
            && self.tangents.iter().zip([1, n, n]).all(|(f, columns)| family(f, count, columns))
            && self.contacts.iter().all(|c| [c.family.points.len(), c.usual.len()] == [c.joints.len(); 2] && c.family.is_of((n, n + 1)))
            && self
                .contacts
                .iter()
                .flat_map(|c| &c.joints)
                .all(|j| property(j.property_a) && property(j.property_b) && (j.contact as usize) < net.contacts.len())
            && net.surfaces.iter().all(|s| solid(s.node) && property(s.property))
            && net.joints.iter().all(is_joint)
            && net.reaches.iter().all(|r| r.nodes.iter().all(|n| solid(*n)))
            && net.radiative.iter().all(|(a, b, _)| solid(*a) && (*b == NONE || solid(*b)))
            && net.sources.iter().all(|s| s.shares.iter().all(|(i, _)| solid(*i)))
            && net.fixed.iter().all(|(i, held)| (*i as usize) + stations < solids && (*held as usize) < self.center_held.len())
            && net.sensors.iter().all(|s| s.weights.iter().all(|(i, _)| node(i)) && s.inlet.is_none_or(|(c, _)| c < circuits))
            && net.streams.iter().all(is_stream)
    }

    /// The steady state of `load` on `network`: the sampled network, or a copy of it with other numbers.
    ///
    /// # Errors
    /// No convergence, or water outside the range of its properties.
    pub fn steady(&self, network: &Network, load: &Load, start: &DVector<f64>) -> Result<ReducedState> {
        let given = self.given(network, load);
        let mut a = start.clone();
        let mut t = self.temperatures(network, load, &a, None);
        let (mut last, mut before_last) = (f64::INFINITY, f64::INFINITY);
        let mut shrank = 1.0;
        let mut factors = None;
        for steps in 0..=MOST_STEPS {
            let streams = network.stream_states(load, &t)?;
            let water = self.channels().alongside(&streams);
            let felt = water.walls_of_steps(&a);
            follow(network, load, &streams, felt.as_slice(), &mut t);
            // A step may be small by chance, so the slower of the last two ratios counts, and no ratio is trusted to be tiny.
            let shrinks = if before_last.is_finite() { (last / before_last).min(1.0) } else { 1.0 };
            if last * shrinks.max(shrank).max(QUICKEST) <= STEP_TOLERANCE {
                network.check_coolant(load, &t)?;
                return Ok(ReducedState { amplitudes: a, temperatures: t, streams, steps });
            }
            shrank = shrinks;
            let now = conductors(network, load, &t);
            let heats = heats(network, load, &streams, felt.as_slice(), &t);
            let residual = self.residual(&given, &now, &water, &heats, &a);
            let lu = match factors.take() {
                Some(lu) if last < SLOW * before_last || before_last.is_infinite() => lu,
                _ => self.jacobian(network, &streams, &water, &given, &now).lu(),
            };
            let Some(step) = lu.solve(&(-residual)).filter(|s| s.iter().all(|v| v.is_finite())) else { break };
            factors = Some(lu);
            a += step;
            let before = t.clone();
            t = self.temperatures(network, load, &a, Some(&before));
            before_last = last;
            last = t[..network.solids].iter().zip(&before).fold(0.0, |m: f64, (t, b)| m.max((t - b).abs()));
            if t[..network.solids].iter().any(|t| *t <= 0.0) {
                break;
            }
        }
        Err(Error::stopped(Stop::MostNewtonSteps, format!("the reduced model found no steady state: the last step moved {last:.2e} K"))
            .help("solve this condition in full"))
    }

    /// State with these amplitudes at a load, its water steady along the walls.
    ///
    /// # Errors
    /// Water outside the range of its properties.
    pub(super) fn state_with(&self, load: &Load, amplitudes: &DVector<f64>) -> Result<ReducedState> {
        let network = &self.network;
        let mut temperatures = self.temperatures(network, load, amplitudes, None);
        // Films follow the temperatures of the water, which follow the films: the first pass is from the inlet's.
        let mut along = || -> Result<Vec<StreamState>> {
            let streams = network.stream_states(load, &temperatures)?;
            let walls = self.channels().alongside(&streams).walls_of_steps(amplitudes);
            follow(network, load, &streams, walls.as_slice(), &mut temperatures);
            Ok(streams)
        };
        along()?;
        let streams = along()?;
        Ok(ReducedState { amplitudes: amplitudes.clone(), temperatures, streams, steps: 0 })
    }

    /// Parts of the level that describe its channels.
    pub(super) fn channels(&self) -> Channels<'_> {
        let Self { network, center, walls, tilts, rings, drifts, .. } = self;
        Channels { network, center, walls, tilts, rings, drifts }
    }

    /// Temperatures of the sampled network, K. Water keeps its temperatures of `before`; without them it is at the
    /// inlet temperatures.
    pub fn temperatures(&self, network: &Network, load: &Load, a: &DVector<f64>, before: Option<&[f64]>) -> Vec<f64> {
        let mut t = match before {
            Some(before) => before.to_vec(),
            None => network.at_inlets(load, 0.0),
        };
        self.set_outside(network, load, a, &mut t);
        self.set_walls(network, a, &mut t);
        t
    }

    /// Sets the temperatures of the sampled network's solids except the walls of channels, which come last.
    pub(super) fn set_outside(&self, network: &Network, load: &Load, a: &DVector<f64>, t: &mut [f64]) {
        self.set(0..network.solids - self.walls.ncols(), a, t);
        network.hold(load, t);
    }

    /// Sets the temperatures of the walls of channels.
    pub(super) fn set_walls(&self, network: &Network, a: &DVector<f64>, t: &mut [f64]) {
        self.set(network.solids - self.walls.ncols()..network.solids, a, t);
    }

    fn set(&self, nodes: Range<usize>, a: &DVector<f64>, t: &mut [f64]) {
        let mut own = DVectorViewMut::from_slice(&mut t[nodes.clone()], nodes.len());
        own.copy_from(&self.center.rows_range(nodes.clone()));
        own.gemv(1.0, &self.rows.rows_range(nodes), a, 1.0);
    }

    /// Parts of the equations that stay constant while a condition is solved.
    pub(super) fn given(&self, network: &Network, load: &Load) -> ConstantTerms {
        let n = self.len();
        let mut wide = self.conduction.clone();
        for contact in &self.contacts {
            let beyond: Vec<f64> = contact.conductances(network, load).zip(&contact.usual).map(|(now, usual)| now - usual).collect();
            if beyond.iter().any(|c| *c != 0.0) {
                contact.family.add(beyond.into_iter(), &mut wide);
            }
        }
        let middle = self.temperatures(network, load, &DVector::zeros(n), None);
        let tangents = conductors(network, load, &middle);
        let mut constant = wide.columns(n, 1).into_owned();
        let [heats, slopes_a, slopes_b] = &self.tangents;
        heats.add(heats.points.iter().map(|p| tangents[*p].heat), &mut constant);
        let mut linear = wide.remove_column(n);
        slopes_a.add(slopes_a.points.iter().map(|p| tangents[*p].slope_a), &mut linear);
        slopes_b.add(slopes_b.points.iter().map(|p| -tangents[*p].slope_b), &mut linear);
        let mut constant: DVector<f64> = constant.column(0).into_owned();
        for ((column, held), middle) in self.held.column_iter().zip(&load.fixed).zip(&self.center_held) {
            constant.axpy(held - middle, &column, 1.0);
        }
        for (column, power) in self.sources.column_iter().zip(&load.powers) {
            constant.axpy(-power, &column, 1.0);
        }
        ConstantTerms { linear, constant, tangents }
    }

    /// Residual of the heat balance, W: heat that leaves the modes. `heats` go into the water of every station, W.
    fn residual(
        &self,
        given: &ConstantTerms,
        now: &[Conductor],
        water: &Alongside,
        heats: &DVector<f64>,
        a: &DVector<f64>,
    ) -> DVector<f64> {
        let mut residual = self.solid_residual(given, now, a);
        residual.gemv(1.0, &water.around.columns(0, self.len()), a, 1.0);
        residual += water.around.column(self.len());
        water.take(heats, 1.0, &mut residual);
        residual
    }

    /// Residual without the water and without the heat it moves around its channels, W.
    pub(super) fn solid_residual(&self, given: &ConstantTerms, now: &[Conductor], a: &DVector<f64>) -> DVector<f64> {
        let mut residual = self.beyond(given, now);
        residual.gemv(1.0, &given.linear, a, 1.0);
        residual += &given.constant;
        residual
    }

    /// Deviation of the chosen conductors from their tangents, projected on the modes, W.
    pub(super) fn beyond(&self, given: &ConstantTerms, now: &[Conductor]) -> DVector<f64> {
        let beyond = now.iter().zip(&given.tangents).map(|(now, tangent)| now.beyond(tangent));
        &self.patterns * DVector::from_iterator(now.len(), beyond)
    }

    /// Derivatives of the residual without the water with respect to the amplitudes, W/K.
    pub(super) fn solid_jacobian(&self, given: &ConstantTerms, now: &[Conductor]) -> DMatrix<f64> {
        let mut slopes = DMatrix::zeros(self.len(), now.len());
        for (e, (now, tangent)) in now.iter().zip(&given.tangents).enumerate() {
            let mut column = slopes.column_mut(e);
            column.axpy(now.slope_a - tangent.slope_a, &self.ends[0].column(e), 0.0);
            column.axpy(tangent.slope_b - now.slope_b, &self.ends[1].column(e), 1.0);
        }
        let mut jacobian = given.linear.clone();
        jacobian.gemm(1.0, &self.patterns, &slopes.transpose(), 1.0);
        jacobian
    }

    /// Derivatives of the residual with respect to the amplitudes, the streams' coefficients held as they are, W/K.
    pub(super) fn jacobian(
        &self,
        network: &Network,
        streams: &[StreamState],
        water: &Alongside,
        given: &ConstantTerms,
        now: &[Conductor],
    ) -> DMatrix<f64> {
        let n = self.len();
        let mut jacobian = self.solid_jacobian(given, now) + water.around.columns(0, n);
        // Derivatives of the heat into the water at every station: by its own wall and, through the water, by the walls
        // upstream.
        let mut slopes = DMatrix::zeros(n, self.walls.ncols());
        let first = firsts(network);
        let mut leaving: Vec<DVector<f64>> = vec![DVector::zeros(n); network.streams.len()];
        for tree in &network.circuits {
            for s in members(&tree.layout) {
                let (stream, state) = (&network.streams[s], &streams[s]);
                let mut slope = DVector::zeros(n);
                for (u, w) in stream.upstream.iter().zip(&state.mixture) {
                    slope.axpy(*w, &leaving[*u], 1.0);
                }
                for (k, exchange) in state.exchange.iter().enumerate() {
                    let share = if state.capacity_rate > 0.0 { exchange / state.capacity_rate } else { 1.0 };
                    let (felt, mut column) = (water.along.felt.column(first[s] + k), slopes.column_mut(first[s] + k));
                    let all = slope.as_mut_slice().iter_mut().zip(felt.as_slice()).zip(column.as_mut_slice());
                    for ((slope, wall), own) in all {
                        let apart = *wall - *slope;
                        *own = exchange * apart;
                        *slope += share * apart;
                    }
                }
                leaving[s] = slope;
            }
        }
        jacobian.gemm(1.0, &water.along.takes, &slopes.transpose(), 1.0);
        jacobian
    }

    /// Readings of all sensors, K.
    pub fn read(&self, network: &Network, load: &Load, state: &ReducedState) -> Vec<f64> {
        self.readings_of(network, load, &state.amplitudes, &state.temperatures)
    }

    /// Readings of all sensors, K, from amplitudes and temperatures of the sampled network.
    pub(super) fn readings_of(&self, network: &Network, load: &Load, a: &DVector<f64>, t: &[f64]) -> Vec<f64> {
        let solids = &self.readings * a;
        let all = network.sensors.iter().zip(solids.iter()).zip(&self.base);
        all.map(|((sensor, rise), base)| base + rise + sensor.read(t, load)).collect()
    }

    /// Largest temperature in a combination of the modes, at the sampled nodes and in the readings, K.
    pub(super) fn largest(&self, a: &DVector<f64>) -> f64 {
        (&self.rows * a).amax().max(self.largest_reading(a))
    }

    /// Largest change of a reading in a combination of the modes, K.
    pub(super) fn largest_reading(&self, a: &DVector<f64>) -> f64 {
        (&self.readings * a).amax()
    }

    /// The slowest time constant at a condition, s.
    ///
    /// # Errors
    /// The condition has no steady state.
    pub fn slowest(&self, load: &Load) -> Result<f64> {
        let state = self.steady(&self.network, load, &DVector::zeros(self.len()))?;
        let given = self.given(&self.network, load);
        let acting = conductors(&self.network, load, &state.temperatures);
        let lu = self.jacobian(&self.network, &state.streams, &self.channels().alongside(&state.streams), &given, &acting).lu();
        let mut a = DVector::from_element(self.len(), 1.0);
        let mut time = 0.0;
        for _ in 0..POWER_STEPS {
            let Some(next) = lu.solve(&(&self.capacity * &a)) else { break };
            (time, a) = (next.norm() / a.norm().max(f64::MIN_POSITIVE), next.normalize());
        }
        Ok(time)
    }
}

/// Sets the water temperatures from the wall temperatures of all stations (K), by one pass downstream.
pub(super) fn follow(network: &Network, load: &Load, streams: &[StreamState], walls: &[f64], t: &mut [f64]) {
    let first = firsts(network);
    for tree in &network.circuits {
        for s in members(&tree.layout) {
            let (stream, state) = (&network.streams[s], &streams[s]);
            let mut above = entering_temperature(network, load, streams, s, t);
            for (k, station) in stream.stations.iter().enumerate() {
                let wall = walls[first[s] + k];
                above = if state.capacity_rate > 0.0 {
                    above + (state.exchange[k] * (wall - above) + state.dissipation * station.length) / state.capacity_rate
                } else {
                    wall
                };
                t[stream.first_node as usize + k] = above;
            }
        }
    }
}

/// Heat into the water of every station (W) from the wall temperatures of all stations and the temperatures of the water (K).
fn heats(network: &Network, load: &Load, streams: &[StreamState], walls: &[f64], t: &[f64]) -> DVector<f64> {
    let mut heats = Vec::with_capacity(walls.len());
    for (s, (stream, state)) in network.streams.iter().zip(streams).enumerate() {
        let mut above = entering_temperature(network, load, streams, s, t);
        for (k, exchange) in state.exchange.iter().enumerate() {
            heats.push(exchange * (walls[heats.len()] - above));
            above = t[stream.first_node as usize + k];
        }
    }
    DVector::from_vec(heats)
}

/// Index of each stream's first station among the stations of all streams.
fn firsts(network: &Network) -> Vec<usize> {
    network.streams.iter().scan(0, |at, s| Some(std::mem::replace(at, *at + s.stations.len()))).collect()
}
