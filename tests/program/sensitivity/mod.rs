//! `sensitivity` as a command; derivatives are tested in crates/solve.

mod command;
