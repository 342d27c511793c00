//! The surrogate that a chart is drawn from: fitted to a sweep, or read from a file.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::super::figures::TableComparison;
use super::super::open::{FileKind, open};
use super::path_of;
use super::results::{Results, SweepResult};
use coldplate_base::document::Section;
use coldplate_base::error::{Error, Result};
use coldplate_surrogate::fit::{PointReport, file};
use coldplate_surrogate::verdict::{Surrogate, condition};
use coldplate_tables::Table;

/// Source of a surrogate.
#[derive(Debug, Clone)]
pub(crate) enum SurrogateSource {
    /// The designs of a sweep.
    Sweep(PathBuf),
    /// A surrogate file, and tables to compare it with.
    File {
        /// The surrogate.
        path: PathBuf,
        /// Conditions its fit has seen.
        table: Option<PathBuf>,
        /// Conditions held out of its fit.
        held_out: Option<PathBuf>,
    },
}

/// A surrogate's file and its comparison.
pub enum Opened {
    /// Fitted to a sweep.
    Sweep(Rc<SweepResult>),
    /// From a file.
    File {
        /// Bytes of the file.
        bytes: Vec<u8>,
        /// The tables beside it.
        comparison: TableComparison,
    },
}

impl SurrogateSource {
    /// Reads `sweep`, or `surrogate` with `table` and `held_out`.
    ///
    /// # Errors
    /// Neither or both are given.
    pub fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        match root.one_of(&["sweep", "surrogate"])? {
            Some("sweep") => Ok(Self::Sweep(path_of(root, folder, "sweep")?)),
            Some(_) => Ok(Self::File {
                path: path_of(root, folder, "surrogate")?,
                table: root.opt_text("table")?.map(|p| folder.join(p)),
                held_out: root.opt_text("held_out")?.map(|p| folder.join(p)),
            }),
            None => Err(root
                .error("the chart does not name its source of numbers")
                .help("add sweep = \"../sweeps/NAME.toml\" or surrogate = \"FILE.cps\"")),
        }
    }

    /// The source that a path names: a sweep file (`.toml`), or a surrogate file.
    pub fn at(path: PathBuf) -> Self {
        match FileKind::by_name(&path) {
            FileKind::Document => Self::Sweep(path),
            _ => Self::File { path, table: None, held_out: None },
        }
    }

    /// Opens the source; missing conditions are solved and fitted.
    ///
    /// # Errors
    /// Errors of [`Results::sweep`]; a file that cannot be read; a sweep without a design to fit.
    pub fn open(&self, results: &mut Results<'_>) -> Result<Opened> {
        match self {
            Self::Sweep(path) => {
                let found = results.sweep(path)?;
                if found.fitted.is_none() {
                    return Err(Error::input("this sweep varies one variable at a time only, so there is no surrogate of it")
                        .in_file(path)
                        .help("give it a [design], or draw figure = \"one_factor\""));
                }
                Ok(Opened::Sweep(found))
            }
            Self::File { path, table, held_out } => {
                let file = open(path).map_err(|e| e.help("`coldplate run SWEEP.toml` or `coldplate fit TABLE` writes a surrogate"))?;
                let mut comparison = TableComparison::default();
                {
                    let surrogate = file.surrogate()?;
                    for (table, unseen) in [(table, false), (held_out, true)] {
                        if let Some(table) = table {
                            comparison.add(&surrogate, &Table::read(table)?, unseen).map_err(|e| e.in_file(table))?;
                        }
                    }
                    comparison.values.resize(surrogate.point_count(), Vec::new());
                }
                Ok(Opened::File { bytes: file.bytes, comparison })
            }
        }
    }
}

impl Opened {
    /// The surrogate.
    ///
    /// # Errors
    /// The bytes are damaged.
    pub fn surrogate(&self) -> Result<Surrogate<'_>> {
        match self {
            Self::Sweep(found) => file::open(found.fitted.as_ref().map_or(&[][..], |f| &f.bytes)),
            Self::File { bytes, .. } => file::open(bytes),
        }
    }

    /// Comparison of the surrogate with tables.
    pub fn comparison(&self) -> TableComparison {
        match self {
            Self::Sweep(found) => found.fitted.as_ref().map(|f| f.comparison.clone()).unwrap_or_default(),
            Self::File { comparison, .. } => comparison.clone(),
        }
    }

    /// Reports of the fit, if it was made here.
    pub(crate) fn reports(&self) -> &[PointReport] {
        match self {
            Self::Sweep(found) => found.fitted.as_ref().map_or(&[], |f| &f.fit.points),
            Self::File { .. } => &[],
        }
    }

    /// Name of the machine.
    pub fn machine(&self, surrogate: &Surrogate<'_>) -> String {
        match self {
            Self::Sweep(found) => found.machine.clone(),
            Self::File { .. } => surrogate.provenance().find(|(k, _)| *k == "machine").map_or("machine", |(_, v)| v).to_string(),
        }
    }
}

/// The values under `[hold]`, `None` for variables it does not name.
///
/// # Errors
/// A name that is no variable of the surrogate, a value without its unit.
pub fn held(root: &Section<'_>, key: &str, surrogate: &Surrogate<'_>) -> Result<Vec<Option<f64>>> {
    let variables = condition::variables(surrogate);
    let mut x = vec![None; variables.len()];
    if let Some(hold) = root.opt_section(key)? {
        for name in hold.keys() {
            let value = hold.value(name)?;
            let index = condition::index_of(surrogate, name).map_err(|e| value.place(e))?;
            x[index] = Some(condition::value_of(&variables[index], &value.text()?).map_err(|e| value.place(e))?);
            condition::varied(surrogate, x.clone()).map_err(|e| value.place(e))?;
        }
    }
    condition::varied(surrogate, x)
}

/// The variable of the surrogate that `key` names.
///
/// # Errors
/// The key is missing or names no variable of the surrogate.
pub fn variable(root: &Section<'_>, key: &str, surrogate: &Surrogate<'_>) -> Result<usize> {
    let names: Vec<&str> = surrogate.variables().map(|v| v.name).collect();
    root.choice(key, &names)
}
