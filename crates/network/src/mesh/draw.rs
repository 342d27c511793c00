//! Shapes of the cells for viewers: points, and polyhedra between them.
//!
//! A cell of a box or a cylinder is one hexahedron with straight edges. A cell of a sphere is a shell,
//! drawn as the facets of a cube blown up to the sphere; all facets of a shell show the same temperature.

use std::f64::consts::FRAC_PI_4;

use super::grid::{Grid, LocalFrame};

/// VTK's number of a hexahedron (VTK file formats).
const HEXAHEDRON: u8 = 12;
/// VTK's number of a pyramid (VTK file formats).
const PYRAMID: u8 = 14;
/// Facets along the edge of the cube that is blown up to a sphere, a count. Chosen: roundness against the size of files.
const FACETS: usize = 6;

/// Points and polyhedra.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drawing {
    /// Coordinates, m, three by three.
    pub points: Vec<f32>,
    /// Points of the polyhedra, one after the other.
    pub connectivity: Vec<u32>,
    /// One past the last entry of each polyhedron in the connectivity.
    pub offsets: Vec<u32>,
    /// VTK type of each polyhedron.
    pub types: Vec<u8>,
    /// Index of the grid, and cell in it, of each polyhedron.
    pub owners: Vec<(usize, [usize; 3])>,
    /// Unit vector of each polyhedron from the centre of its sphere; zero in boxes and cylinders.
    pub outward: Vec<[f64; 3]>,
}

impl Drawing {
    /// Draws all grids.
    pub fn new(grids: &[Grid]) -> Self {
        let mut drawing = Self::default();
        for (g, grid) in grids.iter().enumerate() {
            match grid.frame {
                LocalFrame::Spherical { centre } => drawing.sphere(g, grid, centre),
                _ => drawing.block(g, grid),
            }
        }
        drawing
    }

    fn point(&mut self, at: [f64; 3]) -> u32 {
        self.points.extend(at.map(|x| x as f32));
        (self.points.len() / 3 - 1) as u32
    }

    fn polyhedron(&mut self, kind: u8, points: &[u32], owner: (usize, [usize; 3]), outward: [f64; 3]) {
        self.connectivity.extend(points);
        self.offsets.push(self.connectivity.len() as u32);
        self.types.push(kind);
        self.owners.push(owner);
        self.outward.push(outward);
    }

    fn block(&mut self, g: usize, grid: &Grid) {
        let first = (self.points.len() / 3) as u32;
        let n = [0, 1, 2].map(|d| grid.n(d) + 1);
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    self.point(grid.to_machine([grid.edges[0][i], grid.edges[1][j], grid.edges[2][k]]));
                }
            }
        }
        let vertex = |i: usize, j: usize, k: usize| first + (i + n[0] * (j + n[1] * k)) as u32;
        for c in grid.cells() {
            let [i, j, k] = c;
            let corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)];
            self.polyhedron(HEXAHEDRON, &corners.map(|(a, b, e)| vertex(i + a, j + b, k + e)), (g, c), [0.0; 3]);
        }
    }

    fn sphere(&mut self, g: usize, grid: &Grid, centre: [f64; 3]) {
        // The surface points of a lattice, equally spaced in angle along the cube's middle lines.
        let spread = |i: usize| (FRAC_PI_4 * (2.0 * i as f64 / FACETS as f64 - 1.0)).tan();
        let on_surface = |c: &[usize; 3]| c.iter().any(|i| *i == 0 || *i == FACETS);
        let side = FACETS + 1;
        let all = (0..side.pow(3)).map(|i| [i % side, i / side % side, i / (side * side)]);
        let lattice: Vec<[usize; 3]> = all.filter(on_surface).collect();
        let directions: Vec<[f64; 3]> = lattice.iter().map(|c| unit(c.map(spread))).collect();
        let mut number = vec![0u32; side.pow(3)];
        for (i, c) in lattice.iter().enumerate() {
            number[c[0] + side * (c[1] + side * c[2])] = i as u32;
        }
        let facets: Vec<[u32; 4]> = (0..3)
            .flat_map(|d| [0, FACETS].map(|end| (d, end)))
            .flat_map(|(d, end)| (0..FACETS * FACETS).map(move |i| (d, end, [i % FACETS, i / FACETS])))
            .map(|(d, end, [i, j])| {
                // Seen from outside the corners run against the clock.
                let (p, q) = if end > 0 { ((d + 1) % 3, (d + 2) % 3) } else { ((d + 2) % 3, (d + 1) % 3) };
                [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| {
                    let mut c = [end; 3];
                    (c[p], c[q]) = (i + a, j + b);
                    number[c[0] + side * (c[1] + side * c[2])]
                })
            })
            .collect();
        let mut below: Option<u32> = None; // first point of the surface below, or the centre of a ball
        let is_ball = grid.edges[0][0] == 0.0;
        for (i, radius) in grid.edges[0].iter().enumerate() {
            let first = (self.points.len() / 3) as u32;
            if *radius == 0.0 {
                self.point(centre);
            } else {
                for e in &directions {
                    self.point([0, 1, 2].map(|d| centre[d] + radius * e[d]));
                }
            }
            if let Some(inner) = below {
                for facet in &facets {
                    let outward = unit(facet.iter().fold([0.0; 3], |sum, p| [0, 1, 2].map(|d| sum[d] + directions[*p as usize][d])));
                    let [a, b, c, e] = facet.map(|p| first + p);
                    let owner = (g, [i - 1, 0, 0]);
                    if is_ball && i == 1 {
                        self.polyhedron(PYRAMID, &[a, e, c, b, inner], owner, outward);
                    } else {
                        let [p, q, r, s] = facet.map(|p| inner + p);
                        self.polyhedron(HEXAHEDRON, &[p, q, r, s, a, b, c, e], owner, outward);
                    }
                }
            }
            below = Some(first);
        }
    }
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / norm)
}
