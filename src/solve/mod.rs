//! Networks become temperatures: sparse matrices, multigrid, Krylov methods, Newton's method.

mod aggregation;
pub mod balance;
pub mod calculix;
pub mod csr;
mod direct;
pub mod heat_flow;
mod jacobian;
pub mod krylov;
pub mod meshed;
pub mod multigrid;
mod nearby;
pub mod outlet;
mod outside;
pub mod routes;
pub mod sensitivity;
mod start;
mod steady;
mod system;
mod tangent;
mod tensor;
pub mod transient;

/// Hash of the sources of everything between a machine file and its temperatures: journals and checkpoints of
/// another build are refused by it.
pub const NUMERICS: &str = env!("COLDPLATE_NUMERICS");

pub use jacobian::Jacobian;
pub use nearby::Nearby;
pub use steady::{BALANCE_TOLERANCE, Solution, Solver};
pub use system::{Symmetric, System, entering_temperature, residual};
pub use tangent::Tangent;
