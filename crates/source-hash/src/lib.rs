//! Hash of the sources of a crate, for its build script, so that results of another build are not taken for this one's.
//!
//! Each crate between the machine file and a solved temperature has a build script that calls [`emit`], and a constant
//! `SOURCES` with the hash. `coldplate_explore::numerics` puts the hashes of all these crates together.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use std::path::{Path, PathBuf};

/// Sets `COLDPLATE_SOURCES` for the crate whose build script calls this: the hash of its `src` and `data` folders and of the
/// lock file, 16 hexadecimal digits.
pub fn emit() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    for folder in ["src", "data"].map(|name| root.join(name)).iter().filter(|folder| folder.is_dir()) {
        println!("cargo::rerun-if-changed={}", folder.display());
        add(folder, &mut hash);
    }
    // In the workspace the lock file lies above the crate, in a package beside its manifest. A package without one has none to hash.
    if let Some(lock) = root.ancestors().map(|folder| folder.join("Cargo.lock")).find(|file| file.is_file()) {
        println!("cargo::rerun-if-changed={}", lock.display());
        add(&lock, &mut hash);
    }
    println!("cargo::rustc-env=COLDPLATE_SOURCES={:016x}", hash.0);
}

/// Hash of 64 bits by Fowler, Noll and Vo (FNV-1a). It is equal on every machine and no protection against malice.
struct Fnv(u64);

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// Adds a file, or every file below a folder in the order of their names. Comment lines decide nothing.
fn add(path: &Path, hash: &mut Fnv) {
    if path.is_dir() {
        let mut entries: Vec<PathBuf> = std::fs::read_dir(path).into_iter().flatten().flatten().map(|e| e.path()).collect();
        entries.sort();
        entries.iter().for_each(|entry| add(entry, hash));
        return;
    }
    let text = std::fs::read_to_string(path).unwrap_or_default();
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")) {
        hash.add(line.as_bytes());
        hash.add(b"\n");
    }
}
