//! Designs against published sequences, exhaustive optima and another program; sweep files into conditions.

mod files;
mod growing;
mod points;
