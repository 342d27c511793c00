//! Sensors, limits and measured states.

use super::{CELSIUS, KELVIN, MICROMETRES, SECONDS, TRIPLE, flow::COORDINATES};
use crate::schema::{ChangeReach, Key, KeyTable, Unstated, ValueForm};

/// Share of the surroundings in the temperature that a sensor takes on.
pub(in crate::machine) const SURROUNDINGS_SHARE: Key = Key::new(
    "surroundings_share",
    ValueForm::Number,
    "share of the chamber's temperature in what it takes on, 0 to below 1: a sensor that is badly attached; the rest is that of its place",
)
.or(Unstated::Si(0.0))
.reaching(ChangeReach::Report);
/// First-order lag of a sensor behind the temperature of its place.
pub(in crate::machine) const LAG: Key = Key::new(
    "lag",
    ValueForm::Quantity(SECONDS),
    "what it shows follows the temperature of its place with this time constant; logs and schedules only",
)
.or(Unstated::Si(0.0))
.reaching(ChangeReach::Report)
.also(&["time_constant", "tau"]);
/// Offset of a sensor's reading.
pub(in crate::machine) const OFFSET: Key = Key::new("offset", ValueForm::Quantity(KELVIN), "it shows so much more")
    .or(Unstated::Si(0.0))
    .reaching(ChangeReach::Report)
    .also(&["bias"]);
/// Gain of a sensor.
pub(in crate::machine) const GAIN: Key = Key::new("gain", ValueForm::Number, "it shows 20 degC + gain (T - 20 degC) + offset")
    .positive()
    .or(Unstated::Si(1.0))
    .reaching(ChangeReach::Report);

/// `[sensor.NAME]`
pub(super) const SENSOR: KeyTable = KeyTable {
    doc: "a measurement point",
    keys: &[&[
        Key::new("point", TRIPLE, "`[x, y, z]` with `in`: the temperature there").also(&["at", "position"]),
        Key::new("in", ValueForm::Name("part"), "with `point`: the part it lies in"),
        COORDINATES,
        Key::new("face", ValueForm::Name("face"), "area mean over a face, `\"plate.+z\"`"),
        Key::new("part", ValueForm::Name("part"), "volume mean over a part"),
        Key::new("node", ValueForm::Name("node"), "temperature of a lumped node"),
        Key::new("inlet", ValueForm::Name("channel"), "water that enters a channel"),
        Key::new("outlet", ValueForm::Name("channel"), "water that leaves a channel"),
        SURROUNDINGS_SHARE,
        LAG,
        OFFSET,
        GAIN,
    ]],
    one_of: &["point", "face", "part", "node", "inlet", "outlet"],
};

/// `[heat_flow.NAME]`
pub(super) const HEAT_FLOW: KeyTable = KeyTable {
    doc: "a heat-flow sensor, in W",
    keys: &[&[
        Key::new("contact", ValueForm::Name("contact"), "heat through a contact, out of the first place of its `between`"),
        Key::new("out_of", ValueForm::Name("part, face or node"), "with `contact`: out of this one of its two places instead"),
        Key::new("boundary", ValueForm::Name("boundary"), "heat through a boundary, out of the machine"),
        Key::new("face", ValueForm::Name("face"), "all heat through a face, out of its part: `\"motor.-z\"`; not of a `mesh`"),
        Key::new("channel", ValueForm::Name("channel"), "heat from the part into the water of a channel"),
    ]],
    one_of: &["contact", "boundary", "face", "channel"],
};

const fn report(name: &'static str, form: ValueForm, doc: &'static str) -> Key {
    Key::new(name, form, doc).reaching(ChangeReach::Report)
}

/// A temperature or a displacement.
const LARGEST: ValueForm = ValueForm::Either(&[ValueForm::Quantity(CELSIUS), ValueForm::Quantity(MICROMETRES)]);
/// A difference of two temperatures or displacements.
const APART: ValueForm = ValueForm::Either(&[ValueForm::Quantity(KELVIN), ValueForm::Quantity(MICROMETRES)]);

/// `[limit.NAME]`
pub(super) const LIMIT: KeyTable = KeyTable {
    doc: "what is acceptable",
    keys: &[&[
        report("sensor", ValueForm::Name("sensor"), "with `maximum` or `rise`: the sensor"),
        report("maximum", LARGEST, "the sensor is not hotter: `\"45 degC\"`; a displacement not larger: `\"20 um\"`").also(&["max"]),
        report("magnitude", ValueForm::Quantity(MICROMETRES), "a displacement is in neither sense larger: `\"20 um\"`").positive(),
        report("rise", ValueForm::Quantity(KELVIN), "nor more than that above `ambient_temperature`: `\"5 K\"`"),
        report("between", ValueForm::List(&ValueForm::Name("sensor"), Some(2)), "with `difference`: two sensors, `[\"a\", \"b\"]`"),
        report("difference", APART, "the first minus the second is not larger"),
        report("sensors", ValueForm::List(&ValueForm::Name("sensor"), None), "with `spread`: two or more sensors"),
        report("spread", APART, "largest minus smallest is not larger").positive(),
    ]],
    one_of: &["maximum", "magnitude", "rise", "difference", "spread"],
};

/// `[measurement.NAME]`
pub(super) const MEASUREMENT: KeyTable = KeyTable {
    doc: "a measured state to print beside the prediction",
    keys: &[&[
        report("condition", ValueForm::Free(&ValueForm::AnyQuantity), "`{ coolant_flow = \"3.33e-5 m3/s\", ... }`"),
        report("readings", ValueForm::Free(&ValueForm::AnyQuantity), "`{ SENSOR = \"42.2 degC\" }`; of displacements `\"12 um\"`")
            .required(),
        report("others", ValueForm::Free(&ValueForm::AnyQuantity), "what another program predicted, `{ SENSOR = \"41.8 degC\" }`"),
        report("uncertainty", ValueForm::Quantity(KELVIN), "half the width of the interval that holds a true temperature with 95 %")
            .positive(),
        report("note", ValueForm::Text, "remarks on the readings"),
    ]],
    one_of: &[],
};
