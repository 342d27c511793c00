//! `figure = "model"`: the machine in three dimensions, coloured by temperature, as a binary glTF file for viewers.

use std::path::Path;

use super::super::gallery::Gallery;
use super::Head;
use super::results::Results;
use super::state::{SolvedState, StateKeys};
use crate::scene::Glb;
use coldplate_base::document::Section;
use coldplate_base::error::Result;

/// Keys: those of its state.
#[derive(Debug, Clone)]
pub(super) struct ModelChart {
    state: StateKeys,
}

impl ModelChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        for key in ["title", "width", "notes"] {
            if let Some(value) = root.opt(key) {
                return Err(value.error(format!("a model has no {key}")).help("leave it out: a viewer shows the machine alone"));
            }
        }
        Ok(Self { state: StateKeys::read(root, folder)? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let SolvedState { study, condition, state, .. } = self.state.open(head, results)?;
        let glb = Glb::new(&study.model, &condition, &state).map_err(|e| head.place(e, "machine"))?;
        gallery.add_file(&head.name, "glb", &glb.bytes)
    }
}
