//! `coldplate sensitivity`: derivatives of every reading with respect to conditions and numbers of the machine file.

use std::path::PathBuf;
use std::time::Instant;

use super::condition::ConditionArgs;
use super::draws;
use super::mesh_options::MeshArgs;
use super::output::Output;
use super::text::table;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_jobs::reduced_slopes::Draws;
use coldplate_jobs::sensitivity::{Sensitivities, SensitivityRow};
use coldplate_jobs::{FileKind, open};
use coldplate_solve::sensitivity::{DerivativeTable, Derivatives, UNEVEN};
use coldplate_solve::study::{MachineParameter, ParameterKind, Study};

/// Derivatives of readings by conditions and by numbers of the file
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Machine file, or a reduced model of one
    machine: PathBuf,
    #[command(flatten)]
    condition: ConditionArgs,
    /// A condition variable or a dotted key, for example contact.motor.conductance; may be repeated (default: all variables,
    /// contact conductances, emissivities and sources)
    #[arg(long = "to", value_name = "KEY")]
    to: Vec<String>,
    /// A sensor, limit, or channel (its outlet); may be repeated (default: all sensors)
    #[arg(long = "sensor", value_name = "NAME")]
    sensor: Vec<String>,
    /// Rows shown for each sensor in the text; the rest is in --json
    #[arg(long, value_name = "N", default_value_t = 12)]
    top: usize,
    #[command(flatten)]
    mesh: MeshArgs,
    /// For a reduced model: spread of the readings over this number of draws of its parameters
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=10_000_000))]
    draws: Option<u32>,
    /// Seed of the draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Solve every draw in full
    #[arg(long, requires = "draws")]
    full: bool,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or numerics that failed.
pub fn run(args: &Args, out: Output) -> Result<u8> {
    let start = Instant::now();
    let file = open(&args.machine).map_err(|e| e.help("check the path"))?;
    if file.kind == FileKind::ReducedModel {
        args.mesh.refuse(&file, &[("--to", !args.to.is_empty())])?;
        let draws = Draws { count: args.draws.map(|count| count as usize), seed: args.seed, in_full: args.full };
        return draws::run(&file, &args.condition, draws, &args.sensor, out);
    }
    if args.draws.is_some() {
        let error = Error::input("draws are taken of a reduced model").at_key("--draws").in_file(&args.machine);
        return Err(error.help("make one: `coldplate reduce MACHINE --uncertain`; --full solves its draws in full"));
    }
    let study = Study::new(file.document(&args.mesh.sets()?)?, args.mesh.cells)?;
    let condition = args.condition.condition(&study.model.machine)?;
    let all = Sensitivities::of(&study, &condition, &args.sensor, &args.to)?;
    let Sensitivities { at, rows, parameters, found } = &all;
    for (parameter, (idle, uneven)) in parameters.iter().zip(found.idle.iter().zip(&found.uneven)) {
        if *idle {
            out.note(&format!("note: nothing depends on '{}' at this condition", parameter.name));
        } else if *uneven > UNEVEN {
            out.note(&format!(
                "note: '{}' stands at a kink (a change of flow regime, a corner of a table): its derivative differs from side to side",
                parameter.name
            ));
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    out.report(&text(at, rows, parameters, found, args.top, seconds), &all.record(seconds));
    Ok(0)
}

fn text(
    at: &Derivatives<'_>,
    rows: &[SensitivityRow],
    parameters: &[MachineParameter],
    found: &DerivativeTable,
    top: usize,
    seconds: f64,
) -> String {
    let mut text = format!("{}\n", at.study.model.machine.name);
    for (row, slopes) in rows.iter().zip(&found.slopes) {
        text += &format!("\n{}: {:.3} {}\n", row.name, row.value, if row.is_absolute { "degC" } else { "K" });
        let importance = |p: usize| parameters[p].importance(slopes[p], at.value_of(&parameters[p]));
        let largest = (0..parameters.len()).map(importance).fold(0.0, f64::max);
        // A smaller derivative is rounding of a parameter that acts elsewhere in the machine.
        let mut order: Vec<usize> = (0..parameters.len()).filter(|p| !found.idle[*p] && importance(*p) > 1e-12 * largest).collect();
        order.sort_by(|a, b| importance(*b).total_cmp(&importance(*a)));
        let shown: Vec<Vec<String>> = (order.iter().take(top))
            .map(|p| {
                let (parameter, slope) = (&parameters[*p], slopes[*p]);
                let value = at.value_of(parameter);
                let unit = parameter.step_unit();
                let per = match parameter.kind {
                    ParameterKind::Factor => "K per +100 %".to_string(),
                    _ => format!("K per {unit}"),
                };
                let percent = parameter.per_percent(slope, value);
                vec![
                    parameter.name.clone(),
                    match parameter.kind {
                        ParameterKind::Factor | ParameterKind::Offset => "as written".into(),
                        _ if parameter.unit == "1" => significant(parameter.shown(value), 5),
                        _ => format!("{} {}", significant(parameter.shown(value), 5), parameter.unit),
                    },
                    signed(parameter.per_unit(slope)),
                    per,
                    percent.map_or(String::new(), |p| format!("{p:+.5}")),
                ]
            })
            .collect();
        if shown.is_empty() {
            text += "  depends on none of these\n";
            continue;
        }
        text += &table(&["parameter", "value", "slope", "", "K per +1 %"], &shown);
        if order.len() > shown.len() {
            text += &format!("  and {} more: --top {}\n", order.len() - shown.len(), order.len());
        }
    }
    let idle: Vec<&str> = parameters.iter().zip(&found.idle).filter(|(_, idle)| **idle).map(|(p, _)| p.name.as_str()).collect();
    if !idle.is_empty() {
        text += &format!("\nNothing depends on: {}\n", idle.join(", "));
    }
    text += &format!("\n{} unknowns, {} parameters, {:.2} s\n", at.study.model.network.nodes, parameters.len(), seconds);
    text
}

fn signed(value: f64) -> String {
    let text = significant(value, 5);
    if value > 0.0 { format!("+{text}") } else { text }
}
