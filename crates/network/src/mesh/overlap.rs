//! Touching faces of two grids: the exact area that each pair of cells shares.

use std::f64::consts::TAU;

use super::grid::{Grid, LocalFrame, tangents};
use coldplate_describe::machine::{CoordinateAxis, Side};

/// Faces closer than this touch, m. Chosen: gaps against rounding of coordinates.
pub(crate) const TOUCHING: f64 = 1e-6;

/// A pair of cells and the area they share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Cell of the first grid, by its number in the mesh.
    pub a: usize,
    /// Cell of the second grid.
    pub b: usize,
    /// Shared area, m².
    pub area: f64,
    /// Centre of the shared area, m, in the machine's coordinates.
    pub point: [f64; 3],
}

/// A stretch that two cells share along an axis.
struct Stretch {
    /// Index of the cell of the first grid.
    a: usize,
    /// Index of the cell of the second grid.
    b: usize,
    low: f64,
    high: f64,
}

/// Stretches shared along a tangential axis.
struct Shared {
    axis: usize,
    stretches: Vec<Stretch>,
}

/// Overlaps of two ascending edge lists.
fn intervals(a: &[f64], b: &[f64], shift: f64) -> Vec<Stretch> {
    let (mut i, mut j, mut found) = (0, 0, Vec::new());
    while i + 1 < a.len() && j + 1 < b.len() {
        let (low, high) = (a[i].max(b[j] + shift), a[i + 1].min(b[j + 1] + shift));
        if high - low > 1e-9 * (a[i + 1] - a[i]) {
            found.push(Stretch { a: i, b: j, low, high });
        }
        if a[i + 1] < b[j + 1] + shift { i += 1 } else { j += 1 }
    }
    found
}

/// Overlaps of two ascending lists of angles (rad): the second list is also tried one turn earlier and later.
fn angles(a: &[f64], b: &[f64]) -> Vec<Stretch> {
    [-TAU, 0.0, TAU].iter().flat_map(|shift| intervals(a, b, *shift)).collect()
}

/// Shared areas of `a`'s face `side_a` and `b`'s face `side_b`; empty where they do not touch.
pub fn overlaps(a: &Grid, side_a: Side, b: &Grid, side_b: Side) -> Vec<Overlap> {
    match (a.frame, b.frame) {
        (LocalFrame::Cartesian, LocalFrame::Cartesian) => boxes(a, side_a, b, side_b),
        (LocalFrame::Cylindrical { axis: aa, centre: ca, .. }, LocalFrame::Cylindrical { axis: ab, centre: cb, .. }) => {
            let coaxial = aa == ab && (ca[0] - cb[0]).hypot(ca[1] - cb[1]) < TOUCHING;
            if coaxial {
                coaxials(a, side_a, b, side_b)
            } else if aa == ab && side_a.axis() == 2 {
                // Two parallel but not coaxial cylinders end to end: the second is cut into small boxes' worth of polygons.
                ends(b, side_b, a, side_a, true)
            } else {
                Vec::new()
            }
        }
        (LocalFrame::Spherical { centre: ca }, LocalFrame::Spherical { centre: cb }) => {
            let apart = (0..3).map(|d| (ca[d] - cb[d]).powi(2)).sum::<f64>().sqrt();
            if apart < TOUCHING { shells(a, side_a, b, side_b) } else { Vec::new() }
        }
        // A sphere touches a box or a cylinder in a point or a line, which has no area.
        (LocalFrame::Spherical { .. }, _) | (_, LocalFrame::Spherical { .. }) => Vec::new(),
        (LocalFrame::Cylindrical { .. }, LocalFrame::Cartesian) => ends(a, side_a, b, side_b, false),
        (LocalFrame::Cartesian, LocalFrame::Cylindrical { .. }) => {
            ends(b, side_b, a, side_a, false).into_iter().map(|o| Overlap { a: o.b, b: o.a, ..o }).collect()
        }
    }
}

/// Position of a side along its axis: m, or rad.
pub(crate) fn face_position(grid: &Grid, side: Side) -> f64 {
    let d = side.axis();
    if side.is_high() { grid.edges[d][grid.n(d)] } else { grid.edges[d][0] }
}

fn face_cell(grid: &Grid, side: Side, p: usize, ip: usize, q: usize, iq: usize) -> usize {
    let d = side.axis();
    let mut c = [0; 3];
    c[d] = if side.is_high() { grid.n(d) - 1 } else { 0 };
    (c[p], c[q]) = (ip, iq);
    grid.cell(c)
}

fn boxes(a: &Grid, side_a: Side, b: &Grid, side_b: Side) -> Vec<Overlap> {
    let d = side_a.axis();
    let opposite = side_b.axis() == d && side_a.is_high() != side_b.is_high();
    if !opposite || (face_position(a, side_a) - face_position(b, side_b)).abs() > TOUCHING {
        return Vec::new();
    }
    let [p, q] = tangents(d);
    product(a, side_a, b, side_b, &straight(a, b, p), &straight(a, b, q), |lp, lq| lp * lq)
}

/// Product of the overlaps along two tangential axes; `area` takes the two measures.
fn product(
    a: &Grid,
    side_a: Side,
    b: &Grid,
    side_b: Side,
    along_p: &Shared,
    along_q: &Shared,
    area: impl Fn(f64, f64) -> f64,
) -> Vec<Overlap> {
    let (p, q) = (along_p.axis, along_q.axis);
    let mut found = Vec::with_capacity(along_p.stretches.len() * along_q.stretches.len());
    for Stretch { a: jp, b: kp, low: lp, high: hp } in &along_p.stretches {
        for Stretch { a: jq, b: kq, low: lq, high: hq } in &along_q.stretches {
            let measure_p = if p == 0 && a.is_cylindrical() && q == 1 { (hp * hp - lp * lp) / 2.0 } else { hp - lp };
            let mut local = [face_position(a, side_a); 3];
            local[p] = (lp + hp) / 2.0;
            local[q] = (lq + hq) / 2.0;
            found.push(Overlap {
                a: face_cell(a, side_a, p, *jp, q, *jq),
                b: face_cell(b, side_b, p, *kp, q, *kq),
                area: area(measure_p, hq - lq),
                point: a.to_machine(local),
            });
        }
    }
    found
}

/// Stretches that the edges of two grids share along an axis that is straight or radial.
fn straight(a: &Grid, b: &Grid, axis: usize) -> Shared {
    Shared { axis, stretches: intervals(&a.edges[axis], &b.edges[axis], 0.0) }
}

/// Angles that two cylinders share.
fn around(a: &Grid, b: &Grid) -> Shared {
    Shared { axis: 1, stretches: angles(&a.edges[1], &b.edges[1]) }
}

/// Concentric shells, one inside the other: one cell of each.
fn shells(a: &Grid, side_a: Side, b: &Grid, side_b: Side) -> Vec<Overlap> {
    let facing = side_a.axis() == 0 && side_b.axis() == 0 && side_a.is_high() != side_b.is_high();
    if !facing || (face_position(a, side_a) - face_position(b, side_b)).abs() > TOUCHING {
        return Vec::new();
    }
    let cell = |grid: &Grid, side: Side| face_cell(grid, side, 1, 0, 2, 0);
    let outermost = if side_a.is_high() { a.n(0) - 1 } else { 0 };
    // In the middle of the only cell there is along the angles.
    let point = a.to_machine([face_position(a, side_a), a.centre(1, 0), a.centre(2, 0)]);
    vec![Overlap { a: cell(a, side_a), b: cell(b, side_b), area: a.face_area([outermost, 0, 0], side_a), point }]
}

fn coaxials(a: &Grid, side_a: Side, b: &Grid, side_b: Side) -> Vec<Overlap> {
    let d = side_a.axis();
    if side_b.axis() != d || side_a.is_high() == side_b.is_high() || a.wraps(d) || b.wraps(d) {
        return Vec::new();
    }
    let (pa, pb) = (face_position(a, side_a), face_position(b, side_b));
    let apart = match d {
        1 => ((pa - pb + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0).abs() * a.edges[0][a.n(0)],
        _ => (pa - pb).abs(),
    };
    if apart > TOUCHING {
        return Vec::new();
    }
    match d {
        0 => product(a, side_a, b, side_b, &around(a, b), &straight(a, b, 2), |t, l| pa * t * l),
        1 => product(a, side_a, b, side_b, &straight(a, b, 0), &straight(a, b, 2), |r, l| r * l),
        _ => product(a, side_a, b, side_b, &straight(a, b, 0), &around(a, b), |r2, t| r2 * t),
    }
}

/// The end face of cylinder `a` against a plane face of `b`: polygons of the annular tiles clipped to
/// `b`'s rectangles. With `polar`, `b` is a cylinder too and its tiles are clipped by quadrature.
fn ends(a: &Grid, side_a: Side, b: &Grid, side_b: Side, polar: bool) -> Vec<Overlap> {
    let LocalFrame::Cylindrical { axis, .. } = a.frame else { return Vec::new() };
    let normal_b = if polar { 2 } else { axis.index() };
    let touching = side_a.axis() == 2
        && side_b.axis() == normal_b
        && side_a.is_high() != side_b.is_high()
        && (face_position(a, side_a) - face_position(b, side_b)).abs() < TOUCHING;
    if !touching {
        return Vec::new();
    }
    let [u, v] = LocalFrame::normals(axis);
    let mut found = Vec::new();
    for c in a.side_cells(side_a) {
        let area = a.face_area(c, side_a);
        let cell = a.cell(c);
        if polar {
            let plane = face_position(a, side_a);
            let shared = scatter(a, c, b, side_b).into_iter();
            found.extend(shared.map(|(cell_b, share, at)| Overlap {
                a: cell,
                b: cell_b,
                area: area * share,
                point: in_plane(axis, at, plane),
            }));
            continue;
        }
        let tile = tile_polygon(a, c, u, v);
        let total = polygon_area(&tile);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in &tile {
            for d in 0..2 {
                (low[d], high[d]) = (low[d].min(point[d]), high[d].max(point[d]));
            }
        }
        for i in indices_between(&b.edges[u], low[0], high[0]) {
            for j in indices_between(&b.edges[v], low[1], high[1]) {
                let clipped = clip(&tile, [b.edges[u][i], b.edges[v][j]], [b.edges[u][i + 1], b.edges[v][j + 1]]);
                let share = polygon_area(&clipped) / total;
                if share > 1e-9 {
                    let (p, q) = if u < v { (i, j) } else { (j, i) };
                    let point = in_plane(axis, polygon_centre(&clipped), face_position(a, side_a));
                    found.push(Overlap { a: cell, b: face_cell(b, side_b, u.min(v), p, u.max(v), q), area: area * share, point });
                }
            }
        }
    }
    found
}

/// A point in the plane normal to `axis`, given by the two other coordinates in cyclic order.
fn in_plane(axis: CoordinateAxis, [u, v]: [f64; 2], plane: f64) -> [f64; 3] {
    let [du, dv] = LocalFrame::normals(axis);
    let mut point = [plane; 3];
    (point[du], point[dv]) = (u, v);
    point
}

/// Shares of cell `c`'s end face that fall on the cells of another cylinder's end, by 16 x 16 equal-area points: cell, share, and the
/// centre of the shared area in the plane.
fn scatter(a: &Grid, c: [usize; 3], b: &Grid, side_b: Side) -> Vec<(usize, f64, [f64; 2])> {
    // Points along radius and along angle, a count. Chosen: error of the shares against time.
    const N: usize = 16;
    let (ri, ro) = (a.edges[0][c[0]], a.edges[0][c[0] + 1]);
    let mut shares: Vec<(usize, f64, [f64; 2])> = Vec::new();
    for i in 0..N {
        let r = (ri * ri + (ro * ro - ri * ri) * (i as f64 + 0.5) / N as f64).sqrt();
        for j in 0..N {
            let theta = a.edges[1][c[1]] + a.width(1, c[1]) * (j as f64 + 0.5) / N as f64;
            let mut point = a.to_machine([r, theta, 0.0]);
            let LocalFrame::Cylindrical { axis, .. } = b.frame else { continue };
            point[axis.index()] = face_position(b, side_b);
            if !b.contains(point, 0.0) {
                continue;
            }
            let mut at = b.locate(point);
            at[2] = if side_b.is_high() { b.n(2) - 1 } else { 0 };
            let cell = b.cell(at);
            let [u, v] = LocalFrame::normals(axis).map(|d| point[d]);
            match shares.iter_mut().find(|(known, _, _)| *known == cell) {
                Some((_, share, sum)) => {
                    *share += 1.0 / (N * N) as f64;
                    *sum = [sum[0] + u, sum[1] + v];
                }
                None => shares.push((cell, 1.0 / (N * N) as f64, [u, v])),
            }
        }
    }
    for (_, share, sum) in &mut shares {
        *sum = sum.map(|x| x / (*share * (N * N) as f64));
    }
    shares
}

pub(super) fn indices_between(edges: &[f64], low: f64, high: f64) -> std::ops::Range<usize> {
    let first = edges.partition_point(|e| *e <= low).saturating_sub(1);
    let last = edges.partition_point(|e| *e < high).min(edges.len() - 1);
    first..last.max(first)
}

/// The annular tile of an end face as a polygon in the plane (u, v); arcs in steps of at most 0.2 degrees.
pub(super) fn tile_polygon(grid: &Grid, c: [usize; 3], u: usize, v: usize) -> Vec<[f64; 2]> {
    let (ri, ro) = (grid.edges[0][c[0]], grid.edges[0][c[0] + 1]);
    let (start, width) = (grid.edges[1][c[1]], grid.width(1, c[1]));
    let steps = ((width / 0.0035).ceil() as usize).max(1);
    let at = |r: f64, i: usize| {
        let point = grid.to_machine([r, start + width * i as f64 / steps as f64, 0.0]);
        [point[u], point[v]]
    };
    let mut polygon: Vec<[f64; 2]> = (0..=steps).map(|i| at(ro, i)).collect();
    if ri > 0.0 {
        polygon.extend((0..=steps).rev().map(|i| at(ri, i)));
    } else {
        polygon.push(at(0.0, 0));
    }
    polygon
}

fn polygon_area(polygon: &[[f64; 2]]) -> f64 {
    let mut twice = 0.0;
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        twice += p[0] * q[1] - p[1] * q[0];
    }
    twice.abs() / 2.0
}

/// Centroid of a polygon.
fn polygon_centre(polygon: &[[f64; 2]]) -> [f64; 2] {
    // Relative to the first corner, so that nothing cancels far from the origin.
    let origin = polygon[0];
    let (mut twice, mut moment) = (0.0, [0.0; 2]);
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (p, q) = ([p[0] - origin[0], p[1] - origin[1]], [q[0] - origin[0], q[1] - origin[1]]);
        let cross = p[0] * q[1] - p[1] * q[0];
        twice += cross;
        moment = [moment[0] + (p[0] + q[0]) * cross, moment[1] + (p[1] + q[1]) * cross];
    }
    [origin[0] + moment[0] / (3.0 * twice), origin[1] + moment[1] / (3.0 * twice)]
}

/// The part of a polygon inside a rectangle (Sutherland and Hodgman 1974: clip by one half plane after the other).
fn clip(polygon: &[[f64; 2]], low: [f64; 2], high: [f64; 2]) -> Vec<[f64; 2]> {
    let mut current = polygon.to_vec();
    for (d, limit, sign) in [(0, low[0], 1.0), (0, high[0], -1.0), (1, low[1], 1.0), (1, high[1], -1.0)] {
        let inside = |p: &[f64; 2]| sign * (p[d] - limit) >= 0.0;
        let mut next = Vec::with_capacity(current.len() + 4);
        for (i, p) in current.iter().enumerate() {
            let q = &current[(i + 1) % current.len()];
            if inside(p) {
                next.push(*p);
            }
            if inside(p) != inside(q) {
                let t = (limit - p[d]) / (q[d] - p[d]);
                let mut cut = [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])];
                cut[d] = limit;
                next.push(cut);
            }
        }
        current = next;
        if current.is_empty() {
            break;
        }
    }
    current
}
