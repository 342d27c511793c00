//! Other programs: decks for CalculiX, tables in their dialects, and series of VTU files as tables.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod calculix;
pub mod foreign;
pub mod vtu_series;
