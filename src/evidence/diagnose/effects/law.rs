//! How an effect depends on the condition.

use crate::describe::machine::{Condition, Machine};
use crate::evidence::measurement::Data;

/// How an effect depends on the condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Law {
    /// Not at all.
    Constant,
    /// In proportion to the motor speed.
    Speed,
    /// With the square of the motor speed.
    SpeedSquared,
    /// In proportion to one over the coolant flow.
    InverseFlow,
    /// In proportion to the temperature above 20 degC.
    Temperature,
}

impl Law {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Speed => "in proportion to the motor speed",
            Self::SpeedSquared => "with the square of the motor speed",
            Self::InverseFlow => "in proportion to one over the coolant flow",
            Self::Temperature => "in proportion to the temperature",
        }
    }
}

/// Where laws are one: largest motor speed and median coolant flow of the data, SI.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scales {
    /// rad/s
    pub speed: f64,
    /// m³/s
    pub flow: f64,
    speed_at: Option<usize>,
    flow_at: Option<usize>,
}

impl Scales {
    /// Of a data set.
    pub fn of(data: &Data, machine: &Machine) -> Self {
        let at = |name: &str| machine.variables.iter().position(|v| v.name == name);
        let (speed_at, flow_at) = (at("motor_speed"), at("coolant_flow"));
        let values = |v: Option<usize>| v.map_or(Vec::new(), |v| data.rows.iter().map(|r| r.condition.si()[v]).collect::<Vec<f64>>());
        let speed = values(speed_at).into_iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut flows = values(flow_at);
        flows.sort_by(f64::total_cmp);
        let flow = flows.get(flows.len() / 2).copied().unwrap_or(0.0);
        Self { speed, flow, speed_at, flow_at }
    }

    /// Factor of a law at a condition; `None` where the law needs a temperature.
    pub fn factor(&self, law: Law, condition: &Condition) -> f64 {
        let speed = self.speed_at.map_or(0.0, |v| condition.si()[v]) / if self.speed > 0.0 { self.speed } else { 1.0 };
        match law {
            Law::Constant | Law::Temperature => 1.0,
            Law::Speed => speed,
            Law::SpeedSquared => speed * speed,
            Law::InverseFlow => {
                let flow = self.flow_at.map_or(0.0, |v| condition.si()[v]);
                if flow > 0.0 { self.flow / flow } else { 0.0 }
            }
        }
    }

    /// The law as an expression of a machine file's formulas.
    pub fn expression(&self, law: Law) -> String {
        let rpm = nine_digits(self.speed * 60.0 / std::f64::consts::TAU);
        match law {
            Law::Constant | Law::Temperature => "1".into(),
            Law::Speed => format!("motor_speed_rpm / {rpm:?}"),
            Law::SpeedSquared => format!("(motor_speed_rpm / {rpm:?})^2"),
            Law::InverseFlow => format!("{:?} / coolant_flow_L_min", nine_digits(self.flow * 60_000.0)),
        }
    }
}

/// A number as a person would write it.
pub fn nine_digits(v: f64) -> f64 {
    format!("{v:.8e}").parse().unwrap_or(v)
}
