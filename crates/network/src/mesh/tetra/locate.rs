//! Search for the tetrahedron that holds a point: uniform bins over the bounding box.

use coldplate_base::vector::{cross, dot, minus};

/// Largest distance of a point outside a tetrahedron, in shape functions (dimensionless). Chosen: facets cut the corners of curved
/// faces.
const OUTSIDE: f64 = 0.05;
/// Tolerance of "inside", in shape functions (dimensionless). Chosen above rounding.
const INSIDE: f64 = 1e-9;

/// Tetrahedra by bin.
#[derive(Debug, Clone, Default)]
pub(crate) struct Locator {
    low: [f64; 3],
    size: f64,
    n: [usize; 3],
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Locator {
    /// Bins about as many as tetrahedra; each tetrahedron is in every bin its box touches.
    pub(super) fn new(points: &[[f64; 3]], tetrahedra: &[[u32; 4]]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points {
            for d in 0..3 {
                (low[d], high[d]) = (low[d].min(p[d]), high[d].max(p[d]));
            }
        }
        let extent = [0, 1, 2].map(|d| (high[d] - low[d]).max(1e-9));
        let size = (extent[0] * extent[1] * extent[2] / (tetrahedra.len().max(1) as f64 / 4.0)).cbrt();
        // Margins let a point just outside find its neighbours.
        let low = low.map(|x| x - size / 2.0);
        let n = extent.map(|e| (((e + size) / size).ceil() as usize).clamp(1, 2000));
        let mut found = Self { low, size, n, starts: vec![0; n[0] * n[1] * n[2] + 1], items: Vec::new() };
        let ranges = |t: &[u32; 4]| {
            let p = t.map(|i| points[i as usize]);
            [0, 1, 2].map(|d| {
                let (a, b) =
                    (p.iter().map(|x| x[d]).fold(f64::INFINITY, f64::min), p.iter().map(|x| x[d]).fold(f64::NEG_INFINITY, f64::max));
                let slack = OUTSIDE * (b - a);
                (found.bin(d, a - slack), found.bin(d, b + slack))
            })
        };
        let all: Vec<[(usize, usize); 3]> = tetrahedra.iter().map(ranges).collect();
        let bins = |r: &[(usize, usize); 3]| {
            let r = *r;
            (r[2].0..=r[2].1)
                .flat_map(move |k| (r[1].0..=r[1].1).flat_map(move |j| (r[0].0..=r[0].1).map(move |i| i + n[0] * (j + n[1] * k))))
        };
        for r in &all {
            bins(r).for_each(|b| found.starts[b + 1] += 1);
        }
        for i in 1..found.starts.len() {
            found.starts[i] += found.starts[i - 1];
        }
        let mut next = found.starts.clone();
        found.items = vec![0; found.starts.last().map_or(0, |s| *s as usize)];
        for (t, r) in all.iter().enumerate() {
            bins(r).for_each(|b| {
                found.items[next[b] as usize] = t as u32;
                next[b] += 1;
            });
        }
        found
    }

    fn bin(&self, d: usize, x: f64) -> usize {
        (((x - self.low[d]) / self.size).max(0.0) as usize).min(self.n[d] - 1)
    }

    /// The tetrahedron that holds `point`, or nearly does, and its shape functions there.
    pub(super) fn find(&self, points: &[[f64; 3]], tetrahedra: &[[u32; 4]], point: [f64; 3]) -> Option<(usize, [f64; 4])> {
        let [i, j, k] = [0, 1, 2].map(|d| self.bin(d, point[d]));
        let bin = i + self.n[0] * (j + self.n[1] * k);
        let mut best: Option<(usize, [f64; 4], f64)> = None;
        for t in &self.items[self.starts[bin] as usize..self.starts[bin + 1] as usize] {
            let shape = shape_functions(tetrahedra[*t as usize].map(|c| points[c as usize]), point);
            let least = shape.iter().copied().fold(f64::INFINITY, f64::min);
            if least >= -INSIDE {
                return Some((*t as usize, shape));
            }
            if least >= -OUTSIDE && best.is_none_or(|(.., l)| least > l) {
                best = Some((*t as usize, shape, least));
            }
        }
        best.map(|(t, shape, _)| (t, shape))
    }
}

/// The four linear shape functions of a tetrahedron at a point: its barycentric coordinates.
fn shape_functions(p: [[f64; 3]; 4], at: [f64; 3]) -> [f64; 4] {
    let (a, b, c, x) = (minus(p[1], p[0]), minus(p[2], p[0]), minus(p[3], p[0]), minus(at, p[0]));
    let six = dot(a, cross(b, c));
    let (u, v, w) = (dot(x, cross(b, c)) / six, dot(x, cross(c, a)) / six, dot(x, cross(a, b)) / six);
    [1.0 - u - v - w, u, v, w]
}
