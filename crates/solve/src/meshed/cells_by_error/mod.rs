//! Cells that follow the error: as few as keep the error of the mesh within an accuracy in every reading.
//!
//! A mesh is given by the numbers of cells of every block along each of its axes, its *lines*. Each round begins with all lines cut in
//! two at once. The change of the readings gives the error of the mesh as a whole, which decides. Then each line alone gets twice its
//! cells, which gives its share in the error of every reading. Cells are added to the lines where each added cell takes the most from
//! the errors.

mod choice;
mod trial;

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::{MeshedMachine, budget};
use choice::{ORDER, Share, refined};
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::progress::Progress;
use coldplate_describe::machine::{Condition, Machine};
use coldplate_network::mesh::Mesh;
use trial::{Counts, Trials, cells, changed};

/// Cells to begin with, for each block, a count; blocks have at least eight. Chosen: rounds against the cost of the first ones.
const FIRST_PER_BLOCK: usize = 24;
/// Most rounds, a count. Chosen: time against accuracies that are refused.
const ROUNDS: usize = 20;
/// Fewest cells along a line that had more, a count. Chosen.
const FEWEST: usize = 2;
/// First rounds in which lines may lose cells, a count. Chosen: thrift against an end of the rounds.
const SHRINKING: usize = 6;
/// A line whose share in every reading is below this part of the accuracy is not asked again; dimensionless. Chosen: solutions against
/// lines that are missed.
const NEGLIGIBLE: f64 = 0.03;
/// Error that cells are chosen for, over the accuracy; dimensionless. Chosen: cells against rounds.
const AIM: f64 = 0.8;
/// Most cells that are chosen, a count; eight times as many are solved on in the end. Chosen: memory and time against accuracies that
/// are refused.
const MOST_CELLS: f64 = 500_000.0;
/// Conditions at which the lines are asked to begin with, a count. Chosen: solutions against conditions that are missed.
const ASKED_AT: usize = 3;

/// Cells that were chosen to keep readings within an accuracy.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenCells {
    /// Accuracy that was asked for, K.
    pub accuracy: f64,
    /// Estimated error of the mesh in each sensor, K, in the machine's order, at the condition with the largest error; `None` for
    /// displacements.
    pub sensors: Vec<Option<f64>>,
    /// Estimated error of the mesh in each limit's value, K.
    pub limits: Vec<Option<f64>>,
    /// For each part (index) whose cells the file states: estimated error from these cells, K, in the reading with the largest.
    pub stated: Vec<(usize, f64)>,
    /// Cells of the mesh with all lines cut in two, from which the estimates come.
    pub checked_on: usize,
    /// Number of conditions that keep the accuracy.
    pub conditions: usize,
    /// Cells and largest estimate, K, of every mesh on the way.
    pub rounds: Vec<(usize, f64)>,
}

impl MeshedMachine {
    /// Meshes `machine` with an error of the mesh below `accuracy` (K) in every temperature that a sensor reads or a limit looks at, at
    /// all of `conditions`. Cells that the file states for a block are kept.
    ///
    /// # Errors
    /// The accuracy is not above zero; the machine has imported parts, whose elements cannot be changed; it cannot be solved; the
    /// necessary cells do not fit into memory.
    pub fn within(machine: Machine, accuracy: f64, conditions: &[Condition], progress: &dyn Progress) -> Result<Self> {
        let (counts, chosen) = choose(&machine, accuracy, conditions, progress).map_err(|error| error.in_file(&machine.file))?;
        let mut mesh = Mesh::with_divisions(&machine, &counts, 1.0)?;
        let volume: f64 = (0..machine.parts.len()).map(|part| mesh.volume(part)).sum();
        mesh.element_size = (volume / mesh.cells.max(1) as f64).cbrt();
        let mut model = Self::on(machine, mesh)?;
        model.chosen = Some(chosen);
        Ok(model)
    }
}

fn choose(machine: &Machine, accuracy: f64, conditions: &[Condition], progress: &dyn Progress) -> Result<(Counts, ChosenCells)> {
    let trials = Trials::new(machine, conditions, accuracy)?;
    let all: Vec<usize> = (0..conditions.len()).collect();
    let mut asked_at = all.clone();
    let size = Mesh::size_for(machine, (FIRST_PER_BLOCK * trials.blocks()).max(1))?;
    let mut counts = Mesh::divisions_at(machine, size);
    let mut shares: Vec<Share> = Vec::new();
    let mut rounds: Vec<(usize, f64)> = Vec::new();
    let mut aim = AIM;
    while rounds.len() < ROUNDS {
        let now = cells(&counts) as usize;
        progress.at(&format!("choosing cells: {now}, and all lines of cells cut in two"));
        budget::check(cells(&changed(&counts, &trials.lines, |n| 2 * n))).map_err(|e| beyond(&rounds, accuracy, "", e.what()))?;
        let whole = trials.whole(&counts, &asked_at)?;
        if rounds.is_empty() && all.len() > ASKED_AT {
            asked_at = trials.telling(&whole.open, ASKED_AT);
            rounds.push((now, accuracy * whole.largest().1));
            continue;
        }
        let (at, largest) = whole.largest();
        rounds.push((now, accuracy * largest));
        if largest <= 1.0 {
            let everywhere = if asked_at.len() == all.len() { whole.clone() } else { trials.whole(&counts, &all)? };
            let missed = trials.telling(&everywhere.open, 1);
            if everywhere.largest().1 <= 1.0 || missed.iter().all(|m| asked_at.contains(m)) {
                let estimates: Vec<f64> = everywhere.open.iter().map(|open| open * accuracy).collect();
                let (sensors, limits) = trials.worst(&estimates);
                let checked_on = cells(&changed(&counts, &trials.lines, |n| 2 * n)) as usize;
                let beside = |(part, lines): &(usize, Vec<trial::CellLine>)| -> Result<(usize, f64)> {
                    let open = finer(&trials, &counts, lines, &all, &everywhere.own)?;
                    Ok((*part, accuracy * open.iter().fold(0.0, |m: f64, e| m.max(e.abs()))))
                };
                let stated = trials.stated.iter().map(beside).collect::<Result<_>>()?;
                return Ok((counts, ChosenCells { accuracy, sensors, limits, stated, checked_on, conditions: all.len(), rounds }));
            }
            asked_at.extend(missed);
            shares.clear();
            continue;
        }
        // No mesh has an error that falls faster than with the square of its number of cells.
        if now as f64 * largest.sqrt() > MOST_CELLS {
            let why = format!("so little takes more than {MOST_CELLS} cells");
            return Err(beyond(&rounds, accuracy, trials.name(at), &why));
        }
        shares = asked(&trials, &counts, &asked_at, &whole.own, &shares, progress)?;
        let more = refined(&counts, &mut shares, &whole.open, aim, rounds.len() <= SHRINKING);
        if more == counts {
            aim *= 0.7;
        }
        counts = more;
    }
    Err(beyond(&rounds, accuracy, "", &format!("{ROUNDS} rounds did not lead there")))
}

/// The refusal of an accuracy, after the last of some rounds.
fn beyond(rounds: &[(usize, f64)], accuracy: f64, reading: &str, why: &str) -> Error {
    let (cells, largest) = rounds.last().copied().unwrap_or_default();
    let place = if reading.is_empty() { String::new() } else { format!(" in '{reading}'") };
    let left = if cells > 0 { format!(": {cells} cells still leave {} K open{place}", significant(largest, 2)) } else { String::new() };
    let error = Error::input(format!("the accuracy cannot be had{left}; {why}")).at_key("mesh.accuracy");
    error.read(format!("{} K", significant(accuracy, 3))).help("ask for a larger one, or state --cells")
}

/// Share of every line in the errors, from readings `own` at conditions `at`; a line that was negligible before keeps its known share.
fn asked(trials: &Trials<'_>, counts: &Counts, at: &[usize], own: &[f64], known: &[Share], progress: &dyn Progress) -> Result<Vec<Share>> {
    let done = AtomicUsize::new(0);
    let lines = &trials.lines;
    let of = |line: &trial::CellLine| -> Result<Share> {
        if let Some(share) = known.iter().find(|s| s.line == *line && s.largest() < NEGLIGIBLE) {
            return Ok(share.clone());
        }
        let least = known.iter().find(|s| s.line == *line).map_or(line.least.max(FEWEST), |s| s.least);
        let open = finer(trials, counts, &[*line], at, own)?;
        progress.count(1 + done.fetch_add(1, Ordering::Relaxed), lines.len(), "lines of cells");
        Ok(Share { line: *line, open, least })
    };
    lines.par_iter().map(of).collect()
}

/// Error that the cells of some lines leave in readings `own` at conditions `at`, over the accuracy, from twice as many cells.
fn finer(trials: &Trials<'_>, counts: &Counts, lines: &[trial::CellLine], at: &[usize], own: &[f64]) -> Result<Vec<f64>> {
    let values = trials.values(&changed(counts, lines, |n| 2 * n), at)?;
    let factor = 1.0 / ((1.0 - 0.5f64.powf(ORDER)) * trials.accuracy);
    Ok(values.iter().zip(own).map(|(v, o)| (v - o) * factor).collect())
}
