//! The known units, for lists of them.

use serde::Serialize;

use super::symbols::{MISTAKEN, UNITS};
use super::{Dimension, zero_of_scale};

/// A unit symbol.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
#[allow(non_snake_case)]
pub struct KnownUnit {
    /// The symbol as written in files.
    pub symbol: &'static str,
    /// Name of the measured quantity.
    pub dimension: &'static str,
    /// SI unit of the quantity.
    pub si: &'static str,
    /// Factor from this unit to SI.
    pub factor: f64,
    /// Zero of the scale, K, for a temperature scale that does not begin at absolute zero.
    pub zero_K: Option<f64>,
    /// Wrong symbols often written for this one, which are refused.
    pub not: Vec<&'static str>,
}

/// A quantity that files ask for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct KnownQuantity {
    /// Name of the quantity.
    pub name: &'static str,
    /// SI unit of the quantity.
    pub si: &'static str,
    /// Example values in the notation of the files.
    pub example: &'static str,
}

/// Quantities with their names and SI units.
const QUANTITIES: &[(Dimension, &str, &str)] = &[
    (Dimension::LENGTH, "length", "m"),
    (Dimension::AREA, "area", "m2"),
    (Dimension::VOLUME, "volume", "m3"),
    (Dimension::MASS, "mass", "kg"),
    (Dimension::TIME, "time", "s"),
    (Dimension::TEMPERATURE, "temperature", "K"),
    (Dimension::DIFFERENCE, "difference of temperatures", "K"),
    (Dimension::PER_KELVIN, "share per kelvin", "1/K"),
    (Dimension::NUMBER, "pure number, angle", "1"),
    (Dimension::VELOCITY, "velocity", "m/s"),
    (Dimension::ANGULAR_SPEED, "speed of rotation", "rad/s"),
    (Dimension::VOLUME_FLOW, "volume flow", "m3/s"),
    (Dimension::MASS_FLOW, "mass flow", "kg/s"),
    (Dimension::POWER, "power, heat", "W"),
    (Dimension::HEAT_FLUX, "heat flux", "W/m2"),
    (Dimension::POWER_DENSITY, "heat per volume", "W/m3"),
    (Dimension::CONDUCTIVITY, "conductivity", "W/(m K)"),
    (Dimension::FILM, "film coefficient, contact conductance", "W/(m2 K)"),
    (Dimension::CONDUCTANCE, "conductance of a whole joint", "W/K"),
    (Dimension::DENSITY, "density", "kg/m3"),
    (Dimension::SPECIFIC_HEAT, "specific heat", "J/(kg K)"),
    (Dimension::CAPACITY, "heat capacity", "J/K"),
    (Dimension::PRESSURE, "pressure", "Pa"),
    (Dimension::BEDDING, "stiffness per area", "N/m3"),
    (Dimension::FORCE, "force", "N"),
    (Dimension::TORQUE, "torque, energy", "N m"),
    (Dimension::INERTIA, "moment of inertia", "kg m2"),
    (Dimension::VISCOSITY, "dynamic viscosity", "Pa s"),
    (KINEMATIC_VISCOSITY, "kinematic viscosity", "m2/s"),
    (Dimension::CURRENT, "current", "A"),
    (Dimension::VOLTAGE, "voltage", "V"),
    (Dimension::RESISTANCE, "resistance", "Ohm"),
];

/// m²/s
const KINEMATIC_VISCOSITY: Dimension = Dimension::of(2, 0, -1, 0);

/// All symbols, sorted by quantity.
pub fn symbols() -> Vec<KnownUnit> {
    let rank = |d: Dimension| QUANTITIES.iter().position(|(known, ..)| *known == d).unwrap_or(QUANTITIES.len());
    let mut found: Vec<(usize, KnownUnit)> = (UNITS.iter())
        .map(|(symbol, factor, dimension)| {
            let zero = zero_of_scale(symbol);
            // A temperature symbol stands for a scale; K stands for differences too.
            let dimension = if zero.is_some() || *symbol == "degR" { Dimension::TEMPERATURE } else { *dimension };
            let rank = rank(dimension);
            let (name, si) = QUANTITIES.get(rank).map_or(("", ""), |(_, name, si)| (*name, *si));
            let name = if *symbol == "K" { "temperature, difference of temperatures" } else { name };
            let not = MISTAKEN.iter().filter(|(_, meant)| meant.split(" or ").any(|m| m == *symbol)).map(|(wrong, _)| *wrong).collect();
            (rank, KnownUnit { symbol, dimension: name, si, factor: *factor, zero_K: zero, not })
        })
        .collect();
    found.sort_by_key(|(rank, _)| *rank);
    found.into_iter().map(|(_, unit)| unit).collect()
}

/// SI unit of a dimension, in the notation of the files; `None` for a dimension that no file asks for.
pub fn si_unit(dimension: Dimension) -> Option<&'static str> {
    QUANTITIES.iter().find(|(known, ..)| *known == dimension).map(|(.., si)| *si)
}

/// Every quantity that files ask for.
pub fn quantities() -> Vec<KnownQuantity> {
    QUANTITIES.iter().map(|(dimension, name, si)| KnownQuantity { name, si, example: example(*dimension) }).collect()
}

fn example(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::PER_KELVIN => "\"0.004 1/K\"",
        KINEMATIC_VISCOSITY => "\"150 cSt\"",
        Dimension::NUMBER => "\"0.5\", \"95 %\" or \"30 deg\"",
        _ => dimension.example(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{convert, parse};

    #[test]
    fn every_symbol_has_a_quantity_and_every_example_reads() {
        for unit in symbols() {
            assert!(!unit.si.is_empty(), "{}", unit.symbol);
            let dimension = QUANTITIES.iter().find(|(_, name, _)| *name == unit.dimension).map_or(Dimension::TEMPERATURE, |(d, ..)| *d);
            let one = convert(1.0, unit.symbol, dimension).unwrap();
            assert!((one - unit.factor - unit.zero_K.unwrap_or(0.0)).abs() < 1e-9 * one.abs(), "{}", unit.symbol);
        }
        for (dimension, name, si) in QUANTITIES {
            assert_eq!(convert(2.0, si, *dimension).unwrap(), 2.0, "{name}");
            for text in example(*dimension).split('"').skip(1).step_by(2) {
                parse(text, *dimension).unwrap_or_else(|e| panic!("{name}: {text}: {e}"));
            }
        }
    }
}
