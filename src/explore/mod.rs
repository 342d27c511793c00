//! Many solves: designs of experiments over the conditions, by our own solver or another program, and histories over time.

pub mod cluster;
pub mod external;
pub mod schedule;
pub mod simulate;
pub mod sweep;
