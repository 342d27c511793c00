//! Cells as hexahedra: their nodes, shape functions, faces and volumes. Their edges are straight; the corners of a cylinder's
//! cells stand a little farther out than the circle, so that every cell has its true volume.

use std::f64::consts::TAU;

use super::deck::{Deck, ElementKind, ElementSet, NodeWeights};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Side;
use coldplate_network::mesh::grid::{Grid, LocalFrame};
use coldplate_solve::meshed::MeshedMachine;

/// Corners of a cell in the order of CalculiX: which ones lie at the high end of each axis.
const CORNERS: [[usize; 3]; 8] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
/// Weights below this are rounding, dimensionless. Chosen.
const LEAST_WEIGHT: f64 = 1e-12;
/// Widest cell (rad) around the axis of a cylinder that straight edges may stand for: a third of a turn. Chosen below half a turn,
/// where a polygon has no area.
const WIDEST: f64 = TAU / 3.0 * (1.0 + 1e-9);

/// The grids of a mesh with the nodes of their corners.
pub(super) struct DeckBodies<'a> {
    grids: &'a [Grid],
    /// Number of the first node of each grid.
    first: Vec<u32>,
    /// Coordinates of the nodes of all cells, m.
    nodes: Vec<[f64; 3]>,
}

impl<'a> DeckBodies<'a> {
    /// Adds the nodes and elements of all cells; element number = cell + 1.
    ///
    /// # Errors
    /// A full turn of a cylinder in too few cells.
    pub(super) fn new(model: &'a MeshedMachine, deck: &mut Deck) -> Result<Self> {
        let mut bodies = Self { grids: &model.mesh.grids, first: Vec::new(), nodes: Vec::new() };
        for (g, grid) in bodies.grids.iter().enumerate() {
            let stretch = if grid.is_cylindrical() { stretch(grid.width(1, 0)) } else { 1.0 };
            if !stretch.is_finite() {
                let part = &model.machine.parts[grid.part].name;
                return Err(Error::input(format!("'{part}' has too few cells around for elements with straight edges"))
                    .at_key(format!("part.{part}.cells"))
                    .read(grid.n(1))
                    .help("give its blocks more cells in the second place of 'cells', three or more for a full turn"));
            }
            bodies.first.push(deck.nodes.len() as u32 + 1);
            let turns = [0, 1, 2].map(|d| if d == 1 && grid.wraps(1) { grid.n(1) } else { grid.n(d) + 1 });
            for k in 0..turns[2] {
                for j in 0..turns[1] {
                    for i in 0..turns[0] {
                        if i > 0 || j == 0 || !has_axis(grid) {
                            deck.node(grid.to_machine([stretch * grid.edges[0][i], grid.edges[1][j], grid.edges[2][k]]));
                        }
                    }
                }
            }
            for c in grid.cells() {
                let corners = bodies.corners(g, c);
                // At the axis two pairs of corners are one node each.
                let is_wedge = has_axis(grid) && c[0] == 0;
                let nodes = if is_wedge { [0, 1, 2, 4, 5, 6].map(|i| corners[i]).to_vec() } else { corners.to_vec() };
                deck.element(if is_wedge { ElementKind::C3D6 } else { ElementKind::C3D8 }, ElementSet::Grid(g), nodes);
            }
        }
        bodies.nodes.clone_from(&deck.nodes);
        Ok(bodies)
    }

    pub(super) fn grid(&self, g: usize) -> &Grid {
        &self.grids[g]
    }

    /// The grid of a cell, and its indices there.
    pub(super) fn of_cell(&self, cell: usize) -> (usize, [usize; 3]) {
        let g = self.grids.partition_point(|grid| grid.first <= cell) - 1;
        (g, self.grids[g].indices(cell))
    }

    fn corner(&self, g: usize, at: [usize; 3]) -> u32 {
        let grid = &self.grids[g];
        let rings = if grid.wraps(1) { grid.n(1) } else { grid.n(1) + 1 };
        let [i, j, k] = [at[0], if grid.wraps(1) { at[1] % rings } else { at[1] }, at[2]];
        let local = match (has_axis(grid), i) {
            // One node on the axis stands first in its layer, with the others of the first line.
            (true, 0) => k * (grid.n(0) * rings + 1),
            (true, _) => k * (grid.n(0) * rings + 1) + i + grid.n(0) * j,
            (false, _) => i + (grid.n(0) + 1) * (j + rings * k),
        };
        self.first[g] + local as u32
    }

    /// The nodes at the corners of a cell.
    pub(super) fn corners(&self, g: usize, c: [usize; 3]) -> [u32; 8] {
        CORNERS.map(|high| self.corner(g, [0, 1, 2].map(|d| c[d] + high[d])))
    }

    /// Position of a point (m) in a cell along each axis, 0 to 1.
    fn shares(&self, g: usize, c: [usize; 3], point: [f64; 3]) -> [f64; 3] {
        let grid = &self.grids[g];
        let local = grid.to_local(point);
        [0, 1, 2].map(|d| {
            let (low, width) = (grid.edges[d][c[d]], grid.width(d, c[d]));
            let mut offset = local[d] - low;
            if d == 1 && grid.is_cylindrical() {
                // The nearest turn: to the middle of the cell it is half a turn at most.
                offset = (offset - width / 2.0 + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0 + width / 2.0;
            }
            (offset / width).clamp(0.0, 1.0)
        })
    }

    /// Shape functions at shares of a cell along its axes.
    fn shape(&self, g: usize, c: [usize; 3], shares: [f64; 3]) -> NodeWeights {
        let mut found = NodeWeights::new();
        for (node, high) in self.corners(g, c).into_iter().zip(CORNERS) {
            let weight: f64 = (0..3).map(|d| if high[d] == 1 { shares[d] } else { 1.0 - shares[d] }).product();
            if weight > LEAST_WEIGHT {
                add(&mut found, node, weight);
            }
        }
        found
    }

    /// Place of a node of a cell, m.
    pub(super) fn place(&self, node: u32) -> [f64; 3] {
        self.nodes[node as usize - 1]
    }

    /// The temperature at a point (m) of a cell.
    pub(super) fn at(&self, g: usize, c: [usize; 3], point: [f64; 3]) -> NodeWeights {
        self.shape(g, c, self.shares(g, c, point))
    }

    /// The temperature of a cell's face at the point of it that is nearest to a given one (m).
    pub(super) fn on_face(&self, g: usize, c: [usize; 3], side: Side, point: [f64; 3]) -> NodeWeights {
        let mut shares = self.shares(g, c, point);
        shares[side.axis()] = if side.is_high() { 1.0 } else { 0.0 };
        self.shape(g, c, shares)
    }

    /// The mean temperature of a cell.
    pub(super) fn mean(&self, g: usize, c: [usize; 3]) -> NodeWeights {
        self.shape(g, c, [0.5; 3])
    }

    /// The mean temperature of a cell's face.
    pub(super) fn face_mean(&self, g: usize, c: [usize; 3], side: Side) -> NodeWeights {
        let mut shares = [0.5; 3];
        shares[side.axis()] = if side.is_high() { 1.0 } else { 0.0 };
        self.shape(g, c, shares)
    }

    /// CalculiX's number of a cell's face, and its nodes in order around it.
    pub(super) fn face(&self, g: usize, c: [usize; 3], side: Side) -> (u8, Vec<u32>) {
        let corners = self.corners(g, c);
        let (of_hexahedron, of_wedge, around) = match side {
            Side::Low2 => (1, 1, [0, 1, 2, 3]),
            Side::High2 => (2, 2, [4, 7, 6, 5]),
            Side::Low1 => (3, 3, [0, 4, 5, 1]),
            Side::High0 => (4, 4, [1, 5, 6, 2]),
            Side::High1 => (5, 5, [2, 6, 7, 3]),
            Side::Low0 => (6, 6, [3, 7, 4, 0]),
        };
        let mut nodes = around.map(|i| corners[i]).to_vec();
        nodes.dedup();
        if nodes.first() == nodes.last() {
            nodes.pop();
        }
        (if has_axis(&self.grids[g]) && c[0] == 0 { of_wedge } else { of_hexahedron }, nodes)
    }

    /// Area (m²) of a face with straight edges, which is smaller than that of a cylinder's mantle.
    pub(super) fn face_area(&self, nodes: &[u32]) -> f64 {
        let from = self.place(nodes[0]);
        let to = |n: u32| [0, 1, 2].map(|d| self.place(n)[d] - from[d]);
        let cross = |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let sum = nodes[1..].windows(2).map(|w| cross(to(w[0]), to(w[1]))).fold([0.0; 3], |s, v| [0, 1, 2].map(|d| s[d] + v[d]));
        sum.iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0
    }

    /// Volume (m³) of a cell.
    pub(super) fn volume(&self, g: usize, c: [usize; 3]) -> f64 {
        let (_, end) = self.face(g, c, Side::Low2);
        self.face_area(&end) * self.grids[g].width(2, c[2])
    }
}

/// How much farther from the axis the corners of a polygon stand than the circle of the same area, for cells of an angle (rad);
/// infinite for an angle above [`WIDEST`].
fn stretch(angle: f64) -> f64 {
    if angle > WIDEST { f64::INFINITY } else { (angle / angle.sin()).sqrt() }
}

/// Whether a grid reaches the axis of a cylinder.
fn has_axis(grid: &Grid) -> bool {
    matches!(grid.frame, LocalFrame::Cylindrical { .. }) && grid.edges[0][0] == 0.0
}

/// Adds a weight to those of a node.
pub(super) fn add(weights: &mut NodeWeights, node: u32, weight: f64) {
    match weights.iter_mut().find(|(known, _)| *known == node) {
        Some((_, sum)) => *sum += weight,
        None => weights.push((node, weight)),
    }
}
