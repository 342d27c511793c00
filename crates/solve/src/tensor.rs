//! Coarsening of structured blocks by threes, axis by axis.
//!
//! Groups of about three cells along each axis make one coarse cell; interpolation is linear along each axis and continued to the
//! block's ends, so it is a product of three short tables, and so is the Galerkin product of a block's conduction. Nodes outside blocks
//! are carried over one to one. Conductors between blocks are interpolated along the normal only, and conductances to given
//! temperatures are lumped: the coarse matrix stays symmetric, positive definite and exact for a constant temperature.

use rayon::prelude::*;

use super::csr::{CHUNK, Csr, for_chunks};
use super::system::Symmetric;
use coldplate_network::Block;
use coldplate_network::block::FaceCoefficients;

/// An axis along which cells are bound less than this, relative to the strongest axis, is not coarsened yet; dimensionless. Chosen.
const WEAK_AXIS: f64 = 0.1;

/// Interpolation from coarse to fine values and back.
#[derive(Debug, Clone)]
pub(crate) struct Transfer {
    blocks: Vec<BlockTransfer>,
    /// Fine nodes outside blocks; their coarse numbers follow those of the blocks.
    others: Vec<u32>,
    /// Coarse cells of all blocks.
    in_blocks: usize,
}

#[derive(Debug, Clone)]
struct BlockTransfer {
    fine: Block,
    coarse: Block,
    axes: [Axis; 3],
    /// Conductance between neighbouring coarse cells along each axis, W/K, at both ends of the first one.
    along: [[f64; 3]; 2],
}

/// Linear interpolation along one axis.
#[derive(Debug, Clone)]
struct Axis {
    /// For each fine index two coarse ones and the weight of the second.
    pairs: Vec<(u32, u32, f32)>,
    /// For each fine index the group it belongs to.
    group: Vec<u32>,
    /// For each coarse index the fine ones it reaches, with weights.
    reach: Vec<Vec<(u32, f32)>>,
    is_wrapped: bool,
}

impl Axis {
    fn new(n: usize, is_coarsened: bool, wraps: bool) -> Self {
        let m = if is_coarsened { ((n + 1) / 3).max(1) } else { n };
        let bound = |c: usize| c * n / m;
        let centre = |c: usize| (bound(c) + bound(c + 1)) as f64 / 2.0;
        let mut group = vec![0u32; n];
        for c in 0..m {
            group[bound(c)..bound(c + 1)].fill(c as u32);
        }
        let pair = |i: usize| {
            let (at, c) = (i as f64 + 0.5, group[i] as usize);
            if m == 1 || m == n {
                return (c as u32, c as u32, 0.0);
            }
            let lower = if at < centre(c) { c as isize - 1 } else { c as isize };
            if wraps {
                let lower = lower.rem_euclid(m as isize) as usize;
                let upper = (lower + 1) % m;
                let from = (at - centre(lower)).rem_euclid(n as f64);
                return (lower as u32, upper as u32, (from / (centre(upper) - centre(lower)).rem_euclid(n as f64)) as f32);
            }
            let lower = lower.clamp(0, m as isize - 2) as usize;
            (lower as u32, lower as u32 + 1, ((at - centre(lower)) / (centre(lower + 1) - centre(lower))).clamp(0.0, 1.0) as f32)
        };
        let pairs: Vec<(u32, u32, f32)> = (0..n).map(pair).collect();
        let mut reach = vec![Vec::new(); m];
        for (i, (lower, upper, w)) in pairs.iter().enumerate() {
            for (c, w) in [(*lower, 1.0 - w), (*upper, *w)] {
                if w != 0.0 {
                    reach[c as usize].push((i as u32, w));
                }
            }
        }
        Self { pairs, group, reach, is_wrapped: wraps }
    }

    fn coarse(&self) -> usize {
        self.reach.len()
    }

    /// Coarse indices and weights of a fine index.
    fn weights(&self, i: usize) -> [(usize, f64); 2] {
        let (lower, upper, w) = self.pairs[i];
        [(lower as usize, 1.0 - f64::from(w)), (upper as usize, f64::from(w))]
    }

    /// Coarse indices and weights of a fine index, interpolated only at the ends of the block, where it meets others.
    fn end_weights(&self, i: usize) -> [(usize, f64); 2] {
        let is_end = !self.is_wrapped && (i == 0 || i + 1 == self.pairs.len());
        if is_end { self.weights(i) } else { [(self.group[i] as usize, 1.0), (0, 0.0)] }
    }

    /// Rows of P' diag(g) P.
    fn mass(&self, g: impl Fn(usize) -> f64) -> Banded {
        let mut found = Banded::new(self.coarse());
        for i in 0..self.pairs.len() {
            found.add_square(&self.weights(i), g(i));
        }
        found
    }

    /// Rows of P' K P, K being conduction from each fine index to the next.
    fn stiffness(&self, g: impl Fn(usize) -> f64) -> Banded {
        let n = self.pairs.len();
        let mut found = Banded::new(self.coarse());
        for i in 0..n {
            let next = if i + 1 < n {
                i + 1
            } else if self.is_wrapped && n > 2 {
                0
            } else {
                continue;
            };
            let [a, b] = self.weights(i);
            let [c, d] = self.weights(next);
            found.add_square(&[a, b, (c.0, -c.1), (d.0, -d.1)], g(i));
        }
        found
    }
}

/// A small symmetric matrix of few entries per row.
struct Banded {
    rows: Vec<Vec<(usize, f64)>>,
}

impl Banded {
    fn new(n: usize) -> Self {
        Self { rows: vec![Vec::new(); n] }
    }

    /// Adds g v v'.
    fn add_square(&mut self, v: &[(usize, f64)], g: f64) {
        for (i, wi) in v.iter().filter(|(_, w)| *w != 0.0) {
            for (j, wj) in v.iter().filter(|(_, w)| *w != 0.0) {
                match self.rows[*i].iter_mut().find(|(c, _)| c == j) {
                    Some((_, sum)) => *sum += g * wi * wj,
                    None => self.rows[*i].push((*j, g * wi * wj)),
                }
            }
        }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.rows[i].iter().find(|(c, _)| *c == j).map_or(0.0, |(_, v)| *v)
    }
}

impl Transfer {
    /// Coarsening of the blocks among `rows` nodes; `along` is the conductance between neighbours along each
    /// axis of each block, W/K, at both ends of the first one: about its own axis a solid cylinder is bound far more
    /// strongly round than along.
    pub fn new(blocks: &[Block], along: &[[[f64; 3]; 2]], rows: usize) -> Self {
        let mut first = 0;
        let mut is_free = vec![true; rows];
        let coarsen = |(block, along): (&Block, &[[f64; 3]; 2])| {
            is_free[block.nodes()].fill(false);
            // An axis of one cell binds nothing.
            let strongest = along.map(|end| (0..3).filter(|d| block.cells[*d] > 1).map(|d| end[d]).fold(0.0, f64::max));
            let is_strong = |end: usize, d: usize| along[end][d] >= WEAK_AXIS * strongest[end];
            let at_both = [0, 1, 2].map(|d| is_strong(0, d) && is_strong(1, d));
            // If no axis is left that is strong at both ends, the outer end decides: most cells are there.
            let is_any = (0..3).any(|d| at_both[d] && block.cells[d] > 1);
            let coarsened = [0, 1, 2].map(|d| if is_any { at_both[d] } else { is_strong(1, d) });
            let axes = [0, 1, 2].map(|d| Axis::new(block.cells[d], coarsened[d], d == 1 && block.wraps));
            let cells = [0, 1, 2].map(|d| axes[d].coarse());
            let coarse = Block { first, cells, wraps: block.wraps && cells[1] > 2, property: block.property, faces: Default::default() };
            first += coarse.len();
            let ratio = [0, 1, 2].map(|d| block.cells[d] as f64 / cells[d] as f64);
            let wider = ratio.iter().product::<f64>();
            let along = along.map(|end| std::array::from_fn(|d| end[d] * wider / (ratio[d] * ratio[d])));
            BlockTransfer { fine: block.clone(), coarse, axes, along }
        };
        let blocks = blocks.iter().zip(along).map(coarsen).collect();
        let others = (0..rows as u32).filter(|i| is_free[*i as usize]).collect();
        Self { blocks, others, in_blocks: first }
    }

    /// The coarse blocks, and the conductance between neighbours along each of their axes, as [`Transfer::new`] takes it.
    pub(crate) fn coarse_blocks(&self) -> (Vec<Block>, Vec<[[f64; 3]; 2]>) {
        self.blocks.iter().map(|t| (t.coarse.clone(), t.along)).unzip()
    }

    /// P as a matrix.
    pub(crate) fn prolongation(&self) -> Csr {
        let fine = self.blocks.iter().map(|t| t.fine.len()).sum::<usize>() + self.others.len();
        let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); fine];
        for t in &self.blocks {
            for node in t.fine.nodes() {
                let c = t.fine.indices(node);
                let row = &mut rows[node];
                for (k, wk) in t.axes[2].weights(c[2]) {
                    for (j, wj) in t.axes[1].weights(c[1]) {
                        for (i, wi) in t.axes[0].weights(c[0]) {
                            if wi * wj * wk != 0.0 {
                                row.push((t.coarse_node([i, j, k]) as u32, wi * wj * wk));
                            }
                        }
                    }
                }
                row.sort_by_key(|(c, _)| *c);
            }
        }
        for (c, i) in self.others.iter().enumerate() {
            rows[*i as usize].push(((self.in_blocks + c) as u32, 1.0));
        }
        let lengths = rows.iter().map(Vec::len).collect();
        let (cols, values) = rows.into_iter().flatten().unzip();
        Csr::from_chunks(self.coarse(), vec![(lengths, cols, values)])
    }

    /// Rows of the coarse matrix.
    pub fn coarse(&self) -> usize {
        self.in_blocks + self.others.len()
    }

    /// x += P e
    pub(crate) fn prolong(&self, e: &[f32], x: &mut [f32]) {
        for_chunks(x, |first, part| {
            let range = first..first + part.len();
            let mut line = Vec::new();
            for t in &self.blocks {
                let m = t.coarse.cells[0];
                for segment in t.fine.segments(range.clone()) {
                    let [_, j, k] = t.fine.indices(segment.node);
                    line.clear();
                    line.resize(m, 0.0f32);
                    for (kc, wk) in both(t.axes[2].pairs[k]) {
                        for (jc, wj) in both(t.axes[1].pairs[j]) {
                            let w = wj * wk;
                            if w != 0.0 {
                                let at = t.coarse.first + m * (jc as usize + t.coarse.cells[1] * kc as usize);
                                line.iter_mut().zip(&e[at..at + m]).for_each(|(l, e)| *l += w * e);
                            }
                        }
                    }
                    let y = &mut part[segment.node - first..segment.node - first + segment.along.len()];
                    for (y, (lower, upper, w)) in y.iter_mut().zip(&t.axes[0].pairs[segment.along.clone()]) {
                        *y += (1.0 - w) * line[*lower as usize] + w * line[*upper as usize];
                    }
                }
            }
            let from = self.others.partition_point(|i| (*i as usize) < first);
            for (c, i) in self.others.iter().enumerate().skip(from).take_while(|(_, i)| (**i as usize) < range.end) {
                part[*i as usize - first] += e[self.in_blocks + c];
            }
        });
    }

    /// b = P' r
    pub(crate) fn restrict(&self, r: &[f32], b: &mut [f32]) {
        for_chunks(b, |first, part| {
            let range = first..first + part.len();
            let mut line = Vec::new();
            for t in &self.blocks {
                let n = t.fine.cells[0];
                for segment in t.coarse.segments(range.clone()) {
                    let [_, jc, kc] = t.coarse.indices(segment.node);
                    line.clear();
                    line.resize(n, 0.0f32);
                    for (k, wk) in &t.axes[2].reach[kc] {
                        for (j, wj) in &t.axes[1].reach[jc] {
                            let w = wj * wk;
                            let at = t.fine.first + n * (*j as usize + t.fine.cells[1] * *k as usize);
                            line.iter_mut().zip(&r[at..at + n]).for_each(|(l, r)| *l += w * r);
                        }
                    }
                    let y = &mut part[segment.node - first..segment.node - first + segment.along.len()];
                    for (y, c) in y.iter_mut().zip(segment.along.clone()) {
                        *y = t.axes[0].reach[c].iter().map(|(i, w)| w * line[*i as usize]).sum();
                    }
                }
            }
            let from = range.start.max(self.in_blocks);
            for c in from..range.end.max(from) {
                part[c - first] = r[self.others[c - self.in_blocks] as usize];
            }
        });
    }

    /// P' v for a diagonal v, each value given to the coarse nodes around it.
    pub fn lump(&self, v: &[f64]) -> Vec<f64> {
        let mut found = vec![0.0; self.coarse()];
        for t in &self.blocks {
            for (node, value) in t.fine.nodes().zip(&v[t.fine.nodes()]) {
                if *value != 0.0 {
                    let c = t.fine.indices(node);
                    let group = [0, 1, 2].map(|d| t.axes[d].group[c[d]] as usize);
                    found[t.coarse_node(group)] += value;
                }
            }
        }
        for (c, i) in self.others.iter().enumerate() {
            found[self.in_blocks + c] += v[*i as usize];
        }
        found
    }

    /// The coarse matrix.
    pub(crate) fn galerkin(&self, matrix: &Symmetric) -> Csr {
        let to_given = self.lump(&matrix.to_given);
        let mut joined = self.coarse_couplings(&matrix.couplings);
        joined.par_sort_by_key(|(i, j, _)| (*i, *j));
        let mut chunks: Vec<(Vec<usize>, Vec<u32>, Vec<f64>)> = Vec::new();
        let finish = |first: usize, rows: Vec<Vec<(u32, f64)>>| {
            let (mut lengths, mut cols, mut values) = (Vec::with_capacity(rows.len()), Vec::new(), Vec::new());
            for (k, mut row) in rows.into_iter().enumerate() {
                let i = (first + k) as u32;
                row.push((i, to_given[i as usize]));
                let from = joined.partition_point(|(r, _, _)| *r < i);
                row.extend(joined[from..].iter().take_while(|(r, _, _)| *r == i).map(|(_, c, v)| (*c, *v)));
                row.sort_by_key(|(c, _)| *c);
                row.dedup_by(|later, kept| {
                    let same = later.0 == kept.0;
                    if same {
                        kept.1 += later.1;
                    }
                    same
                });
                lengths.push(row.len());
                cols.extend(row.iter().map(|(c, _)| *c));
                values.extend(row.iter().map(|(_, v)| *v));
            }
            (lengths, cols, values)
        };
        for (t, profile) in self.blocks.iter().zip(&matrix.profiles) {
            let of_block = t.conduction(profile);
            let [m0, m1, m2] = t.coarse.cells;
            let layers: Vec<_> = (0..m2).into_par_iter().map(|c| finish(t.coarse.first + m0 * m1 * c, t.layer(&of_block, c))).collect();
            chunks.extend(layers);
        }
        chunks.push(finish(self.in_blocks, vec![Vec::new(); self.others.len()]));
        Csr::from_chunks(self.coarse(), chunks)
    }

    /// Couplings between blocks and other nodes, on the coarse nodes: g v v' for v the difference of both ends.
    fn coarse_couplings(&self, couplings: &[(u32, u32, f64)]) -> Vec<(u32, u32, f64)> {
        let pieces: Vec<Vec<(u32, u32, f64)>> = couplings
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut found = Vec::with_capacity(16 * chunk.len());
                let mut v: Vec<(u32, f64)> = Vec::new();
                for (a, b, g) in chunk {
                    v.clear();
                    self.end_weights(*a, 1.0, &mut v);
                    self.end_weights(*b, -1.0, &mut v);
                    for (i, wi) in &v {
                        found.extend(v.iter().map(|(j, wj)| (*i, *j, g * wi * wj)));
                    }
                }
                found.sort_by_key(|(i, j, _)| (*i, *j));
                found.dedup_by(|later, kept| {
                    let same = (later.0, later.1) == (kept.0, kept.1);
                    if same {
                        kept.2 += later.2;
                    }
                    same
                });
                found
            })
            .collect();
        pieces.concat()
    }

    /// Coarse nodes and weights that stand for a node at the end of its block, times `sign`.
    fn end_weights(&self, node: u32, sign: f64, found: &mut Vec<(u32, f64)>) {
        let after = self.blocks.partition_point(|t| t.fine.first <= node as usize);
        let holder = after.checked_sub(1).map(|b| &self.blocks[b]).filter(|t| t.fine.nodes().contains(&(node as usize)));
        let Some(t) = holder else {
            let at = self.others.partition_point(|i| *i < node);
            found.push(((self.in_blocks + at) as u32, sign));
            return;
        };
        let c = t.fine.indices(node as usize);
        for (k, wk) in t.axes[2].end_weights(c[2]) {
            for (j, wj) in t.axes[1].end_weights(c[1]) {
                for (i, wi) in t.axes[0].end_weights(c[0]) {
                    let w = sign * wi * wj * wk;
                    if w != 0.0 {
                        found.push((t.coarse_node([i, j, k]) as u32, w));
                    }
                }
            }
        }
    }
}

/// The three one-dimensional factors of a block's coarse conduction.
struct Factors {
    /// Along the first axis: stiffness, and the masses weighted by the conductances of the other two.
    first: [Banded; 3],
    /// Along the others: stiffness and mass.
    others: [[Banded; 2]; 2],
}

impl BlockTransfer {
    fn coarse_node(&self, [i, j, k]: [usize; 3]) -> usize {
        let [m0, m1, _] = self.coarse.cells;
        self.coarse.first + i + m0 * (j + m1 * k)
    }

    fn conduction(&self, profile: &FaceCoefficients<f64>) -> Factors {
        let a = &self.axes;
        Factors {
            first: [a[0].stiffness(|i| profile[0][i + 1]), a[0].mass(|i| profile[1][i]), a[0].mass(|i| profile[2][i])],
            others: [[a[1].stiffness(|_| 1.0), a[1].mass(|_| 1.0)], [a[2].stiffness(|_| 1.0), a[2].mass(|_| 1.0)]],
        }
    }

    /// The rows of one layer of coarse cells.
    fn layer(&self, f: &Factors, c: usize) -> Vec<Vec<(u32, f64)>> {
        let [m0, m1, _] = self.coarse.cells;
        let mut rows = Vec::with_capacity(m0 * m1);
        // Mass and stiffness have the same pattern or the wider one; every pair of either is visited once.
        let near = |banded: [&Banded; 2], i: usize| {
            let mut found: Vec<usize> = banded.iter().flat_map(|b| b.rows[i].iter().map(|(j, _)| *j)).collect();
            found.sort_unstable();
            found.dedup();
            found
        };
        let [[k1, n1], [k2, n2]] = &f.others;
        let near_2: Vec<(usize, f64, f64)> = near([k2, n2], c).into_iter().map(|j| (j, k2.at(c, j), n2.at(c, j))).collect();
        for b in 0..m1 {
            let near_1: Vec<(usize, f64, f64)> = near([k1, n1], b).into_iter().map(|j| (j, k1.at(b, j), n1.at(b, j))).collect();
            for a in 0..m0 {
                let near_0: Vec<(usize, f64, f64, f64)> = near([&f.first[0], &f.first[1]], a)
                    .into_iter()
                    .map(|j| (j, f.first[0].at(a, j), f.first[1].at(a, j), f.first[2].at(a, j)))
                    .collect();
                let mut row = Vec::with_capacity(near_0.len() * near_1.len() * near_2.len() + 4);
                for (z, kz, mz) in &near_2 {
                    for (y, ky, my) in &near_1 {
                        for (x, kx, m1x, m2x) in &near_0 {
                            let value = kx * my * mz + m1x * ky * mz + m2x * my * kz;
                            row.push((self.coarse_node([*x, *y, *z]) as u32, value));
                        }
                    }
                }
                rows.push(row);
            }
        }
        rows
    }
}

fn both((lower, upper, w): (u32, u32, f32)) -> [(u32, f32); 2] {
    [(lower, 1.0 - w), (upper, w)]
}
