//! Heat-flow sensors in the network.

/// A heat-flow sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMeter {
    /// Name.
    pub name: String,
    /// Place that the heat goes through.
    pub through: Through,
}

impl HeatMeter {
    /// Whether its heat goes into water.
    pub fn is_of_water(&self) -> bool {
        matches!(self.through, Through::Stream(_))
    }
}

/// Places that the heat of a heat-flow sensor goes through.
#[derive(Debug, Clone, PartialEq)]
pub enum Through {
    /// Joints (indices into the network's), each with the sign its heat counts by.
    Joints(Vec<(u32, f64)>),
    /// A boundary of the machine, out of the machine.
    Boundary(usize),
    /// The wall of a stream, into the water.
    Stream(usize),
}
