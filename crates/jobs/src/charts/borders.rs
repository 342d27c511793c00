//! `figure = "borders"`: borders of the acceptable conditions by several surrogates of one machine, over two variables.

use std::path::Path;

use super::super::figures;
use super::super::gallery::Gallery;
use super::Head;
use super::results::Results;
use super::source::{Opened, SurrogateSource, held, variable};
use coldplate_base::document::Section;
use coldplate_base::error::{Error, Result};
use coldplate_figures::chart::borders::BordersFigure;

/// Keys: `surrogates` (a table of names, as the legend has them, and surrogate or sweep files), `across`, `up`; optional `hold`
/// (others stand at the middle of the first one's range).
#[derive(Debug, Clone)]
pub(super) struct BordersChart {
    models: Vec<(String, SurrogateSource)>,
}

impl BordersChart {
    pub(super) fn read(root: &Section<'_>, folder: &Path) -> Result<Self> {
        let section = root.section("surrogates")?;
        let models = section.keys().map(|name| Ok((name.to_owned(), SurrogateSource::at(folder.join(section.text(name)?)))));
        let models = models.collect::<Result<Vec<_>>>()?;
        if models.is_empty() {
            return Err(root
                .error_at("surrogates", "no surrogate is named")
                .help("surrogates = { described = \"a.cps\", identified = \"b.cps\" }"));
        }
        for key in ["across", "up"] {
            root.text(key)?;
        }
        root.opt_section("hold")?;
        Ok(Self { models })
    }

    pub(super) fn draw(&self, head: &Head, results: &mut Results<'_>, gallery: &mut Gallery) -> Result<()> {
        let sources = self.models.iter().map(|(_, source)| source.open(results)).collect::<Result<Vec<_>>>()?;
        let opened = sources.iter().map(Opened::surrogate).collect::<Result<Vec<_>>>()?;
        let root = head.root();
        let Some(first) = opened.first() else { return Err(Error::input("no surrogate is named").at_key("surrogates")) };
        let (across, up) = (variable(&root, "across", first)?, variable(&root, "up", first)?);
        let middle = figures::centre(first);
        let x: Vec<f64> = held(&root, "hold", first)?.into_iter().zip(middle).map(|(x, middle)| x.unwrap_or(middle)).collect();
        let mut whole = BordersFigure::default();
        for (surrogate, (name, _)) in opened.iter().zip(&self.models) {
            let same = first.variables().map(|v| v.name).eq(surrogate.variables().map(|v| v.name));
            if !same {
                return Err(Error::input(format!("'{name}' has other variables than the first")).at_key("surrogates"));
            }
            let map =
                figures::map(surrogate, across, up, &x, None, figures::ContourQuantity::Margin).map_err(|e| head.place(e, "across"))?;
            whole.add(name, map);
        }
        whole.title = head.title("Which conditions are acceptable, model by model");
        whole.notes = head.notes(Vec::new());
        head.add(gallery, &whole)
    }
}
