//! The surface of the mesh as flat pieces, for pictures.

use std::f64::consts::TAU;

use super::Mesh;
use super::grid::{Grid, LocalFrame};
use coldplate_describe::machine::Side;

/// Pieces around a full turn, a count. Chosen: roundness against the size of pictures.
const AROUND: f64 = 36.0;

/// A flat piece of a part's surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Facet {
    /// Index of the part.
    pub part: usize,
    /// Number of the block or imported volume it belongs to.
    pub body: usize,
    /// Corners one after the other, m.
    pub corners: Vec<[f64; 3]>,
    /// For each side, from its corner to the next, whether it is an edge of the block.
    pub edges: Vec<bool>,
    /// Direction outward, not of unit length.
    pub outward: [f64; 3],
    /// Nodes of the mesh whose mean temperature it shows.
    pub nodes: Vec<usize>,
}

impl Mesh {
    /// The outside of every block and imported part, inner bores included, in at most `most` pieces along a straight edge of a block.
    /// Faces that touch others are in it too: their neighbours hide them.
    pub fn hull(&self, most: usize) -> Vec<Facet> {
        let mut facets = Vec::new();
        for (body, grid) in self.grids.iter().enumerate() {
            for end in Side::ALL {
                side(body, grid, end, most, &mut facets);
            }
        }
        for (i, tetra) in self.tetra.iter().enumerate() {
            for (face, corners) in tetra.body.faces.iter().enumerate() {
                facets.push(Facet {
                    part: tetra.part,
                    body: self.grids.len() + i,
                    corners: tetra.triangle(face).to_vec(),
                    edges: vec![false; 3],
                    outward: tetra.face_normal(face),
                    nodes: corners.iter().map(|c| tetra.node(*c)).collect(),
                });
            }
        }
        facets
    }
}

/// Pieces along an axis of a grid.
fn pieces(grid: &Grid, d: usize, most: usize) -> usize {
    let (low, high) = ends(grid, d);
    match grid.frame {
        LocalFrame::Cylindrical { .. } if d == 1 => ((high - low) / TAU * AROUND).ceil().max(1.0) as usize,
        LocalFrame::Spherical { .. } => {
            if d == 1 {
                AROUND as usize / 2
            } else {
                AROUND as usize
            }
        }
        _ => grid.n(d).clamp(1, most.max(1)),
    }
}

fn ends(grid: &Grid, d: usize) -> (f64, f64) {
    (grid.edges[d][0], grid.edges[d][grid.n(d)])
}

/// One side of the grid of a block, whose number is `body`.
fn side(body: usize, grid: &Grid, side: Side, most: usize, facets: &mut Vec<Facet>) {
    let (d, high) = (side.axis(), side.is_high());
    let radial = !matches!(grid.frame, LocalFrame::Cartesian) && d == 0;
    // Angles have no face where the turn is complete, and a solid has none at its axis.
    if grid.wraps(d) || radial && !high && ends(grid, 0).0 == 0.0 || grid.is_spherical() && d > 0 {
        return;
    }
    let (p, q) = ((d + 1) % 3, (d + 2) % 3);
    let (np, nq) = (pieces(grid, p, most), pieces(grid, q, most));
    let (low, far) = ends(grid, d);
    let end = if high { far } else { low };
    let inside = if high { end - 0.01 * (far - low) } else { end + 0.01 * (far - low) };
    let at = |axis: usize, i: usize, n: usize| {
        let (low, high) = ends(grid, axis);
        low + (high - low) * i as f64 / n as f64
    };
    for i in 0..np {
        for j in 0..nq {
            let local = |a: f64, b: f64, end: f64| {
                let mut local = [0.0; 3];
                (local[d], local[p], local[q]) = (end, a, b);
                local
            };
            let (a, b) = ((at(p, i, np), at(p, i + 1, np)), (at(q, j, nq), at(q, j + 1, nq)));
            let corners = [(a.0, b.0), (a.1, b.0), (a.1, b.1), (a.0, b.1)];
            let middle = local(f64::midpoint(a.0, a.1), f64::midpoint(b.0, b.1), end);
            let mut behind = middle;
            behind[d] = inside;
            let (here, behind) = (grid.to_machine(middle), grid.to_machine(behind));
            let mut cell = [0; 3];
            for axis in 0..3 {
                let edges = &grid.edges[axis];
                let last = grid.n(axis) - 1;
                cell[axis] = if axis == d {
                    if high { last } else { 0 }
                } else {
                    edges.partition_point(|e| *e <= middle[axis]).clamp(1, last + 1) - 1
                };
            }
            let bounds = |axis: usize, at_end: bool| at_end && !grid.wraps(axis);
            facets.push(Facet {
                part: grid.part,
                body,
                corners: corners.iter().map(|(a, b)| grid.to_machine(local(*a, *b, end))).collect(),
                edges: vec![bounds(q, j == 0), bounds(p, i + 1 == np), bounds(q, j + 1 == nq), bounds(p, i == 0)],
                outward: [0, 1, 2].map(|k| here[k] - behind[k]),
                nodes: vec![grid.cell(cell)],
            });
        }
    }
}
