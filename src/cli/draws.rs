//! `coldplate sensitivity MODEL.cpr`: slopes of every reading along variables and parameters, and its spread over the
//! open parameters.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::condition::ConditionArgs;
use super::output::Output;
use super::text::table;
use coldplate_base::document::suggestion;
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::significant;
use coldplate_base::units::{self, Measurand};
use coldplate_jobs::reduced::place;
use coldplate_network::Network;
use coldplate_reduce::{ReducedModel, Slopes};
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::sensitivity::OpenParameter;

/// Number of draws, seed, and whether each is solved in full.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    pub count: Option<usize>,
    pub seed: u64,
    pub in_full: bool,
}

/// The result as outside programs read it.
#[derive(Debug, Serialize)]
struct Record {
    readings: BTreeMap<String, Reading>,
    /// Draws with a steady state; left out if no draws are asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    draws: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    failed: Option<usize>,
    in_full: bool,
    in_range: bool,
    seconds: f64,
}

#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
struct Reading {
    #[serde(skip_serializing_if = "Option::is_none")]
    degC: Option<f64>,
    /// Reading of a displacement, um.
    #[serde(skip_serializing_if = "Option::is_none")]
    um: Option<f64>,
    /// Slope per variable and parameter, K or um per unit of it.
    slopes: BTreeMap<String, f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    spread: Option<Spread>,
}

#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
#[serde(untagged)]
enum Spread {
    /// Spread of a temperature; low and high are the ends of the middle 95 % of the draws.
    Temperature { mean_degC: f64, deviation_K: f64, low_degC: f64, high_degC: f64, bound_K: f64 },
    /// Spread of a displacement.
    Displacement { mean_um: f64, deviation_um: f64, low_um: f64, high_um: f64, bound_um: f64 },
}

/// Slopes at one condition, and draws if asked for; of all sensors if none are named.
///
/// # Errors
/// The file is damaged, the condition is bad or states a parameter, no steady state is found, or there is nothing to draw.
pub fn run(path: &Path, bytes: &[u8], condition: &ConditionArgs, (draws, sensors): (Draws, &[String]), out: Output) -> Result<u8> {
    let model = ReducedModel::from_bytes(bytes).map_err(|e| e.in_file(path))?;
    let (condition, parameters) = place(&model, condition.values()?)?;
    if !parameters.is_empty() {
        let error = Error::input("slopes and draws are about the file's values of all parameters").at_key("--at");
        return Err(error.help("state variables alone"));
    }
    let known: Vec<&str> = model.fine.network.sensor_names.iter().map(String::as_str).collect();
    if let Some(other) = sensors.iter().find(|name| !known.contains(&name.as_str())) {
        let error = Error::input(format!("'{other}' is not a sensor of this model")).at_key("--sensor");
        return Err(error.help(suggestion(other, &known)));
    }
    let clock = Instant::now();
    let slopes_at = model.slopes(&condition)?;
    let full = if draws.in_full { Some(full(&model).map_err(|e| e.in_file(path))?) } else { None };
    let spreads = draws.count.map(|count| model.spreads(&condition, count, draws.seed, full.as_ref())).transpose()?;
    let (names, network) = (names(&model, &slopes_at)?, &model.fine.network);
    let reading = |s: usize| {
        let shown = |x: f64| network.measurands[s].shown(x);
        let own = network.measurands[s];
        let spread = spreads.as_ref().map(|all| &all.readings[s]).map(|of| {
            let [mean, low, high] = [of.mean, of.interval.0, of.interval.1].map(shown);
            let (deviation, bound) = (of.deviation, of.bound);
            match own {
                Measurand::Temperature => {
                    Spread::Temperature { mean_degC: mean, deviation_K: deviation, low_degC: low, high_degC: high, bound_K: bound }
                }
                Measurand::Displacement => {
                    Spread::Displacement { mean_um: mean, deviation_um: deviation, low_um: low, high_um: high, bound_um: bound }
                }
            }
        });
        let value = |of: Measurand| (own == of).then(|| shown(slopes_at.readings[s]));
        let slopes = names.iter().map(|own| (own.name.clone(), own.slopes[s])).collect();
        (
            network.sensor_names[s].clone(),
            Reading { degC: value(Measurand::Temperature), um: value(Measurand::Displacement), slopes, spread },
        )
    };
    let record = Record {
        readings: (0..known.len()).filter(|s| sensors.is_empty() || sensors.iter().any(|name| *name == known[*s])).map(reading).collect(),
        draws: spreads.as_ref().map(|all| all.draws),
        failed: spreads.as_ref().map(|all| all.failed),
        in_full: draws.in_full,
        in_range: model.is_inside(&condition),
        seconds: clock.elapsed().as_secs_f64(),
    };
    out.report(&text(&model, &record, &names), &record);
    Ok(if record.in_range { 0 } else { 3 })
}

/// A variable or parameter with the slopes of all readings, K per unit of it.
struct Follows {
    name: String,
    unit: String,
    slopes: Vec<f64>,
}

/// Variables in their own units, then parameters.
fn names(model: &ReducedModel, slopes: &Slopes) -> Result<Vec<Follows>> {
    let variable = |(v, of): &(usize, Vec<f64>)| {
        let own = &model.machine.variables[*v];
        // SI units per unit of the variable; a temperature counts as a difference.
        let scale = units::convert(1.0, &own.unit, own.dimension)? - units::convert(0.0, &own.unit, own.dimension)?;
        let unit = if own.dimension.is_absolute() { "K" } else { &own.unit };
        Ok(Follows { name: own.name.clone(), unit: unit.into(), slopes: of.iter().map(|slope| slope * scale).collect() })
    };
    let parameter = |(own, of): (&OpenParameter, &Vec<f64>)| Follows { name: own.name.clone(), unit: own.unit.clone(), slopes: of.clone() };
    let mut all = slopes.variables.iter().map(variable).collect::<Result<Vec<_>>>()?;
    all.extend(model.parameters.iter().zip(&slopes.parameters).map(parameter));
    Ok(all)
}

/// The full network, on a mesh with the model's number of cells, or on the mesh that follows from the accuracy that the
/// machine file asks for.
fn full(model: &ReducedModel) -> Result<Network> {
    let mut meshed = MeshedMachine::new(model.machine.clone(), Some(model.made.cells))?;
    if meshed.network.nodes != model.made.nodes && model.machine.accuracy.is_some() {
        meshed = MeshedMachine::new(model.machine.clone(), None)?;
    }
    if meshed.network.nodes == model.made.nodes {
        return Ok(meshed.network);
    }
    let read = format!("{} nodes then, {} now", model.made.nodes, meshed.network.nodes);
    let error = Error::input("the mesh of this machine is not the one that the model was made on").at_key("--full").read(read);
    Err(error.help("make the model anew"))
}

fn text(model: &ReducedModel, record: &Record, names: &[Follows]) -> String {
    let mut text = format!("{}\n", model.machine.name);
    for (s, name) in model.fine.network.sensor_names.iter().enumerate() {
        let Some(own) = record.readings.get(name) else { continue };
        let unit = if own.um.is_some() { " um" } else { "" };
        text += &format!("\n{name}: {:.3}{unit}", own.degC.or(own.um).unwrap_or(f64::NAN));
        if let Some(spread) = &own.spread {
            let (Spread::Temperature { mean_degC: mean, deviation_K: deviation, low_degC: low, high_degC: high, bound_K: bound }
            | Spread::Displacement { mean_um: mean, deviation_um: deviation, low_um: low, high_um: high, bound_um: bound }) = spread;
            let [deviation, bound] = [*deviation, *bound].map(|x| significant(x, 3));
            text += &format!(", mean {mean:.3}, deviation {deviation}, 95 % within {low:.3} to {high:.3}, each draw known within {bound}");
        }
        let row = |of: &Follows| vec![of.name.clone(), significant(of.slopes[s], 5), format!("per {}", of.unit)];
        text += "\n";
        text += &table(&["varied", "slope", ""], &names.iter().map(row).collect::<Vec<_>>());
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
