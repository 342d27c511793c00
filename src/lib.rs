//! Temperatures of a water-cooled machine in vacuum, at any condition.
//!
//! ```text
//! machine (TOML) -> mesh -> thermal network -> solve -> sensors
//! condition (flow, coolant temperature, speed, ambient) -> sweep -> fit -> surrogate -> query, chart
//! ```
//!
//! The thermal network is the narrow waist: every model compiles to nodes, conductors, streams,
//! surfaces, sources and sensors, and the solver knows nothing else.

#![warn(missing_docs)]

pub mod accept;
pub mod chart;
pub mod cli;
pub mod diagnose;
pub mod error;
pub mod files;
pub mod fit;
pub mod formula;
pub mod gmsh;
pub mod identify;
pub mod job;
pub mod machine;
pub mod measure;
pub mod mesh;
pub mod model;
pub mod network;
pub mod physics;
pub mod random;
pub mod reader;
pub mod report;
pub mod schedule;
pub mod sensitivity;
pub mod simulate;
pub mod solve;
pub mod sweep;
pub mod table;
pub mod units;
