//! Quantities that sensors read, and how readings are shown.

use serde::{Deserialize, Serialize};

use super::{Dimension, ZERO_CELSIUS};

/// Micrometres per metre.
const MICRO: f64 = 1e6;

/// The quantity that a sensor reads. Readings are in K or um: numbers of similar size, so that one tolerance fits both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Measurand {
    /// A temperature.
    #[default]
    Temperature,
    /// A displacement.
    Displacement,
}

impl Measurand {
    /// A reading in its displayed unit: degC or um.
    pub fn shown(self, reading: f64) -> f64 {
        match self {
            Self::Temperature => reading - ZERO_CELSIUS,
            Self::Displacement => reading,
        }
    }

    /// The reading (K or um) for a value in SI.
    pub fn of_si(self, si: f64) -> f64 {
        match self {
            Self::Temperature => si,
            Self::Displacement => si * MICRO,
        }
    }

    /// Unit of displayed readings.
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

    /// Dimension of displayed readings.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Temperature => Dimension::TEMPERATURE,
            Self::Displacement => Dimension::LENGTH,
        }
    }
}
