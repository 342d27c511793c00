//! Hostile tries: what a hurried, mistaken or malicious user gives the program, and what it must answer.
//!
//! `tries/*.toml` hold them, a file per kind of input; `tries/README.md` says how to add one. Each runs the program
//! in a folder of its own, beside a good machine, its readings, a sweep and a surrogate.

mod mutations;
mod tries;
