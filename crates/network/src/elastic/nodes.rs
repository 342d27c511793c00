//! The corners of a structure's cells: numbers, places, and corners that are one.

use std::f64::consts::TAU;

use super::element::{Corners, locate};
use crate::mesh::Mesh;
use crate::mesh::grid::{Grid, tangents};
use coldplate_base::error::Result;
use coldplate_describe::machine::{BlockShape, Machine, Side};

/// Cells of a full turn, a count: chords then stand for arcs to 1 - cos(pi/40) = 0.3 % of the radius.
const TURN: f64 = 40.0;

/// The mesh that displacements are solved on: the mesh of the temperatures, with turns cut finely enough for chords.
///
/// # Errors
/// More cells than can be numbered.
pub fn mesh(machine: &Machine, thermal: &Mesh) -> Result<Mesh> {
    let blocks = machine.parts.iter().flat_map(|p| &p.blocks);
    let finer = |(n, block): ([usize; 3], &coldplate_describe::machine::PartBlock)| match &block.shape {
        BlockShape::Cylinder { turn, .. } => [n[0], n[1].max(((turn.1 - turn.0) / TAU * TURN).ceil() as usize), n[2]],
        _ => n,
    };
    let counts: Vec<[usize; 3]> = thermal.divisions().into_iter().zip(blocks).map(finer).collect();
    Mesh::with_divisions(machine, &counts, thermal.element_size)
}

/// Corners of the cells of all grids, numbered grid by grid.
pub struct Nodes<'a> {
    mesh: &'a Mesh,
    /// First corner of each grid, and one past the last.
    first: Vec<usize>,
    /// A corner that stands for each corner and moves as it does; a chain of them ends at a corner that stands for itself.
    same: Vec<u32>,
}

impl<'a> Nodes<'a> {
    /// All corners, each for itself except on the axis of a solid cylinder.
    pub fn new(mesh: &'a Mesh) -> Self {
        let mut first = vec![0];
        first.extend(mesh.grids.iter().scan(0, |sum, grid| {
            *sum += (0..3).map(|d| along(grid, d)).product::<usize>();
            Some(*sum)
        }));
        let same = (0..*first.last().unwrap_or(&0) as u32).collect();
        let mut nodes = Self { mesh, first, same };
        for (g, grid) in mesh.grids.iter().enumerate().filter(|(_, grid)| grid.is_cylindrical() && grid.edges[0][0] == 0.0) {
            for (j, k) in (0..along(grid, 1)).flat_map(|j| (0..along(grid, 2)).map(move |k| (j, k))) {
                nodes.join(nodes.at(g, [0, 0, k]), nodes.at(g, [0, j, k]));
            }
        }
        nodes
    }

    /// Number of corners.
    pub fn len(&self) -> usize {
        self.same.len()
    }

    /// The corner with indices along a grid's local axes; a full turn ends where it begins.
    pub fn at(&self, g: usize, at: [usize; 3]) -> u32 {
        let n = [0, 1, 2].map(|d| along(&self.mesh.grids[g], d));
        (self.first[g] + at[0] + n[0] * (at[1] % n[1] + n[1] * at[2])) as u32
    }

    /// Corners of a grid with their local indices.
    pub(crate) fn of_grid(&self, g: usize) -> impl Iterator<Item = (u32, [usize; 3])> + '_ {
        let n = [0, 1, 2].map(|d| along(&self.mesh.grids[g], d));
        (0..n[0] * n[1] * n[2]).map(move |i| ((self.first[g] + i) as u32, [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])]))
    }

    /// Place of a corner, m.
    pub fn place(&self, g: usize, at: [usize; 3]) -> [f64; 3] {
        let grid = &self.mesh.grids[g];
        grid.to_machine([0, 1, 2].map(|d| grid.edges[d][at[d]]))
    }

    /// The corners of a cell.
    pub fn of_cell(&self, g: usize, c: [usize; 3]) -> [u32; 8] {
        corners(c).map(|at| self.at(g, at))
    }

    /// Places of the corners of a cell, m.
    pub fn places(&self, g: usize, c: [usize; 3]) -> Corners {
        corners(c).map(|at| self.place(g, at))
    }

    /// The corners of a cell's face with their places.
    pub(crate) fn of_face(&self, g: usize, c: [usize; 3], side: Side) -> [(u32, [f64; 3]); 4] {
        let (d, [p, q]) = (side.axis(), tangents(side.axis()));
        [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| {
            let mut at = c;
            at[d] += usize::from(side.is_high());
            (at[p], at[q]) = (at[p] + i, at[q] + j);
            (self.at(g, at), self.place(g, at))
        })
    }

    /// The corners of a cell's face with their weights at a point (m) of it.
    pub fn on_face(&self, g: usize, c: [usize; 3], side: Side, point: [f64; 3]) -> [(u32, f64); 4] {
        // In the brick's own axes: linear motion stays linear here too, where chords stand for arcs.
        let at = locate(&self.places(g, c), point);
        let [s, t] = tangents(side.axis()).map(|d| f64::midpoint(at[d], 1.0));
        let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
        let corners = self.of_face(g, c, side);
        std::array::from_fn(|i| (corners[i].0, weights[i]))
    }

    /// The corner that stands for one.
    pub fn root(&self, node: u32) -> u32 {
        let mut at = node;
        while self.same[at as usize] != at {
            at = self.same[at as usize];
        }
        at
    }

    /// Lets two corners move as one.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.same[a.max(b) as usize] = a.min(b);
    }
}

/// Different corners along a local axis of a grid.
fn along(grid: &Grid, d: usize) -> usize {
    grid.n(d) + usize::from(!grid.wraps(d))
}

fn corners(c: [usize; 3]) -> [[usize; 3]; 8] {
    std::array::from_fn(|i| [c[0] + (i & 1), c[1] + (i >> 1 & 1), c[2] + (i >> 2 & 1)])
}
