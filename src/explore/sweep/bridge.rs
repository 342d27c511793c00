//! From a sweep file to the solver: machine, mesh, network and multigrid hierarchy are set up once, and every condition
//! starts from the same reference state, so that a result does not depend on which conditions went before.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use super::{Definition, Grow, Open, Plan, Subject, SweepOptions, Swept, execute_growing};
use crate::describe::machine::{Condition, Machine};
use crate::discretise::network::Load;
use crate::error::{Error, Result};
use crate::foundation::document::Document;
use crate::solve::Solver;
use crate::solve::meshed::SteadyState;
use crate::solve::sensitivity::{Derivatives, Study};

/// Conditions of a design for each one that others start from.
const WORTH_ONE_START: usize = 8;
/// Most conditions that others start from: each costs its memory and one product with the matrix per start.
const MOST_STARTS: usize = 16;

/// A sweep ready to run.
#[derive(Debug)]
pub struct Sweep {
    /// The sweep file.
    pub definition: Definition,
    /// The machine file with the machine on its mesh.
    pub study: Study,
    /// What is open of it.
    pub open: Open,
    /// The conditions.
    pub plan: Plan,
}

impl Sweep {
    /// Reads a sweep file and its machine and makes the mesh: of `cells` cells, or else as many as the sweep file says,
    /// or else as many as the machine file says. `sets` are changes to the machine file after those of the sweep file.
    ///
    /// # Errors
    /// One of the files is wrong, or the mesh cannot be made.
    pub fn open(path: impl AsRef<Path>, cells: Option<usize>, sets: &[(String, String)]) -> Result<Self> {
        let definition = Definition::read(path.as_ref())?;
        let sets: Vec<(String, String)> = definition.set.iter().chain(sets).cloned().collect();
        let mut document = Document::read(&definition.machine)?;
        for (key, value) in &sets {
            document.apply_set(key, value).map_err(|error| error.in_file(document.file()))?;
        }
        // Before the mesh, which takes its time: a mistake in the design should show at once.
        let plan = definition.plan(&Machine::from_document(&document)?.variables)?;
        let study = Study::new(document, cells.or(definition.cells))?;
        Self::of(definition, plan, study)
    }

    /// The same of what was read already.
    ///
    /// # Errors
    /// As [`Open::of`].
    pub fn of(definition: Definition, plan: Plan, study: Study) -> Result<Self> {
        let open = Open::of(&study, definition.uncertainty)?;
        Ok(Self { definition, study, open, plan })
    }

    /// What the results depend on, and what they are called.
    pub fn subject(&self) -> Subject {
        Subject {
            machine: self.study.model.machine.name.clone(),
            hash: self.study.model.machine.hash.clone(),
            mesh: format!("{} cells, {} nodes", self.study.model.mesh.cells, self.study.model.network.nodes),
            outputs: self.study.model.network.sensor_names.iter().map(|name| (name.clone(), "degC".to_string())).collect(),
            open: self.open.clone(),
        }
    }

    /// The middle of the ranges, where the shared setup is made.
    pub fn reference(&self) -> Condition {
        let middle = |v: usize| {
            let values = self.plan.conditions.iter().map(|row| row[v]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            0.5 * (low + high)
        };
        Condition::from_si((0..self.plan.variables.len()).map(middle).collect())
    }

    /// The shared setup, at the middle of the ranges, or at the first condition of the design where it can be made.
    fn solver(&self) -> Result<Solver<'_>> {
        let first = match self.study.model.solver(&self.reference()) {
            Ok(solver) => return Ok(solver),
            Err(error) => error,
        };
        let others = self.plan.conditions.iter().map(|row| self.study.model.solver(&Condition::from_si(row.clone())));
        others.flatten().next().ok_or_else(|| {
            Error::numerics(format!("every condition failed, that in the middle of the ranges because: {}", first.what()))
                .help("solve one of them with `coldplate solve`")
        })
    }

    /// Runs what the journal in `folder` does not hold yet and writes the tables.
    ///
    /// # Errors
    /// As [`super::execute`], or the shared setup fails.
    pub fn run(&self, folder: impl AsRef<Path>, options: SweepOptions<'_>) -> Result<Swept> {
        self.run_growing(folder.as_ref(), options, &mut |_| Ok(None))
    }

    /// The same, with what `grow` adds to it round by round, where the design grows.
    ///
    /// # Errors
    /// As [`Sweep::run`], and those of `grow`.
    pub fn run_growing(&self, folder: &Path, options: SweepOptions<'_>, grow: &mut Grow<'_>) -> Result<Swept> {
        let mut solver = self.solver()?;
        // Every condition starts from the same few, spread evenly over the design as the sweep file states it, so that none
        // depends on which others have been solved before it or in this run.
        let rows = &self.plan.conditions;
        let known = (rows.len() / WORTH_ONE_START).min(MOST_STARTS);
        let start = |i: usize| Load::at(&self.study.model.machine, &Condition::from_si(rows[i * rows.len() / known].clone()));
        solver.learn(&(0..known).filter_map(|i| start(i).ok()).collect::<Vec<_>>());
        // By stream: conditions solved now at which its wall boils, and the hottest wall, K.
        let boiling = Mutex::new(vec![(0, 0.0); self.study.model.network.streams.len()]);
        let solve = |plan: &Plan, row: usize| {
            let si = &plan.conditions[row];
            let state = self.study.model.solve(&solver, &Condition::from_si(si.clone()))?;
            self.count_boiling(&state, &mut boiling.lock().unwrap_or_else(PoisonError::into_inner));
            let mut values: Vec<f64> = self.study.model.readings(&state).into_iter().map(|t| t.0).collect();
            let count = self.open.parameters.len() * values.len();
            if count > 0 && plan.is_sloped(row) {
                let at = Derivatives::at(&self.study, &Condition::from_si(si.clone()), &state.solution.temperatures)?;
                values.extend(at.along_open(&self.open.parameters)?.into_iter().flatten());
            } else {
                values.extend(std::iter::repeat_n(0.0, count));
            }
            Ok(values)
        };
        let mut swept = execute_growing(&self.plan, &self.subject(), folder, options, solve, grow)?;
        let boiling = boiling.into_inner().unwrap_or_else(PoisonError::into_inner);
        let note = |(s, (count, wall)): (usize, &(usize, f64))| {
            let network = &self.study.model.network;
            let what = network.boiling_note(s, *wall);
            format!("channel '{}' at {count} of the conditions solved now: {what}", network.streams[s].name)
        };
        swept.notes = boiling.iter().enumerate().filter(|(_, (count, _))| *count > 0).map(note).collect();
        Ok(swept)
    }

    fn count_boiling(&self, state: &SteadyState, found: &mut [(usize, f64)]) {
        let solution = &state.solution;
        for (s, (count, hottest)) in found.iter_mut().enumerate() {
            if let Some(wall) = self.study.model.network.boiling_wall(s, &solution.streams[s], &solution.temperatures) {
                (*count, *hottest) = (*count + 1, hottest.max(wall));
            }
        }
    }
}
