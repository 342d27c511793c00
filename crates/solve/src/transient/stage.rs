//! One implicit stage: enthalpies, heat flows at its end and the heat water brought over it, in balance.

use super::super::balance::balance_with;
use super::super::csr::for_chunks;
use super::super::jacobian::Jacobian;
use super::super::krylov::{Operator, Outcome, Scratch, gmres};
use super::super::multigrid::{Multigrid, Workspace};
use super::super::surfaces::Outside;
use super::super::system::System;
use super::water::{Streams, Water, inflows};
use super::{Passing, Transient, TransientState};
use coldplate_base::error::{Error, Result, Stop};
use coldplate_network::{Load, Network, StreamState};

/// Share of the final residual, the one that Newton's method must reach, that a linear solve may leave; dimensionless. Chosen: a stage
/// without laws of its own temperature is then done in one step.
const LINEAR: f64 = 0.3;
/// Tightest relative residual of a linear solve, dimensionless: as much as single precision carries. Chosen.
const FINEST_LINEAR: f64 = 1e-5;
/// Loosest relative residual of a linear solve, dimensionless: as little as Newton's method can use. Chosen.
const COARSEST_LINEAR: f64 = 1e-4;
/// Derivatives of a stage serve as long as each Newton step with them leaves no more than this share of the residual, dimensionless.
/// Chosen: matrices against Newton steps.
const SLOW: f64 = 1e-2;
/// The heat passing through is recomputed up to this Newton step, a count. Chosen: after it the heat hardly changes.
const SCALED: usize = 1;
/// The residual can be rounding only below this share of the heat passing through, dimensionless. Chosen.
const NEARLY: f64 = 1e-6;
/// Most Newton steps of a stage, a count. Chosen: time against steps that are halved.
pub(super) const MOST_NEWTON: usize = 25;
/// Most iterations of a linear solve, a count. Chosen: time against steps that are halved.
const MOST_KRYLOV: usize = 200;
/// Ratio of rates that one preconditioner serves alike, dimensionless. Chosen: setups against iterations.
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
        // Some capacity from the start: a part without a path to a given temperature has no steady state, yet a transient.
        let mut symmetric = system.symmetric(network, load, &streams, temperatures);
        let total: f64 = network.capacity.iter().sum();
        if total > 0.0 {
            symmetric.to_given.iter_mut().zip(&network.capacity).for_each(|(g, c)| *g += 1e-9 * c);
        }
        let multigrid = Multigrid::new(&symmetric, &network.capacity)?;
        let work = multigrid.workspace();
        Ok(Self { multigrid, work, rate: 0.0, solids: network.solids, scratch: Scratch::default() })
    }

    /// Sets the rate (1/s) of the capacity on the diagonal, rounded to a power of [`NEAR`]: neighbouring rates serve equally well.
    pub fn set(&mut self, rate: f64) -> Result<()> {
        let rate = NEAR.powf((rate.ln() / NEAR.ln()).round());
        if rate != self.rate {
            self.multigrid.shift(rate)?;
            self.rate = rate;
        }
        Ok(())
    }

    /// A linear solve with one V-cycle on the solids per iteration; other nodes stay as they are.
    pub fn solve(&mut self, matrix: &impl Operator, b: &[f64], x: &mut [f64], tolerance: f64) -> Outcome {
        let Self { multigrid, work, solids, scratch, .. } = self;
        gmres(matrix, b, x, tolerance, MOST_KRYLOV, scratch, |r, z| {
            let (solid, rest) = z.split_at_mut(*solids);
            multigrid.apply(&r[..*solids], solid, work);
            rest.copy_from_slice(&r[*solids..]);
        })
    }
}

/// Result of a stage.
pub(super) struct Solved {
    /// Temperature of every node, K.
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
    cold: &'n Streams<'n>,
    rate: f64,
    own: f64,
    solids: usize,
}

impl Operator for Linear<'_> {
    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.jacobian.multiply(x, y);
        y[self.solids..].copy_from_slice(&x[self.solids..]);
        if self.cold.is_empty() {
            return;
        }
        let wall = |n: usize| self.own * x[n];
        let passed = self.cold.carry(&wall);
        self.cold.heats(&wall, &passed, |cell, heat| y[cell] -= self.rate * heat);
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
        // Enthalpy of each storing node without the flow at the end.
        let mut target: Vec<f64> = (0..solids).map(|i| network.enthalpy(i, state.temperatures[i])).collect();
        for (weight, flow) in &stage.earlier {
            target.iter_mut().zip(*flow).for_each(|(t, f)| *t += weight * f);
        }
        let effective = |n: usize, t: f64| stage.effective.0 * t + stage.effective.1.iter().map(|(w, known)| w * known[n]).sum::<f64>();

        // Films from the temperatures expected halfway; within the stage the water's law is linear.
        let mut expected = state.temperatures.clone();
        (0..solids).for_each(|n| expected[n] = effective(n, temperatures[n]));
        let states = network.stream_states(stage.middle, &expected)?;
        let streams = Streams::new(network, &states, stage.duration, &state.water, inflows(stage.begin, stage.load));
        let mut preconditioner = match self.preconditioner.take() {
            Some(known) => known,
            None => Preconditioner::new(network, &self.system, stage.load, &state.temperatures)?,
        };
        preconditioner.set(rate)?;
        let still: Vec<StreamState> =
            states.iter().map(|s| StreamState { capacity_rate: 0.0, exchange: vec![0.0; s.exchange.len()], ..s.clone() }).collect();

        let mut step = vec![0.0; network.nodes];
        let (mut last, mut through) = (f64::INFINITY, 0.0);
        let cold = std::cell::OnceCell::new();
        let mut linear: Option<Linear<'_>> = None;
        for newton in 0..=MOST_NEWTON {
            let wall = |n: usize| effective(n, temperatures[n]);
            let passed = streams.carry(&wall);
            let outside = Outside::new(network, stage.load, &temperatures);
            let mut residual = self.system.residual_with(network, stage.load, &[], &temperatures, &outside);
            let flow: Vec<f64> = residual[..solids].iter().map(|r| -r).collect();
            let mut magnitude = 0.0;
            for i in 0..solids {
                if network.capacity[i] > 0.0 {
                    let now = network.enthalpy(i, temperatures[i]);
                    residual[i] += rate * (now - target[i]);
                    // A temperature is known to its last place, and so is the heat stored at it.
                    magnitude += network.capacity[i] * temperatures[i];
                }
            }
            let mut from_water = 0.0;
            streams.heats(&wall, &passed, |cell, heat| {
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
            let passing = || Passing::of(&balance_with(network, stage.load, &[], &temperatures, &outside.surfaces));
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
                self.system.rounding(network, &[], &temperatures, &outside) + 4.0 * f64::EPSILON * (rate * (magnitude + from_water) + films)
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
                let water = streams.moved(&passed, &mut temperatures);
                return Ok(Solved { temperatures, water, flow, passing });
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
                let mut jacobian = self.system.jacobian_with(network, stage.load, &still, &temperatures, &outside);
                let mut capacity: Vec<f64> = (0..solids).map(|i| rate * network.capacity_at(i, temperatures[i])).collect();
                network.fixed.iter().for_each(|(node, _)| capacity[*node as usize] = 0.0);
                jacobian.add_diagonal(capacity.into_iter());
                linear = Some(Linear { jacobian, cold: cold.get_or_init(|| streams.cold()), rate, own: stage.effective.0, solids });
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
