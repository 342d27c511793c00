//! The first hit of a ray among all blocks and imported parts of a machine.

use std::f64::consts::TAU;

use super::bounds;
use super::grid::LocalFrame;
use coldplate_base::vector::{cross, dot, minus};
use coldplate_describe::machine::{BlockShape, Side};

/// Most solids in a leaf of the tree, a count. Chosen: depth of the tree against tests in a leaf.
const LEAF: usize = 3;

/// An obstacle of rays.
#[derive(Debug, Clone)]
pub enum Obstacle {
    /// A block.
    Block(BlockShape),
    /// A triangle of the boundary of an imported part: its corners, m. It has two faces and no sides.
    Triangle([[f64; 3]; 3]),
}

impl Obstacle {
    /// The box around it, m.
    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        match self {
            Self::Block(shape) => bounds(shape),
            Self::Triangle([a, b, c]) => ([0, 1, 2].map(|d| a[d].min(b[d]).min(c[d])), [0, 1, 2].map(|d| a[d].max(b[d]).max(c[d]))),
        }
    }

    /// Side and distance at which a ray from outside meets the surface; for a triangle the side means nothing.
    fn hit(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<(Side, f64)> {
        match self {
            Self::Block(shape) => hit(shape, origin, direction),
            Self::Triangle(corners) => triangle_hit(corners, origin, direction).map(|t| (Side::Low0, t)),
        }
    }
}

/// The blocks and imported boundaries of a machine in a tree of boxes around them.
#[derive(Debug, Clone)]
pub struct Scene {
    solids: Vec<Obstacle>,
    /// Indices of the solids, leaf by leaf.
    order: Vec<usize>,
    /// The root comes first.
    nodes: Vec<Node>,
}

/// A box around some solids.
#[derive(Debug, Clone)]
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    inside: Inside,
}

#[derive(Debug, Clone)]
enum Inside {
    /// Two other nodes.
    Nodes(usize, usize),
    /// A range of the order.
    Solids(std::ops::Range<usize>),
}

impl Scene {
    /// The scene of some solids; hits name them by their index.
    pub fn new(solids: Vec<Obstacle>) -> Self {
        let mut scene = Self { order: (0..solids.len()).collect(), solids, nodes: Vec::new() };
        if !scene.solids.is_empty() {
            scene.grow(0..scene.solids.len());
        }
        scene
    }

    /// Adds the node of a range of the order and everything below it; returns its index.
    fn grow(&mut self, range: std::ops::Range<usize>) -> usize {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for solid in &self.order[range.clone()] {
            let own = self.solids[*solid].bounds();
            for d in 0..3 {
                (low[d], high[d]) = (low[d].min(own.0[d]), high[d].max(own.1[d]));
            }
        }
        let at = self.nodes.len();
        self.nodes.push(Node { low, high, inside: Inside::Solids(range.clone()) });
        if range.len() > LEAF {
            let middle = |solid: usize, d: usize| {
                let (low, high) = self.solids[solid].bounds();
                low[d] + high[d]
            };
            let spread = |d: usize| {
                let all = self.order[range.clone()].iter().map(|s| middle(*s, d));
                all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
            };
            let d = (0..3).max_by(|a, b| spread(*a).total_cmp(&spread(*b))).unwrap_or(0);
            let mut sorted = self.order[range.clone()].to_vec();
            sorted.sort_by(|a, b| middle(*a, d).total_cmp(&middle(*b, d)).then(a.cmp(b)));
            self.order[range.clone()].copy_from_slice(&sorted);
            let half = range.start + range.len() / 2;
            let (first, second) = (self.grow(range.start..half), self.grow(half..range.end));
            self.nodes[at].inside = Inside::Nodes(first, second);
        }
        at
    }

    /// The first surface a ray from outside all of them meets: index of the solid, its side, the distance in
    /// lengths of `direction`.
    pub(crate) fn first_hit(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<(usize, Side, f64)> {
        let inverse = direction.map(|d| 1.0 / d);
        let mut nearest: Option<(usize, Side, f64)> = None;
        // The depth of the tree is the logarithm of the number of solids: 64 is never reached.
        let mut stack = [0usize; 64];
        let mut waiting = usize::from(!self.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let node = &self.nodes[stack[waiting]];
            let reach = nearest.map_or(f64::INFINITY, |hit| hit.2);
            if !meets(node, origin, inverse, reach) {
                continue;
            }
            match &node.inside {
                Inside::Nodes(first, second) if waiting + 2 <= stack.len() => {
                    (stack[waiting], stack[waiting + 1]) = (*first, *second);
                    waiting += 2;
                }
                Inside::Nodes(..) => {}
                Inside::Solids(range) => {
                    for solid in &self.order[range.clone()] {
                        let hit = self.solids[*solid].hit(origin, direction);
                        if let Some((side, t)) = hit
                            && nearest.is_none_or(|known| t < known.2)
                        {
                            nearest = Some((*solid, side, t));
                        }
                    }
                }
            }
        }
        nearest
    }
}

/// Whether a ray passes through a node's box before `reach`.
fn meets(node: &Node, origin: [f64; 3], inverse: [f64; 3], reach: f64) -> bool {
    let (mut enter, mut leave) = (0.0f64, reach);
    for d in 0..3 {
        let (a, b) = ((node.low[d] - origin[d]) * inverse[d], (node.high[d] - origin[d]) * inverse[d]);
        // A ray within a side's plane gives 0 times infinity, which min and max pass over.
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    enter <= leave
}

/// Side and distance at which a ray from outside a shape meets its surface.
fn hit(shape: &BlockShape, origin: [f64; 3], direction: [f64; 3]) -> Option<(Side, f64)> {
    match shape {
        BlockShape::Box { min, max } => box_hit(min, max, origin, direction),
        BlockShape::Cylinder { axis, base, length, inner, outer, turn } => {
            let [u, v] = LocalFrame::normals(*axis);
            let z = axis.index();
            let local = |p: [f64; 3], b: [f64; 3]| [p[u] - b[u], p[v] - b[v], p[z] - b[z]];
            let tube = Tube { length: *length, inner: *inner, outer: *outer, turn: *turn };
            tube.hit(local(origin, *base), local(direction, [0.0; 3]))
        }
        BlockShape::Sphere { centre, inner, outer } => {
            let from = [0, 1, 2].map(|d| origin[d] - centre[d]);
            let (a, b) = (dot(direction, direction), dot(from, direction));
            let nearest = |side: Side, radius: f64| {
                let roots = roots(a, b, dot(from, from) - radius * radius)?;
                roots.into_iter().find(|t| *t > 0.0).map(|t| (side, t))
            };
            let outside = nearest(Side::High0, *outer);
            let inside = if *inner > 0.0 { nearest(Side::Low0, *inner) } else { None };
            earlier(outside, inside)
        }
    }
}

/// How far along a ray a triangle is (Möller and Trumbore, J. Graphics Tools 2 (1997) 21).
fn triangle_hit([a, b, c]: &[[f64; 3]; 3], origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
    let (e, f, from) = (minus(*b, *a), minus(*c, *a), minus(origin, *a));
    let p = cross(direction, f);
    let determinant = dot(e, p);
    if determinant == 0.0 {
        return None; // along the triangle
    }
    let q = cross(from, e);
    let (u, v, t) = (dot(from, p) / determinant, dot(direction, q) / determinant, dot(f, q) / determinant);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

fn earlier(a: Option<(Side, f64)>, b: Option<(Side, f64)>) -> Option<(Side, f64)> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.1 < a.1 { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// The roots of a t² + 2 b t + c, ascending, without cancellation.
fn roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 || a == 0.0 {
        return None;
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let (first, second) = (q / a, if q == 0.0 { 0.0 } else { c / q });
    Some(if first < second { [first, second] } else { [second, first] })
}

fn box_hit(min: &[f64; 3], max: &[f64; 3], origin: [f64; 3], direction: [f64; 3]) -> Option<(Side, f64)> {
    let (mut enter, mut leave, mut side) = (f64::NEG_INFINITY, f64::INFINITY, Side::Low0);
    for d in 0..3 {
        if direction[d] == 0.0 {
            if origin[d] < min[d] || origin[d] > max[d] {
                return None;
            }
            continue;
        }
        let forward = direction[d] > 0.0;
        let (near, far) = if forward { (min[d], max[d]) } else { (max[d], min[d]) };
        let t = (near - origin[d]) / direction[d];
        if t > enter {
            (enter, side) = (t, Side::ALL[2 * d + usize::from(!forward)]);
        }
        leave = leave.min((far - origin[d]) / direction[d]);
    }
    (enter > 0.0 && enter <= leave).then_some((side, enter))
}

/// A cylinder in its own coordinates: two across its axis, then along it from its base.
struct Tube {
    length: f64,
    inner: f64,
    outer: f64,
    turn: (f64, f64),
}

impl Tube {
    fn is_full(&self) -> bool {
        self.turn.1 - self.turn.0 > TAU * (1.0 - 1e-9)
    }

    fn in_turn(&self, x: f64, y: f64) -> bool {
        self.is_full() || (y.atan2(x) - self.turn.0).rem_euclid(TAU) <= self.turn.1 - self.turn.0
    }

    fn hit(&self, o: [f64; 3], d: [f64; 3]) -> Option<(Side, f64)> {
        let at = |t: f64| [o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]];
        let mut nearest: Option<(Side, f64)> = None;
        let mut offer = |side: Side, t: f64| {
            if t > 0.0 && nearest.is_none_or(|known| t < known.1) {
                nearest = Some((side, t));
            }
        };
        for (side, radius) in [(Side::High0, self.outer), (Side::Low0, self.inner)] {
            if radius <= 0.0 {
                continue;
            }
            let quadratic = (d[0] * d[0] + d[1] * d[1], o[0] * d[0] + o[1] * d[1], o[0] * o[0] + o[1] * o[1] - radius * radius);
            for t in roots(quadratic.0, quadratic.1, quadratic.2).into_iter().flatten() {
                let p = at(t);
                if (0.0..=self.length).contains(&p[2]) && self.in_turn(p[0], p[1]) {
                    offer(side, t);
                }
            }
        }
        for (side, end) in [(Side::Low2, 0.0), (Side::High2, self.length)] {
            let t = (end - o[2]) / d[2];
            if t.is_finite() {
                let p = at(t);
                let r2 = p[0] * p[0] + p[1] * p[1];
                if r2 <= self.outer * self.outer && r2 >= self.inner * self.inner && self.in_turn(p[0], p[1]) {
                    offer(side, t);
                }
            }
        }
        if !self.is_full() {
            for (side, angle) in [(Side::Low1, self.turn.0), (Side::High1, self.turn.1)] {
                let (sin, cos) = angle.sin_cos();
                let t = -(o[1] * cos - o[0] * sin) / (d[1] * cos - d[0] * sin);
                if t.is_finite() {
                    let p = at(t);
                    let r = p[0] * cos + p[1] * sin;
                    if (self.inner..=self.outer).contains(&r) && (0.0..=self.length).contains(&p[2]) {
                        offer(side, t);
                    }
                }
            }
        }
        nearest
    }
}
