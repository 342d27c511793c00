//! The variables that every machine has, in the order of conditions, tables and options.

use crate::units::Dimension;

/// Volume flow of the coolant.
pub const COOLANT_FLOW: &str = "coolant_flow";
/// Temperature of the coolant at the inlet.
pub const COOLANT_TEMPERATURE: &str = "coolant_temperature";
/// Speed of the motor.
pub const MOTOR_SPEED: &str = "motor_speed";
/// Temperature of the chamber around the machine.
pub const AMBIENT_TEMPERATURE: &str = "ambient_temperature";

/// Names of the four variables.
pub const NAMES: [&str; 4] = [COOLANT_FLOW, COOLANT_TEMPERATURE, MOTOR_SPEED, AMBIENT_TEMPERATURE];

/// The four variables with their units.
pub const VARIABLES: [ConditionVariable; 4] = [
    ConditionVariable { name: COOLANT_FLOW, unit: "L/min", si_unit: "m3/s", dimension: Dimension::VOLUME_FLOW },
    ConditionVariable { name: COOLANT_TEMPERATURE, unit: "degC", si_unit: "K", dimension: Dimension::TEMPERATURE },
    ConditionVariable { name: MOTOR_SPEED, unit: "rpm", si_unit: "rad/s", dimension: Dimension::ANGULAR_SPEED },
    ConditionVariable { name: AMBIENT_TEMPERATURE, unit: "degC", si_unit: "K", dimension: Dimension::TEMPERATURE },
];

/// A variable that every machine has.
#[derive(Debug, Clone, Copy)]
pub struct ConditionVariable {
    /// Name.
    pub name: &'static str,
    /// Unit in which values are shown unless a file states another.
    pub unit: &'static str,
    /// SI unit, which formulas may use too.
    pub si_unit: &'static str,
    /// Dimension of both units.
    pub dimension: Dimension,
}
