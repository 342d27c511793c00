//! Uncertainties of the machine file apart from the uncertain numbers themselves.

use super::KELVIN;
use crate::schema::{ChangeReach, Key, KeyTable, Unstated, ValueForm};

/// Kinds of numbers that may share a factor.
pub(in crate::machine) const KINDS: [&str; 4] = ["films", "heats", "emissivities", "contacts"];
/// Model error at each sensor alone.
pub(in crate::machine) const SENSORS: Key =
    Key::new("sensors", ValueForm::Quantity(KELVIN), "standard deviation of what the model misses at each sensor alone")
        .or(Unstated::Si(0.05))
        .reaching(ChangeReach::Report);
/// Model error common to all sensors.
pub(in crate::machine) const COMMON: Key = Key::new("common", ValueForm::Quantity(KELVIN), "the same, at all sensors together")
    .or(Unstated::Si(0.0))
    .reaching(ChangeReach::Report);
/// Growth of the model error away from the measured conditions.
pub(in crate::machine) const GROWTH: Key = Key::new(
    "growth",
    ValueForm::Number,
    "share of it that is added per half of a variable's range away from the mean of the measured conditions",
)
.or(Unstated::Si(1.0))
.reaching(ChangeReach::Report);

const fn report(name: &'static str, form: ValueForm, doc: &'static str) -> Key {
    Key::new(name, form, doc).reaching(ChangeReach::Report)
}

/// `[uncertain.NAME]`
pub(super) const FACTOR: KeyTable = KeyTable {
    doc: "a factor of about one on several numbers at once, or a common offset of several temperatures",
    keys: &[&[
        report("all", ValueForm::Word(&KINDS), "the numbers: all of a kind"),
        report("numbers", ValueForm::List(&ValueForm::Text, None), "or those under these keys: `[\"contact.foot.conductance\", ...]`"),
        report("deviation", ValueForm::Number, "standard deviation of the factor: `\"7 %\"`"),
        report("limits", ValueForm::Number, "or half the width of a range whose values are all alike: `\"12 %\"`"),
        report("offset", ValueForm::Quantity(KELVIN), "of temperatures: standard deviation of what they all are off by, `\"0.2 K\"`"),
        report("source", ValueForm::Text, "where that is from"),
    ]],
    one_of: &["all", "numbers"],
};

/// `[[correlation]]`
pub(super) const CORRELATION: KeyTable = KeyTable {
    doc: "two uncertain numbers that deviate together",
    keys: &[&[
        report("between", ValueForm::List(&ValueForm::Text, Some(2)), "keys of two uncertain numbers, or names of factors").required(),
        report("value", ValueForm::Number, "from -1 to 1").required(),
    ]],
    one_of: &[],
};

/// `[model_error]`
pub(super) const MODEL_ERROR: KeyTable = KeyTable {
    doc: "what the model misses; `identify` and `diagnose` write what they learnt of it",
    keys: &[&[
        SENSORS,
        report(
            "sensor",
            ValueForm::Free(&ValueForm::AnyQuantity),
            "sensors with a deviation of their own: `{ SENSOR = \"0.4 K\" }`; of displacements, which have none else, `\"2 um\"`",
        ),
        COMMON,
        GROWTH,
        report(
            "measured",
            ValueForm::List(&ValueForm::Free(&ValueForm::AnyQuantity), None),
            "conditions at which it was compared with measurements: `[{ coolant_flow = \"8 L/min\", ... }]`",
        ),
    ]],
    one_of: &[],
};
