//! A table of the conductance against the mean temperature of the interface.

use super::super::library::property;
use super::super::parts::Property;
use super::{Interface, Law, Slope};
use crate::schema::{ChangeReach, Key, Unit, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

const FILM: Unit = Unit::of(Dimension::FILM, "W/(m2 K)");

pub(super) const KEYS: &[Key] = &[Key::new(
    "temperature_table",
    ValueForm::Either(&[ValueForm::Quantity(FILM), ValueForm::Curve(Unit::of(Dimension::TEMPERATURE, "degC"), FILM)]),
    "`[[\"20 degC\", \"300 W/(m2 K)\"], ...]` against the mean temperature of the interface",
)
.reaching(ChangeReach::Contact)
.usual()];

/// Conductance (W/(m² K)) against the mean temperature of the interface (K), linear between the points.
#[derive(Debug, Clone, PartialEq)]
pub struct OfTemperature(pub Property);

pub(super) fn read(section: &Section<'_>) -> Result<OfTemperature> {
    property(&section.value(KEYS[0].name)?, Dimension::FILM).map(OfTemperature)
}

impl Law for OfTemperature {
    fn conductance(&self, at: &Interface) -> Slope {
        let (value, slope) = self.0.with_slope(at.temperature);
        Slope { value, slope }
    }

    fn follows_temperature(&self) -> bool {
        !self.0.is_constant()
    }

    // Not along the interface: the temperature of one side alone would not do, and pairs of nodes are equally accurate
    // here, to second order.
    fn joins_along(&self) -> bool {
        false
    }
}
