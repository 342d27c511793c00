//! The machine against measurements: readings with their uncertainty, faulty readings, parameters identified from the readings,
//! and the discrepancy of the model.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod discrepancy;
pub mod faulty;
pub mod given;
pub mod identify;
pub mod measurement;
pub mod residuals;
pub mod sandwich;
