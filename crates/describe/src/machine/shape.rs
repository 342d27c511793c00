//! Bounds of shapes, what they contain, and whether two of them overlap.

use std::f64::consts::PI;

use super::parts::{BlockShape, Part};

/// Depth below which two shapes only touch, and distance up to which a point counts as inside, m. Chosen: above the
/// rounding of coordinates of a machine.
pub(super) const TOUCH: f64 = 1e-9;

/// Distance between two points, m.
pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>().sqrt()
}

/// Smallest and largest coordinates.
pub(super) fn bounds(shape: &BlockShape) -> ([f64; 3], [f64; 3]) {
    match shape {
        BlockShape::Box { min, max } => (*min, *max),
        BlockShape::Cylinder { axis, base, length, inner, outer, turn } => {
            let (z, u, v) = frame(axis.index());
            let (mut low, mut high) = (*base, *base);
            high[z] += length;
            // The extremes lie at the cuts or where the turn passes a coordinate axis.
            let quarters = (-8..=16).map(|k| f64::from(k) * PI / 2.0).filter(|a| (turn.0..=turn.1).contains(a));
            let angles: Vec<f64> = quarters.chain([turn.0, turn.1]).collect();
            let radii = [*inner, *outer];
            for (d, project) in [(u, f64::cos as fn(f64) -> f64), (v, f64::sin)] {
                let reach = || angles.iter().flat_map(|a| radii.iter().map(move |r| r * project(*a)));
                low[d] = base[d] + reach().fold(f64::INFINITY, f64::min);
                high[d] = base[d] + reach().fold(f64::NEG_INFINITY, f64::max);
            }
            (low, high)
        }
        BlockShape::Sphere { centre, outer, .. } => (centre.map(|x| x - outer), centre.map(|x| x + outer)),
    }
}

/// Volume, m³.
pub(super) fn volume(shape: &BlockShape) -> f64 {
    match shape {
        BlockShape::Box { min, max } => (0..3).map(|d| max[d] - min[d]).product(),
        BlockShape::Cylinder { length, inner, outer, turn, .. } => (turn.1 - turn.0) / 2.0 * (outer * outer - inner * inner) * length,
        BlockShape::Sphere { inner, outer, .. } => 4.0 / 3.0 * PI * (outer.powi(3) - inner.powi(3)),
    }
}

/// Origin of the coordinates in a part: smallest corner of the first block, centre of its base, or centre; for an
/// imported part the origin of the mesh file.
pub(super) fn origin(part: &Part) -> [f64; 3] {
    if let Some(import) = &part.import {
        return import.at;
    }
    match part.blocks.first().map(|block| &block.shape) {
        Some(BlockShape::Box { min, .. }) => *min,
        Some(BlockShape::Cylinder { base, .. }) => *base,
        Some(BlockShape::Sphere { centre, .. }) => *centre,
        None => [0.0; 3],
    }
}

impl Part {
    /// Origin of the coordinates in the part, m: smallest corner of the first block, centre of its base, or centre; for
    /// an imported part the origin of the mesh file.
    pub fn origin(&self) -> [f64; 3] {
        origin(self)
    }
}

/// The axis of a cylinder followed by the two across it in cyclic order.
fn frame(axis: usize) -> (usize, usize, usize) {
    (axis, (axis + 1) % 3, (axis + 2) % 3)
}

/// Whether a point lies inside a shape or not farther than `margin` outside (inside by more, if negative).
pub(super) fn contains(shape: &BlockShape, point: [f64; 3], margin: f64) -> bool {
    match shape {
        BlockShape::Box { min, max } => (0..3).all(|d| point[d] >= min[d] - margin && point[d] <= max[d] + margin),
        BlockShape::Cylinder { axis, base, length, inner, outer, turn } => {
            let (z, u, v) = frame(axis.index());
            let (along, x, y) = (point[z] - base[z], point[u] - base[u], point[v] - base[v]);
            let r = x.hypot(y);
            if along < -margin || along > length + margin || r > outer + margin || (*inner > 0.0 && r < inner - margin) {
                return false;
            }
            let span = turn.1 - turn.0;
            if span >= 2.0 * PI {
                return true;
            }
            // Distance to the cuts, along the circle through the point.
            let from_start = (y.atan2(x) - turn.0).rem_euclid(2.0 * PI);
            let beyond = (from_start - span).min(2.0 * PI - from_start);
            if from_start <= span { from_start.min(span - from_start) * r >= -margin } else { beyond * r <= margin }
        }
        BlockShape::Sphere { centre, inner, outer } => {
            let r = distance(point, *centre);
            r <= outer + margin && (*inner == 0.0 || r >= inner - margin)
        }
    }
}

/// Whether a point lies in any block of a part. For an imported part only the bounding box is checked; its tetrahedra
/// are searched when the machine is meshed.
pub(super) fn part_contains(part: &Part, point: [f64; 3]) -> bool {
    if let Some(import) = &part.import {
        let (low, high) = import.body.bounds();
        let slack = 0.01 * (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
        return (0..3).all(|d| (low[d] - slack..=high[d] + slack).contains(&(point[d] - import.at[d])));
    }
    part.blocks.iter().any(|block| contains(&block.shape, point, TOUCH))
}

/// Whether two shapes share volume deeper than [`TOUCH`].
///
/// The test is exact for boxes, for cylinders about parallel axes, for a box beside a full cylinder, and for spheres
/// beside all of these. Two kinds of pairs are tested by points of each shape in the other: parts of a turn for which
/// the exact test of full turns finds an overlap, and cylinders about crossed axes. This can miss an overlap of less
/// than a twelfth of the shapes' size.
pub(super) fn overlap(a: &BlockShape, b: &BlockShape) -> bool {
    let ((low_a, high_a), (low_b, high_b)) = (bounds(a), bounds(b));
    if (0..3).any(|d| high_a[d].min(high_b[d]) - low_a[d].max(low_b[d]) <= TOUCH) {
        return false;
    }
    match (a, b) {
        (BlockShape::Box { .. }, BlockShape::Box { .. }) => true,
        (BlockShape::Box { min, max }, BlockShape::Cylinder { axis, base, inner, outer, turn, .. })
        | (BlockShape::Cylinder { axis, base, inner, outer, turn, .. }, BlockShape::Box { min, max }) => {
            let (_, u, v) = frame(axis.index());
            let nearest = |d: usize| (min[d] - base[d]).max(base[d] - max[d]).max(0.0);
            let farthest = |d: usize| (min[d] - base[d]).abs().max((max[d] - base[d]).abs());
            let clear = nearest(u).hypot(nearest(v)) >= outer - TOUCH || farthest(u).hypot(farthest(v)) <= inner + TOUCH;
            !clear && (turn.1 - turn.0 >= 2.0 * PI || sampled(a, b))
        }
        (
            BlockShape::Cylinder { axis, base, inner, outer, turn, .. },
            BlockShape::Cylinder { axis: axis_b, base: base_b, inner: inner_b, outer: outer_b, turn: turn_b, .. },
        ) => {
            if axis != axis_b {
                return sampled(a, b);
            }
            let (_, u, v) = frame(axis.index());
            let apart = (base[u] - base_b[u]).hypot(base[v] - base_b[v]);
            let clear = apart >= outer + outer_b - TOUCH || apart + outer_b <= inner + TOUCH || apart + outer <= inner_b + TOUCH;
            if clear {
                return false;
            }
            let full = |turn: &(f64, f64)| turn.1 - turn.0 >= 2.0 * PI;
            if full(turn) && full(turn_b) {
                return true;
            }
            if apart > TOUCH {
                return sampled(a, b);
            }
            // Parallel axes on one line: annuli overlap if their angles do.
            let reach = outer.min(*outer_b);
            let shared = |k: f64| (turn.1.min(turn_b.1 + k) - turn.0.max(turn_b.0 + k)) * reach > TOUCH;
            [-2.0, -1.0, 0.0, 1.0, 2.0].into_iter().any(|k| shared(k * 2.0 * PI))
        }
        (BlockShape::Sphere { centre, inner, outer }, other) | (other, BlockShape::Sphere { centre, inner, outer }) => {
            // The other shape is in one piece: its distances from the centre fill the range from near to far.
            let (near, far) = distances(other, *centre);
            let reaches = near < outer - TOUCH && far > inner + TOUCH;
            let is_cut = matches!(other, BlockShape::Cylinder { turn, .. } if turn.1 - turn.0 < 2.0 * PI);
            reaches && (!is_cut || sampled(a, b))
        }
    }
}

/// Smallest and largest distance of a shape's points from a point, m; for a part of a turn, of the full turn.
pub(super) fn distances(shape: &BlockShape, from: [f64; 3]) -> (f64, f64) {
    let outside = |x: f64, low: f64, high: f64| (low - x).max(x - high).max(0.0);
    let away = |x: f64, low: f64, high: f64| (x - low).abs().max((x - high).abs());
    match shape {
        BlockShape::Box { min, max } => {
            let norm = |f: &dyn Fn(f64, f64, f64) -> f64| (0..3).map(|d| f(from[d], min[d], max[d]).powi(2)).sum::<f64>().sqrt();
            (norm(&outside), norm(&away))
        }
        BlockShape::Cylinder { axis, base, length, inner, outer, .. } => {
            let (z, u, v) = frame(axis.index());
            let r = (from[u] - base[u]).hypot(from[v] - base[v]);
            let along = |f: &dyn Fn(f64, f64, f64) -> f64| f(from[z], base[z], base[z] + length);
            (outside(r, *inner, *outer).hypot(along(&outside)), (r + outer).hypot(along(&away)))
        }
        BlockShape::Sphere { centre, inner, outer } => {
            let r = distance(from, *centre);
            (outside(r, *inner, *outer), r + outer)
        }
    }
}

/// Whether a point of the inside of one shape lies well inside the other.
fn sampled(a: &BlockShape, b: &BlockShape) -> bool {
    points(a).any(|p| contains(b, p, -TOUCH)) || points(b).any(|p| contains(a, p, -TOUCH))
}

/// Points spread over the inside of a shape.
fn points(shape: &BlockShape) -> impl Iterator<Item = [f64; 3]> + '_ {
    /// Number of points along each axis (count). Chosen: time against the size of an overlap that can be missed.
    const N: usize = 12;
    let part = |i: usize| (i as f64 + 0.5) / N as f64;
    (0..N * N * N).map(move |i| {
        let s = [part(i % N), part(i / N % N), part(i / N / N)];
        match shape {
            BlockShape::Box { min, max } => std::array::from_fn(|d| min[d] + s[d] * (max[d] - min[d])),
            BlockShape::Cylinder { axis, base, length, inner, outer, turn } => {
                let (z, u, v) = frame(axis.index());
                let (r, angle) = (inner + s[0] * (outer - inner), turn.0 + s[1] * (turn.1 - turn.0));
                let mut point = *base;
                point[z] += s[2] * length;
                point[u] += r * angle.cos();
                point[v] += r * angle.sin();
                point
            }
            BlockShape::Sphere { centre, inner, outer } => {
                // Equal volumes per point, at every height and angle.
                let (r, height, angle) = (inner + s[0] * (outer - inner), 2.0 * s[1] - 1.0, 2.0 * PI * s[2]);
                let across = (1.0 - height * height).sqrt();
                let direction = [across * angle.cos(), across * angle.sin(), height];
                std::array::from_fn(|d| centre[d] + r * direction[d])
            }
        }
    })
}
