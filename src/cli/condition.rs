//! The condition variables as command-line options.

use coldplate_base::condition;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::{Condition, Machine};

/// A condition; every value carries its unit, for example `--motor-speed "2500 rpm"`.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Condition")]
pub struct ConditionArgs {
    /// Coolant flow, for example "9.42 L/min"
    #[arg(long, value_name = "FLOW", allow_hyphen_values = true)]
    pub coolant_flow: Option<String>,
    /// Coolant temperature at the inlet, for example "20.5 degC"
    #[arg(long, value_name = "TEMPERATURE", allow_hyphen_values = true)]
    pub coolant_temperature: Option<String>,
    /// Motor speed, for example "2500 rpm"
    #[arg(long, value_name = "SPEED", allow_hyphen_values = true)]
    pub motor_speed: Option<String>,
    /// Temperature of the chamber, for example "23.5 degC"
    #[arg(long, value_name = "TEMPERATURE", allow_hyphen_values = true)]
    pub ambient_temperature: Option<String>,
    /// Any further variable of the machine, NAME=VALUE
    #[arg(long = "at", value_name = "NAME=VALUE")]
    pub at: Vec<String>,
}

impl ConditionArgs {
    /// The given values as (name, text).
    ///
    /// # Errors
    /// An `--at` without `=`.
    pub fn values(&self) -> Result<Vec<(String, String)>> {
        let four = [&self.coolant_flow, &self.coolant_temperature, &self.motor_speed, &self.ambient_temperature];
        let given = |(name, value): (&str, &Option<String>)| value.clone().map(|value| (name.to_string(), value));
        let mut values: Vec<(String, String)> = condition::NAMES.into_iter().zip(four).filter_map(given).collect();
        for pair in &self.at {
            values.push(pair_of(pair, "--at")?);
        }
        Ok(values)
    }

    /// The condition for `machine`; variables that are not given take the machine's defaults.
    ///
    /// # Errors
    /// A value without its unit, an unknown variable, or one without a value and without a default.
    pub fn condition(&self, machine: &Machine) -> Result<Condition> {
        let values = self.values()?;
        let pairs: Vec<(&str, &str)> = values.iter().map(|(n, v)| (n.as_str(), v.as_str())).collect();
        machine.condition(&pairs)
    }
}

/// Splits `NAME=VALUE`.
///
/// # Errors
/// There is no `=`.
pub fn pair_of(text: &str, option: &str) -> Result<(String, String)> {
    text.split_once('=')
        .map(|(n, v)| (n.trim().to_string(), v.trim().to_string()))
        .ok_or_else(|| Error::input("a name and a value are needed").at_key(option).read(text).help(format!("write {option} NAME=VALUE")))
}
