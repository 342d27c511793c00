//! Hashes the sources that decide a solved temperature, so that results of another build are not taken for this one's.

use std::path::{Path, PathBuf};

/// Rooms from the machine file to the temperatures, and the versions of the libraries.
const SOURCES: [&str; 7] = ["Cargo.lock", "src/describe", "src/discretise", "src/explore", "src/foundation", "src/physics", "src/solve"];

fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        add(&root.join(source), &mut hash);
    }
    println!("cargo::rustc-env=COLDPLATE_NUMERICS={:016x}", hash.0);
}

/// The 64-bit hash of Fowler, Noll and Vo (FNV-1a): not against malice, the same on every machine.
struct Fnv(u64);

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// Adds a file, or every file below a folder in the order of their names. Lines of comment decide nothing.
fn add(path: &Path, hash: &mut Fnv) {
    if path.is_dir() {
        let mut entries: Vec<PathBuf> = std::fs::read_dir(path).into_iter().flatten().flatten().map(|e| e.path()).collect();
        entries.sort();
        entries.iter().for_each(|entry| add(entry, hash));
        return;
    }
    // A package without its lock file has none to hash.
    let text = std::fs::read_to_string(path).unwrap_or_default();
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")) {
        hash.add(line.as_bytes());
        hash.add(b"\n");
    }
}
