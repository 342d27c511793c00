//! The machine's limits, held against readings.

use crate::describe::machine::{LimitKind, Machine};

/// A limit at one state.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitState {
    /// Name.
    pub name: String,
    /// Value: K for maxima (absolute), K for differences.
    pub value: f64,
    /// Largest value allowed, in the same scale.
    pub maximum: f64,
    /// Whether value and maximum are absolute temperatures (shown in degC).
    pub is_absolute: bool,
}

impl LimitState {
    /// What is left, K; negative where the limit is broken.
    pub fn margin(&self) -> f64 {
        self.maximum - self.value
    }
}

/// Every limit of `machine` at the sensors' `readings` (K) and the values of its variables (SI, in its order).
pub fn limit_states(machine: &Machine, readings: &[f64], variables: &[f64]) -> Vec<LimitState> {
    let state = |limit: &crate::describe::machine::Limit| {
        let value = limit.kind.value(|sensor| readings[sensor], |variable| variables[variable]);
        let is_absolute = matches!(limit.kind, LimitKind::Maximum { .. });
        LimitState { name: limit.name.clone(), value, maximum: limit.maximum, is_absolute }
    };
    machine.limits.iter().map(state).collect()
}
