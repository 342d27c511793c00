//! Many solves: designs of experiments over the conditions, by our own solver or another program, and histories over time.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod cluster;
pub mod external;
pub mod schedule;
pub mod simulate;
pub mod sweep;

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
