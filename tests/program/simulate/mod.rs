//! `coldplate simulate` as its users meet it: schedules, series, checkpoints, and a pipe that was measured.

mod boiling;
mod clock;
mod closed;
mod controllers;
mod heat_flow;
mod limits;
mod passes;
mod pipe;
mod pulses;
mod resume;
mod schedules;
mod start;

use std::path::PathBuf;

use serde_json::Value;

pub use crate::common::{coldplate, json, write};

pub fn scratch(name: &str) -> PathBuf {
    crate::common::scratch(&format!("simulate-{name}"))
}

pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}
