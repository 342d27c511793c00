//! A table of the conductance against contact pressure, at a given pressure.

use super::super::parts::Property;
use super::{Interface, Law, Slope};
use crate::schema::{ChangeReach, Key, Unit, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

const MEGAPASCALS: Unit = Unit::of(Dimension::PRESSURE, "MPa");

pub(super) const KEYS: &[Key] = &[
    Key::new(
        "pressure_table",
        ValueForm::Curve(MEGAPASCALS, Unit::of(Dimension::FILM, "W/(m2 K)")),
        "with `pressure`: `[[\"0.1 MPa\", \"300 W/(m2 K)\"], ...]`, at that contact pressure, which must lie in the table",
    )
    .reaching(ChangeReach::Contact)
    .usual(),
    Key::new("pressure", ValueForm::Quantity(MEGAPASCALS), "contact pressure, with `pressure_table`")
        .positive()
        .reaching(ChangeReach::Contact)
        .usual(),
];

/// Conductance against contact pressure, evaluated at one pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct OfPressure {
    /// Piecewise-linear table of (Pa, W/(m² K)).
    pub table: Vec<(f64, f64)>,
    /// Contact pressure, Pa.
    pub pressure: f64,
}

pub(super) fn read(section: &Section<'_>) -> Result<OfPressure> {
    let key = KEYS[0].name;
    let table = section.curve(key, Dimension::PRESSURE, Dimension::FILM)?;
    if table.iter().any(|(p, h)| *p < 0.0 || *h <= 0.0) {
        return Err(section.error_at(key, "pressures cannot be negative, conductances must be larger than zero"));
    }
    let pressure = KEYS[1].read(section)?;
    if pressure < table[0].0 || pressure > table[table.len() - 1].0 {
        return Err(section.error_at("pressure", "the pressure lies outside the table").help("extend the table or change the pressure"));
    }
    Ok(OfPressure { table, pressure })
}

impl Law for OfPressure {
    fn conductance(&self, _: &Interface) -> Slope {
        Slope::constant(Property::Table(self.table.clone()).at(self.pressure))
    }
}
