//! `figure = "acceptability"`: which conditions are acceptable, over two variables.

use std::path::Path;

use super::super::figures::{self, ContourQuantity};
use super::super::gallery::Gallery;
use super::Head;
use super::results::Results;
use super::source::{SurrogateSource, held, variable};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_figures::chart::acceptability::MarkedCondition;

/// Names of the quantities that contour lines may show.
const LINES: [&str; 2] = ["margin", "probability"];

/// Keys: `across`, `up`; optional `hold` (others stand at the middle of their range), `mark` (a condition, with its
/// `label`) and `lines` (`margin` or `probability`).
#[derive(Debug, Clone)]
pub(super) struct AcceptabilityChart {
    source: SurrogateSource,
    label: String,
    lines: ContourQuantity,
}

impl AcceptabilityChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        let source = SurrogateSource::read(root, folder)?;
        for key in ["across", "up"] {
            root.text(key)?;
        }
        root.opt_section("hold")?;
        root.opt_section("mark")?;
        let lines = if root.has("lines") {
            [ContourQuantity::Margin, ContourQuantity::Probability][root.choice("lines", &LINES)?]
        } else {
            ContourQuantity::Margin
        };
        Ok(Self { source, label: root.opt_text("label")?.unwrap_or_else(|| "marked condition".into()), lines })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let opened = self.source.open(results)?;
        let surrogate = opened.surrogate()?;
        let root = head.root();
        let (across, up) = (variable(&root, "across", &surrogate)?, variable(&root, "up", &surrogate)?);
        let middle = figures::centre(&surrogate);
        let x: Vec<f64> = held(&root, "hold", &surrogate)?.into_iter().zip(middle).map(|(x, middle)| x.unwrap_or(middle)).collect();
        let mark = held(&root, "mark", &surrogate)?;
        let here = mark[across].zip(mark[up]).map(|(x, y)| MarkedCondition { x, y, label: self.label.clone() });
        let mut map = figures::map(&surrogate, across, up, &x, here, self.lines).map_err(|e| head.place(e, "across"))?;
        map.title = head.title(map.title);
        map.notes = head.notes(map.notes);
        head.add(gallery, &map)
    }
}
