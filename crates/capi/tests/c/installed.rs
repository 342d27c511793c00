//! The library where `scripts/install-c` puts it, as pkg-config and CMake find it.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{is_there, library, own, run};

const FIXTURE: &str = "../runtime/fixtures/uncertain.cps";

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("coldplate-install-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

/// Installs under a prefix and moves it: nothing in it may name the place.
fn installed(folder: &Path) -> PathBuf {
    let (made, prefix) = (folder.join("made"), folder.join("moved here"));
    let libraries = library();
    let script = own().join("../../scripts/install-c");
    let done = run(Command::new(script).arg(&made).arg(libraries.parent().expect("a folder")));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    std::fs::rename(&made, &prefix).expect("it can be moved");
    prefix
}

fn answers(program: &Path, prefix: &Path) {
    let output = run(Command::new(program).arg(own().join(FIXTURE)).env("LD_LIBRARY_PATH", prefix.join("lib")));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.lines().count() > 3, "{said}{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn pkg_config_finds_it() {
    if !is_there("pkg-config") || !is_there("gcc") {
        return;
    }
    let folder = folder("pkg-config");
    let prefix = installed(&folder);
    let flags = |more: &[&str]| {
        let asked = run(Command::new("pkg-config").args(more).arg("coldplate").env("PKG_CONFIG_PATH", prefix.join("lib/pkgconfig")));
        assert!(asked.status.success(), "{}", String::from_utf8_lossy(&asked.stderr));
        String::from_utf8_lossy(&asked.stdout).trim().to_string()
    };
    assert_eq!(flags(&["--modversion"]), env!("CARGO_PKG_VERSION"));
    for (how, options) in [("shared", &["--cflags", "--libs"][..]), ("static", &["--cflags", "--libs", "--static"])] {
        let program = folder.join(how);
        // A shell takes apart what pkg-config quotes.
        let line = format!(
            "gcc -std=c99 '{}' {} {} -o '{}'",
            own().join("examples/query.c").display(),
            flags(options),
            if how == "static" { "-l:libcoldplate_capi.a" } else { "" },
            program.display()
        );
        let made = run(Command::new("sh").args(["-c", &line]));
        assert!(made.status.success(), "{line}: {}", String::from_utf8_lossy(&made.stderr));
        answers(&program, &prefix);
    }
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn cmake_finds_it() {
    if !is_there("cmake") || !is_there("gcc") {
        return;
    }
    let folder = folder("cmake");
    let prefix = installed(&folder);
    let project = |asked: &str| {
        format!(
            "cmake_minimum_required(VERSION 3.13)\nproject(query C)\nfind_package(coldplate {asked} REQUIRED)\n\
             add_executable(shared \"{0}\")\ntarget_link_libraries(shared coldplate::coldplate)\n\
             add_executable(static \"{0}\")\ntarget_link_libraries(static coldplate::static)\n",
            own().join("examples/query.c").display()
        )
    };
    let configure = |asked: &str| {
        std::fs::write(folder.join("CMakeLists.txt"), project(asked)).expect("it can be written");
        let build = folder.join(format!("build-{asked}"));
        let told = run(Command::new("cmake")
            .arg("-S")
            .arg(&folder)
            .arg("-B")
            .arg(&build)
            .arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display())));
        (told, build)
    };
    let series = env!("CARGO_PKG_VERSION").rsplit_once('.').expect("three numbers").0;
    let (told, build) = configure(series);
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    let made = run(Command::new("cmake").arg("--build").arg(&build));
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    for how in ["shared", "static"] {
        answers(&build.join(how), &prefix);
    }
    let (told, _) = configure("99.0");
    assert!(!told.status.success(), "version 99 was found");
    let _ = std::fs::remove_dir_all(&folder);
}
