//! Controllers: the share of a source's power that follows a sensor.

use super::keys::control::{ACTION, GAIN, HYSTERESIS, INTEGRAL_TIME, SET_POINT};
use super::names::lookup;
use super::readings::{Sensor, SensorReading};
use super::response::SensorResponse;
use super::sources::Source;
use super::symbols::Symbols;
use super::variables::formula;
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::formula::Formula;
use coldplate_base::units::Dimension;

/// A controller. Every source that names it gives a share of its power, from 0 to 1.
#[derive(Debug, Clone)]
pub struct Controller {
    /// Name.
    pub name: String,
    /// The sensor that it reads: index into the machine's.
    pub sensor: usize,
    /// Temperature that the sensor is to have, K.
    pub set_point: Formula,
    /// Whether the share grows when the sensor is too warm.
    pub cools: bool,
    /// How the share follows the sensor.
    pub law: ControlLaw,
}

/// How the share of a controller follows the deviation of its sensor: e = set point - reading, K; the sign is turned where it cools.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ControlLaw {
    /// On from e = hysteresis/2 until e = -hysteresis/2, then off.
    Thermostat {
        /// Width of the band, K.
        hysteresis: f64,
    },
    /// gain (e + integral of e over time / `integral_time`), at least 0 and at most 1; the integral stands still at a limit.
    ProportionalIntegral {
        /// Share for each kelvin, 1/K.
        gain: f64,
        /// Integral time, s.
        integral_time: f64,
    },
}

/// Reads `[controller.NAME]`.
pub(super) fn controllers(root: &Section<'_>, sensors: &[Sensor], sources: &[Source], symbols: &Symbols) -> Result<Vec<Controller>> {
    let tables = root.sections("controller")?.into_iter().enumerate();
    tables.map(|(own, (name, section))| controller((own, name), section, sensors, sources, symbols)).collect()
}

fn controller(
    (own, name): (usize, String),
    section: Section<'_>,
    sensors: &[Sensor],
    sources: &[Source],
    symbols: &Symbols,
) -> Result<Controller> {
    let names: Vec<String> = sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let sensor = lookup(&section.value("sensor")?, &names, "sensor")?;
    let refused = |what: &str, help: &str| Err(section.error_at("sensor", what.to_string()).help(help));
    if matches!(sensors[sensor].reads, SensorReading::Displacement(_)) {
        return refused("a controller reads a temperature, and this is a displacement", "name a sensor of [sensor.NAME]");
    }
    if sensors[sensor].shows != SensorResponse::default() {
        let help = "name a second sensor at the same place, without 'lag', 'gain' and 'offset'";
        return refused("a controller reads the temperature of a place, and this sensor shows another", help);
    }
    let set_point = formula(&section.value(SET_POINT.name)?, Dimension::TEMPERATURE, symbols)?;
    let cools = ACTION.read_word(&section)? == 1;
    let law = match section.one_of(&[HYSTERESIS.name, GAIN.name])? {
        Some(key) if key == HYSTERESIS.name => {
            if section.has(INTEGRAL_TIME.name) {
                return Err(section
                    .error_at(INTEGRAL_TIME.name, "a thermostat has no integral time")
                    .help("leave it out, or give 'gain' in place of 'hysteresis'"));
            }
            ControlLaw::Thermostat { hysteresis: HYSTERESIS.read(&section)? }
        }
        Some(_) => ControlLaw::ProportionalIntegral { gain: GAIN.read(&section)?, integral_time: INTEGRAL_TIME.read(&section)? },
        None => {
            return Err(section
                .error("the controller states no law")
                .help("hysteresis = \"1 K\" for a thermostat; gain = \"20 %/K\" and integral_time = \"300 s\" for a PI controller"));
        }
    };
    if !sources.iter().any(|source| source.controller == Some(own)) {
        return Err(section.error("no source follows this controller").help(format!("write controller = \"{name}\" in a [source.NAME]")));
    }
    section.finish()?;
    Ok(Controller { name, sensor, set_point, cools, law })
}
