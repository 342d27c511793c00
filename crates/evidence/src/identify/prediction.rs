//! Predictions, and the parameters that are a sensor's own.

use crate::measurement::Data;
use coldplate_base::document::Document;
use coldplate_base::error::Result;
use coldplate_describe::machine::{Condition, Machine, SensorResponse};
use coldplate_solve::study::{MachineParameter, Study};

/// Predictions of all readings of a data set (rows, then sensors, missing ones left out).
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Predicted readings, K.
    pub values: Vec<f64>,
    /// Derivatives with respect to the parameters asked for, K per SI unit.
    pub slopes: Vec<Vec<f64>>,
    /// Derivatives with respect to every condition variable, K per SI unit.
    pub conditions: Vec<Vec<f64>>,
}

/// Derivative of the temperature of the surroundings with respect to a parameter at a condition, K per SI unit; 0 where no sensor of the
/// machine takes any of it on.
///
/// # Errors
/// The machine is not valid beside the parameter's value.
pub fn surroundings_slope(study: &Study, parameter: &MachineParameter, condition: &Condition) -> Result<f64> {
    let machine = &study.model.machine;
    if machine.sensors.iter().all(|sensor| sensor.shows.surroundings == 0.0) {
        return Ok(0.0);
    }
    let variable = machine.variables.iter().position(|v| v.name == parameter.name);
    let value = variable.map_or(parameter.value, |v| condition.si()[v]);
    let step = parameter.step(value);
    let at = |value: f64| -> Result<f64> {
        if let Some(v) = variable {
            let mut values = condition.si().to_vec();
            values[v] = value;
            return machine.surroundings(&Condition::from_si(values));
        }
        let mut document = study.document().clone();
        if let Some((key, value)) = parameter.to_set(value, machine)? {
            document.apply_set(&key, &value)?;
        }
        Machine::from_document(&document)?.surroundings(condition)
    };
    // At the end of the valid range, such as an emissivity of one, the step goes to one side.
    Ok(match (at(value + step), at(value - step)) {
        (Ok(more), Ok(less)) => (more - less) / (2.0 * step),
        (Ok(more), Err(_)) => (more - machine.surroundings(condition)?) / step,
        (Err(_), less) => (machine.surroundings(condition)? - less?) / step,
    })
}

/// The sensor (a column of the data) whose own number a parameter is, and its key.
pub fn own_key(parameter: &MachineParameter, data: &Data) -> Option<(usize, String)> {
    match Document::names_in(&parameter.name)?.as_slice() {
        [table, name, key] if table == "sensor" && SensorResponse::has_key(key) => {
            Some((data.names.iter().position(|n| n == name)?, key.clone()))
        }
        _ => None,
    }
}
