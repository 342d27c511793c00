//! Given conditions, of which only those are solved in full that need it: the others are answered by a reduced model made of these,
//! where its bound allows.

use rayon::prelude::*;

use super::assemble::Snapshot;
use super::basis::Basis;
use super::cells::Guess;
use super::ground::{Calibrated, Ground, LEAST_MARGIN};
use super::model::{Answer, ReducedModel};
use crate::describe::machine::Condition;
use crate::discretise::network::Load;
use crate::error::Result;
use crate::foundation::progress::Progress;
use crate::foundation::random::Random;
use crate::solve::Solution;
use crate::solve::sensitivity::Study;

/// Conditions solved in full before the first reduced model, and for each variable that varies more.
const FIRST: (usize, usize) = (16, 4);
/// Fewest conditions added to the basis at a time, and the share of those in it.
const ROUND: (usize, usize) = (8, 4);
/// Most conditions that the basis is made of: a larger one is no longer cheap to make.
const MOST: usize = 160;
/// Further conditions solved in full that the bound is calibrated on.
const CHECKS: usize = 24;
/// Share of the accuracy that bounds of the least margin must keep: the calibrated one is larger.
const AIM: f64 = 0.4;
/// Seed of the order in which conditions are taken.
const SEED: u64 = 17;

/// What is asked.
pub struct Asked<'a> {
    /// The conditions.
    pub conditions: &'a [Condition],
    /// Those that are solved in full in any case, by their places: the basis begins with them.
    pub in_full: &'a dyn Fn(usize) -> bool,
    /// Largest bound on any reading of a condition that is not solved in full.
    pub accuracy: f64,
}

/// Solves conditions in full, by their places, from where they are guessed to be: temperatures of all nodes (K), none where it failed.
pub type InFull<'f> = dyn FnMut(&[usize], &Guesses<'_>) -> Result<Vec<Option<Vec<f64>>>> + 'f;
/// Where the solution of a condition is guessed to be, by its place; none where nothing is known of it.
pub type Guesses<'g> = dyn Fn(usize) -> Option<Guess> + Sync + 'g;

/// The answers of a reduced model, condition by condition; none where the full solution is needed. It is made of those that `solve`
/// was asked for, around the state `center` at a condition. The same conditions get the same answers.
///
/// # Errors
/// Those of `solve`, or a condition cannot be evaluated.
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
    // Of fewer conditions, those of the basis and of the calibration would be all.
    if count <= first + CHECKS + ROUND.0 {
        return Ok(found);
    }
    let ground = Ground::new(machine, network, Load::at(machine, middle)?, center, asked.accuracy);
    let snapshot = |row: usize, temperatures: &[f64]| -> Result<Snapshot> {
        let load = Load::at(machine, &asked.conditions[row])?;
        Ok(ground.snapshot(&load, &network.stream_states(&load, temperatures)?, temperatures))
    };
    // In a random order, those that are solved in any case before the others.
    let (mut open, others): (Vec<usize>, Vec<usize>) =
        Random::new(SEED).permutation(count).into_iter().partition(|row| (asked.in_full)(*row));
    open.extend(others);
    let mut snapshots = Vec::new();
    let join = |rows: &[usize], states: Vec<Option<Vec<f64>>>, snapshots: &mut Vec<Snapshot>| -> Result<()> {
        let known = rows.iter().zip(states).filter_map(|(row, state)| Some((*row, state?))).collect::<Vec<_>>();
        snapshots.extend(known.par_iter().map(|(row, state)| snapshot(*row, state)).collect::<Result<Vec<_>>>()?);
        Ok(())
    };
    // Errors at rows that are solved in full, and the answers of a model there.
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
        // The last conditions of the basis were predicted too, and lie where the bound was largest.
        let predicted = before.take().map_or(LEAST_MARGIN, |(model, _)| compare(&model, &next, &states).margin);
        join(&next, states, &mut snapshots)?;
        // Where no model can be made, everything is solved in full.
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

/// Those of some conditions whose largest bound is above `aim`, the largest first; where nothing is found it has no end.
fn beyond(model: &ReducedModel, asked: &Asked<'_>, rows: &[usize], aim: f64) -> Vec<(usize, f64)> {
    let bound = |row: &usize| (*row, model.steady(&asked.conditions[*row], &[]).map_or(f64::INFINITY, |answer| largest_bound(&answer)));
    let mut bounds: Vec<(usize, f64)> = rows.par_iter().map(bound).collect();
    bounds.retain(|(_, bound)| *bound > aim);
    bounds.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    bounds
}

/// The first of them, taken from what is open; as many as a basis of so many conditions is enlarged by.
fn worst(missed: Vec<(usize, f64)>, basis: usize, open: &mut Vec<usize>) -> Vec<usize> {
    let taken: Vec<usize> = missed.into_iter().take(ROUND.0.max(basis / ROUND.1)).map(|(row, _)| row).collect();
    open.retain(|row| !taken.contains(row));
    taken
}
