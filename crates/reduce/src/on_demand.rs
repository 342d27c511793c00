//! Answers at given conditions. Only some are solved in full; the others are answered by a reduced model made of these, if its
//! bound allows.

use rayon::prelude::*;

use super::assemble::Snapshot;
use super::calibration::{Calibration, ComparedAnswer, FLOOR, LEAST_MARGIN};
use super::growth::{AIM, BasisGrowth, FIRST, Grown, Guess, ROUND};
use super::model::{ReducedAnswer, ReducedModel};
use super::reference::ReferenceNetwork;
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_base::random::Random;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::{Load, Network};
use coldplate_solve::Solution;
use coldplate_solve::study::Study;

/// Conditions added to the basis at a time are at least one in this many of those already in it, a count. Chosen: fewer
/// are placed better, more need fewer rounds.
const PART: usize = 4;
/// Most conditions that the basis is made of, a count. Chosen: a larger basis is no longer cheap to make.
const MOST: usize = 160;
/// Number of further conditions, solved in full, that the bound is calibrated on. Chosen: each costs a full solve,
/// fewer may miss the worst reading.
const CHECKS: usize = 24;
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
    middle: &Condition,
    center: Solution,
    asked: &Asked<'_>,
    solve: &mut InFull<'_>,
    progress: &dyn Progress,
) -> Result<Vec<Option<ReducedAnswer>>> {
    let (machine, network, count) = (&study.model.machine, &study.model.network, asked.conditions.len());
    let mut found: Vec<Option<ReducedAnswer>> = vec![None; count];
    let ranges = ranges(asked.conditions);
    let first = FIRST.0 + FIRST.1 * ranges.iter().filter(|(low, high)| high > low).count();
    // With fewer conditions, basis and calibration would take them all; reduced models follow no controllers.
    if count <= first + CHECKS + ROUND || !machine.controllers.is_empty() {
        return Ok(found);
    }
    let reference = ReferenceNetwork::new(machine, network, Load::at(machine, middle)?, center, asked.accuracy);
    let mut rows = Rows { machine, network, conditions: asked.conditions, reference: &reference, solve, predicted: LEAST_MARGIN };
    // A random order, conditions that are solved in any case first.
    let (mut open, others): (Vec<usize>, Vec<usize>) =
        Random::new(SEED).permutation(count).into_iter().partition(|row| (asked.in_full)(*row));
    open.extend(others);
    let steady = |model: &ReducedModel, row: usize| model.steady(&asked.conditions[row], &[]);
    let further = |solved: usize, missed: usize| ROUND.max(solved / PART).min(missed);
    let round = |solved: usize, _: usize, missed: usize| if solved < MOST { further(solved, missed) } else { 0 };
    let mut growth = BasisGrowth {
        reference: &reference,
        ranges: &ranges,
        parameters: Vec::new(),
        left_out: Vec::new(),
        steady: &steady,
        round: &round,
        margin: LEAST_MARGIN,
        open,
        snapshots: Vec::new(),
        failed: 0,
        worst: 0.0,
    };
    let start = growth.open[..first].to_vec();
    growth.add(&start, None, &mut |at, known| rows.added(at, known))?;
    // If no model can be made, everything is solved in full.
    let Ok(mut grown) = growth.grown() else { return Ok(found) };
    loop {
        let aim = if growth.margin > LEAST_MARGIN { asked.accuracy } else { (AIM * asked.accuracy).max(FLOOR) };
        grown = growth.until(grown, aim, &mut |at, known| rows.added(at, known), progress)?;
        let known = growth.open.iter().filter(|row| (asked.in_full)(**row)).count();
        let checks: Vec<usize> = growth.open.drain(..known.max(CHECKS).min(growth.open.len())).collect();
        let states = rows.states(&checks, Some(&grown))?;
        let calibrated = rows.calibration(&grown.model, &checks, &states);
        growth.margin = growth.margin.max(calibrated.margin).max(rows.predicted);
        (grown.model.margin, grown.model.floor) = (growth.margin, calibrated.floor);
        let bounds = growth.bounds(&grown.model);
        let missed = bounds.iter().filter(|(_, bound)| *bound > asked.accuracy).count();
        if missed <= ROUND || growth.snapshots.len() >= MOST {
            let answer = |row: &usize| Some((*row, steady(&grown.model, *row).ok()?));
            let answers: Vec<(usize, ReducedAnswer)> = growth.open.par_iter().filter_map(answer).collect();
            for (row, answer) in answers.into_iter().filter(|(_, answer)| answer.largest_bound() <= asked.accuracy) {
                found[row] = Some(answer);
            }
            return Ok(found);
        }
        // The calibrated bound asks for a finer model.
        growth.snapshots.extend(rows.snapshots(&checks, states)?);
        let next: Vec<usize> = bounds.iter().take(further(growth.snapshots.len(), missed)).map(|(row, _)| *row).collect();
        growth.add(&next, Some(&grown), &mut |at, known| rows.added(at, known))?;
        grown = growth.grown()?;
    }
}

/// Conditions of a table and their full solutions: temperatures of all nodes, K.
struct Rows<'a, 'f> {
    machine: &'a Machine,
    network: &'a Network,
    conditions: &'a [Condition],
    reference: &'a ReferenceNetwork<'a>,
    solve: &'a mut InFull<'f>,
    /// Margin that the bound needed at the last conditions of the basis, which were predicted too; they are those with the largest
    /// bounds.
    predicted: f64,
}

impl Rows<'_, '_> {
    /// Full solutions, each started from the field of a model if there is one.
    fn states(&mut self, rows: &[usize], known: Option<&Grown>) -> Result<Vec<Option<Vec<f64>>>> {
        let Self { machine, network, conditions, reference, .. } = *self;
        let guess = |row: usize| {
            let (known, load) = (known?, Load::at(machine, &conditions[row]).ok()?);
            known.guess(&conditions[row], &[], network, &load, reference.center())
        };
        (self.solve)(rows, &guess)
    }

    /// Full solutions for the basis.
    fn added(&mut self, rows: &[usize], known: Option<&Grown>) -> Result<Vec<Snapshot>> {
        let states = self.states(rows, known)?;
        self.predicted = known.map_or(LEAST_MARGIN, |known| self.calibration(&known.model, rows, &states).margin);
        self.snapshots(rows, states)
    }

    /// Calibration of a model at rows with their full solutions.
    fn calibration(&self, model: &ReducedModel, rows: &[usize], states: &[Option<Vec<f64>>]) -> Calibration {
        let Self { machine, network, conditions, .. } = *self;
        let one = |(row, state): (&usize, &Option<Vec<f64>>)| {
            let (load, state) = (Load::at(machine, &conditions[*row]).ok()?, state.as_ref()?);
            let truth: Vec<f64> = network.sensors.iter().map(|sensor| sensor.read(state, &load)).collect();
            Some(ComparedAnswer::of(model.steady(&conditions[*row], &[]).ok()?, &truth))
        };
        Calibration::at(&rows.par_iter().zip(states).filter_map(one).collect::<Vec<_>>())
    }

    /// Snapshots of the rows that have a full solution.
    fn snapshots(&self, rows: &[usize], states: Vec<Option<Vec<f64>>>) -> Result<Vec<Snapshot>> {
        let Self { machine, network, conditions, reference, .. } = *self;
        let one = |(row, state): (usize, Vec<f64>)| {
            let load = Load::at(machine, &conditions[row])?;
            Ok(reference.snapshot(&load, &network.stream_states(&load, &state)?, &state))
        };
        let known: Vec<(usize, Vec<f64>)> = rows.iter().zip(states).filter_map(|(row, state)| Some((*row, state?))).collect();
        known.into_par_iter().map(one).collect()
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
