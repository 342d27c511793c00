//! One implicit stage: enthalpies, heat flows at its end and the heat water brought over it, in balance.

use super::super::balance::balance_with;
use super::super::jacobian::Jacobian;
use super::super::krylov::{KrylovResult, Operator, Scratch, SingleBasis, Stopping, gmres};
use super::super::multigrid::{Multigrid, Workspace};
use super::super::newton::{self, HeatBalances};
use super::super::surfaces::SurfaceStates;
use super::super::system::System;
use super::water::{Streams, Water, WaterPassage, inflows};
use super::{HeatPassing, Transient, TransientState};
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
pub(super) struct ImplicitStage<'s> {
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

impl ImplicitStage<'_> {
    /// Effective wall temperature of a node (K) for the water, from its temperature at the end (K).
    fn effective_at(&self, node: usize, end: f64) -> f64 {
        self.effective.0 * end + self.effective.1.iter().map(|(w, known)| w * known[node]).sum::<f64>()
    }
}

/// A hierarchy with the capacity over the time step on its diagonal.
#[derive(Debug)]
pub(super) struct Preconditioner {
    multigrid: Multigrid,
    work: Workspace,
    rate: f64,
    solids: usize,
    scratch: Scratch<SingleBasis>,
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
    pub fn solve(&mut self, matrix: &impl Operator, b: &[f64], x: &mut [f64], tolerance: f64) -> KrylovResult {
        let Self { multigrid, work, solids, scratch, .. } = self;
        let stopping = Stopping { tolerance, settled: 0.0, most: MOST_KRYLOV };
        gmres(matrix, b, x, stopping, scratch, |r, z| {
            let (solid, rest) = z.split_at_mut(*solids);
            multigrid.apply(&r[..*solids], solid, work);
            rest.copy_from_slice(&r[*solids..]);
        })
    }
}

/// Result of a stage.
pub(super) struct SolvedStage {
    /// Temperature of every node, K.
    pub temperatures: Vec<f64>,
    pub water: Water,
    /// Heat into each solid at its end, W.
    pub flow: Vec<f64>,
    /// Heat that passes there.
    pub passing: HeatPassing,
}

/// The linearised stage: solids by their Jacobian, water by carrying a change of the walls along.
struct Linear<'n> {
    jacobian: &'n Jacobian<'n>,
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

/// Heat balances of a stage on the way to its end.
struct StageBalances<'b> {
    network: &'b Network,
    system: &'b System,
    stage: &'b ImplicitStage<'b>,
    /// Time at the beginning of the step, s.
    time: f64,
    /// Share of the heat passing through that may stay open, dimensionless.
    share: f64,
    /// Heat per kelvin of warming at the end over the capacity, 1/s.
    rate: f64,
    /// Enthalpy of each solid without the flow at the end, J.
    target: Vec<f64>,
    /// Streams at the films expected halfway.
    states: Vec<StreamState>,
    water: Streams<'b>,
    /// Response of the water to the walls alone, once it is asked for.
    cold: Option<Streams<'b>>,
    preconditioner: Preconditioner,
    /// Derivatives, kept as long as they serve.
    jacobian: Option<Jacobian<'b>>,
    /// Newton steps taken.
    steps: usize,
    /// Imbalance that the derivatives left, W, and whether it is too much.
    last: f64,
    is_slow: bool,
    /// Heat that passes through, W.
    through: f64,
    at: Assessed,
}

/// A stage at the temperatures assessed last.
#[derive(Default)]
struct Assessed {
    outside: SurfaceStates,
    /// Heat balance of every node, W.
    residual: Vec<f64>,
    /// Heat into each solid, W.
    flow: Vec<f64>,
    passed: Vec<WaterPassage>,
    /// Sum of the absolute heats from the water to all cells, J.
    from_water: f64,
    /// Sum of capacity times temperature, J: a temperature is known to its last place, and so is the heat stored at it.
    magnitude: f64,
    /// Heat that passes, if it was asked for.
    passing: Option<HeatPassing>,
}

impl<'b> StageBalances<'b> {
    fn passing(&self, temperatures: &[f64]) -> HeatPassing {
        HeatPassing::of(&balance_with(self.network, self.stage.load, &[], temperatures, &self.at.outside.surfaces))
    }

    /// Rounding of the heat balances, W.
    fn rounding(&self, temperatures: &[f64]) -> f64 {
        let Assessed { outside, from_water, magnitude, .. } = &self.at;
        // Water gives its heat by differences of temperatures that are rounded as a whole.
        let films: f64 = self.states.iter().flat_map(|s| &s.conductance).sum::<f64>() * temperatures.iter().fold(0.0f64, |m, t| m.max(*t));
        self.system.rounding(self.network, &[], temperatures, outside) + 4.0 * f64::EPSILON * (self.rate * (magnitude + from_water) + films)
    }

    /// Derivatives of the heat balances of the solids, the water left out, W/K.
    fn derivatives(&self, temperatures: &[f64]) -> Jacobian<'b> {
        let Self { network, system, stage, rate, .. } = self;
        let mut jacobian = system.jacobian_with(network, stage.load, &still(&self.states), temperatures, &self.at.outside);
        let mut capacity: Vec<f64> = (0..network.solids).map(|i| rate * network.capacity_at(i, temperatures[i])).collect();
        network.fixed.iter().for_each(|(node, _)| capacity[*node as usize] = 0.0);
        jacobian.add_diagonal(capacity.into_iter());
        jacobian
    }
}

impl HeatBalances for StageBalances<'_> {
    fn assess(&mut self, temperatures: &[f64]) -> Result<f64> {
        let Self { network, system, stage, rate, target, water, .. } = self;
        let solids = network.solids;
        let outside = SurfaceStates::new(network, stage.load, temperatures);
        let mut residual = system.residual_with(network, stage.load, &[], temperatures, &outside);
        let flow: Vec<f64> = residual[..solids].iter().map(|r| -r).collect();
        let mut magnitude = 0.0;
        for i in (0..solids).filter(|i| network.capacity[*i] > 0.0) {
            residual[i] += *rate * (network.enthalpy(i, temperatures[i]) - target[i]);
            magnitude += network.capacity[i] * temperatures[i];
        }
        let wall = |n: usize| stage.effective_at(n, temperatures[n]);
        let passed = water.carry(&wall);
        let mut from_water = 0.0;
        water.heats(&wall, &passed, |cell, heat| {
            residual[cell] -= *rate * heat;
            from_water += heat.abs();
        });
        for (node, _) in &network.fixed {
            residual[*node as usize] = 0.0;
        }
        residual[solids..].fill(0.0);
        let imbalance = residual.iter().map(|r| r.abs()).sum();
        self.at = Assessed { outside, residual, flow, passed, from_water, magnitude, passing: None };
        Ok(imbalance)
    }

    fn are_closed(&mut self, temperatures: &[f64], imbalance: f64) -> Result<bool> {
        // A scale: after the first step it hardly changes.
        if self.steps <= SCALED {
            let passing = self.passing(temperatures);
            self.through = passing.entering.max(passing.leaving) + self.at.from_water * self.rate;
            self.at.passing = Some(passing);
        }
        let is_balanced = imbalance <= self.share * self.through;
        // Rounding is a bound that is seldom reached: as long as a step still helps, another is taken.
        let may_be_spent = imbalance > 0.3 * self.last && (self.steps > SCALED || imbalance <= NEARLY * self.through);
        let is_spent = !is_balanced && may_be_spent && imbalance <= self.rounding(temperatures);
        self.is_slow = imbalance > SLOW * self.last;
        self.last = imbalance;
        Ok(is_balanced || is_spent)
    }

    fn find_step(&mut self, temperatures: &[f64], imbalance: f64, step: &mut [f64]) -> Result<()> {
        let jacobian = match self.jacobian.take() {
            Some(known) if !self.is_slow => known,
            _ => self.derivatives(temperatures),
        };
        let cold = self.cold.get_or_insert_with(|| self.water.cold());
        let linear = Linear { jacobian: &jacobian, cold, rate: self.rate, own: self.stage.effective.0, solids: self.network.solids };
        self.at.residual.iter_mut().for_each(|r| *r = -*r);
        let tolerance = (LINEAR * self.share * self.through / imbalance).clamp(FINEST_LINEAR, COARSEST_LINEAR);
        self.preconditioner.solve(&linear, &self.at.residual, step, tolerance).useful()?;
        self.jacobian = Some(jacobian);
        self.steps += 1;
        Ok(())
    }

    fn when(&self) -> String {
        format!("at {:.6} s", self.time)
    }

    fn unsolved(&self, imbalance: f64) -> Error {
        unsolved(self.time, imbalance, self.through)
    }
}

/// Error of a time step from a time (s) that leaves an imbalance of the heat that passes through, W.
pub(super) fn unsolved(time: f64, imbalance: f64, through: f64) -> Error {
    let what = format!("a time step at {time:.6} s does not converge: {imbalance:.3e} W of {through:.3e} W are unaccounted for");
    Error::stopped(Stop::MostNewtonSteps, what)
}

/// Streams in given states without their flow.
pub(super) fn still(states: &[StreamState]) -> Vec<StreamState> {
    states.iter().map(|s| StreamState { capacity_rate: 0.0, exchange: vec![0.0; s.exchange.len()], ..s.clone() }).collect()
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
    pub(super) fn solve(&mut self, stage: &ImplicitStage<'_>, state: &TransientState, mut guess: Vec<f64>) -> Result<SolvedStage> {
        let network = self.network;
        network.hold(stage.load, &mut guess);
        if let Some(lumped) = &mut self.lumped {
            let temperatures = lumped.solve(network, stage, state, guess)?;
            let flow = lumped.flow(network, stage.load, &temperatures);
            let passing = HeatPassing::at(network, stage.load, &temperatures);
            return Ok(SolvedStage { temperatures, water: Water::default(), flow, passing });
        }
        let mut target: Vec<f64> = (0..network.solids).map(|i| network.enthalpy(i, state.temperatures[i])).collect();
        for (weight, flow) in &stage.earlier {
            target.iter_mut().zip(*flow).for_each(|(t, f)| *t += weight * f);
        }
        // Films from the temperatures expected halfway; within the stage the water's law is linear.
        let mut expected = state.temperatures.clone();
        (0..network.solids).for_each(|n| expected[n] = stage.effective_at(n, guess[n]));
        let states = network.stream_states(stage.middle, &expected)?;
        let water = Streams::new(network, &states, stage.duration, &state.water, inflows(stage.begin, stage.load));
        let rate = 1.0 / stage.own;
        let mut preconditioner = match self.preconditioner.take() {
            Some(known) => known,
            None => Preconditioner::new(network, &self.system, stage.load, &state.temperatures)?,
        };
        preconditioner.set(rate)?;
        let mut balances = StageBalances {
            network,
            system: &self.system,
            stage,
            time: state.time,
            share: self.settings.balance,
            rate,
            target,
            states,
            water,
            cold: None,
            preconditioner,
            jacobian: None,
            steps: 0,
            last: f64::INFINITY,
            is_slow: false,
            through: 0.0,
            at: Assessed::default(),
        };
        let mut temperatures = guess;
        newton::solve(&mut balances, &mut temperatures, MOST_NEWTON)?;
        let passing = balances.at.passing.unwrap_or_else(|| balances.passing(&temperatures));
        let water = balances.water.moved(&balances.at.passed, &mut temperatures);
        let flow = balances.at.flow;
        self.preconditioner = Some(balances.preconditioner);
        Ok(SolvedStage { temperatures, water, flow, passing })
    }
}
