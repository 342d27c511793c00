//! `coldplate solve MODEL.cpr`: the steady state from a reduced model.

use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::condition::ConditionArgs;
use super::hottest::{Place, hottest, hottest_text};
use super::output::Output;
use super::text::table;
use coldplate_base::error::{Error, Result};
use coldplate_base::input;
use coldplate_base::numbers::significant;
use coldplate_base::units::Measurand;
use coldplate_jobs::reduced::{ChannelRecord, LimitRecord, SteadyRecord, place};
use coldplate_network::mesh::{Mesh, vtu};
use coldplate_reduce::{Answer, ReducedModel};
use coldplate_solve::meshed::MeshedMachine;

/// The answer as outside programs read it.
#[derive(Debug, Serialize)]
struct Record {
    #[serde(flatten)]
    steady: SteadyRecord,
    #[serde(skip_serializing_if = "Option::is_none")]
    hottest: Option<Vec<Place>>,
}

/// The bytes of a file, if it is a reduced model. The `options` (name, whether given) mean nothing for one.
///
/// # Errors
/// One of the options is given for a reduced model, or the file cannot be read.
pub fn bytes(path: &Path, options: &[(&str, bool)]) -> Result<Option<Vec<u8>>> {
    if !input::begins_with(path, ReducedModel::FAMILY) {
        return Ok(None);
    }
    if let Some((option, _)) = options.iter().find(|(_, is_given)| *is_given) {
        let error = Error::input("a reduced model has its machine and its mesh built in").at_key(*option).in_file(path);
        return Err(error.help("take the machine file itself, or make another model with `coldplate reduce`"));
    }
    input::read(path).map(Some)
}

/// Answers one condition. If asked for, the field goes to `vtu`, and the hottest place of every part is reported.
///
/// # Errors
/// The file is damaged, or has no field and one is asked for; the condition is bad, or no steady state is found.
pub fn run(path: &Path, bytes: &[u8], condition: &ConditionArgs, (vtu, with_hottest): (Option<&Path>, bool), out: Output) -> Result<u8> {
    let model = ReducedModel::from_bytes(bytes).map_err(|e| e.in_file(path))?;
    let (condition, parameters) = place(&model, condition.values()?)?;
    let clock = Instant::now();
    let answer = model.steady(&condition, &parameters)?;
    let seconds = clock.elapsed().as_secs_f64();
    let mut places = None;
    if vtu.is_some() || with_hottest {
        let size = model.field.as_ref().map(|field| field.element_size);
        let size = size.ok_or_else(|| {
            let error = Error::input("this reduced model knows its sensors, not its field").in_file(path);
            error.at_key(if vtu.is_some() { "--vtu" } else { "--hottest" }).help("make it with `coldplate reduce --field`")
        })?;
        let full = MeshedMachine::on(model.machine.clone(), Mesh::with_size(&model.machine, size)?)?;
        let temperatures = model.temperatures(&answer, &condition, &full.network).map_err(|e| e.in_file(path))?;
        if let Some(to) = vtu {
            vtu::write(to, &full.machine, &full.mesh, &temperatures)?;
            out.note(&format!("wrote {}", to.display()));
        }
        places = with_hottest.then(|| hottest(&full.machine, &full.mesh, &temperatures));
    }
    let record = Record { steady: SteadyRecord::of(&model, &answer, &condition, seconds), hottest: places };
    out.report(&text(&model, &answer, &record), &record);
    Ok(if answer.in_range { 0 } else { 3 })
}

fn text(model: &ReducedModel, answer: &Answer, record: &Record) -> String {
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
    if !record.steady.limits.is_empty() {
        let margin = |l: &LimitRecord| match (l.margin_K, l.margin_um) {
            (Some(kelvins), _) if is_mixed => format!("{kelvins:+.3} K"),
            (Some(kelvins), _) => format!("{kelvins:+.3}"),
            (None, micrometres) => micrometres.map_or_else(String::new, |um| format!("{um:+.3} um")),
        };
        let row = |l: &LimitRecord| vec![l.name.clone(), margin(l), if l.kept { "kept".into() } else { "broken".into() }];
        let head = ["limit", if is_mixed { "margin" } else { "margin K" }, ""];
        text += "\n";
        text += &table(&head, &record.steady.limits.iter().map(row).collect::<Vec<_>>());
    }
    let row = |(name, c): (&String, &ChannelRecord)| {
        vec![name.clone(), format!("{:.3}", c.outlet_degC), format!("{:.3}", c.flow_m3_s * 6e4), format!("{:.0}", c.h_W_m2K)]
    };
    text += "\n";
    text += &table(&["channel", "outlet degC", "L/min", "h W/(m2 K)"], &record.steady.coolant.iter().map(row).collect::<Vec<_>>());
    text += &record.hottest.as_deref().map_or_else(String::new, hottest_text);
    if !answer.in_range {
        text += "\nwarning: outside the ranges that the model was made for; the bounds do not hold there\n";
    }
    text + &format!(
        "\n{} modes, {:.2} ms; the bounds are against the full model on {} cells\n",
        record.steady.modes,
        record.steady.seconds * 1e3,
        model.made.cells
    )
}
