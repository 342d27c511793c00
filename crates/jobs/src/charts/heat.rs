//! `figure = "heat"`: the heat balance, as bars.

use std::path::Path;

use super::super::gallery::Gallery;
use super::super::measured;
use super::Head;
use super::results::Results;
use super::state::StateKeys;
use coldplate_base::document::Section;
use coldplate_base::error::Result;

/// Keys: those of its state.
#[derive(Debug, Clone)]
pub(super) struct HeatChart {
    state: StateKeys,
}

impl HeatChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        Ok(Self { state: StateKeys::read(root, folder)? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let solved = self.state.open(head, results)?;
        let title = head.title(format!("{}: where the heat goes", solved.study.model.machine.name));
        let mut figure = measured::heat(&solved.study.model, &solved.state, title, solved.fixed);
        figure.notes = head.notes(figure.notes);
        head.add(gallery, &figure)
    }
}
