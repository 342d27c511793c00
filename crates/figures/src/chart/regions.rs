//! Areas of a map: filled where a function is positive, hatched, and named.

use std::ops::Range;

use super::canvas::{Canvas, PixelPoint, PixelSize, Stroke};
use super::contour::ValueGrid;
use super::style::Rgb;
use coldplate_base::error::Result;

/// A pattern over an area, so that it is told apart without colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Hatch {
    /// No pattern.
    #[default]
    Plain,
    /// Thin lines rising to the right, wide apart.
    Rising,
    /// Lines falling to the right, close together.
    Falling,
}

impl Hatch {
    /// Spacing along the horizontal in CSS pixels, direction, stroke.
    fn lines(self, ground: Rgb) -> Option<(f64, f64, Stroke)> {
        let stroke = |width: f64| Stroke::solid(ground.darker(), width);
        match self {
            Self::Plain => None,
            Self::Rising => Some((13.0, -1.0, stroke(1.1))),
            Self::Falling => Some((9.0, 1.0, stroke(1.3))),
        }
    }
}

/// Hatches the part of a rectangle where `inside` holds, in a darker tone of its ground.
///
/// # Errors
/// If the surface refuses.
pub(crate) fn hatch(
    canvas: &mut Canvas,
    (left, top): PixelPoint,
    (width, height): PixelSize,
    pattern: Hatch,
    ground: Rgb,
    inside: impl Fn(f64, f64) -> bool,
) -> Result<()> {
    let Some((spacing, direction, stroke)) = pattern.lines(ground) else { return Ok(()) };
    if !(width > 0.0 && height > 0.0 && width < 1e4 && height < 1e4) {
        return Ok(());
    }
    // Every line x = c + direction * y that meets the rectangle, walked downwards.
    let (first, last) = if direction > 0.0 { (-height, width) } else { (0.0, width + height) };
    let steps = (height / 2.0).ceil().max(1.0);
    let mut c = first + spacing / 2.0;
    while c < last {
        let mut run: Option<(PixelPoint, PixelPoint)> = None;
        for k in 0..=steps as usize {
            let y = height * k as f64 / steps;
            let x = c + direction * y;
            let place = (left + x, top + y);
            if (0.0..=width).contains(&x) && inside(place.0, place.1) {
                run = Some((run.map_or(place, |r| r.0), place));
            } else if let Some((a, b)) = run.take() {
                canvas.line(&[a, b], stroke)?;
            }
        }
        if let Some((a, b)) = run {
            canvas.line(&[a, b], stroke)?;
        }
        c += spacing;
    }
    Ok(())
}

/// Hatches a whole rectangle.
///
/// # Errors
/// If the surface refuses.
pub(crate) fn hatch_rectangle(canvas: &mut Canvas, at: PixelPoint, size: PixelSize, pattern: Hatch, ground: Rgb) -> Result<()> {
    hatch(canvas, at, size, pattern, ground, |_, _| true)
}

/// Fills the area where the function is positive; `place` maps the grid's coordinates to CSS pixels.
///
/// # Errors
/// If the surface refuses.
pub(crate) fn fill_positive(canvas: &mut Canvas, grid: &ValueGrid, colour: Rgb, place: impl Fn(f64, f64) -> PixelPoint) -> Result<()> {
    for j in 0..grid.y.len() - 1 {
        // Neighbouring full cells are painted as one, which keeps the file small.
        let mut run: Option<(usize, usize)> = None;
        for i in 0..grid.x.len() - 1 {
            let corners = grid.corners(i, j);
            let full = corners.is_some_and(|four| four.iter().all(|c| c.1 > 0.0));
            if full {
                run = Some((run.map_or(i, |r| r.0), i));
                continue;
            }
            if let Some((a, b)) = run.take() {
                strip(canvas, grid, j, a..b + 1, colour, &place)?;
            }
            let Some(four) = corners else { continue };
            let part: Vec<PixelPoint> = clip(&four).into_iter().map(|(x, y)| place(x, y)).collect();
            canvas.tile(&part, colour)?;
            // A thin outline closes the seam to the neighbouring cells that smoothed edges would show.
            let outline: Vec<PixelPoint> = part.iter().chain(part.first()).copied().collect();
            canvas.line(&outline, Stroke::solid(colour, 0.7))?;
        }
        if let Some((a, b)) = run {
            strip(canvas, grid, j, a..b + 1, colour, &place)?;
        }
    }
    Ok(())
}

/// A run of full cells in row `j`, half a pixel larger upwards and a little to the sides so that no seam shows.
fn strip(
    canvas: &mut Canvas,
    grid: &ValueGrid,
    j: usize,
    run: Range<usize>,
    colour: Rgb,
    place: &impl Fn(f64, f64) -> PixelPoint,
) -> Result<()> {
    let (low, high) = (place(grid.x[run.start], grid.y[j]), place(grid.x[run.end], grid.y[j + 1]));
    let up = if j + 2 < grid.y.len() { 0.5 } else { 0.0 };
    let left = if run.start > 0 { 0.35 } else { 0.0 };
    let right = if run.end + 1 < grid.x.len() { 0.35 } else { 0.0 };
    let (x0, x1, y0, y1) = (low.0 - left, high.0 + right, high.1 - up, low.1);
    canvas.tile(&[(x0, y0), (x1, y0), (x1, y1), (x0, y1)], colour)
}

/// The part of a cell where the function, linear along its edges, is positive.
fn clip(four: &[(PixelPoint, f64); 4]) -> Vec<PixelPoint> {
    let mut part = Vec::with_capacity(6);
    for e in 0..4 {
        let ((a, za), (b, zb)) = (four[e], four[(e + 1) % 4]);
        if za > 0.0 {
            part.push(a);
        }
        if (za > 0.0) != (zb > 0.0) {
            let t = (za / (za - zb)).clamp(0.0, 1.0);
            part.push((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)));
        }
    }
    part
}

/// A connected part of a map with one number, and the node farthest from its edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Zone {
    /// The number.
    pub number: usize,
    /// Node to put its name at.
    pub node: (usize, usize),
    /// Number of nodes.
    pub nodes: usize,
    /// Distance of `node` from the edge, in the unit of the spacing given.
    pub room: f64,
}

/// The connected zones of equal number on an `nx` by `ny` grid whose nodes are `spacing` apart;
/// nodes without a number belong to none.
pub(crate) fn zones(numbers: &[Option<usize>], nx: usize, ny: usize, spacing: (f64, f64)) -> Vec<Zone> {
    if nx == 0 || ny == 0 || numbers.len() != nx * ny {
        return Vec::new();
    }
    let distance = distance_to_edge(numbers, nx, ny, spacing.0, spacing.1);
    let mut seen = vec![false; nx * ny];
    let mut zones = Vec::new();
    for start in 0..nx * ny {
        let Some(number) = numbers[start].filter(|_| !seen[start]) else { continue };
        seen[start] = true;
        let mut zone = Zone { number, node: (start % nx, start / nx), nodes: 0, room: -1.0 };
        let mut open = vec![start];
        while let Some(at) = open.pop() {
            let (i, j) = (at % nx, at / nx);
            zone.nodes += 1;
            if distance[at] > zone.room {
                (zone.room, zone.node) = (distance[at], (i, j));
            }
            let mut visit = |near: usize| {
                if !seen[near] && numbers[near] == Some(number) {
                    seen[near] = true;
                    open.push(near);
                }
            };
            if i > 0 {
                visit(at - 1);
            }
            if i + 1 < nx {
                visit(at + 1);
            }
            if j > 0 {
                visit(at - nx);
            }
            if j + 1 < ny {
                visit(at + nx);
            }
        }
        zones.push(zone);
    }
    zones
}

/// Distance of every node to the nearest node of another number or the edge of the map, by two passes
/// over the grid (chamfer distance: exact along axes and diagonals, within 8 % between).
fn distance_to_edge(numbers: &[Option<usize>], nx: usize, ny: usize, dx: f64, dy: f64) -> Vec<f64> {
    let diagonal = dx.hypot(dy);
    let at_edge = |k: usize| {
        let (i, j) = (k % nx, k / nx);
        let border = i == 0 || j == 0 || i + 1 == nx || j + 1 == ny;
        border || [k - 1, k + 1, k - nx, k + nx].iter().any(|n| numbers[*n] != numbers[k])
    };
    let mut d: Vec<f64> = (0..nx * ny).map(|k| if at_edge(k) { 0.0 } else { f64::INFINITY }).collect();
    let relax = |d: &mut Vec<f64>, k: usize, sign: isize| {
        if d[k] == 0.0 {
            return;
        }
        // Nodes that are not at an edge have all eight neighbours.
        let near = |step: isize| k.checked_add_signed(sign * step).and_then(|n| d.get(n).copied()).unwrap_or(f64::INFINITY);
        let row = nx as isize;
        let best = (near(-1) + dx).min(near(-row) + dy).min(near(-row - 1) + diagonal).min(near(-row + 1) + diagonal);
        d[k] = d[k].min(best);
    };
    for k in 0..nx * ny {
        relax(&mut d, k, 1);
    }
    for k in (0..nx * ny).rev() {
        relax(&mut d, k, -1);
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zones_are_connected_and_named_at_their_middle() {
        // Two columns of zeros left and right of a column of ones, 9 x 9.
        let numbers: Vec<Option<usize>> = (0..81).map(|k| Some(usize::from((3..6).contains(&(k % 9))))).collect();
        let found = zones(&numbers, 9, 9, (1.0, 1.0));
        assert_eq!(found.len(), 3);
        assert_eq!(found.iter().map(|z| z.nodes).collect::<Vec<_>>(), vec![27, 27, 27]);
        assert!(found.iter().all(|z| z.room == 1.0));
        assert_eq!(found[1].number, 1);
        assert_eq!(found[1].node.0, 4);
    }

    #[test]
    fn clipping_keeps_the_positive_part() {
        let four = [((0.0, 0.0), -1.0), ((1.0, 0.0), 1.0), ((1.0, 1.0), 1.0), ((0.0, 1.0), -1.0)];
        let part = clip(&four);
        let area: f64 = (0..part.len())
            .map(|k| {
                let (a, b) = (part[k], part[(k + 1) % part.len()]);
                0.5 * (a.0 * b.1 - b.0 * a.1)
            })
            .sum();
        assert!((area - 0.5).abs() < 1e-12);
        assert!(part.iter().all(|p| p.0 >= 0.5 - 1e-12));
    }
}
