//! Our own solver: network and multigrid hierarchy are set up once, and every condition starts from the same reference state, so
//! that a result does not depend on which conditions went before.

use std::sync::{Mutex, PoisonError};

use super::{Open, Plan};
use crate::describe::machine::Condition;
use crate::discretise::network::Load;
use crate::error::{Error, Result};
use crate::solve::Solver;
use crate::solve::meshed::SteadyState;
use crate::solve::sensitivity::{Derivatives, Study};

/// Conditions of a design for each one that others start from.
const WORTH_ONE_START: usize = 8;
/// Most conditions that others start from: each costs its memory and one product with the matrix per start.
const MOST_STARTS: usize = 16;

/// The shared setup, at the middle of the ranges, or at the first condition of the design where it can be made.
fn solver<'a>(study: &'a Study, plan: &Plan) -> Result<Solver<'a>> {
    let first = match study.model.solver(&plan.middle()) {
        Ok(solver) => return Ok(solver),
        Err(error) => error,
    };
    let others = plan.conditions.iter().map(|row| study.model.solver(&Condition::from_si(row.clone())));
    others.flatten().next().ok_or_else(|| {
        Error::numerics(format!("every condition failed, that in the middle of the ranges because: {}", first.what()))
            .help("solve one of them with `coldplate solve`")
    })
}

/// Sets the solver up and hands it to `work`, whose result comes back with what is doubtful about the conditions solved now, one
/// sentence each. The solver takes a plan and a row of it.
///
/// # Errors
/// Those of `work`, or the shared setup fails.
pub(super) fn with<R>(
    study: &Study,
    open: &Open,
    plan: &Plan,
    work: impl FnOnce(&(dyn Fn(&Plan, usize) -> Result<Vec<f64>> + Sync)) -> Result<R>,
) -> Result<(R, Vec<String>)> {
    let mut solver = solver(study, plan)?;
    // Every condition starts from the same few, spread evenly over the design as the sweep file states it, so that none
    // depends on which others have been solved before it or in this run.
    let rows = &plan.conditions;
    let known = (rows.len() / WORTH_ONE_START).min(MOST_STARTS);
    let start = |i: usize| Load::at(&study.model.machine, &Condition::from_si(rows[i * rows.len() / known].clone()));
    solver.learn(&(0..known).filter_map(|i| start(i).ok()).collect::<Vec<_>>());
    // By stream: conditions solved now at which its wall boils, and the hottest wall, K.
    let boiling = Mutex::new(vec![(0, 0.0); study.model.network.streams.len()]);
    let solve = |plan: &Plan, row: usize| {
        let si = &plan.conditions[row];
        let state = study.model.solve(&solver, &Condition::from_si(si.clone()))?;
        count_boiling(study, &state, &mut boiling.lock().unwrap_or_else(PoisonError::into_inner));
        let mut values = study.model.readings(&state);
        let count = open.parameters.len() * values.len();
        if count > 0 && plan.is_sloped(row) {
            let at = Derivatives::at(study, &Condition::from_si(si.clone()), &state.solution.temperatures)?;
            values.extend(at.along_open(&open.parameters)?.into_iter().flatten());
        } else {
            values.extend(std::iter::repeat_n(0.0, count));
        }
        Ok(values)
    };
    let result = work(&solve)?;
    let boiling = boiling.into_inner().unwrap_or_else(PoisonError::into_inner);
    let note = |(s, (count, wall)): (usize, &(usize, f64))| {
        let network = &study.model.network;
        let what = network.boiling_note(s, *wall);
        format!("channel '{}' at {count} of the conditions solved now: {what}", network.streams[s].name)
    };
    let notes = boiling.iter().enumerate().filter(|(_, (count, _))| *count > 0).map(note).collect();
    Ok((result, notes))
}

fn count_boiling(study: &Study, state: &SteadyState, found: &mut [(usize, f64)]) {
    let solution = &state.solution;
    for (s, (count, hottest)) in found.iter_mut().enumerate() {
        if let Some(wall) = study.model.network.boiling_wall(s, &solution.streams[s], &solution.temperatures) {
            (*count, *hottest) = (*count + 1, hottest.max(wall));
        }
    }
}
