//! The default figures of a surrogate, drawn if no others are named.

use std::path::{Path, PathBuf};

use super::charts::operator_sheet;
use super::figures::{self, TableComparison};
use super::gallery::{Gallery, file_name};
use super::summary::TARGET;
use coldplate_base::condition::{self, AMBIENT_TEMPERATURE, COOLANT_FLOW, COOLANT_TEMPERATURE, MOTOR_SPEED};
use coldplate_base::error::Result;
use coldplate_surrogate::fit::PointReport;
use coldplate_surrogate::verdict::Surrogate;
use coldplate_surrogate::verdict::condition::index_of;
use coldplate_tables::Table;

/// Draws all figures of a surrogate and its comparison, except topics that the gallery has already.
///
/// # Errors
/// The surrogate cannot be queried, or a file cannot be written.
pub(crate) fn draw_surrogate(
    gallery: &mut Gallery,
    surrogate: &Surrogate<'_>,
    comparison: &TableComparison,
    fits: &[PointReport],
    machine: &str,
) -> Result<()> {
    let x = figures::centre(surrogate);
    let index = |name: &str| index_of(surrogate, name).ok().filter(|index| *index < surrogate.variable_count());
    let given: Vec<&str> = ["acceptability", "operator_sheet", "slices", "errors", "parity", "residuals"]
        .into_iter()
        .filter(|topic| gallery.has(topic))
        .collect();
    let wanted = |topic: &str| !given.contains(&topic);
    if surrogate.limit_count() > 0 {
        let pairs = [(MOTOR_SPEED, COOLANT_FLOW), (COOLANT_TEMPERATURE, AMBIENT_TEMPERATURE)];
        for (across, up) in pairs.into_iter().filter(|_| wanted("acceptability")) {
            if let (Some(a), Some(u)) = (index(across), index(up)) {
                let map = figures::map(surrogate, a, u, &x, None, figures::ContourQuantity::Margin)?;
                gallery.add(&format!("acceptability_{across}_{up}"), "acceptability", &map)?;
            }
        }
        if wanted("operator_sheet") && condition::NAMES.iter().all(|n| index(n).is_some()) {
            let sheet = operator_sheet(surrogate, machine, &figures::provenance(surrogate))?;
            gallery.add("operator_sheet", "operator_sheet", &sheet)?;
        }
    }
    let points: Vec<usize> = (0..surrogate.point_count()).collect();
    for variable in (0..surrogate.variable_count()).filter(|_| wanted("slices")) {
        let name = surrogate.variable(variable).map_or(String::new(), |v| v.name.to_string());
        for (i, figure) in figures::slices(surrogate, variable, &x, &points)?.iter().enumerate() {
            gallery.add(&format!("against_{name}_{}", i + 1), "slices", figure)?;
        }
    }
    if wanted("errors") {
        gallery.add("errors", "errors", &figures::errors(surrogate, comparison, fits, Some(TARGET)))?;
    }
    // Parity and residuals of the point with the largest error; the others are one command away.
    if let Some(point) = figures::worst_point(surrogate, comparison) {
        if let Some(figure) = figures::parity(surrogate, comparison, point).filter(|_| wanted("parity")) {
            gallery.add("parity_worst_point", "parity", &figure)?;
        }
        if let Some(figure) = figures::residuals(surrogate, comparison, point).filter(|_| wanted("residuals")) {
            gallery.add("residuals_worst_point", "residuals", &figure)?;
        }
    }
    Ok(())
}

/// Draws the figures of a surrogate alone, or with tables to compare with; for `coldplate chart`.
///
/// # Errors
/// A figure that cannot be drawn or written, and a table without the surrogate's variables and points.
pub fn chart(surrogate: &Surrogate<'_>, tables: &[(Table, bool)], folder: &Path) -> Result<Vec<PathBuf>> {
    let mut comparison = TableComparison::default();
    for (table, held_out) in tables {
        comparison.add(surrogate, table, *held_out)?;
    }
    comparison.values.resize(surrogate.point_count(), Vec::new());
    let mut gallery = Gallery::new(&folder.join("charts"))?;
    let machine = surrogate.provenance().find(|(k, _)| *k == "machine").map_or("machine", |(_, v)| v).to_string();
    draw_surrogate(&mut gallery, surrogate, &comparison, &[], &machine)?;
    if !tables.is_empty() {
        for point in 0..surrogate.point_count() {
            let name = surrogate.point(point).map_or(String::new(), |p| file_name(p.name));
            if let Some(figure) = figures::parity(surrogate, &comparison, point) {
                gallery.add(&format!("parity_{name}"), "parity", &figure)?;
            }
            if let Some(figure) = figures::residuals(surrogate, &comparison, point) {
                gallery.add(&format!("residuals_{name}"), "residuals", &figure)?;
            }
        }
    }
    Ok(gallery.files())
}
