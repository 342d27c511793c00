//! `query` and `chart` of surrogate files: exit statuses, held variables, streams of conditions. The files are those that the
//! family of this name in crates/surrogate writes and reads.

mod held;
mod mesh;
mod page;
mod query;
mod scene;
mod stream;
mod update;

fn fixture(name: &str) -> std::path::PathBuf {
    coldplate_testing::root().join("crates/runtime/fixtures").join(name)
}
