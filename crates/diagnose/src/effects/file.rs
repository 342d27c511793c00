//! Lines of the machine file that an effect is written as.

use super::law::{Law, nine_digits};
use super::scales::Scales;
use super::{Hypothesis, UserKind};
use coldplate_base::condition::AMBIENT_TEMPERATURE;
use coldplate_base::document::Leaf;
use coldplate_base::error::Result;
use coldplate_base::units::ZERO_CELSIUS;
use coldplate_describe::machine::Machine;
use coldplate_network::Network;
use coldplate_solve::study::Study;

/// Name of what an extended machine file adds.
const ADDED: &str = "diagnosed";
/// Least conductance, film or area that is written: the file wants them positive.
pub const LEAST: f64 = 1e-9;

/// Lines of the machine file, (key, TOML value); `None` where it has no words for an effect.
pub type Lines = Option<Vec<(String, String)>>;

/// An effect that is to be written into a machine file.
pub(crate) struct MachineEdit<'a> {
    /// The machine as its file has it.
    pub study: &'a Study,
    /// Where laws are one.
    pub scales: &'a Scales,
    /// The user's kinds.
    pub user: &'a [UserKind],
    /// What is written.
    pub hypothesis: &'a Hypothesis,
    /// Its amplitude.
    pub amplitude: f64,
}

impl MachineEdit<'_> {
    /// The machine.
    pub fn machine(&self) -> &Machine {
        &self.study.model.machine
    }

    /// Its network.
    pub fn network(&self) -> &Network {
        &self.study.model.network
    }

    /// The amplitude of what cannot be less than nothing.
    pub fn positive(&self) -> f64 {
        self.amplitude.max(LEAST)
    }

    /// Name of a part or lumped node.
    pub fn group(&self, g: u32) -> &str {
        &self.network().groups[g as usize]
    }

    /// Whether the law is none.
    pub fn is_constant(&self) -> bool {
        self.hypothesis.law == Law::Constant
    }

    /// The law as an expression of formulas.
    pub fn law(&self) -> String {
        self.scales.expression(self.hypothesis.law)
    }

    /// How it follows the condition, as an expression of formulas; `None` where it is always alike.
    pub fn when(&self) -> Option<String> {
        self.hypothesis.law.is_formula().then(|| self.law())
    }

    /// Key of a table that is added: `source."diagnosed heat source gear"`.
    pub fn added(&self, table: &str) -> String {
        format!("{table}.\"{ADDED} {} {}\"", self.hypothesis.kind(), self.hypothesis.place.replace('"', ""))
    }

    /// Name of a thing that is added.
    pub(crate) fn added_name(&self, what: &str) -> String {
        format!("{ADDED} {what}")
    }

    /// A number of the file times a factor.
    ///
    /// # Errors
    /// There is no such number.
    pub fn scaled(&self, key: &str, factor: f64) -> Result<Lines> {
        let parameter = self.study.parameter(key)?;
        Ok(parameter.to_set(parameter.value * factor, self.machine())?.map(|set| vec![set]))
    }

    /// A number of the file and a difference.
    ///
    /// # Errors
    /// There is no such number.
    pub fn shifted(&self, key: &str, by: f64) -> Result<Lines> {
        let parameter = self.study.parameter(key)?;
        Ok(parameter.to_set(parameter.value + by, self.machine())?.map(|set| vec![set]))
    }

    /// The temperature of the surroundings as the file has it: that of the chamber, in air as in vacuum, for the model knows no other.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn surroundings(&self) -> Result<String> {
        let own = self.study.document().leaf("chamber.temperature")?;
        Ok(own.map_or_else(|| text(AMBIENT_TEMPERATURE), |leaf| leaf.to_toml()))
    }
}

/// A text as TOML.
pub fn text(t: impl Into<String>) -> String {
    Leaf::Text(t.into()).to_toml()
}

/// A contact of a conductance (W/K) between two places, which need not touch, as TOML; times a factor that is a formula.
pub fn conductor(ends: [&str; 2], conductance: f64, factor: Option<String>) -> String {
    let [a, b] = ends.map(text);
    let factor = factor.map_or(String::new(), |factor| format!(", factor = {}", text(factor)));
    format!("{{ between = [{a}, {b}], conductance = \"{:?} W/(m2 K)\", area = \"0.01 m2\"{factor} }}", 100.0 * conductance)
}

/// A contact's table of conductance, W/(m² K), against its mean temperature, K: rows from -50 to 200 degC as TOML.
pub fn temperature_table(conductance: impl Fn(f64) -> f64) -> String {
    let row =
        |celsius: i32| format!("[\"{celsius} degC\", \"{:?} W/(m2 K)\"]", nine_digits(conductance(f64::from(celsius) + ZERO_CELSIUS)));
    let rows: Vec<String> = (-10..=40).map(|i| row(5 * i)).collect();
    format!("temperature_table = [{}]", rows.join(", "))
}
