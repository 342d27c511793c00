//! `figure = "measured"`: a measured state of a machine file beside its prediction and a published one.

use std::path::{Path, PathBuf};

use super::super::gallery::Gallery;
use super::super::measured;
use super::results::Results;
use super::{Head, path_of};
use coldplate_base::document::Section;
use coldplate_base::error::Result;

/// Keys: `machine`, `measurement`.
#[derive(Debug, Clone)]
pub(super) struct MeasuredChart {
    machine: PathBuf,
}

impl MeasuredChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        root.text("measurement")?;
        Ok(Self { machine: path_of(root, folder, "machine")? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let study = results.machine(&self.machine)?;
        let model = &study.model;
        let names: Vec<&str> = model.machine.measurements.iter().map(|m| m.name.as_str()).collect();
        let measurement = &model.machine.measurements[head.root().choice("measurement", &names)?];
        let mut figure = measured::one(&study, measurement)?.figure;
        figure.title = head.title(figure.title);
        figure.notes = head.notes(figure.notes);
        head.add(gallery, &figure)
    }
}
