//! What sensors read, and how that is shown.

use serde::{Deserialize, Serialize};

use super::{Dimension, ZERO_CELSIUS};

/// Micrometres of a metre.
const MICRO: f64 = 1e6;

/// What a sensor reads. Readings are K or um: numbers of one size, so that what is small beside one is small beside the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Measurand {
    /// A temperature.
    #[default]
    Temperature,
    /// A displacement.
    Displacement,
}

impl Measurand {
    /// A reading as it is shown: degC or um.
    pub fn shown(self, reading: f64) -> f64 {
        match self {
            Self::Temperature => reading - ZERO_CELSIUS,
            Self::Displacement => reading,
        }
    }

    /// The reading of a value in SI.
    pub fn of_si(self, si: f64) -> f64 {
        match self {
            Self::Temperature => si,
            Self::Displacement => si * MICRO,
        }
    }

    /// Unit of what is shown.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Temperature => "degC",
            Self::Displacement => "um",
        }
    }

    /// Unit of a difference of readings.
    pub fn unit_of_differences(self) -> &'static str {
        match self {
            Self::Temperature => "K",
            Self::Displacement => "um",
        }
    }

    /// Dimension of what is shown.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Temperature => Dimension::TEMPERATURE,
            Self::Displacement => Dimension::LENGTH,
        }
    }
}
