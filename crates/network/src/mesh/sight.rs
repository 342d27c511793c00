//! View factors by rays: the share of a surface's rays that arrive at each other surface.
//!
//! Rays leave evenly over the surface and with the cosine of the angle to its normal, as diffuse radiation does, and
//! end at the first block or imported part they meet. Their four coordinates are Sobol' points, shifted digit by digit
//! once per batch; the scatter of the batches is the error. The shifts are fixed numbers and results are counted, so a
//! result depends on nothing but the geometry.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::grid::{Grid, LocalFrame, tangents};
use super::overlap::TOUCHING;
use super::ray::{Obstacle, Scene};
use super::{Mesh, bounds};
use coldplate_describe::machine::{Machine, Side};

/// Independent batches of rays, a count. Chosen: certainty of the standard error against rays in a batch.
pub const BATCHES: usize = 16;
/// Distance at which rays start from their surface, m. Chosen below the distance at which faces touch.
const CLEAR: f64 = 1e-7;
/// A point of a surface is covered where a block lies this far in front of it, m: twice the distance at which faces touch.
const COVER: f64 = 2.0 * TOUCHING;

/// A piece of a block's side, in the two local coordinates along it ([`tangents`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SidePiece {
    /// Index of the grid.
    pub grid: usize,
    /// Side of its block.
    pub side: Side,
    /// Lower ends of its coordinates, m or rad.
    pub low: [f64; 2],
    /// Upper ends.
    pub high: [f64; 2],
}

/// View of a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceView {
    /// Share of its rays that arrive at each surface.
    pub share: Vec<f64>,
    /// Standard error of each share.
    pub error: Vec<f64>,
    /// Share that meets nothing.
    pub escaped: f64,
    /// Share that meets blocks or imported parts outside the list of surfaces.
    pub strayed: f64,
    /// Share of the surface that nothing covers.
    pub open: f64,
}

impl SidePiece {
    /// Area, m².
    pub fn area(&self, grid: &Grid) -> f64 {
        let [p, q] = [0, 1].map(|i| self.high[i] - self.low[i]);
        let radius = || grid.edges[0][if self.side.is_high() { grid.n(0) } else { 0 }];
        match (grid.frame, self.side.axis()) {
            (LocalFrame::Cartesian, _) | (LocalFrame::Cylindrical { .. }, 1) => p * q,
            (LocalFrame::Cylindrical { .. }, 0) => radius() * p * q,
            (LocalFrame::Cylindrical { .. }, _) => (self.high[0] * self.high[0] - self.low[0] * self.low[0]) / 2.0 * q,
            (LocalFrame::Spherical { .. }, _) => radius() * radius() * (self.low[0].cos() - self.high[0].cos()) * q,
        }
    }

    /// The point of a facet at (u, v) of the unit square, evenly by area, and the outward normal there.
    pub fn point(&self, grid: &Grid, u: f64, v: f64) -> ([f64; 3], [f64; 3]) {
        let axis = self.side.axis();
        let [p, q] = tangents(axis);
        let between = |i: usize, u: f64| self.low[i] + u * (self.high[i] - self.low[i]);
        let mut local = [0.0; 3];
        local[axis] = grid.edges[axis][if self.side.is_high() { grid.n(axis) } else { 0 }];
        (local[p], local[q]) = match (grid.frame, axis) {
            (LocalFrame::Cylindrical { .. }, 2) => {
                let (a, b) = (self.low[0] * self.low[0], self.high[0] * self.high[0]);
                ((a + u * (b - a)).sqrt(), between(1, v))
            }
            (LocalFrame::Spherical { .. }, _) => {
                let (a, b) = (self.low[0].cos(), self.high[0].cos());
                ((a + u * (b - a)).clamp(-1.0, 1.0).acos(), between(1, v))
            }
            _ => (between(0, u), between(1, v)),
        };
        let sign = if self.side.is_high() { 1.0 } else { -1.0 };
        let mut normal = [0.0; 3];
        match grid.frame {
            LocalFrame::Cartesian => normal[axis] = sign,
            LocalFrame::Cylindrical { axis: along, .. } => {
                let [a, b] = LocalFrame::normals(along);
                let (sin, cos) = local[1].sin_cos();
                match axis {
                    0 => (normal[a], normal[b]) = (sign * cos, sign * sin),
                    1 => (normal[a], normal[b]) = (-sign * sin, sign * cos),
                    _ => normal[along.index()] = sign,
                }
            }
            LocalFrame::Spherical { .. } => {
                let ((sin, cos), (east, north)) = (local[1].sin_cos(), local[2].sin_cos());
                normal = [sign * sin * north, sign * sin * east, sign * cos];
            }
        }
        (grid.to_machine(local), normal)
    }
}

/// Who owns the surface at a side of a grid.
struct Owners<'a> {
    mesh: &'a Mesh,
    /// The box around each grid.
    bounds: Vec<([f64; 3], [f64; 3])>,
    /// The box around each imported part.
    imported: Vec<([f64; 3], [f64; 3])>,
    /// For each grid and side: surface and facet.
    sides: Vec<[Vec<(usize, SidePiece)>; 6]>,
}

impl Owners<'_> {
    /// Whether a point lies in some block or imported part.
    fn is_covered(&self, point: [f64; 3]) -> bool {
        let near = |(low, high): &([f64; 3], [f64; 3])| (0..3).all(|d| point[d] >= low[d] && point[d] <= high[d]);
        let in_block = self.bounds.iter().zip(&self.mesh.grids).any(|(bounds, grid)| near(bounds) && grid.contains(point, 0.0));
        in_block || self.mesh.tetra.iter().zip(&self.imported).any(|(tetra, bounds)| near(bounds) && tetra.contains(point))
    }

    /// The surface at a point of a solid of the scene: blocks in the order of the grids; triangles behind them belong to none.
    fn of(&self, solid: usize, side: Side, point: [f64; 3]) -> Option<usize> {
        let known = &self.sides.get(solid)?[side as usize];
        match known.as_slice() {
            [] => None,
            [(one, _)] => Some(*one),
            several => {
                let local = self.mesh.grids[solid].to_local(point);
                let [p, q] = tangents(side.axis());
                // Rounding may put a point on a border just outside both: it goes to the nearest.
                let outside = |f: &SidePiece| {
                    let away = |i: usize, x: f64| ((f.low[i] - x).max(x - f.high[i]) / (f.high[i] - f.low[i])).max(0.0);
                    away(0, local[p]).max(away(1, local[q]))
                };
                several.iter().min_by(|a, b| outside(&a.1).total_cmp(&outside(&b.1))).map(|(owner, _)| *owner)
            }
        }
    }
}

/// Sends rays from each surface that is `wanted`, at least as many as `rays` and a power of two per batch; a surface
/// is a list of facets.
pub fn look(machine: &Machine, mesh: &Mesh, surfaces: &[Vec<SidePiece>], wanted: &[bool], rays: usize) -> Vec<Option<SurfaceView>> {
    let blocks = mesh.grids.iter().map(|g| &machine.parts[g.part].blocks[g.block].shape);
    let around = blocks.clone().map(bounds).collect();
    let triangles = mesh.tetra.iter().flat_map(|t| (0..t.body.faces.len()).map(|face| t.triangle(face)));
    let scene = Scene::new(blocks.cloned().map(Obstacle::Block).chain(triangles.map(Obstacle::Triangle)).collect());
    let mut sides: Vec<[Vec<(usize, SidePiece)>; 6]> = vec![Default::default(); mesh.grids.len()];
    for (s, facets) in surfaces.iter().enumerate() {
        for facet in facets {
            sides[facet.grid][facet.side as usize].push((s, *facet));
        }
    }
    let owners = Owners { mesh, bounds: around, imported: mesh.tetra.iter().map(|t| t.bounds()).collect(), sides };
    let each = rays.div_ceil(BATCHES).max(1).next_power_of_two();
    let tasks: Vec<(usize, usize)> = (0..surfaces.len()).filter(|s| wanted[*s]).flat_map(|s| (0..BATCHES).map(move |b| (s, b))).collect();
    let counted: Vec<Count> =
        tasks.par_iter().map(|(s, batch)| count(&scene, &owners, &surfaces[*s], surfaces.len(), *batch, each)).collect();
    let mut batches = counted.chunks(BATCHES);
    wanted.iter().map(|wanted| if *wanted { batches.next().map(|own| gather(own, surfaces.len(), each)) } else { None }).collect()
}

/// Counts of the rays of one batch.
#[derive(Debug, Clone)]
struct Count {
    arrived: Vec<u32>,
    escaped: u32,
    strayed: u32,
}

impl Count {
    fn sent(&self) -> u32 {
        self.arrived.iter().sum::<u32>() + self.escaped + self.strayed
    }
}

fn count(scene: &Scene, owners: &Owners<'_>, facets: &[SidePiece], surfaces: usize, batch: usize, rays: usize) -> Count {
    let mut count = Count { arrived: vec![0; surfaces], escaped: 0, strayed: 0 };
    let grids = &owners.mesh.grids;
    let areas: Vec<f64> = facets.iter().map(|f| f.area(&grids[f.grid])).collect();
    let total: f64 = areas.iter().sum();
    let mut sequence = Sequence::new(batch);
    let (mut facet, mut passed) = (0, 0.0);
    for k in 0..rays {
        let x = sequence.next();
        // Facets get rays in proportion to their areas, one facet after the other.
        while facet + 1 < facets.len() && (k as f64 + 0.5) / rays as f64 * total > passed + areas[facet] {
            passed += areas[facet];
            facet += 1;
        }
        let (point, normal) = facets[facet].point(&grids[facets[facet].grid], x[0], x[1]);
        let before = |distance: f64| [0, 1, 2].map(|d| point[d] + distance * normal[d]);
        if owners.is_covered(before(COVER)) {
            continue;
        }
        let (from, along) = (before(CLEAR), cosine(normal, x[2], x[3]));
        match scene.first_hit(from, along) {
            None => count.escaped += 1,
            Some((solid, side, t)) => match owners.of(solid, side, [0, 1, 2].map(|d| from[d] + t * along[d])) {
                Some(owner) => count.arrived[owner] += 1,
                None => count.strayed += 1,
            },
        }
    }
    count
}

/// A direction about `normal`, distributed with the cosine of the angle to it.
fn cosine(normal: [f64; 3], u: f64, v: f64) -> [f64; 3] {
    // Two directions across the normal (Duff et al., J. Comput. Graph. Tech. 6 (2017) 1), continuous but at -z.
    let sign = 1.0f64.copysign(normal[2]);
    let a = -1.0 / (sign + normal[2]);
    let b = normal[0] * normal[1] * a;
    let e1 = [1.0 + sign * normal[0] * normal[0] * a, sign * b, -sign * normal[0]];
    let e2 = [b, sign + normal[1] * normal[1] * a, -normal[1]];
    let (sin, cos) = (u.sqrt(), (1.0 - u).sqrt());
    let (s, c) = (TAU * v).sin_cos();
    [0, 1, 2].map(|d| sin * (c * e1[d] + s * e2[d]) + cos * normal[d])
}

fn gather(batches: &[Count], surfaces: usize, each: usize) -> SurfaceView {
    let sent: u64 = batches.iter().map(|b| u64::from(b.sent())).sum();
    let share = |f: &dyn Fn(&Count) -> u32| {
        if sent == 0 { 0.0 } else { batches.iter().map(|b| u64::from(f(b))).sum::<u64>() as f64 / sent as f64 }
    };
    let error = |j: usize| {
        let shares: Vec<f64> = batches.iter().map(|b| f64::from(b.arrived[j]) / f64::from(b.sent().max(1))).collect();
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        let square: f64 = shares.iter().map(|s| (s - mean).powi(2)).sum();
        (square / (shares.len() * (shares.len() - 1)) as f64).sqrt()
    };
    SurfaceView {
        share: (0..surfaces).map(|j| share(&|b| b.arrived[j])).collect(),
        error: (0..surfaces).map(error).collect(),
        escaped: share(&|b| b.escaped),
        strayed: share(&|b| b.strayed),
        open: sent as f64 / (each * batches.len()) as f64,
    }
}

/// Sobol' points in the unit cube of four dimensions, in the order of the Gray code, shifted digit by digit.
struct Sequence {
    directions: [[u32; 32]; 4],
    at: [u32; 4],
    count: u32,
}

impl Sequence {
    /// Polynomials and first direction numbers of dimensions 2 to 4 (S. Joe and F. Y. Kuo, SIAM J. Sci. Comput. 30
    /// (2008) 2635): degree, inner coefficients, numbers. The first dimension is van der Corput's.
    const TABLE: [(usize, u32, [u32; 3]); 3] = [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

    fn new(batch: usize) -> Self {
        let mut directions = [[0u32; 32]; 4];
        directions[0] = std::array::from_fn(|i| 1 << (31 - i));
        for (own, (degree, inner, first)) in directions[1..].iter_mut().zip(Self::TABLE) {
            for i in 0..32 {
                own[i] = if i < degree {
                    first[i] << (31 - i)
                } else {
                    let start = own[i - degree] ^ (own[i - degree] >> degree);
                    (1..degree).fold(start, |v, k| if inner >> (degree - 1 - k) & 1 == 1 { v ^ own[i - k] } else { v })
                };
            }
        }
        // The shift of a batch is SplitMix64 (Steele, Lea and Flood 2014) from its number.
        let mut state = 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(batch as u64 + 1);
        let at = [0; 4].map(|_: u64| {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 32) as u32
        });
        Self { directions, at, count: 0 }
    }

    /// The next point, in the middle of its cell of 2⁻³².
    fn next(&mut self) -> [f64; 4] {
        let point = self.at.map(|x| (f64::from(x) + 0.5) / 4_294_967_296.0);
        let bit = self.count.trailing_ones() as usize;
        for (x, directions) in self.at.iter_mut().zip(&self.directions) {
            *x ^= directions[bit.min(31)];
        }
        self.count = self.count.wrapping_add(1);
        point
    }
}
