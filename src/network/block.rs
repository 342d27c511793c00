//! Conduction inside one structured block, without a list of its conductors.
//!
//! The cells of a block are numbered line by line, and their faces depend on the first local index
//! only (the radius of a cylinder; nothing, for a box). So the conductances of millions of faces are
//! three short tables, and a product with them moves the temperatures and nothing else.

use std::ops::{AddAssign, Mul, Range, Sub};

use crate::machine::Property;

/// A structured block of nodes, joined to their neighbours along three local axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Node of its first cell; the others follow, first axis fastest.
    pub first: usize,
    /// Cells along the three local axes.
    pub cells: [usize; 3],
    /// Whether the last cell along the second axis touches the first.
    pub wraps: bool,
    /// Conductivity along each axis: index into the network's properties.
    pub property: [u32; 3],
    /// Geometry of the face between a cell and the next one along each axis, by the cell's first index.
    pub faces: [Vec<Gap>; 3],
}

/// Geometry of a face between two cells.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gap {
    /// Area, m² (0 where there is no next cell).
    pub area: f64,
    /// Conduction length from the first cell to the face, m.
    pub length_a: f64,
    /// Conduction length from the face to the second cell, m.
    pub length_b: f64,
}

/// Coefficients of the faces along the three axes, by a cell's first index, W/K.
pub type Profile<T> = [Vec<T>; 3];

/// What the kernels need of a number.
pub trait Real: Copy + Send + Sync + Default + Mul<Output = Self> + Sub<Output = Self> + AddAssign {}
impl<T: Copy + Send + Sync + Default + Mul<Output = T> + Sub<Output = T> + AddAssign> Real for T {}

/// Part of one line of cells along the first axis: what a kernel works on.
#[derive(Debug, Clone)]
pub struct Segment {
    /// First indices of its cells.
    pub along: Range<usize>,
    /// Node of the cell at `along.start`.
    pub node: usize,
    /// Distance in nodes to the neighbour below and above along the second and third axis, where there is one.
    pub neighbours: [Option<isize>; 4],
}

impl Block {
    /// Cells in the block.
    pub fn len(&self) -> usize {
        self.cells.iter().product()
    }

    /// Whether the block has no cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Nodes of the block.
    pub fn nodes(&self) -> Range<usize> {
        self.first..self.first + self.len()
    }

    /// Local indices of a node.
    pub fn indices(&self, node: usize) -> [usize; 3] {
        let local = node - self.first;
        let [n0, n1, _] = self.cells;
        [local % n0, local / n0 % n1, local / (n0 * n1)]
    }

    /// Whether every conductivity is the same at all temperatures.
    pub fn is_constant(&self, properties: &[Property]) -> bool {
        self.property.iter().all(|p| properties[*p as usize].is_constant())
    }

    /// Conductances of the faces, W/K, with every conductivity taken at one temperature (K).
    pub fn profile(&self, properties: &[Property], temperature: f64) -> Profile<f64> {
        [0, 1, 2].map(|d| {
            let k = properties[self.property[d] as usize].at(temperature);
            self.faces[d].iter().map(|gap| if gap.area > 0.0 { k * gap.area / (gap.length_a + gap.length_b) } else { 0.0 }).collect()
        })
    }

    /// The lines of the block that hold the nodes of `range`, cut to it.
    pub fn segments(&self, range: Range<usize>) -> impl Iterator<Item = Segment> + '_ {
        let [n0, n1, n2] = self.cells;
        let (from, to) = (range.start.max(self.first) - self.first, range.end.min(self.first + self.len()).max(self.first) - self.first);
        let lines = if from < to { from / n0..to.div_ceil(n0) } else { 0..0 };
        let layer = (n0 * n1) as isize;
        let step = n0 as isize;
        lines.map(move |line| {
            let (j, k) = (line % n1, line / n1);
            let start = if line * n0 < from { from % n0 } else { 0 };
            let end = (to - line * n0).min(n0);
            let below = if j > 0 { Some(-step) } else if self.wraps { Some(layer - step) } else { None };
            let above = if j + 1 < n1 { Some(step) } else if self.wraps { Some(step - layer) } else { None };
            Segment {
                along: start..end,
                node: self.first + line * n0 + start,
                neighbours: [below, above, (k > 0).then_some(-layer), (k + 1 < n2).then_some(layer)],
            }
        })
    }
}

impl Segment {
    /// Adds to `y`, the segment's part of a vector, what conduction with `profile` makes leave each cell:
    /// the sum of g (x - x of the neighbour). Differences are formed first, so that nothing cancels.
    pub fn add_conduction<T: Real>(&self, profile: &Profile<T>, x: &[T], y: &mut [T]) {
        let Range { start, end } = self.along;
        let n = end - start;
        let own = &x[self.node..self.node + n];
        // Along the line: every face inside the segment, then the two at its ends.
        let g = &profile[0];
        for (((y, x), above), g) in y.iter_mut().zip(own).zip(&own[1..]).zip(&g[start..]) {
            *y += *g * (*x - *above);
        }
        for (((y, x), below), g) in y[1..].iter_mut().zip(&own[1..]).zip(own).zip(&g[start..]) {
            *y += *g * (*x - *below);
        }
        if start > 0 {
            y[0] += g[start - 1] * (own[0] - x[self.node - 1]);
        }
        if end < g.len() {
            y[n - 1] += g[end - 1] * (own[n - 1] - x[self.node + n]);
        }
        for (side, shift) in self.neighbours.iter().enumerate() {
            let Some(shift) = shift else { continue };
            let g = &profile[1 + side / 2][start..end];
            let at = self.node.wrapping_add_signed(*shift);
            for (((y, x), other), g) in y.iter_mut().zip(own).zip(&x[at..at + n]).zip(g) {
                *y += *g * (*x - *other);
            }
        }
    }

    /// Adds to `y` the sum of the coefficients that act on each cell: the diagonal of [`Segment::add_conduction`].
    pub fn add_diagonal<T: Real>(&self, profile: &Profile<T>, y: &mut [T]) {
        let Range { start, end } = self.along;
        for (i, y) in (start..end).zip(y.iter_mut()) {
            *y += profile[0][i];
            if i > 0 {
                *y += profile[0][i - 1];
            }
            for side in 0..4 {
                if self.neighbours[side].is_some() {
                    *y += profile[1 + side / 2][i];
                }
            }
        }
    }

    /// Calls `visit(position in the segment, axis, neighbour's node, whether the neighbour comes after along the axis,
    /// first index that owns the face)` for every neighbour of every cell.
    pub fn each_face(&self, line: usize, mut visit: impl FnMut(usize, usize, usize, bool, usize)) {
        for (at, i) in self.along.clone().enumerate() {
            let node = self.node + at;
            if i > 0 {
                visit(at, 0, node - 1, false, i - 1);
            }
            if i + 1 < line {
                visit(at, 0, node + 1, true, i);
            }
            for (side, shift) in self.neighbours.iter().enumerate() {
                if let Some(shift) = shift {
                    visit(at, 1 + side / 2, node.wrapping_add_signed(*shift), side % 2 == 1, i);
                }
            }
        }
    }
}
