//! Temperatures of a water-cooled machine in vacuum, at any condition.
//!
//! ```text
//! machine (TOML) -> mesh -> thermal network -> solve -> sensors
//! condition (flow, coolant temperature, speed, ambient) -> sweep -> fit -> surrogate -> query, chart
//! ```
//!
//! The thermal network is the narrow waist: every model compiles to nodes, conductors, streams,
//! surfaces, sources and sensors, and the solver knows nothing else.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod cli;
pub mod describe;
pub mod discretise;
pub mod error;
pub mod evidence;
pub mod explore;
pub mod figures;
pub mod foundation;
pub mod physics;
pub mod pipeline;
pub mod solve;
pub mod surrogate;
pub mod units;
