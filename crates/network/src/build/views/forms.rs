//! Pairs of patches with a closed form that holds: the shapes fit and nothing stands between them.

use super::Patch;
use crate::mesh::grid::{Grid, LocalFrame, tangents};
use crate::mesh::overlap::face_position;
use crate::mesh::sight::SidePiece;
use crate::mesh::{Mesh, bounds};
use coldplate_describe::machine::{BlockShape, Machine, Side};
use coldplate_physics::view_factors;

/// Lengths closer than this are equal, m. Chosen above rounding.
const SAME: f64 = 1e-9;

/// The blocks that may stand in the way.
pub(super) struct Forms<'a> {
    mesh: &'a Mesh,
    shapes: Vec<&'a BlockShape>,
    bounds: Vec<([f64; 3], [f64; 3])>,
    /// Boxes around imported parts, which shut out a closed form wherever they reach.
    imported: Vec<([f64; 3], [f64; 3])>,
}

/// A piece of one side of a block, with the block's grid.
#[derive(Clone, Copy)]
struct GridFace<'m> {
    grid: &'m Grid,
    piece: &'m SidePiece,
}

/// A rectangle: normal axis and direction, position along it, extents along the three machine axes.
struct Rectangle {
    axis: usize,
    sign: f64,
    at: f64,
    extents: [(f64, f64); 3],
}

impl<'a> Forms<'a> {
    /// All blocks and imported parts of a machine.
    pub(super) fn new(machine: &'a Machine, mesh: &'a Mesh) -> Self {
        let shapes: Vec<&BlockShape> = mesh.grids.iter().map(|g| &machine.parts[g.part].blocks[g.block].shape).collect();
        Self { mesh, bounds: shapes.iter().map(|s| bounds(s)).collect(), shapes, imported: mesh.tetra.iter().map(|t| t.bounds()).collect() }
    }

    /// Exchange area A F between two patches (or of one to itself), m²; `None` where no closed form holds.
    pub(super) fn exchange(&self, a: &Patch, b: &Patch) -> Option<f64> {
        let ([fa], [fb]) = (a.facets.as_slice(), b.facets.as_slice()) else { return None };
        let (ga, gb) = (&self.mesh.grids[fa.grid], &self.mesh.grids[fb.grid]);
        let whole = |patch: &Patch, facet: &SidePiece, grid: &Grid| (patch.area / facet.area(grid) - 1.0).abs() < 1e-9;
        if fa == fb && is_convex(ga, fa.side) {
            return Some(0.0);
        }
        if !whole(a, fa, ga) || !whole(b, fb, gb) {
            return None;
        }
        let (a, b) = (GridFace { grid: ga, piece: fa }, GridFace { grid: gb, piece: fb });
        match (ga.frame, gb.frame) {
            (LocalFrame::Cartesian, LocalFrame::Cartesian) if fa != fb => self.rectangles(&rectangle(ga, fa), &rectangle(gb, fb)),
            (LocalFrame::Cylindrical { .. }, LocalFrame::Cylindrical { .. }) if fa.side.axis() == 2 && fb.side.axis() == 2 => {
                self.discs(a, b)
            }
            (LocalFrame::Cylindrical { .. }, LocalFrame::Cylindrical { .. }) if fa.side.axis() == 0 && fb.side.axis() == 0 => {
                self.tubes(a, b)
            }
            (LocalFrame::Spherical { .. }, LocalFrame::Spherical { .. }) => self.spheres(a, b),
            _ => None,
        }
    }

    /// Whether nothing reaches into a box between two corners.
    fn is_clear(&self, low: [f64; 3], high: [f64; 3], aside: impl Fn(&BlockShape) -> bool) -> bool {
        let reaches = |(own_low, own_high): &([f64; 3], [f64; 3])| (0..3).all(|d| own_high[d].min(high[d]) - own_low[d].max(low[d]) > SAME);
        let is_block_in = self.shapes.iter().zip(&self.bounds).any(|(shape, bounds)| reaches(bounds) && !aside(shape));
        !is_block_in && !self.imported.iter().any(reaches)
    }

    fn rectangles(&self, a: &Rectangle, b: &Rectangle) -> Option<f64> {
        // Distances of one rectangle's near and far side from the other's plane, in front of it.
        let front = |of: &Rectangle, from: &Rectangle| {
            let (low, high) = of.extents[from.axis];
            let (p, q) = (from.sign * (low - from.at), from.sign * (high - from.at));
            (p.min(q), p.max(q))
        };
        let (in_front_of_a, in_front_of_b) = (front(b, a), front(a, b));
        if in_front_of_a.1 <= SAME || in_front_of_b.1 <= SAME {
            return Some(0.0);
        }
        if in_front_of_a.0 < -SAME || in_front_of_b.0 < -SAME {
            return None; // partly behind
        }
        let corner = |pick: fn(f64, f64) -> f64, end: fn((f64, f64)) -> f64| [0, 1, 2].map(|d| pick(end(a.extents[d]), end(b.extents[d])));
        if !self.is_clear(corner(f64::min, |e| e.0), corner(f64::max, |e| e.1), |_| false) {
            return None;
        }
        let area = |r: &Rectangle| tangents(r.axis).iter().map(|d| r.extents[*d].1 - r.extents[*d].0).product::<f64>();
        let factor = if a.axis == b.axis {
            let [p, q] = tangents(a.axis);
            view_factors::parallel_plane([a.extents[p], a.extents[q]], [b.extents[p], b.extents[q]], (b.at - a.at).abs())
        } else {
            let along = 3 - a.axis - b.axis;
            let away = |(near, far): (f64, f64)| (near.max(0.0), far);
            view_factors::perpendicular_plane([a.extents[along], away(in_front_of_b)], [b.extents[along], away(in_front_of_a)])
        };
        Some(area(a) * factor)
    }

    fn discs(&self, disc: GridFace<'_>, other: GridFace<'_>) -> Option<f64> {
        let line = axis_of(disc.grid)?;
        let is_disc = |face: GridFace<'_>| face.grid.wraps(1) && face.piece.low[0] == 0.0 && is_whole(face.grid, face.piece);
        if !same_axis(disc.grid, other.grid) || !is_disc(disc) || !is_disc(other) {
            return None;
        }
        let (fa, fb) = (disc.piece, other.piece);
        let [a, b] = [disc, other].map(|face| face_position(face.grid, face.piece.side));
        let faces = |side: Side, from: f64, to: f64| if side.is_high() { to > from + SAME } else { to < from - SAME };
        if !faces(fa.side, a, b) || !faces(fb.side, b, a) {
            return Some(0.0);
        }
        let (ra, rb) = (fa.high[0], fb.high[0]);
        let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
        for (d, across) in LocalFrame::normals(line.0).into_iter().zip(line.1) {
            (low[d], high[d]) = (across - ra.max(rb), across + ra.max(rb));
        }
        (low[line.0.index()], high[line.0.index()]) = (a.min(b), a.max(b));
        self.is_clear(low, high, |_| false).then(|| fa.area(disc.grid) * view_factors::coaxial_discs(ra, rb, (a - b).abs()))
    }

    /// Two coaxial cylinders of one length that face each other, or the outer one and itself.
    fn tubes(&self, a: GridFace<'_>, b: GridFace<'_>) -> Option<f64> {
        let (inner, outer) = match (a.piece.side, b.piece.side) {
            (Side::High0, Side::Low0) => (a, b),
            (Side::Low0, Side::High0) => (b, a),
            _ => return None,
        };
        let (line, _) = axis_of(inner.grid)?;
        let apart = |end: Side| (face_position(inner.grid, end) - face_position(outer.grid, end)).abs();
        let same_ends = [Side::Low2, Side::High2].into_iter().all(|end| apart(end) < SAME);
        let full = [inner, outer].iter().all(|face| face.grid.wraps(1) && is_whole(face.grid, face.piece));
        let (r1, r2) = (inner.grid.edges[0][inner.grid.n(0)], outer.grid.edges[0][0]);
        if !same_axis(inner.grid, outer.grid) || !same_ends || !full || r1 >= r2 {
            return None;
        }
        let around = bounds(self.shapes[outer.piece.grid]);
        let aside = |shape: &BlockShape| match shape {
            BlockShape::Cylinder { axis, base, inner: own_inner, outer: own_outer, .. } => {
                let [u, v] = LocalFrame::normals(line);
                let [cu, cv] = axis_of(outer.grid).map_or([0.0; 2], |l| l.1);
                *axis == line && (base[u] - cu).hypot(base[v] - cv) < SAME && (*own_outer <= r1 + SAME || *own_inner >= r2 - SAME)
            }
            _ => false,
        };
        let length = outer.grid.edges[2][outer.grid.n(2)] - outer.grid.edges[2][0];
        self.is_clear(around.0, around.1, aside).then(|| inner.piece.area(inner.grid) * view_factors::coaxial_cylinders(r1, r2, length)[1])
    }

    /// Two concentric spheres that face each other.
    fn spheres(&self, a: GridFace<'_>, b: GridFace<'_>) -> Option<f64> {
        let (LocalFrame::Spherical { centre }, LocalFrame::Spherical { centre: other }) = (a.grid.frame, b.grid.frame) else { return None };
        let apart = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|d| (p[d] - q[d]).powi(2)).sum::<f64>().sqrt();
        let (inner, outer) = match (a.piece.side, b.piece.side) {
            (Side::High0, Side::Low0) => (a, b),
            (Side::Low0, Side::High0) => (b, a),
            _ => return None,
        };
        let (r1, r2) = (inner.grid.edges[0][inner.grid.n(0)], outer.grid.edges[0][0]);
        if apart(&centre, &other) > SAME || r1 >= r2 || !is_whole(inner.grid, inner.piece) || !is_whole(outer.grid, outer.piece) {
            return None;
        }
        let aside = |shape: &BlockShape| match shape {
            BlockShape::Sphere { centre: own, inner, outer } => apart(own, &centre) < SAME && (*outer <= r1 + SAME || *inner >= r2 - SAME),
            _ => false,
        };
        let around = bounds(self.shapes[outer.piece.grid]);
        self.is_clear(around.0, around.1, aside).then(|| inner.piece.area(inner.grid) * view_factors::concentric_spheres(r1, r2)[1])
    }
}

/// Whether no point of a side sees another of it.
fn is_convex(grid: &Grid, side: Side) -> bool {
    matches!(grid.frame, LocalFrame::Cartesian) || side != Side::Low0
}

/// Whether a facet is all of its side.
fn is_whole(grid: &Grid, facet: &SidePiece) -> bool {
    tangents(facet.side.axis())
        .iter()
        .zip(0..2)
        .all(|(d, i)| facet.low[i] == grid.edges[*d][0] && facet.high[i] == grid.edges[*d][grid.n(*d)])
}

fn axis_of(grid: &Grid) -> Option<(coldplate_describe::machine::CoordinateAxis, [f64; 2])> {
    if let LocalFrame::Cylindrical { axis, centre, .. } = grid.frame { Some((axis, centre)) } else { None }
}

fn same_axis(a: &Grid, b: &Grid) -> bool {
    matches!((axis_of(a), axis_of(b)), (Some((p, c)), Some((q, e))) if p == q && (c[0] - e[0]).hypot(c[1] - e[1]) < SAME)
}

fn rectangle(grid: &Grid, facet: &SidePiece) -> Rectangle {
    let axis = facet.side.axis();
    let at = face_position(grid, facet.side);
    let mut extents = [(at, at); 3];
    for (i, d) in tangents(axis).into_iter().enumerate() {
        extents[d] = (facet.low[i], facet.high[i]);
    }
    Rectangle { axis, sign: if facet.side.is_high() { 1.0 } else { -1.0 }, at, extents }
}
