//! Constants of nature that several laws share.

/// Standard gravity, m/s² (exact by definition).
pub(crate) const GRAVITY: f64 = 9.806_65;
/// Molar gas constant, J/(mol K) (CODATA 2018, exact in its digits).
pub(crate) const GAS_CONSTANT: f64 = 8.314_462_618;
