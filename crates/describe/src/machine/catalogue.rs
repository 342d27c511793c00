//! Materials and liquids that every machine file may name without defining them.

use serde::Serialize;

use super::fluids;
use super::library;
use super::parts::{Material, Property};
use coldplate_base::error::Result;
use coldplate_base::units::{ZERO_CELSIUS, celsius};
use coldplate_physics::liquid::Liquid;

/// Temperature at which properties are shown, K: 20 degC. Chosen: the reference temperature of ISO 1.
const SHOWN_AT: f64 = 20.0 + ZERO_CELSIUS;

/// A property of a material or liquid.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct PropertyRecord {
    /// SI unit.
    pub unit: &'static str,
    /// Value at 20 degC.
    pub value: f64,
    /// Range of the table, degC, beyond which the property is constant; `None` for a single number.
    pub range_degC: Option<[f64; 2]>,
    /// The table: temperature in degC and value.
    pub table: Vec<[f64; 2]>,
}

impl PropertyRecord {
    fn new(property: &Property, unit: &'static str) -> Self {
        let table: Vec<[f64; 2]> = match property {
            Property::Constant(_) => Vec::new(),
            Property::Table(points) => points.iter().map(|(t, value)| [celsius(*t), *value]).collect(),
        };
        let range = table.first().zip(table.last()).map(|(first, last)| [first[0], last[0]]);
        Self { unit, value: property.at(SHOWN_AT), range_degC: range, table }
    }
}

/// A built-in material.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
#[allow(non_snake_case)]
pub struct MaterialRecord {
    /// Name by which a part refers to the material.
    pub name: String,
    /// Conductivity, equal in all directions.
    pub conductivity: PropertyRecord,
    /// Density.
    pub density: PropertyRecord,
    /// Specific heat.
    pub specific_heat: PropertyRecord,
    /// Coefficient of linear thermal expansion, 1/K.
    pub expansion_1_K: Option<f64>,
    /// Young's modulus, GPa.
    pub youngs_modulus_GPa: Option<f64>,
    /// Poisson's ratio.
    pub poisson_ratio: Option<f64>,
    /// Source of the numbers.
    pub source: String,
}

/// A built-in liquid.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
#[allow(non_snake_case)]
pub struct LiquidRecord {
    /// Name by which a circuit refers to the liquid.
    pub name: String,
    /// Range of temperatures of the properties, degC.
    pub range_degC: [f64; 2],
    /// Density at 20 degC, kg/m3.
    pub density_kg_m3: f64,
    /// Specific heat at 20 degC, J/(kg K).
    pub specific_heat_J_kgK: f64,
    /// Dynamic viscosity at 20 degC, Pa s.
    pub viscosity_Pa_s: f64,
    /// Conductivity at 20 degC, W/(m K).
    pub conductivity_W_mK: f64,
    /// Source of the numbers.
    pub source: String,
}

/// All built-in materials and liquids: each field is a key of `coldplate materials --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Catalogue {
    /// Materials of parts.
    pub materials: Vec<MaterialRecord>,
    /// Liquids of circuits.
    pub liquids: Vec<LiquidRecord>,
}

impl Catalogue {
    /// All built-in materials and liquids.
    ///
    /// # Errors
    /// None for the library that is shipped.
    pub fn built_in() -> Result<Self> {
        let materials = library::built_in()?.iter().map(material).collect();
        let liquids = liquids()?;
        Ok(Self { materials, liquids })
    }

    /// The entries with `text` in their name or source, in either case of letters.
    #[must_use]
    pub fn search(mut self, text: &str) -> Self {
        let wanted = text.to_lowercase();
        let is_like = |name: &str, source: &str| name.to_lowercase().contains(&wanted) || source.to_lowercase().contains(&wanted);
        self.materials.retain(|m| is_like(&m.name, &m.source));
        self.liquids.retain(|l| is_like(&l.name, &l.source));
        self
    }
}

fn material(material: &Material) -> MaterialRecord {
    MaterialRecord {
        name: material.name.clone(),
        conductivity: PropertyRecord::new(&material.conductivity[0], "W/(m K)"),
        density: PropertyRecord::new(&Property::Constant(material.density), "kg/m3"),
        specific_heat: PropertyRecord::new(&material.specific_heat, "J/(kg K)"),
        expansion_1_K: material.elastic.expansion,
        youngs_modulus_GPa: material.elastic.modulus.map(|pascals| pascals / 1e9),
        poisson_ratio: material.elastic.poisson,
        source: material.source.clone(),
    }
}

fn liquids() -> Result<Vec<LiquidRecord>> {
    let iapws = "IAPWS-95 with the IAPWS formulations for viscosity (2008) and conductivity (2011)";
    let water = [
        ("water".to_string(), Liquid::Water, iapws.to_string()),
        ("paper_water".to_string(), Liquid::PaperWater, format!("1000 kg/m3 and 4200 J/(kg K) as in the source study, else {iapws}")),
    ];
    let tables = fluids::built_in()?.iter().map(|s| (s.fluid.name.clone(), Liquid::Table(s.fluid.clone()), s.source.clone()));
    let of = |(name, liquid, source): (String, Liquid, String)| -> Result<LiquidRecord> {
        let (low, high) = liquid.range();
        let at = liquid.at(SHOWN_AT)?;
        Ok(LiquidRecord {
            name,
            range_degC: [celsius(low), celsius(high)],
            density_kg_m3: at.density,
            specific_heat_J_kgK: at.specific_heat,
            viscosity_Pa_s: at.viscosity,
            conductivity_W_mK: at.conductivity,
            source,
        })
    };
    water.into_iter().chain(tables).map(of).collect()
}
