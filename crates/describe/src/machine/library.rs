//! Materials of the machine file and of the library.

use std::sync::OnceLock;

use super::keys::bodies::{EXPANSION, POISSON_RATIO, YOUNGS_MODULUS};
use super::parts::{Elastic, Material, Property};
use crate::schema::Key;
use coldplate_base::document::{Document, Section, Value, suggestion};
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

/// The library of materials that every machine file may name, with sources.
const LIBRARY: &str = include_str!("../../data/materials.toml");

/// Largest Poisson's ratio (dimensionless). Chosen: a material closer to 0.5 hardly changes its volume, and trilinear
/// cells become too stiff.
const LARGEST_POISSON_RATIO: f64 = 0.49;

/// The materials that every machine file may name. They are read once: a diagnosis reads very many machines.
///
/// # Errors
/// None for the library that is shipped.
pub(super) fn built_in() -> Result<&'static [Material]> {
    static SHIPPED: OnceLock<Vec<Material>> = OnceLock::new();
    if let Some(known) = SHIPPED.get() {
        return Ok(known);
    }
    let document = Document::parse(LIBRARY, "the built-in materials")?;
    let root = document.root();
    let found = root.sections("material")?.into_iter().map(|(name, section)| material(name, section, &[])).collect::<Result<_>>()?;
    root.finish()?;
    Ok(SHIPPED.get_or_init(|| found))
}

/// Every known material; [`Shelf::take`] collects the materials in use in the order of first use.
pub(super) struct Shelf {
    own: Vec<Material>,
    library: &'static [Material],
    /// The materials in use.
    pub(super) used: Vec<Material>,
}

impl Shelf {
    /// Reads `[material.NAME]` and the library.
    pub(super) fn read(root: &Section<'_>) -> Result<Self> {
        let library = built_in()?;
        let mut own: Vec<Material> = Vec::new();
        for (name, section) in root.sections("material")? {
            let known = [own.as_slice(), library].concat();
            own.push(material(name, section, &known)?);
        }
        Ok(Self { own, library, used: Vec::new() })
    }

    /// Index of the material that a value names, among the materials in use. The file's own come before the library's.
    pub(super) fn take(&mut self, value: &Value<'_>) -> Result<usize> {
        let name = value.text()?;
        if let Some(at) = self.used.iter().position(|m| m.name == name) {
            return Ok(at);
        }
        match self.own.iter().chain(self.library).find(|m| m.name == name) {
            Some(material) => {
                self.used.push(material.clone());
                Ok(self.used.len() - 1)
            }
            None => {
                let known: Vec<&str> = self.own.iter().chain(self.library).map(|m| m.name.as_str()).collect();
                let help = format!("{}; or define it with [material.{name:?}]", suggestion(&name, &known));
                Err(value.error(format!("there is no material '{name}'")).help(help))
            }
        }
    }
}

/// First words of the source of a material with a base.
const CHANGED: &str = "changed from ";

/// Reads one material; a key that is not given takes the value of the material named by `base`.
fn material(name: String, section: Section<'_>, known: &[Material]) -> Result<Material> {
    let base = match section.opt("base") {
        None => None,
        Some(value) => {
            let base = value.text()?;
            let unknown = || {
                let names: Vec<&str> = known.iter().map(|m| m.name.as_str()).collect();
                value.error(format!("there is no material '{base}' before this one")).help(suggestion(&base, &names))
            };
            Some(known.iter().find(|m| m.name == base).ok_or_else(unknown)?)
        }
    };
    // A key that is missing takes the base's value; without a base, reading it is the error.
    let wanted = |key: &str| base.is_none() || section.has(key);
    let conductivity = match base {
        Some(base) if !wanted("conductivity") => base.conductivity.clone(),
        _ => conductivity(&section.value("conductivity")?)?,
    };
    let density = match base {
        Some(base) if !wanted("density") => base.density,
        _ => section.positive("density", Dimension::DENSITY)?,
    };
    let specific_heat = match base {
        Some(base) if !wanted("specific_heat") => base.specific_heat.clone(),
        _ => property(&section.value("specific_heat")?, Dimension::SPECIFIC_HEAT)?,
    };
    let source = match (section.opt_text("source")?, base) {
        (Some(source), _) => source,
        (None, Some(base)) => {
            // The nearest of a chain of bases, and the source of the first.
            let first = base.source.strip_prefix(CHANGED).and_then(|rest| rest.split_once(": "));
            format!("{CHANGED}{}: {}", base.name, first.map_or(base.source.as_str(), |(_, source)| source))
        }
        (None, None) => String::new(),
    };
    let elastic = elastic(&section, base.map(|base| base.elastic).unwrap_or_default())?;
    section.finish()?;
    Ok(Material { name, conductivity, density, specific_heat, elastic, source })
}

/// Largest coefficient of linear thermal expansion, 1/K. Chosen: catches a wrong unit and allows every solid.
const LARGEST_EXPANSION: f64 = 1e-2;
/// Range of Young's modulus, Pa. Chosen: catches a wrong unit and allows every solid.
const MODULI: std::ops::RangeInclusive<f64> = 1e3..=1e13;

/// Expansion and stiffness; numbers that are not given come from the base.
fn elastic(section: &Section<'_>, base: Elastic) -> Result<Elastic> {
    let given = |key: &Key, base: Option<f64>| if section.has(key.name) { key.read(section).map(Some) } else { Ok(base) };
    let poisson = given(&POISSON_RATIO, base.poisson)?;
    if poisson.is_some_and(|nu| !(0.0..=LARGEST_POISSON_RATIO).contains(&nu)) {
        let what = format!("Poisson's ratio lies between 0 and {LARGEST_POISSON_RATIO}");
        return Err(section.error_at(POISSON_RATIO.name, what).help("metals have 0.25 to 0.35"));
    }
    let (expansion, modulus) = (given(&EXPANSION, base.expansion)?, given(&YOUNGS_MODULUS, base.modulus)?);
    if expansion.is_some_and(|alpha| alpha.abs() > LARGEST_EXPANSION) {
        return Err(section
            .error_at(EXPANSION.name, "a solid expands by less than a hundredth per kelvin")
            .help("metals have 1e-6 to 30e-6 1/K, polymers up to 300e-6 1/K"));
    }
    if modulus.is_some_and(|modulus| !MODULI.contains(&modulus)) {
        return Err(section
            .error_at(YOUNGS_MODULUS.name, "no solid is that soft or that stiff")
            .help("rubber has some MPa, steel 210 GPa, diamond 1200 GPa"));
    }
    Ok(Elastic { expansion, modulus, poisson })
}

/// One conductivity, or three along the axes.
fn conductivity(value: &Value<'_>) -> Result<[Property; 3]> {
    let entries = if value.is_list() { value.list()? } else { Vec::new() };
    let three_tables = entries.first().is_some_and(|first| first.list().is_ok_and(|pairs| pairs.first().is_some_and(Value::is_list)));
    if entries.iter().any(|entry| !entry.is_list()) || three_tables {
        let [x, y, z] = entries.as_slice() else {
            return Err(value
                .error("three conductivities are wanted here, along x, y, z (cylinders: r, theta, z)")
                .help("or one for all directions, or a table [[\"20 degC\", \"15 W/(m K)\"], ...]"));
        };
        let read = |entry: &Value<'_>| property(entry, Dimension::CONDUCTIVITY);
        return Ok([read(x)?, read(y)?, read(z)?]);
    }
    let same = property(value, Dimension::CONDUCTIVITY)?;
    Ok([same.clone(), same.clone(), same])
}

/// A positive property: a constant, or a table against temperature.
pub(super) fn property(value: &Value<'_>, dimension: Dimension) -> Result<Property> {
    if !value.is_list() {
        return Ok(Property::Constant(value.positive(dimension)?));
    }
    let table = value.curve(Dimension::TEMPERATURE, dimension)?;
    if table.iter().any(|(_, y)| *y <= 0.0) {
        return Err(value.error("every value in this table must be larger than zero"));
    }
    Ok(Property::Table(table))
}
