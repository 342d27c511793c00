//! Place of a point in a mesh, and the weights with which the surrounding corners give a value there.

use super::{Cells, FieldSupport, VtuField};
use crate::vector::{cross, dot, minus, norm};

/// Weight of a corner: point index, and weight.
pub type Weight = (usize, f64);

/// Place in a mesh at which a value is read.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshPlace {
    /// Within a cell: the weighted corners of a triangle or tetrahedron of the cell.
    Inside {
        /// The cell.
        cell: usize,
        /// Corners with their weights.
        corners: Vec<Weight>,
    },
    /// In no cell: the nearest point and its distance.
    Near {
        /// The point.
        point: usize,
        /// A cell with this point as a corner, if there is one.
        cell: Option<usize>,
        /// Distance to the point, in the length unit of the mesh.
        distance: f64,
    },
}

/// Distance outside a cell up to which a point still counts as inside, as a share of the cell. Chosen: closes the gaps
/// between neighbours with faces that are not plane.
const SLACK: f64 = 0.01;

/// Triangles and tetrahedra of a VTK cell type, as places among its corners; the middle nodes of edges, which follow
/// the corners, are not used.
fn simplices(shape: u8) -> &'static [&'static [usize]] {
    /// Six tetrahedra that fill a hexahedron, by its corners in VTK's order.
    const HEXAHEDRON: &[&[usize]] = &[&[0, 1, 2, 6], &[0, 2, 3, 6], &[0, 3, 7, 6], &[0, 7, 4, 6], &[0, 4, 5, 6], &[0, 5, 1, 6]];
    /// Six tetrahedra that fill a voxel, by its corners in VTK's order.
    const VOXEL: &[&[usize]] = &[&[0, 1, 3, 7], &[0, 3, 2, 7], &[0, 2, 6, 7], &[0, 6, 4, 7], &[0, 4, 5, 7], &[0, 5, 1, 7]];
    match shape {
        5 | 22 | 34 => &[&[0, 1, 2]],
        8 => &[&[0, 1, 3], &[0, 3, 2]],
        9 | 23 | 28 => &[&[0, 1, 2], &[0, 2, 3]],
        10 | 24 => &[&[0, 1, 2, 3]],
        11 => VOXEL,
        12 | 25 | 29 | 33 => HEXAHEDRON,
        13 | 26 | 31 | 32 => &[&[0, 1, 2, 5], &[0, 1, 5, 4], &[0, 4, 5, 3]],
        14 | 27 => &[&[0, 1, 2, 4], &[0, 2, 3, 4]],
        _ => &[],
    }
}

impl Cells {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The points of cell number `c`.
    pub(crate) fn corners_of(&self, c: usize) -> &[usize] {
        let from = if c == 0 { 0 } else { self.ends[c - 1] };
        &self.corners[from..self.ends[c]]
    }

    /// Place of the point `at` in these cells with corners at `points`; `None` if there are no points.
    pub fn place(&self, points: &[[f64; 3]], at: [f64; 3]) -> Option<MeshPlace> {
        let mut best: Option<(f64, MeshPlace)> = None;
        for (cell, shape) in self.shapes.iter().enumerate() {
            let own = self.corners_of(cell);
            if simplices(*shape).is_empty() || !is_near(own, points, at) {
                continue;
            }
            for simplex in simplices(*shape) {
                let Some(corners) = simplex.iter().map(|c| own.get(*c).copied()).collect::<Option<Vec<usize>>>() else { continue };
                let Some(weights) = weights(&corners, points, at) else { continue };
                let least = weights.iter().copied().fold(f64::INFINITY, f64::min);
                if least >= -SLACK && best.as_ref().is_none_or(|(before, _)| least > *before) {
                    best = Some((least, MeshPlace::Inside { cell, corners: corners.into_iter().zip(weights).collect() }));
                }
            }
        }
        best.map(|(_, place)| place).or_else(|| self.nearest(points, at))
    }

    fn nearest(&self, points: &[[f64; 3]], at: [f64; 3]) -> Option<MeshPlace> {
        let all = points.iter().map(|p| norm(minus(*p, at))).enumerate();
        let (point, distance) = all.filter(|(_, d)| d.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1))?;
        let cell = (0..self.len()).find(|c| self.corners_of(*c).contains(&point));
        Some(MeshPlace::Near { point, cell, distance })
    }
}

impl MeshPlace {
    /// Value of one component of `field` at this place; `None` for a field of cells if no cell is here.
    pub fn value(&self, field: &VtuField, component: usize) -> Option<f64> {
        let of = |i: usize| field.values.get(i * field.components + component).copied();
        match (self, field.support) {
            (MeshPlace::Inside { corners, .. }, FieldSupport::Points) => corners.iter().map(|(c, weight)| Some(weight * of(*c)?)).sum(),
            (MeshPlace::Inside { cell, .. }, FieldSupport::Cells) => of(*cell),
            (MeshPlace::Near { point, .. }, FieldSupport::Points) => of(*point),
            (MeshPlace::Near { cell, .. }, FieldSupport::Cells) => cell.and_then(of),
        }
    }
}

/// Whether a point lies in the bounding box of corners, widened by the slack.
fn is_near(corners: &[usize], points: &[[f64; 3]], at: [f64; 3]) -> bool {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in corners {
        for d in 0..3 {
            (low[d], high[d]) = (low[d].min(points[*corner][d]), high[d].max(points[*corner][d]));
        }
    }
    let slack = 3.0 * SLACK * norm(minus(high, low));
    (0..3).all(|d| at[d] >= low[d] - slack && at[d] <= high[d] + slack)
}

/// Weights of the corners of a triangle or tetrahedron that give the place `at`; `None` for a flat one, and for a
/// triangle if the place is off its plane.
fn weights(corners: &[usize], points: &[[f64; 3]], at: [f64; 3]) -> Option<Vec<f64>> {
    let origin = points[corners[0]];
    let edges: Vec<[f64; 3]> = corners[1..].iter().map(|c| minus(points[*c], origin)).collect();
    let to = minus(at, origin);
    let (a, b) = (edges[0], edges[1]);
    let normal = cross(a, b);
    let c = match edges.get(2) {
        Some(c) => *c,
        None => normal,
    };
    let volume = dot(normal, c);
    let size = norm(a) * norm(b) * norm(c);
    if volume.abs() <= 1e-12 * size || !volume.is_finite() {
        return None;
    }
    let own = [dot(cross(to, b), c) / volume, dot(cross(a, to), c) / volume, dot(normal, to) / volume];
    if edges.len() == 2 {
        // The third coordinate is in lengths of the normal.
        let off = own[2].abs() * norm(normal);
        return (off <= SLACK * norm(a).max(norm(b))).then(|| vec![1.0 - own[0] - own[1], own[0], own[1]]);
    }
    Some(vec![1.0 - own.iter().sum::<f64>(), own[0], own[1], own[2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of each shape in VTK's order, and a place inside.
    #[test]
    fn linear_fields_are_read_exactly_in_every_shape() {
        let cube = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];
        let pick = |order: &[usize]| order.iter().map(|i| cube[*i]).collect::<Vec<[f64; 3]>>();
        let cases = [
            (12, pick(&[0, 1, 2, 3, 4, 5, 6, 7])),
            (11, pick(&[0, 1, 3, 2, 4, 5, 7, 6])),
            (13, pick(&[0, 1, 3, 4, 5, 7])),
            (14, pick(&[0, 1, 2, 3, 4])),
            (10, pick(&[0, 1, 3, 4])),
            (9, pick(&[0, 1, 2, 3])),
            (8, pick(&[0, 1, 3, 2])),
            (5, pick(&[0, 1, 3])),
        ];
        for (shape, points) in cases {
            let cells = Cells { corners: (0..points.len()).collect(), ends: vec![points.len()], shapes: vec![shape] };
            let at = [0.2, 0.3, if matches!(shape, 5 | 8 | 9) { 0.0 } else { 0.1 }];
            let values = points.iter().map(|p| 3.0 + 2.0 * p[0] - p[1] + 5.0 * p[2]).collect();
            let field = VtuField { support: FieldSupport::Points, components: 1, values };
            let place = cells.place(&points, at).unwrap();
            assert!(matches!(place, MeshPlace::Inside { cell: 0, .. }), "shape {shape}: {place:?}");
            let value = place.value(&field, 0).unwrap();
            assert!((value - (3.0 + 2.0 * at[0] - at[1] + 5.0 * at[2])).abs() < 1e-12, "shape {shape}: {value}");
            // Every place of a filled cube is inside: its tetrahedra leave no gap.
            if matches!(shape, 11 | 12) {
                let inside =
                    |i: i32| cells.place(&points, [0.1 * f64::from(i % 10), 0.1 * f64::from(i / 10 % 10), 0.1 * f64::from(i / 100)]);
                assert!((0..1000).all(|i| matches!(inside(i), Some(MeshPlace::Inside { .. }))));
            }
            let off = cells.place(&points, [-3.0, 0.0, 0.0]).unwrap();
            assert_eq!(off, MeshPlace::Near { point: 0, cell: Some(0), distance: 3.0 });
        }
    }
}
