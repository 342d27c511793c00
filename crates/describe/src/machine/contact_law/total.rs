//! A constant conductance of the whole contact.

use super::{Interface, Law, Slope};
use crate::schema::{ChangeReach, Key, Unit, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;

pub(super) const KEYS: &[Key] =
    &[Key::new("total_conductance", ValueForm::Quantity(Unit::of(Dimension::CONDUCTANCE, "W/K")), "spread over the true area")
        .positive()
        .reaching(ChangeReach::Contact)
        .usual()];

/// Conductance of the whole contact, W/K, spread over its true area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Total(pub f64);

pub(super) fn read(section: &Section<'_>) -> Result<Total> {
    KEYS[0].read(section).map(Total)
}

impl Law for Total {
    fn conductance(&self, at: &Interface) -> Slope {
        Slope::constant(self.0 / at.area)
    }

    fn is_total(&self) -> bool {
        true
    }

    fn refusal_at_node(&self, _: bool) -> Option<&'static str> {
        None
    }
}
