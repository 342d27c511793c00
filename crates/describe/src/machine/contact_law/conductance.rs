//! A constant conductance per area.

use super::{Interface, Law, Slope};
use crate::schema::{ChangeReach, Key, Unit, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

pub(super) const KEYS: &[Key] = &[Key::new("conductance", ValueForm::Quantity(Unit::of(Dimension::FILM, "W/(m2 K)")), "per area")
    .positive()
    .reaching(ChangeReach::Contact)
    .usual()
    .also(&["h", "hc", "tcc", "contact_conductance"])];

/// Constant conductance, W/(m² K).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conductance(pub f64);

pub(super) fn read(section: &Section<'_>) -> Result<Conductance> {
    KEYS[0].read(section).map(Conductance)
}

impl Law for Conductance {
    fn conductance(&self, _: &Interface) -> Slope {
        Slope::constant(self.0)
    }
}
