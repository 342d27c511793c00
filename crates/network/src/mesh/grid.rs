//! One block as a structured grid in its own orthogonal coordinates.
//!
//! Boxes use (x, y, z); cylinders use (r, theta, s), s being the coordinate along the axis; spheres use
//! (r, polar angle, azimuth), with one cell for all angles. Every geometric factor of the finite-volume network is a
//! method here, so that no other file asks for the kind of a block.

use coldplate_describe::machine::{BlockShape, CoordinateAxis, PartBlock, Side};
use std::f64::consts::{PI, TAU};

/// A structured grid over one block.
#[derive(Debug, Clone)]
pub struct Grid {
    /// Index of the part in the machine.
    pub part: usize,
    /// Index of the block in the part.
    pub block: usize,
    /// Cell edges along the three local axes, ascending; m, or rad for theta.
    pub edges: [Vec<f64>; 3],
    /// The frame the local coordinates live in.
    pub frame: LocalFrame,
    /// Number of the first cell in the mesh.
    pub first: usize,
}

/// Local coordinates of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LocalFrame {
    /// The machine's own (x, y, z).
    Cartesian,
    /// (r, theta, s) around a line parallel to a machine axis.
    Cylindrical {
        /// The axis.
        axis: CoordinateAxis,
        /// Point where the line crosses the plane normal to it: the two other coordinates in cyclic order, m.
        centre: [f64; 2],
        /// Whether the turn is complete, so that the last cell in theta touches the first.
        full_turn: bool,
    },
    /// (r, polar angle from z, azimuth from x) around a point; shells, so that r alone counts.
    Spherical {
        /// The point, m.
        centre: [f64; 3],
    },
}

impl LocalFrame {
    /// The two machine axes normal to `axis`, in cyclic order: theta runs from the first to the second.
    pub fn normals(axis: CoordinateAxis) -> [usize; 2] {
        [(axis.index() + 1) % 3, (axis.index() + 2) % 3]
    }
}

/// Cell counts along the local axes for a block, for an element size (m).
pub fn divisions(block: &PartBlock, size: f64) -> [usize; 3] {
    let count = |length: f64, least: usize| ((length / size).ceil().min(1e6) as usize).max(least);
    let (lengths, least) = match &block.shape {
        BlockShape::Box { min, max } => ([0, 1, 2].map(|d| max[d] - min[d]), [2, 2, 2]),
        BlockShape::Cylinder { length, inner, outer, turn, .. } => {
            let angle = turn.1 - turn.0;
            ([outer - inner, angle * (inner + outer) / 2.0, *length], [2, if angle > 0.99 * TAU { 4 } else { 2 }, 2])
        }
        BlockShape::Sphere { inner, outer, .. } => return [block.cells[0].unwrap_or_else(|| count(outer - inner, 2)), 1, 1],
    };
    [0, 1, 2].map(|d| block.cells[d].unwrap_or_else(|| count(lengths[d], least[d])))
}

fn uniform(low: f64, high: f64, n: usize) -> Vec<f64> {
    // The last edge is the face itself, not a rounded neighbour, so that touching faces agree.
    (0..=n).map(|i| if i == n { high } else { low + (high - low) * i as f64 / n as f64 }).collect()
}

impl Grid {
    /// The grid of `block` with the given cell counts.
    pub fn new(part: usize, index: usize, block: &PartBlock, cells: [usize; 3], first: usize) -> Self {
        let (edges, frame) = match &block.shape {
            BlockShape::Box { min, max } => ([0, 1, 2].map(|d| uniform(min[d], max[d], cells[d])), LocalFrame::Cartesian),
            BlockShape::Cylinder { axis, base, length, inner, outer, turn } => {
                let s = base[axis.index()];
                let [b, c] = LocalFrame::normals(*axis);
                let frame =
                    LocalFrame::Cylindrical { axis: *axis, centre: [base[b], base[c]], full_turn: turn.1 - turn.0 > TAU * (1.0 - 1e-9) };
                ([uniform(*inner, *outer, cells[0]), uniform(turn.0, turn.1, cells[1]), uniform(s, s + length, cells[2])], frame)
            }
            BlockShape::Sphere { centre, inner, outer } => {
                ([uniform(*inner, *outer, cells[0]), vec![0.0, PI], vec![0.0, TAU]], LocalFrame::Spherical { centre: *centre })
            }
        };
        Self { part, block: index, edges, frame, first }
    }

    /// Cells along local axis `d`.
    pub fn n(&self, d: usize) -> usize {
        self.edges[d].len() - 1
    }

    /// Cells in the grid.
    pub fn len(&self) -> usize {
        self.n(0) * self.n(1) * self.n(2)
    }

    /// Whether the grid has no cell (never true for a validated block).
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number in the mesh of the cell with local indices `c`.
    pub fn cell(&self, c: [usize; 3]) -> usize {
        self.first + c[0] + self.n(0) * (c[1] + self.n(1) * c[2])
    }

    /// Local indices of a cell given by its number in the mesh.
    pub fn indices(&self, cell: usize) -> [usize; 3] {
        let local = cell - self.first;
        [local % self.n(0), local / self.n(0) % self.n(1), local / (self.n(0) * self.n(1))]
    }

    /// All local indices, first axis fastest: the order of the cells' numbers.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        (0..self.len()).map(|i| self.indices(self.first + i))
    }

    /// Width along `d` of cells with index `i` there (m, or rad).
    pub fn width(&self, d: usize, i: usize) -> f64 {
        self.edges[d][i + 1] - self.edges[d][i]
    }

    /// Local coordinate that the temperature of a cell stands for: the middle. In r of a sphere: the radius at which a field has its
    /// mean over the cell's volume. The field is r² in a ball and 1/r in a shell, for which [`Self::half_length`] is exact.
    pub fn centre(&self, d: usize, i: usize) -> f64 {
        let (low, high) = (self.edges[d][i], self.edges[d][i + 1]);
        match self.frame {
            LocalFrame::Spherical { .. } if d == 0 => {
                // Both means with the common factor of the differences taken out, so that thin cells lose no digits.
                let cubes = high * high + high * low + low * low;
                if self.is_ball() {
                    let fifths = high.powi(4) + high.powi(3) * low + high * high * low * low + high * low.powi(3) + low.powi(4);
                    (0.6 * fifths / cubes).sqrt()
                } else {
                    cubes / (1.5 * (high + low))
                }
            }
            _ => f64::midpoint(low, high),
        }
    }

    /// Whether this is a sphere without a hole.
    fn is_ball(&self) -> bool {
        self.is_spherical() && self.edges[0][0] == 0.0
    }

    /// Whether the local coordinates are (r, polar angle, azimuth).
    pub fn is_spherical(&self) -> bool {
        matches!(self.frame, LocalFrame::Spherical { .. })
    }

    /// Whether the local coordinates are (r, theta, s).
    pub fn is_cylindrical(&self) -> bool {
        matches!(self.frame, LocalFrame::Cylindrical { .. })
    }

    /// Whether the last cell along `d` touches the first.
    pub fn wraps(&self, d: usize) -> bool {
        match self.frame {
            LocalFrame::Cartesian => false,
            LocalFrame::Cylindrical { full_turn, .. } => d == 1 && full_turn,
            LocalFrame::Spherical { .. } => d > 0,
        }
    }

    /// Volume of a cell, m³.
    pub fn volume(&self, c: [usize; 3]) -> f64 {
        if self.is_spherical() {
            let (ri, ro) = (self.edges[0][c[0]], self.edges[0][c[0] + 1]);
            return 2.0 * TAU / 3.0 * (ro - ri) * (ro * ro + ro * ri + ri * ri);
        }
        self.face_area(c, Side::High2) * self.width(2, c[2])
    }

    /// Area of one of a cell's faces, m².
    pub fn face_area(&self, c: [usize; 3], side: Side) -> f64 {
        let w = |d: usize| self.width(d, c[d]);
        let (ri, ro) = (self.edges[0][c[0]], self.edges[0][c[0] + 1]);
        match (self.frame, side) {
            (LocalFrame::Cartesian, _) => {
                let [p, q] = tangents(side.axis());
                w(p) * w(q)
            }
            (LocalFrame::Cylindrical { .. }, Side::Low0) => ri * w(1) * w(2),
            (LocalFrame::Cylindrical { .. }, Side::High0) => ro * w(1) * w(2),
            (LocalFrame::Cylindrical { .. }, Side::Low1 | Side::High1) => w(0) * w(2),
            (LocalFrame::Cylindrical { .. }, Side::Low2 | Side::High2) => (ro * ro - ri * ri) / 2.0 * w(1),
            (LocalFrame::Spherical { .. }, Side::Low0) => 2.0 * TAU * ri * ri,
            (LocalFrame::Spherical { .. }, Side::High0) => 2.0 * TAU * ro * ro,
            (LocalFrame::Spherical { .. }, _) => 0.0, // the angles have no faces
        }
    }

    /// Conduction length from a cell's temperature to one of its faces: flux = k (T - T_face) / length.
    /// Exact for one-dimensional conduction without sources along each axis. In r this is the logarithm of
    /// a tube and 1/r of a shell; solid cylinders and spheres have no such solution, and their lengths are exact
    /// for a uniform source (and, in cylinders, for a constant slope across the axis) instead.
    pub fn half_length(&self, c: [usize; 3], side: Side) -> f64 {
        let d = side.axis();
        let half = self.width(d, c[d]) / 2.0;
        if self.is_spherical() {
            let (face, centre) = (self.edges[0][c[0] + usize::from(side.is_high())], self.centre(0, c[0]));
            return match d {
                0 if face == 0.0 => centre, // a face without area
                0 if self.is_ball() => (face - centre).abs() * (face + centre) / (2.0 * face),
                0 => (face - centre).abs() * face / centre,
                _ => half,
            };
        }
        if !self.is_cylindrical() || d == 2 {
            return half;
        }
        let (ri, ro) = (self.edges[0][c[0]], self.edges[0][c[0] + 1]);
        let is_solid = self.edges[0][0] == 0.0;
        let r = self.centre(0, c[0]);
        match (d, side.is_high()) {
            (0, true) if is_solid => (ro * ro - r * r) / (2.0 * ro),
            (0, false) if ri == 0.0 => half, // a face without area
            (0, false) if is_solid => (r * r - ri * ri) / (2.0 * ri),
            (0, true) => ro * (ro / r).ln(),
            (0, false) => ri * (r / ri).ln(),
            _ if is_solid => half * r,
            _ => half * (ro - ri) / (ro / ri).ln(),
        }
    }

    /// Whether a cell lies at the block's `side`, with nothing of the same block beyond it.
    pub fn on_side(&self, c: [usize; 3], side: Side) -> bool {
        let d = side.axis();
        !self.wraps(d) && if side.is_high() { c[d] + 1 == self.n(d) } else { c[d] == 0 }
    }

    /// The cells along a side, in the order of their two other indices (lower axis fastest).
    pub fn side_cells(&self, side: Side) -> impl Iterator<Item = [usize; 3]> + '_ {
        let d = side.axis();
        let at = if side.is_high() { self.n(d) - 1 } else { 0 };
        let [p, q] = tangents(d);
        let (np, nq) = if self.wraps(d) { (0, 0) } else { (self.n(p), self.n(q)) };
        (0..np * nq).map(move |t| {
            let mut c = [at; 3];
            (c[p], c[q]) = (t % np, t / np);
            c
        })
    }

    /// Machine coordinates (m) of a point in local coordinates.
    pub fn to_machine(&self, local: [f64; 3]) -> [f64; 3] {
        match self.frame {
            LocalFrame::Cartesian => local,
            LocalFrame::Cylindrical { axis, centre, .. } => {
                let [b, c] = LocalFrame::normals(axis);
                let mut point = [0.0; 3];
                point[axis.index()] = local[2];
                point[b] = centre[0] + local[0] * local[1].cos();
                point[c] = centre[1] + local[0] * local[1].sin();
                point
            }
            LocalFrame::Spherical { centre } => {
                let ((sin, cos), (east, north)) = (local[1].sin_cos(), local[2].sin_cos());
                let direction = [sin * north, sin * east, cos];
                [0, 1, 2].map(|d| centre[d] + local[0] * direction[d])
            }
        }
    }

    /// Local coordinates of a point in machine coordinates (m); theta lies in the block's turn where
    /// the point does.
    pub fn to_local(&self, point: [f64; 3]) -> [f64; 3] {
        match self.frame {
            LocalFrame::Cartesian => point,
            LocalFrame::Cylindrical { axis, centre, .. } => {
                let [b, c] = LocalFrame::normals(axis);
                let (u, v) = (point[b] - centre[0], point[c] - centre[1]);
                let start = self.edges[1][0];
                let theta = start + (v.atan2(u) - start + 1e-12).rem_euclid(TAU) - 1e-12;
                [u.hypot(v), theta, point[axis.index()]]
            }
            LocalFrame::Spherical { centre } => {
                let [x, y, z] = [0, 1, 2].map(|d| point[d] - centre[d]);
                [x.hypot(y).hypot(z), x.hypot(y).atan2(z), y.atan2(x).rem_euclid(TAU)]
            }
        }
    }

    /// Whether a point in machine coordinates lies in the block, to within `tolerance` (m).
    pub fn contains(&self, point: [f64; 3], tolerance: f64) -> bool {
        let local = self.to_local(point);
        (0..3).all(|d| {
            let tolerance = if d == 1 && self.is_cylindrical() { tolerance / local[0].max(tolerance) } else { tolerance };
            self.wraps(d) || (local[d] >= self.edges[d][0] - tolerance && local[d] <= self.edges[d][self.n(d)] + tolerance)
        })
    }

    /// Local indices of the cell that holds a point in machine coordinates (nearest where outside).
    pub fn locate(&self, point: [f64; 3]) -> [usize; 3] {
        let local = self.to_local(point);
        [0, 1, 2].map(|d| self.edges[d].partition_point(|e| *e <= local[d]).saturating_sub(1).min(self.n(d) - 1))
    }

    /// Weights (cell, weight) that interpolate linearly to a point in machine coordinates, extrapolating
    /// linearly within the outer half cells; they sum to one. In r of a sphere, linear means in r² (ball) or
    /// 1/r (shell).
    pub fn interpolate(&self, point: [f64; 3]) -> Vec<(usize, f64)> {
        let local = self.to_local(point);
        let axes: [Vec<(usize, f64)>; 3] = [0, 1, 2].map(|d| self.interpolate_axis(d, local[d]));
        let mut weights = Vec::with_capacity(8);
        for &(k, wk) in &axes[2] {
            for &(j, wj) in &axes[1] {
                for &(i, wi) in &axes[0] {
                    weights.push((self.cell([i, j, k]), wi * wj * wk));
                }
            }
        }
        weights.retain(|(_, w)| *w != 0.0);
        weights
    }

    /// Weights (cell, weight) of the temperature on a cell's face at `side`, extrapolated linearly from
    /// the two cells nearest to it.
    pub(crate) fn surface_weights(&self, c: [usize; 3], side: Side) -> Vec<(usize, f64)> {
        let d = side.axis();
        let face = self.edges[d][c[d] + usize::from(side.is_high())];
        let along = self.interpolate_axis(d, face);
        along
            .into_iter()
            .map(|(i, w)| {
                let mut at = c;
                at[d] = i;
                (self.cell(at), w)
            })
            .collect()
    }

    /// Position of a coordinate `x` along local axis `d` between the middle of an outermost cell and its face: 0 in the middle, 1 on
    /// the face. Temperature changes evenly in it, as [`Self::half_length`] has it.
    pub(crate) fn share_to_face(&self, d: usize, x: f64, centre: f64, face: f64) -> f64 {
        (self.scale(d, x) - self.scale(d, centre)) / (self.scale(d, face) - self.scale(d, centre))
    }

    /// Scale in which the temperature is linear along local axis `d`: r² in solid cylinders and balls, the logarithm of r in tubes, 1/r
    /// in shells, else the coordinate.
    fn scale(&self, d: usize, x: f64) -> f64 {
        match self.frame {
            LocalFrame::Cylindrical { .. } if d == 0 && self.edges[0][0] == 0.0 => x * x,
            LocalFrame::Cylindrical { .. } if d == 0 => x.ln(),
            LocalFrame::Spherical { .. } if d == 0 && self.is_ball() => x * x,
            LocalFrame::Spherical { .. } if d == 0 => -1.0 / x,
            _ => x,
        }
    }

    /// The one or two cells along `d` between whose centres `x` lies, with their weights.
    fn interpolate_axis(&self, d: usize, x: f64) -> Vec<(usize, f64)> {
        let [low, high] = self.between(d, x);
        if self.n(d) == 1 { vec![low] } else { vec![low, high] }
    }

    /// The two cells along `d` between whose centres a local coordinate lies, or beside it, with their weights; a single cell has all
    /// the weight.
    pub fn between(&self, d: usize, x: f64) -> [(usize, f64); 2] {
        let n = self.n(d);
        if n == 1 {
            return [(0, 1.0), (0, 0.0)];
        }
        let between = |i: usize, j: usize, t: f64| [(i, 1.0 - t), (j, t)];
        let scale = |x: f64| if self.is_spherical() { self.scale(d, x) } else { x };
        let above = (0..n).find(|i| self.centre(d, *i) > x).unwrap_or(n);
        if self.wraps(d) && (above == 0 || above == n) {
            let (last, first) = (self.centre(d, n - 1) - TAU, self.centre(d, 0));
            let x = if above == n { x - TAU } else { x };
            return between(n - 1, 0, (x - last) / (first - last));
        }
        let j = above.clamp(1, n - 1);
        let (a, b) = (scale(self.centre(d, j - 1)), scale(self.centre(d, j)));
        between(j - 1, j, (scale(x) - a) / (b - a))
    }
}

/// The two local axes other than `d`, the lower one first.
pub fn tangents(d: usize) -> [usize; 2] {
    match d {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}
