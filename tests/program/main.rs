//! Families that run the program; tests/README.md has a table of all families.

mod cases;
mod chart;
mod cli;
mod common;
mod design;
mod diagnose;
mod displacement;
mod docs;
mod hostile;
mod identify;
mod sensitivity;
mod serve;
mod simulate;
mod solvers;
mod surrogate;
mod uncertainty;
