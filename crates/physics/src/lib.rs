//! Closures: one law per function, each with its equation, units, validity range and source.
//!
//! SI throughout, temperatures in kelvin. No law extrapolates in silence: where an argument can leave the range a law
//! was made for, the law either fails ([`water`]) or has a companion that reports it (a `note` function, or a
//! [`Checked`] value). `docs/physics.md` lists all of them with their ranges and sources.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

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

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");

/// A value together with doubts about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked {
    /// The value.
    pub value: f64,
    /// Reason why the value lies outside the range of its law; `None` inside.
    pub note: Option<&'static str>,
}
