//! `identify` and `predict` as commands: data as they should not be, the written machine, what a test alone has, a measured board.

mod between;
mod board;
mod command;
mod data;
mod hold_out;
mod kept;
mod loggers;
mod per_test;
mod predict;
mod response;
mod search;

fn scratch(name: &str) -> std::path::PathBuf {
    crate::common::scratch(&format!("identify-{name}"))
}
