//! Exact solutions: each test writes a machine file for a case with a known answer, solves it on one
//! or several meshes and compares at the case's own tolerance.
//!
//! `V..` is the number of the reference case; inputs and reference values stand in the test. A case in
//! other units is carried over to SI with the factors stated there. `cargo test --release -p coldplate-solve --test it
//! exact:: -- --nocapture` prints the table of docs/record/verification.md.

mod cells;
mod channel;
mod circuits;
mod convection;
mod cylinder;
mod displacement;
mod enclosure;
mod heat_flow;
mod joint;
mod kirchhoff;
mod mesh_error;
mod outlet;
mod plane;
mod radiation;
mod sight;
mod slab;
mod source;
mod sphere;
mod surface;
