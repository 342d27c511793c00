//! Foundations of all other crates: files, documents, units, formulas, and errors with a remedy.
//!
//! * [`error::Error`]: a sentence about a fault, its place, and a remedy; [`error::Kind`] decides the exit status.
//! * [`document::Document`]: a TOML file that knows the place of every value, read strictly by [`document::Section`] and
//!   [`document::Value`].
//! * [`units`]: [`units::Dimension`] and values with units; everything behind the reader is SI.
//! * [`formula::Formula`]: a number that depends on the condition, with its derivative.
//! * [`condition`]: the variables that every machine has.
//! * [`progress::Progress`]: reports of long work.
//! * [`vtu::Vtu`]: fields on a mesh, read from files of `ParaView`.
//! * [`atomic_file`], [`input`], [`roles`]: files written whole or not at all, read as a whole, and never both in one run.
//! * [`random::Random`], [`numbers`], [`vector`], [`memory`], [`terms`]: random numbers with a lasting seed, numbers as
//!   text, vectors, memory of the machine, terms of the surrogate file.
//!
//! ```
//! use coldplate_base::document::Document;
//! use coldplate_base::units::Dimension;
//!
//! let file = Document::parse("[pump]\nflow = '9.42 litres'", "rig.toml").unwrap();
//! let error = file.root().section("pump").unwrap().quantity("flow", Dimension::VOLUME_FLOW).unwrap_err();
//! assert_eq!(error.location().line, Some(2));
//! assert_eq!(error.location().key.as_deref(), Some("pump.flow"));
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod atomic_file;
pub mod condition;
pub mod document;
pub mod error;
pub mod formula;
pub mod input;
pub mod memory;
pub mod numbers;
pub mod progress;
pub mod random;
pub mod roles;
pub mod terms;
pub mod units;
pub mod vector;
pub mod vtu;

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");
