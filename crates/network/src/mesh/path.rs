//! A coolant channel through the cells of a part: stations along the path and the cells each touches.
//!
//! The channel wall is sampled by rings of points at the channel's radius. Where the grid is finer
//! than the channel, each point falls into a cell of its own and the wall is resolved; where it is
//! coarser, a whole ring falls into one cell, whose mean temperature is not the wall's. The conduction
//! between is that of a line sink in a grid (Peaceman, SPE Journal 18 (1978) 183: the cell mean is the
//! temperature at 0.198 cell widths) generalised to any set of cells by the geometric mean distance of
//! the sampled points, so that the same formula holds from coarse to fine.

use serde::{Deserialize, Serialize};

use super::Mesh;
use super::grid::LocalFrame;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Channel, Side};

/// Points on a ring around the channel's axis, a count. Chosen: error of the shares of cells against time.
const RING: usize = 12;
/// Rings on a piece of a channel, a count. Chosen: error of the shares of cells against time.
const RINGS: usize = 4;

/// A piece of the channel with one film coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Station {
    /// Length of the piece along the path, m.
    pub length: f64,
    /// Cells it touches and their share of its wall (sums to one).
    pub cells: Vec<(usize, f64)>,
    /// Conduction length factor between cells and wall: resistance = shape / (k x length), K/W; may be
    /// slightly negative on grids finer than the channel, where the sampled ring overestimates it.
    pub shape: f64,
    /// Weights of the logarithms of the three conductivities (along the block's axes) in the one across the
    /// channel, whose geometric mean acts; they sum to one.
    pub across: [f64; 3],
}

/// A straight piece of a channel, about one cell long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelPiece {
    /// Beginning of the leg of the path that it is cut from, m.
    start: [f64; 3],
    /// Vector from there to the leg's end, m.
    along: [f64; 3],
    /// Shares of the leg between which it lies.
    span: (f64, f64),
    /// Unit vector along it.
    pub direction: [f64; 3],
    /// Length as drawn, m.
    pub length: f64,
}

impl ChannelPiece {
    /// A point on its axis: 0 where it begins, 1 where it ends.
    pub fn at(&self, share: f64) -> [f64; 3] {
        let t = self.span.0 + (self.span.1 - self.span.0) * share;
        [0, 1, 2].map(|d| self.start[d] + self.along[d] * t)
    }

    /// Points on its wall, in rings: each with the middle of its ring.
    pub fn wall(&self, diameter: f64) -> Vec<([f64; 3], Vec<[f64; 3]>)> {
        let radius = diameter / 2.0;
        let [e1, e2] = self.normals();
        let ring = |centre: [f64; 3]| {
            let point = |i: usize| {
                let (sin, cos) = (std::f64::consts::TAU * (i as f64 + 0.5) / RING as f64).sin_cos();
                [0, 1, 2].map(|d| centre[d] + radius * (cos * e1[d] + sin * e2[d]))
            };
            (centre, (0..RING).map(point).collect())
        };
        (0..RINGS).map(|s| ring(self.at((s as f64 + 0.5) / RINGS as f64))).collect()
    }

    /// Two unit vectors across it, normal to each other.
    pub fn normals(&self) -> [[f64; 3]; 2] {
        normals(self.direction)
    }
}

/// The straight pieces of a channel, one for each of its stations; none of a bore.
pub fn pieces(mesh: &Mesh, channel: &Channel) -> Vec<ChannelPiece> {
    let mut found = Vec::new();
    for leg in channel.path.windows(2).filter(|_| !channel.is_bore) {
        let along = [0, 1, 2].map(|d| leg[1][d] - leg[0][d]);
        let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length <= 0.0 {
            continue;
        }
        let direction = along.map(|x| x / length);
        let step = local_width(mesh, channel, leg[0], direction).min(length);
        // A leg of whole cells must not get one piece more by rounding.
        let count = ((length / step - 1e-6).ceil() as usize).max(1);
        let piece = |i: usize| {
            let span = (i as f64 / count as f64, (i + 1) as f64 / count as f64);
            ChannelPiece { start: leg[0], along, span, direction, length: length / count as f64 }
        };
        found.extend((0..count).map(piece));
    }
    found
}

/// A cell that points of a ring fall into.
struct TouchedCell {
    /// Grid of the mesh.
    grid: usize,
    /// Cell of the mesh.
    cell: usize,
    /// Points in it, a count.
    points: f64,
}

/// Cuts a channel into stations about one cell long.
///
/// # Errors
/// The path leaves its part.
pub fn stations(mesh: &Mesh, channel: &Channel, part_name: &str) -> Result<Vec<Station>> {
    let mut found = if channel.is_bore { bore(mesh, channel) } else { Vec::new() };
    for piece in pieces(mesh, channel) {
        found.push(station(mesh, channel, part_name, &piece)?);
    }
    // The wetted length the user states counts, wherever the drawn path is a simplification.
    let drawn: f64 = found.iter().map(|s| s.length).sum();
    let stretch = channel.length.map_or(1.0, |wetted| wetted / drawn);
    for station in &mut found {
        station.length *= stretch;
    }
    Ok(found)
}

/// The stations of a hollow cylinder's bore: one per layer of cells, touching the innermost ones.
fn bore(mesh: &Mesh, channel: &Channel) -> Vec<Station> {
    let mut found = Vec::new();
    for (_, grid) in mesh.grids_of(channel.part) {
        let turn = grid.edges[1][grid.n(1)] - grid.edges[1][0];
        for k in 0..grid.n(2) {
            let cells = (0..grid.n(1)).map(|j| (grid.cell([0, j, k]), grid.width(1, j) / turn)).collect();
            let shape = grid.half_length([0, 0, k], Side::Low0) / (std::f64::consts::PI * channel.diameter);
            found.push(Station { length: grid.width(2, k), cells, shape, across: [1.0, 0.0, 0.0] });
        }
        let LocalFrame::Cylindrical { axis, .. } = grid.frame else { continue };
        if channel.path.first().zip(channel.path.last()).is_some_and(|(first, last)| first[axis.index()] > last[axis.index()]) {
            found.reverse();
        }
    }
    found
}

/// Width of the cells along the path near a point: the length of a station.
fn local_width(mesh: &Mesh, channel: &Channel, point: [f64; 3], direction: [f64; 3]) -> f64 {
    let Some(g) = mesh.grid_at(channel.part, point, channel.diameter) else { return channel.diameter };
    let grid = &mesh.grids[g];
    let c = grid.locate(point);
    let (low, high) = ([0, 1, 2].map(|d| grid.edges[d][c[d]]), [0, 1, 2].map(|d| grid.edges[d][c[d] + 1]));
    match grid.frame {
        LocalFrame::Cartesian => {
            // The distance after which a line in this direction has crossed about one cell.
            (0..3).map(|d| (high[d] - low[d]) / direction[d].abs().max(1e-9)).fold(f64::INFINITY, f64::min)
        }
        // The machine file lets no channel into a sphere; its cells are shells.
        LocalFrame::Spherical { .. } => high[0] - low[0],
        LocalFrame::Cylindrical { .. } => (high[0] - low[0]).min((high[1] - low[1]) * high[0]).min(high[2] - low[2]),
    }
}

fn station(mesh: &Mesh, channel: &Channel, part_name: &str, piece: &ChannelPiece) -> Result<Station> {
    let radius = channel.diameter / 2.0;
    let [e1, e2] = piece.normals();
    let mut cells: Vec<(usize, f64)> = Vec::new();
    let mut rings: Vec<Vec<TouchedCell>> = Vec::new();
    for (centre, points) in piece.wall(channel.diameter) {
        let Some(home) = mesh.grid_at(channel.part, centre, 1e-6) else {
            return Err(Error::input(format!(
                "the channel '{}' leaves the part '{part_name}' at ({:.4}, {:.4}, {:.4}) m",
                channel.name, centre[0], centre[1], centre[2]
            ))
            .at_key(format!("channel.{}.path", channel.name))
            .help("move the corners of the path inside the part, or name the part the channel runs through"));
        };
        let mut ring: Vec<TouchedCell> = Vec::new();
        for point in points {
            // A wall point that sticks out of the part belongs to the nearest cell of the block around the axis.
            let g = mesh.grid_at(channel.part, point, 1e-6).unwrap_or(home);
            let cell = mesh.grids[g].cell(mesh.grids[g].locate(point));
            match ring.iter_mut().find(|known| known.cell == cell) {
                Some(known) => known.points += 1.0,
                None => ring.push(TouchedCell { grid: g, cell, points: 1.0 }),
            }
            let share = 1.0 / (RING * RINGS) as f64;
            match cells.iter_mut().find(|(known, _)| *known == cell) {
                Some((_, s)) => *s += share,
                None => cells.push((cell, share)),
            }
        }
        rings.push(ring);
    }
    let mean = rings.iter().map(|ring| log_mean_distance(mesh, ring, e1, e2)).sum::<f64>() / rings.len() as f64;
    let frame = mesh.grids[rings[0][0].grid].frame;
    let shape = (mean - radius.ln()) / std::f64::consts::TAU;
    Ok(Station { length: piece.length, cells, shape, across: across(frame, piece.direction) })
}

/// Weights of the axes across a direction: half for each of two axes normal to it.
fn across(frame: LocalFrame, direction: [f64; 3]) -> [f64; 3] {
    match frame {
        LocalFrame::Cartesian => direction.map(|e| (1.0 - e * e) / 2.0),
        LocalFrame::Cylindrical { axis, .. } => {
            // The part across the axis is taken to run as much in r as in theta.
            let along = direction[axis.index()] * direction[axis.index()];
            let radial = (1.0 - (1.0 - along) / 2.0) / 2.0;
            [radial, radial, (1.0 - along) / 2.0]
        }
        LocalFrame::Spherical { .. } => [1.0, 0.0, 0.0],
    }
}

/// Mean over all pairs of sampled points of the logarithm of the distance between the cells they fall
/// into; within one cell, of 0.14 times the root of the squared widths (Peaceman's equivalent radius).
fn log_mean_distance(mesh: &Mesh, ring: &[TouchedCell], e1: [f64; 3], e2: [f64; 3]) -> f64 {
    // Place across the channel, for along it the ring is one line, and the logarithm of the equivalent radius with its square.
    let place = |touched: &TouchedCell| {
        let grid = &mesh.grids[touched.grid];
        let c = grid.indices(touched.cell);
        let centre = grid.to_machine([0, 1, 2].map(|d| grid.centre(d, c[d])));
        let corner = |high: usize| grid.to_machine([0, 1, 2].map(|d| grid.edges[d][c[d] + high]));
        let (low, high) = (corner(0), corner(1));
        let width = |e: [f64; 3]| (0..3).map(|d| (high[d] - low[d]).abs() * e[d].abs()).sum::<f64>();
        let along = |e: [f64; 3]| (0..3).map(|d| centre[d] * e[d]).sum::<f64>();
        let square = 0.14 * 0.14 * (width(e1) * width(e1) + width(e2) * width(e2));
        ([along(e1), along(e2)], square, 0.5 * square.ln())
    };
    let places: Vec<([f64; 2], f64, f64)> = ring.iter().map(place).collect();
    let mut sum = 0.0;
    for (i, (a, own, log)) in places.iter().enumerate() {
        sum += ring[i].points * ring[i].points * log;
        for (j, (b, other, other_log)) in places.iter().enumerate().skip(i + 1) {
            let apart = (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
            let of = 0.5 * apart.max(f64::MIN_POSITIVE).ln();
            let both = if apart < *own { *log } else { of } + if apart < *other { *other_log } else { of };
            sum += ring[i].points * ring[j].points * both;
        }
    }
    sum / ring.iter().map(|touched| touched.points).sum::<f64>().powi(2)
}

/// Two unit vectors normal to a direction and to each other.
fn normals(direction: [f64; 3]) -> [[f64; 3]; 2] {
    let least = (0..3).min_by(|a, b| direction[*a].abs().total_cmp(&direction[*b].abs())).unwrap_or(0);
    let mut helper = [0.0; 3];
    helper[least] = 1.0;
    let cross = |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let e1 = cross(direction, helper);
    let norm = e1.iter().map(|x| x * x).sum::<f64>().sqrt();
    let e1 = e1.map(|x| x / norm);
    [e1, cross(direction, e1)]
}
