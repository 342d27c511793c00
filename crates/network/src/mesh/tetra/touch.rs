//! Touching areas of the boundary of an imported volume with a block or another imported volume.
//!
//! Triangles are laid into the coordinates of the face they touch (a plane, or angle and length on a cylinder) and
//! clipped against its cells; two imported faces are clipped triangle by triangle in the plane of the first. On each
//! piece the linear shape functions and their products are integrated exactly, so that the area is the true one and
//! the coupling the consistent one of finite elements on both sides.

use std::collections::HashMap;
use std::f64::consts::TAU;

use super::Tetra;
use super::clip::{Corner, area, clip, quadrature, shape_functions};
use crate::mesh::grid::{Grid, LocalFrame, tangents};
use crate::mesh::overlap::{TOUCHING, face_position, indices_between, tile_polygon};
use coldplate_base::vector::{cross, dot, minus, norm};
use coldplate_describe::machine::Side;

/// Faces closer than this times the longest edge of the triangle touch, dimensionless. Chosen.
const NEAR: f64 = 1e-3;
/// Pieces smaller than this share of a triangle are rounding, dimensionless. Chosen.
const SLIVER: f64 = 1e-13;
/// Thickness of the metal that stands for a bond between matching triangles, over their longest edge; dimensionless. Chosen: drop
/// across the bond against conditioning.
const BOND: f64 = 1e-4;

/// The neighbour of an imported boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Other {
    /// A side of a grid.
    Grid(usize, Side),
    /// Another imported volume, by its place in [`crate::mesh::Mesh::tetra`].
    Tetra(usize),
}

/// Two boundaries that touch.
#[derive(Debug, Clone)]
pub struct Touch {
    /// The imported volume, by its place in [`crate::mesh::Mesh::tetra`].
    pub tetra: usize,
    /// Neighbour of the imported volume.
    pub other: Other,
    /// Shared areas, triangle by triangle.
    pub pieces: Vec<SharedArea>,
}

/// The area one triangle shares with one cell, or with one triangle of another volume. N are the shape functions of the
/// triangle, M those of the other (of a cell: one, which is 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SharedArea {
    /// Boundary triangle.
    pub face: u32,
    /// Cell by its number in the mesh, or boundary triangle of the other volume.
    pub other: u32,
    /// Integrals of N_i M_j, m²; of a cell in the first column.
    pub shared: [[f64; 3]; 3],
    /// Integrals of N_0 N_1, N_0 N_2 and N_1 N_2, m²: terms of the consistent coupling beyond pairs of nodes. Zero where the triangles
    /// match, for which corner to corner is as accurate.
    pub own: [f64; 3],
    /// Integrals of M_0 M_1, M_0 M_2 and M_1 M_2, m².
    pub far: [f64; 3],
    /// Area of the triangle's corners that is covered, m²: `shared` on the flat facet.
    pub covered: [f64; 3],
    /// Thickness of metal that stands for a perfect bond, m. Zero for a cell, which has its own half.
    pub bond: f64,
}

impl SharedArea {
    /// Shared area, m².
    pub fn area(&self) -> f64 {
        self.shared.iter().flatten().sum()
    }

    fn new(face: usize, other: usize) -> Self {
        Self { face: face as u32, other: other as u32, shared: [[0.0; 3]; 3], own: [0.0; 3], far: [0.0; 3], covered: [0.0; 3], bond: 0.0 }
    }

    /// Adds a quadrature point.
    fn add(&mut self, n: [f64; 3], m: [f64; 3], weight: f64) {
        for (row, n) in self.shared.iter_mut().zip(n) {
            row.iter_mut().zip(m).for_each(|(shared, m)| *shared += weight * n * m);
        }
        for (at, (i, j)) in PAIRS.into_iter().enumerate() {
            self.own[at] += weight * n[i] * n[j];
            self.far[at] += weight * m[i] * m[j];
        }
    }
}

/// The pairs of corners that [`SharedArea::own`] and [`SharedArea::far`] count.
pub const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// A triangle laid into the coordinates of a face.
struct Laid {
    at: [Corner; 3],
    /// True area over area in these coordinates.
    scale: f64,
}

/// Pieces shared by a volume's boundary and one side of a grid.
pub(in crate::mesh) fn with_grid(tetra: &Tetra, grid: &Grid, side: Side) -> Vec<SharedArea> {
    let mut found = Vec::new();
    // The one cell of a spherical shell has no place for triangles: spheres are joined by a stated area.
    if grid.wraps(side.axis()) || grid.is_spherical() {
        return found;
    }
    let polar = grid.is_cylindrical() && side.axis() == 2;
    let tiles = if polar { tiles(grid, side) } else { Vec::new() };
    for face in 0..tetra.body.faces.len() {
        let Some(laid) = lay(tetra, face, grid, side) else { continue };
        let total = area(&laid.at);
        let sign = total.signum();
        let mut keep = |cell: usize, polygon: &[Corner], scale: f64, sign: f64| {
            if area(polygon).abs() <= SLIVER * total.abs() {
                return;
            }
            let mut piece = SharedArea::new(face, cell);
            for (point, weight) in quadrature(polygon) {
                piece.add(shape_functions(&laid.at, &point), [1.0, 0.0, 0.0], weight * sign * scale);
            }
            piece.far = [0.0; 3];
            let flat = tetra.face_area(face) / (total.abs() * scale);
            piece.covered = piece.shared.map(|row| row[0] * flat);
            found.push(piece);
        };
        let bounds = bounds(&laid.at);
        if polar {
            let mut triangle = laid.at;
            if sign < 0.0 {
                triangle.swap(1, 2);
            }
            for tile in tiles.iter().filter(|t| (0..2).all(|d| t.low[d] < bounds.1[d] && t.high[d] > bounds.0[d])) {
                keep(tile.cell, &clip(&tile.polygon, &triangle), tile.scale, 1.0);
            }
            continue;
        }
        let [p, q] = tangents(side.axis());
        let turns: &[f64] = if grid.is_cylindrical() && side.axis() == 0 { &[-TAU, 0.0, TAU] } else { &[0.0] };
        for shift in turns {
            // Both tangents of a cylinder's mantle are (theta, s): theta comes first.
            let edges_p: &[f64] = &grid.edges[p];
            for i in indices_between(edges_p, bounds.0[0] + shift, bounds.1[0] + shift) {
                for j in indices_between(&grid.edges[q], bounds.0[1], bounds.1[1]) {
                    let (low, high) = ([edges_p[i] - shift, grid.edges[q][j]], [edges_p[i + 1] - shift, grid.edges[q][j + 1]]);
                    let rectangle = [low, [high[0], low[1]], high, [low[0], high[1]]];
                    let mut c = [0; 3];
                    c[side.axis()] = if side.is_high() { grid.n(side.axis()) - 1 } else { 0 };
                    (c[p], c[q]) = (i, j);
                    keep(grid.cell(c), &clip(&laid.at, &rectangle), laid.scale, sign);
                }
            }
        }
    }
    found
}

/// An end face's cell as a polygon.
struct Tile {
    cell: usize,
    polygon: Vec<Corner>,
    low: Corner,
    high: Corner,
    scale: f64,
}

fn tiles(grid: &Grid, side: Side) -> Vec<Tile> {
    let LocalFrame::Cylindrical { axis, .. } = grid.frame else { return Vec::new() };
    let [u, v] = LocalFrame::normals(axis);
    let tile = |c: [usize; 3]| {
        let polygon = tile_polygon(grid, c, u, v);
        let (low, high) = bounds(&polygon);
        let scale = grid.face_area(c, side) / area(&polygon).abs();
        Tile { cell: grid.cell(c), polygon, low, high, scale }
    };
    grid.side_cells(side).map(tile).collect()
}

fn bounds(points: &[Corner]) -> (Corner, Corner) {
    let mut found = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in points {
        for (d, x) in p.iter().enumerate() {
            found.0[d] = found.0[d].min(*x);
            found.1[d] = found.1[d].max(*x);
        }
    }
    found
}

fn longest_edge(t: &[[f64; 3]; 3]) -> f64 {
    norm(minus(t[1], t[0])).max(norm(minus(t[2], t[1]))).max(norm(minus(t[0], t[2])))
}

/// A boundary triangle in the tangential coordinates of a grid's side, if it lies on it and faces it.
fn lay(tetra: &Tetra, face: usize, grid: &Grid, side: Side) -> Option<Laid> {
    let corners = tetra.triangle(face);
    let near = TOUCHING.max(NEAR * longest_edge(&corners));
    let position = face_position(grid, side);
    let d = side.axis();
    let sign = if side.is_high() { 1.0 } else { -1.0 };
    let normal = tetra.face_normal(face);
    let faces = |outward: [f64; 3], least: f64| sign * dot(outward, normal) < -least * norm(normal);
    let unit = |axis: usize| {
        let mut e = [0.0; 3];
        e[axis] = 1.0;
        e
    };
    let LocalFrame::Cylindrical { axis, centre, .. } = grid.frame else {
        let [p, q] = tangents(d);
        let on = corners.iter().all(|x| (x[d] - position).abs() <= near) && faces(unit(d), 0.99);
        return on.then(|| Laid { at: corners.map(|x| [x[p], x[q]]), scale: 1.0 });
    };
    let z = axis.index();
    let [u, v] = LocalFrame::normals(axis);
    let flat = corners.map(|x| [x[u] - centre[0], x[v] - centre[1]]);
    let radial = |direction: [f64; 2]| {
        let mut e = [0.0; 3];
        (e[u], e[v]) = (direction[0], direction[1]);
        e
    };
    match d {
        0 => {
            let middle = [0, 1].map(|i| (flat[0][i] + flat[1][i] + flat[2][i]) / 3.0);
            let length = middle[0].hypot(middle[1]);
            let on = position > 0.0 && flat.iter().all(|x| (x[0].hypot(x[1]) - position).abs() <= near);
            if !on || length == 0.0 || !faces(radial(middle.map(|x| x / length)), 0.9) {
                return None;
            }
            let first = flat[0][1].atan2(flat[0][0]);
            // The three angles on one branch, whichever it is.
            let angle = |x: [f64; 2]| first + (x[1].atan2(x[0]) - first + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
            Some(Laid { at: [0, 1, 2].map(|i| [angle(flat[i]), corners[i][z]]), scale: position })
        }
        1 => {
            let (sin, cos) = position.sin_cos();
            let along = flat.map(|x| x[0] * cos + x[1] * sin);
            let on = flat.iter().all(|x| (x[1] * cos - x[0] * sin).abs() <= near) && along.iter().all(|r| *r > -near);
            (on && faces(radial([-sin, cos]), 0.99)).then(|| Laid { at: [0, 1, 2].map(|i| [along[i], corners[i][z]]), scale: 1.0 })
        }
        _ => {
            let on = corners.iter().all(|x| (x[z] - position).abs() <= near) && faces(unit(z), 0.99);
            on.then(|| Laid { at: corners.map(|x| [x[u], x[v]]), scale: 1.0 })
        }
    }
}

/// Pieces shared by the boundaries of two volumes.
pub(in crate::mesh) fn with_tetra(a: &Tetra, b: &Tetra) -> Vec<SharedArea> {
    let mut found = Vec::new();
    let box_of = |t: &[[f64; 3]; 3]| {
        let along = |d: usize, f: fn(f64, f64) -> f64, start: f64| t.iter().map(|x| x[d]).fold(start, f);
        ([0, 1, 2].map(|d| along(d, f64::min, f64::INFINITY)), [0, 1, 2].map(|d| along(d, f64::max, f64::NEG_INFINITY)))
    };
    let faces_b = b.body.faces.len();
    if faces_b == 0 {
        return found;
    }
    let size = (0..faces_b).map(|f| longest_edge(&b.triangle(f))).sum::<f64>() / faces_b as f64;
    let bin = |x: f64| (x / size).floor() as i64;
    let bins = |low: [f64; 3], high: [f64; 3]| {
        let (l, h) = (low.map(bin), high.map(bin));
        (l[0]..=h[0]).flat_map(move |i| (l[1]..=h[1]).flat_map(move |j| (l[2]..=h[2]).map(move |k| [i, j, k])))
    };
    let mut places: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for f in 0..faces_b {
        let (low, high) = box_of(&b.triangle(f));
        bins(low, high).for_each(|place| places.entry(place).or_default().push(f as u32));
    }
    let (low_b, high_b) = b.points.iter().fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |(l, h), p| {
        ([0, 1, 2].map(|d| l[d].min(p[d])), [0, 1, 2].map(|d| h[d].max(p[d])))
    });
    let extent = norm(minus(high_b, low_b));
    for face in 0..a.body.faces.len() {
        let corners = a.triangle(face);
        let (low, high) = box_of(&corners);
        let slack = 0.1 * longest_edge(&corners);
        let (low, high) = (low.map(|x| x - slack), high.map(|x| x + slack));
        if (0..3).any(|d| low[d] > high_b[d] || high[d] < low_b[d]) {
            continue;
        }
        let mut candidates: Vec<u32> = bins(low, high).filter_map(|place| places.get(&place)).flatten().copied().collect();
        candidates.sort_unstable();
        candidates.dedup();
        found.extend(candidates.into_iter().filter_map(|other| between(a, face, b, other as usize, extent)));
    }
    found
}

/// The shared area of two triangles.
fn between(a: &Tetra, face: usize, b: &Tetra, other: usize, extent: f64) -> Option<SharedArea> {
    let (ta, tb) = (a.triangle(face), b.triangle(other));
    let (na, nb) = (a.face_normal(face), b.face_normal(other));
    let cosine = -dot(na, nb) / (norm(na) * norm(nb));
    if cosine < 0.9 {
        return None;
    }
    let edge = longest_edge(&ta).max(longest_edge(&tb));
    let mut piece = SharedArea::new(face, other);
    let mut twins = [usize::MAX; 3];
    for (i, p) in ta.iter().enumerate() {
        twins[i] = tb.iter().position(|q| norm(minus(*p, *q)) <= 1e-6 * edge).unwrap_or(usize::MAX);
    }
    if !twins.contains(&usize::MAX) && twins[0] != twins[1] && twins[1] != twins[2] && twins[0] != twins[2] {
        let third = a.face_area(face) / 3.0;
        (0..3).for_each(|i| piece.shared[i][twins[i]] = third);
        piece.covered = [third; 3];
        piece.bond = BOND * edge;
        return Some(piece);
    }
    // In the plane of the first triangle.
    let n = na.map(|x| x / norm(na));
    let along = minus(ta[1], ta[0]);
    let e1 = along.map(|x| x / norm(along));
    let e2 = cross(n, e1);
    let flat = |t: &[[f64; 3]; 3]| t.map(|p| [dot(minus(p, ta[0]), e1), dot(minus(p, ta[0]), e2)]);
    let (fa, fb) = (flat(&ta), flat(&tb));
    // The second is seen from behind, so it is counted clockwise.
    let polygon = clip(&[fb[0], fb[2], fb[1]], &fa);
    let shared = area(&polygon);
    if shared <= SLIVER * area(&fa).abs() {
        return None;
    }
    let count = polygon.len() as f64;
    let centre = [0, 1].map(|d| polygon.iter().map(|p| p[d]).sum::<f64>() / count);
    let m = shape_functions(&fb, &centre);
    let there = [0, 1, 2].map(|d| m[0] * tb[0][d] + m[1] * tb[1][d] + m[2] * tb[2][d]);
    // Facets of one curved face lie apart by their sagitta, an eighth of the edge times the angle between them.
    let near = TOUCHING.max(NEAR * edge) + 0.5 * edge * cosine.min(1.0).acos();
    if dot(minus(there, ta[0]), n).abs() > near {
        return None;
    }
    for (point, weight) in quadrature(&polygon) {
        piece.add(shape_functions(&fa, &point), shape_functions(&fb, &point), weight);
    }
    piece.covered = piece.shared.map(|row| row.iter().sum());
    // A stiffer bond would tie two linear fields together that cannot agree between their corners: with a layer of
    // h²/L the jump and the constraint are both of second order.
    piece.bond = 0.1 * edge * edge / extent.max(edge);
    Some(piece)
}
