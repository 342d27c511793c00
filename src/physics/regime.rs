//! Laminar, turbulent, or between: the flow in a round channel by its Reynolds number.

/// Below this Reynolds number the flow is laminar.
pub const LAMINAR_LIMIT: f64 = 2300.0;
/// Above this Reynolds number the flow is turbulent.
pub const TURBULENT_LIMIT: f64 = 4000.0;

/// Kind of flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Regime {
    /// Reynolds number up to 2300.
    Laminar,
    /// Between.
    Transition,
    /// Reynolds number of 4000 and above.
    Turbulent,
}

impl Regime {
    /// The regime at a Reynolds number.
    pub fn at(reynolds: f64) -> Self {
        if reynolds <= LAMINAR_LIMIT {
            Self::Laminar
        } else if reynolds < TURBULENT_LIMIT {
            Self::Transition
        } else {
            Self::Turbulent
        }
    }

    /// `laminar`, `transition` or `turbulent`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Laminar => "laminar",
            Self::Transition => "transition",
            Self::Turbulent => "turbulent",
        }
    }
}
