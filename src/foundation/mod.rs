//! What every room stands on: files read as a whole, documents that know where each value stands, formulas, tables, files that are
//! whole or absent, random numbers with a lasting seed, numbers as text, vectors, and the progress of long work.

pub mod atomic_file;
pub mod document;
pub mod formula;
pub mod input;
pub mod memory;
pub mod numbers;
pub mod progress;
pub mod random;
pub mod table;
pub mod vector;
pub mod vtu;
