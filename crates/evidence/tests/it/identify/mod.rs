//! Parameters from measured data: coverage over many noisy twins, logs, what cannot be determined, bounds and priors, scans,
//! the written machine, and data as they should not be.

mod closed;
mod common;
mod learnt;
mod logs;
mod mesh;
mod per_test;
mod twins;
