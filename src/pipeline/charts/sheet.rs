//! `figure = "operator_sheet"`: one page for the wall.

use std::path::Path;

use super::super::figures;
use super::super::gallery::Gallery;
use super::Head;
use super::results::Results;
use super::source::Source;
use crate::error::Result;
use crate::foundation::document::Section;

/// No keys but those of its source.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    source: Source,
}

impl Sheet {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        Ok(Self { source: Source::read(root, folder)? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let opened = self.source.open(results)?;
        let surrogate = opened.surrogate()?;
        let machine = head.title(opened.machine(&surrogate));
        let sheet = figures::operator_sheet(&surrogate, &machine, &figures::provenance(&surrogate))?;
        head.add(gallery, &sheet)
    }
}
