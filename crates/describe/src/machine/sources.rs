//! Heat sources: heated places, power, and distribution of the power in space.

use super::names::{Index, lookup};
use super::parts::{HeatedPlace, Part, Place};
use super::shape::volume;
use super::source_law::SourceLaw;
use super::symbols::Symbols;
use super::variables::formula;
use coldplate_base::document::{Section, Value};
use coldplate_base::error::{Result, all};
use coldplate_base::formula::{Formula, FormulaNames};
use coldplate_base::units::Dimension;

/// Names of the coordinates in a distribution.
const COORDINATES: [&str; 3] = ["x_mm", "y_mm", "z_mm"];

/// A heat source.
#[derive(Debug, Clone)]
pub struct Source {
    /// Name.
    pub name: String,
    /// Heated places: the power is spread over the volume of a part or the area of a face, or put into a node.
    pub places: Vec<HeatedPlace>,
    /// Total power, W, shared among the places by volume or area; or the power per volume, W/m³.
    pub power: Formula,
    /// Volume of all places, m³, for a power given per volume.
    pub volume: Option<f64>,
    /// Relative power per volume or area at x, y, z (mm, in the coordinates of the part); `None` means even.
    pub distribution: Option<Formula>,
    /// The controller that gives a share of the power: index into the machine's.
    pub controller: Option<usize>,
    /// Dependence of the power of each piece on its own temperature.
    pub law: SourceLaw,
}

/// Reads `[source.NAME]`.
pub(super) fn sources(root: &Section<'_>, index: &Index<'_>, symbols: &Symbols) -> Result<Vec<Source>> {
    let controllers: Vec<String> = root.opt_section("controller")?.iter().flat_map(|table| table.keys()).map(str::to_string).collect();
    all(root.sections("source")?.into_iter().map(|(name, section)| source(name, section, index, &controllers, symbols)))
}

fn source(name: String, section: Section<'_>, index: &Index<'_>, controllers: &[String], symbols: &Symbols) -> Result<Source> {
    let value = section.value("in")?;
    let values = if value.is_text() { vec![value.clone()] } else { value.list()? };
    let mut places: Vec<HeatedPlace> = Vec::new();
    for value in &values {
        let heated = index.heated(value)?;
        if places.iter().any(|known| known.holds(heated) || heated.holds(*known)) {
            return Err(value.error("this place is named twice").help("name it once; the power is shared by volume or area"));
        }
        places.push(heated);
    }
    if places.is_empty() {
        return Err(value.error("the source heats nothing").help("write in = [\"motor\"]"));
    }
    let (power, volume) = match section.one_of(&["power", "power_density"])? {
        Some("power_density") => {
            let volume = places.iter().map(|heated| volume_of(&section, *heated, index.parts)).sum::<Result<f64>>()?;
            (formula(&section.value("power_density")?, Dimension::POWER_DENSITY, symbols)?, Some(volume))
        }
        Some(key) => (formula(&section.value(key)?, Dimension::POWER, symbols)?, None),
        None => {
            return Err(section
                .error("the source states no heat")
                .help("give power = \"40 W\", or power_density = \"2e5 W/m3\"; both may be formulas"));
        }
    };
    let distribution = section.opt("distribution").map(|value| distribution(&value, &places, volume.is_some())).transpose()?;
    let controller = section.opt("controller").map(|value| lookup(&value, controllers, "controller")).transpose()?;
    let law = SourceLaw::read(&section)?;
    section.finish()?;
    Ok(Source { name, places, power, volume, distribution, controller, law })
}

/// A formula of the coordinates in a part, by which a total power is distributed.
fn distribution(value: &Value<'_>, places: &[HeatedPlace], is_density: bool) -> Result<Formula> {
    if is_density {
        return Err(value.error("a distribution shares a total").help("give power = \"...\" instead of power_density"));
    }
    if places.iter().any(|heated| matches!(heated.place, Place::Node(_))) {
        return Err(value.error("a lumped node has no places within it").help("take the node out of this source"));
    }
    let mut names = FormulaNames::default();
    for name in COORDINATES {
        names.add(name)?;
    }
    Formula::parse(&value.text()?, Dimension::NUMBER, None, &names, value.error("").location().clone()).map_err(|e| value.place(e))
}

/// Volume of a heated body, m³.
fn volume_of(section: &Section<'_>, heated: HeatedPlace, parts: &[Part]) -> Result<f64> {
    let Place::Part(part) = heated.place else {
        return Err(section
            .error_at("power_density", "faces and lumped nodes have no volume")
            .help("give power = \"...\" for these, or name parts and blocks alone"));
    };
    let part = &parts[part];
    Ok(match (&part.import, heated.block) {
        (Some(import), _) => (0..import.body.tetrahedra.len()).map(|t| import.body.volume(t)).sum(),
        (None, Some(block)) => volume(&part.blocks[block].shape),
        (None, None) => part.blocks.iter().map(|block| volume(&block.shape)).sum(),
    })
}
