//! The narrow waist: nodes, conductors, streams, surfaces, sources and sensors.
//!
//! Every model compiles to a [`Network`]: resolved cells, hand-written lumped nodes and water all
//! become *nodes*; conduction and contact become *joints* and linear conductors (GL), coolant becomes
//! one-way *streams* (GF), radiation between nodes becomes radiative conductors (GR), and each open
//! face becomes a *surface*, an arithmetic node eliminated where it stands. The network holds no
//! condition; a [`Load`] does. The solver sees these two and nothing else.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

pub mod block;
mod build;
mod control;
mod coolant;
mod corners;
mod crossing;
pub mod elastic;
mod enclosure;
mod load;
pub mod mesh;
mod meter;
pub mod slopes;
mod split;
pub mod stream;
pub mod surface;

pub use block::Block;
pub use control::ControlLoop;
pub use corners::{Corner, Corners};
pub use crossing::{Crossing, JointState};
pub use enclosure::EnclosureViews;
pub use load::{BoundaryState, ContactFactors, Load};
pub use meter::{HeatMeter, Through};
pub use split::{GivenBranch, GivenFlow};
pub use stream::{Stream, StreamState};
pub use surface::{BoundaryArea, FREE, FaceNode, Laws, Surface};

use serde::{Deserialize, Serialize};

use coldplate_base::units::Measurand;
use coldplate_describe::machine::{ConstantPower, ContactLaw, Property, Side, Slope, SourceLaw};

/// Hash of the sources of this crate and of the lock file it was built with.
pub const SOURCES: &str = env!("COLDPLATE_SOURCES");

/// Marks "no such index".
pub const NONE: u32 = u32::MAX;

/// A thermal network, valid for every condition of one machine on one mesh.
#[derive(Debug, Clone, Default)]
pub struct Network {
    /// Nodes of solid: cells, then lumped nodes, then arithmetic nodes of links. Water nodes follow.
    pub solids: usize,
    /// Nodes in total.
    pub nodes: usize,
    /// Heat capacity of each solid node at 300 K, J/K (0 for arithmetic nodes).
    pub capacity: Vec<f64>,
    /// Specific heat of each group over its value at 300 K: how the capacity of its nodes changes with temperature.
    pub relative_capacity: Vec<Property>,
    /// Group of each solid node: a part, a lumped node, or [`NONE`]; see [`Network::groups`].
    pub group: Vec<u32>,
    /// Names of the groups: first the parts, then the lumped nodes.
    pub groups: Vec<String>,
    /// Linear conductors (GL) inside structured blocks.
    pub blocks: Vec<Block>,
    /// All other linear conductors: contacts, bonds between blocks, edges of imported meshes.
    pub joints: Vec<Joint>,
    /// Temperatures beside the middle of a cell.
    pub reaches: Vec<EndInterpolation>,
    /// Contacts the joints belong to.
    pub contacts: Vec<ContactGroup>,
    /// Conductivities the joints and surfaces refer to, W/(m K).
    pub properties: Vec<Property>,
    /// Open faces.
    pub surfaces: Vec<Surface>,
    /// The cell faces that surfaces are on; those of lumped nodes and of imported meshes are not among them.
    pub open: Vec<OpenFace>,
    /// Joints that cross each interface of the mesh.
    pub crossed: Vec<Crossed>,
    /// Area that each boundary of the machine acts on.
    pub acting: Vec<BoundaryArea>,
    /// Nodes of open faces that sensors read.
    pub faces: Vec<FaceNode>,
    /// Radiative conductors (GR) between nodes: two nodes and eps F A, m².
    pub radiative: Vec<(u32, u32, f64)>,
    /// Coolant channels.
    pub streams: Vec<Stream>,
    /// Coolant circuits, by which streams are fed.
    pub circuits: Vec<stream::CircuitTree>,
    /// Heat sources, in the machine's order.
    pub sources: Vec<HeatSource>,
    /// Nodes held at a temperature: node and index into [`Load::fixed`]. Lumped nodes, and vertices of imported
    /// meshes on faces whose temperature is given.
    pub fixed: Vec<(u32, u32)>,
    /// Node held at the temperature of the chamber wall, which enclosures radiate to; one of the fixed.
    pub chamber: Option<u32>,
    /// View factors of each enclosure.
    pub enclosures: Vec<EnclosureViews>,
    /// Controllers, in the machine's order.
    pub loops: Vec<ControlLoop>,
    /// Sensors: weights over nodes.
    pub sensors: Vec<SensorTerm>,
    /// Names of the sensors.
    pub sensor_names: Vec<String>,
    /// Quantity that each sensor reads.
    pub measurands: Vec<Measurand>,
    /// Heat-flow sensors.
    pub meters: Vec<HeatMeter>,
}

/// The cell face, or the part of one, that a surface is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpenFace {
    /// Index into [`Network::surfaces`].
    pub surface: usize,
    /// The cell.
    pub cell: usize,
    /// Side of the cell.
    pub side: Side,
}

/// The joints of one interface, one for each pair of cells in the order of its overlaps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Crossed {
    /// Index into the interfaces of the mesh.
    pub interface: usize,
    /// The joints.
    pub joints: std::ops::Range<usize>,
}

/// A conductor whose conductance may depend on temperature: two half cells and the interface between.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// First node.
    pub a: u32,
    /// Second node.
    pub b: u32,
    /// Area, m²; negative where linear shape functions make it so (obtuse edges of imported meshes).
    pub area: f64,
    /// Conduction length from the first node to the interface, m (0 for a lumped node).
    pub length_a: f64,
    /// Conduction length from the second node, m.
    pub length_b: f64,
    /// Conductivity of the first side: index into [`Network::properties`].
    pub property_a: u32,
    /// Conductivity of the second side.
    pub property_b: u32,
    /// Contact it belongs to, or [`NONE`] where nothing resists between the halves.
    pub contact: u32,
    /// Interpolation to the temperature of each end, where it is not its node's: indices into [`Network::reaches`], or [`NONE`].
    pub reach: [u32; 2],
}

/// The temperature beside the middle of a cell, where cells that do not match meet: the cell's own, and a share
/// of the way to a neighbour along each of two tangential axes. Second order for any smooth temperature.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EndInterpolation {
    /// A neighbour along each axis (the node itself where the point is level with it).
    pub nodes: [u32; 2],
    /// Share of the way to each, at most 1/2; negative at the edge of a face, where the point lies away from the
    /// only neighbour.
    pub shares: [f64; 2],
}

/// Distribution of a source's power over nodes, and its dependence on their temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatSource {
    /// Nodes and shares, which sum to one.
    pub shares: Vec<(u32, f64)>,
    /// How each share follows its own node's temperature.
    pub law: SourceLaw,
}

impl HeatSource {
    /// A source of the same power at every temperature.
    pub fn constant(shares: Vec<(u32, f64)>) -> Self {
        Self { shares, law: SourceLaw::Constant(ConstantPower) }
    }

    /// Heat into each node (W) at a stated power (W) and temperatures of all nodes (K).
    pub fn heats<'a>(&'a self, power: f64, temperatures: &'a [f64]) -> impl Iterator<Item = (u32, f64)> + 'a {
        self.at(power, temperatures).map(|(node, heat)| (node, heat.value))
    }

    /// Heat of the source into all nodes, W.
    pub fn total(&self, power: f64, temperatures: &[f64]) -> f64 {
        if self.law.follows_temperature() { self.heats(power, temperatures).map(|(_, heat)| heat).sum() } else { power }
    }

    /// Change of the heat into each node with its temperature, W/K.
    pub fn slopes<'a>(&'a self, power: f64, temperatures: &'a [f64]) -> impl Iterator<Item = (u32, f64)> + 'a {
        self.at(power, temperatures).map(|(node, heat)| (node, heat.slope))
    }

    fn at<'a>(&'a self, power: f64, temperatures: &'a [f64]) -> impl Iterator<Item = (u32, Slope)> + 'a {
        self.shares.iter().map(move |(node, share)| (*node, self.law.power(power * share, temperatures[*node as usize])))
    }
}

/// A contact with its law and its joints.
#[derive(Debug, Clone)]
pub struct ContactGroup {
    /// Index into the contacts of the machine; `None` for parts that touch and that no contact names. The two halves of a link between
    /// places that do not touch share one index.
    pub of: Option<usize>,
    /// Name.
    pub name: String,
    /// Law.
    pub law: ContactLaw,
    /// Names of the two sides.
    pub between: [String; 2],
    /// True overlap area, m² (or the stated one, where there is no overlap to compute).
    pub area: f64,
    /// Factor on the law's conductance: 1, or stated area over the area the joints carry, twice that for
    /// half of a link.
    pub scale: f64,
    /// Whether this is one of the two halves of a link between places that do not touch.
    pub is_half: bool,
    /// First and one past the last joint; heat is counted from side a to side b over these.
    pub joints: std::ops::Range<usize>,
}

/// The reading of a sensor: a weighted sum of nodes, or water entering a circuit. K, or um of a displacement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SensorTerm {
    /// Weights over nodes.
    pub weights: Vec<(u32, f64)>,
    /// Share of a circuit's inlet temperature: circuit index and weight.
    pub inlet: Option<(usize, f64)>,
    /// Constant that is added: 0 for temperatures; for a displacement the value that makes it zero at its reference temperature.
    pub constant: f64,
}

impl SensorTerm {
    /// The reading of a temperature.
    pub fn temperature(weights: Vec<(u32, f64)>) -> Self {
        Self { weights, inlet: None, constant: 0.0 }
    }

    /// This reading with weights over other nodes.
    #[must_use]
    pub fn over(&self, weights: Vec<(u32, f64)>) -> Self {
        Self { weights, ..*self }
    }

    /// The reading, K or um, from all node temperatures and the circuits' inlet temperatures.
    pub fn read(&self, temperatures: &[f64], load: &Load) -> f64 {
        let nodes: f64 = self.weights.iter().map(|(n, w)| w * temperatures[*n as usize]).sum();
        nodes + self.inlet.map_or(0.0, |(c, w)| w * load.inlets[c]) + self.constant
    }
}

impl Network {
    /// Sets held nodes to their temperatures in the load, K.
    pub fn hold(&self, load: &Load, temperatures: &mut [f64]) {
        for (node, index) in &self.fixed {
            temperatures[*node as usize] = load.fixed[*index as usize];
        }
    }

    /// Temperatures of all nodes, K, with the water at its inlet temperatures and all solids at one temperature (K).
    pub fn at_inlets(&self, load: &Load, solids: f64) -> Vec<f64> {
        let mut found = vec![solids; self.nodes];
        for stream in &self.streams {
            found[stream.first_node as usize..=stream.outlet() as usize].fill(load.inlets[stream.circuit]);
        }
        found
    }

    /// Heat capacity (J/K) of a solid node at a temperature (K).
    pub fn capacity_at(&self, node: usize, temperature: f64) -> f64 {
        match self.relative_capacity.get(self.group[node] as usize) {
            Some(relative) => self.capacity[node] * relative.at(temperature),
            None => self.capacity[node],
        }
    }

    /// Enthalpy (J) of a solid node at a temperature (K), zero at 300 K.
    pub fn enthalpy(&self, node: usize, temperature: f64) -> f64 {
        match self.relative_capacity.get(self.group[node] as usize) {
            Some(relative) => self.capacity[node] * relative.integral(temperature),
            None => self.capacity[node] * (temperature - 300.0),
        }
    }

    /// Temperature (K) at which the enthalpy of a node has grown by an amount (J) since another temperature (K).
    pub fn warmed(&self, node: usize, from: f64, enthalpy: f64) -> f64 {
        let of_group = self.relative_capacity.get(self.group[node] as usize);
        let share = enthalpy / self.capacity[node];
        of_group.map_or(from + share, |relative| relative.moved(from, share))
    }

    /// Whether the capacity of a node follows its temperature.
    pub fn has_own_heat_curve(&self, node: usize) -> bool {
        self.capacity[node] > 0.0 && self.relative_capacity.get(self.group[node] as usize).is_some_and(|c| !c.is_constant())
    }

    /// Temperatures (K) at the two ends of a joint.
    pub fn joint_ends(&self, joint: &Joint, temperatures: &[f64]) -> (f64, f64) {
        let end = |node: u32, reach: u32| {
            let own = temperatures[node as usize];
            let Some(reach) = self.reaches.get(reach as usize) else { return own };
            let towards = reach.nodes.map(|n| temperatures[n as usize] - own);
            own + reach.shares[0] * towards[0] + reach.shares[1] * towards[1]
        };
        (end(joint.a, joint.reach[0]), end(joint.b, joint.reach[1]))
    }

    /// Whether no conductance changes with temperature; otherwise the Jacobian is not symmetric.
    pub fn is_linear_conduction(&self) -> bool {
        self.properties.iter().all(Property::is_constant) && !self.contacts.iter().any(|c| c.law.follows_temperature())
    }
}
