//! Contour lines of a function on a rectangular grid (marching squares), and where to label them.

use std::collections::BTreeMap;

use super::canvas::{PixelPoint, PixelSize};
use coldplate_base::error::{Error, Result};

/// Values on a rectangular grid, not necessarily evenly spaced. A value that is not finite is a hole.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ValueGrid {
    /// Rising horizontal positions, at least two.
    pub x: Vec<f64>,
    /// Rising vertical positions, at least two.
    pub y: Vec<f64>,
    /// Values, `z[j * x.len() + i]` at `(x[i], y[j])`.
    pub z: Vec<f64>,
}

/// One connected contour line, in the coordinates of the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Points of the line in order.
    pub points: Vec<PixelPoint>,
    /// Whether the last point joins the first (which is then repeated at the end).
    pub closed: bool,
}

impl ValueGrid {
    /// Checks and takes the values.
    ///
    /// # Errors
    /// Input: fewer than two positions, positions that do not rise, a wrong number of values.
    pub fn new(x: Vec<f64>, y: Vec<f64>, z: Vec<f64>) -> Result<Self> {
        for (name, axis) in [("horizontal", &x), ("vertical", &y)] {
            let rises = axis.windows(2).all(|p| p[0] < p[1]) && axis.iter().all(|v| v.abs() < 1e300);
            if axis.len() < 2 || !rises {
                return Err(Error::input(format!("the {name} positions of a map must be at least two finite, rising numbers"))
                    .read(format!("{} positions", axis.len())));
            }
        }
        if z.len() != x.len() * y.len() {
            return Err(Error::input("a map needs one value per pair of positions").read(format!(
                "{} values for {} x {} positions",
                z.len(),
                x.len(),
                y.len()
            )));
        }
        Ok(Self { x, y, z })
    }

    /// The value at node `(i, j)`; a hole outside.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        if i < self.x.len() { self.z.get(j * self.x.len() + i).copied().unwrap_or(f64::NAN) } else { f64::NAN }
    }

    /// The value between the nodes, bilinear; a hole outside and in cells with a hole.
    pub fn value(&self, x: f64, y: f64) -> f64 {
        let (Some((i, s)), Some((j, t))) = (cell(&self.x, x), cell(&self.y, y)) else { return f64::NAN };
        let low = self.at(i, j) * (1.0 - s) + self.at(i + 1, j) * s;
        let high = self.at(i, j + 1) * (1.0 - s) + self.at(i + 1, j + 1) * s;
        low * (1.0 - t) + high * t
    }

    /// The four corners of a cell, counterclockwise from the lower left, unless one is a hole.
    pub fn corners(&self, i: usize, j: usize) -> Option<[(PixelPoint, f64); 4]> {
        let corner = |i: usize, j: usize| Some(((*self.x.get(i)?, *self.y.get(j)?), self.at(i, j)));
        let four = [corner(i, j)?, corner(i + 1, j)?, corner(i + 1, j + 1)?, corner(i, j + 1)?];
        four.iter().all(|c| c.1.is_finite()).then_some(four)
    }

    /// The lines where the function equals `level`.
    pub(crate) fn contour(&self, level: f64) -> Vec<Line> {
        self.contour_in(level, |_, _| true)
    }

    /// The lines where the function equals `level`, only through cells, named by their lower left nodes, for which
    /// `is_open` holds.
    pub(crate) fn contour_in(&self, level: f64, is_open: impl Fn(usize, usize) -> bool) -> Vec<Line> {
        chain(self.pieces(level, is_open))
    }

    /// The straight pieces of the contour, cell by cell; their ends are named by the grid edge they lie on.
    fn pieces(&self, level: f64, is_open: impl Fn(usize, usize) -> bool) -> Vec<[(Edge, PixelPoint); 2]> {
        let mut pieces = Vec::new();
        for j in 0..self.y.len() - 1 {
            for i in (0..self.x.len() - 1).filter(|i| is_open(*i, j)) {
                let Some(four) = self.corners(i, j) else { continue };
                let edges = [(i, j, false), (i + 1, j, true), (i, j + 1, false), (i, j, true)];
                let cut = |e: usize| {
                    let ((a, za), (b, zb)) = (four[e], four[(e + 1) % 4]);
                    ((za >= level) != (zb >= level)).then(|| {
                        let t = ((level - za) / (zb - za)).clamp(0.0, 1.0);
                        (edges[e], (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)))
                    })
                };
                let cuts: Vec<(Edge, PixelPoint)> = (0..4).filter_map(cut).collect();
                match cuts[..] {
                    [a, b] => pieces.push([a, b]),
                    [a, b, c, d] => {
                        // A saddle: the mean of the corners says which corners are joined.
                        let mean = four.iter().map(|c| c.1).sum::<f64>() / 4.0;
                        if (mean >= level) == (four[0].1 >= level) {
                            pieces.extend([[a, b], [c, d]]);
                        } else {
                            pieces.extend([[d, a], [b, c]]);
                        }
                    }
                    _ => {}
                }
            }
        }
        pieces
    }
}

/// The cell a position lies in and how far along it, 0 to 1.
fn cell(axis: &[f64], v: f64) -> Option<(usize, f64)> {
    let (first, last) = (*axis.first()?, *axis.last()?);
    if !(v >= first && v <= last) {
        return None;
    }
    let i = axis.partition_point(|a| *a <= v).clamp(1, axis.len() - 1) - 1;
    Some((i, ((v - axis[i]) / (axis[i + 1] - axis[i])).clamp(0.0, 1.0)))
}

/// A grid edge: the node it begins at, and whether it is vertical.
type Edge = (usize, usize, bool);

/// Joins pieces that share an end into lines; the order of the pieces decides the order of the lines.
fn chain(pieces: Vec<[(Edge, PixelPoint); 2]>) -> Vec<Line> {
    let mut ends: BTreeMap<Edge, Vec<usize>> = BTreeMap::new();
    for (index, piece) in pieces.iter().enumerate() {
        for (edge, _) in piece {
            ends.entry(*edge).or_default().push(index);
        }
    }
    let mut used = vec![false; pieces.len()];
    let mut lines = Vec::new();
    for start in 0..pieces.len() {
        if used[start] {
            continue;
        }
        used[start] = true;
        let [first, last] = pieces[start];
        let mut points = std::collections::VecDeque::from([first.1, last.1]);
        let mut tips = [first.0, last.0];
        for (side, tip) in tips.iter_mut().enumerate() {
            while let Some(next) = ends.get(tip).and_then(|at| at.iter().find(|k| !used[**k])).copied() {
                used[next] = true;
                let [a, b] = pieces[next];
                let far = if a.0 == *tip { b } else { a };
                *tip = far.0;
                if side == 0 { points.push_front(far.1) } else { points.push_back(far.1) }
            }
        }
        let closed = tips[0] == tips[1];
        lines.push(Line { points: points.into(), closed });
    }
    lines
}

/// A rectangle that labels keep clear of: left, top, right, bottom in CSS pixels.
pub type Taken = (f64, f64, f64, f64);

/// The place along a drawn line (CSS pixels) where a label of this size stands best: inside the bounds, clear of
/// taken places, where the line is straight, as near its middle as possible. `None` if the line is shorter than twice
/// the label or no place is free.
pub(crate) fn label_place(line: &[PixelPoint], size: PixelSize, bounds: Taken, taken: &[Taken]) -> Option<PixelPoint> {
    let mut along = vec![0.0];
    for pair in line.windows(2) {
        along.push(along.last().copied().unwrap_or(0.0) + (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1));
    }
    let total = along.last().copied().unwrap_or(0.0);
    if total.is_nan() || total <= 2.0 * size.0 {
        return None;
    }
    let place = |s: f64| {
        let k = along.partition_point(|a| *a < s).clamp(1, line.len() - 1);
        let t = (s - along[k - 1]) / (along[k] - along[k - 1]).max(1e-12);
        let (a, b) = (line[k - 1], line[k]);
        (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
    };
    let mut best: Option<(f64, PixelPoint)> = None;
    for step in 1..40 {
        let s = total * f64::from(step) / 40.0;
        let (x, y) = place(s);
        let own = around((x, y), size);
        let inside = own.0 > bounds.0 && own.1 > bounds.1 && own.2 < bounds.2 && own.3 < bounds.3;
        if !inside || taken.iter().any(|t| overlaps(*t, own)) {
            continue;
        }
        let half = (0.5 * size.0).min(0.5 * total);
        let (a, b) = (place((s - half).max(0.0)), place((s + half).min(total)));
        let straight = (b.0 - a.0).hypot(b.1 - a.1) / (2.0 * half);
        let central = 1.0 - (s / total - 0.5).abs();
        let score = 2.0 * straight + central;
        if best.is_none_or(|(s, _)| score > s) {
            best = Some((score, (x, y)));
        }
    }
    best.map(|(_, place)| place)
}

/// The rectangle of this size around a place, with a little air.
pub fn around((x, y): PixelPoint, (width, height): PixelSize) -> Taken {
    (x - width / 2.0 - 3.0, y - height / 2.0 - 2.0, x + width / 2.0 + 3.0, y + height / 2.0 + 2.0)
}

/// Whether two rectangles overlap.
pub fn overlaps(a: Taken, b: Taken) -> bool {
    a.0 < b.2 && b.0 < a.2 && a.1 < b.3 && b.1 < a.3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize, f: impl Fn(f64, f64) -> f64) -> ValueGrid {
        let axis: Vec<f64> = (0..n).map(|i| -1.0 + 2.0 * i as f64 / (n - 1) as f64).collect();
        let z = axis.iter().flat_map(|y| axis.iter().map(|x| f(*x, *y)).collect::<Vec<_>>()).collect();
        ValueGrid::new(axis.clone(), axis, z).unwrap()
    }

    #[test]
    fn a_plane_gives_one_straight_line() {
        let lines = grid(9, |x, y| x + 2.0 * y).contour(0.3);
        assert_eq!(lines.len(), 1);
        assert!(!lines[0].closed);
        for (x, y) in &lines[0].points {
            assert!((x + 2.0 * y - 0.3).abs() < 1e-12);
        }
        let (first, last) = (lines[0].points[0], *lines[0].points.last().unwrap());
        // From x = -1 (y = 0.65) to x = 1 (y = -0.35), in either direction.
        assert!(((first.0 - last.0).abs() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_circle_closes_and_has_its_length() {
        // The polygon's length converges to 2 pi r with the square of the cell size.
        let error = |n: usize| {
            let lines = grid(n, |x, y| x.hypot(y)).contour(0.5);
            assert_eq!(lines.len(), 1);
            assert!(lines[0].closed);
            let length: f64 = lines[0].points.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum();
            (length - std::f64::consts::PI).abs()
        };
        let (coarse, fine) = (error(21), error(81));
        let order = (coarse / fine).log2() / 2.0;
        assert!(order > 1.6, "order {order}: {coarse} {fine}");
    }

    #[test]
    fn a_saddle_gives_two_lines_that_do_not_cross() {
        let lines = grid(2, |x, y| x * y + 0.1).contour(0.0);
        assert_eq!(lines.len(), 2);
        assert!(lines.iter().all(|l| l.points.len() == 2));
    }

    #[test]
    fn holes_interrupt() {
        let mut g = grid(9, |x, _| x);
        g.z[4 * 9 + 4] = f64::NAN;
        let lines = g.contour(0.01);
        assert_eq!(lines.len(), 2);
        assert!(g.value(0.0, 0.05).is_nan());
        assert!((g.value(0.8, 0.8) - 0.8).abs() < 1e-12);
    }
}
