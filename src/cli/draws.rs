//! `coldplate sensitivity MODEL.cpr`: slopes of every reading along variables and parameters, and its spread over the
//! open parameters.

use super::condition::ConditionArgs;
use super::output::Output;
use super::text::table;
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_jobs::OpenFile;
use coldplate_jobs::reduced_slopes::{Draws, ReducedSlopes, SlopesAlong, SpreadRecord};
use coldplate_reduce::ReducedModel;

/// Slopes at one condition, and draws if asked for; of all sensors if none are named.
///
/// # Errors
/// The file is damaged; errors of [`ReducedSlopes::of`].
pub fn run(file: &OpenFile, condition: &ConditionArgs, draws: Draws, sensors: &[String], out: Output) -> Result<u8> {
    let model = file.reduced_model()?;
    let found = ReducedSlopes::of(&model, condition.values()?, draws, sensors, &file.path)?;
    out.report(&text(&model, &found), &found.record);
    Ok(if found.record.in_range { 0 } else { 3 })
}

fn text(model: &ReducedModel, found: &ReducedSlopes) -> String {
    let record = &found.record;
    let mut text = format!("{}\n", model.machine.name);
    for (s, name) in model.fine.network.sensor_names.iter().enumerate() {
        let Some(own) = record.readings.get(name) else { continue };
        let unit = if own.um.is_some() { " um" } else { "" };
        text += &format!("\n{name}: {:.3}{unit}", own.degC.or(own.um).unwrap_or(f64::NAN));
        if let Some(spread) = &own.spread {
            let (SpreadRecord::Temperature { mean_degC: mean, deviation_K: deviation, low_degC: low, high_degC: high, bound_K: bound }
            | SpreadRecord::Displacement { mean_um: mean, deviation_um: deviation, low_um: low, high_um: high, bound_um: bound }) = spread;
            let [deviation, bound] = [*deviation, *bound].map(|x| significant(x, 3));
            text += &format!(", mean {mean:.3}, deviation {deviation}, 95 % within {low:.3} to {high:.3}, each draw known within {bound}");
        }
        let row = |of: &SlopesAlong| vec![of.name.clone(), significant(of.slopes[s], 5), format!("per {}", of.unit)];
        text += "\n";
        text += &table(&["varied", "slope", ""], &found.along.iter().map(row).collect::<Vec<_>>());
    }
    let draws = record.draws.map_or_else(String::new, |draws| {
        let how = if record.in_full { "solved in full" } else { "of the reduced model" };
        format!("{draws} draws {how}, {} without a steady state, ", record.failed.unwrap_or(0))
    });
    if !record.in_range {
        text += "\nwarning: outside the ranges that the model was made for; the bounds do not hold there\n";
    }
    text + &format!("\n{draws}{:.2} s\n", record.seconds)
}
