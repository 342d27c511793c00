//! Many solves: designs of experiments over the conditions, and histories over time.

pub mod schedule;
pub mod simulate;
pub mod sweep;
