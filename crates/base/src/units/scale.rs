//! The two scales of absolute temperatures.

/// Offset between the Celsius and the Kelvin scale, K: 0 degC is 273.15 K by definition.
pub const ZERO_CELSIUS: f64 = 273.15;

/// An absolute temperature in kelvin.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Kelvin(pub f64);

/// An absolute temperature in degrees Celsius.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Celsius(pub f64);

impl From<Celsius> for Kelvin {
    fn from(t: Celsius) -> Self {
        Kelvin(t.0 + ZERO_CELSIUS)
    }
}

impl From<Kelvin> for Celsius {
    fn from(t: Kelvin) -> Self {
        Celsius(t.0 - ZERO_CELSIUS)
    }
}
