//! Checks that channels can be drilled: a bore stays inside its part, and clear of itself and of every other channel.

use super::channels::Channel;
use super::circuits::{Circuit, branches};
use super::parts::{BlockShape, Part};
use super::shape::{contains, distance, distances, origin};
use coldplate_base::document::Section;
use coldplate_base::error::{Error, Result};

/// Thinnest wall that counts as a wall, m. Chosen: far below any real wall, above the rounding of coordinates.
const LEAST_WALL: f64 = 1e-8;
/// Length of path in bores (dimensionless) within which two places of one path may be nearer than the bore is wide.
/// Chosen to allow bends and still refuse passes that run into each other.
const BEND: f64 = 3.0;
/// Cosine (dimensionless) of the sharpest corner, 30 degrees between its legs. Chosen: sharper corners are passes that
/// fold back.
const SHARPEST: f64 = 0.866;
/// Distance from a face up to which a path counts as ending at the face, m. Chosen: far below a drawing's accuracy,
/// above rounding.
const AT_FACE: f64 = 1e-6;
/// Number of points around the wall of a bore at one station (count). Chosen: time of the check against the size of a
/// breakthrough that it can miss.
const RING: usize = 24;
/// Largest number of stations along a leg (count). Chosen: time of the check against the size of a breakthrough that it
/// can miss.
const MOST_STATIONS: usize = 2000;

type Point = [f64; 3];

/// A straight piece of a channel.
struct Leg {
    channel: usize,
    /// Number of the leg in the path, from 0.
    number: usize,
    from: Point,
    to: Point,
    /// Length of path before the leg, m.
    before: f64,
    length: f64,
}

impl Leg {
    fn direction(&self) -> Point {
        std::array::from_fn(|d| (self.to[d] - self.from[d]) / self.length)
    }

    fn at(&self, s: f64) -> Point {
        let u = self.direction();
        std::array::from_fn(|d| self.from[d] + s * u[d])
    }

    fn span(&self, axis: usize) -> (f64, f64) {
        (self.from[axis].min(self.to[axis]), self.from[axis].max(self.to[axis]))
    }
}

/// Refuses channels whose bores leave their part or run into each other.
pub(super) fn check(root: &Section<'_>, parts: &[Part], channels: &[Channel], circuits: &[Circuit]) -> Result<()> {
    for (c, channel) in channels.iter().enumerate().filter(|(_, c)| !c.is_bore) {
        for leg in legs(c, channel) {
            stays_inside(root, &parts[channel.part], channel, &leg)?;
        }
    }
    for (p, part) in parts.iter().enumerate() {
        let own = |c: &usize| channels[*c].part == p && !channels[*c].is_bore;
        let all: Vec<Leg> = (0..channels.len()).filter(own).flat_map(|c| legs(c, &channels[c])).collect();
        stay_apart(root, part, channels, circuits, all)?;
    }
    Ok(())
}

fn legs(c: usize, channel: &Channel) -> Vec<Leg> {
    let mut before = 0.0;
    let leg = |(number, ends): (usize, &[Point])| {
        let length = distance(ends[0], ends[1]);
        before += length;
        Leg { channel: c, number, from: ends[0], to: ends[1], before: before - length, length }
    };
    channel.path.windows(2).enumerate().map(leg).collect()
}

/// An error at the key that draws a channel.
fn refusal(root: &Section<'_>, channel: &Channel, what: String) -> Result<Error> {
    let section = root.section("channel")?.section(&channel.name)?;
    let key = if section.has("serpentine") { "serpentine" } else { "path" };
    Ok(section.error_at(key, what))
}

fn millimetres(metres: f64) -> String {
    format!("{} mm", (metres * 1e6).round() / 1e3 + 0.0)
}

/// A point in the coordinates of a part, as text in millimetres.
fn place(part: &Part, point: Point) -> String {
    let from = origin(part);
    let shown: Vec<String> = (0..3).map(|d| millimetres(point[d] - from[d])).collect();
    format!("[{}]", shown.join(", "))
}

fn stays_inside(root: &Section<'_>, part: &Part, channel: &Channel, leg: &Leg) -> Result<()> {
    let radius = channel.diameter / 2.0;
    let Some((point, outside)) = breakthrough(part, channel, leg, radius) else { return Ok(()) };
    let (mut fits, mut fails) = (0.0, radius);
    for _ in 0..40 {
        let middle = (fits + fails) / 2.0;
        if breakthrough(part, channel, leg, middle).is_none() { fits = middle } else { fails = middle }
    }
    let what = format!(
        "the bore of {} breaks through the surface of '{}' between corners {} and {}: at {} its wall lies {} outside",
        millimetres(channel.diameter),
        part.name,
        leg.number + 1,
        leg.number + 2,
        place(part, point),
        millimetres(outside)
    );
    let or = if fits > 1e-5 { format!(", or give a diameter below {}", millimetres(2.0 * fits)) } else { String::new() };
    Err(refusal(root, channel, what)?
        .help(format!("move the path inwards{or}; a bore may leave its part only where the path ends at a face")))
}

/// The point of a leg's wall that lies farthest outside the part, and how far, m.
fn breakthrough(part: &Part, channel: &Channel, leg: &Leg, radius: f64) -> Option<(Point, f64)> {
    if part.blocks.iter().any(|block| encloses(&block.shape, leg, radius)) {
        return None;
    }
    let u = leg.direction();
    let ports: Vec<Port> = [channel.path.first(), channel.path.last()].into_iter().flatten().flat_map(|end| ports(part, *end)).collect();
    let stations = ((leg.length / (radius / 2.0).max(1e-6)).ceil() as usize).clamp(2, MOST_STATIONS);
    let mut worst: Option<(Point, f64)> = None;
    for station in 0..=stations {
        let centre = leg.at(leg.length * station as f64 / stations as f64);
        for e in outwards(part, centre, u) {
            let wall: Point = std::array::from_fn(|d| centre[d] + (radius + LEAST_WALL) * e[d]);
            let is_inside = part.blocks.iter().any(|block| contains(&block.shape, wall, LEAST_WALL / 10.0));
            if is_inside || ports.iter().any(|port| port.lets_through(wall, u, radius)) {
                continue;
            }
            let outside = part.blocks.iter().map(|block| distances(&block.shape, wall).0).fold(f64::INFINITY, f64::min);
            if worst.is_none_or(|(_, most)| outside > most) {
                worst = Some((wall, outside));
            }
        }
    }
    worst
}

/// Whether a bore lies in one shape, by a quick test: true for boxes only, false if undecided.
fn encloses(shape: &BlockShape, leg: &Leg, radius: f64) -> bool {
    let u = leg.direction();
    let reach = |d: usize| (radius + LEAST_WALL) * (1.0 - u[d] * u[d]).max(0.0).sqrt();
    match shape {
        BlockShape::Box { min, max } => (0..3).all(|d| {
            let (low, high) = leg.span(d);
            low - reach(d) >= min[d] - LEAST_WALL / 10.0 && high + reach(d) <= max[d] + LEAST_WALL / 10.0
        }),
        BlockShape::Cylinder { .. } | BlockShape::Sphere { .. } => false,
    }
}

/// Unit vectors across a direction: a ring, and the directions towards the nearest plane and curved faces.
fn outwards(part: &Part, centre: Point, u: Point) -> Vec<Point> {
    let across = |x: Point| -> Option<Point> {
        let along: f64 = (0..3).map(|d| x[d] * u[d]).sum();
        let rest: Point = std::array::from_fn(|d| x[d] - along * u[d]);
        let norm = rest.iter().map(|r| r * r).sum::<f64>().sqrt();
        (norm > 1e-9).then(|| rest.map(|r| r / norm))
    };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let radial = part.blocks.iter().filter_map(|block| match &block.shape {
        BlockShape::Cylinder { axis, base, .. } => Some(std::array::from_fn(|d| if d == axis.index() { 0.0 } else { centre[d] - base[d] })),
        BlockShape::Box { .. } | BlockShape::Sphere { .. } => None,
    });
    let mut found: Vec<Point> = axes.into_iter().chain(radial).filter_map(across).flat_map(|e| [e, e.map(|x| -x)]).collect();
    let e1 = found[0];
    let e2: Point = [u[1] * e1[2] - u[2] * e1[1], u[2] * e1[0] - u[0] * e1[2], u[0] * e1[1] - u[1] * e1[0]];
    found.extend((0..RING).map(|i| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / RING as f64).sin_cos();
        std::array::from_fn(|d| cos * e1[d] + sin * e2[d])
    }));
    found
}

/// A face at which a path ends.
struct Port {
    at: Point,
    /// Normal of the face, out of the part.
    normal: Point,
    /// Radius of a round face, m.
    bend: Option<f64>,
}

impl Port {
    /// Whether a point of the wall lies in the mouth of the bore.
    fn lets_through(&self, wall: Point, u: Point, radius: f64) -> bool {
        let apart: Point = std::array::from_fn(|d| wall[d] - self.at[d]);
        let dot = |a: Point, b: Point| (0..3).map(|d| a[d] * b[d]).sum::<f64>();
        let steep = dot(u, self.normal).abs();
        // A bore along a face has no mouth in it.
        if steep < 0.2 {
            return false;
        }
        let sag = self.bend.map_or(0.0, |bend| if radius < bend { bend - (bend * bend - radius * radius).sqrt() } else { bend });
        dot(apart, self.normal) >= -sag - 2.0 * LEAST_WALL && distance(wall, self.at) <= (radius + sag) / steep * 1.001 + AT_FACE
    }
}

/// The faces of a part at a point.
fn ports(part: &Part, point: Point) -> Vec<Port> {
    let mut found = Vec::new();
    for block in part.blocks.iter().filter(|block| contains(&block.shape, point, AT_FACE)) {
        match &block.shape {
            BlockShape::Box { min, max } => {
                for d in 0..3 {
                    for (face, sign) in [(min[d], -1.0), (max[d], 1.0)] {
                        if (point[d] - face).abs() <= AT_FACE {
                            let normal = std::array::from_fn(|i| if i == d { sign } else { 0.0 });
                            found.push(Port { at: point, normal, bend: None });
                        }
                    }
                }
            }
            BlockShape::Cylinder { axis, base, length, inner, outer, .. } => {
                let z = axis.index();
                for (face, sign) in [(base[z], -1.0), (base[z] + length, 1.0)] {
                    if (point[z] - face).abs() <= AT_FACE {
                        found.push(Port { at: point, normal: std::array::from_fn(|i| if i == z { sign } else { 0.0 }), bend: None });
                    }
                }
                let radial: Point = std::array::from_fn(|d| if d == z { 0.0 } else { point[d] - base[d] });
                let r = radial.iter().map(|x| x * x).sum::<f64>().sqrt();
                if (r - outer).abs() <= AT_FACE {
                    found.push(Port { at: point, normal: radial.map(|x| x / r), bend: Some(*outer) });
                }
                if *inner > 0.0 && (r - inner).abs() <= AT_FACE {
                    found.push(Port { at: point, normal: radial.map(|x| -x / r), bend: None });
                }
            }
            BlockShape::Sphere { .. } => {}
        }
    }
    found
}

/// Checks that no two legs in a part come nearer than their bores are wide; bends and the joints of channels of one
/// circuit are exempt.
fn stay_apart(root: &Section<'_>, part: &Part, channels: &[Channel], circuits: &[Circuit], mut all: Vec<Leg>) -> Result<()> {
    let widest = all.iter().map(|leg| channels[leg.channel].diameter).fold(0.0, f64::max);
    let extent = |axis: usize| {
        let (low, high) =
            all.iter().map(|leg| leg.span(axis)).fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        all.iter().map(|leg| leg.span(axis).1 - leg.span(axis).0 + widest).sum::<f64>() / (high - low).max(widest)
    };
    // The axis along which the fewest legs lie side by side.
    let axis = (0..3).min_by(|a, b| extent(*a).total_cmp(&extent(*b))).unwrap_or(0);
    all.sort_by(|a, b| a.span(axis).0.total_cmp(&b.span(axis).0));
    for (i, first) in all.iter().enumerate() {
        let (_, end) = first.span(axis);
        for second in all[i + 1..].iter().take_while(|leg| leg.span(axis).0 <= end + widest) {
            let limit = (channels[first.channel].diameter + channels[second.channel].diameter) / 2.0;
            if (0..3).any(|d| first.span(d).0 > second.span(d).1 + limit || second.span(d).0 > first.span(d).1 + limit) {
                continue;
            }
            let (a, b) = if (second.channel, second.number) < (first.channel, first.number) { (second, first) } else { (first, second) };
            let constraints = separations(a, b, channels, circuits, BEND * limit);
            let Some((nearest, at)) = nearest(a, b, &constraints) else { continue };
            if nearest < limit + LEAST_WALL {
                let own = &channels[b.channel];
                let (what, help) = if a.channel == b.channel {
                    (
                        format!(
                            "the path passes itself at {} (legs {} and {}, {} apart), nearer than its bore of {} is wide",
                            place(part, at),
                            a.number + 1,
                            b.number + 1,
                            millimetres(nearest),
                            millimetres(own.diameter)
                        ),
                        "move the passes apart, or take a smaller diameter".to_string(),
                    )
                } else {
                    (
                        format!(
                            "the channels '{}' and '{}' run into each other at {}: their centres are {} apart, their bores need {}",
                            channels[a.channel].name,
                            own.name,
                            place(part, at),
                            millimetres(nearest),
                            millimetres(limit)
                        ),
                        "move one of them; channels of one circuit may meet where both paths end".to_string(),
                    )
                };
                return Err(refusal(root, own, what)?.help(help));
            }
        }
    }
    Ok(())
}

/// Constraints on the pairs of places on two legs to be checked, s and t metres from the beginnings of the legs: each
/// entry [p, q, c] means p s + q t >= c.
fn separations(a: &Leg, b: &Leg, channels: &[Channel], circuits: &[Circuit], least: f64) -> Vec<[f64; 3]> {
    if a.channel == b.channel {
        let turn: f64 = (0..3).map(|d| -a.direction()[d] * b.direction()[d]).sum();
        // A corner that folds back is not exempt as a bend.
        if b.number == a.number + 1 && turn > SHARPEST {
            return vec![[-1.0, 1.0, a.before - b.before + 1e-9]];
        }
        return vec![[-1.0, 1.0, least + a.before - b.before]];
    }
    let is_joint = circuits.iter().any(|circuit| [a, b].iter().all(|leg| branches(&circuit.layout, leg.channel).is_some()));
    let mut found = Vec::new();
    let (one, two) = (&channels[a.channel], &channels[b.channel]);
    let ends = |channel: &Channel| [channel.path.first().copied(), channel.path.last().copied()];
    let whole = |channel: &Channel| channel.path.windows(2).map(|w| distance(w[0], w[1])).sum::<f64>();
    for (i, p) in ends(one).into_iter().enumerate() {
        for (j, q) in ends(two).into_iter().enumerate() {
            let (Some(p), Some(q)) = (p, q) else { continue };
            let apart = distance(p, q);
            if !is_joint || apart >= (one.diameter + two.diameter) / 2.0 {
                continue;
            }
            // Distance from the joint along each path: from its beginning, or from its end.
            let along = |leg: &Leg, channel: &Channel, end: usize| {
                if end == 0 { (1.0, leg.before) } else { (-1.0, whole(channel) - leg.before) }
            };
            let ((p, own), (q, other)) = (along(a, one, i), along(b, two, j));
            found.push([p, q, least - apart - own - other]);
        }
    }
    found
}

/// Smallest distance (m) between two legs among the places that fulfil the constraints, and the point half way between
/// them.
fn nearest(a: &Leg, b: &Leg, constraints: &[[f64; 3]]) -> Option<(f64, Point)> {
    let mut corners = vec![[0.0, 0.0], [a.length, 0.0], [a.length, b.length], [0.0, b.length]];
    for [p, q, c] in constraints {
        let value = |x: [f64; 2]| p * x[0] + q * x[1] - c;
        let mut kept = Vec::new();
        for (i, x) in corners.iter().enumerate() {
            let y = corners[(i + 1) % corners.len()];
            let (own, next) = (value(*x), value(y));
            if own >= 0.0 {
                kept.push(*x);
            }
            if (own >= 0.0) != (next >= 0.0) {
                let share = own / (own - next);
                kept.push([x[0] + share * (y[0] - x[0]), x[1] + share * (y[1] - x[1])]);
            }
        }
        corners = kept;
    }
    let (u, v) = (a.direction(), b.direction());
    let apart = |x: [f64; 2]| distance(a.at(x[0]), b.at(x[1]));
    let mut best: Option<[f64; 2]> = None;
    let mut consider = |x: [f64; 2]| {
        if best.is_none_or(|known| apart(x) < apart(known)) {
            best = Some(x);
        }
    };
    // The squared distance is a parabola along an edge.
    for (i, x) in corners.iter().enumerate() {
        let y = corners[(i + 1) % corners.len()];
        let (ds, dt) = (y[0] - x[0], y[1] - x[1]);
        let (p, q) = (a.at(x[0]), b.at(x[1]));
        let change: Point = std::array::from_fn(|d| ds * u[d] - dt * v[d]);
        let square: f64 = change.iter().map(|c| c * c).sum();
        let slope: f64 = (0..3).map(|d| (p[d] - q[d]) * change[d]).sum();
        let share = if square > 0.0 { (-slope / square).clamp(0.0, 1.0) } else { 0.0 };
        consider([x[0] + share * ds, x[1] + share * dt]);
    }
    // The place where the lines themselves are nearest, if it fulfils the constraints.
    let cosine: f64 = (0..3).map(|d| u[d] * v[d]).sum();
    let across = 1.0 - cosine * cosine;
    if across > 1e-12 && !corners.is_empty() {
        let w: Point = std::array::from_fn(|d| a.from[d] - b.from[d]);
        let (wu, wv): (f64, f64) = ((0..3).map(|d| w[d] * u[d]).sum(), (0..3).map(|d| w[d] * v[d]).sum());
        let x = [(cosine * wv - wu) / across, (wv - cosine * wu) / across];
        let is_inside = (0.0..=a.length).contains(&x[0])
            && (0.0..=b.length).contains(&x[1])
            && constraints.iter().all(|[p, q, c]| p * x[0] + q * x[1] >= *c);
        if is_inside {
            consider(x);
        }
    }
    let x = best?;
    let (p, q) = (a.at(x[0]), b.at(x[1]));
    Some((apart(x), std::array::from_fn(|d| (p[d] + q[d]) / 2.0)))
}
