//! A sweep file with everything that a run of it needs.

use std::path::{Path, PathBuf};

use super::journal::ConditionOutcome;
use super::merge::{self, Merged};
use super::mesh_errors::{Remarks, remarks};
use super::own_solver::Own;
use super::shards::{self, Shard, ShardRecord};
use super::{
    Grow, Open, Plan, SolvedBy, SweepDefinition, SweepOptions, SweepSubject, Swept, execute_remarked, own_solver, reduced_answers,
};
use crate::external::{Program, TemplateValues};
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::{Progress, Silent};
use coldplate_describe::machine::{Condition, Machine, ModelError, Scope};
use coldplate_solve::study::Study;

/// Most conditions of the design that cells are chosen for, count, if the machine file asks for an accuracy of the mesh.
/// Chosen: each costs solves.
const CHOSEN_AT: usize = 16;

/// A sweep ready to run.
#[derive(Debug)]
pub struct Sweep {
    /// The sweep file.
    pub definition: SweepDefinition,
    /// Variables, measurement points and limits of the sweep.
    pub scope: Scope,
    /// The conditions.
    pub plan: Plan,
    solver: Solving,
}

/// Solver of the sweep.
#[derive(Debug)]
enum Solving {
    /// Our own solver: the machine file with the machine on its mesh, and its uncertain parameters.
    Own(Box<(Study, Open)>),
    /// Another program.
    Program(Box<Program>),
}

impl Sweep {
    /// Reads a sweep file and its machine and makes the mesh: of `cells` cells, or else as many as the sweep file states, or
    /// else as many as the machine file states. `sets` are changes to the machine file after those of the sweep file. Another
    /// program that solves is asked for its version.
    ///
    /// # Errors
    /// One of the files is wrong, the mesh cannot be made, or the program not be run.
    pub fn open(path: impl AsRef<Path>, cells: Option<usize>, sets: &[(String, String)]) -> Result<Self> {
        Self::open_heard(path, cells, sets, &Silent)
    }

    /// [`Sweep::open`] with a word on the choice of cells that an accuracy asks for.
    ///
    /// # Errors
    /// Errors of [`Sweep::open`].
    pub fn open_heard(path: impl AsRef<Path>, cells: Option<usize>, sets: &[(String, String)], progress: &dyn Progress) -> Result<Self> {
        let definition = SweepDefinition::read(path.as_ref())?;
        let (scope, program) = definition.asked(sets)?;
        // Before the mesh, which takes its time: a mistake in the design should show at once.
        let plan = definition.plan(&scope.variables)?;
        match (program, definition.machine_file(sets)?) {
            (Some(mut program), _) => {
                if cells.is_some() {
                    return Err(Error::input("another program makes its own mesh").at_key("--cells").help("leave it out"));
                }
                program.ask_version().map_err(|e| e.in_file(path))?;
                Ok(Self { definition, scope, plan, solver: Solving::Program(Box::new(program)) })
            }
            (None, Some(document)) => {
                let rows: Vec<Condition> = plan.conditions.iter().map(|row| Condition::from_si(row.clone())).collect();
                let counting = |_: &Machine| Ok(Condition::far_apart(&rows, CHOSEN_AT));
                let study = Study::for_conditions(document, cells.or(definition.cells), counting, progress)?;
                Self::of(definition, plan, study)
            }
            (None, None) => Err(Error::input("there is neither a machine nor a solver").in_file(path).help("name the machine file")),
        }
    }

    /// A sweep of a machine that was read already.
    ///
    /// # Errors
    /// Errors of [`Open::of`].
    pub fn of(definition: SweepDefinition, plan: Plan, study: Study) -> Result<Self> {
        let open = Open::of(&study, definition.uncertainty)?;
        Ok(Self { definition, scope: study.model.machine.scope(), plan, solver: Solving::Own(Box::new((study, open))) })
    }

    /// The machine file with the machine on its mesh, if our own solver is used.
    pub fn study(&self) -> Option<&Study> {
        if let Solving::Own(own) = &self.solver { Some(&own.0) } else { None }
    }

    /// The other program that solves, if there is one.
    pub fn program(&self) -> Option<&Program> {
        if let Solving::Program(program) = &self.solver { Some(program) } else { None }
    }

    /// Solver in words, for a line that names the sweep: `on 5000 cells`, `by ccx, version 2.20`.
    pub fn solver_in_words(&self) -> String {
        match &self.solver {
            Solving::Own(own) => format!("on {} cells", own.0.model.mesh.cells),
            Solving::Program(program) => format!("by {}", program.called()),
        }
    }

    /// Identity and names of the results.
    pub fn subject(&self) -> SweepSubject {
        let (machine, hash) = (self.scope.name.clone(), self.scope.hash.clone());
        match &self.solver {
            Solving::Own(own) => {
                let (study, open) = own.as_ref();
                let mesh = format!("{} cells, {} nodes", study.model.mesh.cells, study.model.network.nodes);
                let outputs = study.model.machine.sensors.iter().map(|s| (s.name.clone(), s.measurand().unit().to_string())).collect();
                SweepSubject { machine, hash, by: SolvedBy::Mesh(mesh), outputs, open: open.clone() }
            }
            Solving::Program(program) => {
                let by =
                    SolvedBy::Program { name: program.called(), recover: program.readings.iter().map(|reading| reading.recover).collect() };
                let outputs: Vec<(String, String)> = program.points().into_iter().map(|point| (point.name, point.unit)).collect();
                let sensors = vec![0.0; outputs.len()];
                let model_error = ModelError { sensors, common: 0.0, growth: 0.0, measured: Vec::new(), is_stated: false };
                SweepSubject { machine, hash, by, outputs, open: Open { parameters: Vec::new(), correlations: Vec::new(), model_error } }
            }
        }
    }

    /// Sets that every condition is solved in full, whatever accuracy the sweep file asks for.
    pub fn solve_in_full(&mut self) {
        self.plan.accuracy = None;
    }

    /// The middle of the ranges.
    pub fn reference(&self) -> Condition {
        self.plan.middle()
    }

    /// Runs the conditions that the journal in `folder` does not hold yet and writes the tables.
    ///
    /// # Errors
    /// Errors of [`super::execute`], or the shared setup fails.
    pub fn run(&self, folder: impl AsRef<Path>, options: SweepOptions<'_>) -> Result<Swept> {
        self.run_growing(folder.as_ref(), options, &mut |_| Ok(None))
    }

    /// Runs the sweep as [`Sweep::run`] does, with the conditions that `grow` adds round by round if the design grows.
    ///
    /// # Errors
    /// Errors of [`Sweep::run`] and of `grow`.
    pub fn run_growing(&self, folder: &Path, options: SweepOptions<'_>, grow: &mut Grow<'_>) -> Result<Swept> {
        let subject = self.subject();
        if let (Solving::Own(own), Some(accuracy)) = (&self.solver, self.plan.accuracy) {
            return reduced_answers::execute(&Own::new(&own.0, &own.1, &self.plan)?, &self.plan, &subject, folder, options, accuracy);
        }
        let (mut swept, notes) = self.solving(folder, options, |solve, options| self.execute(&subject, folder, options, solve, grow))?;
        swept.notes.extend(notes);
        Ok(swept)
    }

    /// Runs the plan with `solve` at single conditions, and remarks on the error of the mesh.
    fn execute(
        &self,
        subject: &SweepSubject,
        folder: &Path,
        options: SweepOptions<'_>,
        solve: impl Fn(&Plan, usize) -> Result<Vec<f64>> + Sync,
        grow: &mut Grow<'_>,
    ) -> Result<Swept> {
        let remark = |plan: &Plan, outcomes: &[ConditionOutcome]| {
            self.study().map_or_else(Remarks::default, |study| remarks(&study.model, subject, plan, outcomes))
        };
        execute_remarked(&self.plan, subject, folder, options, solve, grow, &remark)
    }

    /// Runs the missing conditions of one part, into a journal of its own below `folder`.
    ///
    /// # Errors
    /// Errors of [`shards::run`].
    pub fn run_shard(&self, folder: &Path, shard: Shard, options: SweepOptions<'_>) -> Result<ShardRecord> {
        let subject = self.subject();
        Ok(self.solving(folder, options, |solve, options| shards::run(&self.plan, &subject, folder, shard, options, solve))?.0)
    }

    /// Merges the conditions of other journals into that of `folder`.
    ///
    /// # Errors
    /// Errors of [`merge::merge`].
    pub fn merge(&self, folder: &Path, journals: &[PathBuf]) -> Result<Merged> {
        merge::merge(&self.plan, &self.subject(), folder, journals)
    }

    /// Merges journals as [`Sweep::merge`] does; there may be no other journals yet.
    ///
    /// # Errors
    /// Errors of [`merge::merge_any`].
    pub(crate) fn merge_any(&self, folder: &Path, journals: &[PathBuf]) -> Result<Merged> {
        merge::merge_any(&self.plan, &self.subject(), folder, journals)
    }

    /// Writes the tables of a sweep whose journal in `folder` holds every condition; nothing is solved.
    ///
    /// # Errors
    /// Errors of [`Sweep::run`].
    pub fn tables(&self, folder: &Path) -> Result<Swept> {
        let missing = |_: &Plan, _| Err(Error::numerics("the journal does not hold it"));
        self.execute(&self.subject(), folder, SweepOptions::default(), missing, &mut |_| Ok(None))
    }

    /// Sets the solver up and hands it to `work`, with the options that suit it. Returns the doubts about the conditions as
    /// notes.
    fn solving<R>(
        &self,
        folder: &Path,
        options: SweepOptions<'_>,
        work: impl FnOnce(&(dyn Fn(&Plan, usize) -> Result<Vec<f64>> + Sync), SweepOptions<'_>) -> Result<R>,
    ) -> Result<(R, Vec<String>)> {
        match &self.solver {
            Solving::Own(own) => own_solver::with(&own.0, &own.1, &self.plan, |solve| work(solve, options)),
            Solving::Program(program) => {
                let workshop = program.workshop(folder);
                let options = SweepOptions { threads: program.at_once.or(options.threads), ..options };
                let solve = |plan: &Plan, row: usize| workshop.solve(TemplateValues { si: &plan.conditions[row], shown: &plan.shown[row] });
                Ok((work(&solve, options)?, Vec::new()))
            }
        }
    }
}
