//! Reduced models for users: ranges of variables, records of models, and their answers.

use std::collections::BTreeMap;
use std::time::Instant;

use serde::Serialize;

use coldplate_base::condition;
use coldplate_base::document::suggestion;
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{self, Measurand, celsius};
use coldplate_describe::machine::{Condition, DescribedVariable};
use coldplate_network::mesh::Mesh;
use coldplate_reduce::{ReducedAnswer, ReducedModel};
use coldplate_solve::meshed::{LimitState, MeshedMachine, limit_states};

/// The range of every variable of a machine, SI; a variable that does not vary has one value. `vary` names the varying ones, with
/// commas, or is `all`; `stated` has ranges by name, `"2 L/min .. 18 L/min"`.
///
/// # Errors
/// A name that is no variable, a range that cannot be read, a variable with neither range nor default.
pub fn ranges(variables: &[DescribedVariable], vary: Option<&str>, stated: &[(String, String)]) -> Result<Vec<(f64, f64)>> {
    let names: Vec<&str> = variables.iter().map(|v| v.name.as_str()).collect();
    let known = |name: &str, option: &str| match names.iter().position(|n| *n == name) {
        Some(at) => Ok(at),
        None => {
            let error = Error::input(format!("'{name}' is not a variable of this machine")).at_key(option);
            Err(error.help(suggestion(name, &names)))
        }
    };
    let mut varies: Vec<bool> = match vary {
        None => names.iter().map(|n| condition::NAMES.contains(n)).collect(),
        Some("all") => vec![true; names.len()],
        Some(list) => {
            let mut varies = vec![false; names.len()];
            for name in list.split(',') {
                varies[known(name.trim(), "--vary")?] = true;
            }
            varies
        }
    };
    let mut given: Vec<Option<(f64, f64)>> = vec![None; names.len()];
    for (name, value) in stated {
        let at = known(name, "--range")?;
        let fail =
            |what: &str| Error::input(what).at_key(format!("--range {name}")).read(value).help("write LOW .. HIGH, both with their unit");
        let (low, high) = value.split_once("..").ok_or_else(|| fail("two values are needed"))?;
        let parse = |text: &str| units::parse(text.trim(), variables[at].dimension).map_err(|e| e.at_key(format!("--range {name}")));
        let (low, high) = (parse(low)?, parse(high)?);
        if high.partial_cmp(&low) != Some(std::cmp::Ordering::Greater) {
            return Err(fail("the second value must be above the first"));
        }
        (given[at], varies[at]) = (Some((low, high)), true);
    }
    let one = |(i, variable): (usize, &DescribedVariable)| {
        let range = given[i].or(variable.range);
        match (varies[i], range, variable.default) {
            (true, Some(range), _) => Ok(range),
            (_, _, Some(value)) => Ok((value, value)),
            (_, Some(range), None) => Ok(range),
            (_, None, None) => Err(Error::input(format!("'{}' has neither range nor default", variable.name))
                .at_key(format!("variables.{}", variable.name))
                .help(format!("state its range: --range {}=\"LOW .. HIGH\"", variable.name))),
        }
    };
    variables.iter().enumerate().map(one).collect()
}

/// How a reduced model was made, as outside programs read it.
#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
pub struct MadeRecord {
    /// File of the model; left out if empty.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub file: String,
    /// Size of the file.
    pub bytes: usize,
    /// Modes that answer.
    pub modes: usize,
    /// Modes that the bound is from.
    pub modes_of_the_bound: usize,
    /// Conductors that are evaluated.
    pub conductors: usize,
    /// Conductors of the machine.
    pub conductors_of_the_machine: usize,
    /// Cells of the full model.
    pub cells: usize,
    /// Nodes of the full model.
    pub nodes: usize,
    /// Conditions solved in full.
    pub solved: usize,
    /// Conditions without a steady state.
    pub failed: usize,
    /// Further conditions that the bound was calibrated on.
    pub checks: usize,
    /// Largest bound that was asked for, K.
    pub accuracy_K: f64,
    /// Whether the largest bound is within the accuracy.
    pub reached: bool,
    /// Largest error at the conditions of the calibration, K.
    pub largest_error_K: f64,
    /// Largest bound at the conditions of the calibration and at further ones without a full solve, K.
    pub largest_bound_K: f64,
    /// Variables that vary.
    pub varied: Vec<String>,
    /// Parameters that vary.
    pub parameters: Vec<String>,
    /// Open parameters that keep the value of the machine file.
    pub parameters_left_out: Vec<String>,
    /// Bound over time, if the model was made with histories.
    pub in_time: Option<TimeRecord>,
    /// Reason why the model cannot follow time although histories were run; left out if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untimed: Option<String>,
    /// The temperatures of all cells, if the model has them.
    pub field: Option<FieldRecord>,
    /// Time taken, s.
    pub seconds: f64,
}

/// Size and error of the temperatures of all cells.
#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
pub struct FieldRecord {
    /// Size in the file.
    pub bytes: usize,
    /// Largest error of any cell at the conditions of the calibration, K.
    pub largest_error_K: f64,
}

/// Bound of the model over time.
#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
pub struct TimeRecord {
    /// Number of histories that contributed modes.
    pub histories: usize,
    /// Number of further histories that the bound was calibrated on.
    pub checks: usize,
    /// Largest error in the histories of the calibration, K.
    pub largest_error_K: f64,
    /// Largest bound in the histories of the calibration, K.
    pub largest_bound_K: f64,
}

impl MadeRecord {
    /// Record of a model whose bounds were to come below `accuracy`, K, and of its file of `bytes` bytes.
    pub fn of(model: &ReducedModel, file: String, bytes: usize, accuracy: f64) -> Self {
        let made = &model.made;
        let varied = model.machine.variables.iter().zip(&model.ranges).filter(|(_, (low, high))| high > low);
        Self {
            file,
            bytes,
            modes: model.coarse.len(),
            modes_of_the_bound: model.fine.len(),
            conductors: model.fine.patterns.ncols(),
            conductors_of_the_machine: made.conductors,
            cells: made.cells,
            nodes: made.nodes,
            solved: made.solved,
            failed: made.failed,
            checks: made.checks,
            accuracy_K: accuracy,
            reached: made.largest_bound <= accuracy,
            largest_error_K: made.largest_error,
            largest_bound_K: made.largest_bound,
            varied: varied.map(|(v, _)| v.name.clone()).collect(),
            parameters: model.parameters.iter().map(|p| p.name.clone()).collect(),
            parameters_left_out: model.left_out.clone(),
            untimed: model.untimed.clone(),
            in_time: model.in_time.as_ref().map(|own| TimeRecord {
                histories: own.histories,
                checks: own.checks,
                largest_error_K: own.largest_error,
                largest_bound_K: own.largest_bound,
            }),
            field: model.field.as_ref().map(|own| FieldRecord {
                bytes: (own.modes.len() * size_of::<f32>() + size_of::<f64>()) * own.center.len(),
                largest_error_K: own.largest_error,
            }),
            seconds: made.seconds,
        }
    }
}

/// The steady state from a reduced model, as outside programs read it.
#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
pub struct SteadyRecord {
    /// Temperatures of the sensors' places, degC.
    pub sensors: BTreeMap<String, f64>,
    /// Bound on the difference of each temperature from the full model's, K.
    pub bounds_K: BTreeMap<String, f64>,
    /// Bound on the difference of each displacement from the full model's, um, if there are displacements.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub bounds_um: BTreeMap<String, f64>,
    /// Channels by name.
    pub coolant: BTreeMap<String, ReducedChannelRecord>,
    /// Limits in the order of the machine file.
    pub limits: Vec<ReducedLimitRecord>,
    /// Whether condition and parameters are within the ranges of the training.
    pub in_range: bool,
    /// Cells of the full model's mesh; bounds do not hold the error of that mesh.
    pub cells: usize,
    /// Modes that answered.
    pub modes: usize,
    /// Steps of the iteration.
    pub newton_iterations: usize,
    /// Largest error of any cell at the conditions that the bounds were calibrated on, K, if the model has its field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_error_K: Option<f64>,
    /// Time taken, s.
    pub seconds: f64,
}

/// Flow through a channel.
#[derive(Debug, Serialize)]
#[allow(non_snake_case, missing_docs)]
pub struct ReducedChannelRecord {
    pub outlet_degC: f64,
    pub flow_m3_s: f64,
    pub reynolds: f64,
    pub h_W_m2K: f64,
    pub pressure_drop_Pa: f64,
}

/// A limit.
#[derive(Debug, Serialize)]
#[allow(non_snake_case, missing_docs)]
pub struct ReducedLimitRecord {
    pub name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub margin_K: Option<f64>,
    /// Margin of a limit on a displacement, um.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub margin_um: Option<f64>,
    pub kept: bool,
}

/// Condition and parameters; values that are not given are the machine's defaults and the file's values.
///
/// # Errors
/// A name is neither a variable nor a parameter, or a value is none of it.
pub fn place(model: &ReducedModel, given: Vec<(String, String)>) -> Result<(Condition, Vec<f64>)> {
    let mut pairs = Vec::new();
    let mut parameters: Vec<f64> = model.parameters.iter().map(|p| p.nominal).collect();
    let mut is_moved = false;
    for (name, value) in given {
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

/// The steady state of a reduced model at one condition.
#[derive(Debug)]
pub struct ReducedSolution<'m> {
    /// The model.
    pub model: &'m ReducedModel,
    /// The condition.
    pub condition: Condition,
    /// Readings with their bounds.
    pub answer: ReducedAnswer,
    /// Time taken, s.
    pub seconds: f64,
}

/// The machine of a reduced model on the mesh of its field.
///
/// # Errors
/// The model has no field; the mesh cannot be made.
pub fn meshed(model: &ReducedModel) -> Result<MeshedMachine> {
    let size = model.known_field()?.element_size;
    MeshedMachine::on(model.machine.clone(), Mesh::with_size(&model.machine, size)?)
}

impl<'m> ReducedSolution<'m> {
    /// The steady state at the condition and parameters `given` (name, value).
    ///
    /// # Errors
    /// Errors of [`place`]; no steady state is found.
    pub fn at(model: &'m ReducedModel, given: Vec<(String, String)>) -> Result<Self> {
        let (condition, parameters) = place(model, given)?;
        let clock = Instant::now();
        let answer = model.steady(&condition, &parameters)?;
        Ok(Self { model, condition, answer, seconds: clock.elapsed().as_secs_f64() })
    }

    /// The machine on the mesh of the model's field, and the temperature of every node, K.
    ///
    /// # Errors
    /// The model has no field, or its field is not of this mesh.
    pub fn field(&self) -> Result<(MeshedMachine, Vec<f64>)> {
        let model = self.model;
        let full = meshed(model)?;
        let temperatures = model.temperatures(&self.answer, &self.condition, &full.network)?;
        Ok((full, temperatures))
    }

    /// Record for outside programs.
    pub fn record(&self) -> SteadyRecord {
        let (network, answer) = (&self.model.fine.network, &self.answer);
        let names = || network.sensor_names.iter().cloned();
        let streams = answer.state.streams.iter().zip(&network.streams).map(|(state, stream)| {
            let own = ReducedChannelRecord {
                outlet_degC: celsius(answer.state.temperatures[stream.outlet() as usize]),
                flow_m3_s: state.flow,
                reynolds: state.reynolds,
                h_W_m2K: state.film,
                pressure_drop_Pa: state.pressure_drop,
            };
            (stream.name.clone(), own)
        });
        let bounds = |of: Measurand| {
            let all = names().zip(&network.measurands).zip(&answer.bounds).filter(|((_, own), _)| **own == of);
            all.map(|((name, _), bound)| (name, *bound)).collect()
        };
        let limit = |state: &LimitState| {
            let margin = |of: Measurand| (state.measurand == of).then(|| state.margin());
            let (kelvins, micrometres) = (margin(Measurand::Temperature), margin(Measurand::Displacement));
            ReducedLimitRecord { name: state.name.clone(), margin_K: kelvins, margin_um: micrometres, kept: state.margin() >= 0.0 }
        };
        SteadyRecord {
            sensors: names().zip(network.measurands.iter().zip(&answer.readings).map(|(own, t)| own.shown(*t))).collect(),
            bounds_K: bounds(Measurand::Temperature),
            bounds_um: bounds(Measurand::Displacement),
            coolant: streams.collect(),
            limits: limit_states(&self.model.machine, &answer.readings, self.condition.si()).iter().map(limit).collect(),
            in_range: answer.in_range,
            cells: self.model.made.cells,
            modes: self.model.coarse.len(),
            newton_iterations: answer.state.steps,
            field_error_K: self.model.field.as_ref().map(|field| field.largest_error),
            seconds: self.seconds,
        }
    }
}
