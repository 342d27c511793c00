//! Measured runs as tables that `coldplate` reads. The measurements are not part of the project.

pub mod hot_water_pipe;
pub mod two_heaters;
