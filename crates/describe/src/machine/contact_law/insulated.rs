//! A joint that no heat crosses.

use super::{Interface, Law, Slope, must_be_true};
use crate::schema::{ChangeReach, Key, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;

pub(super) const KEYS: &[Key] = &[Key::new("insulated", ValueForm::True, "no heat").reaching(ChangeReach::Contact)];

/// A joint without heat flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Insulated;

pub(super) fn read(section: &Section<'_>) -> Result<Insulated> {
    must_be_true(section, KEYS[0].name).map(|()| Insulated)
}

impl Law for Insulated {
    fn conductance(&self, _: &Interface) -> Slope {
        Slope::constant(0.0)
    }

    fn joins_along(&self) -> bool {
        false
    }

    fn refusal_at_node(&self, _: bool) -> Option<&'static str> {
        None
    }
}
