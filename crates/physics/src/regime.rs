//! Laminar, turbulent, or between: the flow in a round channel by its Reynolds number.

/// Reynolds number (dimensionless) up to which the flow is laminar; from [`crate::channel::nusselt`]'s source,
/// Gnielinski (2013).
pub const LAMINAR_LIMIT: f64 = 2300.0;
/// Reynolds number (dimensionless) from which on the flow is turbulent; from Gnielinski (2013) too.
pub const TURBULENT_LIMIT: f64 = 4000.0;

/// Kind of flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Regime {
    /// Reynolds number up to 2300.
    Laminar,
    /// Reynolds number between 2300 and 4000.
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
