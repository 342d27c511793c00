//! Lengths of the slices that a caller hands over.

use core::fmt;

/// A slice does not have the length the surrogate asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShapeError {
    /// Name of the wrong argument.
    pub argument: &'static str,
    /// The length it must have, or the number it must stay under.
    pub expected: usize,
    /// The length or index that was given.
    pub found: usize,
}

impl fmt::Display for ShapeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}, found {}", self.argument, self.expected, self.found)
    }
}

impl core::error::Error for ShapeError {}

pub(crate) fn check(argument: &'static str, expected: usize, found: usize) -> Result<(), ShapeError> {
    if expected == found { Ok(()) } else { Err(ShapeError { argument, expected, found }) }
}
