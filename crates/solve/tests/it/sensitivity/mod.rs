//! Derivatives: the exact Jacobian against differences of the residual, forward against adjoint, both against
//! differences of full solutions, closed forms, and what a user can get wrong.

mod closed;
mod common;
mod input;
mod jacobian;
mod resolved;
mod screen;
