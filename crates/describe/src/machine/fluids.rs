//! Liquids of the machine file and of the library.

use std::sync::{Arc, OnceLock};

use super::library::property;
use super::parts::Property;
use coldplate_base::document::{Document, Section, Value, suggestion};
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;
use coldplate_physics::liquid::{CurvePoint, FluidTable, Liquid, PropertyCurve};

/// The library of liquids that every machine file may name, with sources.
const LIBRARY: &str = include_str!("../../data/fluids.toml");

/// Every liquid beside water that a circuit may name; the file's own come first.
pub(super) struct Fluids(Vec<Arc<FluidTable>>);

/// Densities of coolants, kg/m³. Chosen, with the ranges below, to catch a wrong unit: from hot gases under vacuum to mercury.
const DENSITIES: (f64, f64) = (1e-3, 2e4);
/// Specific heats, J/(kg K): from metals to hydrogen.
const SPECIFIC_HEATS: (f64, f64) = (50.0, 2e4);
/// Viscosities, Pa s: from cold gases to resins.
const VISCOSITIES: (f64, f64) = (1e-7, 1e3);
/// Conductivities, W/(m K): from heavy gases to liquid metals.
const CONDUCTIVITIES: (f64, f64) = (1e-3, 1e3);

impl Fluids {
    /// Reads `[fluid.NAME]` and the library.
    pub fn read(root: &Section<'_>) -> Result<Self> {
        let mut found = Vec::new();
        for (name, section) in root.sections("fluid")? {
            found.push(Arc::new(fluid(name, section)?));
        }
        found.extend(built_in()?.iter().map(|shipped| shipped.fluid.clone()));
        Ok(Self(found))
    }

    /// The liquid that a value names.
    pub fn find(&self, value: &Value<'_>) -> Result<Liquid> {
        let name = value.text()?;
        match name.as_str() {
            "water" => return Ok(Liquid::Water),
            "paper_water" => return Ok(Liquid::PaperWater),
            _ => {}
        }
        let Some(found) = self.0.iter().find(|fluid| fluid.name == name) else {
            let known: Vec<&str> = ["water", "paper_water"].into_iter().chain(self.0.iter().map(|f| f.name.as_str())).collect();
            let help = format!("{}; or define it with [fluid.{name:?}]", suggestion(&name, &known));
            return Err(value.error(format!("there is no liquid '{name}'")).help(help));
        };
        Ok(Liquid::Table(found.clone()))
    }
}

/// A liquid of the library.
pub(super) struct Shipped {
    /// Properties of the liquid.
    pub fluid: Arc<FluidTable>,
    /// Source of the properties.
    pub source: String,
}

/// The liquids beside water that every machine file may name. They are read once: a diagnosis reads very many machines.
///
/// # Errors
/// None for the library that is shipped.
pub(super) fn built_in() -> Result<&'static [Shipped]> {
    static SHIPPED: OnceLock<Vec<Shipped>> = OnceLock::new();
    if let Some(known) = SHIPPED.get() {
        return Ok(known);
    }
    let document = Document::parse(LIBRARY, "the built-in fluids")?;
    let root = document.root();
    let one = |(name, section): (String, Section<'_>)| {
        let source = section.opt_text("source")?.unwrap_or_default();
        Ok(Shipped { fluid: Arc::new(fluid(name, section)?), source })
    };
    let found = root.sections("fluid")?.into_iter().map(one).collect::<Result<_>>()?;
    root.finish()?;
    Ok(SHIPPED.get_or_init(|| found))
}

fn fluid(name: String, section: Section<'_>) -> Result<FluidTable> {
    if matches!(name.as_str(), "water" | "paper_water") {
        return Err(section.error(format!("'{name}' is there already")).help("give the fluid another name"));
    }
    let curve = |key: &str, dimension: Dimension| -> Result<PropertyCurve> {
        let value = section.value(key)?;
        Ok(match property(&value, dimension)? {
            Property::Constant(value) => PropertyCurve::Constant(value),
            Property::Table(points) if points.len() < 2 => {
                return Err(value.error("a table has two points or more").help("or write the value itself, without brackets"));
            }
            Property::Table(points) => {
                PropertyCurve::Points(points.into_iter().map(|(temperature, value)| CurvePoint { temperature, value }).collect())
            }
        })
    };
    let found = FluidTable {
        density: curve("density", Dimension::DENSITY)?,
        specific_heat: curve("specific_heat", Dimension::SPECIFIC_HEAT)?,
        viscosity: curve("viscosity", Dimension::VISCOSITY)?,
        conductivity: curve("conductivity", Dimension::CONDUCTIVITY)?,
        name,
    };
    for (key, curve, (least, most), example) in [
        ("density", &found.density, DENSITIES, "water has 998 kg/m3"),
        ("specific_heat", &found.specific_heat, SPECIFIC_HEATS, "water has 4184 J/(kg K)"),
        ("viscosity", &found.viscosity, VISCOSITIES, "water has 1e-3 Pa s"),
        ("conductivity", &found.conductivity, CONDUCTIVITIES, "water has 0.6 W/(m K)"),
    ] {
        let is_odd = |value: f64| !(least..=most).contains(&value);
        let odd = match curve {
            PropertyCurve::Constant(value) => is_odd(*value),
            PropertyCurve::Points(points) => points.iter().any(|point| is_odd(point.value)),
        };
        if odd {
            return Err(section.error_at(key, format!("no coolant has this {}", key.replace('_', " "))).help(example));
        }
    }
    let (low, high) = found.range();
    if low >= high {
        return Err(section.error("the tables of this fluid share no temperatures").help("let all of them reach over the same range"));
    }
    section.opt_text("source")?;
    section.finish()?;
    Ok(found)
}
