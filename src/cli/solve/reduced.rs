//! `coldplate solve MODEL.cpr`: the steady state from a reduced model.

use super::super::hottest::{hottest, hottest_text};
use super::super::output::Output;
use super::super::text::{block, table};
use super::{Args, WithPlaces};
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_base::units::Measurand;
use coldplate_jobs::OpenFile;
use coldplate_jobs::reduced::{ReducedChannelRecord, ReducedLimitRecord, ReducedSolution, SteadyRecord};
use coldplate_network::mesh::vtu;

/// Answers one condition. If asked for, the field is written, and the hottest place of every part is reported.
///
/// # Errors
/// The file is damaged, or has no field and one is asked for; the condition is bad, or no steady state is found.
pub(super) fn run(file: &OpenFile, args: &Args, out: Output) -> Result<u8> {
    let model = file.reduced_model()?;
    let solution = ReducedSolution::at(&model, args.condition.values()?)?;
    let mut places = None;
    if args.vtu.is_some() || args.hottest {
        let option = if args.vtu.is_some() { "--vtu" } else { "--hottest" };
        let (full, temperatures) = solution.field().map_err(|e| e.in_file(&args.machine).at_key(option))?;
        if let Some(path) = &args.vtu {
            vtu::write(path, &full.machine, &full.mesh, &temperatures)?;
            out.note(&format!("wrote {}", path.display()));
        }
        places = args.hottest.then(|| hottest(&full.machine, &full.mesh, &temperatures));
    }
    let record = WithPlaces { record: solution.record(), hottest: places };
    out.note_on_mesh("bounds", record.record.cells);
    out.report(&text(&solution, &record), &record);
    Ok(if record.record.in_range { 0 } else { 3 })
}

fn text(solution: &ReducedSolution<'_>, record: &WithPlaces<SteadyRecord>) -> String {
    let (model, answer, steady) = (solution.model, &solution.answer, &record.record);
    let mut text = format!("{}\n\n", model.machine.name);
    let measurands = &model.fine.network.measurands;
    let is_mixed = measurands.contains(&Measurand::Displacement);
    let row = |(s, ((name, reading), bound)): (usize, ((&String, &f64), &f64))| {
        let unit = if is_mixed { format!(" {}", measurands[s].unit()) } else { String::new() };
        let more = if is_mixed { format!(" {}", measurands[s].unit_of_differences()) } else { String::new() };
        vec![name.clone(), format!("{:.4}{unit}", measurands[s].shown(*reading)), significant(*bound, 2) + &more]
    };
    let rows: Vec<Vec<String>> =
        model.fine.network.sensor_names.iter().zip(&answer.readings).zip(&answer.bounds).enumerate().map(row).collect();
    text += &table(if is_mixed { &["sensor", "", "+-"] } else { &["sensor", "degC", "+- K"] }, &rows);
    let margin = |l: &ReducedLimitRecord| match (l.margin_K, l.margin_um) {
        (Some(kelvins), _) if is_mixed => format!("{kelvins:+.3} K"),
        (Some(kelvins), _) => format!("{kelvins:+.3}"),
        (None, micrometres) => micrometres.map_or_else(String::new, |um| format!("{um:+.3} um")),
    };
    let row = |l: &ReducedLimitRecord| vec![l.name.clone(), margin(l), if l.kept { "kept".into() } else { "broken".into() }];
    let head = ["limit", if is_mixed { "margin" } else { "margin K" }, ""];
    text += &block(&head, &steady.limits.iter().map(row).collect::<Vec<_>>());
    let row = |(name, c): (&String, &ReducedChannelRecord)| {
        vec![name.clone(), format!("{:.3}", c.outlet_degC), format!("{:.3}", c.flow_m3_s * 6e4), format!("{:.0}", c.h_W_m2K)]
    };
    text += "\n";
    text += &table(&["channel", "outlet degC", "L/min", "h W/(m2 K)"], &steady.coolant.iter().map(row).collect::<Vec<_>>());
    text += &record.hottest.as_deref().map_or_else(String::new, hottest_text);
    if !answer.in_range {
        text += "\nwarning: outside the ranges that the model was made for; the bounds do not hold there\n";
    }
    text + &format!(
        "\n{} modes, {:.2} ms; the bounds are against the full model on {} cells\n",
        steady.modes,
        steady.seconds * 1e3,
        model.made.cells
    )
}
