//! The wheel of crates/python: built, installed in an environment of its own, and its program and package put to their tests.

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

/// Standard output of a command that ends with success; both outputs are shown.
fn printed(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    println!("{out}{err}");
    assert!(output.status.success(), "{command:?}");
    out
}

fn succeeds(command: &mut Command) {
    printed(command);
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
    succeeds(Command::new(&python).args(["-m", "venv", "--without-pip"]).arg(&place));
    let own_python = place.join("bin/python3");
    let install = ["-q", "--disable-pip-version-check", "install", "--no-deps"];
    succeeds(Command::new(&python).args(["-m", "pip", "--python"]).arg(&own_python).args(install).arg(&wheels[0]));
    let program = place.join("bin/coldplate");
    assert_eq!(printed(Command::new(&program).arg("--version")).trim(), concat!("coldplate ", env!("CARGO_PKG_VERSION")));
    let mut query = Command::new(&program);
    query.args(["query", "crates/runtime/fixtures/uncertain.cps", "--coolant-flow", "8 L/min"]);
    query.args(["--coolant-temperature", "20 degC", "--ambient-temperature", "21 degC"]);
    assert!(printed(query.current_dir(root)).contains("\nAcceptable: "));
    // numpy and what else the tests ask for stand beside the clients' Python.
    let packages = printed(Command::new(&own_python).args(["-c", "import sysconfig; print(sysconfig.get_path('platlib'))"]));
    let mut tests = Command::new(&python);
    tests.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=5", "crates/python/tests"]);
    tests.env("PYTHONPATH", packages.trim()).env("PYTHONDONTWRITEBYTECODE", "1").env("COLDPLATE", &program);
    succeeds(tests.current_dir(root));
}
