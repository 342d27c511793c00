//! Liquids of a circuit: water, a liquid of constant properties, or one known by tables against temperature.

use std::sync::Arc;

use super::water::{self, LiquidProperties, water};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::ZERO_CELSIUS;

/// A coolant.
#[derive(Debug, Clone, PartialEq)]
pub enum Liquid {
    /// Water: [`water()`].
    Water,
    /// Water with the round numbers of the source paper, density 1000 kg/m³ and specific heat 4200 J/(kg K), which make
    /// rho cp 0.8 % too large at 26 degC; other properties are those of [`Liquid::Water`].
    PaperWater,
    /// Constant properties at all temperatures.
    Constant {
        /// Density, kg/m³.
        density: f64,
        /// Specific heat, J/(kg K).
        specific_heat: f64,
        /// Dynamic viscosity, Pa s.
        viscosity: f64,
        /// Conductivity, W/(m K).
        conductivity: f64,
    },
    /// Properties by tables: oils, mixtures of water and glycol.
    Table(Arc<FluidTable>),
}

/// A liquid known by tables. Density, specific heat and conductivity are linear between the points. The logarithm of
/// the viscosity is linear in 1/T (Andrade), which follows the tenfold changes of cold oils.
#[derive(Debug, Clone, PartialEq)]
pub struct FluidTable {
    /// Name.
    pub name: String,
    /// Density, kg/m³.
    pub density: PropertyCurve,
    /// Specific heat, J/(kg K).
    pub specific_heat: PropertyCurve,
    /// Dynamic viscosity, Pa s.
    pub viscosity: PropertyCurve,
    /// Conductivity, W/(m K).
    pub conductivity: PropertyCurve,
}

/// A property as a function of temperature.
#[derive(Debug, Clone, PartialEq)]
pub enum PropertyCurve {
    /// One value at all temperatures.
    Constant(f64),
    /// Points of temperature (K), ascending strictly, and value; two or more.
    Points(Vec<CurvePoint>),
}

/// A point of a [`PropertyCurve`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Temperature, K.
    pub temperature: f64,
    /// Value, SI, larger than zero.
    pub value: f64,
}

/// Gauss's rule of three points: places in half lengths from the middle, and weights; dimensionless.
const GAUSS: [(f64, f64); 3] = [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

impl PropertyCurve {
    /// Temperatures (K) of the points.
    fn places(&self) -> Vec<f64> {
        match self {
            Self::Constant(_) => Vec::new(),
            Self::Points(points) => points.iter().map(|p| p.temperature).collect(),
        }
    }

    /// Range of temperatures (K) of the curve.
    fn range(&self) -> (f64, f64) {
        match self {
            Self::Constant(_) => (0.0, f64::INFINITY),
            Self::Points(points) => (points.first().map_or(f64::NAN, |p| p.temperature), points.last().map_or(f64::NAN, |p| p.temperature)),
        }
    }

    /// Interpolates `value` between the two points around a temperature (K) inside the range, linearly along `scale`.
    fn between(&self, temperature: f64, scale: impl Fn(f64) -> f64, value: impl Fn(f64) -> f64) -> f64 {
        match self {
            Self::Constant(constant) => value(*constant),
            Self::Points(points) => {
                let above = points.partition_point(|p| p.temperature <= temperature).clamp(1, points.len() - 1);
                let (a, b) = (points[above - 1], points[above]);
                let share = (scale(temperature) - scale(a.temperature)) / (scale(b.temperature) - scale(a.temperature));
                value(a.value) + share * (value(b.value) - value(a.value))
            }
        }
    }

    fn straight(&self, temperature: f64) -> f64 {
        self.between(temperature, |t| t, |v| v)
    }

    fn andrade(&self, temperature: f64) -> f64 {
        if let Self::Constant(value) = self { *value } else { self.between(temperature, f64::recip, f64::ln).exp() }
    }
}

impl FluidTable {
    /// Range of temperatures (K) at which every property is known.
    pub fn range(&self) -> (f64, f64) {
        let curves = [&self.density, &self.specific_heat, &self.viscosity, &self.conductivity];
        curves.iter().map(|curve| curve.range()).fold((0.0, f64::INFINITY), |all: (f64, f64), one| (all.0.max(one.0), all.1.min(one.1)))
    }

    /// Properties at `temperature` (K).
    ///
    /// # Errors
    /// Some property is not known at this temperature.
    pub fn at(&self, temperature: f64) -> Result<LiquidProperties> {
        let (low, high) = self.range();
        if !(low..=high).contains(&temperature) {
            return Err(Error::input(format!("the temperature leaves the tables of the fluid '{}'", self.name))
                .read(format_args!("{:.2} degC", temperature - ZERO_CELSIUS))
                .help(format!(
                    "stay between {:.1} and {:.1} degC, or give the fluid longer tables",
                    low - ZERO_CELSIUS,
                    high - ZERO_CELSIUS
                )));
        }
        Ok(LiquidProperties {
            density: self.density.straight(temperature),
            specific_heat: self.specific_heat.straight(temperature),
            viscosity: self.viscosity.andrade(temperature),
            conductivity: self.conductivity.straight(temperature),
        })
    }
}

impl Liquid {
    /// Properties at `temperature` (K).
    ///
    /// # Errors
    /// The temperature lies outside [`Liquid::range`].
    pub fn at(&self, temperature: f64) -> Result<LiquidProperties> {
        match self {
            Self::Water => water(temperature),
            Self::PaperWater => Ok(LiquidProperties { density: 1000.0, specific_heat: water::PAPER_SPECIFIC_HEAT, ..water(temperature)? }),
            &Self::Constant { density, specific_heat, viscosity, conductivity } => {
                Ok(LiquidProperties { density, specific_heat, viscosity, conductivity })
            }
            Self::Table(table) => table.at(temperature),
        }
    }

    /// Mean specific heat (J/(kg K)) between two temperatures (K): the difference of their enthalpies over the difference of the
    /// temperatures, in the limit the specific heat itself. Beyond [`Liquid::range`] the specific heat keeps its value at the end.
    ///
    /// The specific heat is a polynomial between the ends of its fits, or straight between the points of its table. Three points of
    /// Gauss integrate polynomials of degree five without error, and no enthalpies cancel.
    pub fn mean_specific_heat(&self, one: f64, other: f64) -> f64 {
        let ends: Vec<f64> = match self {
            Self::PaperWater => return water::PAPER_SPECIFIC_HEAT,
            Self::Constant { specific_heat, .. } => return *specific_heat,
            Self::Water => water::joins().to_vec(),
            Self::Table(table) => table.specific_heat.places(),
        };
        let (low, high) = self.range();
        let at = |t: f64| match self {
            Self::Table(table) => table.specific_heat.straight(t.clamp(low, high)),
            _ => water::specific_heat(t.clamp(low, high)),
        };
        let (from, to) = (one.min(other), one.max(other));
        if to <= from {
            return at(from);
        }
        let mut cuts: Vec<f64> = ends.into_iter().chain([low, high]).filter(|t| *t > from && *t < to).collect();
        cuts.extend([from, to]);
        cuts.sort_by(f64::total_cmp);
        let integral = |piece: &[f64]| {
            let (middle, half) = (f64::midpoint(piece[0], piece[1]), 0.5 * (piece[1] - piece[0]));
            half * GAUSS.iter().map(|(place, weight)| weight * at(middle + place * half)).sum::<f64>()
        };
        cuts.windows(2).map(integral).sum::<f64>() / (to - from)
    }

    /// Range of temperatures (K) at which the properties are known.
    pub fn range(&self) -> (f64, f64) {
        match self {
            Self::Water | Self::PaperWater => water::range(),
            Self::Constant { .. } => (0.0, f64::INFINITY),
            Self::Table(table) => table.range(),
        }
    }

    /// Temperature (K) at which the liquid boils under `pressure` (Pa); known for water only.
    pub fn boils_at(&self, pressure: f64) -> Option<f64> {
        matches!(self, Self::Water | Self::PaperWater).then(|| water::saturation_temperature(pressure)).flatten()
    }

    /// Doubt about the properties at `temperature` (K), if there is one.
    pub fn note(&self, temperature: f64) -> Option<String> {
        let (low, high) = self.range();
        (!(low..=high).contains(&temperature)).then(|| {
            format!("the properties of the liquid are not known outside {:.1}..{:.1} degC", low - ZERO_CELSIUS, high - ZERO_CELSIUS)
        })
    }
}
