//! What sensors read, and how that is shown.

use serde::{Deserialize, Serialize};

use super::{Dimension, ZERO_CELSIUS};

/// Micrometres of a metre.
const MICRO: f64 = 1e6;

/// What a sensor reads: K or m inside, degC or um where people and other programs see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Measurand {
    /// A temperature.
    #[default]
    Temperature,
    /// A displacement.
    Displacement,
}

impl Measurand {
    /// A value (SI) as it is shown.
    pub fn shown(self, si: f64) -> f64 {
        match self {
            Self::Temperature => si - ZERO_CELSIUS,
            Self::Displacement => si * MICRO,
        }
    }

    /// A difference of two values (SI) as it is shown.
    pub fn difference(self, si: f64) -> f64 {
        match self {
            Self::Temperature => si,
            Self::Displacement => si * MICRO,
        }
    }

    /// A difference as it is shown, in SI.
    pub fn difference_si(self, shown: f64) -> f64 {
        match self {
            Self::Temperature => shown,
            Self::Displacement => shown / MICRO,
        }
    }

    /// Unit of a value.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Temperature => "degC",
            Self::Displacement => "um",
        }
    }

    /// Unit of a difference.
    pub fn unit_of_differences(self) -> &'static str {
        match self {
            Self::Temperature => "K",
            Self::Displacement => "um",
        }
    }

    /// Dimension of a value.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Temperature => Dimension::TEMPERATURE,
            Self::Displacement => Dimension::LENGTH,
        }
    }
}
