//! The machine file: what it says, what is refused, and how the refusal helps.

mod clearance;
mod enclosures;
mod fluids;
mod formulas;
mod groups;
mod laws;
mod machines;
mod overlaps;
mod printed_schema;
mod reading;
mod schema;
mod spheres;
mod uncertain;
