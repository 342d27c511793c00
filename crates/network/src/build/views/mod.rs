//! View factors of an enclosure's patches: in closed form, by rays, or as the machine file gives them.

mod cache;
mod forms;

use nalgebra::DMatrix;

use crate::mesh::Mesh;
use crate::mesh::sight::{SidePiece, SurfaceView, look};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Enclosure, Machine};
use coldplate_physics::exchange::{complete, enforce};

/// Share of rays that may leave an enclosure said to be closed, dimensionless. Chosen: gaps that matter against rounding between faces.
pub(super) const LEAK: f64 = 1e-3;

/// A surface, or a piece of one, with one radiosity.
pub(super) struct Patch {
    /// Name in reports.
    pub(super) name: String,
    /// Faces of the patch; none where it is no part of the mesh.
    pub(super) facets: Vec<SidePiece>,
    /// Open area, m².
    pub(super) area: f64,
}

/// View factors between patches.
pub(super) struct Seeing {
    /// Exchange areas A_i F_ij, m²; symmetric.
    pub(super) exchange: DMatrix<f64>,
    /// Exchange area of each patch past all others, m².
    pub(super) rest: Vec<f64>,
    /// Pairs found by rays; 0 where there were none.
    pub(super) by_rays: usize,
    /// Largest standard error of a view factor found by rays.
    pub(super) error: f64,
    /// Largest change of a view factor to make all consistent.
    pub(super) corrected: f64,
    /// Share of each patch's radiation that falls on faces outside the enclosure; it counts as chamber.
    pub(super) strayed: Vec<f64>,
    /// Remarks.
    pub(super) notes: Vec<String>,
}

/// An error about the view factors of an enclosure.
fn refused(enclosure: &Enclosure, what: String) -> Error {
    Error::input(what).at_line(enclosure.line).at_key(format!("enclosure.{}.view_factors", enclosure.name))
}

/// View factors from the table of the machine file.
pub(super) fn given(enclosure: &Enclosure, table: &[Vec<Option<f64>>], patches: &[Patch]) -> Result<Seeing> {
    let n = patches.len();
    let areas: Vec<f64> = patches.iter().map(|p| p.area).collect();
    let mut filled = table.to_vec();
    complete(&mut filled, &areas, enclosure.closed);
    let name = |i: usize| patches[i].name.as_str();
    let tolerance = enclosure.tolerance;
    let mut views = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..n {
            let Some(view) = filled[i][j] else {
                let help = if enclosure.closed {
                    "reciprocity gives one of a pair from the other, the sum of a row its last gap: give more entries"
                } else {
                    "give more entries, or closed = true if nothing leaves between the surfaces"
                };
                return Err(refused(
                    enclosure,
                    format!("the view factor from '{}' to '{}' does not follow from the others", name(i), name(j)),
                )
                .help(help));
            };
            if !(-tolerance..=1.0 + tolerance).contains(&view) {
                return Err(refused(enclosure, format!("the view factor from '{}' to '{}' would have to be {view:.6}", name(i), name(j)))
                    .help("check the entries it follows from, and the areas"));
            }
            views[(i, j)] = view.max(0.0);
        }
        let sum: f64 = views.row(i).sum();
        let open = if enclosure.closed { "exactly 1, nothing else being there" } else { "at most 1" };
        if sum > 1.0 + tolerance || (enclosure.closed && sum < 1.0 - tolerance) {
            return Err(refused(enclosure, format!("the view factors of '{}' sum to {sum:.6}", name(i)))
                .help(format!("a row sums to {open}; 'tolerance' is {tolerance}, 'closed' says whether something leaves")));
        }
    }
    let mut exchange = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..n {
            let (there, back) = (areas[i] * views[(i, j)], areas[j] * views[(j, i)]);
            let larger = areas[i].max(areas[j]);
            if (there - back).abs() > tolerance * larger {
                return Err(refused(
                    enclosure,
                    format!("'{}' and '{}' see each other by {there:.6} m2 one way and {back:.6} m2 the other", name(i), name(j)),
                )
                .help(format!(
                    "area times view factor is the same both ways: with areas of {:.6} and {:.6} m2 the second must be {:.6}; or write \"?\" for one",
                    areas[i],
                    areas[j],
                    there / areas[j]
                )));
            }
            // Both have the same error as factors, so the one with the smaller area counts more.
            let (a, b) = (areas[j] * areas[j], areas[i] * areas[i]);
            exchange[(i, j)] = (a * there + b * back) / (a + b);
        }
    }
    let mut rest: Vec<(f64, f64)> = (0..n).map(|i| ((areas[i] - exchange.row(i).sum()).max(0.0), 0.0)).collect();
    if enclosure.closed {
        rest.fill((0.0, 0.0));
    }
    let corrected = consistent(&mut exchange, &mut rest, &areas, None);
    // Rounding of a row that sums to 1 is no opening.
    let rest = rest.iter().zip(&areas).map(|((r, _), a)| if *r < 1e-12 * a { 0.0 } else { *r }).collect();
    Ok(Seeing { exchange, rest, by_rays: 0, error: 0.0, corrected, strayed: vec![0.0; n], notes: Vec::new() })
}

/// Enforces the sums of rows; returns the largest change of a view factor. Without a variance every entry may
/// change in proportion to itself.
fn consistent(exchange: &mut DMatrix<f64>, rest: &mut [(f64, f64)], areas: &[f64], variance: Option<&DMatrix<f64>>) -> f64 {
    let before = exchange.clone();
    let own = before.clone();
    enforce(exchange, variance.unwrap_or(&own), rest, areas);
    let n = areas.len();
    (0..n * n).map(|k| (exchange[(k / n, k % n)] - before[(k / n, k % n)]).abs() / areas[k / n]).fold(0.0, f64::max)
}

/// View factors from the geometry.
pub(super) fn computed(
    machine: &Machine,
    mesh: &Mesh,
    enclosure: &Enclosure,
    patches: &[Patch],
    rays: usize,
    closed_forms: bool,
    sealed: bool,
) -> Result<Seeing> {
    let n = patches.len();
    let areas: Vec<f64> = patches.iter().map(|p| p.area).collect();
    let forms = forms::Forms::new(machine, mesh);
    let (mut exchange, mut variance) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    let mut unknown = vec![vec![false; n]; n];
    for i in 0..n {
        for j in i..n {
            match if closed_forms { forms.exchange(&patches[i], &patches[j]) } else { None } {
                Some(known) => (exchange[(i, j)], exchange[(j, i)]) = (known, known),
                None => (unknown[i][j], unknown[j][i]) = (true, true),
            }
        }
    }
    let wanted: Vec<bool> = unknown.iter().map(|row| row.contains(&true)).collect();
    let mut notes = Vec::new();
    let surfaces: Vec<Vec<SidePiece>> = patches.iter().map(|p| p.facets.clone()).collect();
    let seen: Vec<Option<SurfaceView>> = if wanted.contains(&true) {
        let key = cache::key(machine, mesh, &surfaces, &wanted, rays);
        let kept = enclosure.cache.as_ref().and_then(|path| cache::read(path, &key, &wanted, &mut notes));
        kept.unwrap_or_else(|| {
            let seen = look(machine, mesh, &surfaces, &wanted, rays);
            if let Some(path) = &enclosure.cache {
                cache::write(path, &key, &seen, &mut notes);
            }
            seen
        })
    } else {
        vec![None; n]
    };
    let (mut rest, mut error, mut by_rays) = (vec![(0.0, 0.0); n], 0.0f64, 0);
    for i in 0..n {
        let Some(own) = &seen[i] else { continue };
        if own.open <= 0.0 {
            return Err(
                refused(enclosure, format!("'{}' is covered altogether", patches[i].name)).help("name a face that something can see")
            );
        }
        let away = own.escaped + own.strayed;
        if sealed && away > LEAK {
            return Err(refused(enclosure, format!("{:.2} % of what '{}' sends out leaves the enclosure", 100.0 * away, patches[i].name))
                .help("remove closed = true, or add the faces that are missing"));
        }
        if !sealed {
            rest[i] = (areas[i] * away, areas[i] * areas[i] * away);
        }
        for j in (0..n).filter(|j| unknown[i][*j]) {
            let Some(other) = &seen[j] else { continue };
            // Two estimates with errors in proportion to the root of their own area.
            let (there, back) = (areas[i] * own.share[j], areas[j] * other.share[i]);
            exchange[(i, j)] = (areas[j] * there + areas[i] * back) / (areas[i] + areas[j]);
            variance[(i, j)] = exchange[(i, j)] * areas[i] * areas[j] / (areas[i] + areas[j]);
            error = error.max(own.error[j]);
            by_rays += usize::from(j >= i);
        }
    }
    for i in (0..n).filter(|i| seen[*i].is_none()) {
        let left = areas[i] - exchange.row(i).sum();
        rest[i].0 = if left > 1e-9 * areas[i] { left } else { 0.0 };
        if sealed && left > LEAK * areas[i] {
            let what = format!("{:.2} % of what '{}' sends out leaves the enclosure", 100.0 * left / areas[i], patches[i].name);
            return Err(refused(enclosure, what).help("remove closed = true, or add the faces that are missing"));
        }
    }
    let corrected = if by_rays > 0 { consistent(&mut exchange, &mut rest, &areas, Some(&variance)) } else { 0.0 };
    let strayed = seen.iter().map(|s| s.as_ref().map_or(0.0, |s| s.strayed)).collect();
    Ok(Seeing { exchange, rest: rest.iter().map(|r| r.0).collect(), by_rays, error, corrected, strayed, notes })
}
