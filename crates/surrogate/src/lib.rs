//! From a table to answers: fits with honest bands, the surrogate file, and verdicts on conditions.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod fit;
pub mod verdict;
