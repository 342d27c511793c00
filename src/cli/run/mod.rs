//! `coldplate run`: everything, from a sweep file to a folder with tables, surrogate, figures and report.

mod text;

use std::path::PathBuf;

use serde_json::json;

use super::output::Output;
use super::sweep::{Cluster, SweepArgs, keeps, parts, warn_of};
use coldplate_base::error::Result;
use coldplate_explore::sweep::SweepOptions;
use coldplate_figures::chart::style::Quantity;
use coldplate_jobs::pdf::Printer;
use coldplate_jobs::{Answer, Summary};

/// Everything: sweep, fit, charts, surrogate, report
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Sweep file
    sweep: PathBuf,
    #[command(flatten)]
    asked: SweepArgs,
    /// The report as PDF too (report.pdf), printed by an installed Chromium
    #[arg(long)]
    pdf: bool,
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
    // A browser that is missing should show before the sweep, which takes its time.
    let printer = args.pdf.then(Printer::find).transpose()?;
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
    let mut summary = coldplate_jobs::run(&sweep, &folder, options, &progress)?;
    if let Some(printer) = printer {
        let pdf = folder.join("report.pdf");
        printer.print(&folder.join("report.html"), &pdf)?;
        summary.files.insert(1, pdf);
    }
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
    out.report(&text::text(&summary), &told);
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
        "answer": summary.answer.as_ref().map(answer),
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

/// The answer as outside programs read it.
fn answer(found: &Answer) -> serde_json::Value {
    let value = |(quantity, value): &(Quantity, f64)| (quantity.name.clone(), json!(format!("{value} {}", quantity.unit)));
    let condition: serde_json::Map<String, serde_json::Value> = found.condition.iter().map(value).collect();
    json!({ "text": found.sentence, "acceptable": found.is_found, "condition": condition, "uncertain": found.open })
}

/// A key with its unit for temperatures and displacements; other units stand under `unit` alone.
fn keyed(of: &str, unit: &str) -> String {
    if matches!(unit, "K" | "um") { format!("{of}_{unit}") } else { of.to_string() }
}

/// The unit of the errors of a point.
fn unit_of<'a>(summary: &'a Summary, point: &str) -> &'a str {
    summary.points.iter().find(|p| p.name == point).map_or("K", |p| p.unit.as_str())
}
