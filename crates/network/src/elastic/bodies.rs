//! Blocks that move as one, the joints between them, and whether they are held.

use nalgebra::{DMatrix, Matrix3, SMatrix, SymmetricEigen, Vector3};

use super::nodes::Nodes;
use crate::mesh::grid::{Grid, tangents};
use crate::mesh::overlap::Overlap;
use crate::mesh::{Mesh, TouchingFaces};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Face, JointKind, Machine, Side};
use std::f64::consts::TAU;

/// Stiffness of a rigid joint per area, over that of the cells beside it; dimensionless. Chosen: compliance of the joint against
/// iterations.
const RIGID: f64 = 100.0;
/// Corners nearer than this (m) are one: twice the distance at which faces touch.
const TOGETHER: f64 = 2e-6;
/// A motion that is held by less than this share of the firmest is free, dimensionless. Chosen above rounding.
const FREE: f64 = 1e-9;

/// A spring between two places.
pub(crate) struct Spring {
    /// Corners with their weights: the first place counts positive, the second negative.
    pub ends: [(u32, f64); 8],
    /// Stiffness along x, y, z, N/m.
    pub stiffness: Matrix3<f64>,
    /// Place of the spring, m.
    point: [f64; 3],
    /// The grids it joins.
    grids: [usize; 2],
    /// Unit matrix of the directions it holds.
    holds: Matrix3<f64>,
}

/// The grids that take part, and the joints that hold them together.
pub(crate) struct ElasticBodies {
    /// A number for all grids that move as one; `None` for grids that take no part.
    body: Vec<Option<usize>>,
    /// Springs between cells.
    pub springs: Vec<Spring>,
    /// Directions in which corners are held.
    pub held: Vec<[bool; 3]>,
}

/// Mechanical kind of an interface.
fn kind(machine: &Machine, mesh: &Mesh, interface: &TouchingFaces) -> JointKind {
    let faces = [interface.a, interface.b].map(|(g, side)| {
        let grid = &mesh.grids[g];
        Face { part: grid.part, block: Some(grid.block), side }
    });
    machine.contact_between(faces).map_or(JointKind::Glued, |(contact, _)| machine.contacts[contact].joint)
}

/// Numbers of sets: joined members have one number, the smallest of them.
struct Sets(Vec<usize>);

impl Sets {
    fn of(&self, mut i: usize) -> usize {
        while self.0[i] != i {
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a.max(b)] = a.min(b);
    }
}

impl ElasticBodies {
    /// The bodies connected with any of the `wanted` grids. Joins corners that move as one.
    ///
    /// # Errors
    /// A connected part can move freely.
    pub fn new(machine: &Machine, mesh: &Mesh, nodes: &mut Nodes<'_>, wanted: &[usize], modulus: &[f64]) -> Result<Self> {
        let kinds: Vec<JointKind> = mesh.interfaces.iter().map(|i| kind(machine, mesh, i)).collect();
        let linked = linked(mesh, &kinds);
        let takes_part = |g: usize| wanted.iter().any(|w| linked.of(*w) == linked.of(g));
        let mut bodies = Sets((0..mesh.grids.len()).collect());
        let mut springs = Vec::new();
        for (interface, kind) in mesh.interfaces.iter().zip(&kinds).filter(|(i, _)| takes_part(i.a.0)) {
            let is_one = matches!(kind, JointKind::Glued);
            let (normal, tangential) = match kind {
                JointKind::Open => continue,
                JointKind::Glued => (f64::INFINITY, f64::INFINITY),
                JointKind::Springs { normal, tangential } => (*normal, *tangential),
            };
            if is_one {
                bodies.join(interface.a.0, interface.b.0);
            }
            let rigid = rigid(mesh, interface, modulus);
            for overlap in &interface.overlaps {
                if is_one && merge(mesh, nodes, interface, [overlap.a, overlap.b]) {
                    continue;
                }
                let points = points(mesh, interface, overlap);
                let area = overlap.area / points.len() as f64;
                let [(ga, sa), (gb, sb)] = [interface.a, interface.b];
                for point in points {
                    let axis = normal_at(&mesh.grids[ga], sa, point);
                    let across = axis * axis.transpose();
                    let along = Matrix3::identity() - across;
                    let stiffness = (across * normal.min(rigid) + along * tangential.min(rigid)) * area;
                    let holds = across + if tangential > 0.0 { along } else { Matrix3::zeros() };
                    let a = nodes.on_face(ga, mesh.grids[ga].indices(overlap.a), sa, point);
                    let b = nodes.on_face(gb, mesh.grids[gb].indices(overlap.b), sb, point);
                    let ends = std::array::from_fn(|i| if i < 4 { a[i] } else { (b[i - 4].0, -b[i - 4].1) });
                    springs.push(Spring { ends, stiffness, point, grids: [ga, gb], holds });
                }
            }
        }
        let body = (0..mesh.grids.len()).map(|g| takes_part(g).then(|| bodies.of(g))).collect();
        let held = held(machine, mesh, nodes);
        let found = Self { body, springs, held };
        found.check_held(machine, mesh, nodes)?;
        Ok(found)
    }

    /// Whether a grid takes part.
    pub fn has(&self, grid: usize) -> bool {
        self.body[grid].is_some()
    }

    /// Whether anything can move without resistance.
    fn check_held(&self, machine: &Machine, mesh: &Mesh, nodes: &Nodes<'_>) -> Result<()> {
        let mut numbers: Vec<usize> = self.body.iter().flatten().copied().collect();
        numbers.sort_unstable();
        numbers.dedup();
        let place = |g: usize| self.body[g].and_then(|own| numbers.binary_search(&own).ok());
        // Motions of each body: along x, y, z, and about axes through its middle, m per its own size.
        let mut boxes = vec![[[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]; numbers.len()];
        for (g, grid) in mesh.grids.iter().enumerate() {
            let Some(own) = place(g) else { continue };
            for c in (0..8).map(|i| [0, 1, 2].map(|d| if i >> d & 1 == 1 { grid.n(d) } else { 0 })) {
                let at = nodes.place(g, c);
                for d in 0..3 {
                    boxes[own][0][d] = boxes[own][0][d].min(at[d]);
                    boxes[own][1][d] = boxes[own][1][d].max(at[d]);
                }
            }
        }
        let motions = |own: usize, point: [f64; 3]| -> SMatrix<f64, 3, 6> {
            let [low, high] = boxes[own].map(Vector3::from);
            let [x, y, z] = ((Vector3::from(point) - (low + high) / 2.0) / (high - low).norm()).into();
            #[rustfmt::skip]
            let found = SMatrix::from_row_slice(&[
                1.0, 0.0, 0.0, 0.0, z, -y,
                0.0, 1.0, 0.0, -z, 0.0, x,
                0.0, 0.0, 1.0, y, -x, 0.0,
            ]);
            found
        };
        let mut sum = DMatrix::<f64>::zeros(6 * numbers.len(), 6 * numbers.len());
        let mut add = |ends: &[(usize, SMatrix<f64, 3, 6>)], holds: &Matrix3<f64>| {
            for (i, own) in ends {
                for (j, far) in ends {
                    let mut block = sum.fixed_view_mut::<6, 6>(6 * i, 6 * j);
                    block += own.transpose() * holds * far;
                }
            }
        };
        for spring in &self.springs {
            if let [Some(a), Some(b)] = spring.grids.map(place)
                && a != b
            {
                add(&[(a, motions(a, spring.point)), (b, -motions(b, spring.point))], &spring.holds);
            }
        }
        for g in 0..mesh.grids.len() {
            let Some(own) = place(g) else { continue };
            for (node, at) in nodes.of_grid(g) {
                let held = self.held[node as usize];
                if held != [false; 3] {
                    let holds = Matrix3::from_diagonal(&Vector3::from(held.map(|h| if h { 1.0 } else { 0.0 })));
                    add(&[(own, motions(own, nodes.place(g, at)))], &holds);
                }
            }
        }
        let eigen = SymmetricEigen::new(sum);
        let firmest = eigen.eigenvalues.max();
        let loose = eigen.eigenvalues.iter().position(|value| *value <= FREE * firmest);
        let Some(loose) = loose else { return Ok(()) };
        let motion = eigen.eigenvectors.column(loose);
        let most = motion.iamax();
        let parts: Vec<&str> = (0..mesh.grids.len())
            .filter(|g| place(*g) == Some(most / 6))
            .map(|g| machine.parts[mesh.grids[g].part].name.as_str())
            .collect();
        let axis = ["x", "y", "z"][most % 3];
        let how = if most % 6 < 3 { format!("along {axis}") } else { format!("about {axis}") };
        let name = parts.first().copied().unwrap_or_default();
        let with = if parts.iter().any(|p| *p != name) { " with the parts glued to it" } else { "" };
        Err(Error::input(format!("'{name}'{with} can move freely {how}: nothing holds it there")).at_key("support").help(format!(
            "hold a face: [support.{}] faces = [\"{name}.-z\"], directions = [\"{axis}\"]; or let a sliding joint of it stick by \
                 tangential_stiffness",
            if most % 6 < 3 { axis } else { "feet" }
        )))
    }
}

/// Grids that hang together by any joint.
fn linked(mesh: &Mesh, kinds: &[JointKind]) -> Sets {
    let mut linked = Sets((0..mesh.grids.len()).collect());
    for (interface, _) in mesh.interfaces.iter().zip(kinds).filter(|(_, kind)| **kind != JointKind::Open) {
        linked.join(interface.a.0, interface.b.0);
    }
    linked
}

/// Stiffness per area (N/m³) beside which the cells of an interface are soft.
fn rigid(mesh: &Mesh, interface: &TouchingFaces, modulus: &[f64]) -> f64 {
    let softness = |(g, side): (usize, Side)| {
        let grid = &mesh.grids[g];
        let d = side.axis();
        let at = if side.is_high() { grid.n(d) - 1 } else { 0 };
        let scale = if d == 1 && grid.is_cylindrical() { grid.edges[0][grid.n(0)] } else { 1.0 };
        grid.width(d, at) * scale / modulus[grid.part]
    };
    RIGID * 2.0 / (softness(interface.a) + softness(interface.b))
}

/// Lets the corners of two cells' faces move as one where they coincide; returns whether they do.
fn merge(mesh: &Mesh, nodes: &mut Nodes<'_>, interface: &TouchingFaces, cells: [usize; 2]) -> bool {
    let [a, b] =
        [(interface.a, cells[0]), (interface.b, cells[1])].map(|((g, side), cell)| nodes.of_face(g, mesh.grids[g].indices(cell), side));
    let apart = |p: [f64; 3], q: [f64; 3]| (0..3).map(|d| (p[d] - q[d]).powi(2)).sum::<f64>().sqrt();
    let pairs: Vec<(u32, u32)> =
        a.iter().filter_map(|(node, at)| Some((*node, b.iter().find(|(_, far)| apart(*at, *far) < TOGETHER)?.0))).collect();
    if pairs.len() < 4 {
        return false;
    }
    pairs.into_iter().for_each(|(a, b)| nodes.join(a, b));
    true
}

/// Points at which springs join the area that two cells share: Gauss's points of a rectangle in local coordinates that both grids have,
/// so that the joint resists being turned out to its edges; otherwise its middle.
fn points(mesh: &Mesh, interface: &TouchingFaces, overlap: &Overlap) -> Vec<[f64; 3]> {
    let [(ga, side), (gb, _)] = [interface.a, interface.b];
    let (a, b) = (&mesh.grids[ga], &mesh.grids[gb]);
    let (own, far) = (a.indices(overlap.a), b.indices(overlap.b));
    let middle = a.to_local(overlap.point);
    let mut spans = [[0.0; 2]; 2];
    for (span, d) in spans.iter_mut().zip(tangents(side.axis())) {
        let turn = if d == 1 && a.is_cylindrical() { TAU } else { f64::INFINITY };
        let shift = |x: f64| if turn.is_finite() { turn * ((middle[d] - x) / turn).round() } else { 0.0 };
        let edges = |grid: &Grid, i: usize| {
            let by = shift(f64::midpoint(grid.edges[d][i], grid.edges[d][i + 1]));
            [grid.edges[d][i] + by, grid.edges[d][i + 1] + by]
        };
        let (one, other) = (edges(a, own[d]), edges(b, far[d]));
        *span = [one[0].max(other[0]), one[1].min(other[1])];
        // Grids in other coordinates share no rectangle.
        let off = (f64::midpoint(span[0], span[1]) - middle[d] - shift(middle[d])).abs();
        if a.is_cylindrical() != b.is_cylindrical() || off > 1e-3 * (span[1] - span[0]) {
            return vec![overlap.point];
        }
    }
    let [p, q] = tangents(side.axis());
    let gauss = |[low, high]: [f64; 2], sign: f64| f64::midpoint(low, high) + sign * (high - low) / 2.0 / f64::sqrt(3.0);
    let at = |(i, j): (f64, f64)| {
        let mut local = middle;
        (local[p], local[q]) = (gauss(spans[0], i), gauss(spans[1], j));
        a.to_machine(local)
    };
    [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(at).to_vec()
}

/// Unit normal of a grid's side at a point (m) of it.
fn normal_at(grid: &Grid, side: Side, point: [f64; 3]) -> Vector3<f64> {
    let local = grid.to_local(point);
    let step = 1e-3 * grid.width(side.axis(), 0);
    let mut beside = local;
    beside[side.axis()] += step;
    let (from, to) = (grid.to_machine(local), grid.to_machine(beside));
    (Vector3::from(to) - Vector3::from(from)).normalize()
}

/// Directions in which supports hold corners.
fn held(machine: &Machine, mesh: &Mesh, nodes: &Nodes<'_>) -> Vec<[bool; 3]> {
    let mut held = vec![[false; 3]; nodes.len()];
    for (g, grid) in mesh.grids.iter().enumerate() {
        for side in Side::ALL {
            let holds = machine.elasticity.held(Face { part: grid.part, block: Some(grid.block), side });
            if holds == [false; 3] {
                continue;
            }
            for c in grid.side_cells(side) {
                for (node, _) in nodes.of_face(g, c, side) {
                    (0..3).for_each(|d| held[node as usize][d] |= holds[d]);
                }
            }
        }
    }
    held
}
