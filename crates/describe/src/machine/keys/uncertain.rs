//! Uncertainties of the machine file apart from the uncertain numbers themselves.

use super::KELVIN;
use crate::schema::{Form, Key, Reach, Table, Unstated};

/// Kinds of numbers that may share a factor.
pub(in crate::machine) const KINDS: [&str; 4] = ["films", "heats", "emissivities", "contacts"];
/// Model error at each sensor alone.
pub(in crate::machine) const SENSORS: Key =
    Key::new("sensors", Form::Quantity(KELVIN), "standard deviation of what the model misses at each sensor alone")
        .or(Unstated::Si(0.05))
        .reaching(Reach::Report);
/// Model error common to all sensors.
pub(in crate::machine) const COMMON: Key =
    Key::new("common", Form::Quantity(KELVIN), "the same, at all sensors together").or(Unstated::Si(0.0)).reaching(Reach::Report);
/// Growth of the model error away from the measured conditions.
pub(in crate::machine) const GROWTH: Key = Key::new(
    "growth",
    Form::Number,
    "share of it that is added per half of a variable's range away from the mean of the measured conditions",
)
.or(Unstated::Si(1.0))
.reaching(Reach::Report);

const fn report(name: &'static str, form: Form, doc: &'static str) -> Key {
    Key::new(name, form, doc).reaching(Reach::Report)
}

/// `[uncertain.NAME]`
pub(super) const FACTOR: Table = Table {
    doc: "a factor of about one on several numbers at once, or a common offset of several temperatures",
    keys: &[&[
        report("all", Form::Word(&KINDS), "the numbers: all of a kind"),
        report("numbers", Form::List(&Form::Text, None), "or those under these keys: `[\"contact.foot.conductance\", ...]`"),
        report("deviation", Form::Number, "standard deviation of the factor: `\"7 %\"`"),
        report("limits", Form::Number, "or half the width of a range whose values are all alike: `\"12 %\"`"),
        report("offset", Form::Quantity(KELVIN), "of temperatures: standard deviation of what they all are off by, `\"0.2 K\"`"),
        report("source", Form::Text, "where that is from"),
    ]],
    one_of: &["all", "numbers"],
};

/// `[[correlation]]`
pub(super) const CORRELATION: Table = Table {
    doc: "two uncertain numbers that deviate together",
    keys: &[&[
        report("between", Form::List(&Form::Text, Some(2)), "keys of two uncertain numbers, or names of factors").required(),
        report("value", Form::Number, "from -1 to 1").required(),
    ]],
    one_of: &[],
};

/// `[model_error]`
pub(super) const MODEL_ERROR: Table = Table {
    doc: "what the model misses; `identify` and `diagnose` write what they learnt of it",
    keys: &[&[
        SENSORS,
        report(
            "sensor",
            Form::Free(&Form::AnyQuantity),
            "sensors with a deviation of their own: `{ SENSOR = \"0.4 K\" }`; of displacements, which have none else, `\"2 um\"`",
        ),
        COMMON,
        GROWTH,
        report(
            "measured",
            Form::List(&Form::Free(&Form::AnyQuantity), None),
            "conditions at which it was compared with measurements: `[{ coolant_flow = \"8 L/min\", ... }]`",
        ),
    ]],
    one_of: &[],
};
