//! `figure = "parity"`, `"residuals"`, `"errors"`: how far a surrogate can be trusted.

use std::path::Path;

use super::super::gallery::Gallery;
use super::super::{TARGET, figures};
use super::results::Results;
use super::source::{Opened, SurrogateSource};
use super::{Head, chosen};
use coldplate_base::document::Section;
use coldplate_base::error::Result;

/// Predicted over simulated. Keys: `points` (default: the one with the largest error).
#[derive(Debug, Clone)]
pub(super) struct ParityChart {
    source: SurrogateSource,
}

/// Residuals over the prediction and every variable. Keys: those of [`Parity`].
#[derive(Debug, Clone)]
pub(super) struct ResidualsChart {
    source: SurrogateSource,
}

/// Errors of every point on one axis. No keys but those of its source.
#[derive(Debug, Clone)]
pub(super) struct ErrorsChart {
    source: SurrogateSource,
}

/// The points asked for, or the worst.
fn points(head: &Head, opened: &Opened) -> Result<Vec<usize>> {
    let surrogate = opened.surrogate()?;
    let root = head.root();
    let names: Vec<&str> = surrogate.points().map(|p| p.name).collect();
    if root.has("points") {
        return chosen(&root, "points", &names);
    }
    Ok(figures::worst_point(&surrogate, &opened.comparison()).into_iter().collect())
}

fn nothing(head: &Head) -> coldplate_base::error::Error {
    let what = "there is no condition to compare the surrogate with";
    head.root().error(what).help("name the tables with table = \"FILE.csv\" and held_out = \"FILE.csv\", or a sweep")
}

impl ParityChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        root.opt_texts("points")?;
        Ok(Self { source: SurrogateSource::read(root, folder)? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let opened = self.source.open(results)?;
        let (surrogate, comparison) = (opened.surrogate()?, opened.comparison());
        for point in points(head, &opened)? {
            let mut figure = figures::parity(&surrogate, &comparison, point).ok_or_else(|| nothing(head))?;
            figure.title = head.title(figure.title);
            head.add(gallery, &figure)?;
        }
        Ok(())
    }
}

impl ResidualsChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        root.opt_texts("points")?;
        Ok(Self { source: SurrogateSource::read(root, folder)? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let opened = self.source.open(results)?;
        let (surrogate, comparison) = (opened.surrogate()?, opened.comparison());
        for point in points(head, &opened)? {
            let mut figure = figures::residuals(&surrogate, &comparison, point).ok_or_else(|| nothing(head))?;
            figure.title = head.title(figure.title);
            figure.notes = head.notes(figure.notes);
            head.add(gallery, &figure)?;
        }
        Ok(())
    }
}

impl ErrorsChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        Ok(Self { source: SurrogateSource::read(root, folder)? })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let opened = self.source.open(results)?;
        let mut figure = figures::errors(&opened.surrogate()?, &opened.comparison(), opened.reports(), Some(TARGET));
        figure.title = head.title(figure.title);
        figure.notes = head.notes(figure.notes);
        head.add(gallery, &figure)
    }
}
