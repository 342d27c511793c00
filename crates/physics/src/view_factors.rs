//! View factors of pairs of surfaces in closed form: the share of the first surface's radiation, emitted diffusely and
//! evenly, that arrives at the second. Nothing stands between them.
//!
//! `C-..` is the number in J. R. Howell's catalogue of radiation heat transfer configuration factors. By reciprocity A1
//! F12 = A2 F21; lengths in m.

use std::f64::consts::{FRAC_1_PI, PI};

/// View factor between two equal aligned parallel rectangles `a` x `b` (m) at `distance` (m).
///
/// Closed form (Howell's catalogue C-11); rounding costs digits where the rectangles are smaller
/// than about 1e-3 of their distance.
pub fn parallel_rectangles(a: f64, b: f64, distance: f64) -> f64 {
    let (x, y) = (a / distance, b / distance);
    let (x1, y1) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let logarithm = (x1 * y1 / (1.0 + x * x + y * y).sqrt()).ln();
    let arcs = x * y1 * (x / y1).atan() + y * x1 * (y / x1).atan() - x * x.atan() - y * y.atan();
    2.0 / (PI * x * y) * (logarithm + arcs)
}

/// View factor from a rectangle `depth1` x `width` to one `depth2` x `width` (m) at a right angle to
/// it, the common edge being `width` long. Closed form (Howell's catalogue C-14).
pub fn perpendicular_rectangles(width: f64, depth1: f64, depth2: f64) -> f64 {
    let (w, h) = (depth1 / width, depth2 / width);
    let (w2, h2) = (w * w, h * h);
    let s = w2 + h2;
    let arcs = w * (1.0 / w).atan() + h * (1.0 / h).atan() - s.sqrt() * (1.0 / s.sqrt()).atan();
    let all = 1.0 + s;
    let logarithm =
        ((1.0 + w2) * (1.0 + h2) / all).ln() + w2 * (w2 * all / ((1.0 + w2) * s)).ln() + h2 * (h2 * all / ((1.0 + h2) * s)).ln();
    (arcs + 0.25 * logarithm) / (PI * w)
}

/// View factor from a disc of radius `r1` to a coaxial parallel disc of radius `r2` at `distance` (m).
/// Closed form (Howell's catalogue C-41).
pub fn coaxial_discs(r1: f64, r2: f64, distance: f64) -> f64 {
    let (x, y) = (r1 / distance, r2 / distance);
    let s = 1.0 + (1.0 + y * y) / (x * x);
    // [s - (s² - 4 q)^(1/2)]/2, in a form without cancellation for small discs.
    let q = (y / x) * (y / x);
    2.0 * q / (s + (s * s - 4.0 * q).sqrt())
}

/// View factor from a disc of radius `radius` to the inside of a cylinder of this radius and of `length`, closed at one
/// end by the disc: 1 - F to the other end (C-41 and closure).
pub fn end_to_cylinder(radius: f64, length: f64) -> f64 {
    1.0 - coaxial_discs(radius, radius, length)
}

/// View factor of the inside of a cylinder to itself: 1 - 2 F to an end, by reciprocity with [`end_to_cylinder`].
pub fn cylinder_to_itself(radius: f64, length: f64) -> f64 {
    1.0 - radius / length * end_to_cylinder(radius, length)
}

/// A rectangle's extent along one axis: low and high, m.
pub(crate) type RectangleExtent = (f64, f64);

/// View factor from one rectangle to another in a parallel plane at `distance`. The sides lie along the same two axes,
/// anywhere on them: extents of the first, then of the second (C-13; A. Ehlert and T. F. Smith, J. Thermophys. Heat
/// Transfer 7 (1993) 173).
///
/// The sum over the sixteen pairs of corners cancels: digits are lost as distance⁴ over the product of the areas.
pub fn parallel_plane(first: [RectangleExtent; 2], second: [RectangleExtent; 2], distance: f64) -> f64 {
    let z2 = distance * distance;
    let g = |u: f64, v: f64| {
        let (p, q) = ((u * u + z2).sqrt(), (v * v + z2).sqrt());
        v * p * (v / p).atan() + u * q * (u / q).atan() - 0.5 * z2 * (u * u + v * v + z2).ln()
    };
    let sum = corners(|x, y, xi, eta| g(x - xi, y - eta), first, second);
    (0.5 * FRAC_1_PI * sum / area(first)).clamp(0.0, 1.0)
}

/// View factor from one rectangle to another in a plane at a right angle, both with a pair of sides parallel to the
/// line where the planes meet. Each is given by its extents along that line and away from it (at least 0). They need
/// not touch the line, nor lie at equal places along it (C-15; Ehlert and Smith 1993).
pub fn perpendicular_plane(first: [RectangleExtent; 2], second: [RectangleExtent; 2]) -> f64 {
    let g = |along: f64, x: f64, z: f64| {
        let (v2, c2) = (along * along, x * x + z * z);
        let c = c2.sqrt();
        let arc = if c > 0.0 { along * c * (along / c).atan() } else { 0.0 };
        let logarithm = if c2 + v2 > 0.0 { 0.25 * (c2 - v2) * (c2 + v2).ln() } else { 0.0 };
        arc - logarithm
    };
    let sum = corners(|y, x, eta, z| g(y - eta, x, z), first, second);
    (0.5 * FRAC_1_PI * sum / area(first)).clamp(0.0, 1.0)
}

/// Sum of `g` over the four corners of each of two rectangles, with the sign of the corners' product.
fn corners(g: impl Fn(f64, f64, f64, f64) -> f64, first: [RectangleExtent; 2], second: [RectangleExtent; 2]) -> f64 {
    let ends = |e: RectangleExtent| [(e.0, -1.0), (e.1, 1.0)];
    let mut sum = 0.0;
    for (x, sx) in ends(first[0]) {
        for (y, sy) in ends(first[1]) {
            for (xi, sxi) in ends(second[0]) {
                for (eta, seta) in ends(second[1]) {
                    sum += sx * sy * sxi * seta * g(x, y, xi, eta);
                }
            }
        }
    }
    sum
}

fn area([a, b]: [RectangleExtent; 2]) -> f64 {
    (a.1 - a.0) * (b.1 - b.0)
}

/// View factors in the gap of two endless concentric cylinders of radii `r1` < `r2`: [F11, F12, F21, F22].
pub fn long_cylinders(r1: f64, r2: f64) -> [f64; 4] {
    [0.0, 1.0, r1 / r2, 1.0 - r1 / r2]
}

/// View factors in the gap of two concentric spheres of radii `r1` < `r2`: [F11, F12, F21, F22].
pub fn concentric_spheres(r1: f64, r2: f64) -> [f64; 4] {
    let share = (r1 / r2).powi(2);
    [0.0, 1.0, share, 1.0 - share]
}

/// View factors in the gap of two concentric cylinders of radii `r1` < `r2` and one `length`, without ends: [F11, F12,
/// F21, F22] (C-91 and C-92). The remainder of a row leaves through the two open ends, half through each.
pub fn coaxial_cylinders(r1: f64, r2: f64, length: f64) -> [f64; 4] {
    let (r, h) = (r2 / r1, length / r1);
    let (r_2, h_2) = (r * r, h * h);
    let (a, b) = (h_2 + r_2 - 1.0, h_2 - r_2 + 1.0);
    let root = ((a + 2.0).powi(2) - 4.0 * r_2).max(0.0).sqrt();
    let arcs = root * (b / (r * a)).clamp(-1.0, 1.0).acos() + b * (1.0 / r).asin() - PI * a / 2.0;
    let inward = (1.0 - FRAC_1_PI * ((b / a).clamp(-1.0, 1.0).acos() - arcs / (2.0 * h))) / r;
    let s = (4.0 * r_2 + h_2).sqrt() / h;
    let inner = ((4.0 * (r_2 - 1.0) + h_2 / r_2 * (r_2 - 2.0)) / (h_2 + 4.0 * (r_2 - 1.0))).clamp(-1.0, 1.0).asin();
    let itself = 1.0 - 1.0 / r + 2.0 / (PI * r) * (2.0 * (r_2 - 1.0).sqrt() / h).atan()
        - h / (2.0 * PI * r) * (s * inner - ((r_2 - 2.0) / r_2).asin() + PI / 2.0 * (s - 1.0));
    [0.0, r * inward, inward, itself]
}

/// View factor from a sphere to a disc of radius `radius` whose axis passes through the sphere's centre at `distance`:
/// the solid angle over 4 pi. The result does not depend on the sphere's radius if that is below the distance.
pub fn sphere_to_disc(radius: f64, distance: f64) -> f64 {
    let h = radius / distance;
    // [1 - (1 + h²)^(-1/2)]/2, in a form without cancellation for small discs.
    let s = (1.0 + h * h).sqrt();
    0.5 * h * h / (s * (1.0 + s))
}

/// View factor from a small plane element to a disc of radius `radius` on its normal at `distance`.
pub fn element_to_disc(radius: f64, distance: f64) -> f64 {
    radius * radius / (radius * radius + distance * distance)
}

/// View factors of a small convex body of `area` in a large room of `room` (m²): [F11, F12, F21, F22].
pub fn body_in_room(area: f64, room: f64) -> [f64; 4] {
    [0.0, 1.0, area / room, 1.0 - area / room]
}
