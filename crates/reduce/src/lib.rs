//! Reduced models: a machine at any condition in milliseconds, with a bound on every reading.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

mod assemble;
mod basis;
mod cell_fields;
mod channel_walls;
mod conductors;
mod cubature;
mod dynamics;
mod integrator;
mod interpolation;
mod make;
mod model;
mod modes_field;
mod network_parts;
mod on_demand;
mod reduced_network;
mod reference;
mod run;
mod sensitivity;
mod stations;
mod stored;
mod training_runs;
mod water;

pub use cell_fields::Guess;
pub use dynamics::{Slow, SlowSample};
pub use integrator::Path;
pub use make::{Settings, reduce};
pub use model::{Answer, InTime, Made, ReducedModel};
pub use modes_field::Field;
pub use on_demand::{Asked, Guesses, InFull, answers};
pub use reduced_network::{Level, Reduced};
pub use run::{Beginning, Course, Stretch};
pub use sensitivity::{Slopes, Spread, Spreads};

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");
