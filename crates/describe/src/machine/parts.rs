//! Parts: materials, shapes, surfaces, faces, and lumped nodes.

use coldplate_base::formula::Formula;

/// A material.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name.
    pub name: String,
    /// Conductivity along the block's three axes (x, y, z or r, theta, z).
    pub conductivity: [Property; 3],
    /// Density, kg/m³.
    pub density: f64,
    /// Specific heat, J/(kg K).
    pub specific_heat: Property,
    /// Expansion and stiffness.
    pub elastic: Elastic,
    /// Source of the numbers.
    pub source: String,
}

/// Expansion and stiffness of a material; `None` for a number that the file does not state.
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
    /// One value at all temperatures.
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
        // The property is linear between the points of the table: the trapezium rule is exact between neighbouring
        // points.
        let mut sum = 0.0;
        let mut last = low;
        for next in table.iter().map(|(t, _)| *t).filter(|t| *t > low && *t < high).chain([high]) {
            sum += 0.5 * (self.at(last) + self.at(next)) * (next - last);
            last = next;
        }
        sign * sum
    }

    /// Mean value between two temperatures (K), exact for the table: of a conductivity, the one with which Fourier's law between the two
    /// holds (Kirchhoff's transformation; Carslaw and Jaeger 1959, 2.16).
    pub fn mean(&self, first: f64, last: f64) -> f64 {
        let Self::Table(table) = self else { return self.at(first) };
        let (low, high) = (first.min(last), first.max(last));
        let inside = table.partition_point(|(t, _)| *t <= low)..table.partition_point(|(t, _)| *t < high);
        if inside.is_empty() || low == high {
            return 0.5 * (self.at(low) + self.at(high));
        }
        let (mut sum, mut last) = (0.0, (low, self.at(low)));
        for next in table[inside].iter().copied().chain([(high, self.at(high))]) {
            sum += 0.5 * (last.1 + next.1) * (next.0 - last.0);
            last = next;
        }
        sum / (high - low)
    }

    /// Temperature (K) up to which the integral from another one (K) has a given value; exact for the table.
    pub fn moved(&self, from: f64, integral: f64) -> f64 {
        let Self::Table(table) = self else { return from + integral / self.at(from) };
        let sign = integral.signum();
        let (mut at, mut left) = ((from, self.at(from)), integral.abs());
        let ahead: Vec<(f64, f64)> = if sign > 0.0 {
            table[table.partition_point(|(t, _)| *t <= from)..].to_vec()
        } else {
            table[..table.partition_point(|(t, _)| *t < from)].iter().rev().copied().collect()
        };
        for next in ahead {
            let length = (next.0 - at.0).abs();
            let whole = 0.5 * (at.1 + next.1) * length;
            if whole > left {
                // v x + s x²/2 = left, without cancellation for small s.
                let rise = (next.1 - at.1) / length;
                return at.0 + sign * 2.0 * left / (at.1 + (at.1 * at.1 + 2.0 * rise * left).sqrt());
            }
            (at, left) = (next, left - whole);
        }
        at.0 + sign * left / at.1
    }

    /// Whether the value is equal at all temperatures.
    pub fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

/// A coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CoordinateAxis {
    /// First axis.
    X,
    /// Second axis.
    Y,
    /// Third axis.
    Z,
}

impl CoordinateAxis {
    /// Index of the axis: 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// The shape of one block, placed in the machine's coordinates.
#[derive(Debug, Clone, PartialEq)]
pub enum BlockShape {
    /// A box between two opposite corners.
    Box {
        /// Corner with the smallest coordinates, m.
        min: [f64; 3],
        /// Corner with the largest coordinates, m.
        max: [f64; 3],
    },
    /// A solid or annular cylinder, or part of a turn of one.
    Cylinder {
        /// Direction of the cylinder's axis.
        axis: CoordinateAxis,
        /// Centre of the end face with the smaller axial coordinate, m.
        base: [f64; 3],
        /// Length along the axis, m.
        length: f64,
        /// Inner radius, m (0 for solid).
        inner: f64,
        /// Outer radius, m.
        outer: f64,
        /// First and last angle, rad; a full turn is (0, 2 pi). Angles are measured from the next axis in cyclic order
        /// (axis z: from x towards y; axis x: from y towards z; axis y: from z towards x).
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
pub struct PartBlock {
    /// Shape and place of the block.
    pub shape: BlockShape,
    /// Fixed cell counts along the block's three axes; `None` lets the mesh choose.
    pub cells: [Option<usize>; 3],
}

/// A volume of an imported mesh, placed in the machine.
#[derive(Debug, Clone)]
pub struct Import {
    /// The mesh file, as written.
    pub file: String,
    /// The volume in its own coordinates, m.
    pub body: std::sync::Arc<crate::gmsh::Body>,
    /// Place of the mesh's origin in the machine, m.
    pub at: [f64; 3],
}

/// A part of one material: one or several blocks, or a volume of an imported mesh. Touching blocks of one part are one
/// piece.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name.
    pub name: String,
    /// Index into [`Machine::materials`](super::Machine::materials).
    pub material: usize,
    /// Blocks of the part; none for an imported mesh.
    pub blocks: Vec<PartBlock>,
    /// The volume of an imported mesh, if the part is one.
    pub import: Option<Import>,
    /// Ratio of this part's cell size to the machine's (dimensionless): 1 is equal, 0.5 is half.
    pub element_scale: f64,
    /// Radiation of the part's outer surface to the chamber.
    pub surface: PartSurface,
    /// Temperature at the start of a schedule or log, K, if the file states one.
    pub start: Option<Formula>,
    /// Area that the user states for the part's heat-transfer face, m²; compared with the true contact area.
    pub stated_flux_area: Option<f64>,
}

/// Radiation of a part's exposed faces.
#[derive(Debug, Clone, PartialEq)]
pub struct PartSurface {
    /// Emissivity of the surface, or the effective emissivity if `effective`.
    pub emissivity: f64,
    /// Whether `emissivity` is used directly, not through the enclosure formula.
    pub effective: bool,
    /// Total radiating area, m², to which the exposed faces are scaled; `None` takes the area of the exposed faces.
    pub area: Option<f64>,
    /// Faces that do not see the chamber.
    pub excluded: Vec<Face>,
}

/// A side of a block. For boxes: the six sides. For cylinders: two ends, inner, outer, two cuts. For spheres: inner and
/// outer.
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

    /// Local axis 0, 1 or 2 that the side is normal to.
    pub fn axis(self) -> usize {
        self as usize / 2
    }

    /// Whether the side is at the larger coordinate.
    pub fn is_high(self) -> bool {
        self as usize % 2 == 1
    }
}

/// A side of a part: of one block, or of every block with this side on the outside. For an imported part: one of its
/// named surfaces, or its whole boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Index into [`Machine::parts`](super::Machine::parts).
    pub part: usize,
    /// Index into that part's blocks; `None` means every block. For an imported part: index into
    /// [`crate::gmsh::Body::surfaces`]; `None` means the whole boundary.
    pub block: Option<usize>,
    /// The side; without meaning for an imported part.
    pub side: Side,
}

impl Face {
    /// Whether a face of one block is this face or belongs to it.
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
    /// Temperature at the start of a schedule or log, K, if the file states one.
    pub start: Option<Formula>,
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

impl Place {
    /// The part that the place is or belongs to.
    pub fn part(self) -> Option<usize> {
        match self {
            Self::Part(part) => Some(part),
            Self::Face(face) => Some(face.part),
            Self::Node(_) => None,
        }
    }
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

#[cfg(test)]
mod tests {
    use super::Property;

    /// Mean and integral agree with sums over very many pieces, and a move of the integral comes back to its temperature.
    #[test]
    fn means_and_moves_of_a_table() {
        let table = Property::Table(vec![(280.0, 1.0), (300.0, 5.0), (310.0, 400.0), (320.0, 2.0)]);
        for (a, b) in [(270.0, 275.0), (270.0, 340.0), (301.0, 309.0), (319.0, 285.0), (300.0, 310.0), (335.0, 345.0), (305.0, 305.0)] {
            let n = 200_000;
            let middle = |i: i32| a + (b - a) * (f64::from(i) + 0.5) / f64::from(n);
            let expected = (0..n).map(|i| table.at(middle(i))).sum::<f64>() / f64::from(n);
            let mean = table.mean(a, b);
            assert!((mean - expected).abs() < 1e-6 * expected, "{a} to {b}: {mean} {expected}");
            let moved = table.moved(a, mean * (b - a));
            assert!((moved - b).abs() < 1e-9, "{a} to {b}: {moved}");
        }
        assert_eq!(Property::Constant(2.0).moved(300.0, -10.0), 295.0);
    }
}
