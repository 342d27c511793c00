//! The steady state: Newton's method on radiation, conductances and films, a Krylov method on each step.

use std::time::Instant;

use super::anchors::Anchors;
use super::balance::{Balance, balance_with};
use super::csr::for_chunks;
use super::jacobian::Jacobian;
use super::krylov::{Outcome, Scratch, conjugate_gradients, gmres};
use super::multigrid::{Multigrid, Workspace};
use super::reachability::Pieces;
use super::surfaces::Outside;
use super::system::System;
use coldplate_base::error::{Error, Result, Stop};
use coldplate_base::progress::{Progress, Silent};
use coldplate_network::{Load, Network, StreamState};

/// Largest relative heat imbalance of a result that may be printed, dimensionless. Chosen.
pub const BALANCE_TOLERANCE: f64 = 1e-8;
/// Newton's method stops when the error left in any temperature is estimated below this, K, and the heat residual agrees. Chosen:
/// exactness against a further step.
const LEFT_TOLERANCE: f64 = 1e-7;
/// Sum of the absolute nodal residuals over the heat that passes through, at the end; dimensionless. Chosen: exactness against
/// rounding.
const RESIDUAL_TOLERANCE: f64 = 1e-10;
/// Error left after a Newton step of s kelvin whose linear solve left a relative residual r: s (LAG r + BEND s). LAG, dimensionless: a
/// weakly connected part may be that much worse than the norm. Chosen.
pub(super) const LAG: f64 = 20.0;
/// Relative change of the heat flows per kelvin of a Newton step, 1/K; see [`LAG`]. Chosen.
pub(super) const BEND: f64 = 0.01;
/// Loosest relative residual of a linear solve far from the solution, dimensionless. Chosen: iterations against Newton steps.
const LINEAR_TOLERANCE: f64 = 1e-3;
/// Tightest relative residual of a linear solve, dimensionless. Chosen: iterations against Newton steps.
const FINEST_TOLERANCE: f64 = 1e-7;
/// Share of the final residual, the one that Newton's method must reach, that a linear solve in the last steps may leave;
/// dimensionless. Chosen.
const ENOUGH: f64 = 0.3;
/// Loosest relative residual of a linear solve in the last steps, dimensionless. Chosen: iterations against Newton steps.
const LARGEST_TOLERANCE: f64 = 0.05;
/// Most Newton steps, a count. Chosen: time against conditions that are refused.
const MOST_NEWTON: usize = 40;
/// Most iterations of a linear solve, a count. Chosen: time against conditions that are refused.
const MOST_KRYLOV: usize = 400;
/// Passes of the search for a combination of known states to start from, a count. Chosen: residuals formed against Newton steps.
const ANCHOR_PASSES: usize = 3;

/// A network with everything that can be set up once for all conditions.
#[derive(Debug, Clone)]
pub struct Solver<'a> {
    pub(super) network: &'a Network,
    pub(super) system: System,
    pub(super) multigrid: Multigrid,
    is_symmetric: bool,
    pub(super) reference: (Load, Solution),
    anchors: Anchors,
    pieces: Pieces,
}

/// A steady state.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Temperature of every node, K.
    pub temperatures: Vec<f64>,
    /// State of every stream.
    pub streams: Vec<StreamState>,
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

    /// Sets up pattern and multigrid hierarchy, and solves the reference condition from temperatures (K, one per node) that resemble
    /// its solution.
    ///
    /// # Errors
    /// Errors of [`Solver::new`].
    pub fn near(network: &'a Network, reference: &Load, start: Vec<f64>, progress: &dyn Progress) -> Result<Self> {
        let mut solver = Self::unsolved(network, reference, start, progress)?;
        // Every condition starts from the reference solution, so that no result depends on the order of a sweep.
        solver.reference.1 = solver.newton(reference, &solver.reference.1.temperatures, f64::INFINITY, progress)?;
        Ok(solver)
    }

    /// Sets up pattern and multigrid hierarchy, with reports on Newton's method to `progress`.
    ///
    /// # Errors
    /// Errors of [`Solver::new`].
    pub fn heard(network: &'a Network, reference: &Load, progress: &dyn Progress) -> Result<Self> {
        Self::near(network, reference, initial(network, reference), progress)
    }

    /// A solver that is set up, with a reference that is not solved.
    pub(super) fn unsolved(network: &'a Network, reference: &Load, start: Vec<f64>, progress: &dyn Progress) -> Result<Self> {
        progress.at(&format!("{} unknowns: setting up", network.nodes));
        // Before anything is solved: a way out for the heat.
        let pieces = Pieces::new(network);
        pieces.check(network, reference)?;
        let system = System::new(network);
        let streams = network.stream_states(reference, &start)?;
        let multigrid = Multigrid::new(&system.symmetric(network, reference, &streams, &start), &network.capacity)?;
        let is_symmetric =
            network.streams.is_empty() && network.is_linear_conduction() && network.radiative.is_empty() && network.reaches.is_empty();
        let unsolved = Solution {
            temperatures: start,
            streams,
            balance: Balance::default(),
            newton_iterations: 0,
            krylov_iterations: 0,
            assemble_seconds: 0.0,
            solve_seconds: 0.0,
        };
        Ok(Self { network, system, multigrid, is_symmetric, reference: (reference.clone(), unsolved), anchors: Anchors::default(), pieces })
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

    /// Rows of each level of the hierarchy, finest first, and its operator complexity.
    pub fn hierarchy(&self) -> (Vec<usize>, f64) {
        (self.multigrid.sizes(), self.multigrid.operator_complexity())
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
            hold(network, load, &mut temperatures);
            // The matrix changes little from one pass to the next.
            let mut known = None;
            for _ in 0..ANCHOR_PASSES {
                let streams = network.stream_states(load, &temperatures)?;
                let outside = Outside::new(network, load, &temperatures);
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
        let solution = self.newton(load, start, error, &Silent)?;
        self.network.check_coolant(load, &solution.temperatures)?;
        Ok(solution)
    }

    /// Newton's method, without a check of the coolant.
    fn newton(&self, load: &Load, start: &[f64], error: f64, progress: &dyn Progress) -> Result<Solution> {
        let network = self.network;
        self.pieces.check(network, load)?;
        let mut temperatures = start.to_vec();
        hold(network, load, &mut temperatures);
        let (mut newton, mut krylov) = (0, 0);
        let (mut assembling, mut solving) = (0.0, 0.0);
        let mut work = (self.multigrid.workspace(), Scratch::default());
        let (mut step, mut residual, mut outside) = (vec![0.0; network.nodes], Vec::new(), Outside::default());
        let mut matrix: Option<Jacobian<'_>> = None;
        let mut last_step = f64::INFINITY;
        // About how far the temperatures still are from the solution, K; at least one step is taken.
        let mut left = error.max(2.0 * LEFT_TOLERANCE);
        loop {
            let clock = Instant::now();
            let streams = network.stream_states(load, &temperatures)?;
            outside.renew(network, load, &temperatures);
            self.system.residual_in(&mut residual, network, load, &streams, &temperatures, &outside);
            let imbalance: f64 = residual.iter().map(|r| r.abs()).sum();
            let mut balance = balance_with(network, load, &streams, &temperatures, &outside.surfaces);
            // The heat that passes through: the scale the residual is measured against.
            let through = balance.in_watts;
            if !imbalance.is_finite() {
                return Err(Error::stopped(Stop::NotFinite, format!("the temperatures are no longer finite after {newton} Newton steps")));
            }
            let rounding = self.system.rounding(network, &streams, &temperatures, &outside);
            let asked = (RESIDUAL_TOLERANCE * through).max(rounding);
            let is_balanced = imbalance <= asked;
            if is_balanced && left <= LEFT_TOLERANCE {
                if balance.relative > BALANCE_TOLERANCE && (balance.in_watts - balance.out_watts).abs() <= rounding {
                    // Hardly any heat flows: the imbalance is rounding of the temperatures.
                    balance.relative = 0.0;
                }
                if balance.relative > BALANCE_TOLERANCE {
                    return Err(Error::stopped(
                        Stop::HeatBalanceOpen,
                        format!("the heat balance is open: {:.3e} of {:.3} W do not add up", balance.relative, balance.in_watts),
                    ));
                }
                let assemble_seconds = assembling + clock.elapsed().as_secs_f64();
                return Ok(Solution {
                    temperatures,
                    streams,
                    balance,
                    newton_iterations: newton,
                    krylov_iterations: krylov,
                    assemble_seconds,
                    solve_seconds: solving,
                });
            }
            if newton == MOST_NEWTON {
                return Err(Error::stopped(Stop::MostNewtonSteps, format!(
                    "no steady state after {newton} Newton steps: {imbalance:.3e} W of {through:.3e} W are unaccounted for, the last step moved {last_step:.2e} K"
                ))
                .help("look for a part without a path for its heat, or a source that grows with its own temperature"));
            }
            let matrix = match &mut matrix {
                Some(matrix) => {
                    self.system.renew(matrix, network, load, &streams, &temperatures, &outside);
                    matrix
                }
                none => none.insert(self.system.jacobian_with(network, load, &streams, &temperatures, &outside)),
            };
            assembling += clock.elapsed().as_secs_f64();

            let clock = Instant::now();
            for_chunks(&mut residual, |_, part| part.iter_mut().for_each(|r| *r = -*r));
            // No solve needs to be more exact than the heat flows are linear over the step, nor the last ones more than the final
            // residual.
            let within = (BEND * left).clamp(FINEST_TOLERANCE, LINEAR_TOLERANCE).max(ENOUGH * asked / imbalance);
            let outcome = self.linear(matrix, &streams, &residual, &mut step, within.min(LARGEST_TOLERANCE), &mut work);
            solving += clock.elapsed().as_secs_f64();
            krylov += outcome.iterations;
            if outcome.is_useless() {
                return Err(Error::stopped(
                    Stop::LinearSolver,
                    format!(
                        "the linear solver stopped at a relative residual of {:.2e} after {} iterations",
                        outcome.relative_residual, outcome.iterations
                    ),
                ));
            }
            last_step = step.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
            // T^4 makes a step from far below overshoot: no absolute temperature may more than double or turn negative.
            let factor =
                temperatures.iter().zip(&step).fold(1.0f64, |f, (t, s)| if s.abs() > 0.9 * t { f.min(0.9 * t / s.abs()) } else { f });
            temperatures.iter_mut().zip(&step).for_each(|(t, s)| *t += factor * s);
            left = last_step * (LAG * outcome.relative_residual + BEND * last_step).min(1.0);
            newton += 1;
            progress.at(&format!(
                "{} unknowns: Newton step {newton} moved {last_step:.1e} K, {imbalance:.1e} W of {through:.1e} W were open",
                network.nodes
            ));
        }
    }

    /// One linear solve, to a relative residual `within`.
    pub(super) fn linear(
        &self,
        matrix: &Jacobian<'_>,
        streams: &[StreamState],
        b: &[f64],
        x: &mut [f64],
        within: f64,
        (work, scratch): &mut (Workspace, Scratch),
    ) -> Outcome {
        if self.is_symmetric {
            return conjugate_gradients(matrix, b, x, within, MOST_KRYLOV, |r, z| self.multigrid.apply(r, z, work));
        }
        gmres(matrix, b, x, within, MOST_KRYLOV, scratch, |r, z| self.precondition(streams, r, z, work))
    }

    /// Approximate solution (K) of the linearised network for a right-hand side (W): solids by one cycle, then the water that follows
    /// from them.
    pub(super) fn precondition(&self, streams: &[StreamState], r: &[f64], z: &mut [f64], work: &mut Workspace) {
        let solids = self.network.solids;
        let (solid, water) = z.split_at_mut(solids);
        self.multigrid.apply(&r[..solids], solid, work);
        self.follow_streams(streams, &r[solids..], solid, water);
    }

    /// Water temperatures that follow from given wall temperatures, by one pass downstream.
    fn follow_streams(&self, streams: &[StreamState], right: &[f64], solid: &[f64], water: &mut [f64]) {
        for tree in &self.network.circuits {
            for s in coldplate_network::stream::members(&tree.layout) {
                let (stream, state) = (&self.network.streams[s], &streams[s]);
                let first = stream.first_node as usize - solid.len();
                let outlet = |u: &usize| water[self.network.streams[*u].outlet() as usize - solid.len()];
                let mut above: f64 = stream.upstream.iter().zip(&state.mixture).map(|(u, w)| w * outlet(u)).sum();
                for (k, station) in stream.stations.iter().enumerate() {
                    let wall: f64 = station.cells.iter().map(|(n, w)| w * solid[*n]).sum();
                    let (rate, exchange) = (state.capacity_rate, state.exchange[k]);
                    above = if rate > 0.0 {
                        (right[first + k] + (rate - exchange) * above + exchange * wall) / rate
                    } else {
                        right[first + k] + wall
                    };
                    water[first + k] = above;
                }
            }
        }
    }
}

/// Sets held nodes to their temperatures in the load.
pub(super) fn hold(network: &Network, load: &Load, temperatures: &mut [f64]) {
    for (node, index) in &network.fixed {
        temperatures[*node as usize] = load.fixed[*index as usize];
    }
}

/// A first guess: solids and water at the mean of the given temperatures.
fn initial(network: &Network, load: &Load) -> Vec<f64> {
    let given: Vec<f64> =
        load.inlets.iter().copied().chain([load.chamber]).chain(network.fixed.iter().map(|(_, i)| load.fixed[*i as usize])).collect();
    let mean = given.iter().sum::<f64>() / given.len() as f64;
    let mut start = vec![mean; network.nodes];
    for stream in &network.streams {
        let nodes = stream.first_node as usize..=stream.outlet() as usize;
        start[nodes].fill(load.inlets[stream.circuit]);
    }
    start
}
