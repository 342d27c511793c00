//! The machine file, read and checked. Everything here is SI; temperatures are in kelvin.

use coldplate_base::formula::Formula;

mod catalogue;
mod channels;
mod circuits;
mod clearance;
mod condition;
mod contact_law;
mod contacts;
mod elastic;
mod enclosures;
mod film;
mod fluids;
mod geometry;
mod heat_flows;
mod import;
mod keys;
mod library;
mod names;
mod parts;
mod read;
mod region;
mod response;
mod scope;
mod sensors;
mod shape;
mod slope;
mod source_law;
mod sources;
pub mod starters;
mod uncertain;
mod variables;

pub use coldplate_base::terms::LimitKind;

pub use catalogue::{Catalogue, LiquidRecord, MaterialRecord, PropertyRecord};
pub use channels::Channel;
pub use circuits::{Branch, BranchFlow, Circuit, Intake, Layout, Supply};
pub use condition::Condition;
pub use contact_law::{Bonded, Conductance, ContactLaw, Insulated, Interface, OfPressure, OfTemperature, Total};
pub use contacts::{Boundary, BoundaryLaw, Contact, ExposedNode, Place, RadiationLink};
pub use elastic::{Displacement, Elasticity, JointKind, Support};
pub use enclosures::{Enclosure, EnclosureSurface, Views};
pub use film::{Film, FlowState};
pub use heat_flows::{HeatFlow, HeatPath};
pub use keys::SCHEMA;
pub use parts::{Axis, Block, Elastic, Face, Import, LumpedNode, Material, Part, Property, Shape, Side, Surface};
pub use region::Region;
pub use response::{SensorResponse, Shown};
pub use scope::{Point, Scope};
pub use slope::Slope;
pub use source_law::{ConstantPower, LinearPower, SourceLaw};
pub use uncertain::{Correlation, ModelError, NumberKind, Shared, SharedFactor};

/// A machine, as described by one file.
#[derive(Debug, Clone)]
pub struct Machine {
    /// One-line name.
    pub name: String,
    /// The file the machine was read from, under the name used in errors.
    pub file: std::path::PathBuf,
    /// Free text.
    pub description: String,
    /// SHA-256 of the file's text with every `--set` applied, and of every imported mesh, in hexadecimal.
    pub hash: String,
    /// The condition variables: first the four that always exist, then the file's own.
    pub variables: Vec<Variable>,
    /// Named intermediate formulas, in the order they must be evaluated.
    pub definitions: Vec<Definition>,
    /// Drives; formulas see their heats as `NAME_motor_W` and so forth.
    pub drives: Vec<Drive>,
    /// The vacuum chamber around the machine.
    pub chamber: Chamber,
    /// Materials in use.
    pub materials: Vec<Material>,
    /// Parts made of blocks, or of imported meshes.
    pub parts: Vec<Part>,
    /// Hand-written lumped nodes.
    pub nodes: Vec<LumpedNode>,
    /// Law for touching faces without a named contact; `None` means bonded, with a warning.
    pub default_contact: Option<ContactLaw>,
    /// Named contacts.
    pub contacts: Vec<Contact>,
    /// Coolant channels.
    pub channels: Vec<Channel>,
    /// Coolant circuits that feed the channels.
    pub circuits: Vec<Circuit>,
    /// Prescribed film, flux or temperature on faces.
    pub boundaries: Vec<Boundary>,
    /// Radiative links between facing surfaces.
    pub radiation_links: Vec<RadiationLink>,
    /// Enclosures of surfaces that see each other.
    pub enclosures: Vec<Enclosure>,
    /// Heat sources.
    pub sources: Vec<Source>,
    /// Measurement points.
    pub sensors: Vec<Sensor>,
    /// Heat-flow sensors.
    pub heat_flows: Vec<HeatFlow>,
    /// Supports of the machine, and the reference of its displacements.
    pub elasticity: Elasticity,
    /// Limits of acceptable operation.
    pub limits: Vec<Limit>,
    /// Numbers the file marks as assumed, with the reason.
    pub assumptions: Vec<Assumption>,
    /// Measured readings to print beside the prediction.
    pub measurements: Vec<Measurement>,
    /// Uncertain factors shared by several numbers.
    pub shared_factors: Vec<SharedFactor>,
    /// Correlations of uncertain numbers.
    pub correlations: Vec<Correlation>,
    /// Standard deviations of the model error.
    pub model_error: ModelError,
    /// Number of cells aimed at when the caller does not say.
    pub default_cells: usize,
    /// Largest error of a reading from the mesh, K, if the file states it in place of a number of cells.
    pub accuracy: Option<f64>,
    /// The names of the formulas, slot by slot.
    symbols: condition::Symbols,
    /// Indices of the variables that affect nothing.
    unused: Vec<usize>,
}

impl Machine {
    /// Whether parts or nodes have a start temperature of their own for a schedule or log.
    pub fn has_starts(&self) -> bool {
        self.parts.iter().any(|p| p.start.is_some()) || self.nodes.iter().any(|n| n.start.is_some())
    }
}

/// A condition variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name, for example `coolant_flow`.
    pub name: String,
    /// Unit in which values are shown, for example `L/min`.
    pub unit: String,
    /// Physical dimension of the variable.
    pub dimension: coldplate_base::units::Dimension,
    /// Default value (SI), if the file states one.
    pub default: Option<f64>,
    /// Range of sensible values (SI), if the file states one.
    pub range: Option<(f64, f64)>,
}

/// A named intermediate formula.
#[derive(Debug, Clone)]
pub struct Definition {
    /// Name under which later formulas use it.
    pub name: String,
    /// Formula of the definition; the value is used without unit conversion.
    pub formula: Formula,
}

/// One feed drive: motor, reducer, screw, rails, bearings (equations 1-5 of the source paper).
#[derive(Debug, Clone)]
pub struct Drive {
    /// Prefix of its quantities in formulas.
    pub name: String,
    /// Motor speed, rad/s.
    pub speed: Formula,
    /// Physical parameters; see [`coldplate_physics::drive`].
    pub parameters: coldplate_physics::drive::Parameters,
}

/// The chamber: wall temperature, enclosure, residual gas.
#[derive(Debug, Clone)]
pub struct Chamber {
    /// Wall temperature, K.
    pub temperature: Formula,
    /// Wall emissivity and area (m²) for the enclosure formula; `None`: the effective emissivity equals the emissivity.
    pub enclosure: Option<(f64, f64)>,
    /// Pressure of the residual gas, Pa.
    pub pressure: f64,
    /// Energy accommodation coefficient of the residual gas.
    pub accommodation: f64,
    /// Distance from machine to wall, m, for the continuum limit of the gas conduction.
    pub gap: f64,
}

/// The place that a source heats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatedPlace {
    /// A part, a face or a node.
    pub place: Place,
    /// The block of the part, from 0, if a single block is heated.
    pub block: Option<usize>,
}

impl HeatedPlace {
    /// Whether another place is this one or a block of it.
    pub fn holds(self, other: Self) -> bool {
        self.place == other.place && (self.block == other.block || self.block.is_none())
    }
}

/// A heat source.
#[derive(Debug, Clone)]
pub struct Source {
    /// Name.
    pub name: String,
    /// Heated places: the power is spread over the volume of a part or the area of a face, or put into a node.
    pub places: Vec<HeatedPlace>,
    /// Total power, W, shared among the places by volume or area; or the power per volume, W/m³.
    pub power: Formula,
    /// Volume of all places, m³, for a power given per volume.
    pub volume: Option<f64>,
    /// Relative power per volume or area at x, y, z (mm, in the coordinates of the part); `None` means even.
    pub distribution: Option<Formula>,
    /// Dependence of the power of each piece on its own temperature.
    pub law: SourceLaw,
}

/// A measurement point.
#[derive(Debug, Clone)]
pub struct Sensor {
    /// Name.
    pub name: String,
    /// Reading of the sensor.
    pub reads: Reading,
    /// Response of the sensor to the value at its place.
    pub shows: SensorResponse,
}

/// Reading of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub enum Reading {
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

impl Reading {
    /// Whether the reading is a displacement, not a temperature.
    pub fn is_displacement(&self) -> bool {
        matches!(self, Self::Displacement(_))
    }
}

/// A limit on sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Name.
    pub name: String,
    /// The limited quantity, by indices into [`Machine::sensors`] (its points) and [`Machine::variables`].
    pub kind: LimitKind<Vec<usize>>,
    /// Largest value allowed: K for maxima (absolute), K for differences.
    pub maximum: f64,
}

/// A number the file marks as assumed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assumption {
    /// Dotted key of the number.
    pub key: String,
    /// The value as written.
    pub value: String,
    /// Why it was chosen.
    pub reason: String,
}

/// One measured state of the machine, to be printed beside the prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Name, for example `working condition 1`.
    pub name: String,
    /// The condition of the measurement: (index into [`Machine::variables`], SI value).
    pub condition: Vec<(usize, f64)>,
    /// Readings: (index into [`Machine::sensors`], K).
    pub readings: Vec<(usize, f64)>,
    /// Predictions of other programs, if known: (sensor, K).
    pub others: Vec<(usize, f64)>,
    /// Half the width of the 95 % interval of a reading, K, if stated.
    pub uncertainty: Option<f64>,
    /// Remarks on the readings.
    pub note: String,
}
