//! Figures as plain data, drawn in one house style, and HTML reports made of them.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod chart;
pub mod report;
