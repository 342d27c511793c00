//! Networks become temperatures: sparse matrices, multigrid, Krylov methods, Newton's method.

pub mod balance;
pub mod csr;
pub mod krylov;
pub mod multigrid;
mod steady;
mod system;

pub use steady::{BALANCE_TOLERANCE, Solution, Solver};
pub use system::System;
