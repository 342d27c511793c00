//! The library as C programs meet it: its answers, its header, and where it is installed.

mod called;
mod header;
mod installed;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn own() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The static library, beside this test or above it.
fn library() -> PathBuf {
    let test = std::env::current_exe().expect("a test knows where it is");
    let found = test.ancestors().skip(1).take(2).map(|folder| folder.join("libcoldplate_capi.a")).find(|path| path.exists());
    found.expect("the static library is built with the tests")
}

fn is_there(program: &str) -> bool {
    let there = Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success());
    if !there {
        // A closed standard error is no reason to fail.
        let _ = writeln!(std::io::stderr(), "skipped: {program} is not on this machine");
    }
    there
}

fn run(command: &mut Command) -> Output {
    command.output().expect("the program starts")
}
