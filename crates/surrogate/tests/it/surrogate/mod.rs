//! Surrogate files: written, read, evaluated, judged, inverted, and refused when damaged.

mod damage;
mod examples;
mod format;
mod held;
mod in_time;
mod indices;
mod inverse;
mod optimum;
mod query;
mod stream;
mod uncertain;
mod values;
mod verdict;
