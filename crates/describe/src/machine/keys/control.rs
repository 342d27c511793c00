//! Controllers.

use super::{CELSIUS, KELVIN, SECONDS};
use crate::schema::{ChangeReach, Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::units::Dimension;

/// Temperature that a controller wants of its sensor.
pub(in crate::machine) const SET_POINT: Key =
    Key::new("set_point", ValueForm::Formula(CELSIUS), "formula; the temperature that the sensor is to have")
        .required()
        .reaching(ChangeReach::Load)
        .also(&["setpoint", "target"]);
/// Whether the controlled sources warm or cool.
pub(in crate::machine) const ACTION: Key = Key::new(
    "action",
    ValueForm::Word(&["heat", "cool"]),
    "`\"heat\"`: more power below the set point; `\"cool\"`: more above it, for sources of negative power",
)
.or(Unstated::Text("heat"));
/// Width of a thermostat's band.
pub(in crate::machine) const HYSTERESIS: Key = Key::new(
    "hysteresis",
    ValueForm::Quantity(KELVIN),
    "a thermostat: width of its band, half below the set point and half above; it switches at both ends",
)
.positive();
/// Gain of a PI controller.
pub(in crate::machine) const GAIN: Key = Key::new(
    "gain",
    ValueForm::Quantity(Unit::of(Dimension::PER_KELVIN, "1/K")),
    "a PI controller, with `integral_time`: share of the full power for each kelvin, `\"20 %/K\"`",
)
.positive();
/// Integral time of a PI controller.
pub(in crate::machine) const INTEGRAL_TIME: Key = Key::new(
    "integral_time",
    ValueForm::Quantity(SECONDS),
    "with `gain`: time in which a steady deviation adds the gain's share once more",
)
.positive();

/// `[controller.NAME]`
pub(super) const CONTROLLER: KeyTable = KeyTable {
    doc: "a controller, from 0 to 1: share of the power of the sources that name it",
    keys: &[&[
        Key::new("sensor", ValueForm::Name("sensor"), "the sensor that it reads: a temperature, without `lag`, `gain` and `offset`")
            .required(),
        SET_POINT,
        ACTION,
        HYSTERESIS,
        GAIN,
        INTEGRAL_TIME,
    ]],
    one_of: &["hysteresis", "gain"],
};
