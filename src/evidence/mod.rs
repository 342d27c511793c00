//! The machine against measurements: readings with their uncertainty, parameters identified from them, and
//! causes named where no parameter explains them.

pub mod diagnose;
pub mod discrepancy;
pub mod faulty;
pub mod identify;
pub mod measurement;
pub mod residuals;
pub mod sandwich;
