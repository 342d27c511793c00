//! Reduced models: a machine at any condition in milliseconds, with a bound on every reading.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

mod assemble;
mod basis;
mod bound;
mod calibration;
mod channel_walls;
mod conductors;
mod cubature;
mod dynamics;
mod fields;
mod growth;
mod integrator;
mod interpolation;
mod make;
mod model;
mod network_parts;
mod on_demand;
mod reduced_network;
mod reference;
mod run;
mod sensitivity;
mod shapes;
mod stations;
mod stored;
mod storing;
mod training_runs;
mod water;

pub use dynamics::{Slow, SlowSample};
pub use fields::ModeField;
pub use growth::Guess;
pub use integrator::Path;
pub use make::{ReduceSettings, reduce};
pub use model::{HistoryBound, Made, ReducedAnswer, ReducedModel};
pub use on_demand::{Asked, Guesses, InFull, answers};
pub use reduced_network::{ReducedNetwork, ReducedState};
pub use run::{Beginning, ConditionStretch, ReducedHistory};
pub use sensitivity::{ReadingSpread, Slopes, Spreads};

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");
