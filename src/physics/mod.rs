//! Closures: one law per function, each with its equation, units, validity range and source.
//!
//! SI throughout, temperatures in kelvin. No law extrapolates in silence: where an argument can
//! leave the range a law was made for, the law either fails ([`water`]) or has a companion that
//! says so (a `note` function, or a [`Checked`] value). `docs/physics.md` lists all of them with
//! their ranges and sources.

pub mod bearing;
pub mod channel;
pub mod contact;
pub mod convection;
pub mod drive;
pub mod exchange;
pub mod gas;
pub mod liquid;
pub mod radiation;
pub mod view;
pub mod water;

mod bend;
mod hydraulics;
mod regime;

/// A value together with what is doubtful about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked {
    /// The value.
    pub value: f64,
    /// Why the value is outside what its law was made for; `None` inside.
    pub note: Option<&'static str>,
}
