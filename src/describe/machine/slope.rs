//! What a law gives to the solver.

/// A value with its derivative with respect to temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// The value, SI.
    pub value: f64,
    /// Its derivative, per kelvin.
    pub slope: f64,
}

impl Slope {
    /// A value that does not follow the temperature.
    pub fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
}
