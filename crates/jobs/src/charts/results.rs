//! Sources of the numbers in charts: sweeps solved already or to be solved now, and machines on their meshes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::super::adaptive::{self, FinishedSweep};
use super::super::designs::{DesignTables, FittedDesigns, fit_designs};
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_describe::machine::Scope;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{Plan, SweepDefinition, SweepOptions};
use coldplate_solve::study::Study;
use coldplate_tables::Table;

/// Results of a sweep.
#[derive(Debug)]
pub struct SweepResult {
    /// Conditions of the sweep.
    pub plan: Plan,
    /// Name of the machine.
    pub machine: String,
    /// Every condition with its readings.
    pub table: Table,
    /// A surrogate of the sweep's designs; `None` if it varies one variable at a time only.
    pub fitted: Option<FittedDesigns>,
}

/// Sweeps and machines that have been opened, so that several charts share them.
pub struct Results<'a> {
    root: PathBuf,
    options: SweepOptions<'a>,
    progress: &'a dyn Progress,
    sweeps: BTreeMap<PathBuf, Rc<SweepResult>>,
    machines: BTreeMap<PathBuf, Rc<Study>>,
}

impl<'a> Results<'a> {
    /// Results of sweeps are looked for, and kept, in `root`/NAME after the name of the sweep file; `progress` hears what is
    /// being done.
    pub fn new(root: &Path, options: SweepOptions<'a>, progress: &'a dyn Progress) -> Self {
        Self { root: root.to_path_buf(), options, progress, sweeps: BTreeMap::new(), machines: BTreeMap::new() }
    }

    /// Adds the results of a sweep that have just been found.
    pub fn insert(&mut self, sweep: &Path, result: Rc<SweepResult>) {
        self.sweeps.insert(key(sweep), result);
    }

    /// The results of a sweep file. Conditions that its journal does not hold are solved now.
    ///
    /// # Errors
    /// The sweep or its machine cannot be read; every condition failed; the folder cannot be written.
    pub fn sweep(&mut self, path: &Path) -> Result<Rc<SweepResult>> {
        if let Some(known) = self.sweeps.get(&key(path)) {
            return Ok(Rc::clone(known));
        }
        let definition = SweepDefinition::read(path)?;
        let scope = definition.scope(&[])?;
        let plan = definition.plan(&scope.variables)?;
        let folder = self.root.join(path.file_stem().unwrap_or("sweep".as_ref()));
        let (plan, tables, fit) = match finished(&folder, &plan, &scope)? {
            Some(found) => (plan, found, None),
            None => {
                self.progress.say(&format!("{}: solving conditions that {} does not hold yet", path.display(), folder.display()));
                let FinishedSweep { swept, fit, .. } =
                    adaptive::run(&Sweep::open_heard(path, None, &[], self.progress)?, &folder, self.options, self.progress)?;
                let tables = DesignTables::from(&swept);
                (swept.plan, tables, fit)
            }
        };
        let fitted = fit_designs(&plan, &scope, &tables, definition.fit, fit)?;
        let result = Rc::new(SweepResult { plan, machine: scope.name, table: tables.fitted, fitted });
        self.sweeps.insert(key(path), Rc::clone(&result));
        Ok(result)
    }

    /// A machine on its own mesh.
    ///
    /// # Errors
    /// The machine file cannot be read, or the mesh cannot be made.
    pub fn machine(&mut self, path: &Path) -> Result<Rc<Study>> {
        if let Some(known) = self.machines.get(&key(path)) {
            return Ok(Rc::clone(known));
        }
        let made = Rc::new(Study::read(path, &[], None)?);
        self.machines.insert(key(path), Rc::clone(&made));
        Ok(made)
    }
}

/// Canonical path of a file, so that different names of one file are equal.
fn key(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// The tables in `folder`, if they are of this machine and hold every condition of the plan.
fn finished(folder: &Path, plan: &Plan, scope: &Scope) -> Result<Option<DesignTables>> {
    let path = folder.join("sweep.csv");
    // Only its rounds know whether an adaptive design is finished.
    if plan.growth.is_some() || !path.exists() {
        return Ok(None);
    }
    let fitted = Table::read(&path)?;
    let hash = fitted.provenance.iter().find(|(k, _)| k == "machine hash" || k == "solver hash").map(|(_, v)| v.as_str());
    if hash != Some(scope.hash.as_str()) {
        return Err(Error::input("these results are of another machine file or solver than the sweep names now")
            .in_file(&path)
            .help("remove the folder, or look for results elsewhere with --results DIR"));
    }
    let beside = |name: &str| Some(folder.join(name)).filter(|path| path.exists()).map(Table::read).transpose();
    let (validation, slopes, followed) = (beside("validation.csv")?, beside("slopes.csv")?, beside("followed.csv")?);
    let rows = fitted.rows() + [&validation, &followed].into_iter().flatten().map(Table::rows).sum::<usize>();
    Ok((rows == plan.conditions.len()).then_some(DesignTables { fitted, validation, slopes, followed }))
}
