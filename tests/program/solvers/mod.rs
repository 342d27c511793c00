//! Sweeps that another program solves: the shipped examples, every way in which a run can fail, limits, the cache, and what is left
//! after a kill.

mod calculix;
mod examples;
mod failures;
mod limits;
mod parts;
mod refused;
mod slurm;
mod stopped;
mod vtu;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use crate::common::root;

/// An empty folder of this test.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("solvers-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The program, to be run in `folder`.
fn coldplate(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_coldplate"));
    command.args(arguments).current_dir(folder);
    command
}

fn output(folder: &Path, arguments: &[&str]) -> Output {
    coldplate(folder, arguments).output().unwrap()
}

fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// What a command that ends well prints as JSON.
fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = output(folder, &[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{arguments:?}: {}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A sweep of `runs` values of `x` from 0 to 1 kW, which the shell script `solve.sh` solves: it finds `x` (in W) in `x.txt`, and the
/// temperature `t` is read from a line `t = NUMBER` of what it prints. Every run adds a line to `runs.log` beside the sweep file.
fn shell(folder: &Path, runs: usize, solver: &str, script: &str) {
    let sweep = format!(
        "name = 'shell'\n[solver]\ncommand = ['sh', 'solve.sh']\ntemplates = ['x.txt.template']\nfiles = ['solve.sh']\n{solver}\n\
         [point.t]\nunit = 'degC'\npattern = '^t = (\\S+)'\nrecover = '-1 degC'\n[variables]\nx = {{ unit = 'W' }}\n[range]\nx = ['0 W', '1000 W']\n\
         [levels]\n[design]\nkind = 'factorial'\npoints = {runs}\n"
    );
    std::fs::write(folder.join("sweep.toml"), sweep.replace("[levels]\n", "")).unwrap();
    std::fs::write(folder.join("x.txt.template"), "{{x:W}}\n").unwrap();
    let log = folder.join("runs.log");
    std::fs::write(folder.join("solve.sh"), format!("x=$(cat x.txt)\necho \"$x\" >> '{}'\n{script}\n", log.display())).unwrap();
}

/// The runs of [`shell`] so far, by their `x`.
fn runs(folder: &Path) -> Vec<String> {
    std::fs::read_to_string(folder.join("runs.log")).unwrap_or_default().lines().map(String::from).collect()
}

/// Tables and failures of a sweep, by name.
fn tables(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    let named = entries.map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&path).unwrap()));
    let mut files: Vec<_> = named.filter(|(name, _)| name.ends_with(".csv") || name.ends_with(".parquet")).collect();
    files.sort();
    files
}
