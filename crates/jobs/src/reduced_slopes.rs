//! Slopes of a reduced model's readings along variables and parameters, and the spread of the readings over the open
//! parameters.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::reduced::place;
use coldplate_base::document::suggestion;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{self, Measurand};
use coldplate_network::Network;
use coldplate_reduce::{ReadingSpread, ReducedModel, Slopes};
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::sensitivity::OpenParameter;

/// Draws of the open parameters.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    /// Number of draws; none leaves the spread out.
    pub count: Option<usize>,
    /// Seed of the draws.
    pub seed: u64,
    /// Whether every draw is solved in full.
    pub in_full: bool,
}

/// Slopes of all readings at one condition, and their spread where draws are asked for.
#[derive(Debug)]
pub struct ReducedSlopes {
    /// Variables in their own units, then parameters.
    pub along: Vec<SlopesAlong>,
    /// Record for outside programs.
    pub record: ReducedSlopesRecord,
}

/// A variable or parameter with the slopes of all readings.
#[derive(Debug)]
pub struct SlopesAlong {
    /// Name of the variable or parameter.
    pub name: String,
    /// Unit of the variable or parameter; K for a temperature.
    pub unit: String,
    /// Slope of every reading, K or um per unit.
    pub slopes: Vec<f64>,
}

/// Slopes and spreads as outside programs read them.
#[derive(Debug, Serialize)]
pub struct ReducedSlopesRecord {
    /// Readings by sensor.
    pub readings: BTreeMap<String, ReadingSlopesRecord>,
    /// Draws with a steady state; left out if no draws are asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub draws: Option<usize>,
    /// Draws without a steady state.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed: Option<usize>,
    /// Whether every draw was solved in full.
    pub in_full: bool,
    /// Whether the condition is within the ranges of the training.
    pub in_range: bool,
    /// Time taken, s.
    pub seconds: f64,
}

/// A reading with its slopes and its spread.
#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
pub struct ReadingSlopesRecord {
    /// Reading of a temperature, degC.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub degC: Option<f64>,
    /// Reading of a displacement, um.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub um: Option<f64>,
    /// Slope per variable and parameter, K or um per unit of it.
    pub slopes: BTreeMap<String, f64>,
    /// Spread over the draws.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spread: Option<SpreadRecord>,
}

/// Spread of a reading; low and high are the ends of the middle 95 % of the draws.
#[derive(Debug, Serialize)]
#[allow(non_snake_case, missing_docs)]
#[serde(untagged)]
pub enum SpreadRecord {
    /// Spread of a temperature.
    Temperature { mean_degC: f64, deviation_K: f64, low_degC: f64, high_degC: f64, bound_K: f64 },
    /// Spread of a displacement.
    Displacement { mean_um: f64, deviation_um: f64, low_um: f64, high_um: f64, bound_um: f64 },
}

impl ReducedSlopes {
    /// Slopes at the condition `given` (name, value), and draws if asked for; the record has the `sensors` alone if any are
    /// named. `file` is the name of the model in errors.
    ///
    /// # Errors
    /// The condition is bad or states a parameter, a sensor is none of the model's, no steady state is found, there is nothing
    /// to draw, or the mesh of the model cannot be made again.
    pub fn of(model: &ReducedModel, given: Vec<(String, String)>, draws: Draws, sensors: &[String], file: &Path) -> Result<Self> {
        let (condition, parameters) = place(model, given)?;
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
        let slopes = model.slopes(&condition)?;
        let full = if draws.in_full { Some(full(model).map_err(|e| e.in_file(file))?) } else { None };
        let spreads = draws.count.map(|count| model.spreads(&condition, count, draws.seed, full.as_ref())).transpose()?;
        let along = along(model, &slopes)?;
        let measurands = &model.fine.network.measurands;
        let reading = |s: usize| {
            let own = measurands[s];
            let value = |of: Measurand| (own == of).then(|| own.shown(slopes.readings[s]));
            let record = ReadingSlopesRecord {
                degC: value(Measurand::Temperature),
                um: value(Measurand::Displacement),
                slopes: along.iter().map(|of| (of.name.clone(), of.slopes[s])).collect(),
                spread: spreads.as_ref().map(|all| SpreadRecord::of(&all.readings[s], own)),
            };
            (known[s].to_string(), record)
        };
        let is_asked = |s: &usize| sensors.is_empty() || sensors.iter().any(|name| *name == known[*s]);
        let record = ReducedSlopesRecord {
            readings: (0..known.len()).filter(is_asked).map(reading).collect(),
            draws: spreads.as_ref().map(|all| all.draws),
            failed: spreads.as_ref().map(|all| all.failed),
            in_full: draws.in_full,
            in_range: model.is_inside(&condition),
            seconds: clock.elapsed().as_secs_f64(),
        };
        Ok(Self { along, record })
    }
}

impl SpreadRecord {
    fn of(spread: &ReadingSpread, measurand: Measurand) -> Self {
        let [mean, low, high] = [spread.mean, spread.interval.0, spread.interval.1].map(|x| measurand.shown(x));
        let (deviation, bound) = (spread.deviation, spread.bound);
        match measurand {
            Measurand::Temperature => {
                Self::Temperature { mean_degC: mean, deviation_K: deviation, low_degC: low, high_degC: high, bound_K: bound }
            }
            Measurand::Displacement => {
                Self::Displacement { mean_um: mean, deviation_um: deviation, low_um: low, high_um: high, bound_um: bound }
            }
        }
    }
}

fn along(model: &ReducedModel, slopes: &Slopes) -> Result<Vec<SlopesAlong>> {
    let variable = |(v, of): &(usize, Vec<f64>)| {
        let own = &model.machine.variables[*v];
        // SI units per unit of the variable; a temperature counts as a difference.
        let scale = units::convert(1.0, &own.unit, own.dimension)? - units::convert(0.0, &own.unit, own.dimension)?;
        let unit = if own.dimension.is_absolute() { "K" } else { &own.unit };
        Ok(SlopesAlong { name: own.name.clone(), unit: unit.into(), slopes: of.iter().map(|slope| slope * scale).collect() })
    };
    let parameter =
        |(own, of): (&OpenParameter, &Vec<f64>)| SlopesAlong { name: own.name.clone(), unit: own.unit.clone(), slopes: of.clone() };
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
