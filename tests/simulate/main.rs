//! `coldplate simulate` as its users meet it: schedules, series, checkpoints, and a pipe that was measured.

mod boiling;
mod clock;
mod heat_flow;
mod limits;
mod passes;
mod pipe;
mod resume;
mod schedules;
mod start;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

pub fn coldplate(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_coldplate")).args(args).current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("the program starts")
}

pub fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("simulate-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

pub fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_string()
}

pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}
