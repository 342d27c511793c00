//! Polygons in a plane: clipping, and integrals of linear functions and their products.

/// A corner of a polygon.
pub type Corner = [f64; 2];

/// The part of a polygon inside a convex one, both counted counter-clockwise (Sutherland and Hodgman 1974: clip by
/// one half plane after the other).
pub fn clip(polygon: &[Corner], convex: &[Corner]) -> Vec<Corner> {
    let mut current = polygon.to_vec();
    for (i, a) in convex.iter().enumerate() {
        let b = convex[(i + 1) % convex.len()];
        let height = |p: &Corner| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        let mut next = Vec::with_capacity(current.len() + 2);
        for (j, p) in current.iter().enumerate() {
            let q = &current[(j + 1) % current.len()];
            let (hp, hq) = (height(p), height(q));
            if hp >= 0.0 {
                next.push(*p);
            }
            if (hp >= 0.0) != (hq >= 0.0) {
                let t = hp / (hp - hq);
                next.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
        }
        current = next;
        if current.is_empty() {
            break;
        }
    }
    current
}

/// Signed area, positive counter-clockwise.
pub fn area(polygon: &[Corner]) -> f64 {
    let Some(first) = polygon.first() else { return 0.0 };
    let mut twice = 0.0;
    for pair in polygon.windows(2) {
        // Relative to the first corner: far from the origin nothing cancels.
        let (p, q) = ([pair[0][0] - first[0], pair[0][1] - first[1]], [pair[1][0] - first[0], pair[1][1] - first[1]]);
        twice += p[0] * q[1] - p[1] * q[0];
    }
    twice / 2.0
}

/// Points and weights that integrate quadratic functions over a polygon exactly: a fan of triangles with the
/// midpoints of their edges. The weights sum to the area; some are negative where the polygon is not convex.
pub(crate) fn quadrature(polygon: &[Corner]) -> Vec<(Corner, f64)> {
    let mut found = Vec::new();
    let Some(a) = polygon.first() else { return found };
    for pair in polygon[1..].windows(2) {
        let (b, c) = (pair[0], pair[1]);
        let third = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 6.0;
        if third != 0.0 {
            let middle = |p: &Corner, q: &Corner| [(p[0] + q[0]) / 2.0, (p[1] + q[1]) / 2.0];
            found.extend([(middle(a, &b), third), (middle(&b, &c), third), (middle(&c, a), third)]);
        }
    }
    found
}

/// The three linear shape functions of a triangle at a point.
pub(crate) fn shape_functions(t: &[Corner; 3], at: &Corner) -> [f64; 3] {
    let twice = area(t) * 2.0;
    let part = |b: &Corner, c: &Corner| ((b[0] - at[0]) * (c[1] - at[1]) - (b[1] - at[1]) * (c[0] - at[0])) / twice;
    let (u, v) = (part(&t[1], &t[2]), part(&t[2], &t[0]));
    [u, v, 1.0 - u - v]
}
