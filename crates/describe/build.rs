//! Hashes the sources of this crate into `SOURCES`.

fn main() {
    coldplate_source_hash::emit();
}
