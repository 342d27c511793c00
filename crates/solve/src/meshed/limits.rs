//! The machine's limits, held against readings.

use coldplate_base::units::Measurand;
use coldplate_describe::machine::{LimitKind, Machine, Sensor};

/// A limit at one state.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitState {
    /// Name.
    pub name: String,
    /// Value: K for maxima (absolute), K for differences, um of displacements.
    pub value: f64,
    /// Largest value allowed, in the same scale.
    pub maximum: f64,
    /// Whether value and maximum are readings (absolute temperatures are shown in degC), and not differences of such.
    pub is_absolute: bool,
    /// Quantity that is limited.
    pub measurand: Measurand,
}

impl LimitState {
    /// A value of the limit as it is shown.
    pub fn shown(&self, value: f64) -> f64 {
        if self.is_absolute { self.measurand.shown(value) } else { value }
    }

    /// Unit of the limit's value as it is shown.
    pub fn unit(&self) -> &'static str {
        if self.is_absolute { self.measurand.unit() } else { self.measurand.unit_of_differences() }
    }

    /// Distance to the limit, K or um; negative where the limit is broken.
    pub fn margin(&self) -> f64 {
        self.maximum - self.value
    }
}

/// Every limit of `machine` at the sensors' `readings` (K or um) and the values of its variables (SI, in its order).
pub fn limit_states(machine: &Machine, readings: &[f64], variables: &[f64]) -> Vec<LimitState> {
    let state = |limit: &coldplate_describe::machine::MachineLimit| {
        let value = limit.kind.value(|sensor| readings[sensor], |variable| variables[variable]);
        let is_absolute = matches!(limit.kind, LimitKind::Maximum { .. });
        let of = limit.kind.points().next().and_then(|point| machine.sensors.get(point));
        let measurand = of.map_or(Measurand::Temperature, Sensor::measurand);
        LimitState { name: limit.name.clone(), value, maximum: measurand.of_si(limit.maximum), is_absolute, measurand }
    };
    machine.limits.iter().map(state).collect()
}
