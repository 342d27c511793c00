//! `figure = "slices"`: the surrogate along one variable.

use std::path::Path;

use super::super::figures;
use super::super::gallery::Gallery;
use super::results::Results;
use super::source::{SurrogateSource, held, variable};
use super::{Head, chosen};
use coldplate_base::document::Section;
use coldplate_base::error::Result;

/// Keys: `variable`; optional `hold` and `points`.
#[derive(Debug, Clone)]
pub(super) struct SlicesChart {
    source: SurrogateSource,
}

impl SlicesChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        let source = SurrogateSource::read(root, folder)?;
        root.text("variable")?;
        root.opt_section("hold")?;
        root.opt_texts("points")?;
        Ok(Self { source })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let opened = self.source.open(results)?;
        let surrogate = opened.surrogate()?;
        let root = head.root();
        let along = variable(&root, "variable", &surrogate)?;
        let middle = figures::centre(&surrogate);
        let x: Vec<f64> = held(&root, "hold", &surrogate)?.into_iter().zip(middle).map(|(x, middle)| x.unwrap_or(middle)).collect();
        let names: Vec<&str> = surrogate.points().map(|p| p.name).collect();
        let points = chosen(&root, "points", &names)?;
        let drawn = figures::slices(&surrogate, along, &x, &points)?;
        head.add_curves(gallery, drawn)
    }
}
