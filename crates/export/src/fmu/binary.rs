//! The binary for the present machine, made by its C compiler.

use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicU64, Ordering};

use super::Version;
use crate::File;

/// A shared library, and its folder in the archive.
pub(super) struct Binary {
    pub(super) platform: String,
    pub(super) content: Vec<u8>,
}

/// Compiles the sources. The error is the reason in words.
pub(super) fn build(sources: &[File], name: &str, version: Version) -> Result<Binary, String> {
    let (arch, os) = (std::env::consts::ARCH, std::env::consts::OS);
    let platform = platform(version, arch, os).ok_or_else(|| format!("units have no name for {arch} with {os}"))?;
    let compiler = std::env::var("CC").ok().filter(|own| !own.is_empty()).unwrap_or_else(|| "cc".into());
    // No two exports share a folder, not even within one process.
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("coldplate-fmu-{}-{number}", std::process::id()));
    let built = std::fs::create_dir_all(&folder)
        .map_err(|error| format!("no folder to compile in: {error}"))
        .and_then(|()| compile(sources, name, &compiler, &folder));
    // A remainder of the folder does not change the unit.
    let _ = std::fs::remove_dir_all(&folder);
    built.map(|content| Binary { platform, content })
}

fn compile(sources: &[File], name: &str, compiler: &str, folder: &Path) -> Result<Vec<u8>, String> {
    let library = folder.join(format!("{name}{}", std::env::consts::DLL_SUFFIX));
    for file in sources {
        std::fs::write(folder.join(&file.name), &file.content).map_err(|error| format!("{}: {error}", file.name))?;
    }
    let output = Command::new(compiler)
        .current_dir(folder)
        .args(["-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-o"])
        .arg(&library)
        .args(sources.iter().map(|file| &file.name).filter(|name| name.ends_with(".c")))
        .arg("-lm")
        .output()
        .map_err(|error| format!("the C compiler '{compiler}' does not start: {error}"))?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        return Err(format!("the C compiler '{compiler}' fails: {}", text.lines().next().unwrap_or("it says nothing")));
    }
    std::fs::read(&library).map_err(|error| format!("the C compiler '{compiler}' left nothing: {error}"))
}

/// The name of a folder of binaries.
fn platform(version: Version, arch: &str, os: &str) -> Option<String> {
    match (version, arch, os) {
        (Version::Two, "x86_64", "linux") => Some("linux64".into()),
        (Version::Two, "x86", "linux") => Some("linux32".into()),
        (Version::Two, "x86_64" | "aarch64", "macos") => Some("darwin64".into()),
        (Version::Three, "x86_64" | "aarch64" | "x86", "linux") => Some(format!("{arch}-linux")),
        (Version::Three, "x86_64" | "aarch64", "macos") => Some(format!("{arch}-darwin")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compiler_that_is_not_there_is_said() {
        let folder = std::env::temp_dir();
        let reason = compile(&[], "none", "no-such-compiler", &folder).expect_err("there is no such compiler");
        assert!(reason.starts_with("the C compiler 'no-such-compiler' does not start"), "{reason}");
    }
}
