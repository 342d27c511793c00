//! What tests and sensors cost, in whatever the user counts in: hours, euros.

use std::collections::BTreeMap;

use super::{ExtraSensor, Trial};

/// Costs of tests and of sensors that the data lack, in one unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Costs {
    /// What they are counted in, for readers; by default steady tests.
    pub unit: String,
    /// A steady test.
    pub steady: f64,
    /// A step of a condition, followed for two hours.
    pub step: f64,
    /// A heater that is fixed, and switched on for a while.
    pub heater_pulse: f64,
    /// A steady test with another pressure in the chamber.
    pub chamber_pressure: f64,
    /// A sensor of the machine file that the data lack.
    pub existing_sensor: f64,
    /// A sensor that does not exist yet.
    pub new_sensor: f64,
    /// Sensors whose cost is stated by name.
    pub sensors: BTreeMap<String, f64>,
}

impl Default for Costs {
    /// A heater has to be fixed and a chamber to be filled; a sensor that is there has to be read, a new one to be fitted.
    fn default() -> Self {
        Self {
            unit: "steady tests".into(),
            steady: 1.0,
            step: 1.0,
            heater_pulse: 2.0,
            chamber_pressure: 3.0,
            existing_sensor: 0.2,
            new_sensor: 1.0,
            sensors: BTreeMap::new(),
        }
    }
}

impl Costs {
    /// Of a test with a sensor beside those of the data.
    pub(super) fn of(&self, trial: &Trial, sensor: Option<&ExtraSensor>) -> f64 {
        let test = match trial {
            Trial::Steady => self.steady,
            Trial::Step { .. } => self.step,
            Trial::Heater { .. } => self.heater_pulse,
            Trial::Pressure(_) => self.chamber_pressure,
        };
        let usual = |s: &ExtraSensor| if s.entry.is_some() { self.new_sensor } else { self.existing_sensor };
        test + sensor.map_or(0.0, |s| self.sensors.get(&s.name).copied().unwrap_or_else(|| usual(s)))
    }
}
