//! What every room stands on: documents that know where each value stands, formulas, tables, files that are
//! whole or absent, and random numbers with a lasting seed.

pub mod atomic_file;
pub mod document;
pub mod formula;
pub mod random;
pub mod table;
