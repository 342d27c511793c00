//! `figure = "one_factor"`: temperatures over one variable, with a polynomial fitted to each.

use std::path::{Path, PathBuf};

use super::super::designs::rows_of;
use super::super::figures;
use super::super::gallery::Gallery;
use super::results::Results;
use super::{Head, chosen, path_of};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_tables::Table;

/// Keys: `sweep` with `group`, or `table` with `variable` and `degree`; optional `points`.
#[derive(Debug, Clone)]
pub(super) struct OneFactorChart {
    samples: SampleSource,
}

/// A table in which one variable runs.
#[derive(Debug, Clone)]
pub(super) enum SampleSource {
    /// A one-factor sweep of a sweep file.
    Sweep(PathBuf),
    /// A table, with the variable and the degree.
    Table { path: PathBuf, variable: String, degree: usize },
}

/// Samples with the variable that runs in them and the degree of its polynomial.
pub(super) struct OneFactorTable {
    pub(super) table: Table,
    pub(super) variable: String,
    pub(super) degree: usize,
}

impl SampleSource {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        match root.one_of(&["sweep", "table"])? {
            Some("sweep") => {
                root.text("group")?;
                Ok(Self::Sweep(path_of(root, folder, "sweep")?))
            }
            Some(_) => Ok(Self::Table {
                path: path_of(root, folder, "table")?,
                variable: root.text("variable")?,
                degree: root.opt_integer("degree", 0)?.unwrap_or(2),
            }),
            None => Err(root
                .error("the chart does not name its source of numbers")
                .help("add sweep = \"../sweeps/NAME.toml\" with group = \"...\", or table = \"FILE.csv\" with variable = \"...\"")),
        }
    }

    /// The rows, with the variable that runs and the degree of its polynomial.
    pub(super) fn open(&self, head: &Head, results: &mut Results<'_>) -> Result<OneFactorTable> {
        match self {
            Self::Sweep(path) => {
                let found = results.sweep(path)?;
                let groups: Vec<_> = found.plan.groups.iter().filter(|g| g.varied.len() == 1).collect();
                let names: Vec<&str> = groups.iter().map(|g| g.name.as_str()).collect();
                let group = groups[head.root().choice("group", &names)?];
                Ok(OneFactorTable {
                    table: rows_of(&found.table, &found.plan, |g| g.name == group.name),
                    variable: found.plan.variables[group.varied[0]].name.clone(),
                    degree: group.degree.unwrap_or(2),
                })
            }
            Self::Table { path, variable, degree } => {
                Ok(OneFactorTable { table: Table::read(path)?, variable: variable.clone(), degree: *degree })
            }
        }
    }
}

impl OneFactorChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        root.opt_texts("points")?;
        Ok(Self { samples: SampleSource::read(root, folder)? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let OneFactorTable { mut table, variable, degree } = self.samples.open(head, results)?;
        let names: Vec<&str> = table.outputs().iter().map(|c| c.name.as_str()).collect();
        let points = chosen(&head.root(), "points", &names)?;
        let kept = points.iter().map(|p| table.outputs()[*p].clone()).collect::<Vec<_>>();
        table.columns.truncate(table.inputs);
        table.columns.extend(kept);
        head.add_curves(gallery, figures::one_factor(&table, &variable, degree, "")?)
    }
}
