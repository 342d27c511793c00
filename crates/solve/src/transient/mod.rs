//! Temperatures over time.
//!
//! The solids are integrated by TR-BDF2 (Bank et al., IEEE Trans. Electron Devices 32 (1985) 1992; Hosea and Shampine, Applied
//! Numerical Mathematics 20 (1996) 21): second order, L-stable, both stages with the same matrix. The integrated quantity is enthalpy,
//! so that heat is conserved for any course of the capacity. Over each stage the water moves as parcels along walls held at the stage's
//! own mean (`water`); the heat it brings counts as one integral. In a steady state this becomes the steady state's law.

mod before;
mod control;
mod energy;
mod lumped;
mod modes;
pub mod parcels;
mod passage;
mod plan;
mod settle;
mod stage;
pub mod tr_bdf2;
pub mod water;

use super::steady::Solver;
use super::system::System;
pub use before::Before;
use coldplate_base::error::{Error, Result, Stop};
use coldplate_network::{Load, Network, Stream, StreamState};
pub use control::ControlState;
use control::{ControlledStage, Integration};
pub use energy::{Energy, HeatPassing};
use lumped::LumpedSolver;
use modes::Modes;
use parcels::{Parcel, Parcels};
use stage::{ImplicitStage, SolvedStage};
use tr_bdf2::{EARLIER, GAMMA, OWN};

/// Steps between two hierarchies of the preconditioner, a count. Chosen: setup against iterations.
const RENEWAL: usize = 100;
/// Most rejected trials of one step, a count. Chosen: time against runs that are refused.
const MOST_REJECTIONS: usize = 60;
/// No step is tried again shorter than this, s: no step leads on where heat is drawn from a node that has none left. Chosen.
const SHORTEST: f64 = 1e-9;

/// Ends of given steps that are nearer than this share of the remaining time count as reached, dimensionless. Chosen above rounding.
const SAME_TIME: f64 = 1e-9;

/// Default share of the heat passing through that a step leaves open, dimensionless. Chosen: a run taken up again with another
/// preconditioner comes to temperatures that agree within 1e-9 K.
pub const BALANCE: f64 = 1e-10;

/// How accurately to integrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSettings {
    /// Error allowed in each step, K, at any node.
    pub tolerance: f64,
    /// Longest step, s.
    pub longest: f64,
    /// Share of the heat that passes through which a step may leave open, summed over all nodes.
    pub balance: f64,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self { tolerance: 0.01, longest: f64::INFINITY, balance: BALANCE }
    }
}

/// A machine at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct TransientState {
    /// Time, s.
    pub time: f64,
    /// Temperature of every node, K; water nodes are the ends of their stations.
    pub temperatures: Vec<f64>,
    /// Controllers of the network; empty before the first step if they start from the law alone.
    pub controls: Vec<ControlState>,
    /// Water in each stream from inlet to outlet.
    pub water: Vec<Parcels>,
    /// Next step to try, s; 0 lets the integrator choose.
    pub step: f64,
    /// Steps taken.
    pub steps: usize,
    /// Steps tried again with a smaller size.
    pub rejected: usize,
    /// Heat since the beginning.
    pub energy: Energy,
    /// The step that led here, from which the next one's error is estimated: `None` at the beginning and behind a corner of the
    /// condition, where earlier slopes tell nothing.
    pub before: Option<Before>,
}

/// A network over time.
#[derive(Debug)]
pub struct Transient<'a> {
    network: &'a Network,
    system: System,
    settings: StepSettings,
    preconditioner: Option<stage::Preconditioner>,
    /// Dense solver, for a network of few nodes.
    lumped: Option<LumpedSolver>,
    /// Modes of a linear network, if states between are not asked for.
    strides: Strides,
    /// Ends of the steps that are to be taken, s, whatever their error; empty where the error decides.
    given: Vec<f64>,
}

/// Whether stretches of straight loads may be one exact step.
#[derive(Debug)]
enum Strides {
    /// States between are asked for, or the network is not linear.
    No,
    /// Exact steps are allowed, once the modes are known.
    Wanted,
    Known(Box<Modes>),
}

impl<'a> Transient<'a> {
    /// Sets up the integration of `network`.
    ///
    /// # Errors
    /// The tolerance or the longest step is not positive.
    pub fn new(network: &'a Network, settings: StepSettings) -> Result<Self> {
        if settings.tolerance.is_nan() || settings.tolerance <= 0.0 {
            return Err(Error::input("the tolerance must be positive").at_key("tolerance").read(settings.tolerance));
        }
        if settings.longest.is_nan() || settings.longest <= 0.0 {
            return Err(Error::input("the longest step must be positive").at_key("longest").read(settings.longest));
        }
        let lumped = LumpedSolver::of(network);
        let system = System::new(network);
        let (strides, given) = (Strides::No, Vec::new());
        Ok(Self { network, system, settings, preconditioner: None, lumped, strides, given })
    }

    /// Takes steps that end at given times, s, ascending, whatever their error: two machines that differ by little are compared best in
    /// equal steps. A step that cannot be solved is halved; past the last time the error decides again.
    #[must_use]
    pub fn in_steps(mut self, ends: Vec<f64>) -> Self {
        self.given = ends;
        self
    }

    /// Takes a stretch of straight loads in one exact step, for a linear network of few nodes: states between the ends of
    /// [`Transient::advance`] are of no interest.
    #[must_use]
    pub fn in_strides(mut self) -> Self {
        self.strides = if self.lumped.is_some() && self.network.loops.is_empty() { Strides::Wanted } else { Strides::No };
        self
    }

    /// Whether the network is one of few nodes, whose steps cost little.
    pub fn is_lumped(&self) -> bool {
        self.lumped.is_some()
    }

    /// The steady state of `load`, at time zero.
    ///
    /// # Errors
    /// Errors of [`Solver::new`].
    pub fn from_steady(&self, load: &Load) -> Result<TransientState> {
        let solver = Solver::new(self.network, load)?;
        let solution = solver.steady(load)?;
        let water = steady_water(self.network, load, &solution.streams, &solution.temperatures);
        let controls = ControlState::steady(self.network, load, &solution.temperatures, &solution.shares);
        Ok(TransientState {
            time: 0.0,
            temperatures: solution.temperatures,
            controls,
            water,
            step: 0.0,
            steps: 0,
            rejected: 0,
            energy: Energy::default(),
            before: None,
        })
    }

    /// One temperature (K) everywhere at time zero, held nodes excepted.
    pub fn uniform(&self, load: &Load, temperature: f64) -> TransientState {
        let mut temperatures = vec![temperature; self.network.nodes];
        self.network.hold(load, &mut temperatures);
        let water = even_water(self.network, temperature);
        let (controls, energy) = (Vec::new(), Energy::default());
        TransientState { time: 0.0, temperatures, controls, water, step: 0.0, steps: 0, rejected: 0, energy, before: None }
    }

    /// Sets every node of a part or lumped node to a temperature, K; those that are held keep theirs.
    pub fn set_group(&self, state: &mut TransientState, group: usize, temperature: f64) {
        let held: std::collections::HashSet<usize> = self.network.fixed.iter().map(|(node, _)| *node as usize).collect();
        let own = self.network.group.iter().enumerate().filter(|(node, g)| **g as usize == group && !held.contains(node));
        own.for_each(|(node, _)| state.temperatures[node] = temperature);
    }

    /// Sets the water in a channel to a temperature, K.
    pub fn set_stream(&self, state: &mut TransientState, stream: usize, temperature: f64) {
        let nodes = self.network.streams[stream].first_node as usize..=self.network.streams[stream].outlet() as usize;
        state.temperatures[nodes].fill(temperature);
        state.water[stream].iter_mut().for_each(|parcel| *parcel = Parcel::even(parcel.volume, temperature));
    }

    /// Advances to time `until` (s). `load` gives the condition at a time and must be smooth until then; `seen` is
    /// called after every step. Goes on as the step before ended, if no condition has jumped since; behind any other corner, set
    /// [`TransientState::before`] to `None`.
    ///
    /// # Errors
    /// A condition cannot be evaluated, a step does not converge, the coolant boils or leaves its range, or `seen` fails.
    pub fn advance(
        &mut self,
        state: &mut TransientState,
        until: f64,
        load: &dyn Fn(f64) -> Result<Load>,
        seen: &mut dyn FnMut(&TransientState, &Load) -> Result<()>,
    ) -> Result<()> {
        let mut now = load(state.time)?;
        while state.time < until {
            now = self.towards(state, until, &now, load)?;
            seen(state, &now)?;
        }
        Ok(())
    }

    /// One step that ends at `until` (s) or before it, from the load `now`; returns the load at its end. Arguments are those of
    /// [`Transient::advance`].
    ///
    /// # Errors
    /// Errors of [`Transient::advance`].
    pub fn towards(&mut self, state: &mut TransientState, until: f64, now: &Load, load: &dyn Fn(f64) -> Result<Load>) -> Result<Load> {
        state.before = state.before.take().filter(|before| before.ended_at(state.time, now));
        if let Some(end) = self.stride(state, until, now, load)? {
            return Ok(end);
        }
        let now = &self.begun(state, now)?;
        let mut step = if state.step > 0.0 { state.step } else { self.first_step(state, now) };
        let mut rejections = 0;
        // Length of a step that ends where a thermostat switches, s.
        let mut switches: Option<f64> = None;
        loop {
            let left = until - state.time;
            let given = self.given_step(state.time, until).filter(|_| rejections == 0);
            step = given.unwrap_or(step);
            let is_last = step >= left * (1.0 - 1e-9) && switches.is_none();
            // Two even steps rather than a long one and a sliver.
            let h = if let Some(length) = switches {
                length
            } else if is_last {
                left
            } else if step > 0.5 * left && given.is_none() {
                0.5 * left
            } else {
                step
            };
            let tried = self.step(state, h, now, load);
            let (next, error) = match tried {
                Ok(found) => found,
                Err(e) if rejections >= MOST_REJECTIONS || h < SHORTEST => return Err(e),
                Err(_) => {
                    rejections += 1;
                    state.rejected += 1;
                    (step, switches) = (0.25 * h, None);
                    continue;
                }
            };
            let growth = 0.9 * (self.settings.tolerance / error.max(1e-300)).cbrt();
            if error > self.settings.tolerance && given.is_none() {
                rejections += 1;
                state.rejected += 1;
                if rejections >= MOST_REJECTIONS || h < SHORTEST {
                    return Err(Error::stopped(
                        Stop::TimeStepTooShort,
                        format!("no step is short enough at {:.6} s: {h:.2e} s still gives an error of {error:.2e} K", state.time),
                    )
                    .help("allow a larger tolerance, or look for a jump in the schedule that is no corner of it"));
                }
                (step, switches) = (h * growth.clamp(0.1, 0.7), None);
                continue;
            }
            if let Some(share) = self.switch_within(next.excess) {
                rejections += 1;
                state.rejected += 1;
                if rejections >= MOST_REJECTIONS || h < SHORTEST {
                    return Err(self.chatters(state.time));
                }
                switches = Some(share * h);
                continue;
            }
            let temperatures = std::mem::replace(&mut state.temperatures, next.temperatures);
            state.time = if is_last { until } else { state.time + h };
            let now = if is_last { load(state.time)?.with_shares(self.network, &next.shares) } else { next.load };
            state.advance_controls(h, &next.shares, &next.integrals);
            state.before = Some(Before {
                temperatures,
                between: next.between,
                length: h,
                time: state.time,
                variables: now.variables.clone(),
                flow: next.flow,
                passing: next.passing,
            });
            state.water = next.water;
            state.energy = next.energy;
            state.steps += 1;
            // The step stays as long as it serves: a new one needs a new matrix.
            let grown = if growth > 1.2 {
                h * growth.min(2.5)
            } else if growth < 1.0 {
                h * growth.max(0.5)
            } else {
                h
            };
            state.step = if is_last || switches.is_some() { step.max(grown) } else { grown }.min(self.settings.longest);
            self.network.check_coolant(&now, &state.temperatures)?;
            return Ok(now);
        }
    }

    /// The whole of a stretch in one exact step, and the load at its end; `None` where the network is not linear or its load not
    /// straight.
    fn stride(&mut self, state: &mut TransientState, until: f64, now: &Load, load: &dyn Fn(f64) -> Result<Load>) -> Result<Option<Load>> {
        if until <= state.time {
            return Ok(None);
        }
        self.strides = match std::mem::replace(&mut self.strides, Strides::No) {
            Strides::Known(modes) if modes.hold(now) => Strides::Known(modes),
            Strides::Known(_) | Strides::Wanted => Modes::of(self.network, now).map_or(Strides::No, |m| Strides::Known(Box::new(m))),
            Strides::No => Strides::No,
        };
        let Strides::Known(modes) = &mut self.strides else { return Ok(None) };
        let (middle, end) = (load(f64::midpoint(state.time, until))?, load(until)?);
        if !Modes::is_straight(now, &middle, &end) {
            return Ok(None);
        }
        modes.step(self.network, state, until - state.time, now, &end);
        if state.temperatures.iter().any(|t| !t.is_finite() || *t <= 0.0) {
            return Err(Error::stopped(Stop::NotFinite, format!("a temperature is no longer above absolute zero at {until:.6} s")));
        }
        state.time = until;
        state.steps += 1;
        Ok(Some(end))
    }

    /// The length of the step that is given from a time on, s, not beyond `until`.
    fn given_step(&self, time: f64, until: f64) -> Option<f64> {
        let next = self.given.partition_point(|end| *end <= time + SAME_TIME * (until - time));
        self.given.get(next).map(|end| end.min(until) - time)
    }

    /// A step in which nothing moves by more than a few tolerances.
    fn first_step(&mut self, state: &TransientState, load: &Load) -> f64 {
        let flow = self.solid_flow(load, &state.temperatures);
        let fastest = flow.iter().zip(&self.network.capacity).filter(|(_, c)| **c > 0.0).map(|(f, c)| (f / c).abs()).fold(0.0, f64::max);
        let apart = load
            .inlets
            .iter()
            .flat_map(|t| state.temperatures[..self.network.solids].iter().map(move |s| (s - t).abs()))
            .fold(0.0, f64::max);
        let by_rate = if fastest > 0.0 { 5.0 * self.settings.tolerance / fastest } else { f64::INFINITY };
        let by_water = if apart > self.settings.tolerance { 0.1 } else { f64::INFINITY };
        by_rate.min(by_water).min(60.0).min(self.settings.longest).max(1e-6)
    }

    /// One step of length `h` from `state`: the new state and the estimated error, K.
    fn step(&mut self, state: &TransientState, h: f64, now: &Load, load: &dyn Fn(f64) -> Result<Load>) -> Result<(Taken, f64)> {
        let network = self.network;
        if self.lumped.is_none() && (state.steps.is_multiple_of(RENEWAL) || self.preconditioner.is_none()) {
            self.preconditioner = Some(stage::Preconditioner::new(network, &self.system, now, &state.temperatures)?);
        }
        let (between, end) = (load(state.time + GAMMA * h)?, load(state.time + h)?);
        // Loads in the middle of the stages: their flows carry the water.
        let halfway =
            if network.streams.is_empty() { None } else { Some((load(state.time + 0.5 * GAMMA * h)?, load(state.time + 0.5 * h)?)) };
        let (early, middle) = halfway.as_ref().map_or((&between, &end), |(early, middle)| (early, middle));
        let (begin, passing) = match &state.before {
            Some(before) => (before.flow.clone(), before.passing),
            None => (self.solid_flow(now, &state.temperatures), HeatPassing::at(network, now, &state.temperatures)),
        };

        let rates = self.rates(state, now);
        let guess = self.extrapolated(state, GAMMA * h);
        let mut first = |own: &mut Self, load: &Load| {
            let stage = ImplicitStage {
                duration: GAMMA * h,
                own: OWN * h,
                earlier: vec![(OWN * h, &begin)],
                effective: (0.5, vec![(0.5, &state.temperatures)]),
                begin: now,
                middle: early,
                load,
            };
            own.solve(&stage, state, guess.clone())
        };
        let earlier = Integration { own: OWN * h, earlier: &[(OWN * h, &rates)], shares: state.shares() };
        let at_between = self.controlled_stage(state, &between, earlier, &mut first)?;
        let SolvedStage { temperatures: between_at, flow, passing: passing_between, .. } = at_between.solved;
        let guess = self.continued(state, h, &between_at);
        let mut second = |own: &mut Self, load: &Load| {
            let stage = ImplicitStage {
                duration: h,
                own: OWN * h,
                earlier: vec![(EARLIER * h, &begin), (EARLIER * h, &flow)],
                effective: (OWN, vec![(EARLIER, &state.temperatures), (EARLIER, &between_at)]),
                begin: now,
                middle,
                load,
            };
            own.solve(&stage, state, guess.clone())
        };
        let known: [(f64, &[f64]); 2] = [(EARLIER * h, &rates), (EARLIER * h, &at_between.rates)];
        let earlier = Integration { own: OWN * h, earlier: &known, shares: at_between.shares };
        let ControlledStage { solved, load: end, shares, integrals, .. } = self.controlled_stage(state, &end, earlier, &mut second)?;
        let SolvedStage { temperatures, water, flow, passing: last } = solved;
        let excess = [
            self.excess(state, now, &state.temperatures),
            self.excess(state, &between, &between_at),
            self.excess(state, &end, &temperatures),
        ];

        let error = self.local_error(state, h, &between_at, &temperatures);
        let mut energy = state.energy;
        for (weight, passing) in [(EARLIER, passing), (EARLIER, passing_between), (OWN, last)] {
            energy.add(weight * h * passing.entering, weight * h * passing.leaving);
        }
        energy.add(water.brought.max(0.0) + water.dissipated, (-water.brought).max(0.0));
        energy.stored += water.stored;
        energy.moved += water.stored.abs();
        self.store(&mut energy, &state.temperatures, &temperatures);
        let water = water.parcels;
        Ok((Taken { temperatures, between: between_at, water, energy, load: end, flow, passing: last, shares, integrals, excess }, error))
    }

    /// Counts the heat that the solids took up in a step.
    fn store(&self, energy: &mut Energy, before: &[f64], after: &[f64]) {
        let mut is_held = vec![false; self.network.solids];
        for (node, _) in &self.network.fixed {
            if let Some(held) = is_held.get_mut(*node as usize) {
                *held = true;
            }
        }
        for i in (0..self.network.solids).filter(|i| !is_held[*i]) {
            let (then, now) = (self.network.enthalpy(i, before[i]), self.network.enthalpy(i, after[i]));
            energy.store(now - then, now);
        }
    }
}

/// The water of a steady state: a parcel per station, between the ends of its neighbours.
pub fn steady_water(network: &Network, load: &Load, streams: &[StreamState], temperatures: &[f64]) -> Vec<Parcels> {
    let of = |(s, stream): (usize, &Stream)| {
        let mut above = super::system::entering_temperature(network, load, streams, s, temperatures);
        let mut parcels = Parcels::new();
        for (k, station) in stream.stations.iter().enumerate() {
            let below = temperatures[stream.first_node as usize + k];
            let upstream = std::mem::replace(&mut above, below);
            parcels.push(Parcel { volume: area(stream) * station.length, upstream, downstream: below });
        }
        parcels
    };
    network.streams.iter().enumerate().map(of).collect()
}

/// Water of one temperature (K).
pub fn even_water(network: &Network, temperature: f64) -> Vec<Parcels> {
    let of = |s: &Stream| s.stations.iter().map(|k| Parcel::even(area(s) * k.length, temperature)).collect();
    network.streams.iter().map(of).collect()
}

/// Cross-section of a channel, m².
fn area(stream: &Stream) -> f64 {
    std::f64::consts::PI / 4.0 * stream.diameter * stream.diameter
}

/// A step that was taken.
struct Taken {
    temperatures: Vec<f64>,
    /// Temperatures at the end of the first stage.
    between: Vec<f64>,
    water: Vec<Parcels>,
    energy: Energy,
    /// Load at the end, with the heat into each solid (W) and the heat that passes there.
    load: Load,
    flow: Vec<f64>,
    passing: HeatPassing,
    /// Shares of the controllers at the end, and their integrals.
    shares: Vec<f64>,
    integrals: Vec<f64>,
    /// Excess of thermostats' sensors over the ends of their bands at the three states of the step, K.
    excess: [f64; 3],
}
