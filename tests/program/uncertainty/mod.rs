//! Bands beside readings of machines that were identified by the program; the family of this name in tests/library has the others.

mod measured;
