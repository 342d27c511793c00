//! The steady state: Newton's method on radiation, conductances and films, a Krylov method on each step.

use std::time::Instant;

use super::anchors::Anchors;
use super::balance::{Balance, balance_with};
use super::csr::for_chunks;
use super::jacobian::Jacobian;
use super::krylov::{KrylovResult, Scratch, SingleBasis, Stopping, conjugate_gradients, gmres};
use super::multigrid::{Multigrid, Workspace};
use super::newton::{self, HeatBalances, largest};
use super::preconditioner::downstream;
use super::reachability::ConnectedPieces;
use super::surfaces::SurfaceStates;
use super::system::System;
use coldplate_base::error::{Error, Result, Stop};
use coldplate_base::progress::{Progress, Silent};
use coldplate_network::{Load, Network, StreamState};

/// Numbers by which steady states are solved. All were chosen; each states the trade-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadySettings {
    /// Estimated error of any temperature at which Newton's method may stop, K: exactness against a further step.
    pub error: f64,
    /// Sum of the absolute nodal residuals over the heat that passes through at which Newton's method may stop, dimensionless:
    /// exactness against rounding.
    pub residual: f64,
    /// Largest relative heat imbalance of a result that may be printed, dimensionless: results that are refused against results that
    /// are wrong.
    pub balance: f64,
    /// Error that a linear solve leaves in a temperature, over its relative residual times the step, dimensionless: a weakly connected
    /// part may be that much worse than the norm.
    pub lag: f64,
    /// Relative change of the heat flows per kelvin of a Newton step, 1/K, from radiation, films and properties: iterations against
    /// Newton steps.
    pub bend: f64,
    /// Loosest relative residual of a linear solve far from the solution, dimensionless: iterations against Newton steps.
    pub loosest_linear: f64,
    /// Tightest relative residual of a linear solve, dimensionless: iterations against Newton steps.
    pub tightest_linear: f64,
    /// Share of the final residual that a linear solve in the last steps may leave, dimensionless: iterations against Newton steps.
    pub last_share: f64,
    /// Loosest relative residual of a linear solve in the last steps, dimensionless: iterations against Newton steps.
    pub loosest_last: f64,
    /// Most Newton steps, a count: time against conditions that are refused.
    pub most_newton: usize,
    /// Most iterations of a linear solve, a count: time against conditions that are refused.
    pub most_krylov: usize,
    /// Passes of the search for a combination of known states to start from, a count: residuals formed against Newton steps.
    pub start_passes: usize,
}

impl Default for SteadySettings {
    fn default() -> Self {
        Self {
            error: 1e-7,
            residual: 1e-10,
            balance: 1e-8,
            lag: 20.0,
            bend: 0.01,
            loosest_linear: 1e-3,
            tightest_linear: 1e-7,
            last_share: 0.3,
            loosest_last: 0.05,
            most_newton: 40,
            most_krylov: 400,
            start_passes: 3,
        }
    }
}

impl SteadySettings {
    /// Relative residual for a linear solve, dimensionless, from the error of the temperatures (K) before it, the open imbalance and the
    /// one asked for (W). No solve need be more exact than the heat flows are linear over the step, nor the last ones more than the
    /// final residual.
    fn tolerance_for(&self, error: f64, imbalance: f64, asked: f64) -> f64 {
        let by_step = (self.bend * error).clamp(self.tightest_linear, self.loosest_linear);
        by_step.max(self.last_share * asked / imbalance).min(self.loosest_last)
    }

    /// Estimated error of the temperatures after a Newton step, K: its largest entry `moved` (K) times the share that its linear solve
    /// (relative residual `unsolved`) and the bend of the heat flows leave.
    pub(super) fn left_after(&self, moved: f64, unsolved: f64) -> f64 {
        moved * (self.lag * unsolved + self.bend * moved).min(1.0)
    }
}

/// A network with everything that can be set up once for all conditions.
#[derive(Debug, Clone)]
pub struct Solver<'a> {
    pub(super) network: &'a Network,
    pub(super) settings: SteadySettings,
    pub(super) system: System,
    pub(super) multigrid: Multigrid,
    is_symmetric: bool,
    pub(super) reference: (Load, Solution),
    anchors: Anchors,
    pieces: ConnectedPieces,
}

/// A steady state.
#[derive(Debug, Clone, Default)]
pub struct Solution {
    /// Temperature of every node, K.
    pub temperatures: Vec<f64>,
    /// State of every stream.
    pub streams: Vec<StreamState>,
    /// Share of its sources' power that each controller of the network gives, from 0 to 1.
    pub shares: Vec<f64>,
    /// Heat balance of the state.
    pub balance: Balance,
    /// Newton steps taken.
    pub newton_iterations: usize,
    /// Krylov iterations of all steps together.
    pub krylov_iterations: usize,
    /// Seconds spent on coefficients and matrices.
    pub assemble_seconds: f64,
    /// Seconds spent in linear solves.
    pub solve_seconds: f64,
}

impl<'a> Solver<'a> {
    /// Sets up pattern and multigrid hierarchy, at a reference condition that later ones resemble.
    ///
    /// # Errors
    /// Heat has no way out of some part, or water leaves its property range.
    pub fn new(network: &'a Network, reference: &Load) -> Result<Self> {
        Self::heard(network, reference, &Silent)
    }

    /// Sets up pattern and multigrid hierarchy, and solves the reference condition with `settings` from temperatures (K, one per node)
    /// that resemble its solution.
    ///
    /// # Errors
    /// Errors of [`Solver::new`].
    pub fn near(
        network: &'a Network,
        reference: &Load,
        start: Vec<f64>,
        settings: SteadySettings,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let mut solver = Self { settings, ..Self::unsolved(network, reference, start, progress)? };
        // Every condition starts from the reference solution, so that no result depends on the order of a sweep.
        solver.reference.1 = solver.controlled(reference, &solver.reference.1.temperatures, f64::INFINITY, progress)?;
        Ok(solver)
    }

    /// Sets up pattern and multigrid hierarchy, with reports on Newton's method to `progress`.
    ///
    /// # Errors
    /// Errors of [`Solver::new`].
    pub fn heard(network: &'a Network, reference: &Load, progress: &dyn Progress) -> Result<Self> {
        Self::near(network, reference, initial(network, reference), SteadySettings::default(), progress)
    }

    /// A solver that is set up, with a reference that is not solved.
    pub(super) fn unsolved(network: &'a Network, reference: &Load, start: Vec<f64>, progress: &dyn Progress) -> Result<Self> {
        progress.at(&format!("{} unknowns: setting up", network.nodes));
        // Before anything is solved: a way out for the heat.
        let pieces = ConnectedPieces::new(network);
        pieces.check(network, reference)?;
        let system = System::new(network);
        let streams = network.stream_states(reference, &start)?;
        let multigrid = Multigrid::new(&system.symmetric(network, reference, &streams, &start), &network.capacity)?;
        let is_symmetric =
            network.streams.is_empty() && network.is_linear_conduction() && network.radiative.is_empty() && network.reaches.is_empty();
        let unsolved = Solution { temperatures: start, streams, ..Solution::default() };
        Ok(Self {
            network,
            settings: SteadySettings::default(),
            system,
            multigrid,
            is_symmetric,
            reference: (reference.clone(), unsolved),
            anchors: Anchors::default(),
            pieces,
        })
    }

    /// Solves some conditions so that others start from a combination of them. Solutions of the others do not depend on their order,
    /// only on these. Conditions that fail to converge are skipped.
    pub fn learn(&mut self, loads: &[Load]) {
        if self.anchors.is_empty() {
            let (load, at) = &self.reference;
            self.anchors = Anchors::new(&self.system.jacobian(self.network, load, &at.streams, &at.temperatures));
        }
        for load in loads {
            if let Ok(solution) = self.steady(load) {
                self.anchors.add(&self.reference.1.temperatures, &solution.temperatures);
            }
        }
    }

    /// Solves one condition, starting from the reference solution.
    ///
    /// # Errors
    /// No convergence, a temperature that is not finite, or a heat balance left open: each says by how
    /// much. A result that is returned is converged and balanced. Coolant that boils or leaves its range.
    pub fn steady(&self, load: &Load) -> Result<Solution> {
        if *load != self.reference.0 {
            return self.iterate(load);
        }
        self.network.check_coolant(load, &self.reference.1.temperatures)?;
        Ok(self.reference.1.clone())
    }

    /// Solves one condition from the reference temperatures, or from their best combination with known states.
    fn iterate(&self, load: &Load) -> Result<Solution> {
        let network = self.network;
        let mut temperatures = self.reference.1.temperatures.clone();
        if !self.anchors.is_empty() {
            network.hold(load, &mut temperatures);
            // The matrix changes little from one pass to the next.
            let mut known = None;
            for _ in 0..self.settings.start_passes {
                let streams = network.stream_states(load, &temperatures)?;
                let outside = SurfaceStates::new(network, load, &temperatures);
                let residual = self.system.residual_with(network, load, &streams, &temperatures, &outside);
                let matrix = || self.system.jacobian_with(network, load, &streams, &temperatures, &outside);
                known.get_or_insert_with(|| self.anchors.seen_by(&matrix())).improve(&residual, &mut temperatures);
            }
        }
        self.steady_from(load, &temperatures, f64::INFINITY)
    }

    /// Solves one condition by Newton's method from given temperatures (K, one per node). They are about `error` (K) from the solution;
    /// `error` is infinite if nothing is known about it. The error decides how far the first linear solve goes, not how exact the
    /// solution is.
    ///
    /// # Errors
    /// Errors of [`Solver::steady`].
    pub fn steady_from(&self, load: &Load, start: &[f64], error: f64) -> Result<Solution> {
        let solution = self.controlled(load, start, error, &Silent)?;
        self.network.check_coolant(load, &solution.temperatures)?;
        Ok(solution)
    }

    /// Newton's method at the powers of the load, without a check of the coolant.
    pub(super) fn newton(&self, load: &Load, start: &[f64], error: f64, progress: &dyn Progress) -> Result<Solution> {
        self.pieces.check(self.network, load)?;
        let mut temperatures = start.to_vec();
        self.network.hold(load, &mut temperatures);
        let mut balances = SteadyBalances {
            solver: self,
            load,
            progress,
            found: Solution::default(),
            // At least one step is taken.
            error: error.max(2.0 * self.settings.error),
            moved: f64::INFINITY,
            rounding: 0.0,
            asked: 0.0,
            residual: Vec::new(),
            outside: SurfaceStates::default(),
            matrix: None,
            work: self.work_space(),
        };
        newton::solve(&mut balances, &mut temperatures, self.settings.most_newton)?;
        Ok(Solution { temperatures, ..balances.found })
    }

    /// Work space for linear solves.
    pub(super) fn work_space(&self) -> LinearWork {
        LinearWork { cycle: self.multigrid.workspace(), krylov: Scratch::default() }
    }

    /// One linear solve, to a relative residual `within`.
    pub(super) fn linear(
        &self,
        matrix: &Jacobian<'_>,
        streams: &[StreamState],
        b: &[f64],
        x: &mut [f64],
        within: f64,
        work: &mut LinearWork,
    ) -> KrylovResult {
        let LinearWork { cycle, krylov } = work;
        let most = self.settings.most_krylov;
        if self.is_symmetric {
            return conjugate_gradients(matrix, b, x, within, most, |r, z| self.multigrid.apply(r, z, cycle));
        }
        let stopping = Stopping { tolerance: within, settled: 0.0, most };
        gmres(matrix, b, x, stopping, krylov, |r, z| self.precondition(streams, r, z, cycle))
    }

    /// Approximate solution (K) of the linearised network for a right-hand side (W).
    pub(super) fn precondition(&self, streams: &[StreamState], r: &[f64], z: &mut [f64], work: &mut Workspace) {
        downstream(self.network, streams, &self.multigrid, r, z, work);
    }
}

/// Work space of a linear solve.
pub(super) struct LinearWork {
    pub cycle: Workspace,
    krylov: Scratch<SingleBasis>,
}

/// Heat balances of a steady state on the way to it.
struct SteadyBalances<'s, 'a> {
    solver: &'s Solver<'a>,
    load: &'s Load,
    progress: &'s dyn Progress,
    /// Streams, balance and effort so far; the temperatures are the driver's.
    found: Solution,
    /// Estimated error of the temperatures, K.
    error: f64,
    /// Largest change of a temperature in the last step, K.
    moved: f64,
    /// Rounding of the residual, W.
    rounding: f64,
    /// Imbalance that the solution may leave, W.
    asked: f64,
    residual: Vec<f64>,
    outside: SurfaceStates,
    matrix: Option<Jacobian<'a>>,
    work: LinearWork,
}

impl HeatBalances for SteadyBalances<'_, '_> {
    fn assess(&mut self, temperatures: &[f64]) -> Result<f64> {
        let clock = Instant::now();
        let Self { solver: Solver { network, system, settings, .. }, load, found, outside, residual, .. } = self;
        found.streams = network.stream_states(load, temperatures)?;
        outside.renew(network, load, temperatures);
        system.residual_in(residual, network, load, &found.streams, temperatures, outside);
        found.balance = balance_with(network, load, &found.streams, temperatures, &outside.surfaces);
        self.rounding = system.rounding(network, &found.streams, temperatures, outside);
        // The residual is measured against the heat that passes through.
        self.asked = (settings.residual * found.balance.in_watts).max(self.rounding);
        found.assemble_seconds += clock.elapsed().as_secs_f64();
        Ok(residual.iter().map(|r| r.abs()).sum())
    }

    fn are_closed(&mut self, _: &[f64], imbalance: f64) -> Result<bool> {
        let SteadySettings { error, balance, .. } = self.solver.settings;
        let is_closed = imbalance <= self.asked && self.error <= error;
        if !is_closed {
            return Ok(false);
        }
        let Balance { relative, in_watts, out_watts, .. } = &mut self.found.balance;
        if *relative > balance {
            if (*in_watts - *out_watts).abs() > self.rounding {
                let what = format!("the heat balance is open: {relative:.3e} of {in_watts:.3} W do not add up");
                return Err(Error::stopped(Stop::HeatBalanceOpen, what));
            }
            // Hardly any heat flows: the imbalance is rounding of the temperatures.
            *relative = 0.0;
        }
        Ok(true)
    }

    fn find_step(&mut self, temperatures: &[f64], imbalance: f64, step: &mut [f64]) -> Result<()> {
        let clock = Instant::now();
        let Self { solver, load, found, outside, residual, work, .. } = self;
        let Solver { network, system, settings, .. } = solver;
        let matrix = match &mut self.matrix {
            Some(matrix) => {
                system.renew(matrix, network, load, &found.streams, temperatures, outside);
                matrix
            }
            none => none.insert(system.jacobian_with(network, load, &found.streams, temperatures, outside)),
        };
        found.assemble_seconds += clock.elapsed().as_secs_f64();

        let clock = Instant::now();
        for_chunks(residual, |_, part| part.iter_mut().for_each(|r| *r = -*r));
        let within = settings.tolerance_for(self.error, imbalance, self.asked);
        let solved = solver.linear(matrix, &found.streams, residual, step, within, work);
        found.solve_seconds += clock.elapsed().as_secs_f64();
        found.krylov_iterations += solved.iterations;
        found.newton_iterations += 1;
        solved.useful()?;
        self.moved = largest(step);
        self.error = settings.left_after(self.moved, solved.relative_residual);
        self.progress.at(&format!(
            "{} unknowns: Newton step {} moved {:.1e} K, {imbalance:.1e} W of {:.1e} W were open",
            network.nodes, found.newton_iterations, self.moved, found.balance.in_watts
        ));
        Ok(())
    }

    fn when(&self) -> String {
        format!("after {} Newton steps", self.found.newton_iterations)
    }

    fn unsolved(&self, imbalance: f64) -> Error {
        let Self { found, moved, .. } = self;
        let what = format!(
            "no steady state {}: {imbalance:.3e} W of {:.3e} W are unaccounted for, the last step moved {moved:.2e} K",
            self.when(),
            found.balance.in_watts
        );
        Error::stopped(Stop::MostNewtonSteps, what)
            .help("look for a part without a path for its heat, or a source that grows with its own temperature")
    }
}

/// A first guess: solids and water at the mean of the given temperatures.
fn initial(network: &Network, load: &Load) -> Vec<f64> {
    let given: Vec<f64> =
        load.inlets.iter().copied().chain([load.chamber]).chain(network.fixed.iter().map(|(_, i)| load.fixed[*i as usize])).collect();
    let mean = given.iter().sum::<f64>() / given.len() as f64;
    network.at_inlets(load, mean)
}
