//! Result of a law for the solver: a value with its slope.

/// A value with its derivative with respect to temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// The value, SI.
    pub value: f64,
    /// Derivative with respect to temperature, per kelvin.
    pub slope: f64,
}

impl Slope {
    /// A value that does not depend on the temperature.
    pub fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
}
