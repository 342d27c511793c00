//! Parts: materials, shapes, surfaces, faces, and lumped nodes.

use crate::foundation::formula::Formula;

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
    /// What it does to displacements.
    pub elastic: Elastic,
    /// Where the numbers come from.
    pub source: String,
}

/// What a material does to displacements; `None` where its file does not say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Elastic {
    /// Coefficient of linear thermal expansion, 1/K.
    pub expansion: Option<f64>,
    /// Young's modulus, Pa.
    pub modulus: Option<f64>,
    /// Poisson's ratio, from 0 to below 1/2.
    pub poisson: Option<f64>,
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
    pub body: std::sync::Arc<crate::describe::gmsh::Body>,
    /// Where its origin stands in the machine, m.
    pub at: [f64; 3],
}

/// A part: one material, one or several blocks; blocks of one part that touch are one piece. Or, instead of
/// blocks, a volume of an imported mesh.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name.
    pub name: String,
    /// Index into [`Machine::materials`](super::Machine::materials).
    pub material: usize,
    /// Its blocks; none for an imported mesh.
    pub blocks: Vec<Block>,
    /// Its volume of an imported mesh.
    pub import: Option<Import>,
    /// Cells of this part are smaller than the machine's by this factor (1 = the same, 0.5 = half).
    pub element_scale: f64,
    /// How its outer surface radiates to the chamber.
    pub surface: Surface,
    /// Temperature at the start of a schedule or log, K, where the file states one.
    pub start: Option<Formula>,
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
    /// Index into [`Machine::parts`](super::Machine::parts).
    pub part: usize,
    /// Index into that part's blocks; `None` means every block. Of an imported part: index into
    /// [`crate::describe::gmsh::Body::surfaces`]; `None` means the whole boundary.
    pub block: Option<usize>,
    /// Which side; says nothing for an imported part.
    pub side: Side,
}

impl Face {
    /// Whether a face of one block is this one, or of its blocks.
    pub fn covers(self, face: Face) -> bool {
        self.part == face.part && self.side == face.side && self.block.is_none_or(|b| Some(b) == face.block)
    }
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
    /// Temperature at the start of a schedule or log, K, where the file states one.
    pub start: Option<Formula>,
}
