//! The wheel of crates/python: built, installed beside the clients' packages, and put to its own tests.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// The Python that `scripts/clients` installs, where it has pytest.
fn python() -> Option<PathBuf> {
    let cache = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
    let cache = cache.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))?;
    let python = cache.join("coldplate/clients/bin/python3");
    let has = Command::new(&python).args(["-c", "import pytest, numpy"]).output();
    has.is_ok_and(|output| output.status.success()).then_some(python)
}

fn succeeds(command: &mut Command) {
    let output = command.output().unwrap();
    let text = [String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr)].concat();
    println!("{text}");
    assert!(output.status.success(), "{command:?}");
}

#[test]
fn the_wheel_is_built_and_passes_its_tests() {
    let Some(python) = python() else {
        println!("skipped: pytest is not there: scripts/clients installs it");
        return;
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let began = Instant::now();
    let mut build = Command::new(root.join("scripts/wheel"));
    // What cargo tells a test of itself would make the build think that everything has changed.
    for (name, _) in std::env::vars_os().filter(|(name, _)| name.to_string_lossy().starts_with("CARGO_PKG_")) {
        build.env_remove(name);
    }
    succeeds(build.current_dir(root));
    println!("wheel built in {:.0} s", began.elapsed().as_secs_f64());
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python");
    let _ = std::fs::remove_dir_all(&place);
    let wheels = std::fs::read_dir(root.join("target/wheels")).unwrap().map(|f| f.unwrap().path());
    let wheels: Vec<PathBuf> = wheels.filter(|path| path.extension().is_some_and(|e| e == "whl")).collect();
    assert_eq!(wheels.len(), 1, "{wheels:?}");
    let install = ["-m", "pip", "install", "-q", "--disable-pip-version-check", "--no-deps", "--target"];
    succeeds(Command::new(&python).args(install).arg(&place).arg(&wheels[0]));
    let mut tests = Command::new(&python);
    tests.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=5", "crates/python/tests"]);
    tests.env("PYTHONPATH", &place).env("PYTHONDONTWRITEBYTECODE", "1").env("COLDPLATE", env!("CARGO_BIN_EXE_coldplate"));
    succeeds(tests.current_dir(root));
}
