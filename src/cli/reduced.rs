//! `coldplate solve MODEL.cpr`: the steady state from a reduced model.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::condition::ConditionArgs;
use super::output::Output;
use super::places::{Place, hottest, hottest_text};
use super::text::table;
use crate::describe::machine::Condition;
use crate::discretise::mesh::{Mesh, vtu};
use crate::error::{Error, Result};
use crate::foundation::document::suggestion;
use crate::foundation::input;
use crate::foundation::numbers::significant;
use crate::reduce::{Answer, ReducedModel};
use crate::solve::meshed::{LimitState, MeshedMachine, limit_states};
use crate::units::{Measurand, celsius};

/// As outside programs read it.
#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
struct Record {
    /// Temperatures of the sensors' places, degC.
    sensors: BTreeMap<String, f64>,
    /// How far each may be from that of the full model.
    bounds_K: BTreeMap<String, f64>,
    /// The same of displacements, where there are some.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    bounds_um: BTreeMap<String, f64>,
    coolant: BTreeMap<String, Channel>,
    limits: Vec<Limit>,
    in_range: bool,
    modes: usize,
    newton_iterations: usize,
    /// Largest error of any cell at the conditions that the bounds were calibrated on, where the model has its field.
    #[serde(skip_serializing_if = "Option::is_none")]
    field_error_K: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    hottest: Option<Vec<Place>>,
    seconds: f64,
}

#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
struct Channel {
    outlet_degC: f64,
    flow_m3_s: f64,
    reynolds: f64,
    h_W_m2K: f64,
    pressure_drop_Pa: f64,
}

#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
struct Limit {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    margin_K: Option<f64>,
    /// Of a displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    margin_um: Option<f64>,
    kept: bool,
}

/// The bytes of a file, if it is a reduced model; with it, options that are given (name, whether) mean nothing.
///
/// # Errors
/// One of these is given, or the file cannot be read.
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

/// Answers one condition; the field goes to `vtu`, and the hottest place of every part is told, where that is asked for.
///
/// # Errors
/// The file is damaged, or has no field and one is asked for; the condition is bad, or no steady state is found.
pub fn run(path: &Path, bytes: &[u8], condition: &ConditionArgs, (vtu, with_hottest): (Option<&Path>, bool), out: Output) -> Result<u8> {
    let model = ReducedModel::from_bytes(bytes).map_err(|e| e.in_file(path))?;
    let (condition, parameters) = place(&model, condition)?;
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
    let (names, measurands) = (&model.fine.network.sensor_names, &model.fine.network.measurands);
    let states = limit_states(&model.machine, &answer.readings, condition.si());
    let network = &model.fine.network;
    let outlet = |s: usize| answer.state.temperatures[network.streams[s].outlet() as usize];
    let channel = |(s, state): (usize, &crate::discretise::network::StreamState)| {
        let own = Channel {
            outlet_degC: celsius(outlet(s)),
            flow_m3_s: state.flow,
            reynolds: state.reynolds,
            h_W_m2K: state.film,
            pressure_drop_Pa: state.pressure_drop,
        };
        (network.streams[s].name.clone(), own)
    };
    let bounds = |of: Measurand| {
        let all = names.iter().zip(measurands).zip(&answer.bounds).filter(|((_, own), _)| **own == of);
        all.map(|((name, _), bound)| (name.clone(), *bound)).collect()
    };
    let limit = |state: &LimitState| {
        let margin = |of: Measurand| (state.measurand == of).then(|| state.margin());
        let (kelvins, micrometres) = (margin(Measurand::Temperature), margin(Measurand::Displacement));
        Limit { name: state.name.clone(), margin_K: kelvins, margin_um: micrometres, kept: state.margin() >= 0.0 }
    };
    let record = Record {
        sensors: names.iter().cloned().zip(measurands.iter().zip(&answer.readings).map(|(own, t)| own.shown(*t))).collect(),
        bounds_K: bounds(Measurand::Temperature),
        bounds_um: bounds(Measurand::Displacement),
        coolant: answer.state.streams.iter().enumerate().map(channel).collect(),
        limits: states.iter().map(limit).collect(),
        in_range: answer.in_range,
        modes: model.coarse.len(),
        newton_iterations: answer.state.steps,
        field_error_K: model.field.as_ref().map(|field| field.largest_error),
        hottest: places,
        seconds,
    };
    out.report(&text(&model, &answer, &record), &record);
    Ok(if answer.in_range { 0 } else { 3 })
}

/// Condition and parameters; what is not given has the machine's default or the file's value.
///
/// # Errors
/// A name that is neither a variable nor a parameter, or a value that is none of it.
pub fn place(model: &ReducedModel, given: &ConditionArgs) -> Result<(Condition, Vec<f64>)> {
    let mut pairs = Vec::new();
    let mut parameters: Vec<f64> = model.parameters.iter().map(|p| p.nominal).collect();
    let mut is_moved = false;
    for (name, value) in given.values()? {
        let Some(at) = model.parameters.iter().position(|p| p.name == name) else {
            if !model.machine.variables.iter().any(|v| v.name == name) {
                let names = model.machine.variables.iter().map(|v| v.name.as_str()).chain(model.parameters.iter().map(|p| p.name.as_str()));
                let error =
                    Error::input(format!("'{name}' is neither a variable nor a parameter of this model")).at_key("--at").read(value);
                return Err(error.help(suggestion(&name, &names.collect::<Vec<_>>())));
            }
            pairs.push((name, value));
            continue;
        };
        let (own, unit) = (&model.parameters[at], &model.parameters[at].unit);
        let bare = value.trim().strip_suffix(unit.as_str()).unwrap_or(&value).trim();
        let number = bare.parse::<f64>().ok().filter(|x| x.is_finite());
        parameters[at] = number.ok_or_else(|| {
            let shown = if unit == "1" { "a number".into() } else { format!("a number in {unit}") };
            Error::input(format!("{shown} is needed"))
                .at_key(&own.name)
                .read(&value)
                .help(format!("write --at \"{}={}\"", own.name, own.nominal))
        })?;
        is_moved = true;
    }
    let pairs: Vec<(&str, &str)> = pairs.iter().map(|(n, v)| (n.as_str(), v.as_str())).collect();
    Ok((model.machine.condition(&pairs)?, if is_moved { parameters } else { Vec::new() }))
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
    if !record.limits.is_empty() {
        let margin = |l: &Limit| match (l.margin_K, l.margin_um) {
            (Some(kelvins), _) if is_mixed => format!("{kelvins:+.3} K"),
            (Some(kelvins), _) => format!("{kelvins:+.3}"),
            (None, micrometres) => micrometres.map_or_else(String::new, |um| format!("{um:+.3} um")),
        };
        let row = |l: &Limit| vec![l.name.clone(), margin(l), if l.kept { "kept".into() } else { "broken".into() }];
        text += "\n";
        text += &table(&["limit", if is_mixed { "margin" } else { "margin K" }, ""], &record.limits.iter().map(row).collect::<Vec<_>>());
    }
    let row = |(name, c): (&String, &Channel)| {
        vec![name.clone(), format!("{:.3}", c.outlet_degC), format!("{:.3}", c.flow_m3_s * 6e4), format!("{:.0}", c.h_W_m2K)]
    };
    text += "\n";
    text += &table(&["channel", "outlet degC", "L/min", "h W/(m2 K)"], &record.coolant.iter().map(row).collect::<Vec<_>>());
    text += &record.hottest.as_deref().map_or_else(String::new, hottest_text);
    if !answer.in_range {
        text += "\nwarning: outside the ranges that the model was made for; the bounds do not hold there\n";
    }
    text + &format!(
        "\n{} modes, {:.2} ms; the bounds are against the full model on {} cells\n",
        record.modes,
        record.seconds * 1e3,
        model.made.cells
    )
}
