//! Our own solver. Network and multigrid hierarchy are set up once, and every condition starts from the same reference state,
//! so that a result does not depend on the conditions solved before.

use std::sync::{Mutex, PoisonError};

use super::{Open, Plan};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_network::Load;
use coldplate_reduce::Guess;
use coldplate_solve::meshed::SteadyState;
use coldplate_solve::sensitivity::Derivatives;
use coldplate_solve::study::Study;
use coldplate_solve::{Solution, Solver};

/// Conditions of a design for each one that others start from, count. Chosen: each start costs a solve.
const WORTH_ONE_START: usize = 8;
/// Most conditions that others start from, count. Chosen: each costs its memory and one product with the matrix per start.
const MOST_STARTS: usize = 16;

/// Our own solver, set up for a design.
pub(super) struct Own<'a> {
    pub(super) study: &'a Study,
    pub(super) open: &'a Open,
    solver: Solver<'a>,
    /// Condition at which the solver was set up.
    pub(super) reference: Condition,
    /// Boiling by stream: number of conditions solved now at which its wall boils, and the hottest wall temperature, K.
    boiling: Mutex<Vec<(usize, f64)>>,
}

impl<'a> Own<'a> {
    /// The shared setup, at the middle of the ranges, or at the first condition of the design at which it can be made.
    ///
    /// # Errors
    /// No condition allows the setup.
    pub(super) fn new(study: &'a Study, open: &'a Open, plan: &Plan) -> Result<Self> {
        let machine = &study.model.machine;
        let (mut solver, reference) = match study.model.solver(&plan.middle()) {
            Ok(solver) => (solver, plan.middle()),
            Err(error) => {
                let others = plan.conditions.iter().map(|row| Condition::from_si(row.clone()));
                others.flat_map(|at| Some((study.model.solver(&at).ok()?, at))).next().ok_or_else(|| {
                    Error::numerics(format!("every condition failed, that in the middle of the ranges because: {}", error.what()))
                        .help("solve one of them with `coldplate solve`")
                })?
            }
        };
        // Every condition starts from the same few, spread evenly over the design as the sweep file states it, so that none
        // depends on others solved before it or in this run. If a reduced model is made, its guesses serve better.
        let rows = &plan.conditions;
        let known = if plan.accuracy.is_some() { 0 } else { (rows.len() / WORTH_ONE_START).min(MOST_STARTS) };
        let start = |i: usize| Load::at(machine, &Condition::from_si(rows[i * rows.len() / known].clone()));
        solver.learn(&(0..known).filter_map(|i| start(i).ok()).collect::<Vec<_>>());
        let boiling = Mutex::new(vec![(0, 0.0); study.model.network.streams.len()]);
        Ok(Self { study, open, solver, reference, boiling })
    }

    /// Steady state at which the solver was set up.
    ///
    /// # Errors
    /// There is no steady state.
    pub(super) fn center(&self) -> Result<Solution> {
        self.solver.steady(&Load::at(&self.study.model.machine, &self.reference)?)
    }

    /// The steady state at a row of a plan, from a guess if there is one.
    ///
    /// # Errors
    /// There is no steady state.
    pub(super) fn state(&self, plan: &Plan, row: usize, guess: Option<Guess>) -> Result<SteadyState> {
        let (model, condition) = (&self.study.model, Condition::from_si(plan.conditions[row].clone()));
        match guess {
            Some(guess) => model.solve_from(&self.solver, &condition, &guess.temperatures, guess.error),
            None => model.solve(&self.solver, &condition),
        }
    }

    /// Outputs and slopes at a row of a plan with a known state.
    ///
    /// # Errors
    /// The slopes cannot be found.
    pub(super) fn values(&self, plan: &Plan, row: usize, state: &SteadyState) -> Result<Vec<f64>> {
        let (network, solution) = (&self.study.model.network, &state.solution);
        let wall = |s: usize| Some((s, network.boiling_wall(s, &solution.streams[s], &solution.temperatures)?));
        self.count_boiling((0..network.streams.len()).filter_map(wall));
        let mut values = self.study.model.readings(state);
        let count = self.open.parameters.len() * values.len();
        if self.is_sloped(plan, row) {
            let at = Derivatives::at(self.study, &Condition::from_si(plan.conditions[row].clone()), &solution.temperatures)?;
            values.extend(at.along_open(&self.open.parameters)?.into_iter().flatten());
        } else {
            values.extend(std::iter::repeat_n(0.0, count));
        }
        Ok(values)
    }

    /// Whether slopes are found at a row of a plan.
    pub(super) fn is_sloped(&self, plan: &Plan, row: usize) -> bool {
        !self.open.parameters.is_empty() && plan.is_sloped(row)
    }

    /// Takes note of the walls (K) that boil at one condition, by their streams.
    pub(super) fn count_boiling(&self, walls: impl IntoIterator<Item = (usize, f64)>) {
        let mut found = self.boiling.lock().unwrap_or_else(PoisonError::into_inner);
        for (s, wall) in walls {
            found[s] = (found[s].0 + 1, found[s].1.max(wall));
        }
    }

    /// Doubts about the conditions solved now, one sentence each.
    pub(super) fn notes(&self) -> Vec<String> {
        let (network, found) = (&self.study.model.network, self.boiling.lock().unwrap_or_else(PoisonError::into_inner));
        let note = |(s, (count, wall)): (usize, &(usize, f64))| {
            let what = network.boiling_note(s, *wall);
            format!("channel '{}' at {count} of the conditions solved now: {what}", network.streams[s].name)
        };
        found.iter().enumerate().filter(|(_, (count, _))| *count > 0).map(note).collect()
    }
}

/// Sets the solver up and hands it to `work`. Returns the result of `work` with the doubts about the conditions solved now, one
/// sentence each. The solver takes a plan and a row of it.
///
/// # Errors
/// Errors of `work`, or the shared setup fails.
pub(super) fn with<R>(
    study: &Study,
    open: &Open,
    plan: &Plan,
    work: impl FnOnce(&(dyn Fn(&Plan, usize) -> Result<Vec<f64>> + Sync)) -> Result<R>,
) -> Result<(R, Vec<String>)> {
    let own = Own::new(study, open, plan)?;
    let result = work(&|plan, row| own.values(plan, row, &own.state(plan, row, None)?))?;
    Ok((result, own.notes()))
}
