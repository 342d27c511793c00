//! Foundations of all other crates: files read as a whole, documents that know the place of every value, formulas,
//! files written whole or not at all, random numbers with a lasting seed, numbers as text, vectors, and the progress of
//! long work.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod atomic_file;
pub mod document;
pub mod error;
pub mod formula;
pub mod input;
pub mod memory;
pub mod numbers;
pub mod progress;
pub mod random;
pub mod terms;
pub mod units;
pub mod vector;
pub mod vtu;

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");
