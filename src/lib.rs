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
//! # Where things are
//!
//! This crate is the interface. What it is made of lies in crates of its own, which may change in every release:
//! `coldplate-describe` (the machine file), `coldplate-network` (cells and the thermal network), `coldplate-solve`,
//! `coldplate-reduce`, `coldplate-explore` (sweeps, schedules), `coldplate-surrogate`, `coldplate-evidence` (measured data,
//! identification), `coldplate-diagnose`, `coldplate-jobs` and `coldplate-findings` (whole jobs and their reports).
//! `coldplate-runtime` reads surrogate files on any device. Results derive `serde::Serialize` or have a `record` beside them
//! that does: `--json` prints it.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub use coldplate_base::error::{Error, Result, Stop};
pub use coldplate_base::progress::{Progress, Silent};
pub use coldplate_describe::machine::{Condition, Machine};
pub use coldplate_diagnose::{Diagnosis, Problem as DiagnosisProblem, Verdict, diagnose};
pub use coldplate_evidence::identify::{Estimate, Free, IdentifyOptions, IdentifyProblem, identify};
pub use coldplate_evidence::measurement::{Data, MeasurementUncertainty};
pub use coldplate_explore::schedule::Schedule;
pub use coldplate_explore::simulate::{History, SimulateOptions, run as simulate};
pub use coldplate_explore::sweep::sweep_file::Sweep;
pub use coldplate_explore::sweep::{SweepOptions, Swept};
pub use coldplate_findings::{Findings, examine, words};
pub use coldplate_jobs::fitting::fit_table;
pub use coldplate_solve::meshed::{MeshedMachine, SteadyState};
pub use coldplate_solve::study::Study;
pub use coldplate_surrogate::fit::{FitOptions, SurrogateFit};
pub use coldplate_surrogate::verdict::{Acceptability, Inverse, Surrogate, SurrogateAnswer, free, query};
pub use coldplate_tables::Table;
