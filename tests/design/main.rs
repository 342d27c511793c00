//! Designs against published sequences, exhaustive optima and another program; sweep files into conditions.

mod adaptive;
mod files;
mod points;
