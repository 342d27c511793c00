//! `coldplate run`: everything, from a sweep file to a folder with tables, surrogate, figures and report.

use std::path::PathBuf;

use serde_json::json;

use super::output::Output;
use super::sweep::{Cluster, SweepArgs, keeps, parts, rounds, warn_of};
use super::text::table;
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_explore::sweep::SweepOptions;
use coldplate_jobs::{PointSummary, Summary, TARGET};

/// Everything: sweep, fit, charts, surrogate, report
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Sweep file
    sweep: PathBuf,
    #[command(flatten)]
    asked: SweepArgs,
    /// Run conditions again that failed before
    #[arg(long)]
    retry_failed: bool,
    #[command(flatten)]
    cluster: Cluster,
}

/// Runs the command.
///
/// # Errors
/// Bad input, numerics that failed everywhere, or a folder that cannot be written.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let sweep = args.asked.open(&args.sweep, out)?;
    let folder = args.asked.folder(&args.sweep);
    keeps(&sweep, &folder);
    let more =
        sweep.plan.growth.as_ref().map_or_else(String::new, |growth| format!(", then more until {} K are reached,", growth.accuracy));
    out.note(&format!("{}: {} conditions{more} {}", sweep.plan.name, sweep.plan.conditions.len(), sweep.solver_in_words()));
    let progress = out.progress();
    let typed = parts::Typed { sweep: &args.sweep, asked: &args.asked };
    let slurm = parts::on_slurm(&sweep, &typed, &args.cluster, &folder, args.retry_failed, out)?;
    // Conditions that failed on the cluster were tried again there.
    let retry_failed = args.retry_failed && slurm.is_none();
    let options = SweepOptions { threads: None, progress: Some(&progress), retry_failed };
    let summary = coldplate_jobs::run(&sweep, &folder, options, &progress)?;
    for note in &summary.notes {
        out.note(note);
    }
    summary.adaptation.iter().for_each(|found| warn_of(found, out));
    for failure in &summary.failures {
        out.note(&format!("condition {} ({}) failed: {}", failure.row + 1, failure.group, failure.reason));
    }
    let mut told = to_json(&summary);
    if let (Some(slurm), Some(all)) = (slurm, told.as_object_mut()) {
        all.insert("slurm".into(), json!(slurm));
    }
    out.report(&text(&summary), &told);
    Ok(0)
}

fn to_json(summary: &Summary) -> serde_json::Value {
    let points: Vec<_> = summary
        .points
        .iter()
        .map(|p| {
            let key = |of: &str| keyed(of, &p.unit);
            json!({
                "name": p.name,
                "model": p.model,
                "unit": p.unit,
                key("leave_one_out_rms"): p.leave_one_out,
                key("k_fold_rms"): p.k_fold,
                key("half_width"): p.half_width,
                key("mesh"): p.mesh,
                "held_out": p.held_out.map(|(max, rms, inside)| json!({ key("max"): max, key("rms"): rms, "share_in_band": inside })),
            })
        })
        .collect();
    let formulas: Vec<_> = (summary.formulas.iter())
        .map(|f| {
            let rms = keyed("rms", unit_of(summary, &f.point));
            json!({ "sweep": f.group, "variable": f.variable, "point": f.point, "formula": f.text, "r_squared": f.r_squared, rms: f.rms })
        })
        .collect();
    let mut all = json!({
        "folder": summary.folder.display().to_string(),
        "conditions": summary.conditions.0,
        "resumed": summary.conditions.1,
        "failed": summary.failures.len(),
        "known": summary.known,
        "points": points,
        "formulas": formulas,
        "files": summary.files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>(),
        "seconds": { "sweep": summary.seconds[0], "fit": summary.seconds[1], "figures_and_report": summary.seconds[2] },
    });
    if let (Some(found), Some(all)) = (&summary.adaptation, all.as_object_mut()) {
        all.insert("adaptive".into(), json!(found));
    }
    if let (Some(answered), Some(all)) = (&summary.answered, all.as_object_mut()) {
        all.insert("answered".into(), json!(answered));
    }
    all
}

/// A key with its unit for temperatures and displacements; other units stand under `unit` alone.
fn keyed(of: &str, unit: &str) -> String {
    if matches!(unit, "K" | "um") { format!("{of}_{unit}") } else { of.to_string() }
}

/// The unit of the errors of a point.
fn unit_of<'a>(summary: &'a Summary, point: &str) -> &'a str {
    summary.points.iter().find(|p| p.name == point).map_or("K", |p| p.unit.as_str())
}

fn text(summary: &Summary) -> String {
    let mut text = format!(
        "{} conditions, {} of them from the journal, {} failed\n\n",
        summary.conditions.0,
        summary.conditions.1,
        summary.failures.len()
    );
    text += &summary.known.as_ref().map_or_else(String::new, |known| format!("{}\n\n", known.sentence()));
    text += &summary.answered.as_ref().map_or_else(String::new, |answered| format!("{}\n\n", answered.sentence()));
    text += &summary.adaptation.as_ref().map_or_else(String::new, rounds);
    if !summary.points.is_empty() {
        let rows: Vec<Vec<String>> = summary
            .points
            .iter()
            .map(|p| {
                let held = |f: fn(&(f64, f64, f64)) -> f64| p.held_out.as_ref().map(|h| significant(f(h), 2)).unwrap_or_default();
                vec![
                    p.name.clone(),
                    p.model.clone(),
                    p.k_fold.map(|k| significant(k, 2)).unwrap_or_default(),
                    significant(p.half_width, 2),
                    p.mesh.map(|mesh| significant(mesh, 2)).unwrap_or_default(),
                    held(|h| h.0),
                    held(|h| h.1),
                    p.held_out.map(|h| format!("{:.1} %", 100.0 * h.2)).unwrap_or_default(),
                ]
            })
            .collect();
        let unit = summary.unit_of_errors();
        let heading = match unit {
            Some(unit) => ["k-fold rms ", "fit +-", "mesh +-", "held-out max ", "rms "].map(|of| format!("{of}{unit}")),
            None => ["k-fold rms", "fit +-", "mesh +-", "held-out max", "rms"].map(String::from),
        };
        let heading: Vec<&str> = ["measurement point", "model"].into_iter().chain(heading.iter().map(String::as_str)).collect();
        text += &match unit {
            Some(_) => table(&[&heading[..], &["in band"]].concat(), &rows),
            None => table(&[&heading[..], &["unit", "in band"]].concat(), &with_units(rows, summary)),
        };
        if let Some(worst) = summary.worst_held_out() {
            text += &format!("\nlargest held-out error {worst:.4} K (aim: {TARGET} K)\n");
        }
    }
    let mut group = "";
    for formula in &summary.formulas {
        if formula.group != group {
            group = &formula.group;
            let y = if summary.unit_of_errors().is_none_or(|unit| unit == "K") { " in degC" } else { "" };
            text += &format!("\n{group}: y{y}, x is {}\n", formula.variable);
        }
        let (rms, unit) = (significant(formula.rms, 2), unit_of(summary, &formula.point));
        text += &format!("  {:<24} {}   R2 {:.5}, rms {rms} {unit}\n", formula.point, formula.text, formula.r_squared);
    }
    let [sweep, fit, drawing] = summary.seconds;
    text += &format!("\nsweep {sweep:.1} s, fit {fit:.1} s, figures and report {drawing:.1} s\n");
    for file in summary.files.iter().filter(|f| !f.parent().is_some_and(|p| p.ends_with("charts"))) {
        text += &format!("wrote {}\n", file.display());
    }
    text + &format!("wrote {}\n", summary.folder.join("charts").display())
}

/// Rows with the unit of the errors before the last column.
fn with_units(rows: Vec<Vec<String>>, summary: &Summary) -> Vec<Vec<String>> {
    let with = |(mut row, point): (Vec<String>, &PointSummary)| {
        row.insert(row.len() - 1, point.unit.clone());
        row
    };
    rows.into_iter().zip(&summary.points).map(with).collect()
}
