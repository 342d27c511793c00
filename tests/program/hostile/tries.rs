//! Runs `tries/*.toml`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use serde::Deserialize;

use crate::common::copy_all;

/// The longest that a try may take; most take milliseconds.
const PATIENCE: Duration = Duration::from_secs(30);
/// The longest message that a person reads.
const LONGEST_MESSAGE: usize = 4000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tries {
    #[serde(rename = "try")]
    tries: Vec<Try>,
}

/// One hostile try.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Try {
    /// What is wrong.
    name: String,
    /// Arguments of the program.
    run: Vec<String>,
    /// Changes of the good files: each names a file, a text that stands in it once, and what replaces it.
    #[serde(default)]
    edit: Vec<Edit>,
    /// Files to write: name and content.
    #[serde(default)]
    file: BTreeMap<String, String>,
    /// Exit status.
    status: i32,
    /// Words that standard error holds.
    #[serde(default)]
    says: Vec<String>,
    /// Words that standard output holds.
    #[serde(default)]
    prints: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Edit {
    file: String,
    from: String,
    to: String,
}

/// A folder with the good files: the tutorial's machine, readings and sweep, and what the sweep gave.
fn good() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("hostile-good");
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let tutorial = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tutorial");
        for name in ["machine.toml", "readings.csv", "readings.toml", "sweep.toml", "warm_up.csv"] {
            std::fs::copy(tutorial.join(name), folder.join(name)).unwrap();
        }
        for args in [["sweep", "sweep.toml", "--out", "swept", "--quiet"], ["fit", "swept/sweep.csv", "--out", "surrogate.cps", "--quiet"]]
        {
            let output = Command::new(env!("CARGO_BIN_EXE_coldplate")).args(args).current_dir(&folder).output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
        folder
    })
}

/// Files and folders below `folder`, by name.
fn listing(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// What is wrong with the program's answer to a try; `None` if nothing is.
fn fault(hostile: &Try, folder: &Path) -> Option<String> {
    let _ = std::fs::remove_dir_all(folder);
    copy_all(good(), folder);
    for edit in &hostile.edit {
        let path = folder.join(&edit.file);
        let text = std::fs::read_to_string(&path).unwrap();
        if text.matches(&edit.from).count() != 1 {
            return Some(format!("'{}' should stand in {} once", edit.from, edit.file));
        }
        std::fs::write(&path, text.replace(&edit.from, &edit.to)).unwrap();
    }
    for (name, content) in &hostile.file {
        std::fs::write(folder.join(name), content).unwrap();
    }
    let before = listing(folder);

    let started = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_coldplate"))
        .args(&hostile.run)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(std::fs::File::create(folder.join("stdout.txt")).unwrap())
        .stderr(std::fs::File::create(folder.join("stderr.txt")).unwrap())
        .spawn()
        .unwrap();
    let ended = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if started.elapsed() > PATIENCE => {
                child.kill().unwrap();
                child.wait().unwrap();
                return Some(format!("it had not ended after {PATIENCE:?}"));
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    let read = |name: &str| String::from_utf8_lossy(&std::fs::read(folder.join(name)).unwrap()).into_owned();
    let (out, message) = (read("stdout.txt"), read("stderr.txt"));
    if ended.code() != Some(hostile.status) {
        return Some(format!("it ended with {ended}, not with status {}: {message}{out}", hostile.status));
    }
    if message.contains("panicked") {
        return Some(format!("it panicked: {message}"));
    }
    if message.len() > LONGEST_MESSAGE {
        return Some(format!("its message has {} bytes", message.len()));
    }
    if let Some(missing) = hostile.says.iter().find(|words| !message.contains(words.as_str())) {
        return Some(format!("it does not say '{missing}': {message}"));
    }
    if let Some(missing) = hostile.prints.iter().find(|words| !out.contains(words.as_str())) {
        return Some(format!("it does not print '{missing}': {out}"));
    }
    if hostile.status == 2 {
        let after: Vec<String> = listing(folder).into_iter().filter(|n| n != "stdout.txt" && n != "stderr.txt").collect();
        if after != before {
            return Some(format!("refused, yet it left files: {before:?} became {after:?}"));
        }
        if !out.is_empty() {
            return Some(format!("refused, yet it printed: {out}"));
        }
    }
    None
}

fn run_all(kind: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/hostile/tries").join(format!("{kind}.toml"));
    let all: Tries = toml::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert!(!all.tries.is_empty());
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("hostile-{kind}"));
    let faults: Vec<String> = all
        .tries
        .iter()
        .enumerate()
        .filter_map(|(number, hostile)| fault(hostile, &folder.join(number.to_string())).map(|fault| format!("{}: {fault}", hostile.name)))
        .collect();
    assert!(faults.is_empty(), "{} of {} tries:\n\n{}", faults.len(), all.tries.len(), faults.join("\n\n"));
}

macro_rules! kinds {
    ($($kind:ident)*) => {
        $(#[test]
        fn $kind() {
            run_all(stringify!($kind));
        })*

        #[test]
        fn no_file_of_tries_is_forgotten() {
            let named = [$(concat!(stringify!($kind), ".toml")),*, "README.md"];
            for file in listing(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/hostile/tries")) {
                assert!(named.contains(&file.as_str()), "{file}");
            }
        }
    };
}

kinds! { arguments displacements files imports machines sweeps tables }
