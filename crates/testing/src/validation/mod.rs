//! The published rig and machine, held against the numbers of the study (data/): a file for each section of
//! docs/record/validation.md, which `cargo bench --bench validation` writes; tests hold the same numbers to their targets.

pub mod common;
pub mod fits;
pub mod flow;
pub mod machine;
pub mod placement;
pub mod plan;
pub mod rig;
pub mod settling;
pub mod standstill;
pub mod tables;
