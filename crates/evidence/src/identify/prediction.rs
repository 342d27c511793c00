//! Predictions, and the parameters that are a sensor's own.

use crate::measurement::Data;
use coldplate_base::document::Document;
use coldplate_describe::machine::SensorResponse;
use coldplate_solve::study::MachineParameter;

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

/// The sensor (a column of the data) whose own lag, gain or offset a parameter is, and which of the three.
pub fn own_key(parameter: &MachineParameter, data: &Data) -> Option<(usize, String)> {
    match Document::names_in(&parameter.name)?.as_slice() {
        [table, name, key] if table == "sensor" && SensorResponse::slope(key, 0.0).is_some() => {
            Some((data.names.iter().position(|n| n == name)?, key.clone()))
        }
        _ => None,
    }
}
