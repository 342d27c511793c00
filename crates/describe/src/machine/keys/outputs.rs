//! Sensors, limits and measured states.

use super::{CELSIUS, KELVIN, MICROMETRES, SECONDS, TRIPLE, flow::COORDINATES};
use crate::schema::{Form, Key, Reach, Table, Unstated};

/// First-order lag of a sensor behind the temperature of its place.
pub(in crate::machine) const LAG: Key = Key::new(
    "lag",
    Form::Quantity(SECONDS),
    "what it shows follows the temperature of its place with this time constant; logs and schedules only",
)
.or(Unstated::Si(0.0))
.reaching(Reach::Report)
.also(&["time_constant", "tau"]);
/// Offset of a sensor's reading.
pub(in crate::machine) const OFFSET: Key =
    Key::new("offset", Form::Quantity(KELVIN), "it shows so much more").or(Unstated::Si(0.0)).reaching(Reach::Report).also(&["bias"]);
/// Gain of a sensor.
pub(in crate::machine) const GAIN: Key = Key::new("gain", Form::Number, "it shows 20 degC + gain (T - 20 degC) + offset")
    .positive()
    .or(Unstated::Si(1.0))
    .reaching(Reach::Report);

/// `[sensor.NAME]`
pub(super) const SENSOR: Table = Table {
    doc: "a measurement point",
    keys: &[&[
        Key::new("point", TRIPLE, "`[x, y, z]` with `in`: the temperature there").also(&["at", "position"]),
        Key::new("in", Form::Name("part"), "with `point`: the part it lies in"),
        COORDINATES,
        Key::new("face", Form::Name("face"), "area mean over a face, `\"plate.+z\"`"),
        Key::new("part", Form::Name("part"), "volume mean over a part"),
        Key::new("node", Form::Name("node"), "temperature of a lumped node"),
        Key::new("inlet", Form::Name("channel"), "water that enters a channel"),
        Key::new("outlet", Form::Name("channel"), "water that leaves a channel"),
        LAG,
        OFFSET,
        GAIN,
    ]],
    one_of: &["point", "face", "part", "node", "inlet", "outlet"],
};

/// `[heat_flow.NAME]`
pub(super) const HEAT_FLOW: Table = Table {
    doc: "a heat-flow sensor, in W",
    keys: &[&[
        Key::new("contact", Form::Name("contact"), "heat through a contact, out of the first place of its `between`"),
        Key::new("out_of", Form::Name("part, face or node"), "with `contact`: out of this one of its two places instead"),
        Key::new("boundary", Form::Name("boundary"), "heat through a boundary, out of the machine"),
        Key::new("face", Form::Name("face"), "all heat through a face, out of its part: `\"motor.-z\"`; not of a `mesh`"),
        Key::new("channel", Form::Name("channel"), "heat from the part into the water of a channel"),
    ]],
    one_of: &["contact", "boundary", "face", "channel"],
};

const fn report(name: &'static str, form: Form, doc: &'static str) -> Key {
    Key::new(name, form, doc).reaching(Reach::Report)
}

/// A temperature or a displacement.
const LARGEST: Form = Form::Either(&[Form::Quantity(CELSIUS), Form::Quantity(MICROMETRES)]);
/// A difference of two temperatures or displacements.
const APART: Form = Form::Either(&[Form::Quantity(KELVIN), Form::Quantity(MICROMETRES)]);

/// `[limit.NAME]`
pub(super) const LIMIT: Table = Table {
    doc: "what is acceptable",
    keys: &[&[
        report("sensor", Form::Name("sensor"), "with `maximum` or `rise`: the sensor"),
        report("maximum", LARGEST, "the sensor is not hotter: `\"45 degC\"`; a displacement not larger: `\"20 um\"`").also(&["max"]),
        report("magnitude", Form::Quantity(MICROMETRES), "a displacement is in neither sense larger: `\"20 um\"`").positive(),
        report("rise", Form::Quantity(KELVIN), "nor more than that above `ambient_temperature`: `\"5 K\"`"),
        report("between", Form::List(&Form::Name("sensor"), Some(2)), "with `difference`: two sensors, `[\"a\", \"b\"]`"),
        report("difference", APART, "the first minus the second is not larger"),
        report("sensors", Form::List(&Form::Name("sensor"), None), "with `spread`: two or more sensors"),
        report("spread", APART, "largest minus smallest is not larger").positive(),
    ]],
    one_of: &["maximum", "magnitude", "rise", "difference", "spread"],
};

/// `[measurement.NAME]`
pub(super) const MEASUREMENT: Table = Table {
    doc: "a measured state to print beside the prediction",
    keys: &[&[
        report("condition", Form::Free(&Form::AnyQuantity), "`{ coolant_flow = \"3.33e-5 m3/s\", ... }`"),
        report("readings", Form::Free(&Form::AnyQuantity), "`{ SENSOR = \"42.2 degC\" }`; of displacements `\"12 um\"`").required(),
        report("others", Form::Free(&Form::AnyQuantity), "what another program predicted, `{ SENSOR = \"41.8 degC\" }`"),
        report("uncertainty", Form::Quantity(KELVIN), "half the width of the interval that holds a true temperature with 95 %").positive(),
        report("note", Form::Text, "remarks on the readings"),
    ]],
    one_of: &[],
};
