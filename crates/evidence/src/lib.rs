//! The machine against measurements.
//!
//! [`Data`] holds readings by condition, [`MeasurementUncertainty`] their standard deviations. [`cleared`] finds the readings that
//! are wrong, each a [`Fault`], and leaves them out. [`PredictedReadings`] puts the machine's predictions beside the rest;
//! [`identify()`] finds the numbers of the machine file that fit them ([`Estimate`]), and with them the error that the model has of
//! its own ([`DiscrepancySize`]).
//!
//! ```no_run
//! use coldplate_base::progress::Silent;
//! use coldplate_evidence::{Data, Free, IdentifyOptions, IdentifyProblem, MeasurementUncertainty, cleared, identify};
//! use coldplate_explore::Start;
//! use coldplate_solve::study::Study;
//!
//! let study = Study::read("machine.toml", &[], None)?;
//! let data = Data::read("readings.csv".as_ref(), &study.model.machine)?;
//! let uncertainty = MeasurementUncertainty::beside("readings.csv".as_ref(), &data, &study.model.machine)?;
//! let data = cleared(&study, &data, &uncertainty, Start::Steady)?.data;
//! let free = vec![Free::parse("contact.foot.conductance", &study)?];
//! let problem = IdentifyProblem { study, data, uncertainty, free, start: Start::Steady };
//! let found = identify(&problem, &IdentifyOptions::default(), &Silent)?;
//! println!("{} W/m²K", found.values[0]);
//! # Ok::<(), coldplate_base::error::Error>(())
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod command_input;
pub mod discrepancy;
pub mod faulty_readings;
pub mod identify;
pub mod measured_table;
pub mod measurement;
pub mod record;
pub mod residuals;
pub mod sandwich;

pub use discrepancy::DiscrepancySize;
pub use faulty_readings::{Fault, cleared};
pub use identify::{Estimate, Free, IdentifyOptions, IdentifyProblem, identify};
pub use measurement::{Data, MeasurementUncertainty};
pub use residuals::PredictedReadings;
