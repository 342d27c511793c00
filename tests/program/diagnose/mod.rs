//! `diagnose` as a command: what it prints and writes, what it refuses, faults, causes in time, and two measured set-ups.

mod amplitudes;
mod board;
mod command;
mod faults;
mod over_time;
mod pipe;
mod refused;
mod rigs;
mod stated;

fn scratch(name: &str) -> std::path::PathBuf {
    crate::common::scratch(&format!("diagnose-{name}"))
}
