//! Answers at given conditions. Only some are solved in full; the others are answered by a reduced model made of these, if its
//! bound allows.

use rayon::prelude::*;

use super::assemble::Snapshot;
use super::basis::Basis;
use super::cell_fields::Guess;
use super::model::{Answer, ReducedModel};
use super::reference::{Calibrated, Ground, LEAST_MARGIN};
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_network::Load;
use coldplate_solve::Solution;
use coldplate_solve::sensitivity::Study;

/// Number of conditions solved in full before the first reduced model: `FIRST.0 + FIRST.1` · varying variables.
/// Chosen: fewer make the first bound a poor guide to the next conditions, more may be wasted.
const FIRST: (usize, usize) = (16, 4);
/// Conditions added to the basis at a time: at least `ROUND.0`, and at least one in `ROUND.1` of those already in it.
/// Chosen: fewer are placed better, more need fewer rounds.
const ROUND: (usize, usize) = (8, 4);
/// Most conditions that the basis is made of, a count. Chosen: a larger basis is no longer cheap to make.
const MOST: usize = 160;
/// Number of further conditions, solved in full, that the bound is calibrated on. Chosen: each costs a full solve,
/// fewer may miss the worst reading.
const CHECKS: usize = 24;
/// Share of the accuracy that bounds with the least margin must keep while conditions are added. Chosen below one,
/// because the calibrated margin is larger.
const AIM: f64 = 0.4;
/// Seed of the order in which conditions are taken, a number without meaning.
const SEED: u64 = 17;

/// Conditions that are asked for, and the accuracy.
pub struct Asked<'a> {
    /// The conditions.
    pub conditions: &'a [Condition],
    /// Whether the condition at a place is solved in full in any case; the basis begins with these.
    pub in_full: &'a dyn Fn(usize) -> bool,
    /// Largest bound on any reading of a condition that is not solved in full, K.
    pub accuracy: f64,
}

/// Solves the conditions at these places in full, each started from its guess. Returns temperatures of all nodes (K), none if the
/// solve failed.
pub type InFull<'f> = dyn FnMut(&[usize], &Guesses<'_>) -> Result<Vec<Option<Vec<f64>>>> + 'f;
/// Guess of the solution of the condition at a place; none if nothing is known of it.
pub type Guesses<'g> = dyn Fn(usize) -> Option<Guess> + Sync + 'g;

/// Answers of a reduced model, condition by condition; none if the full solution is needed. The model is made of the conditions
/// that `solve` was asked for, around the state `center` at the condition `middle`. Equal conditions get equal answers.
///
/// # Errors
/// Errors of `solve`, or a condition cannot be evaluated.
pub fn answers(
    study: &Study,
    (middle, center): (&Condition, Solution),
    asked: &Asked<'_>,
    solve: &mut InFull<'_>,
    progress: &dyn Progress,
) -> Result<Vec<Option<Answer>>> {
    let (machine, network, count) = (&study.model.machine, &study.model.network, asked.conditions.len());
    let mut found: Vec<Option<Answer>> = vec![None; count];
    let ranges = ranges(asked.conditions);
    let first = FIRST.0 + FIRST.1 * ranges.iter().filter(|(low, high)| high > low).count();
    // With fewer conditions, basis and calibration would take them all.
    if count <= first + CHECKS + ROUND.0 {
        return Ok(found);
    }
    let ground = Ground::new(machine, network, Load::at(machine, middle)?, center, asked.accuracy);
    let snapshot = |row: usize, temperatures: &[f64]| -> Result<Snapshot> {
        let load = Load::at(machine, &asked.conditions[row])?;
        Ok(ground.snapshot(&load, &network.stream_states(&load, temperatures)?, temperatures))
    };
    // A random order, conditions that are solved in any case first.
    let (mut open, others): (Vec<usize>, Vec<usize>) =
        Random::new(SEED).permutation(count).into_iter().partition(|row| (asked.in_full)(*row));
    open.extend(others);
    let mut snapshots = Vec::new();
    let join = |rows: &[usize], states: Vec<Option<Vec<f64>>>, snapshots: &mut Vec<Snapshot>| -> Result<()> {
        let known = rows.iter().zip(states).filter_map(|(row, state)| Some((*row, state?))).collect::<Vec<_>>();
        snapshots.extend(known.par_iter().map(|(row, state)| snapshot(*row, state)).collect::<Result<Vec<_>>>()?);
        Ok(())
    };
    // Calibration from the errors at rows that are solved in full, and a model's answers there.
    let compare = |model: &ReducedModel, rows: &[usize], states: &[Option<Vec<f64>>]| -> Calibrated {
        let one = |(row, state): (&usize, &Option<Vec<f64>>)| {
            let (load, state) = (Load::at(machine, &asked.conditions[*row]).ok()?, state.as_ref()?);
            let answer = model.steady(&asked.conditions[*row], &[]).ok()?;
            let errors = network.sensors.iter().zip(&answer.readings).map(|(s, r)| (s.read(state, &load) - r).abs()).collect();
            Some((errors, answer))
        };
        Calibrated::at(&rows.par_iter().zip(states).filter_map(one).collect::<Vec<_>>())
    };
    let mut margin = LEAST_MARGIN;
    let mut before: Option<(ReducedModel, Basis)> = None;
    let guess = |known: Option<&(ReducedModel, Basis)>, row: usize| {
        let (model, basis) = known?;
        let (load, answer) = (Load::at(machine, &asked.conditions[row]).ok()?, model.steady(&asked.conditions[row], &[]).ok()?);
        model.guess(&answer, (network, &load), ground.center(), &basis.modes).ok()
    };
    let mut next: Vec<usize> = open.drain(..first).collect();
    loop {
        let states = solve(&next, &|row| guess(before.as_ref(), row))?;
        // The last conditions of the basis were predicted too; they are those with the largest bounds.
        let predicted = before.take().map_or(LEAST_MARGIN, |(model, _)| compare(&model, &next, &states).margin);
        join(&next, states, &mut snapshots)?;
        // If no model can be made, everything is solved in full.
        let Ok((model, basis)) = ground.model(&snapshots, &ranges) else { return Ok(found) };
        let model = ReducedModel { margin, ..model };
        let aim = if margin > LEAST_MARGIN { asked.accuracy } else { (AIM * asked.accuracy).max(model.floor) };
        let missed = beyond(&model, asked, &open, aim);
        let largest = missed.first().map_or(aim, |(_, bound)| *bound);
        progress.at(&format!("{} conditions in the basis, {} modes: largest bound {largest:.1e} K", snapshots.len(), model.fine.len()));
        if !missed.is_empty() && snapshots.len() < MOST {
            next = worst(missed, snapshots.len(), &mut open);
            before = Some((model, basis));
            continue;
        }
        let known = open.iter().filter(|row| (asked.in_full)(**row)).count();
        let checks: Vec<usize> = open.drain(..known.max(CHECKS).min(open.len())).collect();
        let known = (model, basis);
        let states = solve(&checks, &|row| guess(Some(&known), row))?;
        let (mut model, basis) = known;
        let calibrated = compare(&model, &checks, &states);
        margin = margin.max(calibrated.margin).max(predicted);
        (model.margin, model.floor) = (margin, calibrated.floor);
        let missed = beyond(&model, asked, &open, asked.accuracy);
        if missed.len() <= ROUND.0 || snapshots.len() >= MOST {
            let answers: Vec<(usize, Answer)> =
                open.par_iter().filter_map(|row| Some((*row, model.steady(&asked.conditions[*row], &[]).ok()?))).collect();
            for (row, answer) in answers.into_iter().filter(|(_, answer)| largest_bound(answer) <= asked.accuracy) {
                found[row] = Some(answer);
            }
            return Ok(found);
        }
        // The calibrated bound asks for a finer model.
        join(&checks, states, &mut snapshots)?;
        next = worst(missed, snapshots.len(), &mut open);
        before = Some((model, basis));
    }
}

/// Lowest and highest value of every variable.
fn ranges(conditions: &[Condition]) -> Vec<(f64, f64)> {
    let of = |v: usize| {
        let values = conditions.iter().map(|c| c.si()[v]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (f64::min(low, x), f64::max(high, x)))
    };
    (0..conditions.first().map_or(0, |c| c.si().len())).map(of).collect()
}

fn largest_bound(answer: &Answer) -> f64 {
    answer.bounds.iter().fold(0.0, |most: f64, bound| most.max(*bound))
}

/// Conditions of `rows` whose largest bound is above `aim`, the largest first; without a steady state the bound is
/// infinite.
fn beyond(model: &ReducedModel, asked: &Asked<'_>, rows: &[usize], aim: f64) -> Vec<(usize, f64)> {
    let bound = |row: &usize| (*row, model.steady(&asked.conditions[*row], &[]).map_or(f64::INFINITY, |answer| largest_bound(&answer)));
    let mut bounds: Vec<(usize, f64)> = rows.par_iter().map(bound).collect();
    bounds.retain(|(_, bound)| *bound > aim);
    bounds.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    bounds
}

/// Takes the first of the `missed` conditions out of `open`; their number follows from the size of the basis.
fn worst(missed: Vec<(usize, f64)>, basis: usize, open: &mut Vec<usize>) -> Vec<usize> {
    let taken: Vec<usize> = missed.into_iter().take(ROUND.0.max(basis / ROUND.1)).map(|(row, _)| row).collect();
    open.retain(|row| !taken.contains(row));
    taken
}
