//! Temperatures of a water-cooled machine in vacuum, at any condition: solved, swept, fitted, and held against what was
//! measured.
//!
//! ```text
//!     machine (TOML) --> mesh --> THERMAL NETWORK --> solve --> temperatures at sensors
//!                                                       |
//!     condition (flow, water, speed, chamber) ----------+--> sweep --> table --> fit --> surrogate --> query, chart
//!
//!     measured data --> identify --> diagnose --> extend --> a better machine
//! ```
//!
//! The **thermal network** is the narrow waist: every machine compiles to nodes, conductors, streams of water, surfaces,
//! sources and sensors, and the solver knows nothing else. A **surrogate** is a function fitted to a table of solved or
//! measured conditions, with a band that says how far to trust it; the crate `coldplate-runtime` evaluates its file anywhere.
//!
//! The `coldplate` program is a thin command line over this library: what a command does, the functions below do.
//!
//! # Solve a machine
//!
//! ```
//! use coldplate::{Machine, MeshedMachine};
//!
//! let machine = Machine::read("examples/tutorial/machine.toml", &[])?;
//! let condition = machine.condition(&[("motor_speed", "2500 rpm"), ("coolant_flow", "4 L/min")])?;
//! let model = MeshedMachine::new(machine, Some(500))?; // about so many cells
//! let state = model.steady(&condition)?;
//! for reading in model.record(&state).sensors {
//!     println!("{}: {:.2} degC", reading.0, reading.1);
//! }
//! assert!(state.solution.balance.relative < 1e-8);
//! # Ok::<(), coldplate::Error>(())
//! ```
//!
//! # Sweep, fit, query
//!
//! ```
//! use coldplate::{Acceptability, FitOptions, Surrogate, Sweep, SweepOptions, fit_table, query};
//!
//! let folder = std::env::temp_dir().join(format!("coldplate-sweep-{}", std::process::id()));
//! let sweep = Sweep::open("examples/tutorial/sweep.toml", Some(300), &[])?;
//! let swept = sweep.run(&folder, SweepOptions::default())?; // resumes what it finds in the folder
//! let fit = fit_table(&swept.table, Some(&sweep.scope), &FitOptions::default())?;
//! let file = fit.to_bytes()?;
//!
//! let surrogate = Surrogate::open(&file)?;
//! // flow in L/min, water in degC, speed in rpm, chamber in degC: variables and units stand in the surrogate
//! let answer = query(&surrogate, &[4.0, 20.0, 2000.0, 22.0])?;
//! assert_eq!(answer.verdict, Acceptability::Acceptable);
//! println!("{:?} has the least margin", answer.binding_name());
//! # std::fs::remove_dir_all(folder).unwrap();
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Diagnose and extend
//!
//! ```
//! use coldplate::{DiagnosisProblem, Machine, Silent, examine};
//!
//! // The readings stand beside a file that says how good they are: readings.toml.
//! let problem = DiagnosisProblem::read("examples/tutorial/machine.toml", "examples/tutorial/readings.csv", Some(150))?;
//! let found = examine(&problem, "extended.toml", None, &Silent)?; // writes nothing
//! println!("{}", found.headline());
//! assert!(found.diagnosis.misfit.probability < 0.002); // this file is wrong in two places
//! if let Some(extended) = &found.extended {
//!     println!("{}", extended.text); // the machine file with the best explanation in it
//! }
//! # Ok::<(), coldplate::Error>(())
//! ```
//!
//! # Rooms
//!
//! | room | what is in it |
//! |---|---|
//! | [`foundation`] | documents, formulas, tables, files that are whole or absent, random numbers, progress |
//! | [`units`], [`error`] | values with units; one error that names place, value and remedy |
//! | [`describe`] | the machine file and imported meshes |
//! | [`physics`] | one law per function, with source and validity range |
//! | [`discretise`] | cells, and the thermal network they make |
//! | [`solve`] | matrices, multigrid, steady and transient solvers, derivatives |
//! | [`reduce`] | reduced models: few modes for a machine, with a bound on every reading |
//! | [`explore`] | sweeps, by our own solver or another, here or on a cluster; schedules, simulation over time |
//! | [`surrogate`] | fitting, the surrogate file, verdicts and inverse questions |
//! | [`figures`] | charts and reports as plain data |
//! | [`evidence`] | measured data, identification, diagnosis |
//! | [`pipeline`] | whole jobs: from sweep to report, from data to extended machine |
//! | [`cli`] | the command line |
//!
//! A room uses only rooms above it in this table; a test holds the arrows. Results derive `serde::Serialize` or have a
//! `record` beside them that does: that is what `--json` prints.

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
pub mod reduce;
pub mod solve;
pub mod surrogate;
pub mod units;

pub use describe::machine::{Condition, Machine};
pub use error::{Error, Result, Stop};
pub use evidence::diagnose::{Diagnosis, Problem as DiagnosisProblem, Verdict, diagnose};
pub use evidence::identify::{Estimate, Free, IdentifyOptions, Problem as IdentifyProblem, identify};
pub use evidence::measurement::{Data, Uncertainty};
pub use explore::schedule::Schedule;
pub use explore::simulate::{History, SimulateOptions, run as simulate};
pub use explore::sweep::bridge::Sweep;
pub use explore::sweep::{SweepOptions, Swept};
pub use foundation::progress::{Progress, Silent};
pub use foundation::table::Table;
pub use pipeline::diagnosis::{Findings, examine};
pub use pipeline::fitting::fit_table;
pub use solve::meshed::{MeshedMachine, SteadyState};
pub use solve::sensitivity::Study;
pub use surrogate::fit::{Fit, FitOptions};
pub use surrogate::verdict::{Acceptability, Answer, Surrogate, query};
