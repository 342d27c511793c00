//! Surrogate files: written, read, evaluated, judged, inverted, and refused when damaged.

mod damage;
mod examples;
mod format;
mod inverse;
mod query;
mod values;
mod verdict;
