//! Sensors, the limits on them, and their measured readings.

use super::parts::Face;
use super::response::SensorResponse;
use coldplate_base::terms::LimitKind;
use coldplate_base::units::Measurand;

/// A measurement point.
#[derive(Debug, Clone)]
pub struct Sensor {
    /// Name.
    pub name: String,
    /// Quantity that the sensor reads.
    pub reads: SensorReading,
    /// Response of the sensor to the value at its place.
    pub shows: SensorResponse,
}

/// Quantity that a sensor reads, and its place.
#[derive(Debug, Clone, PartialEq)]
pub enum SensorReading {
    /// Temperature at a point (m) of a part.
    Point(usize, [f64; 3]),
    /// Area mean over a face.
    FaceMean(Face),
    /// Volume mean over a part.
    PartMean(usize),
    /// Temperature of a lumped node.
    Node(usize),
    /// Temperature of the coolant entering a channel.
    Inlet(usize),
    /// Temperature of the coolant leaving a channel.
    Outlet(usize),
    /// Displacement of a point.
    Displacement(Displacement),
}

impl Sensor {
    /// The quantity that the sensor reads.
    pub fn measurand(&self) -> Measurand {
        if self.reads.is_displacement() { Measurand::Displacement } else { Measurand::Temperature }
    }
}

impl SensorReading {
    /// Whether the reading is a displacement, not a temperature.
    pub fn is_displacement(&self) -> bool {
        matches!(self, Self::Displacement(_))
    }
}

/// The displacement of a point along a direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Displacement {
    /// The point: its part and where it is, m.
    pub of: (usize, [f64; 3]),
    /// The reference point; `None` means the supports.
    pub relative_to: Option<(usize, [f64; 3])>,
    /// Unit vector of the positive direction.
    pub direction: [f64; 3],
    /// Line in the machine file.
    pub line: usize,
}

/// A limit on sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineLimit {
    /// Name.
    pub name: String,
    /// The limited quantity, by indices into [`Machine::sensors`](super::Machine::sensors) (its points) and
    /// [`Machine::variables`](super::Machine::variables).
    pub kind: LimitKind<Vec<usize>>,
    /// Largest value allowed: K for maxima (absolute), K for differences.
    pub maximum: f64,
}

/// One measured state of the machine, to be printed beside the prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Name, for example `working condition 1`.
    pub name: String,
    /// The condition of the measurement: (index into [`Machine::variables`](super::Machine::variables), SI value).
    pub condition: Vec<(usize, f64)>,
    /// Readings: (index into [`Machine::sensors`](super::Machine::sensors), K).
    pub readings: Vec<(usize, f64)>,
    /// Predictions of other programs, if known: (sensor, K).
    pub others: Vec<(usize, f64)>,
    /// Half the width of the 95 % interval of a reading, K, if stated.
    pub uncertainty: Option<f64>,
    /// Remarks on the readings.
    pub note: String,
}
