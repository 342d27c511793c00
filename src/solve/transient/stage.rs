//! One implicit stage: enthalpies, heat flows at its end and the heat water brought over it, in balance.

use super::super::balance::balance_with;
use super::super::csr::for_chunks;
use super::super::jacobian::Jacobian;
use super::super::krylov::{Operator, Outcome, Scratch, gmres};
use super::super::multigrid::{Multigrid, Workspace};
use super::super::system::{System, surface_states};
use super::parcels::{Flow, Parcel, Parcels, Share, mixed};
use super::water::{Carried, Passage};
use super::{Passing, Transient, TransientState};
use crate::discretise::network::{Load, Network, StreamState};
use crate::error::{Error, Result, Stop};

/// Share of the residual that a linear solve may leave: so little that a stage without laws of its own temperature is done with it,
/// and between what single precision carries and what Newton's method can use.
const LINEAR: f64 = 0.3;
const FINEST_LINEAR: f64 = 1e-5;
const COARSEST_LINEAR: f64 = 1e-4;
/// Derivatives of a stage serve as long as each Newton step with them leaves no more than this share.
const SLOW: f64 = 1e-2;
/// Newton steps up to which the heat that passes through is counted anew, and the share of it below which rounding may be what is left.
const SCALED: usize = 1;
const NEARLY: f64 = 1e-6;
pub(super) const MOST_NEWTON: usize = 25;
const MOST_KRYLOV: usize = 200;
/// Ratio of rates that one preconditioner serves alike.
const NEAR: f64 = 1.25;

/// A stage: H(T) = H(begin) + own f(T) + earlier flows + heat from the water along walls at the effective temperature.
pub(super) struct Stage<'s> {
    /// From the beginning of the step, s.
    pub duration: f64,
    /// Weight of the heat flow at the end, s.
    pub own: f64,
    /// Weights (s) and heat flows (W) known already.
    pub earlier: Vec<(f64, &'s [f64])>,
    /// Weights of the end's temperature and of known ones (K) in the effective wall temperature.
    pub effective: (f64, Vec<(f64, &'s [f64])>),
    /// Condition at the beginning of the step.
    pub begin: &'s Load,
    /// Condition in the middle, whose flow carries the water.
    pub middle: &'s Load,
    /// Condition at the end.
    pub load: &'s Load,
}

/// A hierarchy with the capacity over the time step on its diagonal.
#[derive(Debug)]
pub(super) struct Preconditioner {
    multigrid: Multigrid,
    work: Workspace,
    rate: f64,
    solids: usize,
    scratch: Scratch,
}

impl Preconditioner {
    pub fn new(network: &Network, system: &System, load: &Load, temperatures: &[f64]) -> Result<Self> {
        let streams = network.stream_states(load, temperatures)?;
        // Some capacity from the start: what has no path to a given temperature has no steady state, yet a transient.
        let mut symmetric = system.symmetric(network, load, &streams, temperatures);
        let total: f64 = network.capacity.iter().sum();
        if total > 0.0 {
            symmetric.to_given.iter_mut().zip(&network.capacity).for_each(|(g, c)| *g += 1e-9 * c);
        }
        let multigrid = Multigrid::new(&symmetric, &network.capacity)?;
        let work = multigrid.workspace();
        Ok(Self { multigrid, work, rate: 0.0, solids: network.solids, scratch: Scratch::default() })
    }

    /// Takes in the capacity over another time, 1/s: the nearest of rates so near to each other that one serves as well as the next.
    pub fn set(&mut self, rate: f64) -> Result<()> {
        let rate = NEAR.powf((rate.ln() / NEAR.ln()).round());
        if rate != self.rate {
            self.multigrid.shift(rate)?;
            self.rate = rate;
        }
        Ok(())
    }

    /// A linear solve with one V-cycle on the solids per iteration; what is not solid stays as it is.
    pub fn solve(&mut self, matrix: &impl Operator, b: &[f64], x: &mut [f64], tolerance: f64) -> Outcome {
        let Self { multigrid, work, solids, scratch, .. } = self;
        gmres(matrix, b, x, tolerance, MOST_KRYLOV, scratch, |r, z| {
            let (solid, rest) = z.split_at_mut(*solids);
            multigrid.apply(&r[..*solids], solid, work);
            rest.copy_from_slice(&r[*solids..]);
        })
    }
}

/// What the water did in a stage.
#[derive(Debug, Default)]
pub(super) struct Water {
    pub parcels: Vec<Parcels>,
    /// Heat that came with it, less what went with it, J.
    pub brought: f64,
    /// Heat of dissipation, J.
    pub dissipated: f64,
    /// More heat in it than before, J.
    pub stored: f64,
}

/// The streams during a stage, for a given coefficient of each.
pub(crate) struct Streams<'n> {
    network: &'n Network,
    passages: Vec<Passage>,
    /// Weight of each upstream stream in the inlet mixture.
    mixtures: Vec<Vec<f64>>,
}

impl Streams<'_> {
    /// The same without dissipation.
    fn calm(&self) -> Self {
        Self { network: self.network, passages: self.passages.iter().map(Passage::calm).collect(), mixtures: self.mixtures.clone() }
    }

    /// Carries the water of every stream, upstream ones first.
    pub(crate) fn carry(&self, wall: &dyn Fn(usize) -> f64, parcels: &[Parcels], inflows: &[Flow]) -> Vec<Carried> {
        let mut found: Vec<Carried> = vec![Carried::default(); self.passages.len()];
        for (tree, inflow) in self.network.circuits.iter().zip(inflows) {
            for s in crate::discretise::network::stream::members(&tree.layout) {
                let stream = &self.network.streams[s];
                let walls: Vec<f64> = stream.stations.iter().map(|k| k.cells.iter().map(|(n, w)| w * wall(*n)).sum()).collect();
                let entering = self.entering(s, inflow, &found);
                found[s] = self.passages[s].carry(&walls, &parcels[s], &entering);
            }
        }
        found
    }

    /// The parcels as the streams see them: as many cubic metres as each channel holds.
    pub(crate) fn fitted(&self, water: &[Parcels]) -> Vec<Parcels> {
        self.passages.iter().zip(water).map(|(passage, parcels)| fitted(passage, parcels)).collect()
    }

    /// Sets the water nodes to the ends of their stations.
    pub(crate) fn place(&self, temperatures: &mut [f64], carried: &[Carried]) {
        for ((stream, passage), carried) in self.network.streams.iter().zip(&self.passages).zip(carried) {
            let ends = passage.at_ends(&carried.parcels, &carried.outflow);
            let first = stream.first_node as usize;
            temperatures[first..first + ends.len()].copy_from_slice(&ends);
        }
    }

    /// What enters a stream: what its circuit takes in, or what those upstream of it gave off.
    fn entering(&self, s: usize, inflow: &Flow, carried: &[Carried]) -> Flow {
        let upstream = &self.network.streams[s].upstream;
        if upstream.is_empty() {
            return inflow.clone();
        }
        let flows: Vec<(&Flow, f64)> = upstream.iter().zip(&self.mixtures[s]).map(|(u, w)| (&carried[*u].outflow, *w)).collect();
        mixed(&flows)
    }

    /// Whether one of two streams flows into the other within their circuit.
    fn is_above(&self, above: usize, below: usize) -> bool {
        let (above_of, below_of) = (&self.network.streams[above], &self.network.streams[below]);
        above_of.circuit == below_of.circuit && below_of.upstream.contains(&above)
    }

    /// Visits the heat (J) every cell gets: what its station's wall gets, by the cell's own temperature.
    fn heats(&self, wall: &dyn Fn(usize) -> f64, carried: &[Carried], mut visit: impl FnMut(usize, f64)) {
        for (stream, carried) in self.network.streams.iter().zip(carried) {
            for ((station, heat), weight) in stream.stations.iter().zip(&carried.heat).zip(&carried.weight) {
                let mean: f64 = station.cells.iter().map(|(n, w)| w * wall(*n)).sum();
                for (cell, share) in &station.cells {
                    visit(*cell, share * (heat + weight * (mean - wall(*cell))));
                }
            }
        }
    }
}

/// Water with no temperature of its own.
struct Cold {
    parcels: Vec<Parcels>,
    inflows: Vec<Flow>,
}

/// What a stage came to.
pub(super) struct Solved {
    /// K, of every node.
    pub temperatures: Vec<f64>,
    pub water: Water,
    /// Heat into each solid at its end, W.
    pub flow: Vec<f64>,
    /// Heat that passes there.
    pub passing: Passing,
}

/// The linearised stage: solids by their Jacobian, water by carrying a change of the walls along.
struct Linear<'n> {
    jacobian: Jacobian<'n>,
    calm: &'n Streams<'n>,
    cold: &'n Cold,
    rate: f64,
    own: f64,
    solids: usize,
}

impl Operator for Linear<'_> {
    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.jacobian.multiply(x, y);
        y[self.solids..].copy_from_slice(&x[self.solids..]);
        if self.calm.passages.is_empty() {
            return;
        }
        let wall = |n: usize| self.own * x[n];
        let carried = self.calm.carry(&wall, &self.cold.parcels, &self.cold.inflows);
        self.calm.heats(&wall, &carried, |cell, heat| y[cell] -= self.rate * heat);
    }
}

impl Transient<'_> {
    /// Heat that solids exchange with each other and with everything but water: into each node, W.
    pub(super) fn solid_flow(&mut self, load: &Load, temperatures: &[f64]) -> Vec<f64> {
        if let Some(lumped) = &mut self.lumped {
            return lumped.flow(self.network, load, temperatures);
        }
        let mut flow = self.system.residual(self.network, load, &[], temperatures);
        flow.truncate(self.network.solids);
        flow.iter_mut().for_each(|f| *f = -*f);
        flow
    }

    /// Solves a stage of a step from `state`, from a first guess (K).
    pub(super) fn solve(&mut self, stage: &Stage<'_>, state: &TransientState, guess: &[f64]) -> Result<Solved> {
        let network = self.network;
        if let Some(lumped) = &mut self.lumped {
            let temperatures = lumped.solve(network, stage, (&state.temperatures, state.time), guess)?;
            let flow = lumped.flow(network, stage.load, &temperatures);
            let passing = Passing::at(network, stage.load, &temperatures);
            return Ok(Solved { temperatures, water: Water::default(), flow, passing });
        }
        let (solids, rate) = (network.solids, 1.0 / stage.own);
        let mut temperatures = guess.to_vec();
        for (node, index) in &network.fixed {
            temperatures[*node as usize] = stage.load.fixed[*index as usize];
        }
        // What each storing node would hold without the flow at the end.
        let mut target: Vec<f64> = (0..solids).map(|i| network.enthalpy(i, state.temperatures[i])).collect();
        for (weight, flow) in &stage.earlier {
            target.iter_mut().zip(*flow).for_each(|(t, f)| *t += weight * f);
        }
        let effective = |n: usize, t: f64| stage.effective.0 * t + stage.effective.1.iter().map(|(w, known)| w * known[n]).sum::<f64>();

        // Films from the temperatures expected halfway; within the stage the water's law is linear.
        let mut expected = state.temperatures.clone();
        (0..solids).for_each(|n| expected[n] = effective(n, temperatures[n]));
        let states = network.stream_states(stage.middle, &expected)?;
        let streams = streams_of(network, &states, stage.duration);
        let inflows = inflows(stage.begin, stage.load);
        let water = streams.fitted(&state.water);
        let mut preconditioner = match self.preconditioner.take() {
            Some(known) => known,
            None => Preconditioner::new(network, &self.system, stage.load, &state.temperatures)?,
        };
        preconditioner.set(rate)?;
        let still: Vec<StreamState> =
            states.iter().map(|s| StreamState { capacity_rate: 0.0, exchange: vec![0.0; s.exchange.len()], ..s.clone() }).collect();

        // Water of one temperature needs one parcel: it is cut at the stations.
        let cold = Cold {
            parcels: water.iter().map(|parcels| vec![Parcel::even(parcels.iter().map(|p| p.volume).sum(), 0.0)]).collect(),
            inflows: inflows.iter().map(|f| f.iter().map(|s| Share { share: s.share, first: 0.0, last: 0.0 }).collect()).collect(),
        };
        let calm = streams.calm();

        let mut step = vec![0.0; network.nodes];
        let (mut last, mut through) = (f64::INFINITY, 0.0);
        let mut linear: Option<Linear<'_>> = None;
        for newton in 0..=MOST_NEWTON {
            let wall = |n: usize| effective(n, temperatures[n]);
            let carried = streams.carry(&wall, &water, &inflows);
            let surfaces = surface_states(network, stage.load, &temperatures);
            let mut residual = self.system.residual_with(network, stage.load, &[], &temperatures, &surfaces);
            let flow: Vec<f64> = residual[..solids].iter().map(|r| -r).collect();
            let mut magnitude = 0.0;
            for i in 0..solids {
                if network.capacity[i] > 0.0 {
                    let now = network.enthalpy(i, temperatures[i]);
                    residual[i] += rate * (now - target[i]);
                    // A temperature is known to its last place, and so is what is stored at it.
                    magnitude += network.capacity[i] * temperatures[i];
                }
            }
            let mut from_water = 0.0;
            streams.heats(&wall, &carried, |cell, heat| {
                residual[cell] -= rate * heat;
                from_water += heat.abs();
            });
            for (node, _) in &network.fixed {
                residual[*node as usize] = 0.0;
            }
            residual[solids..].fill(0.0);
            let imbalance: f64 = residual.iter().map(|r| r.abs()).sum();
            if !imbalance.is_finite() {
                return Err(Error::stopped(Stop::NotFinite, format!("the temperatures are no longer finite at {:.6} s", state.time)));
            }
            let passing = || Passing::of(&balance_with(network, stage.load, &[], &temperatures, &surfaces));
            // A scale: after the first step it hardly changes.
            let known = (newton <= SCALED).then(passing);
            if let Some(Passing { entering, leaving }) = known {
                through = entering.max(leaving) + from_water * rate;
            }
            let is_balanced = imbalance <= self.settings.balance * through;
            let rounding = if !is_balanced && (newton > SCALED || imbalance <= NEARLY * through) {
                // Water gives its heat by differences of temperatures that are rounded as a whole.
                let films: f64 =
                    states.iter().flat_map(|s| &s.conductance).sum::<f64>() * temperatures.iter().fold(0.0f64, |m, t| m.max(*t));
                self.system.rounding(network, stage.load, &[], &temperatures)
                    + 4.0 * f64::EPSILON * (rate * (magnitude + from_water) + films)
            } else {
                0.0
            };
            // Rounding is a bound that is seldom reached: as long as a step still helps, another is taken.
            let is_spent = imbalance <= rounding && imbalance > 0.3 * last;
            let is_slow = imbalance > SLOW * last;
            last = imbalance;
            if is_balanced || is_spent {
                self.preconditioner = Some(preconditioner);
                let passing = known.unwrap_or_else(passing);
                streams.place(&mut temperatures, &carried);
                return Ok(Solved { temperatures, water: gathered(&streams, &water, &inflows, carried), flow, passing });
            }
            if newton == MOST_NEWTON {
                return Err(Error::stopped(
                    Stop::MostNewtonSteps,
                    format!(
                        "a time step at {:.6} s does not converge: {imbalance:.3e} W of {through:.3e} W are unaccounted for",
                        state.time
                    ),
                ));
            }
            if is_slow || linear.is_none() {
                let mut jacobian = self.system.jacobian_with(network, stage.load, &still, &temperatures, &surfaces);
                let mut capacity: Vec<f64> = (0..solids).map(|i| rate * network.capacity_at(i, temperatures[i])).collect();
                network.fixed.iter().for_each(|(node, _)| capacity[*node as usize] = 0.0);
                jacobian.add_diagonal(capacity.into_iter());
                linear = Some(Linear { jacobian, calm: &calm, cold: &cold, rate, own: stage.effective.0, solids });
            }
            let Some(linear) = &linear else { break };
            residual.iter_mut().for_each(|r| *r = -*r);
            let tolerance = (LINEAR * self.settings.balance * through / imbalance).clamp(FINEST_LINEAR, COARSEST_LINEAR);
            let outcome = preconditioner.solve(linear, &residual, &mut step, tolerance);
            if outcome.is_useless() {
                return Err(Error::stopped(
                    Stop::LinearSolver,
                    format!(
                        "the linear solver stopped at a relative residual of {:.2e} after {} iterations",
                        outcome.relative_residual, outcome.iterations
                    ),
                ));
            }
            // No absolute temperature may more than double or turn negative.
            let factor =
                temperatures.iter().zip(&step).fold(1.0f64, |f, (t, s)| if s.abs() > 0.9 * t { f.min(0.9 * t / s.abs()) } else { f });
            for_chunks(&mut temperatures, |first, part| part.iter_mut().zip(&step[first..]).for_each(|(t, s)| *t += factor * s));
        }
        Err(Error::stopped(Stop::MostNewtonSteps, "a time step does not converge"))
    }
}

/// The streams for a duration (s).
pub(crate) fn streams_of<'n>(network: &'n Network, states: &[StreamState], duration: f64) -> Streams<'n> {
    Streams {
        network,
        passages: network.streams.iter().zip(states).map(|(stream, state)| Passage::new(stream, state, duration)).collect(),
        mixtures: states.iter().map(|s| s.mixture.clone()).collect(),
    }
}

/// The parcels as a passage sees them: as many cubic metres as the channel holds.
fn fitted(passage: &Passage, parcels: &Parcels) -> Parcels {
    let held: f64 = parcels.iter().map(|p| p.volume).sum();
    let scale = passage.volume() / held;
    parcels.iter().map(|p| Parcel { volume: p.volume * scale, ..*p }).collect()
}

/// What enters each circuit over a stage: the inlet temperature runs straight from its value at the beginning.
pub(crate) fn inflows(begin: &Load, end: &Load) -> Vec<Flow> {
    let of_circuit = |(first, last): (&f64, &f64)| vec![Share { share: 1.0, first: *first, last: *last }];
    begin.inlets.iter().zip(&end.inlets).map(of_circuit).collect()
}

/// Sums up what the water did.
fn gathered(streams: &Streams<'_>, before: &[Parcels], inflows: &[Flow], carried: Vec<Carried>) -> Water {
    let mut found = Water::default();
    // Enthalpy counts from one temperature near all others, so that little cancels.
    let zero = inflows.iter().flatten().next().map_or(300.0, |s| s.first);
    let heat = |flow: &Flow| flow.iter().map(|s| s.share * (s.mean() - zero)).sum::<f64>();
    for (c, tree) in streams.network.circuits.iter().enumerate() {
        for s in crate::discretise::network::stream::members(&tree.layout) {
            let passage = &streams.passages[s];
            // The water of each circuit on its own: what one gives to another leaves here and enters there.
            if !(0..carried.len()).any(|above| streams.is_above(above, s)) {
                found.brought += passage.moved() * heat(&streams.entering(s, &inflows[c], &carried));
            }
            let content = |parcels: &Parcels| passage.volumetric() * parcels.iter().map(|p| p.volume * (p.mean() - zero)).sum::<f64>();
            found.stored += content(&carried[s].parcels) - content(&before[s]);
            found.dissipated += carried[s].dissipated;
        }
        // The ends of the circuit: streams that feed no other of it.
        for s in crate::discretise::network::stream::members(&tree.layout) {
            if !(0..carried.len()).any(|below| streams.is_above(s, below)) {
                found.brought -= streams.passages[s].moved() * heat(&carried[s].outflow);
            }
        }
    }
    found.parcels = carried.into_iter().map(|c| c.parcels).collect();
    found
}
