//! An imported volume as linear finite elements: its nodes are the vertices.
//!
//! With shape functions N_i the conduction between two vertices is G_ij = -k V sum grad N_i . grad N_j over the tetrahedra they share
//! (Zienkiewicz, Taylor and Zhu, The Finite Element Method, ch. 5): a conductor of the network like any other, though it may be
//! negative on obtuse edges. A vertex holds a quarter of the volume of its tetrahedra and a third of the area of its triangles, the
//! integrals of the linear shape functions. Surface temperatures are those of the vertices: nothing lies between.

pub mod clip;
pub mod locate;
pub mod touch;

use std::sync::Arc;

use coldplate_base::vector::{cross, dot, minus, norm};
use coldplate_describe::gmsh::Body;
use coldplate_describe::machine::{Face, Import};
use locate::Locator;

/// An imported volume in the mesh.
#[derive(Debug, Clone)]
pub struct Tetra {
    /// Index of the part in the machine.
    pub part: usize,
    /// Number in the mesh of its first vertex.
    pub first: usize,
    /// Vertices in the machine's coordinates, m.
    pub points: Vec<[f64; 3]>,
    /// Connectivity and names; its own coordinates lack the part's place.
    pub body: Arc<Body>,
    /// Volume that each vertex stands for, m³.
    pub volumes: Vec<f64>,
    /// Open area that each corner of each boundary triangle stands for, m².
    pub open: Vec<[f64; 3]>,
    /// For looking up points.
    locator: Locator,
}

/// An edge with its geometric conduction: sums of -V dN_i/dx_d dN_j/dx_d (m) along the three axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Vertex with the smaller index.
    pub a: u32,
    /// Vertex with the larger index.
    pub b: u32,
    /// Conductance over conductivity along each axis, m.
    pub factor: [f64; 3],
}

impl Tetra {
    /// The volume that `import` places in the machine.
    pub(super) fn new(part: usize, import: &Import, first: usize) -> Self {
        let body = Arc::clone(&import.body);
        let points: Vec<[f64; 3]> = body.points.iter().map(|p| [0, 1, 2].map(|d| p[d] + import.at[d])).collect();
        let mut volumes = vec![0.0; points.len()];
        for (i, corners) in body.tetrahedra.iter().enumerate() {
            let quarter = body.volume(i) / 4.0;
            corners.iter().for_each(|c| volumes[*c as usize] += quarter);
        }
        let locator = Locator::new(&points, &body.tetrahedra);
        let mut tetra = Self { part, first, points, body, volumes, open: Vec::new(), locator };
        tetra.open = (0..tetra.body.faces.len()).map(|f| [tetra.face_area(f) / 3.0; 3]).collect();
        tetra
    }

    /// Number in the mesh of a vertex.
    pub fn node(&self, vertex: u32) -> usize {
        self.first + vertex as usize
    }

    /// Corners of a boundary triangle, m.
    pub fn triangle(&self, face: usize) -> [[f64; 3]; 3] {
        self.body.faces[face].map(|i| self.points[i as usize])
    }

    /// Twice the area of a boundary triangle times its outward unit normal, m².
    pub(crate) fn face_normal(&self, face: usize) -> [f64; 3] {
        let [a, b, c] = self.triangle(face);
        cross(minus(b, a), minus(c, a))
    }

    /// Area of a boundary triangle, m².
    pub fn face_area(&self, face: usize) -> f64 {
        norm(self.face_normal(face)) / 2.0
    }

    /// The boundary triangles of a machine face.
    pub fn faces_of(&self, face: Face) -> Vec<usize> {
        match face.block {
            None => (0..self.body.faces.len()).collect(),
            Some(surface) => self.body.surfaces[surface].faces.iter().map(|f| *f as usize).collect(),
        }
    }

    /// Whether a boundary triangle belongs to a machine face.
    pub fn belongs(&self, triangle: usize, face: Face) -> bool {
        face.part == self.part && face.block.is_none_or(|s| self.body.surfaces[s].faces.binary_search(&(triangle as u32)).is_ok())
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        self.volumes.iter().sum()
    }

    /// Vertices and shape functions at a point (m) that lies in the volume or, since facets cut the corners of
    /// curved faces, not farther outside than a twentieth of the nearest tetrahedron.
    pub fn interpolate(&self, point: [f64; 3]) -> Option<[(usize, f64); 4]> {
        let (tetrahedron, shape) = self.locator.find(&self.points, &self.body.tetrahedra, point)?;
        let corners = self.body.tetrahedra[tetrahedron];
        Some([0, 1, 2, 3].map(|i| (self.node(corners[i]), shape[i])))
    }

    /// Whether a point (m) lies in the volume.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        self.locator.find(&self.points, &self.body.tetrahedra, point).is_some_and(|(_, shape)| shape.iter().all(|n| *n >= 0.0))
    }

    /// The box around it, m.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let around = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        self.points.iter().fold(around, |(l, h), p| ([0, 1, 2].map(|d| l[d].min(p[d])), [0, 1, 2].map(|d| h[d].max(p[d]))))
    }

    /// Gradients of the four shape functions of a tetrahedron, 1/m.
    pub fn gradients(&self, tetrahedron: usize) -> [[f64; 3]; 4] {
        let p = self.body.tetrahedra[tetrahedron].map(|i| self.points[i as usize]);
        let (a, b, c) = (minus(p[1], p[0]), minus(p[2], p[0]), minus(p[3], p[0]));
        let six = dot(a, cross(b, c));
        let (ga, gb, gc) = (cross(b, c).map(|x| x / six), cross(c, a).map(|x| x / six), cross(a, b).map(|x| x / six));
        [[0, 1, 2].map(|d| -(ga[d] + gb[d] + gc[d])), ga, gb, gc]
    }

    /// All edges with their conduction, in ascending order.
    pub fn edges(&self) -> Vec<Edge> {
        // Corners of the six edges of a tetrahedron.
        const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        let tetrahedra = &self.body.tetrahedra;
        // Counting sort by the smaller vertex, then a small sort within.
        let mut starts = vec![0usize; self.points.len() + 1];
        for t in tetrahedra {
            for (i, j) in PAIRS {
                starts[t[i].min(t[j]) as usize + 1] += 1;
            }
        }
        for i in 0..self.points.len() {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut gathered = vec![(0u32, [0.0; 3]); 6 * tetrahedra.len()];
        for (at, t) in tetrahedra.iter().enumerate() {
            let (gradients, volume) = (self.gradients(at), self.body.volume(at));
            for (i, j) in PAIRS {
                let place = &mut next[t[i].min(t[j]) as usize];
                let factor = [0, 1, 2].map(|d| -volume * gradients[i][d] * gradients[j][d]);
                gathered[*place] = (t[i].max(t[j]), factor);
                *place += 1;
            }
        }
        let mut edges: Vec<Edge> = Vec::with_capacity(gathered.len() / 4);
        for a in 0..self.points.len() {
            let bucket = &mut gathered[starts[a]..starts[a + 1]];
            // A stable sort keeps the order of the sums.
            bucket.sort_by_key(|(b, _)| *b);
            for (b, factor) in bucket.iter() {
                match edges.last_mut() {
                    Some(last) if last.a == a as u32 && last.b == *b => (0..3).for_each(|d| last.factor[d] += factor[d]),
                    _ => edges.push(Edge { a: a as u32, b: *b, factor: *factor }),
                }
            }
        }
        edges
    }
}
