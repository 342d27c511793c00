//! A power that changes linearly with the temperature of each piece it heats.

use super::{Law, Slope};
use crate::schema::{Key, Unit, Unstated, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

/// Largest relative change of the power with the temperature, 1/K. Chosen: allows every real source and catches a wrong
/// unit.
const MOST: f64 = 0.2;

const COEFFICIENT: Key = Key::new(
    LinearPower::COEFFICIENT,
    ValueForm::Quantity(Unit::of(Dimension::PER_KELVIN, "1/K")),
    "relative change of the power of each cell with its own temperature: `\"0.39 %/K\"` for copper at a given current, about \
     `\"-3 %/K\"` for grease",
)
.or(Unstated::Si(LinearPower::UNSTATED.coefficient));

const REFERENCE: Key = Key::new(
    "reference_temperature",
    ValueForm::Quantity(Unit::of(Dimension::TEMPERATURE, "degC")),
    "temperature at which the power is as stated",
)
.or(Unstated::Si(LinearPower::UNSTATED.reference));

pub(super) const KEYS: &[Key] = &[COEFFICIENT, REFERENCE];

/// P (1 + b (T - T0)), at least zero: a source never turns into a sink.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearPower {
    /// Relative change of the power with the temperature, 1/K: 0.0039 for copper losses at a given current.
    pub coefficient: f64,
    /// Temperature at which the power equals the stated power, K.
    pub reference: f64,
}

impl LinearPower {
    /// The key of the coefficient.
    pub const COEFFICIENT: &str = "temperature_coefficient";

    /// The law with all keys at their defaults: the power is constant.
    pub(crate) const UNSTATED: Self = Self { coefficient: 0.0, reference: 293.15 };

    /// Derivative of the power with respect to the coefficient, W K, at a temperature (K); none where the power is zero.
    pub fn per_coefficient(&self, base: f64, temperature: f64) -> f64 {
        let rise = temperature - self.reference;
        if 1.0 + self.coefficient * rise > 0.0 { base * rise } else { 0.0 }
    }
}

pub(super) fn read(section: &Section<'_>) -> Result<Option<LinearPower>> {
    let coefficient = COEFFICIENT.read(section)?;
    if coefficient.abs() > MOST {
        return Err(section
            .error_at(LinearPower::COEFFICIENT, "losses change by a few percent per kelvin")
            .help("copper: \"0.39 %/K\"; grease and oil: about \"-3 %/K\""));
    }
    let law = LinearPower { coefficient, reference: REFERENCE.read(section)? };
    Ok((law != LinearPower::UNSTATED).then_some(law))
}

impl Law for LinearPower {
    fn power(&self, base: f64, temperature: f64) -> Slope {
        let factor = (1.0 + self.coefficient * (temperature - self.reference)).max(0.0);
        Slope { value: base * factor, slope: if factor > 0.0 { base * self.coefficient } else { 0.0 } }
    }

    fn follows_temperature(&self) -> bool {
        self.coefficient != 0.0
    }

    fn linear(&self) -> Option<LinearPower> {
        Some(*self)
    }

    fn note(&self) -> Option<&'static str> {
        (!self.follows_temperature()).then_some("reference_temperature changes nothing while temperature_coefficient is 0")
    }
}
