//! Conduction inside one structured block, without a list of its conductors.
//!
//! The cells of a block are numbered line by line, and their faces depend on the first local index
//! only (the radius of a cylinder; nothing, for a box). So the conductances of millions of faces are
//! three short tables, and a product with them moves the temperatures and nothing else.

use std::ops::{AddAssign, Mul, Range, Sub};

use coldplate_describe::machine::Property;

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

/// Coefficients of the faces of a block, W/K, by a cell's first index. Along the first axis entry i belongs to
/// the face below cell i, so there is one more, and the first and the last are zero; along the others entry i
/// belongs to all faces of the cells with first index i.
pub type FaceCoefficients<T> = [Vec<T>; 3];

/// The arithmetic that the kernels use.
pub trait BlockReal: Copy + Send + Sync + Default + Mul<Output = Self> + Sub<Output = Self> + AddAssign {}
impl<T: Copy + Send + Sync + Default + Mul<Output = T> + Sub<Output = T> + AddAssign> BlockReal for T {}

/// Cells in a line, a count: shorter lines are taken several at a time. Chosen: cost of a line against cells in it.
const SHORT: usize = 24;
/// Least number of lines with neighbours on equal sides for which this pays, a count. Chosen.
const MANY: usize = 4;
/// Most cells of such lines taken together, a count. Chosen.
const PIECE: usize = 96;

/// Part of one line of cells along the first axis: the unit of work of a kernel. With the profile of several lines one behind the
/// other, part of as many lines that have neighbours on the same sides.
#[derive(Debug, Clone)]
pub struct RowSegment {
    /// First indices of its cells; the lines behind the first one count on.
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
    pub fn profile(&self, properties: &[Property], temperature: f64) -> FaceCoefficients<f64> {
        let mut found = [0, 1, 2].map(|d| {
            let k = properties[self.property[d] as usize].at(temperature);
            let conductance = |gap: &Gap| if gap.area > 0.0 { k * gap.area / (gap.length_a + gap.length_b) } else { 0.0 };
            self.faces[d].iter().map(conductance).collect::<Vec<_>>()
        });
        found[0].insert(0, 0.0);
        found
    }

    /// Adds to `part`, the rows from `first` on of a vector, the heat (W) that conduction with `profile` (W/K) makes leave each cell of
    /// the block at temperatures `x` (K) of all nodes.
    pub fn add_conduction<T: BlockReal>(&self, profile: &FaceCoefficients<T>, first: usize, x: &[T], part: &mut [T]) {
        let range = first.max(self.first)..(first + part.len()).min(self.first + self.len());
        if range.is_empty() {
            return;
        }
        let [n0, n1, n2] = self.cells;
        let alike = if n1 == 1 { n2 } else { n1 }.saturating_sub(2);
        if n0 >= SHORT || alike < MANY {
            for segment in self.segments(range) {
                segment.add_conduction(profile, x, &mut part[segment.node - first..][..segment.along.len()]);
            }
            return;
        }
        // No heat passes from the end of a line to the beginning of the next: the coefficient between them is zero, as at every end.
        let lines = (PIECE.div_ceil(n0) + 1).min(alike);
        let [along, second, third] = profile;
        let tiled = [&along[..n0], second, third].map(|own| own.iter().copied().cycle().take(lines * n0 + 1).collect());
        for segment in self.pieces(range) {
            segment.add_conduction(&tiled, x, &mut part[segment.node - first..][..segment.along.len()]);
        }
    }

    /// Segments over the nodes of `range`, all of the block: each has as many lines as have neighbours on the same sides, of up to
    /// [`PIECE`] cells.
    fn pieces(&self, range: Range<usize>) -> impl Iterator<Item = RowSegment> + '_ {
        let [n0, n1, n2] = self.cells;
        let Range { start: mut node, end: to } = range;
        let inner = |at: usize, count: usize| if at == 0 || at + 1 == count { at } else { count - 2 };
        std::iter::from_fn(move || {
            if node >= to {
                return None;
            }
            let [i, j, k] = self.indices(node);
            let last = if n1 == 1 { inner(k, n2) } else { k * n1 + inner(j, n1) };
            let end = (self.first + (last + 1) * n0).min(to).min(node + PIECE);
            let piece = RowSegment { along: i..i + end - node, node, neighbours: self.neighbours(j, k) };
            node = end;
            Some(piece)
        })
    }

    /// Distance in nodes to the neighbours of a line below and above along the second and third axis, where there are any.
    fn neighbours(&self, j: usize, k: usize) -> [Option<isize>; 4] {
        let [n0, n1, n2] = self.cells;
        let (step, layer) = (n0 as isize, (n0 * n1) as isize);
        let below = if j > 0 { Some(-step) } else { self.wraps.then_some(layer - step) };
        let above = if j + 1 < n1 { Some(step) } else { self.wraps.then_some(step - layer) };
        [below, above, (k > 0).then_some(-layer), (k + 1 < n2).then_some(layer)]
    }

    /// The lines of the block that hold the nodes of `range`, cut to it.
    pub fn segments(&self, range: Range<usize>) -> impl Iterator<Item = RowSegment> + '_ {
        let [n0, n1, _] = self.cells;
        let (from, to) = (range.start.max(self.first) - self.first, range.end.min(self.first + self.len()).max(self.first) - self.first);
        let lines = if from < to { from / n0..to.div_ceil(n0) } else { 0..0 };
        lines.map(move |line| {
            let start = if line * n0 < from { from % n0 } else { 0 };
            let end = (to - line * n0).min(n0);
            let node = self.first + line * n0 + start;
            RowSegment { along: start..end, node, neighbours: self.neighbours(line % n1, line / n1) }
        })
    }
}

impl RowSegment {
    /// Adds to `y`, the segment's part of a vector, the heat (W) that leaves each cell by conduction with `profile`: the sum of g (x -
    /// x of the neighbour). Differences are formed first, so that nothing cancels.
    fn add_conduction<T: BlockReal>(&self, profile: &FaceCoefficients<T>, x: &[T], y: &mut [T]) {
        let Range { start, end } = self.along;
        let n = end - start;
        let own = &x[self.node..self.node + n];
        // Without a neighbour a cell is its own, and the difference is zero.
        let [below, above, before, behind] = self.neighbours.map(|shift| {
            let at = self.node.wrapping_add_signed(shift.unwrap_or(0));
            &x[at..at + n]
        });
        let (g1, g2) = (&profile[1][start..end], &profile[2][start..end]);
        let (lower, upper) = (&profile[0][start..end], &profile[0][start + 1..end + 1]);
        let y = &mut y[..n];
        // Along the line the neighbours are the same values moved by one; at the ends of a line the coefficient is zero, for any value.
        // Only the first and the last value of the whole vector have nothing beyond.
        let (from, to) = (usize::from(self.node == 0), if self.node + n == x.len() { n - 1 } else { n });
        if from < to {
            let m = to - from;
            let (left, right) = (&x[self.node + from - 1..][..m], &x[self.node + from + 1..][..m]);
            let [own, below, above, before, behind] = [own, below, above, before, behind].map(|s| &s[from..to]);
            let [g1, g2, lower, upper] = [g1, g2, lower, upper].map(|s| &s[from..to]);
            let y = &mut y[from..to];
            for i in 0..m {
                let v = own[i];
                let mut sum = lower[i] * (v - left[i]);
                sum += upper[i] * (v - right[i]);
                sum += g1[i] * (v - below[i]);
                sum += g1[i] * (v - above[i]);
                sum += g2[i] * (v - before[i]);
                sum += g2[i] * (v - behind[i]);
                y[i] += sum;
            }
        }
        for i in (0..from).chain(to.max(from)..n) {
            let v = own[i];
            if start + i > 0 {
                y[i] += lower[i] * (v - x[self.node + i - 1]);
            }
            if self.node + i + 1 < x.len() {
                y[i] += upper[i] * (v - x[self.node + i + 1]);
            }
            y[i] += g1[i] * (v - below[i]);
            y[i] += g1[i] * (v - above[i]);
            y[i] += g2[i] * (v - before[i]);
            y[i] += g2[i] * (v - behind[i]);
        }
    }

    /// Adds to `y` the sum of the coefficients that act on each cell: the diagonal of [`Block::add_conduction`].
    pub fn add_diagonal<T: BlockReal>(&self, profile: &FaceCoefficients<T>, y: &mut [T]) {
        for (i, y) in self.along.clone().zip(y.iter_mut()) {
            *y += profile[0][i];
            *y += profile[0][i + 1];
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines of any length, in a ring or not, any stretch of them: the product agrees with the heat added up face by face.
    #[test]
    fn lines_are_taken_together() {
        for (cells, wraps) in [
            ([1, 1, 40], false),
            ([2, 1, 200], false),
            ([2, 90, 3], false),
            ([5, 1, 7], true),
            ([4, 3, 3], false),
            ([3, 7, 5], true),
            ([30, 4, 3], true),
        ] {
            let own = |d: usize| (0..cells[0]).map(move |i| 1.0 + 0.3 * d as f64 + 0.1 * i as f64);
            let mut along: Vec<f64> = own(0).collect();
            along[0] = 0.0;
            along.push(0.0);
            let profile: FaceCoefficients<f64> = [along, own(1).collect(), own(2).collect()];
            let block = Block { first: 5, cells, wraps, property: [0; 3], faces: Default::default() };
            let x: Vec<f64> = (0..block.len() + 9).map(|i| (1.7 * i as f64).sin()).collect();
            for range in [5..block.len() + 5, 0..x.len(), 12..29] {
                let mut found = vec![0.0; range.len()];
                block.add_conduction(&profile, range.start, &x, &mut found);
                let mut expected = vec![0.0; range.len()];
                for segment in block.segments(range.clone()) {
                    segment.each_face(cells[0], |at, d, other, _, i| {
                        let g = if d == 0 { profile[0][i + 1] } else { profile[d][segment.along.start + at] };
                        expected[segment.node + at - range.start] += g * (x[segment.node + at] - x[other]);
                    });
                }
                let most = found.iter().zip(&expected).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
                assert!(most < 1e-13, "{cells:?} {range:?}: {most}");
            }
        }
    }
}
