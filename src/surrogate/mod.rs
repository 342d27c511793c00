//! From a table to answers: fits with honest bands, the surrogate file, and verdicts on conditions.

pub mod fit;
pub mod verdict;
