//! Fineness of the mesh, as command-line options.

use super::condition::pair_of;
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_solve::meshed::{ChosenCells, MeshedMachine};

/// Number of cells, or the error that the cells may leave.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct CellsArgs {
    /// About how many cells (default: the machine file's own)
    #[arg(long, value_name = "N")]
    pub cells: Option<usize>,
    /// Instead of --cells: choose cells for an error below this in every reading
    #[arg(id = "mesh_accuracy", long = "accuracy", value_name = "KELVIN", allow_hyphen_values = true, conflicts_with = "cells")]
    pub accuracy: Option<String>,
}

impl CellsArgs {
    /// `--set` pairs with the accuracy among them, which is a key of the machine file.
    ///
    /// # Errors
    /// A pair without `=`.
    pub fn with(&self, sets: &[String]) -> Result<Vec<(String, String)>> {
        let accuracy = self.accuracy.iter().map(|text| Ok(("mesh.accuracy".to_string(), text.clone())));
        sets.iter().map(|s| pair_of(s, "--set")).chain(accuracy).collect()
    }

    /// Name of the given option, and whether one is given.
    pub fn given(&self) -> (&'static str, bool) {
        (if self.accuracy.is_some() { "--accuracy" } else { "--cells" }, self.cells.is_some() || self.accuracy.is_some())
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
