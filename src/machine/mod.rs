//! What the engineer writes, read and validated. Everything here is SI; temperatures are kelvin.
//!
//! A [`Machine`] knows nothing of meshes or solvers: it is the machine file with names resolved
//! to indices and every number checked. [`Machine::read`] is the only way to make one.

use crate::formula::Formula;

mod channels;
mod condition;
mod contacts;
mod enclosures;
mod geometry;
mod import;
mod library;
mod names;
mod read;
mod sensors;
mod shape;
mod variables;

pub use condition::Condition;

/// A machine, as described by one file.
#[derive(Debug, Clone)]
pub struct Machine {
    /// One-line name.
    pub name: String,
    /// Free text.
    pub description: String,
    /// SHA-256 of the file's text with every `--set` applied, and of every imported mesh, in hexadecimal.
    pub hash: String,
    /// The condition variables: first the four that always exist, then the file's own.
    pub variables: Vec<Variable>,
    /// Named intermediate formulas, in the order they must be evaluated.
    pub definitions: Vec<Definition>,
    /// Drives, whose heats are available to formulas as `NAME_motor_W` and so on.
    pub drives: Vec<Drive>,
    /// The vacuum chamber around the machine.
    pub chamber: Chamber,
    /// Materials in use.
    pub materials: Vec<Material>,
    /// Parts made of blocks, or of imported meshes.
    pub parts: Vec<Part>,
    /// Hand-written lumped nodes.
    pub nodes: Vec<LumpedNode>,
    /// Law for faces that touch and that no contact names; `None` means bonded, with a warning.
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
    /// What is acceptable.
    pub limits: Vec<Limit>,
    /// Numbers the file marks as assumed, with the reason.
    pub assumptions: Vec<Assumption>,
    /// Measured readings to print beside the prediction.
    pub measurements: Vec<Measurement>,
    /// Cells aimed at when the caller does not say.
    pub default_cells: usize,
    /// The names formulas use, slot by slot.
    symbols: condition::Symbols,
}

/// A condition variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name, for example `coolant_flow`.
    pub name: String,
    /// Unit it is shown in, for example `L/min`.
    pub unit: String,
    /// Its physical dimension.
    pub dimension: crate::units::Dimension,
    /// Value used when a caller gives none (SI), if the file states one.
    pub default: Option<f64>,
    /// Range that makes sense (SI), if the file states one.
    pub range: Option<(f64, f64)>,
}

/// A named intermediate formula.
#[derive(Debug, Clone)]
pub struct Definition {
    /// Name under which later formulas use it.
    pub name: String,
    /// Its formula; the value is used as it stands, without unit conversion.
    pub formula: Formula,
}

/// One feed drive: motor, reducer, screw, rails, bearings (equations 1-5 of the source paper).
#[derive(Debug, Clone)]
pub struct Drive {
    /// Prefix of its quantities in formulas.
    pub name: String,
    /// Motor speed, rad/s.
    pub speed: Formula,
    /// Physical parameters; see [`crate::physics::drive`].
    pub parameters: crate::physics::drive::Parameters,
}

/// The chamber: wall temperature, enclosure, residual gas.
#[derive(Debug, Clone)]
pub struct Chamber {
    /// Wall temperature, K.
    pub temperature: Formula,
    /// Wall emissivity and area (m²) for the enclosure formula; `None` gives eps_eff = emissivity.
    pub enclosure: Option<(f64, f64)>,
    /// Pressure of the residual gas, Pa.
    pub pressure: f64,
    /// Energy accommodation coefficient of the residual gas.
    pub accommodation: f64,
    /// Distance from machine to wall, m, for the continuum limit of the gas conduction.
    pub gap: f64,
}

/// A material.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name.
    pub name: String,
    /// Conductivity along the block's three axes (x, y, z or r, theta, z).
    pub conductivity: [Property; 3],
    /// kg/m³.
    pub density: f64,
    /// J/(kg K).
    pub specific_heat: Property,
    /// Where the numbers come from.
    pub source: String,
}

/// A property that may depend on temperature.
#[derive(Debug, Clone, PartialEq)]
pub enum Property {
    /// The same at every temperature.
    Constant(f64),
    /// Piecewise linear in (K, value), constant outside; temperatures ascend strictly.
    Table(Vec<(f64, f64)>),
}

impl Property {
    /// Value at `temperature` (K).
    pub fn at(&self, temperature: f64) -> f64 {
        self.with_slope(temperature).0
    }

    /// Value and its derivative with respect to temperature, at `temperature` (K).
    pub fn with_slope(&self, temperature: f64) -> (f64, f64) {
        let table = match self {
            Self::Constant(value) => return (*value, 0.0),
            Self::Table(table) => table,
        };
        let above = table.partition_point(|(t, _)| *t <= temperature);
        if above == 0 || above == table.len() {
            return (table[if above == 0 { 0 } else { above - 1 }].1, 0.0);
        }
        let ((t0, v0), (t1, v1)) = (table[above - 1], table[above]);
        let slope = (v1 - v0) / (t1 - t0);
        (v0 + slope * (temperature - t0), slope)
    }

    /// Integral over temperature from 300 K to `temperature` (K): of a specific heat, the enthalpy.
    pub fn integral(&self, temperature: f64) -> f64 {
        let table = match self {
            Self::Constant(value) => return value * (temperature - 300.0),
            Self::Table(table) => table,
        };
        let (sign, low, high) = if temperature < 300.0 { (-1.0, temperature, 300.0) } else { (1.0, 300.0, temperature) };
        // Linear between the points of the table, so the trapezium is exact between neighbouring ones.
        let mut sum = 0.0;
        let mut last = low;
        for next in table.iter().map(|(t, _)| *t).filter(|t| *t > low && *t < high).chain([high]) {
            sum += 0.5 * (self.at(last) + self.at(next)) * (next - last);
            last = next;
        }
        sign * sum
    }

    /// Whether the value is the same at every temperature.
    pub fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

/// A coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// First axis.
    X,
    /// Second axis.
    Y,
    /// Third axis.
    Z,
}

impl Axis {
    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// The shape of one block, placed in the machine's coordinates.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A box between two opposite corners.
    Box {
        /// Corner with the smallest coordinates, m.
        min: [f64; 3],
        /// Corner with the largest coordinates, m.
        max: [f64; 3],
    },
    /// A solid or annular cylinder, or part of a turn of one.
    Cylinder {
        /// Direction of its axis.
        axis: Axis,
        /// Centre of the end face with the smaller axial coordinate, m.
        base: [f64; 3],
        /// Length along the axis, m.
        length: f64,
        /// Inner radius, m (0 for solid).
        inner: f64,
        /// Outer radius, m.
        outer: f64,
        /// First and last angle, rad; a full turn is (0, 2 pi). Measured from the next axis in
        /// cyclic order (axis z: from x towards y; axis x: from y towards z; axis y: from z towards x).
        turn: (f64, f64),
    },
    /// A ball or a spherical shell, whose temperature depends on the radius alone.
    Sphere {
        /// Centre, m.
        centre: [f64; 3],
        /// Inner radius, m (0 for solid).
        inner: f64,
        /// Outer radius, m.
        outer: f64,
    },
}

/// One block of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Where and what shape it is.
    pub shape: Shape,
    /// Fixed cell counts along its three axes; `None` lets the mesh choose.
    pub cells: [Option<usize>; 3],
}

/// A volume of an imported mesh, placed in the machine.
#[derive(Debug, Clone)]
pub struct Import {
    /// The mesh file, as written.
    pub file: String,
    /// The volume in its own coordinates, m.
    pub body: std::sync::Arc<crate::gmsh::Body>,
    /// Where its origin stands in the machine, m.
    pub at: [f64; 3],
}

/// A part: one material, one or several blocks; blocks of one part that touch are one piece. Or, instead of
/// blocks, a volume of an imported mesh.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name.
    pub name: String,
    /// Index into [`Machine::materials`].
    pub material: usize,
    /// Its blocks; none for an imported mesh.
    pub blocks: Vec<Block>,
    /// Its volume of an imported mesh.
    pub import: Option<Import>,
    /// Cells of this part are smaller than the machine's by this factor (1 = the same, 0.5 = half).
    pub element_scale: f64,
    /// How its outer surface radiates to the chamber.
    pub surface: Surface,
    /// Flux area the user states for its heat-transfer face, m²; compared with the true contact area.
    pub stated_flux_area: Option<f64>,
}

/// Radiation of a part's exposed faces.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Emissivity of the surface, or the effective emissivity if `effective`.
    pub emissivity: f64,
    /// Use `emissivity` as it stands, not through the enclosure formula.
    pub effective: bool,
    /// Total radiating area, m²; `None` takes the exposed area of the faces, otherwise the exposed
    /// faces are scaled to this total.
    pub area: Option<f64>,
    /// Faces that do not see the chamber.
    pub excluded: Vec<Face>,
}

/// A face of a block. For boxes: the six sides. For cylinders: two ends, inner, outer, two cuts. For
/// spheres: inner and outer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Box: x low. Cylinder and sphere: inner radius.
    Low0,
    /// Box: x high. Cylinder and sphere: outer radius.
    High0,
    /// Box: y low. Cylinder: first angle.
    Low1,
    /// Box: y high. Cylinder: last angle.
    High1,
    /// Box: z low. Cylinder: end with the smaller axial coordinate.
    Low2,
    /// Box: z high. Cylinder: end with the larger axial coordinate.
    High2,
}

impl Side {
    /// All six sides.
    pub const ALL: [Side; 6] = [Side::Low0, Side::High0, Side::Low1, Side::High1, Side::Low2, Side::High2];

    /// Local axis 0, 1 or 2 the face is normal to.
    pub fn axis(self) -> usize {
        self as usize / 2
    }

    /// Whether it is the face at the larger coordinate.
    pub fn is_high(self) -> bool {
        self as usize % 2 == 1
    }
}

/// A side of a part: of one block, or of every block where it lies on the outside. Of an imported part: one of
/// its named surfaces, or its whole boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Index into [`Machine::parts`].
    pub part: usize,
    /// Index into that part's blocks; `None` means every block. Of an imported part: index into
    /// [`crate::gmsh::Body::surfaces`]; `None` means the whole boundary.
    pub block: Option<usize>,
    /// Which side; says nothing for an imported part.
    pub side: Side,
}

/// A node with one temperature, written by hand.
#[derive(Debug, Clone)]
pub struct LumpedNode {
    /// Name.
    pub name: String,
    /// Heat capacity, J/K (0 for an arithmetic node).
    pub capacity: f64,
    /// Fixed temperature, K, for a boundary node.
    pub fixed: Option<Formula>,
    /// Emissivity, whether effective, and area (m²) radiating to the chamber.
    pub radiation: Option<(f64, bool, f64)>,
}

/// Something a contact, source or link can attach to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A whole part.
    Part(usize),
    /// A face of a part.
    Face(Face),
    /// A lumped node.
    Node(usize),
}

/// A named contact between two places.
#[derive(Debug, Clone)]
pub struct Contact {
    /// Name.
    pub name: String,
    /// The two sides.
    pub between: [Place; 2],
    /// Its law.
    pub law: ContactLaw,
    /// Area, m². Needed where a lumped node takes part; for two parts the touching area is
    /// computed, and this, where given, replaces it in total (hA = h x area).
    pub area: Option<f64>,
    /// Line in the machine file.
    pub line: usize,
}

/// How heat crosses a contact.
#[derive(Debug, Clone, PartialEq)]
pub enum ContactLaw {
    /// Perfect.
    Bonded,
    /// Constant conductance, W/(m² K).
    Conductance(f64),
    /// Total conductance, W/K, spread over the true area.
    Total(f64),
    /// Conductance (W/(m² K)) against mean interface temperature (K).
    OfTemperature(Property),
    /// Conductance against contact pressure (Pa), evaluated at `pressure`.
    OfPressure {
        /// Piecewise-linear table of (Pa, W/(m² K)).
        table: Vec<(f64, f64)>,
        /// Contact pressure, Pa.
        pressure: f64,
    },
    /// Cooper-Mikic-Yovanovich solid spots with gap gas and radiation in parallel.
    Rough(crate::physics::contact::Rough),
    /// No heat crosses.
    Insulated,
}

/// A coolant channel: a round hole along a path through parts.
#[derive(Debug, Clone)]
pub struct Channel {
    /// Name.
    pub name: String,
    /// Corners of the path, m, in the machine's coordinates, from inlet to outlet.
    pub path: Vec<[f64; 3]>,
    /// Index of the part it runs through.
    pub part: usize,
    /// Hydraulic diameter, m.
    pub diameter: f64,
    /// Wetted length, m; `None` takes the length of the path.
    pub length: Option<f64>,
    /// How its film is found.
    pub film: Film,
    /// Factor on it: fouling, or a correlation known to be off (1 = as found).
    pub film_factor: f64,
    /// Loss coefficients summed over the bends, inlet and outlet.
    pub minor_loss: f64,
    /// Wall roughness, m.
    pub roughness: f64,
    /// Whether it is the bore of a hollow cylinder, whose inner face is its wall; otherwise a hole in solid.
    pub is_bore: bool,
}

/// How the film coefficient of a channel is found.
#[derive(Debug, Clone, PartialEq)]
pub enum Film {
    /// From the correlations of [`crate::physics::channel`], times `bend_factor`.
    Correlation {
        /// Heat-transfer augmentation by bends (1 = straight).
        bend_factor: f64,
        /// Thermal boundary condition of the laminar branch.
        wall: crate::physics::channel::Wall,
    },
    /// Given, W/(m² K).
    Given(f64),
}

/// A coolant circuit: what flows in, and through which channels.
#[derive(Debug, Clone)]
pub struct Circuit {
    /// Name.
    pub name: String,
    /// Volume flow, m³/s at inlet conditions.
    pub flow: Formula,
    /// Inlet temperature, K.
    pub inlet: Formula,
    /// Properties of the liquid.
    pub liquid: crate::physics::water::Liquid,
    /// The order in which the channels are passed.
    pub layout: Layout,
    /// Whether viscous dissipation heats the liquid.
    pub dissipation: bool,
}

/// Channels in series and parallel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Layout {
    /// Index into [`Machine::channels`].
    Channel(usize),
    /// One after the other.
    Series(Vec<Layout>),
    /// Side by side; the flow splits so that the pressure drops agree.
    Parallel(Vec<Layout>),
}

/// A prescribed thermal condition on faces.
#[derive(Debug, Clone)]
pub struct Boundary {
    /// Name.
    pub name: String,
    /// The faces it applies to.
    pub faces: Vec<Face>,
    /// What is prescribed.
    pub law: BoundaryLaw,
}

/// What a boundary prescribes.
#[derive(Debug, Clone)]
pub enum BoundaryLaw {
    /// Surface temperature, K.
    Temperature(Formula),
    /// Film coefficient W/(m² K) to a fluid at a temperature (K).
    Film(Formula, Formula),
    /// Heat flux into the machine, W/m².
    Flux(Formula),
    /// Radiation to a temperature (K) with an emissivity.
    Radiation(f64, Formula),
}

/// Radiation between two places that face each other.
#[derive(Debug, Clone)]
pub struct RadiationLink {
    /// Name.
    pub name: String,
    /// The two surfaces.
    pub between: [Place; 2],
    /// Area of the first, m²; `None` takes its exposed area.
    pub area: Option<f64>,
    /// View factor from the first to the second.
    pub view_factor: f64,
    /// Emissivities of the two.
    pub emissivity: [f64; 2],
}

/// Grey diffuse surfaces that exchange radiation, each with all others.
#[derive(Debug, Clone)]
pub struct Enclosure {
    /// Name.
    pub name: String,
    /// Its surfaces.
    pub surfaces: Vec<EnclosureSurface>,
    /// What they see of each other.
    pub views: Views,
    /// Whether nothing leaves between the surfaces; else the rest of each one's view is the chamber.
    pub closed: bool,
    /// How far given view factors may miss reciprocity and the sum of a row.
    pub tolerance: f64,
    /// File in which view factors found by rays are kept, if any.
    pub cache: Option<std::path::PathBuf>,
    /// Line in the machine file.
    pub line: usize,
}

/// One surface of an enclosure.
#[derive(Debug, Clone)]
pub struct EnclosureSurface {
    /// What it is called in reports: the text that named it.
    pub name: String,
    /// Where it is; `None` is the chamber wall.
    pub place: Option<Place>,
    /// Emissivity.
    pub emissivity: f64,
    /// Area, m²; `None` takes the open area of the faces.
    pub area: Option<f64>,
    /// Pieces it is cut into along the two axes of its faces.
    pub patches: [usize; 2],
}

/// Where the view factors of an enclosure come from.
#[derive(Debug, Clone)]
pub enum Views {
    /// From the file, row by row; what is `None` follows from the others.
    Given(Vec<Vec<Option<f64>>>),
    /// In closed form where there is one, else by this many rays from each surface.
    Computed {
        /// Rays.
        rays: usize,
        /// Whether closed forms may be used.
        closed_forms: bool,
    },
}

/// A heat source.
#[derive(Debug, Clone)]
pub struct Source {
    /// Name.
    pub name: String,
    /// Where: spread evenly over the volume of a part, the area of a face, or put into a node.
    pub places: Vec<Place>,
    /// Total power, W, shared among the places by volume or area.
    pub power: Formula,
}

/// A measurement point.
#[derive(Debug, Clone)]
pub struct Sensor {
    /// Name.
    pub name: String,
    /// What it reads.
    pub reads: Reading,
}

/// What a sensor reads.
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
    /// Water entering a channel.
    Inlet(usize),
    /// Water leaving a channel.
    Outlet(usize),
}

/// A limit on sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Name.
    pub name: String,
    /// What is limited.
    pub kind: LimitKind,
    /// Largest value allowed: K for maxima (absolute), K for differences.
    pub maximum: f64,
}

/// What a limit looks at. Sensors are indices into [`Machine::sensors`].
#[derive(Debug, Clone, PartialEq)]
pub enum LimitKind {
    /// A sensor's temperature.
    Maximum(usize),
    /// A sensor's rise over the chamber (`ambient_temperature`).
    RiseOverAmbient(usize),
    /// First sensor minus second.
    Difference(usize, usize),
    /// Largest minus smallest of several sensors.
    Spread(Vec<usize>),
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
    /// The condition it was taken at: (index into [`Machine::variables`], SI value).
    pub condition: Vec<(usize, f64)>,
    /// Readings: (index into [`Machine::sensors`], K).
    pub readings: Vec<(usize, f64)>,
    /// What other programs predicted, where known: (sensor, K).
    pub others: Vec<(usize, f64)>,
    /// Remarks on the readings.
    pub note: String,
}
