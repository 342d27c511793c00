//! A perfect joint.

use super::{Interface, Law, Slope, must_be_true};
use crate::schema::{ChangeReach, Key, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;

pub(super) const KEYS: &[Key] = &[Key::new("bonded", ValueForm::True, "no resistance").reaching(ChangeReach::Contact)];

/// A joint without resistance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bonded;

pub(super) fn read(section: &Section<'_>) -> Result<Bonded> {
    must_be_true(section, KEYS[0].name).map(|()| Bonded)
}

impl Law for Bonded {
    fn conductance(&self, _: &Interface) -> Slope {
        Slope::constant(f64::INFINITY)
    }

    fn refusal_at_node(&self, _: bool) -> Option<&'static str> {
        Some("a lumped node cannot be bonded")
    }
}
