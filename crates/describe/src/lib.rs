//! The engineer's input: the machine file with its schema, and meshes imported from CAD. Nothing here solves.
//!
//! * [`machine::Machine`]: a machine file, read and checked, in SI.
//! * [`machine::Part`], [`machine::LumpedNode`], [`machine::Contact`], [`machine::Circuit`], [`machine::Source`],
//!   [`machine::Sensor`]: its pieces.
//! * [`machine::Condition`]: a value for every variable of a machine.
//! * [`machine::Scope`]: the variables, points and limits, which suffice for a fit or a verdict.
//! * [`machine::SCHEMA`], a [`schema::KeyTable`]: every key with its form, default and reach.
//! * [`gmsh::MeshFile`], [`gmsh::Body`]: a mesh of Gmsh, and one volume of it.
//!
//! ```
//! use coldplate_describe::machine::{Machine, starters};
//!
//! let machine: Machine = starters::starter("cold_plate")?.text.parse()?;
//! let condition = machine.condition(&[("coolant_flow", "4 L/min")])?;
//! assert!(condition.words(&machine).starts_with("coolant flow 4.000 L/min"));
//! # Ok::<(), coldplate_base::error::Error>(())
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod gmsh;
pub mod machine;
pub mod schema;

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");
