//! The machine file, read and checked. Everything here is SI; temperatures are in kelvin.

mod bounds_in_time;
mod catalogue;
mod channels;
mod circuits;
mod clearance;
mod condition;
mod contact_law;
mod contacts;
mod controllers;
mod elastic;
mod enclosures;
mod film;
mod fluids;
mod geometry;
mod heat_flows;
mod import;
mod keys;
mod library;
mod model;
mod names;
mod parts;
mod prior;
mod read;
mod readings;
mod region;
mod response;
mod scope;
mod sensors;
mod shape;
mod slope;
mod source_law;
mod sources;
pub mod starters;
mod symbols;
mod uncertain;
mod variables;

pub use coldplate_base::terms::LimitKind;

pub use catalogue::{Catalogue, LiquidRecord, MaterialRecord, PropertyRecord};
pub use channels::Channel;
pub use circuits::{Branch, BranchFlow, Circuit, Intake, Layout, Supply};
pub use condition::Condition;
pub use contact_law::{Bonded, Conductance, ContactLaw, Insulated, Interface, OfPressure, OfTemperature, Total};
pub use contacts::{Boundary, BoundaryLaw, Contact, ExposedNode, RadiationLink};
pub use controllers::{ControlLaw, Controller};
pub use elastic::{Elasticity, JointKind, Support};
pub use enclosures::{Enclosure, EnclosureSurface, Views};
pub use film::{FilmSource, FlowState};
pub use heat_flows::{HeatFlow, HeatPath};
pub use keys::SCHEMA;
pub use model::{Assumption, Chamber, Machine};
pub use parts::{
    BlockShape, CoordinateAxis, Elastic, Face, HeatedPlace, Import, LumpedNode, Material, Part, PartBlock, PartSurface, Place, Property,
    Side,
};
pub use prior::Priors;
pub use readings::{Displacement, MachineLimit, Measurement, Sensor, SensorReading};
pub use region::Region;
pub use response::{SensorResponse, ShownTemperature};
pub use scope::{PointColumn, Scope};
pub use slope::Slope;
pub use source_law::{ConstantPower, LinearPower, SourceLaw};
pub use sources::Source;
pub use uncertain::{Correlation, ModelError, NumberKind, SharedFactor, SharedNumbers};
pub use variables::{DescribedVariable, Drive, NamedFormula};
