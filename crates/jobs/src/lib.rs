//! Whole jobs: from a file to tables, surrogates, figures and reports.
//!
//! [`run()`] is the main one: a sweep file becomes one folder with tables, surrogate, figures and a report, summed up in a
//! [`Summary`]. [`open()`] reads a file of any kind; [`info::Info`] says what is in it, [`reduced::ReducedSolution`] and
//! [`reduced_slopes::ReducedSlopes`] answer from reduced models, [`surrogate_run::SurrogateRun`] runs a surrogate through a
//! schedule, [`service::Book`] answers for as long as a process lives, and [`charts::Chart`] draws what a definition says.
//!
//! ```no_run
//! use coldplate_base::progress::Silent;
//! use coldplate_explore::sweep::SweepOptions;
//! use coldplate_explore::sweep::sweep_file::Sweep;
//!
//! let sweep = Sweep::open("examples/tutorial/sweep.toml", None, &[])?;
//! let summary = coldplate_jobs::run(&sweep, "out/tutorial".as_ref(), SweepOptions::default(), &Silent)?;
//! assert!(summary.worst_held_out().is_some_and(|kelvins| kelvins < coldplate_jobs::TARGET));
//! # Ok::<(), coldplate_base::error::Error>(())
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod adaptive;
mod answer;
pub mod charts;
mod default_figures;
pub mod designs;
pub mod drift_report;
pub mod dynamics_fit;
pub mod figures;
pub mod fitting;
pub mod followed;
pub mod gallery;
pub mod info;
pub mod measured;
pub mod one_machine;
mod open;
pub mod pdf;
pub mod reduced;
pub mod reduced_slopes;
pub mod refit;
mod report;
mod run;
pub mod scene;
pub mod sensitivity;
pub mod service;
mod summary;
pub mod surrogate_run;
mod trial;

pub use answer::Answer;
pub use default_figures::chart;
pub use open::{DocumentKind, FileKind, OpenFile, open};
pub use run::run;
pub use summary::{PointSummary, PrintedFormula, SURROGATE, Summary, TARGET};
