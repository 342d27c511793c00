//! Result of the main job in a few lines: the answer, and the files that hold the rest.

use std::path::Path;

use coldplate_base::numbers::significant;
use coldplate_jobs::{PointSummary, SURROGATE, Summary, TARGET};

/// The answer first: how far the machine may go, how well the fit predicts, how well the machine is known; then where everything is.
pub(super) fn text(summary: &Summary) -> String {
    // Pages have the sign of the degree, texts do not.
    let mut lines: Vec<String> = summary.answer.as_ref().map(|answer| answer.sentence.replace('°', "deg")).into_iter().collect();
    lines.extend(fit(summary));
    lines.extend(formulas(summary));
    lines.extend(summary.known.as_ref().map(|known| known.sentence()));
    lines.extend(summary.adaptation.as_ref().map(|found| found.sentence()));
    lines.extend(summary.answered.as_ref().map(|answered| answered.sentence()));
    let (conditions, resumed) = summary.conditions;
    let [sweep, fit, drawing] = summary.seconds;
    lines.push(format!("{conditions} conditions, {resumed} of them from the journal, {} failed", summary.failures.len()));
    lines.push(format!("sweep {sweep:.1} s, fit {fit:.1} s, figures and report {drawing:.1} s\n"));
    lines.extend(files(summary));
    lines.join("\n") + "\n"
}

/// Errors and bands of all points.
fn fit(summary: &Summary) -> Vec<String> {
    if summary.points.is_empty() {
        return Vec::new();
    }
    let errors = match largest(summary, |point| Some(point.held_out?.0)) {
        held_out if !held_out.is_empty() => {
            let aim = if summary.worst_held_out().is_some() { format!("; aim: {TARGET} K") } else { String::new() };
            let inside = summary.points.iter().filter_map(|point| Some(point.held_out?.2)).reduce(f64::min);
            let inside = inside.map_or_else(String::new, |share| format!("; {:.1} % or more inside the band", 100.0 * share));
            format!("largest held-out error {held_out}{aim}{inside}")
        }
        _ => format!("largest k-fold error {} (root mean square)", largest(summary, |point| point.k_fold)),
    };
    let mesh = match largest(summary, |point| point.mesh) {
        mesh if mesh.is_empty() => String::new(),
        mesh => format!("; of the mesh up to {mesh}"),
    };
    vec![errors, format!("band of the fit up to {}{mesh}", largest(summary, |point| Some(point.half_width)))]
}

/// The largest value among the points of each unit, with its point: `0.16 K (head), 0.51 um (tool x)`.
fn largest(summary: &Summary, value: impl Fn(&PointSummary) -> Option<f64>) -> String {
    let mut found: Vec<(f64, &PointSummary)> = Vec::new();
    for (own, point) in summary.points.iter().filter_map(|point| Some((value(point)?, point))) {
        match found.iter_mut().find(|(_, other)| other.unit == point.unit) {
            Some(largest) if largest.0 >= own => {}
            Some(largest) => *largest = (own, point),
            None => found.push((own, point)),
        }
    }
    found.iter().map(|(value, point)| format!("{} {} ({})", significant(*value, 2), point.unit, point.name)).collect::<Vec<_>>().join(", ")
}

/// How well the formulas of one variable hold; a constant follows none.
fn formulas(summary: &Summary) -> Option<String> {
    let follows = summary.formulas.iter().filter_map(|formula| Some((formula, formula.r_squared_in_words()?)));
    let (worst, r_squared) = follows.min_by(|(a, _), (b, _)| a.r_squared.total_cmp(&b.r_squared))?;
    let (count, group) = (summary.formulas.len(), &worst.group);
    Some(format!("{count} formulas of one variable, R2 {r_squared} or more ({}, {group})", worst.point))
}

/// Files and folders, each with its use.
fn files(summary: &Summary) -> Vec<String> {
    let folder = &summary.folder;
    let is_figure = |file: &Path| file.parent().is_some_and(|parent| parent.ends_with("charts"));
    let mut lines = Vec::new();
    let mut tables = Vec::new();
    for file in summary.files.iter().filter(|file| !is_figure(file)) {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match name.as_str() {
            "report.html" => lines.push(format!("wrote {}: every point, formula and figure", file.display())),
            "report.pdf" => lines.push(format!("wrote {}: the report on paper", file.display())),
            SURROGATE => lines.push(format!("wrote {}: answers `coldplate query`", file.display())),
            _ => tables.push(name),
        }
    }
    if !tables.is_empty() {
        lines.push(format!("wrote {}: {}", folder.display(), tables.join(", ")));
    }
    let figures = summary.files.iter().filter(|file| is_figure(file)).count();
    lines.push(format!("wrote {}: {figures} figures", folder.join("charts").display()));
    lines
}
