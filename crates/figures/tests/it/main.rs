//! Tests of this crate from outside, in one binary; tests/README.md of the project has a table of all families.

mod chart;
