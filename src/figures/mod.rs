//! What one looks at: figures as plain data, drawn in one house style, and HTML reports made of them.

pub mod chart;
pub mod report;
