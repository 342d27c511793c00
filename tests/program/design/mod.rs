//! Sweeps that go on until they are accurate enough; sweep files and designs are tested in crates/explore.

mod adaptive;
