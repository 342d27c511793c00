//! The program as a user starts it, in the folder of the project, and what it answers.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

pub use coldplate_testing::{root, write};

pub fn coldplate(args: &[&str]) -> Output {
    coldplate_in(root(), args)
}

/// A run in a folder of its own.
pub fn coldplate_in(folder: &Path, args: &[impl AsRef<OsStr>]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_coldplate")).args(args).current_dir(folder).output().expect("the program starts")
}

/// Copies a folder with its folders.
pub fn copy_all(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_all(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// What was printed, of a run that succeeded.
pub fn json(output: &Output) -> Value {
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", message(output));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// An empty folder of a test.
pub fn scratch(name: &str) -> PathBuf {
    coldplate_testing::scratch(env!("CARGO_TARGET_TMPDIR"), name)
}

/// The folder in which `scripts/clients` installs programs.
pub fn cache() -> Option<PathBuf> {
    let cache = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
    cache.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))
}

/// The Python that `scripts/clients` installs, where it has these modules.
pub fn python(modules: &str) -> Option<PathBuf> {
    let python = cache()?.join("coldplate/clients/bin/python3");
    let has = Command::new(&python).arg("-c").arg(format!("import {modules}")).output();
    has.is_ok_and(|output| output.status.success()).then_some(python)
}
