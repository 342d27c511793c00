//! Values and mesh of a machine file, as command-line options.

use super::condition::pair_of;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_jobs::{FileKind, OpenFile};
use coldplate_solve::meshed::{ChosenCells, MeshedMachine};

/// Changed values, and the number of cells or the error that the cells may leave.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct MeshArgs {
    /// Change a value of the machine file, for example contact.motor.conductance="560 W/(m2 K)"
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// About how many cells (default: the machine file's own)
    #[arg(long, value_name = "N")]
    pub cells: Option<usize>,
    /// Choose cells for an error below this in every reading, instead of --cells
    #[arg(id = "mesh_accuracy", long = "accuracy", value_name = "KELVIN", allow_hyphen_values = true, conflicts_with = "cells")]
    accuracy: Option<String>,
}

impl MeshArgs {
    /// Changed keys and their values, with the accuracy among them, which is a key of the machine file.
    ///
    /// # Errors
    /// A pair without `=`.
    pub fn sets(&self) -> Result<Vec<(String, String)>> {
        let accuracy = self.accuracy.iter().map(|text| Ok(("mesh.accuracy".to_string(), text.clone())));
        self.set.iter().map(|s| pair_of(s, "--set")).chain(accuracy).collect()
    }

    /// Refuses options of a machine file (these, and `more` by name and whether given) for a file that has its machine built in.
    ///
    /// # Errors
    /// One of the options is given.
    pub fn refuse(&self, file: &OpenFile, more: &[(&str, bool)]) -> Result<()> {
        let own = [("--set", !self.set.is_empty()), ("--cells", self.cells.is_some()), ("--accuracy", self.accuracy.is_some())];
        let Some((option, _)) = own.iter().chain(more).find(|(_, is_given)| *is_given) else { return Ok(()) };
        let refused = |what: &str| Error::input(what).at_key(*option).in_file(&file.path);
        Err(match file.kind {
            FileKind::Surrogate => refused("a surrogate has its machine built in"),
            _ => refused("a reduced model has its machine and its mesh built in")
                .help("take the machine file itself, or make another model with `coldplate reduce`"),
        })
    }
}

/// One line for each part whose cell counts the file fixes and which leaves more than a tenth of the accuracy open.
pub fn stated_cells<'a>(model: &'a MeshedMachine, chosen: &'a ChosenCells) -> impl Iterator<Item = String> + 'a {
    let much = chosen.stated.iter().filter(|(_, open)| *open > 0.1 * chosen.accuracy);
    much.map(|(part, open)| {
        let name = &model.machine.parts[*part].name;
        format!("the cells that the file states for '{name}' were kept; they leave {} K open, which is not counted", significant(*open, 2))
    })
}
