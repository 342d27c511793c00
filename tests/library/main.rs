//! Families that cross crates and need no program; tests/README.md has a table of all families.

mod fit;
mod machine_file;
mod machines;
mod reduce;
mod uncertainty;
mod validation;
