//! Networks become temperatures: sparse matrices, multigrid, Krylov methods, Newton's method.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

mod adjoint;
mod aggregation;
mod anchors;
pub mod balance;
mod bounded;
mod control;
pub mod csr;
mod direct;
pub mod heat_flow;
pub mod heat_paths;
mod jacobian;
pub mod krylov;
pub mod meshed;
pub mod multigrid;
mod newton;
mod preconditioner;
pub mod reachability;
pub mod sensitivity;
mod state_table;
mod steady;
pub mod study;
mod surfaces;
mod system;
mod tensor;
pub mod transient;

pub use adjoint::Tangent;
pub use jacobian::Jacobian;
pub use state_table::Nearby;
pub use steady::{Solution, Solver, SteadySettings};
pub use system::{Symmetric, System, entering_temperature, residual};

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");
