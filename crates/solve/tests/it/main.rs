//! Tests of this crate from outside, in one binary; tests/README.md of the project has a table of all families.

mod bench;
mod control;
mod exact;
mod invariant;
mod order;
mod sensitivity;
mod tetra;
mod transient;
