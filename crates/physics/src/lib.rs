//! Closures: one law per function, each with its equation, units, validity range and source.
//!
//! SI throughout, temperatures in kelvin. No law extrapolates in silence: where an argument can leave the range a law
//! was made for, the law either fails ([`water`]) or has a companion that reports it (a `note` function, or a
//! [`NotedValue`] value). `docs/reference/physics.md` lists all of them with their ranges and sources.
//!
//! The solver does not call every law. Some serve engineers who check a number by hand, and tests that hold the solver
//! against a closed form: bearing friction ([`bearing`]), coils ([`channel::coil_nusselt_schmidt`] and its siblings),
//! view factors of [`view_factors`] beyond those between blocks, single terms of a drive's heat ([`drive::copper_loss`],
//! [`drive::guide_force`], [`drive::preload_torque`]), [`radiation::two_surface`], [`contact::gap_radiation`],
//! [`water::saturation_pressure`].
//!
//! * [`channel::StraightChannel`], [`channel::Film`]: film, friction and flow split of coolant channels.
//! * [`liquid::Liquid`], [`water::LiquidProperties`]: coolants and their properties at a temperature.
//! * [`contact::Rough`]: conductance between touching rough surfaces.
//! * [`convection::FreeConvection`], [`convection::Gas`]: free convection to a still gas.
//! * [`drive::Parameters`], [`drive::Heats`]: heat of a feed drive.
//! * [`exchange`], [`radiation`], [`gas`]: radiation among grey surfaces, residual gas in the chamber.
//!
//! ```
//! use coldplate_physics::channel::{StraightChannel, Wall, film};
//! use coldplate_physics::liquid::Liquid;
//!
//! let channel = StraightChannel { diameter: 0.01, length: 1.6, wall: Wall::Flux, velocity_developed: false };
//! let water = Liquid::Water.at(299.15)?;
//! let film = film(2e-6, &channel, &water, None); // 0.12 L/min
//! assert_eq!(film.regime.name(), "laminar");
//! assert!(film.note.is_none());
//! # Ok::<(), coldplate_base::error::Error>(())
//! ```

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
pub mod view_factors;
pub mod water;

mod bend;
mod constants;
mod hydraulics;
mod regime;

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");

/// A value together with doubts about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NotedValue {
    /// The value.
    pub value: f64,
    /// Reason why the value lies outside the range of its law; `None` inside.
    pub note: Option<&'static str>,
}
