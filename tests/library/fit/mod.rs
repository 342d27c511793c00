//! Fits over designs that grow; the family of this name in crates/surrogate has the others.

mod growing;
