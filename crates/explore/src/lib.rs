//! Many solves: designs of experiments over the conditions, and histories over time.
//!
//! A [`Sweep`] is a sweep file with the machine. Its [`Plan`] of conditions is solved by our own solver, a reduced model or
//! another program ([`external`]), here, in parts or on a [`cluster`]; finished conditions stand in a [journal](sweep::journal) and
//! are never solved twice. A [`Schedule`] gives conditions over time: [`simulate::run`] takes a machine through it, [`simulate::run_reduced`]
//! a reduced model, [`simulate::run_stepped`] any other model that moves in steps.
//!
//! ```no_run
//! use coldplate_explore::{Sweep, SweepOptions};
//!
//! let sweep = Sweep::open("sweeps/rig.toml", Some(3000), &[])?;
//! let swept = sweep.run("out/rig", SweepOptions::default())?; // resumes what it finds in the folder
//! println!("{} conditions to fit, {} failed", swept.table.rows(), swept.failures.len());
//! # Ok::<(), coldplate_base::error::Error>(())
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod cluster;
pub mod external;
pub mod schedule;
pub mod simulate;
pub mod stop;
pub mod sweep;

pub use schedule::{Schedule, ScheduleOptions};
pub use simulate::{History, SimulateOptions, Start};
pub use sweep::sweep_file::Sweep;
pub use sweep::{Plan, SweepDefinition, SweepOptions, Swept};

use sha2::{Digest, Sha256};

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");

/// Hash of every source that decides a solved temperature or an answer of a reduced model: this crate and all crates of the
/// project below it. A journal or a checkpoint of other numerics is refused. `coldplate-runtime` is left out: only names and
/// limits of length are taken from it.
pub fn numerics() -> String {
    let sources = [
        coldplate_base::SOURCES,
        coldplate_tables::SOURCES,
        coldplate_physics::SOURCES,
        coldplate_describe::SOURCES,
        coldplate_network::SOURCES,
        coldplate_solve::SOURCES,
        coldplate_reduce::SOURCES,
        SOURCES,
    ];
    Sha256::digest(sources.concat()).iter().take(8).map(|byte| format!("{byte:02x}")).collect()
}
